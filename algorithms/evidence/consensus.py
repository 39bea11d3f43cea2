"""Consensus: models with which many items agree, from random samples whose best models are refined (LO-RANSAC)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, log, log1p, prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from generated import samples

from ..arguments import Reals, finite_number
from ..precision import LIKELY, TINY
from .chance import Freedom, by_chance, surely_not_by_chance, tail_by_chance
from .sampling import Seed, chance_of_right_sets, drawn_sets, random_subsets

_BATCH, _LARGEST = 16, 512
"""A limit on work: samples that are solved and scored at once, for each item of a sample and at most; each batch is
four times as large as the one before, but no larger than the number of samples that are still wanted."""
_SUBSET = 64
"""A limit on work: if there are many items, models are first scored on this number of them,"""
_KEPT = 16
"""and this number of models is scored on all items."""
_SOON = 2.0
"""A limit on work: the number of steps with another threshold,"""
_STEPS = 50.0
"""and of those to a minimum."""
_ROUNDS = 4
"""A limit on work: how often a minimum is left in search of a lower one."""
N_WRONG = 5000
"""A limit on work: number of wrong pairs by which the distances of unrelated items are estimated."""
_FACTORS = np.random.default_rng(0).normal(size=128)
"""From floating point: of whole numbers times these, two sets rarely have the same sum."""

Indices = NDArray[Any]
"""Indices of items: integers, or bool."""


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Definition of a model for sampling."""

    first: Reals
    """(n, ...) One side of the pairs,"""
    second: Reals
    """(n, ...) and the other."""
    freedom: Freedom
    solve: Callable[[Indices], Reals]
    """Function from index sets (b, sample_size) to models (m, ...); missing ones are NaN."""
    distances: Callable[[Reals, Reals, Reals], Reals]
    """Function from models (m, ...) and both sides (k, ...) of pairs to nonnegative distances (m, k)."""
    costs: Callable[[Reals, Reals, Reals, float], Reals]
    """Function from models (m, ...), both sides (k, ...) of pairs and a threshold to sums (m,) of truncated squared
    distances."""
    descend: Callable[[Reals, float, float], Reals]
    """Function from models (m, ...), a threshold and a largest number of steps to the models near them with the least
    truncated squares."""
    scores: Reals | None = None
    """(n,) How likely items are right, in relation to each other: half of the samples are drawn by them."""


class Hypothesis(NamedTuple):
    """A model and the items that agree with it."""

    cost: float
    """The sum of truncated squared distances."""
    model: Reals
    inliers: Indices
    """(n,) bool"""


@dataclass(frozen=True, slots=True, eq=False)
class Consensus:
    """Result of `consensus`."""

    best: Hypothesis | None
    """None if no sample has a model."""
    n_samples: int
    reached: bool
    """Whether a sample without wrong items was drawn with the given confidence."""


def check_sampling(threshold: float, confidence: float, max_samples: int) -> None:
    """Raise ValueError or TypeError if one of these options is invalid."""
    if finite_number(threshold, "threshold") <= 0:
        raise ValueError(f"threshold: {threshold}; expected more than 0 pixels")
    if not 0 < finite_number(confidence, "confidence") < 1:
        raise ValueError(f"confidence: {confidence}; expected a probability between 0 and 1, both excluded")
    if isinstance(max_samples, bool) or not isinstance(max_samples, (int, np.integer)):
        raise TypeError(f"max_samples: {max_samples!r}; expected a whole number")
    if max_samples < 1:
        raise ValueError(f"max_samples: {max_samples}; expected at least 1")


def consensus(
    problem: Problem, threshold: float, seed: Seed, confidence: float, max_samples: int, at_once: bool = False
) -> Consensus:
    """Return the model with the least truncated squared distances (MSAC); new best models are refined.

    Samples are drawn until one of them is free of wrong items with the given confidence. Chum, Matas and Kittler,
    *Locally optimized RANSAC*, DAGM 2003. Whether chance explains the inliers is for `explained_by_chance` to say. If
    few models are expected to have a consensus, all samples can be drawn `at_once`, so that one model is refined, once.
    """
    rng, size, n = np.random.default_rng(seed), problem.freedom.sample_size, len(problem.first)
    best, inliers, lowest, least, is_polished = None, np.zeros(n, np.bool_), np.inf, np.inf, at_once
    drawn, wanted, batch = 0, np.inf, max_samples if at_once else min(_BATCH * size, max_samples)
    while True:
        if best is not None and drawn >= wanted and not is_polished:
            found = _among_inliers(problem, best, lowest, inliers, threshold, rng)
            best, lowest = polished(problem, *found, threshold)
            inliers, is_polished = _distances(problem, best) <= threshold, True
            wanted = _samples_for(problem, inliers, confidence)
        if drawn >= min(wanted, max_samples):
            break
        batch = ceil(min(batch, max_samples - drawn, wanted - drawn))
        model, cost = _best_of(problem, drawn_sets(rng, n, size, batch, problem.scores), threshold, rng)
        drawn += batch
        batch = min(4 * batch, _LARGEST)
        if model is None or cost >= least:
            continue
        # Refine each new best sample. If compared with refined models, few would be, and maybe not the right one.
        least = cost
        model, cost = _followed(problem, model, cost, threshold)
        if cost < lowest:
            best, lowest, is_polished = model, cost, at_once
            inliers = _distances(problem, best) <= threshold
            wanted = _samples_for(problem, inliers, confidence)
    if best is None:
        return Consensus(None, drawn, reached=False)
    return Consensus(Hypothesis(lowest, best, inliers), drawn, drawn >= wanted)


