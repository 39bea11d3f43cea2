"""Polynomials and constants for the transcendental functions of kernels, in double and in float.

Each function is reduced to a short interval, where what remains after its first terms is a polynomial in ``z``. The
coefficients interpolate at the nodes of Chebyshev, to 50 digits, and are then rounded; they are computed here and not
copied, so that whoever doubts one can compute it again. `gac_runtime.h` and
`gac_runtime/jit` have them as numbers, which a test compares with these.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import mpmath

FARTHEST = 65536
"""Sines and cosines of larger arguments are the C library's. A multiple of pi/2 up to there has 16 bits, so that three
numbers of pi/2 are enough of it."""

_DIGITS = 50


@dataclass(frozen=True, slots=True)
class Approximation:
    """A function that is nearly a polynomial, and how many terms stand for it.

    Attributes
    ----------
    function : callable
        What it is of `z`, a hypergeometric function.
    interval : callable
        Between which two numbers `z` lies.
    n_double, n_float : int
        How many coefficients each precision takes: as few as leave less than a quarter of a unit in the last place.
    """

    function: Callable[[Any], Any]
    interval: Callable[[], tuple[Any, Any]]
    n_double: int
    n_float: int


APPROXIMATIONS = {
    # (sin(r)/r - 1)/z and (cos(r) - 1 + z/2)/z^2, z = r^2, for |r| up to an eighth of a turn.
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
    # (atan(t)/t - 1)/t^2, z = t^2 - 1/2, for t up to 1: around there each term is a third of the one before, or less.
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
        fitted = mpmath.chebyfit(approximation.function, approximation.interval(), n)
        return tuple(rounded(c, double=double) for c in reversed(fitted))


@cache
def numbers(*, double: bool) -> dict[str, float]:
    """The constants of the functions in a precision: a quarter of a turn and the logarithm of 2, in parts."""
    with mpmath.workdps(_DIGITS):
        inverses = {"quarter_inverse": 2 / mpmath.pi, "log_inverse": 1 / mpmath.log(2)}
        known = {name: rounded(value, double=double) for name, value in inverses.items()}
        for name, value, n in (("quarter", mpmath.pi / 2, 3), ("log", mpmath.log(2), 2)):
            known |= {f"{name}_{k}": part for k, part in enumerate(_parts(value, n, double=double))}
    return known


def rounded(value: Any, *, double: bool) -> float:
    """`value` as the nearest double, or the nearest float."""
    return float(value) if double else float(struct.unpack("f", struct.pack("f", float(value)))[0])


def _parts(value: Any, n: int, *, double: bool) -> list[float]:
    """`value` as a sum of so many numbers, each the nearest to what the ones before it leave."""
    found = []
    for _ in range(n):
        found.append(rounded(value, double=double))
        value -= found[-1]
    return found
