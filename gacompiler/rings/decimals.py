"""Real numbers with many digits: decimals, whose arithmetic is compiled and many times faster than that of mpmath.

Definitions and programs are evaluated in decimals; arguments and results are numbers of mpmath. A value that is not
real, such as the root of a negative number, is NaN.
"""

from __future__ import annotations

import decimal
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal
from fractions import Fraction
from typing import Any

import mpmath

from ..algebra.coefficients import binary_to_decimal

GUARD = 5
"""Number of digits in addition to those of the results."""


@contextmanager
def digits(n: int) -> Iterator[None]:
    """Compute with `n` digits, in decimals and in mpmath."""
    traps = [decimal.DivisionByZero]
    context = decimal.Context(n + GUARD, Emin=decimal.MIN_EMIN, Emax=decimal.MAX_EMAX, traps=traps)
    with mpmath.workdps(n), decimal.localcontext(context):
        yield


def to_decimal(value: Any) -> Decimal:
    """Convert a number of Python or mpmath to a decimal of the current precision."""
    if isinstance(value, Decimal):
        return value
    if isinstance(value, float):
        return +Decimal(value)
    if isinstance(value, (int, Fraction)):
        return Decimal(value.numerator) / value.denominator
    if not mpmath.isfinite(value):
        return Decimal(str(float(value)))
    return binary_to_decimal(value if isinstance(value, mpmath.mpf) else mpmath.mpf(value))


def from_decimal(value: Any) -> Any:
    """Convert a decimal to a number of mpmath of the current precision; exact numbers are converted as well.

    Raises
    ------
    ValueError
        If the number is not real.
    """
    if isinstance(value, (int, Fraction)):
        return mpmath.mpf(value.numerator) / value.denominator
    if value.is_nan():
        raise ValueError("a result is not real")
    return mpmath.mpf(str(value)) if value.is_finite() else mpmath.mpf(float(value))
