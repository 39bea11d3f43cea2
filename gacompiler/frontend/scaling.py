"""Exponentials without a closed form, by scaling and squaring of a Taylor polynomial.

With ``y = exp(x) - 1``, a squaring is ``exp(2 x) - 1 = 2 y + y y``, which keeps the digits of a small `y`. A rounding
error of one squaring is doubled by each of the following: an argument of norm 1000 would lose more than three digits.
Therefore the first squarings use ``y = h + l``, where the coefficients of `h` are multiples of a power of two, about
2**-20 of the largest. Then ``h h`` has no rounding errors, and neither has ``2 h - h'`` with the `h'` of the next step.
The rounding errors of the other products are smaller by the ratio of `l` to `h` (the method of Dekker, *A
floating-point technique for extending the available precision*, 1971, with multivectors in place of numbers).

The number of squarings is fixed for an algebra, because additional squarings do not harm the accuracy of ``2 y + y y``
for small arguments.
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
"""Euclidean norm of the coefficients up to which the argument is guaranteed to be in the valid range."""
PLAIN = 4
"""Number of final squarings that use plain double precision."""
SCALED = Fraction(1, 3)
"""The largest norm for the polynomial, with an error of 1e-17 of the argument."""
HEAD = 3 * 2**31
"""Number that is added to a coefficient of 1, and subtracted again, to round it to its first 20 binary places."""
TAYLOR = tuple(Fraction(1, factorial(k)) for k in range(14))
_EVEN, _ODD = TAYLOR[::2], TAYLOR[1::2]


def exponential_by_squaring(b: Any) -> Any:
    """Return ``exp(b)`` for any element without scalar part, or NaN if its norm may be too large."""
    algebra, blades = b.algebra, sorted(blades_of(b))
    shares = weights(algebra, blades)
    squarings = next(k for k in count(PLAIN) if max(shares) * LARGEST**2 <= (SCALED * 2**k) ** 2)
    size = sum(
        weight * b.coefficient_at(blade) * b.coefficient_at(blade) for weight, blade in zip(shares, blades, strict=True)
    )
    limit = (SCALED * 2**squarings) ** 2
    inside = size <= limit
    nothing = sqrt(limit - size)  # NaN outside the valid range
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
    """Return the Taylor polynomial of ``exp(x) - 1 - x`` to degree 13."""
    z = x * x
    zz = z * z
    zzz = zz * z
    even = z / 2 + zz * _EVEN[2] + zzz * (_EVEN[3] + z * _EVEN[4] + zz * _EVEN[5] + zzz * _EVEN[6])
    odd = z * _ODD[1] + zz * _ODD[2] + zzz * (_ODD[3] + z * _ODD[4] + zz * _ODD[5] + zzz * _ODD[6])
    return even + odd * x


def _head(x: Any, inside: Value, nothing: Value) -> Any:
    """Round all coefficients to multiples of one power of two, so that their products are exact.

    In exact arithmetic, which proofs use, the result is `x`. The selection between two values keeps the optimizer from
    cancelling the number that is added and subtracted.
    """
    blades = sorted(blades_of(x))
    if not blades:
        return x
    largest = reduce(maximum, [absolute(x.coefficient_at(blade)) for blade in blades])
    shift = HEAD * largest * Multivector(x.algebra, dict.fromkeys(blades, 1))
    return select(inside, x + shift, nothing * Multivector(x.algebra, dict.fromkeys(blades, 1))) - shift


def weights(algebra: Algebra, blades: Sequence[int]) -> list[Fraction]:
    """Return weights whose sum with squared coefficients bounds the squared norm of the matrix of multiplication.

    Multiplication by each blade is a matrix of known norm. For bivectors in an orthogonal basis, the norms add up as
    for rotations in separate planes, with real and imaginary angles if squares have both signs. For other elements, all
    matrices may have the same direction.
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
    """Return an upper bound of the norm of multiplication by a blade: the largest absolute row or column sum."""
    columns = [algebra.blade_product(blade, other) for other in algebra.blades()]
    rows: dict[int, Fraction] = {}
    for column in columns:
        for place, value in column.items():
            rows[place] = rows.get(place, Fraction(0)) + abs(Fraction(value))
    return max([_total(column.values()) for column in columns] + [*rows.values()])


def _total(values: Iterable[Any]) -> Fraction:
    return sum((abs(Fraction(value)) for value in values), Fraction(0))
