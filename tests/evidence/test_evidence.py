"""The theory of evidence: distributions by scipy.stats, minima by scipy.optimize, null spaces by numpy."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import comb
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import scipy.optimize
import scipy.stats

from algorithms.evidence import (
    WRONG,
    Freedom,
    Noise,
    Problem,
    Status,
    all_or_some_sets,
    by_chance,
    consensus,
    differ,
    explained_by_chance,
    explains,
    gate_of,
    is_lost,
    largest_ratio,
    least_by_chance,
    likely,
    log_false_alarms,
    minima,
    polished,
    random_subsets,
    rank,
    surely_not_by_chance,
    undetermined,
)
from algorithms.evidence.gates import checked_gate
from algorithms.evidence.noise import tail_of
from algorithms.precision import HUGE
from algorithms.vision import VisionStatus
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]


@all_cases("n, freedom", [(1, 3), (2, 4), (6, 20), (200, 4), (3, np.inf)])
@all_cases("probability", [0.5, 1e-3, 1e-9])
def test_ratios_of_mean_squares(n: int, freedom: float, probability: float) -> None:
    known = (
        scipy.stats.chi2(n).isf(probability) / n if np.isinf(freedom) else scipy.stats.f(n, freedom).isf(probability)
    )
    assert largest_ratio(n, freedom, probability) == pytest.approx(known, rel=1e-6)


def test_residuals_only_raise_a_stated_variance() -> None:
    stated = Noise(2.0)
    assert stated.raised(np.array([1.0, 100.0]), 10).tolist() == [2.0, 10.0]
    known = Noise(2.0, 4.0)
    assert known.raised(np.array(0.0), 4) == 1.0 and known.raised(np.array(80.0), 4) == 11.0


def test_tails_are_those_of_students_distribution() -> None:
    """The weight of an error is half of that of small ones where its square is the degrees of freedom."""
    rng = np.random.default_rng(3)
    for freedom in (1.0, 2.0, 4.0):
        tails = [tail_of(9 * rng.standard_t(freedom, 2000) ** 2) / (9 * freedom) for _ in range(20)]
        assert 0.3 < np.median(tails) < 3
    assert all(tail_of(rng.normal(size=2000) ** 2) > 20 for _ in range(20))
    assert np.isinf(tail_of(rng.uniform(-1, 1, 300) ** 2)) and np.isinf(tail_of(np.zeros(9)))


def test_right_noise_is_contradicted_once_in_a_thousand_times() -> None:
    rng = np.random.default_rng(0)
    for noise, variance in ((Noise(4.0), np.full(200_000, 4.0)), (Noise(4.0, 6.0), 24.0 / rng.chisquare(6, 200_000))):
        cost = (variance[:, None] * rng.normal(size=(len(variance), 3)) ** 2).sum(1)
        assert noise.contradicted(cost, 3).mean() == pytest.approx(WRONG, rel=0.3)
    assert not Noise(1.0).contradicted(np.array(100.0), 0)


def test_the_farthest_of_many_is_outlying_once_in_a_thousand_times() -> None:
    rng = np.random.default_rng(1)
    squares = (rng.normal(size=(50_000, 20, 2)) ** 2).sum(-1)
    found = Noise(1.0).outlying(squares, 2, np.zeros((50_000, 1)), 0).any(1)
    assert found.mean() == pytest.approx(WRONG, rel=0.4)


def test_likely_minima() -> None:
    """The likelihood of 13.8 variances more is a thousandth; an estimated variance makes tails heavier."""
    limit = 2 * np.log(1 / WRONG)
    costs = np.array([5.0, 5 + limit - 0.01, 5 + limit + 0.01, np.inf])
    assert likely(costs, 8, 5, Noise(1.0)).tolist() == [True, True, False, False]
    student = scipy.stats.t(9 - 1)
    # With one residual in 9 numbers of which 8 are the prior, the likelihood is a density of Student's distribution.
    ratio = student.pdf(np.sqrt(costs[:3])) / student.pdf(np.sqrt(costs[0]))
    assert (likely(costs, 1, 1, Noise(1.0, 8.0))[:3] == (ratio > WRONG)).all()


def test_parameters_that_differ() -> None:
    information = np.diag([4.0, 25.0])
    bound = np.sqrt(scipy.stats.chi2(2).isf(WRONG))
    offsets = np.array([[0.99 * bound / 2, 0], [0, 1.01 * bound / 5]])
    assert differ(offsets, information, np.array(1.0)).tolist() == [False, True]


def test_undetermined_directions() -> None:
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(4, 6)) * [1, 1, 1, 1e5, 1e5, 1e5]
    information = rows.T @ rows
    free = undetermined(information)
    assert rank(information) == 4 and free.shape == (2, 6)
    assert np.abs(rows @ free.T).max() < 1e-6 * np.abs(rows).max()


def test_gates() -> None:
    assert gate_of(4) == pytest.approx(scipy.stats.chi2(4).isf(1e-3))
    assert is_lost(1, 3) and not is_lost(2, 3) and not is_lost(0, 1)


def test_false_alarms() -> None:
    """The bound is that of all samples of two items whose lines, five times as wide, contain the others by chance."""
    free = Freedom(sample_size=2, parameters=9, codimension=1, solutions=1, false_alarms=1.0)
    share, n, count = 0.05, 20, 9
    tail = scipy.stats.binom(n - 2, 3 * share).sf(count - 3)
    found = float(log_false_alarms(n, np.asarray(count), np.asarray(share), free))
    assert found == pytest.approx(np.log(comb(n, 2) * tail))


@pytest.mark.parametrize(("n", "count", "share"), [(1000, 100, 1e-15), (50, 50, 1e-9), (500, 300, 1e-3)])
def test_false_alarms_that_underflow(n: int, count: int, share: float) -> None:
    free = Freedom(sample_size=0, parameters=0, codimension=1, solutions=1, false_alarms=1.0)
    found = float(log_false_alarms(n, np.asarray(count), np.asarray(share), free))
    with mpmath.workdps(40):
        p = mpmath.mpf(share)
        tail = mpmath.fsum(comb(n, j) * p**j * (1 - p) ** (n - j) for j in range(count, n + 1))
        assert found == pytest.approx(float(mpmath.log(tail)), rel=1e-9)


def test_the_threshold_that_is_least_by_chance() -> None:
    rng = np.random.default_rng(3)
    distances = np.concatenate([rng.uniform(0, 0.01, 30), rng.uniform(0.05, 1, 70)])
    free = Freedom(sample_size=2, parameters=2, codimension=1, solutions=1, false_alarms=1.0)
    logarithm, threshold = least_by_chance(rng.permutation(distances), lambda r: np.minimum(r, 1), free)
    assert logarithm < -10 and 0.008 < threshold < 0.05
    assert least_by_chance(rng.uniform(0, 1, 100), lambda r: np.minimum(r, 1), free)[0] > 0


def test_nothing_is_no_evidence() -> None:
    """Without wrong pairs, or without points, nothing contradicts chance; wrong pairs that are far off do."""
    free = Freedom(sample_size=2, parameters=2, codimension=1, solutions=1, false_alarms=1.0)
    assert by_chance(np.ones(50), np.zeros(0), 1.0, free)
    assert not by_chance(np.ones(50), np.full(50, np.inf), 1.0, free)
    assert by_chance(np.full(50, 2.0), np.full(50, np.inf), 1.0, free)
    assert least_by_chance(np.zeros(0), lambda r: r, free) == (np.inf, 0)
    logarithms, thresholds = least_by_chance(np.zeros((3, 0)), lambda r: r, free)
    assert logarithms.tolist() == [np.inf] * 3 and thresholds.tolist() == [0] * 3


def test_few_wrong_pairs_bound_their_share() -> None:
    """Six of 20 items of a model with one parameter agree, and none of n wrong pairs.

    No more than a share p of these agrees with the confidence 1 - 1e-6, where (1 - p)^n = 1e-6. The bound on the number
    of false alarms, 2 * 20 * 2 times Chernoff's bound for 5 of 19, decides.
    """
    free = Freedom(sample_size=1, parameters=1, codimension=1, solutions=1, false_alarms=1.0)

    def bound(n: int) -> float:
        p = 1 - 1e-6 ** (1 / n)
        return float(80 * (19 * p / 5) ** 5 * (19 * (1 - p) / 14) ** 14)

    least = next(n for n in range(60, 1000) if bound(n) <= 1)
    for n in (least - 1, least):
        assert surely_not_by_chance(20, 6, np.full(n, 2.0), 1.0, free) == (n == least)
    assert not surely_not_by_chance(20, 6, np.full(least, 0.5), 1.0, free)


def test_subsets_are_equally_likely() -> None:
    with pytest.raises(ValueError, match="size: 5; expected at most the number of items, 3"):
        random_subsets(np.random.default_rng(4), 3, 5, 4)
    for n in (6, 9):  # permutations of few items, and independent draws of others
        sets = random_subsets(np.random.default_rng(4), n, 3, 60_000)
        assert sets.shape == (60_000, 3)
        codes, counts = np.unique(np.sort(sets, 1) @ [n * n, n, 1], return_counts=True)
        assert len(codes) == comb(n, 3) and np.abs(counts * comb(n, 3) / 60_000 - 1).max() < 0.15
    assert len(all_or_some_sets(6, 3, 20)) == 20 and len({*map(tuple, all_or_some_sets(9, 3, 30))}) <= 30


def away(models: Array, first: Array, _: Array) -> Array:
    """Distances of numbers, some of which are models."""
    return np.asarray(np.abs(models[:, None] - first))


def truncated(distances: Callable[[Array, Array, Array], Array]) -> Callable[[Array, Array, Array, float], Array]:
    """Return the function of sums of squared distances that are truncated at a threshold."""

    def costs(models: Array, first: Array, second: Array, threshold: float) -> Array:
        return np.asarray((distances(models, first, second).clip(max=threshold) ** 2).sum(-1))

    return costs


def test_consensus_finds_the_line_of_most_points() -> None:
    """Two lines with 40 and 30 points, and 30 points that are on none."""
    rng = np.random.default_rng(5)
    x = rng.uniform(-1, 1, 100)
    y = np.concatenate([2 * x[:40] + 1, -x[40:70], rng.uniform(-3, 3, 30)]) + rng.normal(0, 0.005, 100)

    def solve(sets: Array) -> Array:
        slope = (y[sets[:, 1]] - y[sets[:, 0]]) / (x[sets[:, 1]] - x[sets[:, 0]])
        return np.stack([slope, y[sets[:, 0]] - slope * x[sets[:, 0]]], -1)

    def distances(models: Array, first: Array, second: Array) -> Array:
        return np.asarray(np.abs(models[:, :1] * first + models[:, 1:] - second))

    def descend(models: Array, threshold: float, _: float) -> Array:
        near = distances(models, x, y) <= threshold
        return np.array([np.polyfit(x[inliers], y[inliers], 1) for inliers in near])

    free = Freedom(sample_size=2, parameters=2, codimension=1, solutions=1, false_alarms=1e-2)
    problem = Problem(x, y, free, solve, distances, truncated(distances), descend)
    found = consensus(problem, 0.02, 0, 0.999, 2000)
    assert found.reached and found.best is not None
    assert not explained_by_chance(problem, found.best.model, 0.02, np.random.default_rng(1))
    assert np.abs(found.best.model - [2, 1]).max() < 0.01 and found.best.inliers[:40].all()


def test_a_model_without_inliers_ends_no_sampling() -> None:
    """No mean of two powers of two is another power: all samples are drawn, and the best model has no inlier."""
    x = 2.0 ** np.arange(12)

    free = Freedom(sample_size=2, parameters=1, codimension=1, solutions=1, false_alarms=1e-2)
    problem = Problem(x, x, free, lambda sets: x[sets].mean(-1), away, truncated(away), lambda models, *_: models)
    found = consensus(problem, 1e-3, 0, 0.999, 500)
    assert found.best is not None and not found.best.inliers.any()
    assert found.n_samples == 500 and not found.reached


@all_cases("place, least", [(1.1, 22 / 70), (1.3, 0.0)])
def test_polishing_leaves_a_minimum_for_a_lower_one(place: float, least: float) -> None:
    """Ten numbers are 0 and four are elsewhere; the mean of all is within 1 of them, as that of the ten is of these."""
    x = np.where(np.arange(14) < 10, 0.0, place)

    def descend(models: Array, threshold: float, at_most: float) -> Array:
        for _ in range(int(at_most)):
            models = np.array([x[np.abs(x - m) < threshold].mean() for m in models])
        return models

    free = Freedom(sample_size=1, parameters=1, codimension=1, solutions=1, false_alarms=1e-2)
    costs = truncated(away)
    problem = Problem(x, x, free, lambda sets: x[sets[:, 0]], away, costs, descend)
    for start in (0.0, float(x.mean())):
        stuck = descend(np.array([start]), 1.0, 50)
        assert stuck == pytest.approx(start)
        model, cost = polished(problem, stuck[0], float(costs(stuck, x, x, 1.0)[0]), 1.0)
        assert model == pytest.approx(least) and cost == pytest.approx(costs(np.array([least]), x, x, 1.0)[0])


def test_minima_are_those_of_scipy() -> None:
    """Exponentials fitted from several starts: each reaches the minimum that scipy finds from there."""
    rng = np.random.default_rng(6)
    t = np.linspace(0, 3, 30)
    y = 2 * np.exp(-1.3 * t) + 0.5 + 0.01 * rng.normal(size=30)

    def residuals(p: Array) -> Array:
        return np.asarray(p[..., :1] * np.exp(-p[..., 1:2] * t) + p[..., 2:] - y)

    def equations(p: Array, which: Array) -> tuple[Array, Array]:
        decay = np.exp(-p[:, 1:2] * t)
        return residuals(p), np.stack([decay, -p[:, :1] * t * decay, np.ones((len(p), len(t)))], -1)

    starts = np.array([[1.0, 1.0, 0.0], [3.0, 0.5, 1.0], [1.0, 4.0, 0.0], [np.nan, 1.0, 0.0]])
    found = minima(starts, equations, lambda step, p, which: p + step, np.zeros(4), 100)
    assert found.converged.tolist() == [True, True, True, False] and np.isnan(found.cost[3])
    for start, state, cost in list(zip(starts, found.state, found.cost, strict=True))[:3]:
        known = scipy.optimize.least_squares(residuals, start, method="lm", xtol=1e-14, ftol=1e-14)
        assert np.abs(state - known.x).max() < 1e-4 and cost == pytest.approx(2 * known.cost, rel=1e-8)
    few = minima(starts[:1], equations, lambda step, p, which: p + step, np.zeros(1), 1)
    assert not few.converged[0]


def test_explained_variance() -> None:
    rng = np.random.default_rng(7)
    one, noise = rng.normal(size=(2, 10_000))
    assert explains(3 * one + 1, one + 0.9 * noise) and not explains(one, one + 1.1 * noise)
    assert (
        not explains(-one, one) and not explains(np.ones(9), np.arange(9.0)) and not explains(np.zeros(9), np.zeros(9))
    )


def test_gates_are_positive_numbers() -> None:
    assert checked_gate(np.inf) == HUGE and checked_gate(np.float32(9)) == 9
    for gate, error in ((None, TypeError), ("9", TypeError), (np.ones(2), TypeError), (0, ValueError)):
        with pytest.raises(error, match=r"^gate: "):
            checked_gate(gate)  # type: ignore[arg-type]


def test_all_statuses_have_one_base() -> None:
    """Every enumeration of a status has the base `Status`."""
    pattern, found = re.compile(r"^class (\w*Status)\((.*)\):$", re.MULTILINE), []
    for path in (Path(__file__).parents[2] / "algorithms").rglob("*.py"):
        found += [(path.name, *match) for match in pattern.findall(path.read_text())]
    assert len(found) > 25
    other = [each for each in found if each[2] not in ("Status", "evidence.Status")]
    assert other == [("status.py", "Status", "IntEnum")]
    assert issubclass(VisionStatus, Status) and VisionStatus.OK == 0
