"""Singular values and right singular vectors of matrices of any size, in kernels."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..frontend.loops import each, fold, scan, total, transpose
from ..frontend.operations import absolute, equal, maximum, minimum, select
from ..frontend.searches import pick, row_numbers
from .products import identity
from .reflections import reflect_columns, reflected, reflector
from .rotations import (
    LEAST,
    Turns,
    diagonal_of,
    diagonalized,
    following,
    is_valid,
    ordered,
    places,
    rotation,
    scaled,
    shift_of_block,
    without_rounding,
)

ROUNDINGS = 4
"""Roundings that two rotations can leave of an entry that they remove: for fewer, equal values might not converge."""


class _Chase(NamedTuple):
    """What rotations of a row pass to the next: results of the row, and values of the next row before its own."""

    diagonal: Any
    beside: Any
    own: Any
    across: Any
    cosine: Any
    sine: Any
    is_gap: Any


class _Bidiagonal(NamedTuple):
    """An upper bidiagonal matrix: its diagonal, and the entry above it in each column, which is 0 in the first."""

    diagonal: Any
    beside: Any


def singular_values(matrix: Any) -> tuple[Any, Any]:
    """Compute the singular values of a matrix, in descending order.

    Parameters
    ----------
    matrix : array of scalars, (n, m)

    Returns
    -------
    values : array of scalars, (m)
    converged : scalar
        1 if the result is valid. It is 0 if a number of the matrix is not finite.

    Notes
    -----
    The method is that of `singular_vectors`, without the operations that only the vectors need.
    """
    small, size = scaled(matrix)
    start, _ = _bidiagonal(small, None)
    found, converged = diagonal_of(start, _step)
    values = ordered(each(lambda d: size * absolute(d), found), _descending(found))
    return values, is_valid(converged, found)


def singular_vectors(matrix: Any) -> tuple[Any, Any, Any]:
    """Compute the singular values of a matrix, in descending order, and its right singular vectors.

    Parameters
    ----------
    matrix : array of scalars, (n, m)

    Returns
    -------
    values : array of scalars, (m)
    vectors : array of scalars, (m, m)
        Right singular vectors as columns. Their signs are arbitrary. The left ones are the columns of
        ``matrix vectors``, divided by the values.
    converged : scalar
        1 if the results are valid. It is 0 if a number of the matrix is not finite.

    Notes
    -----
    Reflections make the matrix bidiagonal, and steps of the implicit QR algorithm diagonal (Golub and Kahan; *Matrix
    Computations*, 8.6). The shift is 0 if a value of a block is rounding compared with others (Demmel and Kahan). For m
    up to 16, and for equal, zero and graded values, the errors of the values are below 4e-15 times the first. They are
    at most twice those of LAPACK, and 2.3 times if all values are equal.
    """
    values, basis, converged = _diagonal(matrix)
    order = _descending(values)
    return ordered(values, order), each(lambda row: ordered(row, order), transpose(basis)), converged


def null_vector(matrix: Any) -> tuple[Any, Any, Any]:
    """Compute the unit vector x with the smallest norm of ``matrix x``, the last right singular vector.

    Parameters
    ----------
    matrix : array of scalars, (n, m)
        n may be less than m.

    Returns
    -------
    vector : array of scalars, (m)
        Its sign is arbitrary.
    second, last : scalars
        The second smallest and the smallest singular value, divided by the largest. The vector is well determined if
        the first is much larger than both rounding and the second. For a single column, both are 1. Both are 0 if a
        number of the matrix is not finite.

    Notes
    -----
    The method is that of `singular_vectors`. The norm of ``matrix x`` exceeds the smallest possible by at most 2e-15
    times the norm of the matrix, for m up to 12.
    """
    values, basis, is_found = _diagonal(matrix)

    def smallest(carry: Any, x: Any) -> Any:
        least, where, second, most, i = carry
        is_first = i <= 0
        is_less = select(is_first, 1, x < least)
        return (
            select(is_less, x, least), select(is_less, i, where),
            select(is_first, second, select(is_less, least, minimum(second, x))), maximum(most, x), i + 1,
        )  # fmt: skip

    largest = fold(maximum, 0, values)
    least, where, second, _, _ = fold(smallest, (0, -1, largest, 0, 0), values)
    unit = select(equal(largest, 0), 1, largest)
    numbers = row_numbers(values)
    vector = each(lambda row: total(lambda x, i: select(equal(i, where), x, 0), row, numbers), transpose(basis))
    return vector, select(is_found, second / unit, 0), select(is_found, least / unit, 0)


def _diagonal(matrix: Any) -> tuple[Any, Any, Any]:
    """Return the singular values and the right singular vectors as rows, in any order, and whether they are valid."""
    small, size = scaled(matrix)
    found, basis, converged = diagonalized(*_bidiagonal(small, identity(transpose(matrix))), _step)
    return each(lambda d: size * absolute(d), found), basis, is_valid(converged, found)


def _descending(values: Any) -> Any:
    return places(each(lambda d: -absolute(d), values))


def _bidiagonal(matrix: Any, basis: Any) -> tuple[_Bidiagonal, Any]:
    """Return a bidiagonal matrix after reflections, and the basis, if any, after those of the columns."""
    heights, widths = row_numbers(matrix), row_numbers(transpose(matrix))

    def step(state: Any, k: Any) -> Any:
        a, *others = state
        a = reflect_columns(a, *reflector(each(lambda row: pick(row, k, 0), a), heights, k, LEAST))
        own = total(lambda row, i: each(lambda x: select(equal(i, k), x, 0), row), a, heights)
        v, factor = reflector(own, widths, k + 1, LEAST)
        a = each(lambda row: reflected(row, v, factor), a)
        return (a, *(reflect_columns(other, v, factor) for other in others))

    a, *others = fold(step, (matrix,) if basis is None else (matrix, basis), widths)

    def on(row: Any, i: Any, shift: int) -> Any:
        return each(lambda x, j: select(equal(i + shift, j), x, 0), row, widths)

    entries = total(lambda row, i: (on(row, i, 0), on(row, i, 1)), a, heights)
    return _Bidiagonal(*entries), others[0] if others else None


def _step(t: _Bidiagonal, firsts: Any) -> tuple[_Bidiagonal, Turns]:
    """Return a bidiagonal matrix after a step of the QR algorithm in every block, and the rotations of the columns."""
    shift = _shift(t)

    def rotated(carry: Any, own: Any, after: Any, beside: Any, is_first: Any) -> Any:
        c, _ = carry
        a, is_gap = select(is_first, own, c.own), equal(beside, 0)
        x = select(c.is_gap, a - shift / select(equal(a, 0), 1, a), c.across)
        y = select(c.is_gap, beside, c.sine * beside)
        mixed = select(c.is_gap, beside, c.cosine * beside)
        cosine, sine, length = _rotation(x, y, is_gap)
        upper, lower = cosine * mixed - sine * a, cosine * after
        left, right, diagonal = _rotation(cosine * a + sine * mixed, sine * after, is_gap)
        joined = select(c.is_gap, 0, length)
        found = _Chase(
            diagonal, without_rounding(joined, c.diagonal, diagonal, ROUNDINGS), left * lower - right * upper,
            left * upper + right * lower, left, right, is_gap,
        )  # fmt: skip
        return found, Turns(cosine, sine)

    start = _Chase(0, 0, 0, 0, 1, 0, 1), Turns(1, 0)
    found, turns = scan(rotated, start, t.diagonal, following(t.diagonal), following(t.beside), firsts)
    return _Bidiagonal(found.diagonal, found.beside), turns


def _rotation(x: Any, y: Any, is_left_out: Any) -> tuple[Any, Any, Any]:
    """Return what `rotation` returns, for any size of x and y: values far below the first must converge, too."""
    longest = maximum(absolute(x), absolute(y))
    unit = select(longest > 0, longest, 1)
    cosine, sine, length = rotation(x / unit, y / unit, is_left_out)
    return cosine, sine, unit * length


def _shift(t: _Bidiagonal) -> Any:
    """Return the square of the shift: 0, or an eigenvalue of the last block ``B^T B`` that is not yet diagonal."""

    def later(carry: Any, d: Any, b: Any, after: Any) -> Any:
        before, least, most, *block = carry
        is_inside = select(equal(b, 0), select(equal(after, 0), 0, 1), 1)
        size = absolute(d)
        return (
            d,
            select(is_inside, minimum(least, size), least),
            select(is_inside, maximum(most, size + absolute(b)), most),
            *(select(equal(b, 0), old, new) for old, new in zip(block, (before, b, d), strict=True)),
        )  # fmt: skip

    bound = 1 + total(absolute, t.diagonal)
    _, least, most, a, b, d = fold(later, (0, bound, 0, 0, 0, 0), t.diagonal, t.beside, following(t.beside))
    shift = shift_of_block(a * a, (a * b) ** 2, b * b + d * d)
    return select(equal(most + least, most), 0, maximum(shift, 0))
