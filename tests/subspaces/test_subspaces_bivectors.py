"""Bivectors as sums of commuting blades: against sums that were made, and exponentials of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.stats import ortho_group

from algorithms.subspaces import BivectorParts, bivectors, split_bivectors
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, PGA3, STA, null_pairs, orthogonal
from tests.support.all_cases import all_cases

RANDOM = np.random.default_rng(22)


@pytest.fixture(autouse=True)
def same_numbers_in_any_order() -> None:
    """The numbers of a test do not depend on the tests before it."""
    RANDOM.bit_generator.state = np.random.default_rng(22).bit_generator.state


def gram_of(algebra: Algebra) -> np.ndarray:
    return np.array([[float(x) for x in row] for row in algebra.gram])


def matrix(coefficients: np.ndarray, n: int) -> np.ndarray:
    result = np.zeros((*coefficients.shape[:-1], n, n))
    at = 0
    for j in range(n):
        for i in range(j):
            result[..., i, j], result[..., j, i] = coefficients[..., at], -coefficients[..., at]
            at += 1
    return result


def coefficients(skew: np.ndarray) -> np.ndarray:
    n = skew.shape[-1]
    return np.stack([skew[..., i, j] for j in range(n) for i in range(j)], -1)


def check(found: BivectorParts, bivector: np.ndarray, n: int, gram: np.ndarray, tolerance: float = 1e-11) -> None:
    """The sum, simplicity by rank, commuting as operators, squares."""
    size = np.abs(bivector).max()
    assert np.abs(found.parts.sum(-2) - bivector).max() < tolerance * size
    parts = matrix(found.parts, n)
    assert np.linalg.svd(parts, compute_uv=False)[..., 2:].max(initial=0) < tolerance * size
    maps = parts @ gram
    for i in range(maps.shape[-3]):
        square = maps[..., i, :, :] @ maps[..., i, :, :] @ maps[..., i, :, :]
        assert np.abs(square - found.squares[..., i, None, None] * maps[..., i, :, :]).max() < tolerance * 100 * size**3
        for j in range(i):
            one, two = maps[..., i, :, :], maps[..., j, :, :]
            assert np.abs(one @ two - two @ one).max() < tolerance * 100 * size**2


@all_cases("n", range(2, 13))
@all_cases("scale", [1e-8, 1.0, 1e8])
def test_euclidean_bivectors(n: int, scale: float) -> None:
    bivectors = scale * RANDOM.normal(size=(20, n * (n - 1) // 2))
    found = split_bivectors(bivectors, n)
    assert found.is_split.all()
    check(found, bivectors, n, np.eye(n))
    assert (np.diff(found.squares, axis=-1) >= -1e-12 * scale**2).all() and (found.squares <= 0).all()
    # a rotation turns each plane by its rate
    angles = np.sort(np.abs(np.angle(np.linalg.eigvals(expm(matrix(bivectors[0] / scale, n))))))[::-1]
    rates = np.sqrt(-found.squares[0]) / scale
    expected = np.abs((rates + np.pi) % (2 * np.pi) - np.pi)
    assert np.abs(np.sort(np.repeat(expected, 2))[::-1] - angles[: 2 * len(rates)]).max() < 1e-7


def test_equal_and_small_rates() -> None:
    n = 8
    frame = ortho_group.rvs(n, random_state=5)
    for rates in ([1.0, 1.0, 1.0, 1.0], [2.0, 1.0, 1.0, 0.0], [1.0, 1e-9, 0.0, 0.0], [3.0, 1.0, 1.0, 1.0 + 1e-12]):
        skew = np.zeros((n, n))
        for k, rate in enumerate(rates):
            skew[2 * k, 2 * k + 1], skew[2 * k + 1, 2 * k] = rate, -rate
        bivector = coefficients(frame @ skew @ frame.T)
        found = split_bivectors(bivector, n)
        check(found, bivector, n, np.eye(n))
        assert np.abs(np.sqrt(-found.squares) - np.sort(rates)[::-1]).max() < 1e-12


@pytest.mark.parametrize("algebra", [STA, CGA3, orthogonal(5, 1), orthogonal(1, 6)], ids=lambda a: a.name)
def test_bivectors_of_one_timelike_direction(algebra: Algebra) -> None:
    n, gram = algebra.dimension, gram_of(algebra)
    bivectors = RANDOM.normal(size=(50, n * (n - 1) // 2))
    found = split_bivectors(bivectors, n, gram)
    assert found.is_split.all()
    check(found, bivectors, n, gram, 1e-9)
    assert ((found.squares > 1e-9).sum(-1) <= 1).all()
    truth = np.linalg.eigvals(matrix(bivectors, n) @ gram) ** 2
    for one, all_of in zip(found.squares, truth, strict=True):
        assert max(np.abs(all_of - square).min() for square in one) < 1e-8


def made(n: int, metric: np.ndarray, rates: list[float], seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A bivector and its parts: planes of basis vectors, turned by an orthogonal map of the metric."""
    random = np.random.default_rng(seed)
    turn = expm(matrix(random.normal(size=n * (n - 1) // 2) * 0.2, n) @ metric)
    parts = np.zeros((n // 2, n, n))
    for k, rate in enumerate(rates):
        parts[k, 2 * k, 2 * k + 1], parts[k, 2 * k + 1, 2 * k] = rate, -rate
    parts = turn @ parts @ turn.T
    return coefficients(parts.sum(0)), coefficients(parts)


@pytest.mark.parametrize(
    ("squares", "rates"),
    [
        ([1, 1, 1, 1, 1], [2.0, 1.0]),
        ([1, 1, 1, -1], [2.0, -1.0]),
        ([1, 1, 1, -1, 1], [2.0, -1.0]),
        ([1, 1, 1, 0], [2.0, 1.0]),
        ([1, 1, -1, -1], [3.0, 1.0]),
        ([1, 1, 1, 1, 1, -1], [-3.0, 2.0, 1.0]),
        ([1, 1, 1, 1, 1, -1, -1], [3.0, 2.0, 1.0]),
        ([1, -1, 1, 1, 1, -1, 1, 1], [4.0, -3.0, 2.0, 1.0]),
    ],
    ids=str,
)
def test_rates_far_apart_need_no_subspaces(
    squares: list[int], rates: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Polynomials of the bivector find the parts by themselves, in batches with leading axes and in any unit."""

    def refuse(*_: object) -> None:
        raise AssertionError("the slow method is for rates that polynomials cannot separate")

    monkeypatch.setattr(bivectors, "_by_subspaces", refuse)
    n, metric = len(squares), np.diag(np.array(squares, float))
    pairs = [made(n, metric, rates, seed) for seed in range(6)]
    given, parts = (np.stack([pair[k] for pair in pairs]) for k in (0, 1))
    for scale in (1.0, 1e-6, 1e6):
        found = split_bivectors(scale * given.reshape(2, 3, -1), n, metric)
        assert found.is_split.shape == (2, 3) and found.is_split.all()
        assert np.abs(found.parts.reshape(parts.shape) - scale * parts).max() < 1e-11 * scale
    signs = np.array([-metric[2 * k, 2 * k] * metric[2 * k + 1, 2 * k + 1] for k in range(n // 2)])
    expected = signs * np.array(rates) ** 2 * 1e12
    assert np.abs(found.squares - expected).max() < 1e-10 * 1e12


@pytest.mark.parametrize("gap", [1e-9, 1e-3, 0.2])
def test_equal_and_near_rates_of_other_metrics(gap: float) -> None:
    """Subspaces are used for small gaps: by either method, the parts are simple, commute and have their squares."""
    metric = np.diag([1.0, 1, 1, 1, 1, -1])
    given = np.stack([made(6, metric, [1.0 + gap, 1.0, 0.5], seed)[0] for seed in range(4)])
    found = split_bivectors(given, 6, metric)
    assert found.is_split.all()
    check(found, given, 6, metric, 1e-10 if gap < 1e-6 or gap > 0.1 else 1e-8)
    assert np.abs(np.sort(found.squares, axis=-1) - [-((1 + gap) ** 2), -1.0, 0.25]).max() < 1e-8


def test_screws_and_null_rotations() -> None:
    """In PGA a screw is a commuting rotation and translation; in STA and beyond null parts are not divided."""
    screw = np.array([2.0, 0.3, 0.5, 1.0, -0.7, 0.2])
    gram = gram_of(PGA3)
    found = split_bivectors(screw, 4, gram)
    assert found.is_split
    check(found, screw, 4, gram)
    assert np.allclose(np.sort(found.squares), [-(4 + 0.09 + 0.25), 0.0])
    null = np.zeros((6, 6))
    minkowski = np.diag([1.0, 1, 1, 1, 1, -1])
    null[0, 4] = null[0, 5] = 1.0
    null[1, 2] = 3.0
    turn = expm(matrix(RANDOM.normal(size=15) * 0.3, 6) @ minkowski)
    bivector = coefficients(turn @ (null - null.T) @ turn.T)
    found = split_bivectors(bivector, 6, minkowski)
    assert found.is_split
    check(found, bivector, 6, minkowski, 1e-9)
    assert np.allclose(np.sort(found.squares), [-9, 0, 0], atol=1e-8)


def test_small_boosts_with_fast_rotations() -> None:
    minkowski = np.diag([1.0, 1, 1, 1, 1, -1])
    skew = np.zeros((6, 6))
    skew[0, 1], skew[2, 3], skew[4, 5] = 5.0, 5.0, 1e-7
    turn = expm(matrix(RANDOM.normal(size=15) * 0.3, 6) @ minkowski)
    bivector = coefficients(turn @ (skew - skew.T) @ turn.T)
    found = split_bivectors(bivector, 6, minkowski)
    assert found.is_split
    check(found, bivector, 6, minkowski, 1e-9)


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_a_small_part_with_nearly_equal_ones_is_simple_in_any_unit(scale: float) -> None:
    """Rounding errors after subtraction of the large parts are relative to the size of the bivector."""
    gram = np.diag([1.0, 1, 1, 1, -1, -1])
    bivector, parts = made(6, gram, [1.0, 1.001, 1e-8], 7)
    found = split_bivectors(scale * bivector, 6, gram)
    assert found.is_split
    np.testing.assert_allclose(found.parts[2], scale * parts[2], atol=1e-12 * scale)


def test_where_no_real_split_is_singled_out() -> None:
    """Complex rates of G(2, 2), and a nilpotent bivector that is not simple."""
    gram = np.diag([1.0, 1, -1, -1])
    skew = np.zeros((4, 4))
    skew[0, 1], skew[2, 3], skew[0, 2], skew[1, 3] = 1.0, -1.0, 0.5, 0.5
    bivector = coefficients(skew - skew.T)
    rates = np.linalg.eigvals(matrix(bivector, 4) @ gram)
    found = split_bivectors(np.stack([bivector, [1.0, 0, 0, 0, 0, 0]]), 4, gram)
    assert np.abs((rates**2).imag).max() > 0.1
    assert found.is_split.tolist() == [False, True]
    assert np.allclose(found.parts.sum(-2)[0], bivector)
    null = np.zeros((8, 8))
    null[0, 1], null[2, 3] = 1.0, 2.0  # w1^w2 + 2 w3^w4: the squares and products of its parts vanish
    assert not split_bivectors(coefficients(null - null.T), 8, gram_of(null_pairs(4))).is_split
    null[2, 3] = 0.0
    assert split_bivectors(coefficients(null - null.T), 8, gram_of(null_pairs(4))).is_split


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([1.0, 2.0], 3), r"\(\.\.\., 3\)"),
        (([], 3), r"shape \(0,\)"),
        (([np.nan, 0, 0], 3), "nan"),
        (([1.0], 1), "2 or more"),
        (([1.0], 31), "30"),
        (([1.0, 0, 0], 3, [1, 1]), "gram"),
    ],
)
def test_bad_arguments_are_named(arguments: tuple, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        split_bivectors(*arguments)
