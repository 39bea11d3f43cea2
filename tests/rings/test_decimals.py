"""Decimals with many digits give the values of mpmath, and refuse what is not real."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import mpmath
import pytest

from gacompiler.algebra.coefficients import divide, scalar_function, scale
from gacompiler.rings.decimals import digits, from_decimal, to_decimal
from tests.support.all_cases import all_cases

FUNCTIONS = ("sqrt", "sin", "cos", "exp", "log", "acos")


@all_cases("name", FUNCTIONS)
@all_cases("number", [Fraction(2, 7), Fraction(1, 2**40), Fraction(99, 100)])
def test_functions_agree_with_mpmath(name: str, number: Fraction) -> None:
    with digits(80):
        found = from_decimal(scalar_function(name, to_decimal(number)))
        expected = getattr(mpmath, name)(mpmath.mpf(number.numerator) / number.denominator)
        assert abs(found - expected) <= mpmath.mpf(10) ** -78 * (1 + abs(expected))


def test_numbers_survive_the_conversion() -> None:
    with digits(60):
        for number in (mpmath.pi, -mpmath.pi / 2**70, mpmath.mpf(2) ** 300, mpmath.mpf(0)):
            assert abs(from_decimal(to_decimal(number)) - number) <= mpmath.mpf(10) ** -59 * abs(number)
        assert from_decimal(to_decimal(mpmath.inf)) == mpmath.inf


def test_exact_factors_and_divisors() -> None:
    with digits(60):
        third = to_decimal(Fraction(1, 3))
        assert abs(scale(third, Fraction(3, 2)) - Decimal("0.5")) < Decimal("1e-60")
        assert abs(divide(Fraction(1, 3), third) - 1) < Decimal("1e-60")


@all_cases("numerator", [0, 1, Fraction(1, 3), Decimal(0), Decimal(2)])
def test_division_by_zero_is_an_error(numerator: object) -> None:
    with digits(60), pytest.raises(ZeroDivisionError):
        divide(numerator, Decimal(0))


@pytest.mark.parametrize(("name", "number"), [("sqrt", -1), ("log", -2), ("acos", 2)])
def test_values_that_are_not_real_are_refused(name: str, number: int) -> None:
    with digits(60):
        found = scalar_function(name, to_decimal(number))
        with pytest.raises(ValueError, match="not real"):
            from_decimal(found * 2 + 1)
        with pytest.raises(ValueError, match="not real"):
            scalar_function("less", found, Decimal(1))
        with pytest.raises(ValueError, match="not real"):
            scalar_function("select", Decimal(1), Decimal(2), found)


@pytest.mark.parametrize("exponent", [10**8, -(10**8)])
def test_exponentials_of_large_numbers_take_no_time(exponent: int) -> None:
    """Their binary exponents are too large for a power of two as an integer."""
    with digits(40):
        value = scalar_function("exp", Decimal(exponent))
        expected = mpmath.exp(exponent)
        assert abs(from_decimal(value) / expected - 1) < mpmath.mpf(10) ** -35
        assert abs(from_decimal(to_decimal(expected)) / expected - 1) < mpmath.mpf(10) ** -35
