"""Eigenvalues and eigenvectors of symmetric matrices of any size, in kernels."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

from ..frontend.equations import nonzero
from ..frontend.functions import sqrt
from ..frontend.loops import each, fold, scan, total, transpose
from ..frontend.operations import absolute, equal, select
from ..frontend.searches import pick, row_numbers
from .products import dot, identity
from .reflections import reflect_columns, reflector
from .rotations import (
    LEAST,
    Turns,
    diagonal_of,
    diagonalized,
    following,
    is_valid,
    ordered,
    places,
    scaled,
    shift_of_block,
)

TINY = Fraction(1, 2**60)
"""The least entry that is divided by, beside 1. Replacing a smaller one changes the matrix by less than a rounding, and
its square does not underflow in single precision. Entries beside the diagonal below 16 times this are removed."""


class _Chase(NamedTuple):
    """What rotations of a row pass to the next.

    `lead` is the pivot of the row times the cosine of the row before, `cosine` and `sine` are squares, the latter with
    the sign of the sine, `ratio` is the inverse of the first, and `length` the square of the rotated column's length.
    `turn` is the sign of the pivot and `sign` that of the cosine.
    """

    lead: Any
    cosine: Any
    sine: Any
    ratio: Any
    length: Any
    turn: Any
    sign: Any
    last_sine: Any


class _Tridiagonal(NamedTuple):
    """A tridiagonal matrix: its diagonal, and the square of the entry to the left of it in each row.

    The square has the sign of the entry. In the first row, there is none, and the square is 0.
    """

    diagonal: Any
    beside: Any


def eigenvalues(matrix: Any) -> tuple[Any, Any]:
    """Compute the eigenvalues of a symmetric matrix, in ascending order.

    Parameters
    ----------
    matrix : array of scalars, (n, n)

    Returns
    -------
    values : array of scalars, (n)
    converged : scalar
        1 if the result is valid. It is 0 if a number of the matrix is not finite.

    Notes
    -----
    The method is that of `eigenvectors`, without the operations that only the eigenvectors need.
    """
    small, size = scaled(matrix)
    start, _ = _tridiagonal(small, None)
    found, converged = diagonal_of(start, _step)
    values = ordered(each(lambda x: x * size, found), places(found))
    return values, is_valid(converged, found)


def eigenvectors(matrix: Any) -> tuple[Any, Any, Any]:
    """Compute the eigenvalues of a symmetric matrix, in ascending order, and an orthonormal basis of eigenvectors.

    Parameters
    ----------
    matrix : array of scalars, (n, n)

    Returns
    -------
    values : array of scalars, (n)
    vectors : array of scalars, (n, n)
        Eigenvectors as columns, so that ``matrix = vectors diag(values) vectors^T``. Their signs are arbitrary, and so
        is the basis of the eigenspace of a repeated eigenvalue.
    converged : scalar
        1 if the results are valid. It is 0 if a number of the matrix is not finite.

    Notes
    -----
    Reflections make the matrix tridiagonal, and steps of the QR algorithm with Wilkinson's shift diagonal (Golub and
    Van Loan, *Matrix Computations*, 8.3; Parlett, *The Symmetric Eigenvalue Problem*, 8.15). About two steps are needed
    for each row. For n up to 16, and for equal, nearly equal and graded eigenvalues, the residual is below 7e-15 times
    the norm of the matrix, and ``vectors^T vectors - 1`` below 1e-14, in double precision. Both are at most twice those
    of LAPACK. `eigenvectors_symmetric` is faster for 2, 3 and 4 rows.
    """
    small, size = scaled(matrix)
    found, basis, converged = diagonalized(*_tridiagonal(small, identity(matrix)), _step)
    order = places(found)
    values = ordered(each(lambda x: x * size, found), order)
    return values, each(lambda row: ordered(row, order), transpose(basis)), is_valid(converged, found)


def _tridiagonal(matrix: Any, basis: Any) -> tuple[_Tridiagonal, Any]:
    """Return a similar tridiagonal matrix, and the rows of the basis, if any, after the same reflections."""
    numbers = row_numbers(matrix)

    def step(state: Any, k: Any) -> Any:
        a, *others = state
        v, factor = reflector(pick(a, k, 0), numbers, k + 1, LEAST)
        image = each(lambda row: factor * dot(row, v), a)
        half = factor * dot(v, image) / 2
        w = each(lambda x, y: x - half * y, image, v)
        a = each(lambda row, x, y: each(lambda e, p, q: e - x * q - y * p, row, v, w), a, v, w)
        return (a, *(reflect_columns(other, v, factor) for other in others))

    a, *others = fold(step, (matrix,) if basis is None else (matrix, basis), numbers)
    diagonal = each(lambda row, i: pick(row, i, 0), a, numbers)
    beside = each(lambda row, i: total(lambda x, j: select(equal(j + 1, i), x, 0), row, numbers), a, numbers)
    return _Tridiagonal(diagonal, each(lambda b: b * absolute(b), beside)), others[0] if others else None


def _step(t: _Tridiagonal, firsts: Any) -> tuple[_Tridiagonal, Turns]:
    """Return a tridiagonal matrix after a step of the QR algorithm in every block, and the rotations.

    The squares of cosines and sines are found without square roots (Pal, Walker and Kahan), so that a row waits only
    for divisions of the row before.
    """
    shift = _shift(t)
    besides = following(t.beside)

    def rotated(c: Any, own: Any, beside: Any) -> Any:
        least, found = TINY * c.cosine, c.cosine * (own - shift) - absolute(c.sine) * c.lead
        lead = select(absolute(found) <= least, least, found)
        square = lead * (c.ratio * lead)
        length = square + absolute(beside)
        sign = c.sign * (1 - 2 * (lead < 0))
        next_sign = select(equal(beside, 0), 1, sign)
        ratios = square / length, beside / length, length / square
        return _Chase(lead, *ratios, length, sign, next_sign, c.sine)

    found = scan(rotated, _Chase(0, 1, 0, 1, 0, 1, 1, 0), t.diagonal, besides)

    def changed(carry: Any, own: Any, after: Any, beside: Any, next_lead: Any, c: Any) -> Any:
        last, _ = carry
        is_gap, was_gap = equal(beside, 0), equal(c.last_sine, 0)
        ended = select(was_gap, own, c.lead + shift)
        diagonal = select(is_gap, ended, c.lead + (after - next_lead))
        joined = c.last_sine * c.length * select(is_gap, c.turn, 1)
        cosine = select(is_gap, 1, c.turn * sqrt(c.cosine))
        sine = select(is_gap, 0, sqrt(select(is_gap, 1, absolute(c.sine))))
        row = _Tridiagonal(diagonal, _without_rounding(joined, last.diagonal, diagonal))
        return row, Turns(cosine, select(beside < 0, -sine, sine))

    start = _Tridiagonal(0, 0), Turns(1, 0)
    rows, turns = scan(changed, start, t.diagonal, following(t.diagonal), besides, following(found.lead), found)
    return rows, turns


def _without_rounding(beside: Any, a: Any, b: Any) -> Any:
    """Return a square beside the diagonal, or 0 if its root is at most a rounding of its neighbours there."""
    size, length = absolute(a) + absolute(b), absolute(beside)
    is_rounding = select(equal(size + sqrt(nonzero(length)), size), 1, length <= (16 * TINY) ** 2)
    return select(is_rounding, 0, beside)


def _shift(t: _Tridiagonal) -> Any:
    """Return the shift of the last block that is not yet diagonal."""

    def later(carry: Any, d: Any, b: Any) -> Any:
        before, *block = carry
        return (d, *(select(equal(b, 0), old, new) for old, new in zip(block, (before, b, d), strict=True)))

    _, *block = fold(later, (0, 0, 0, 0), t.diagonal, t.beside)
    return shift_of_block(block[0], absolute(block[1]), block[2])
