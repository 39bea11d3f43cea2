"""Quotients, reciprocals and powers of single elements, which the extension computes unless there is none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gacompiler import Cl
from gacompiler.errors import AlgebraError, ZeroDivisorError
from gacompiler.objects import CGA3, PGA3, STA, VGA3
from gacompiler.objects.operators import operators

NULL = (
    VGA3.vector(0.0, 0, 0), STA.vector(1.0, 1, 0, 0), PGA3.of(PGA3.PLANE, [0.0, 0, 0, 2]),
    CGA3.of(CGA3.VECTOR, [0.0, 0, 0, 1, 0]),
)  # fmt: skip
FAR = (VGA3.vector(3e-180, 0, 4e-180), VGA3.vector(3e180, 0, 4e180), STA.vector(5e-170, 1e-170, 0, 0))
REGULAR = (VGA3.vector(1.0, 2, 3), STA.vector(3.0, 1, 0, 1), PGA3.plane(1.0, 2, 3, 4), CGA3.sphere([1.0, 2, 3], 2.0))


def called_often(x: Any) -> None:
    """Let operators on elements of this kind be bound to their compiled functions."""
    for _ in range(3):
        _ = x / x, 2 / x, 2.5 / x, x**-1
        for each in operators():
            each.wait()


@pytest.mark.parametrize("x", REGULAR, ids=str)
def test_quotients_multiply_back(x: Any) -> None:
    called_often(x)
    y = x + 0.5 * x
    assert (y / x).isclose(1.5) and ((2 / x) * x).isclose(2) and ((2.5 / x) * x).isclose(2.5)
    assert (x**-1 * x).isclose(1) and (x**-2 * x * x).isclose(1) and (x**-3 * x**3).isclose(1)


@pytest.mark.parametrize("x", NULL, ids=str)
def test_null_divisors_are_refused_after_regular_ones(x: Any) -> None:
    called_often(next(each for each in REGULAR if each.algebra == x.algebra))
    for _ in range(2):
        for divide in (lambda: x / x, lambda: 2 / x, lambda: 2.5 / x, lambda: x**-1, lambda: x**-2):
            with pytest.raises(ZeroDivisorError):
                divide()


@pytest.mark.parametrize("x", FAR, ids=str)
def test_divisors_with_squares_outside_of_doubles(x: Any) -> None:
    called_often(next(each for each in REGULAR if each.algebra == x.algebra))
    assert (x / x).isclose(1) and ((2 / x) * x).isclose(2) and (x**-1 * x).isclose(1)


def test_quotients_of_nan_are_nan() -> None:
    called_often(REGULAR[0])
    x = VGA3.vector(np.nan, 0, 0)
    assert all(np.isnan(found.values).any() for found in (x / x, 2 / x, x**-1))


def test_reciprocals_of_unit_versors_are_reverses() -> None:
    m = PGA3.motor([0, 0, 1], 0.5, 1.0, 2.0, 3.0)
    called_often(m)
    assert m**-1 == ~m and (m / m).isclose(1) and (m**-2).isclose(~m * ~m)


@pytest.mark.parametrize("exponent", [0.5, -1.5, 0.0, 2.0, 1e3])
def test_powers_of_rotations_are_those_of_their_angles(exponent: float) -> None:
    turn, screw = VGA3.rotor([0, 0, 1], 0.75), PGA3.motor([0, 0, 1], 0.75, 0.5)
    for _ in range(3):
        for x in (turn, screw):
            _ = x**0.5
        for each in operators():
            each.wait()
    half = 0.375 * exponent
    angle = np.abs((turn**exponent).values[[0, 1]])
    np.testing.assert_allclose(angle, np.abs([np.cos(half), np.sin(half)]), rtol=0, atol=1e-12)
    place = PGA3.coordinates(screw**exponent >> PGA3.point(1, 2, 3))
    x, y = np.cos(2 * half) - 2 * np.sin(2 * half), np.sin(2 * half) + 2 * np.cos(2 * half)
    np.testing.assert_allclose(place, [x, y, 3 + 0.5 * exponent], rtol=0, atol=1e-9)
    with pytest.raises(AlgebraError, match="power"):
        _ = turn**np.nan


def test_powers_that_are_not_determined_are_refused_after_others() -> None:
    space = Cl(4)
    one = (0.3 * space.e12).exp() * (0.5 * space.e34).exp()
    for _ in range(3):
        assert (one**0.5 * one**0.5).isclose(one)
        for each in operators():
            each.wait()
    turned = space.of(one.layout, *(name == "e1234" for name in one.layout.blades))  # by 90 degrees in any two planes
    with pytest.raises(AlgebraError, match="power"):
        _ = turned**0.5
