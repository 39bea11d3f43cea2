"""Exponentials and logarithms with all digits of mpmath, against closed forms."""

from __future__ import annotations

import mpmath
import pytest

from gacompiler import exp, log
from gacompiler.algebra.catalog import CGA3, PGA3
from gacompiler.algebra.multivector import Multivector


def scaled(a: Multivector, number: mpmath.mpf) -> Multivector:
    return a.map(lambda x: x * number)


def off(a: Multivector, b: Multivector) -> mpmath.mpf:
    """The largest difference of coefficients, in units of the last digit of the largest one."""
    largest = max(map(abs, b.terms.values()))
    return max(map(abs, (a - b).terms.values()), default=0) / (mpmath.eps * largest)


@pytest.mark.parametrize("angle", ["0.3", "1.5", "1e-9", "30"])
@pytest.mark.parametrize("sign", [1, -1])
def test_screws(angle: str, sign: int) -> None:
    """``cos + sin B`` times a translation, up to its sign, has the logarithm with the smallest angle."""
    e1, e2, e3, e0 = PGA3.basis()
    with mpmath.workdps(50):
        size, shift = mpmath.mpf(angle), mpmath.mpf("0.7")
        turn, move = e1 * e2, scaled(e3 * e0, shift)
        screw = (PGA3.scalar(mpmath.cos(size)) + scaled(turn, mpmath.sin(size))) * (PGA3.scalar(mpmath.mpf(1)) + move)
        assert off(exp(scaled(turn, size) + move), screw) < 4
        least = size - mpmath.pi * mpmath.nint(size / mpmath.pi)
        assert off(log(scaled(screw, sign)), scaled(turn, least) + move) < 100


@pytest.mark.parametrize("size", ["0.3", "20"])
def test_boosts(size: str) -> None:
    """Rounding of the hyperbolic functions changes the logarithm by the square of the cosine."""
    *_, plus, minus = CGA3.basis()
    with mpmath.workdps(50):
        boost = scaled(plus ^ minus, mpmath.mpf(size))
        length = mpmath.sqrt((boost * boost).scalar)
        cosine = mpmath.cosh(length)
        truth = CGA3.scalar(cosine) + scaled(boost, mpmath.sinh(length) / length)
        assert off(exp(boost), truth) < 4 and off(log(truth), boost) < 4 * cosine**2
