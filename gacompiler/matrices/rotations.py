"""Rotations of neighbouring columns in kernels, from which the steps of the QR algorithm consist.

A step takes all columns from the first to the last. Blocks that are separated by a zero beside the diagonal are rotated
by the same loop, so that nothing is selected by a computed number, and batches run in vector lanes.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

from ..frontend.equations import nonzero
from ..frontend.functions import sqrt
from ..frontend.loops import each, fold, iterate, scan, total
from ..frontend.operations import absolute, equal, maximum, select
from ..frontend.searches import row_numbers
from ..frontend.windows import window

MOST_STEPS = 1000
"""Maximum number of steps. Two or three for each row suffice."""
LEAST = Fraction(1, 10**36)
"""The square of a length that counts as 0 beside 1: smaller squares underflow in single precision."""


class Turns(NamedTuple):
    """The cosines and sines of rotations of each column and the next."""

    cosine: Any
    sine: Any


def diagonalized(start: Any, basis: Any, step: Callable[[Any, Any], tuple[Any, Turns]]) -> tuple[Any, Any, Any]:
    """Repeat a step of the QR algorithm until nothing is beside the diagonal.

    Return the diagonal, the basis after the same rotations of its rows, and whether the steps have converged. `step`
    takes a matrix and `first_of` its diagonal.
    """
    firsts = first_of(start.diagonal)

    def next_step(state: Any) -> Any:
        matrix, turned_basis = state
        matrix, turns = step(matrix, firsts)
        return matrix, turned(turned_basis, turns, firsts)

    (found, basis), converged, _ = iterate(
        next_step, (start, basis), lambda _, new: is_diagonal(new[0].beside), MOST_STEPS
    )
    return found.diagonal, basis, converged


def diagonal_of(start: Any, step: Callable[[Any, Any], tuple[Any, Turns]]) -> tuple[Any, Any]:
    """Return what `diagonalized` does, without a basis."""
    firsts = first_of(start.diagonal)
    found, converged, _ = iterate(
        lambda t: step(t, firsts)[0], start, lambda _, new: is_diagonal(new.beside), MOST_STEPS
    )
    return found.diagonal, converged


def scaled(matrix: Any) -> tuple[Any, Any]:
    """Return a matrix whose largest entry is 1 or -1, and the number by which it was divided."""
    largest = fold(lambda m, row: fold(lambda m, x: maximum(m, absolute(x)), m, row), 0, matrix)
    size = select(equal(largest, 0), 1, largest)
    return each(lambda row: each(lambda x: x / size, row), matrix), size


class _Following(NamedTuple):
    own: Any
    following: Any


def following(rows: Any) -> Any:
    """Return the array whose row i is row i + 1 of an array of scalars, and whose last row is 0."""
    return scan(lambda c, x: _Following(x, c.own), _Following(0, 0), rows, reverse=True).following


def rotation(x: Any, y: Any, is_left_out: Any) -> tuple[Any, Any, Any]:
    """Return the cosine and the sine of the rotation from (x, y) to (length, 0), and the length.

    There is no rotation if it is left out, or the length counts as 0.
    """
    square = x * x + y * y
    is_zero = select(is_left_out, 1, square < LEAST)
    length = sqrt(select(is_zero, 1, square))
    return select(is_zero, 1, x / length), select(is_zero, 0, y / length), select(is_zero, x, length)


def without_rounding(beside: Any, a: Any, b: Any, roundings: int = 1) -> Any:
    """Return an entry beside the diagonal, or 0 if it is at most so many roundings of its neighbours there."""
    size = absolute(a) + absolute(b)
    is_rounding = select(equal(size + absolute(beside) / roundings, size), 1, beside * beside < LEAST)
    return select(is_rounding, 0, beside)


def is_valid(converged: Any, diagonal: Any) -> Any:
    """Return whether the steps have converged to numbers, which are at most the size of the scaled matrix."""
    return select(total(absolute, diagonal) < 1 / LEAST, converged, 0)


def is_diagonal(beside: Any) -> Any:
    """Return whether all entries beside the diagonal are 0 or NaN."""
    return total(lambda x: select(absolute(x) > 0, 1, 0), beside) <= 0


def shift_of_block(a: Any, square: Any, d: Any) -> Any:
    """Return the eigenvalue of ``[[a, b], [b, d]]`` that is nearer to d (Wilkinson), for the square of b."""
    half = (a - d) / 2
    length = sqrt(nonzero(half * half + square))
    return d - square / (half + select(half < 0, -length, length))


class _Moved(NamedTuple):
    found: Any
    passed: Any


def first_of(rows: Any) -> Any:
    """Return an array with a 1 for the first row and zeros for the others."""
    return each(lambda i: select(i > 0, 0, 1), row_numbers(rows))


def turned(basis: Any, turns: Turns, firsts: Any) -> Any:
    """Return a matrix after rotations of its rows, each with the next. The last argument is that of `first_of`."""
    zeros = each(lambda _: 0, firsts)

    def moved(c: Any, own: Any, after: Any, cosine: Any, sine: Any, is_first: Any) -> Any:
        def of_entry(passed: Any, x: Any, y: Any) -> Any:
            first = select(is_first, x, passed)
            return _Moved(cosine * first + sine * y, cosine * y - sine * first)

        return each(of_entry, c.passed, own, after)

    shifted = window(basis, (1,), boundary="nearest")
    return scan(moved, _Moved(zeros, zeros), basis, *shifted, turns.cosine, turns.sine, firsts).found


def places(values: Any) -> Any:
    """Return the place of each value in their ascending order."""
    numbers = row_numbers(values)

    def place(x: Any, i: Any) -> Any:
        def is_before(y: Any, j: Any) -> Any:
            return select(equal(x, y), select(j < i, 1, 0), y < x)

        return total(is_before, values, numbers)

    return each(place, values, numbers)


def ordered(values: Any, order: Any) -> Any:
    """Return values in the order of `places`."""
    return each(lambda i: total(lambda x, place: select(equal(place, i), x, 0), values, order), row_numbers(values))
