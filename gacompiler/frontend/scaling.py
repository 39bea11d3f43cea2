"""Exponentials without a closed form: Taylor's polynomial of a small part of the argument, and squarings.

With ``y = exp(x) - 1`` a squaring is ``exp(2 x) - 1 = 2 y + y y``, which keeps the digits of a small `y`. A rounding
error of one squaring is doubled by each that follows: an argument of norm 1000 would lose three digits and more. So
the first ones compute with ``y = h + l``, where the coefficients of `h` are multiples of a power of two, about 2**-20
of the largest. Then ``h h`` has no rounding errors, nor has ``2 h - h'`` with the `h'` of the next step, and those of
the other products are as much smaller as `l` is (the method of Dekker, *A floating-point technique for extending the
available precision*, 1971, with whole multivectors in place of numbers).

The number of squarings is fixed for an algebra, because ``2 y + y y`` takes as many from small arguments without harm.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import reduce
from itertools import count
from math import factorial
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.multivector import Multivector
from .operations import absolute, maximum, select, sqrt
from .squares import Value, blades_of

LARGEST = 1024
"""Roots of sums of squared coefficients up to this are inside for certain."""
PLAIN = 4
"""So many squarings at the end are not worth two parts."""
SCALED = Fraction(1, 3)
"""The largest norm that the polynomial takes, to 1e-17 of the argument."""
HEAD = 3 * 2**31
"""What is added to a coefficient of 1 to leave its first 20 binary places."""
TAYLOR = tuple(Fraction(1, factorial(k)) for k in range(14))
_EVEN, _ODD = TAYLOR[::2], TAYLOR[1::2]


def exponential_by_squaring(b: Any) -> Any:
    """``exp(b)`` of any element without scalar part; not a number where its norm may be too large."""
    algebra, blades = b.algebra, sorted(blades_of(b))
    shares = weights(algebra, blades)
    squarings = next(k for k in count(PLAIN) if max(shares) * LARGEST**2 <= (SCALED * 2**k) ** 2)
    size = sum(weight * b[blade] * b[blade] for weight, blade in zip(shares, blades, strict=True))
    limit = (SCALED * 2**squarings) ** 2
    inside = size <= limit
    nothing = sqrt(limit - size)  # not a number outside
    small = b / 2**squarings
    rest = _without_first(small)
    head = _head(small + rest, inside, nothing)
    tail = (small - head) + rest
    for _ in range(squarings - PLAIN):
        square = head * head
        error = 2 * tail + head * tail + tail * (head + tail)
        following = _head(2 * head + square + error, inside, nothing)
        head, tail = following, ((2 * head - following) + square) + error
    y = head + tail
    for _ in range(PLAIN):
        y = 2 * y + y * y
    return 1 + y


def _without_first(x: Any) -> Any:
    """``exp(x) - 1 - x`` to degree 13."""
    z = x * x
    zz = z * z
    zzz = zz * z
    even = z / 2 + zz * _EVEN[2] + zzz * (_EVEN[3] + z * _EVEN[4] + zz * _EVEN[5] + zzz * _EVEN[6])
    odd = z * _ODD[1] + zz * _ODD[2] + zzz * (_ODD[3] + z * _ODD[4] + zz * _ODD[5] + zzz * _ODD[6])
    return even + odd * x


def _head(x: Any, inside: Value, nothing: Value) -> Any:
    """The first places of all coefficients: the same multiples for all, so that products of them are exact.

    To exact arithmetic, which knows no rounding, this is `x`; so it is to proofs. The choice between two values keeps
    the optimiser from taking away what was added.
    """
    blades = sorted(blades_of(x))
    if not blades:
        return x
    largest = reduce(maximum, [absolute(x[blade]) for blade in blades])
    shift = HEAD * largest * Multivector(x.algebra, dict.fromkeys(blades, 1))
    return select(inside, x + shift, nothing * Multivector(x.algebra, dict.fromkeys(blades, 1))) - shift


def weights(algebra: Algebra, blades: Sequence[int]) -> list[Fraction]:
    """What makes a sum of squared coefficients at least the square of the norm of the matrix that multiplies by them.

    Each blade multiplies by a matrix of known norm. Those of bivectors of an orthogonal basis add up as rotations in
    planes of their own do, of real and of imaginary angles where squares have both signs; any others may all have the
    same direction.
    """
    n, gram = algebra.dimension, algebra.gram
    flat = all(blade.bit_count() == 2 for blade in blades) and not any(gram[i][j] for i in range(n) for j in range(i))
    planes = n // 2 * (1 + _has_both_signs(algebra))
    number = min(len(blades), planes) if flat else len(blades)
    return [number * _norm_of_blade(algebra, blade) ** 2 for blade in blades]


def _has_both_signs(algebra: Algebra) -> bool:
    squares = [algebra.gram[k][k] for k in range(algebra.dimension)]
    return min(squares) < 0 < max(squares)


def _norm_of_blade(algebra: Algebra, blade: int) -> Fraction:
    """The largest sum of sizes in a row or a column of the matrix that multiplies by a blade: at least its norm."""
    columns = [algebra.blade_product(blade, other) for other in algebra.blades()]
    rows: dict[int, Fraction] = {}
    for column in columns:
        for place, value in column.items():
            rows[place] = rows.get(place, Fraction(0)) + abs(Fraction(value))
    return max([_total(column.values()) for column in columns] + [*rows.values()])


def _total(values: Iterable[Any]) -> Fraction:
    return sum((abs(Fraction(value)) for value in values), Fraction(0))
