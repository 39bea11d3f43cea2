"""Exponentials without a closed form, from small to large arguments, against matrices in 60 digits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from selection import some_slow
from spin_matrices import error, generators, null_generators

import gacompiler as ga
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA3, G33, VGA3, orthogonal
from gacompiler.algebra.multivector import Multivector
from gacompiler.objects import Space

CASES: dict[str, tuple[Algebra, Any]] = {
    "G(6)": (orthogonal(6), lambda: generators([1] * 6)),
    "G(3,3)": (orthogonal(3, 3), lambda: generators([1, 1, 1, -1, -1, -1])),
    "G(4,2)": (orthogonal(4, 2), lambda: generators([1, 1, 1, 1, -1, -1])),
    "G33": (G33, lambda: null_generators(3)),
}


def bivector(algebra: Algebra, coefficients: Any) -> Multivector:
    return Multivector(algebra, dict(zip(algebra.blades(2), map(float, coefficients), strict=True)))


def arguments(algebra: Algebra, seed: int = 0) -> list[Multivector]:
    """Random bivectors up to the overflow of hyperbolic functions, rotations of norm 1000, and degenerate bivectors."""
    rng = np.random.default_rng(seed)
    planes = algebra.blades(2)
    found = []
    for norm in (1e-9, 1.0, 30.0, 300.0):
        c = rng.normal(size=len(planes))
        found.append(c * norm / np.linalg.norm(c))
    turning = [algebra.blade_product(b, b).get(0, 0) < 0 and _is_definite(algebra, b) for b in planes]
    c = np.where(turning, rng.normal(size=len(planes)), 0.0)
    found += [1000 * c / np.linalg.norm(c)] if any(turning) else []
    equal = np.zeros(len(planes))
    equal[[planes.index(0b11), planes.index(0b1100), planes.index(0b110000)]] = 20.0, 20.0, 20.0 + 1e-9
    single = np.zeros(len(planes))
    single[0] = 500.0
    return [bivector(algebra, each) for each in (*found, equal, single)]


def _is_definite(algebra: Algebra, blade: int) -> bool:
    """Whether the plane of a basis bivector has vectors of one sign only."""
    i, j = (k for k in range(algebra.dimension) if blade >> k & 1)
    return algebra.gram[i][i] * algebra.gram[j][j] > 0


@pytest.mark.parametrize("name", some_slow(CASES, "G(3,3)", "G(4,2)", "G33"))
@pytest.mark.slow
def test_accuracy(name: str) -> None:
    """The error is at most 1e-13 of the largest coefficient; a fixed number of four squarings fails from norm 8 on."""
    algebra, make = CASES[name]
    vectors = make()
    for b in arguments(algebra):
        assert error(vectors, b.terms, ga.exp(b).terms) < 3e-14


@pytest.mark.slow
@pytest.mark.parametrize(("p", "q"), [(4, 4)])
def test_eight_dimensions(p: int, q: int) -> None:
    """The error is that of entries of matrices, which are sums of 128 coefficients."""
    algebra = orthogonal(p, q)
    (b,) = (b for b in arguments(algebra) if abs(_norm(b) - 1000) < 1)
    assert error(generators([1] * p + [-1] * q), b.terms, ga.exp(b).terms) < 1e-13


@pytest.mark.slow
@pytest.mark.parametrize(("p", "q"), [(8, 0)])
def test_objects_of_eight_dimensions(p: int, q: int) -> None:
    """Test objects and arrays of objects, with a scalar part, and with numbers that are not finite."""
    algebra, vectors = orthogonal(p, q), generators([1] * p + [-1] * q)
    space = Space(algebra)
    several = [b for b in arguments(algebra) if _norm(b) > 1]
    rows = np.array([[b.terms.get(plane, 0) for plane in algebra.blades(2)] for b in several])
    found = space.bivector(rows).exp()
    alone = space.bivector(rows[0]).exp()
    # in the definite metric the bivector of norm 1000, otherwise one whose hyperbolic functions are not the largest
    k = 0 if q else int(np.argmax([_norm(b) for b in several]))
    values = {algebra.blade(name)[1]: float(found[k][name]) for name in algebra.even.blades}
    assert error(vectors, several[k].terms, values) < 1e-13
    np.testing.assert_allclose(alone.values, found[0].values, rtol=0, atol=1e-13 * np.abs(alone.values).max())
    shifted = (0.5 + space.bivector(rows[0])).exp()
    np.testing.assert_allclose(shifted.values, np.exp(0.5) * alone.values, rtol=1e-13)
    rows[1] = np.nan
    spoiled = space.bivector(rows).exp().values
    assert np.isnan(spoiled[1]).any() and np.isfinite(spoiled[0]).all()
    assert (space.bivector(0 * rows[0]).exp() - 1).values.any() == np.False_


def _norm(b: Multivector) -> float:
    return float(np.linalg.norm(list(b.terms.values())))


@pytest.mark.slow
def test_compiled() -> None:
    """Objects agree with the definition; results are NaN where they overflow, never wrong."""
    algebra, make = CASES["G(3,3)"]
    space, vectors = Space(algebra), make()
    several = arguments(algebra, 1)
    rows = space.bivector(np.array([[b.terms.get(plane, 0) for plane in algebra.blades(2)] for b in several]))
    found = rows.exp()
    for k, b in enumerate(several):
        values = {blade: float(found[k][algebra.spelling(blade)[1]]) for blade in algebra.blades(0, 2, 4, 6)}
        assert error(vectors, b.terms, values) < 3e-14
    nothing = (0 * rows[1]).exp()
    assert nothing["1"] == 1 and float((nothing - 1).norm_squared()) == 0
    turn = rows[4]
    for size, is_known in ((1.0, True), (100.0, True), (1e197, False), (np.inf, False), (np.nan, False)):
        with np.errstate(invalid="ignore", over="ignore"):
            value = (size * turn).exp()
        assert np.isfinite(value.values).all() == is_known
        assert is_known or np.isnan(value.values).any()
    half = (50 * turn).exp()  # by five myriads of radians, of which doubles keep eleven digits
    assert np.abs(((100 * turn).exp() - half * half).values).max() < 1e-10
    with np.errstate(invalid="ignore", over="ignore"):
        boost = (
            space.bivector(np.where(np.isin(algebra.blades(2), [0b1001, 0b10010, 0b100100]), 710.0, 0.0)).exp().values
        )
    assert not np.isfinite(boost).all(), "the largest coefficient is above every double"


@pytest.mark.slow
def test_other_elements() -> None:
    """Elements without a closed form: even elements of conformal space, vectors plus bivectors."""
    from scipy.linalg import expm

    for algebra, blades in ((CGA3, CGA3.blades(2, 4)), (VGA3, VGA3.blades(1, 2))):
        c = np.random.default_rng(3).normal(size=len(blades))
        x = Multivector(algebra, dict(zip(blades, map(float, c), strict=True)))
        matrix = np.array(
            [
                [float((x * Multivector(algebra, {column: 1})).terms.get(row, 0)) for column in algebra.blades()]
                for row in algebra.blades()
            ]
        )
        for factor in (0.01, 1, 40):
            truth = expm(factor * matrix)[:, 0]
            found = np.array([float(ga.exp(x * factor).terms.get(blade, 0)) for blade in algebra.blades()])
            assert np.abs(found - truth).max() < 1e-12 * np.abs(truth).max()