def _samples_for(problem: Problem, inliers: Indices, confidence: float) -> float:
    """Return the number of samples of which one has inliers only, with a confidence."""
    size = problem.freedom.sample_size
    chance = (np.count_nonzero(inliers) / len(inliers)) ** size
    if problem.scores is not None:
        chance = (chance + chance_of_right_sets(problem.scores, inliers, size)) / 2
    return log(1 - confidence) / min(log1p(-min(chance, 1 - 1e-12)), -TINY)


def _best_of(problem: Problem, sets: Indices, threshold: float, rng: np.random.Generator) -> tuple[Reals | None, float]:
    """Return the best model of some samples, or None, and its cost."""
    models = _promising(problem, problem.solve(sets), threshold, rng)
    if not len(models):
        return None, np.inf
    costs = _costs(problem, models, threshold)
    k = int(costs.argmin())
    return (models[k], float(costs[k])) if np.isfinite(models[k]).all() else (None, np.inf)


def _among_inliers(
    problem: Problem, model: Reals, cost: float, inliers: Indices, threshold: float, rng: np.random.Generator
) -> tuple[Reals, float]:
    """Return the minimum to which samples of inliers lead, if it is lower than that of a model.

    A first batch of them almost always includes a better one.
    """
    which, size = np.flatnonzero(inliers), problem.freedom.sample_size
    if len(which) > size:
        sets = which.take(random_subsets(rng, len(which), size, _BATCH * size))
        found, lower = _best_of(problem, sets, threshold, rng)
        if found is not None:
            found, lower = _followed(problem, found, lower, threshold)
            return (found, lower) if lower < cost else (model, cost)
    return model, cost


def _followed(problem: Problem, model: Reals, cost: float, threshold: float) -> tuple[Reals, float]:
    """Return the minimum near a model, if it is lower, and its cost.

    Twice the threshold helps from farther away; then follows the threshold.
    """
    found = problem.descend(problem.descend(model[None], 2 * threshold, _SOON), threshold, _STEPS)
    lower = float(_costs_of_few(problem, found, threshold)[0])
    return (found[0], lower) if lower < cost else (model, cost)


def polished(problem: Problem, model: Reals, cost: float, threshold: float) -> tuple[Reals, float]:
    """Return the lowest minimum to which a model leads, and its cost.

    Truncated squares have several minima, which differ in the items near the threshold. Half and twice the threshold
    lead away from one and back to others.
    """
    for _ in range(_ROUNDS):
        away = [problem.descend(model[None], limit, _SOON) for limit in (threshold / 2, 2 * threshold)]
        found = np.concatenate([problem.descend(each, threshold, _STEPS) for each in away])
        costs = _costs_of_few(problem, found, threshold)
        k = int(costs.argmin())
        if costs[k] >= cost * (1 - LIKELY):
            break
        model, cost = found[k], float(costs[k])
    return model, cost


def explained_by_chance(problem: Problem, model: Reals, threshold: float, rng: np.random.Generator) -> bool:
    """Return whether shuffled partners could agree with a model as well. Inliers that repeat others count once."""
    distances = _distances(problem, model)
    once = distances > threshold
    inliers = np.flatnonzero(~once)
    firsts, seconds = problem.first.take(inliers, axis=0), problem.second.take(inliers, axis=0)
    cells = _cells(firsts, seconds, threshold)
    order = rng.permutation(len(distances))
    next_ones = np.concatenate([order[1:], order[:1]])
    few = problem.distances(model[None], problem.first.take(order, axis=0), problem.second.take(next_ones, axis=0))[0]
    most = int(np.count_nonzero(_repeat_in_order(cells)))
    if surely_not_by_chance(len(order) - most, len(inliers) - most, few, threshold, problem.freedom):
        return False
    once[inliers] = _without_repeats(cells)
    order = order.compress(once.take(order))
    if len(order) <= problem.freedom.sample_size:
        return True
    wrong = unrelated(problem.first.take(order, axis=0), problem.second.take(order, axis=0))
    return by_chance(distances.compress(once), problem.distances(model[None], *wrong)[0], threshold, problem.freedom)


