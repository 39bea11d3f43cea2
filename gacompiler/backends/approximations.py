"""Polynomials and constants for the transcendental functions of kernels, in double and in float.

Each function is reduced to a short interval, where what remains after its first terms is a polynomial in ``z``. The
coefficients interpolate at the nodes of Chebyshev, to 50 digits, and are then rounded; they are computed here and not
copied, so that whoever doubts one can compute it again. `functions.c.jinja` and `runtime_transcendental.py` use them.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from math import comb, factorial
from typing import Any

import mpmath

FARTHEST = 65536
"""Sines and cosines of larger arguments are the C library's. A multiple of pi/2 up to there has 16 bits."""

_DIGITS = 50
_SPARE = 53 - 16
_TERMS = 120
"""More than any of the series needs on its interval."""


@dataclass(frozen=True, slots=True)
class Approximation:
    """A power series, and the polynomial that stands for it.

    Attributes
    ----------
    term : callable
        The coefficient of ``z**k``.
    interval : callable
        Between which two numbers `z` lies.
    n_double, n_float : int
        How many coefficients each precision takes: as few as leave less than a fifth of a unit in the last place.
    """

    term: Callable[[int], Fraction]
    interval: Callable[[], tuple[Any, Any]]
    n_double: int
    n_float: int


APPROXIMATIONS = {
    # (sin(r)/r - 1)/z and (cos(r) - 1 + z/2)/z^2, z = r^2, for |r| up to an eighth of a turn.
    "sin": Approximation(
        lambda k: Fraction((-1) ** (k + 1), factorial(2 * k + 3)), lambda: (0, (mpmath.pi / 4) ** 2), 6, 3
    ),
    "cos": Approximation(lambda k: Fraction((-1) ** k, factorial(2 * k + 4)), lambda: (0, (mpmath.pi / 4) ** 2), 6, 3),
    # (exp(z) - 1 - z)/z^2 for |z| up to half the logarithm of 2.
    "exp": Approximation(
        lambda k: Fraction(1, factorial(k + 2)), lambda: (-mpmath.log(2) / 2, mpmath.log(2) / 2), 10, 5
    ),
    # (log((1 + s)/(1 - s))/s - 2)/z, z = s^2, for arguments between the root of 1/2 and that of 2.
    "log": Approximation(
        lambda k: Fraction(2, 2 * k + 3),
        lambda: (0, ((mpmath.sqrt(2) - 1) / (mpmath.sqrt(2) + 1)) ** 2),
        7,
        3,
    ),
    # (atan(t)/t - 1)/z, z = t^2, for t up to 0.55: just above tan(1/2), where the spacing of the results doubles.
    "atan": Approximation(lambda k: Fraction((-1) ** (k + 1), 2 * k + 3), lambda: (0, mpmath.mpf("0.55") ** 2), 14, 7),
    # (asin(s)/s - 1)/z, z = s^2, for s up to 1/2.
    "asin": Approximation(
        lambda k: Fraction(comb(2 * k + 2, k + 1), 4 ** (k + 1) * (2 * k + 3)), lambda: (0, mpmath.mpf(1) / 4), 13, 6
    ),
}


def series(name: str, z: Any) -> Any:
    """The function that the polynomial `name` stands for, at `z`, to the working precision of mpmath."""
    return mpmath.polyval(_terms(name, mpmath.mp.prec), z)


@cache
def _terms(name: str, precision: int) -> list[Any]:
    """The terms of a series as numbers of mpmath, the highest first, in the working precision."""
    fractions = [APPROXIMATIONS[name].term(k) for k in range(_TERMS)]
    return [mpmath.mpf(c.numerator) / c.denominator for c in reversed(fractions)]


@cache
def coefficients(name: str, *, double: bool) -> tuple[float, ...]:
    """Of the polynomial `name`, that of ``z**0`` first, each rounded to the precision.

    Parameters
    ----------
    name : str
        One of `APPROXIMATIONS`.
    double : bool
        Whether in double or in float.

    Returns
    -------
    tuple of float
    """
    approximation = APPROXIMATIONS[name]
    with mpmath.workdps(_DIGITS):
        n = approximation.n_double if double else approximation.n_float
        fitted = mpmath.chebyfit(lambda z: series(name, z), approximation.interval(), n)
        return tuple(rounded(c, double=double) for c in reversed(fitted))


@cache
def numbers(*, double: bool) -> dict[str, float]:
    """The constants of the functions in a precision; angles are reduced in double in both."""
    with mpmath.workdps(_DIGITS):
        known = {"log_inverse": rounded(1 / mpmath.log(2), double=double)}
        if double:
            quarter = parts(mpmath.pi / 2, (_SPARE, _SPARE), double=True)
            known |= {"turn_inverse": float(2 / mpmath.pi)} | {f"turn_{k}": part for k, part in enumerate(quarter)}
        for name, value, n_bits in (("log", mpmath.log(2), (15, 41)), ("eighth", mpmath.pi / 4, (20, 48))):
            known[f"{name}_high"], known[f"{name}_low"] = parts(value, (n_bits[double],), double=double)
    return known


def rounded(value: Any, *, double: bool) -> float:
    """`value` as the nearest double, or the nearest float."""
    return float(value) if double else float(struct.unpack("f", struct.pack("f", float(value)))[0])


def parts(value: Any, bits: Sequence[int], *, double: bool) -> tuple[float, ...]:
    """`value` as a sum of numbers of so many bits each, and a last one of the precision."""
    found = []
    for n in bits:
        mantissa, exponent = mpmath.frexp(value)
        part = mpmath.ldexp(mpmath.floor(mpmath.ldexp(mantissa, n)), exponent - n)
        found.append(rounded(part, double=double))
        value -= part
    return (*found, rounded(value, double=double))
