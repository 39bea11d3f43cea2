"""Logarithms, roots and powers of versors over six to eight vectors, against exponentials of mpmath."""

from __future__ import annotations

from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest

import gacompiler
from gacompiler import Cl
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.multivector import Multivector
from gacompiler.errors import AlgebraError
from gacompiler.objects.arrays import wrap

PLANES = ["e12", "e34", "e56", "e78"]
PI = mpmath.mpf("3.14159265358979323846264338327950288419716939937510")
ANGLES = {
    "near zero": [1e-9, 2e-9, -1e-9, 3e-9],
    "of different sizes": [1e-12, 1.0, 2.0, 1e-8],
    "equal": [1.0, 1.0, 1.0, 1.0],
    "opposite": [1.0, -1.0, 1.0, -1.0],
    "nearly equal": [1.0, 1 + 1e-9, 1.0, 2.0],
    "pi - 1e-3": [PI - mpmath.mpf("1e-3"), 0.3, 0.5, -1.0],
    "pi - 1e-13": [PI - mpmath.mpf("1e-13"), 0.3, 0.5, -1.0],
    "two near pi": [PI - mpmath.mpf("0.1"), PI - mpmath.mpf("0.3"), 0.5, 1.0],
}


@cache
def frame(algebra: Algebra) -> Multivector:
    """A rotor of a few planes, which moves bivectors out of the coordinate planes."""
    found = algebra.scalar(mpmath.mpf(1))
    for k, (i, j) in enumerate([(0, 2), (1, 3), (2, algebra.dimension - 1), (0, algebra.dimension - 1)]):
        vectors = algebra.basis()
        generator = (vectors[i] * vectors[j]).map(lambda value, k=k: value * mpmath.mpf(k + 1) / 7)  # type: ignore[misc]
        found = exact_exp(generator) * found
    return found


def turn(algebra: Algebra, name: str, angle: Any) -> Multivector:
    """The exponential of a multiple of a blade whose square is 1 or -1."""
    blade = algebra.multivector({name: mpmath.mpf(1)})
    if (blade * blade).scalar < 0:
        return mpmath.cos(angle) + mpmath.sin(angle) * blade
    return mpmath.cosh(angle) + mpmath.sinh(angle) * blade


def exact_exp(x: Multivector) -> Multivector:
    term = total = x.algebra.scalar(mpmath.mpf(1))
    small = x.map(lambda value: value / 2**8)
    for k in range(1, 24):
        term = (term * small).map(lambda value, k=k: value / k)  # type: ignore[misc]
        total = total + term
    for _ in range(8):
        total = total * total
    return total


def example(signature: tuple[int, ...], angles: list[Any]) -> tuple[Any, Any]:
    """Return a bivector and its exponential as objects, both rounded from 40 digits."""
    with mpmath.workdps(40):
        algebra = Cl(*signature).algebra
        parts = {plane: mpmath.mpf(angle) / 2 for plane, angle in zip(PLANES, angles, strict=False)}
        known = {name: value for name, value in parts.items() if int(name[-1]) <= algebra.dimension}
        versor = algebra.scalar(mpmath.mpf(1))
        for name, value in known.items():
            versor = versor * turn(algebra, name, value)
        moved = frame(algebra)
        b, versor = ((moved * x) * ~moved for x in (algebra.multivector(known), versor))
        return rounded(algebra, b.grade(2), algebra.blades(2)), rounded(algebra, versor, algebra.even.support)


def rounded(algebra: Algebra, x: Multivector, blades: Any) -> Any:
    layout = algebra.layout("part", " ".join(algebra.spelling(b)[1] for b in sorted(blades)))
    return wrap(layout, np.array([float(x.terms.get(s.blade, 0)) * s.sign for s in layout.stored]))


def size(x: Any) -> float:
    return float(np.max(np.abs(x.values)))


CASES = [
    *((signature, name) for signature in ((6,), (3, 3), (4, 2)) for name in ANGLES),
    pytest.param((8,), "equal", marks=pytest.mark.slow),
    pytest.param((4, 4), "of different sizes", marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("signature", "name"), CASES, ids=str)
def test_known_angles(signature: tuple[int, ...], name: str) -> None:
    b, versor = example(signature, ANGLES[name])
    found = versor.log()
    # With two angles near pi, rounding the versor already changes the bivector by the error divided by their distance.
    # The projections of boosted planes have coefficients above 1, whose rounding errors are relative to their squares.
    limit = 1e-14 * max(size(versor), 1.0) ** 2
    assert size(found - b) <= limit * size(b)
    assert size(found.exp() - versor) <= limit
    root = versor.sqrt()
    assert size(root * root - versor) <= limit
    assert size(versor.power(1 / 3) ** 3 - versor) <= limit


@pytest.mark.parametrize("signature", [(6,), (4, 2)], ids=str)
def test_half_turns_have_one_of_two_logarithms(signature: tuple[int, ...]) -> None:
    _, versor = example(signature, [PI, 0.3, 0.5, -1.0])
    found = versor.log().exp()
    assert min(size(found - versor), size(found + versor)) <= 1e-14


def test_null_rotations_and_boosts() -> None:
    algebra = Cl(3, 3).algebra
    a = algebra.multivector
    null = (a({"e1": 1}) + a({"e4": 1})) ^ (a({"e2": 1}) + a({"e5": 1}))
    shear = (a({"e1": 1}) + a({"e4": 1})) ^ a({"e2": 1})
    mixed = null.map(lambda value: 3 * value) + a({"e36": 1})
    for parts in (null, shear, shear + a({"e36": 2}), mixed, a({"e14": 3, "e25": 3})):
        with mpmath.workdps(40):
            exact = parts.map(mpmath.mpf)
            b = rounded(algebra, exact, algebra.blades(2))
            versor = rounded(algebra, exact_exp(exact), algebra.even.support)
        assert size(versor.log() - b) <= 1e-14 * size(versor) * size(b)


@pytest.mark.slow
def test_more_than_half_a_turn() -> None:
    """With ``shorter=False``, the exponential is the versor itself; else that of the shorter way."""
    b, versor = example((6,), [1.0, 2.0, 4.0])
    shorter, whole = versor.log(), versor.log(shorter=False)
    assert size(shorter.exp() + versor) <= 1e-14 and size(whole.exp() - versor) <= 1e-14
    assert size(whole - b) <= 1e-14 and size(versor.sqrt(shorter=False) ** 2 - versor) <= 1e-14


@pytest.mark.slow
def test_two_half_turns_have_no_logarithm() -> None:
    algebra = Cl(6).algebra
    with pytest.raises(AlgebraError, match="no logarithm, or many"):
        wrap(algebra.even, np.eye(algebra.even.size)[algebra.even.blades.index("e1234")]).log()
    one, other = example((6,), [1.0, 2.0, 0.5])[1], np.zeros(algebra.even.size)
    other[algebra.even.blades.index("e1234")] = 1
    both = wrap(algebra.even, np.stack([one.as_layout(algebra.even).values, other]))
    assert np.isnan(gacompiler.log(both).values).all(-1).tolist() == [False, True]


def test_a_degenerate_metric_is_refused() -> None:
    algebra = Cl(5, 0, 1).algebra
    with pytest.raises(AlgebraError, match="degenerate metric"):
        wrap(algebra.even, np.eye(algebra.even.size)[0]).log()
