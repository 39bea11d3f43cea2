"""Linear equations of a fixed small size: functions that kernels are written with, on nested sequences of scalars.

Everything is composed of sums, products, quotients and `select`, so that derivatives, proofs and all backends work by
themselves. Matrices are sequences of rows; entries are scalar expressions or numbers, exact ones too.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

from ..algebra.coefficients import divide
from ..errors import KernelError
from .operations import absolute, equal, select

Matrix = Sequence[Sequence[Any]]
Rows = list[list[Any]]

LARGEST = 6
"""Rows that a matrix may have: straight-line code grows with the cube."""
SOLVED_BY_MINORS, INVERTED_BY_MINORS = 2, 4
"""Rows up to which equations are solved, and matrices inverted, by the adjugate, without branches."""


def matrix_determinant(matrix: Matrix) -> Any:
    """The determinant of a square matrix, a polynomial in its entries: no division, no branch.

    Parameters
    ----------
    matrix : n rows of n scalars
        n from 1 to 6.

    Returns
    -------
    scalar

    Notes
    -----
    Laplace's expansion in which every minor of the first rows is computed once: 2, 9, 28, 75, 186 products for n from
    2 to 6. The error is at most some 1e-15 times the product of the lengths of the rows.
    """
    n = _size("matrix_determinant", matrix)
    return _leading_minors(matrix, n)[tuple(range(n))]


def inverse_matrix(matrix: Matrix) -> tuple[tuple[tuple[Any, ...], ...], Any]:
    """The inverse of a square matrix, with its determinant.

    Parameters
    ----------
    matrix : n rows of n scalars
        n from 1 to 6.

    Returns
    -------
    inverse : n rows of n scalars
    determinant : scalar
        Where it is 0 there is no inverse, and the first result, though finite, means nothing.

    Notes
    -----
    Up to n = 4 the adjugate over the determinant, which share their minors: no branch, and 6, 30, 92 products for n
    from 2 to 4. With singular values s1, s2, ... in descending order, its relative error is some 1e-16 times s1 / s2
    for n = 2, and times s1**2 / (s2 s3) and s1**3 / (s2 s3 s4) above: as good as any where the matrix has a moderate
    condition, and worse than elimination where several of its singular values are small. Above n = 4, and by
    ``solve_linear(matrix, identity)`` always, elimination.
    """
    n = _size("inverse_matrix", matrix)
    if n > INVERTED_BY_MINORS:
        return _eliminate(matrix, [[int(row == column) for column in range(n)] for row in range(n)])
    adjugate, value = _adjugate(matrix)
    scale = divide(1, nonzero(value))
    return tuple(tuple(entry * scale for entry in row) for row in adjugate), value


def solve_linear(matrix: Matrix, right: Sequence[Any]) -> tuple[tuple[Any, ...], Any]:
    """The solution of ``matrix x = right``, with the determinant of the matrix.

    Parameters
    ----------
    matrix : n rows of n scalars
        n from 1 to 6.
    right : n scalars, or n rows of m scalars
        One right side, or several as the columns of a matrix.

    Returns
    -------
    solution : of the shape of `right`
    determinant : scalar
        Where it is 0 there is no single solution, and the first result, though finite, means nothing.

    Notes
    -----
    Up to n = 2 by the adjugate, without branches. From n = 3 by elimination with partial pivoting, where rows change
    places by `select` (Golub and Van Loan, *Matrix Computations*, 3.4): the residual is below 3e-16 times the norms of
    matrix and solution, for every condition. One right side takes 19, 39, 69, 111 products and 40, 84, 150, 242 choices
    for n from 3 to 6. (By the adjugate the residual of 3 rows with a condition of 1e6 may be 1e-11.)
    """
    n = _size("solve_linear", matrix)
    columns, is_column = _right("solve_linear", right, n)
    if n > SOLVED_BY_MINORS:
        solution, value = _eliminate(matrix, columns)
    else:
        adjugate, value = _adjugate(matrix)
        scale = divide(1, nonzero(value))
        solution = tuple(
            tuple(_dot(row, [entries[k] for entries in columns]) * scale for k in range(len(columns[0])))
            for row in adjugate
        )
    return (tuple(row[0] for row in solution) if is_column else solution), value


def solve_symmetric(matrix: Matrix, right: Sequence[Any]) -> tuple[tuple[Any, ...], Any]:
    """The solution of ``matrix x = right`` for a symmetric positive definite matrix, with its determinant.

    Parameters
    ----------
    matrix : n rows of n scalars
        n from 1 to 6, positive definite; only the lower triangle is read.
    right : n scalars, or n rows of m scalars
        One right side, or several as the columns of a matrix.

    Returns
    -------
    solution : of the shape of `right`
    determinant : scalar
        The product of the pivots. It is not positive, or not a number, where the matrix is not positive definite to
        rounding; the first result means nothing there.

    Notes
    -----
    ``L D L^T`` without pivoting and without roots (Golub and Van Loan, *Matrix Computations*, 4.1), stable for positive
    definite matrices only: there the residual is below 2e-16 times the norms of matrix and solution. One right side
    takes 6, 17, 34, 58, 90 products for n from 2 to 6.
    """
    n = _size("solve_symmetric", matrix)
    columns, is_column = _right("solve_symmetric", right, n)
    lower: Rows = [[0] * n for _ in range(n)]  # L below the diagonal
    reciprocals: list[Any] = []
    value: Any = 1
    for j in range(n):
        scaled = [lower[j][k] for k in range(j)]  # row j of L D, which becomes a row of L
        for k in range(j):
            lower[j][k] = scaled[k] * reciprocals[k]
        pivot = matrix[j][j] - _dot(scaled, lower[j][:j]) if j else matrix[j][j]
        reciprocals.append(divide(1, nonzero(pivot)))
        value = pivot * value if j else pivot
        for i in range(j + 1, n):
            lower[i][j] = matrix[i][j] - _dot(lower[i][:j], lower[j][:j]) if j else matrix[i][j]
    solution = [list(row) for row in columns]
    width = range(len(columns[0]))
    for i in range(n):
        for k in range(i):
            solution[i] = [solution[i][c] - lower[i][k] * solution[k][c] for c in width]
    solution = [[entry * reciprocals[i] for entry in row] for i, row in enumerate(solution)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            solution[i] = [solution[i][c] - lower[k][i] * solution[k][c] for c in width]
    return (tuple(row[0] for row in solution) if is_column else tuple(map(tuple, solution))), value


def nonzero(value: Any) -> Any:
    """`value`, or 1 where it is 0: what may be divided by."""
    return select(equal(value, 0), 1, value)


def _size(where: str, matrix: Matrix) -> int:
    n = len(matrix)
    if not 1 <= n <= LARGEST or any(len(row) != n for row in matrix):
        sizes = " x ".join(map(str, dict.fromkeys([n, *map(len, matrix)])))
        raise KernelError(f"{where}()", f"a matrix of {sizes}", f"n rows of n scalars, n from 1 to {LARGEST}")
    return n


def _right(where: str, right: Sequence[Any], n: int) -> tuple[Rows, bool]:
    """Right sides as rows of a matrix, and whether there is a single one given as a sequence of scalars."""
    is_column = not any(isinstance(entry, (tuple, list)) for entry in right)
    rows = [[entry] for entry in right] if is_column else [list(row) for row in right]
    if len(rows) != n or len({len(row) for row in rows}) != 1:
        raise KernelError(f"{where}()", f"right sides of {len(rows)} rows", f"{n} scalars, or {n} rows of equal length")
    return rows, is_column


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    products = [x * y for x, y in zip(a, b, strict=True)]
    total = products[0]
    for product in products[1:]:
        total = total + product
    return total


def _leading_minors(rows: Matrix, n: int) -> dict[tuple[int, ...], Any]:
    """Minors of all of the given rows, by their columns: by the last row, from those of the rows before it."""
    minors: dict[tuple[int, ...], Any] = {(column,): rows[0][column] for column in range(n)}
    for size in range(2, len(rows) + 1):
        row = rows[size - 1]
        minors = {chosen: _expand(row, chosen, minors) for chosen in combinations(range(n), size)}
    return minors


def _expand(row: Sequence[Any], chosen: Sequence[int], minors: dict[tuple[int, ...], Any], is_last: bool = True) -> Any:
    """Laplace's expansion by a row that is the last or the first, from the minors of the others."""
    signs = range(len(chosen))
    total: Any = None
    for place in reversed(signs) if is_last else signs:
        others = tuple(column for column in chosen if column != chosen[place])
        product = row[chosen[place]] * minors[others]
        is_negative = (len(chosen) - 1 - place if is_last else place) % 2
        total = product if total is None else total - product if is_negative else total + product
    return total


