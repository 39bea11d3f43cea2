"""Polynomials and constants for the transcendental functions of kernels, in double and in float.

The argument of each function is reduced to a short interval, on which the remainder after the first terms of the
function is approximated by a polynomial in ``z``. The polynomial interpolates at Chebyshev nodes; its coefficients are
computed to 50 digits and then rounded. They are computed here so that they can be verified: `gac_runtime.h` and
`gac_runtime/jit` contain them as numbers, which a test compares with these.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import mpmath

FARTHEST = 65536
"""The largest argument for which sines and cosines are computed by these polynomials; others use the C library. The
multiples of pi/2 up to this limit have at most 16 bits, so that pi/2 as a sum of three numbers is accurate enough."""

_DIGITS = 50


@dataclass(frozen=True, slots=True)
class Approximation:
    """A function and the sizes of the polynomials that approximate it.

    Attributes
    ----------
    function : callable
        The function of `z`, a hypergeometric function.
    interval : callable
        Returns the bounds of `z`.
    n_double, n_float : int
        The number of coefficients for each precision: the smallest for which the error is less than a quarter of a unit
        in the last place.
    """

    function: Callable[[Any], Any]
    interval: Callable[[], tuple[Any, Any]]
    n_double: int
    n_float: int


APPROXIMATIONS = {
    # (sin(r)/r - 1)/z and (cos(r) - 1 + z/2)/z^2, z = r^2, for |r| up to pi/4.
    "sin": Approximation(lambda z: -mpmath.hyper([1], [2, 2.5], -z / 4) / 6, lambda: (0, (mpmath.pi / 4) ** 2), 6, 3),
    "cos": Approximation(lambda z: mpmath.hyper([1], [2.5, 3], -z / 4) / 24, lambda: (0, (mpmath.pi / 4) ** 2), 6, 3),
    # (exp(z) - 1 - z)/z^2 for |z| up to half the logarithm of 2.
    "exp": Approximation(
        lambda z: mpmath.hyper([1], [3], z) / 2, lambda: (-mpmath.log(2) / 2, mpmath.log(2) / 2), 10, 5
    ),
    # (log((1 + s)/(1 - s))/s - 2)/z, z = s^2, for arguments between the root of 1/2 and that of 2.
    "log": Approximation(
        lambda z: 2 * mpmath.hyper([1, 1.5], [2.5], z) / 3,
        lambda: (0, ((mpmath.sqrt(2) - 1) / (mpmath.sqrt(2) + 1)) ** 2),
        7,
        3,
    ),
    # (atan(t)/t - 1)/t^2, z = t^2 - 1/2, for t up to 1. Each term is at most a third of the previous one.
    "atan": Approximation(
        lambda z: -mpmath.hyper([1, 1.5], [2.5], -(z + 0.5)) / 3, lambda: (-mpmath.mpf(0.5), mpmath.mpf(0.5)), 20, 9
    ),
    # (asin(s)/s - 1)/z, z = s^2, for s up to 1/2.
    "asin": Approximation(
        lambda z: mpmath.hyper([1, 1.5, 1.5], [2, 2.5], z) / 6, lambda: (0, mpmath.mpf(1) / 4), 13, 6
    ),
}


@cache
def coefficients(name: str, *, double: bool) -> tuple[float, ...]:
    """Compute the coefficients of a polynomial, from ``z**0`` upwards, rounded to the precision.

    Parameters
    ----------
    name : str
        A key of `APPROXIMATIONS`.
    double : bool
        Whether the precision is double, else float.

    Returns
    -------
    tuple of float
    """
    approximation = APPROXIMATIONS[name]
    with mpmath.workdps(_DIGITS):
        n = approximation.n_double if double else approximation.n_float
        fitted = mpmath.chebyfit(approximation.function, approximation.interval(), n)
        return tuple(rounded(c, double=double) for c in reversed(fitted))


@cache
def numbers(*, double: bool) -> dict[str, float]:
    """Compute the constants for argument reduction in a precision: pi/2 and log(2) as sums, and their inverses."""
    with mpmath.workdps(_DIGITS):
        inverses = {"quarter_inverse": 2 / mpmath.pi, "log_inverse": 1 / mpmath.log(2)}
        known = {name: rounded(value, double=double) for name, value in inverses.items()}
        for name, value, n in (("quarter", mpmath.pi / 2, 3), ("log", mpmath.log(2), 2)):
            known |= {f"{name}_{k}": part for k, part in enumerate(_parts(value, n, double=double))}
    return known


def rounded(value: Any, *, double: bool) -> float:
    """Round `value` to the nearest double or float."""
    return float(value) if double else float(struct.unpack("f", struct.pack("f", float(value)))[0])


def _parts(value: Any, n: int, *, double: bool) -> list[float]:
    """Split `value` into a sum of `n` numbers, each of which is the rounded remainder after the previous ones."""
    found = []
    for _ in range(n):
        found.append(rounded(value, double=double))
        value -= found[-1]
    return found