def near_by_chance(problem: Problem, model: Reals, threshold: float) -> bool:
    """Return whether partners as near their places as those that disagree with a model could agree with it as well.

    These are near in a mirrored image, for example, or if the threshold is smaller than the noise; one that disagrees
    shows neither. The test is for points: few distances from lines say little of the nearest ones of others.
    """
    return tail_by_chance(_distances(problem, model), threshold, problem.freedom)


def unrelated(first: Reals, second: Reals) -> tuple[Reals, Reals]:
    """Return about `N_WRONG` pairs of items with the partners of others."""
    n = len(first)
    shifts, twice = range(1, min(n - 1, -(-N_WRONG // n)) + 1), np.concatenate([second, second])
    return np.concatenate([first] * len(shifts)), np.concatenate([twice[n - k : 2 * n - k] for k in shifts])


def without_repeats(first: Reals, second: Reals, threshold: float) -> NDArray[np.bool_]:
    """Return which items (n,) do not repeat others on both sides (n, ...), up to noise and a few.

    Images of one thing differ by up to twice the threshold, and are therefore in one cell of twice that size, or of
    those shifted by a half. On the first side, which may have another unit, cells are in relation to the extent.
    """
    return _without_repeats(_cells(first, second, threshold))


def _cells(first: Reals, second: Reals, threshold: float) -> Reals:
    """Return numbers (4, n) of the cells of items, without a shift and with one on either or both sides."""
    width, height = prod(first.shape[1:]), prod(second.shape[1:])
    one, two = first.reshape(len(first), width), second.reshape(len(second), height)
    numbers = samples.cell_numbers(one, two, 4 * threshold, _FACTORS[:width], _FACTORS[width:][:height])
    return np.ascontiguousarray(np.asarray(numbers).T)


def _repeat_in_order(cells: Reals) -> NDArray[np.bool_]:
    """Return which of the cells (4, n) in order, but for the last ones, are those of another item."""
    in_order = np.sort(cells, axis=1)
    return np.asarray(in_order[:, 1:] == in_order[:, :-1])


def _without_repeats(cells: Reals) -> NDArray[np.bool_]:
    """Return `without_repeats` (n,) for cells (4, n)."""
    left = np.arange(cells.shape[1])
    for row in cells.compress(_repeat_in_order(cells).any(1), axis=0):
        own = row.take(left)
        order = own.argsort()
        own = own.take(order)
        is_first = np.ones(len(own), np.bool_)
        np.not_equal(own[1:], own[:-1], out=is_first[1:])
        left = left.take(order.compress(is_first))
    kept = np.zeros(cells.shape[1], np.bool_)
    kept[left] = True
    return kept


def _costs(problem: Problem, models: Reals, threshold: float) -> Reals:
    """Return the sums (m,) of truncated squared distances."""
    return without_nan(problem.costs(models, problem.first, problem.second, threshold))


def _costs_of_few(problem: Problem, models: Reals, threshold: float) -> Reals:
    """Return `_costs` by distances, which takes less time for few models. All items are far from what is not finite."""
    distances = np.fmin(problem.distances(models, problem.first, problem.second), threshold)
    return np.asarray(np.einsum("mn,mn->m", distances, distances))


def _distances(problem: Problem, model: Reals) -> Reals:
    """Return the distances (n,) of all items."""
    return without_nan(problem.distances(model[None], problem.first, problem.second)[0])


def without_nan(numbers: Reals) -> Reals:
    """Return numbers with infinity in the place of NaN."""
    return np.asarray(np.fmin(numbers, np.inf))


def _promising(problem: Problem, models: Reals, threshold: float, rng: np.random.Generator) -> Reals:
    """Return the models that are best for some of the items, if there are many models and items."""
    n = len(problem.first)
    if n <= 2 * _SUBSET or len(models) <= 2 * _KEPT:
        return models
    some = rng.integers(0, n, _SUBSET)
    first, second = problem.first.take(some, axis=0), problem.second.take(some, axis=0)
    costs = without_nan(problem.costs(models, first, second, threshold))
    return np.asarray(models[np.argpartition(costs, _KEPT)[:_KEPT]])