def _adjugate(matrix: Matrix) -> tuple[Rows, Any]:
    """The adjugate of a matrix of at most 4 rows, and its determinant from the same minors."""
    n = len(matrix)
    if n == 1:
        return [[1]], matrix[0][0]
    half = n // 2
    tops, bottoms = _leading_minors(matrix[:half], n), _leading_minors(matrix[half:], n)
    adjugate: Rows = [[None] * n for _ in range(n)]
    for row in range(n):
        # The minors of the half without this row are there already; the other half, of two rows at most, loses it.
        is_upper = row < half
        whole = bottoms if is_upper else tops
        others = [matrix[k] for k in (range(half) if is_upper else range(half, n)) if k != row]
        for column in range(n):
            columns = tuple(k for k in range(n) if k != column)
            minor = _expand(others[0], columns, whole, is_last=not is_upper) if others else whole[columns]
            adjugate[column][row] = -minor if (row + column) % 2 else minor
    return adjugate, _dot(matrix[0], [adjugate[column][0] for column in range(n)])


def _eliminate(matrix: Matrix, right: Rows) -> tuple[tuple[tuple[Any, ...], ...], Any]:
    """Elimination with partial pivoting, and substitution back; the determinant is the signed product of the pivots."""
    n = len(matrix)
    rows = [[*entries, *sides] for entries, sides in zip(matrix, right, strict=True)]
    value: Any = 1
    reciprocals = []
    for k in range(n):
        for i in range(k + 1, n):
            value = _order(rows, k, i, value)
        pivot = rows[k][k]
        value = value * pivot
        reciprocals.append(divide(1, nonzero(pivot)))
        for i in range(k + 1, n):
            factor = rows[i][k] * reciprocals[k]
            rows[i] = [
                entry - factor * above if c > k else 0
                for c, (entry, above) in enumerate(zip(rows[i], rows[k], strict=True))
            ]
    for k in reversed(range(n)):
        for c in range(n, len(rows[k])):
            entry = rows[k][c]
            for j in range(k + 1, n):
                entry = entry - rows[k][j] * rows[j][c]
            rows[k][c] = entry * reciprocals[k]
    return tuple(tuple(row[n:]) for row in rows), value


def _order(rows: Rows, k: int, i: int, value: Any) -> Any:
    """Put the row with the larger entry in column `k` at place `k`; `value` changes its sign where they change places.

    After all rows below have had their turn, the pivot is the largest of its column, as partial pivoting wants it.
    """
    swap = absolute(rows[k][k]) < absolute(rows[i][k])
    upper, lower = rows[k], rows[i]
    rows[k] = [select(swap, b, a) if c >= k else 0 for c, (a, b) in enumerate(zip(upper, lower, strict=True))]
    rows[i] = [select(swap, a, b) if c >= k else 0 for c, (a, b) in enumerate(zip(upper, lower, strict=True))]
    return select(swap, -value, value)
