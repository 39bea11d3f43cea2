"""Logarithms, roots and powers of versors over six to eight vectors, against exponentials of mpmath."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from many_planes import ANGLES, PI, exact_exp, example, rounded, size

import gacompiler
from gacompiler import Cl
from gacompiler.errors import AlgebraError
from gacompiler.objects.arrays import wrap

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
