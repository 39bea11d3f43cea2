"""Linear equations of a fixed small size, as functions for kernels on nested sequences of scalars.

All functions consist of sums, products, quotients and `select`, so derivatives, proofs and backends need no rules for
them. Matrices are sequences of rows; entries are scalar expressions or numbers, including exact ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

from ..algebra.coefficients import divide
from ..errors import KernelError, OperandError
from .operands import check_matrix, is_sequence
from .operations import absolute, equal, select

Matrix = Sequence[Sequence[Any]]
Rows = list[list[Any]]

LARGEST = 6
"""Maximum number of rows of a matrix, because the size of straight-line code grows with its cube,"""
LARGEST_SYMMETRIC = 8
"""and of one that is symmetric and positive definite, which takes a third of the operations."""
SOLVED_BY_MINORS, INVERTED_BY_MINORS = 2, 4
"""Maximum numbers of rows for which equations are solved, and matrices inverted, by the adjugate without branches."""


def matrix_determinant(matrix: Matrix) -> Any:
    """Compute the determinant of a square matrix as a polynomial in its entries, without division or branches.

    Parameters
    ----------
    matrix : n rows of n scalars
        n from 1 to 6.

    Returns
    -------
    scalar

    Raises
    ------
    KernelError
        If the matrix is not square, or n is not from 1 to 6.

    Notes
    -----
    The method is Laplace's expansion, in which every minor of the first rows is computed once. It takes 2, 9, 28, 75,
    186 products for n from 2 to 6. The error is at most about 1e-15 times the product of the norms of the rows.
    """
    n = _size("matrix_determinant", matrix)
    return _leading_minors(matrix, n)[tuple(range(n))]


def inverse_matrix(matrix: Matrix) -> tuple[tuple[tuple[Any, ...], ...], Any]:
    """Compute the inverse and the determinant of a square matrix.

    Parameters
    ----------
    matrix : n rows of n scalars
        n from 1 to 6.

    Returns
    -------
    inverse : n rows of n scalars
    determinant : scalar
        If it is 0, the matrix has no inverse, and the first result is finite but meaningless.

    Raises
    ------
    KernelError
        If the matrix is not square, or n is not from 1 to 6.

    Notes
    -----
    Up to n = 4 the result is the adjugate divided by the determinant, which share their minors, without branches. It
    takes 6, 30, 92 products for n from 2 to 4. With singular values s1, s2, ... in descending order, the relative error
    is about 1e-16 times s1 / s2 for n = 2, s1**2 / (s2 s3) for n = 3, and s1**3 / (s2 s3 s4) for n = 4. This is as
    accurate as other methods for a moderate condition number, and less accurate than elimination if several singular
    values are small. Elimination is used above n = 4, and for every n by ``solve_linear(matrix, identity)``.
    """
    n = _size("inverse_matrix", matrix)
    if n > INVERTED_BY_MINORS:
        return _eliminate(matrix, [[int(row == column) for column in range(n)] for row in range(n)])
    adjugate, value = _adjugate(matrix)
    scale = divide(1, nonzero(value))
    return tuple(tuple(entry * scale for entry in row) for row in adjugate), value


def solve_linear(matrix: Matrix, right: Sequence[Any]) -> tuple[tuple[Any, ...], Any]:
    """Solve ``matrix x = right``, and compute the determinant of the matrix.

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
        If it is 0, the solution is not unique or does not exist, and the first result is finite but meaningless.

    Raises
    ------
    KernelError
        If the matrix is not square, n is not from 1 to 6, or `right` does not have n rows.

    Notes
    -----
    Up to n = 2 the solution is computed from the adjugate, without branches. From n = 3 it is computed by elimination
    with partial pivoting, in which rows are exchanged by `select` (Golub and Van Loan, *Matrix Computations*, 3.4). The
    residual is below 3e-16 times the norms of matrix and solution, for every condition number. One right side takes 19,
    39, 69, 111 products and 40, 84, 150, 242 selections for n from 3 to 6. (With the adjugate, the residual for n = 3
    and a condition number of 1e6 may be 1e-11.)
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
    """Solve ``matrix x = right`` for a symmetric positive definite matrix, and compute its determinant.

    Parameters
    ----------
    matrix : n rows of n scalars
        n from 1 to 8, positive definite; only the lower triangle is used.
    right : n scalars, or n rows of m scalars
        One right side, or several as the columns of a matrix.

    Returns
    -------
    solution : of the shape of `right`
    determinant : scalar
        The product of the pivots. If the matrix is not positive definite up to rounding, it is not positive or NaN, and
        the first result is meaningless.

    Raises
    ------
    KernelError
        If the matrix is not square, n is not from 1 to 8, or `right` does not have n rows.

    Notes
    -----
    The method is the factorization ``L D L^T`` without pivoting or square roots (Golub and Van Loan, *Matrix
    Computations*, 4.1). It is stable only for positive definite matrices, for which the residual is below 2e-16 times
    the norms of matrix and solution. One right side takes 6, 17, 34, 58, 90, 131, 182 products for n from 2 to 8.
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
    """Return `value`, or 1 where it is 0, as a safe divisor."""
    return select(equal(value, 0), 1, value)


def _size(where: str, matrix: Matrix) -> int:
    is_symmetric = where == "solve_symmetric"
    check_matrix(f"{where}()", matrix, is_symmetric=is_symmetric)
    n, largest = len(matrix), LARGEST_SYMMETRIC if is_symmetric else LARGEST
    if not 1 <= n <= largest or any(len(row) != n for row in matrix):
        sizes = " x ".join(map(str, dict.fromkeys([n, *map(len, matrix)])))
        raise KernelError(f"{where}()", f"a matrix of {sizes}", f"n rows of n scalars, n from 1 to {largest}")
    return n


def _right(where: str, right: Sequence[Any], n: int) -> tuple[Rows, bool]:
    """Return the right sides as rows of a matrix, and whether a single right side is given as a sequence of scalars."""
    if not is_sequence(right):
        raise OperandError(f"{where}()", f"{type(right).__name__} as the right side", f"{n} scalars, or {n} rows")
    is_column = not any(isinstance(entry, (tuple, list)) for entry in right)
    rows = [[entry] for entry in right] if is_column else [list(row) for row in right]
    if len(rows) != n or len({len(row) for row in rows}) != 1:
        raise KernelError(f"{where}()", f"right sides of {len(rows)} rows", f"{n} scalars, or {n} rows of equal length")
    check_matrix(f"{where}()", rows)
    return rows, is_column


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    products = [x * y for x, y in zip(a, b, strict=True)]
    total = products[0]
    for product in products[1:]:
        total = total + product
    return total


def _leading_minors(rows: Matrix, n: int) -> dict[tuple[int, ...], Any]:
    """Return the minors of all given rows by their columns, expanded by the last row from those of the rows before."""
    minors: dict[tuple[int, ...], Any] = {(column,): rows[0][column] for column in range(n)}
    for size in range(2, len(rows) + 1):
        row = rows[size - 1]
        minors = {chosen: _expand(row, chosen, minors) for chosen in combinations(range(n), size)}
    return minors


def _expand(row: Sequence[Any], chosen: Sequence[int], minors: dict[tuple[int, ...], Any], is_last: bool = True) -> Any:
    """Return a minor by Laplace's expansion along its last or first row, from the minors of the other rows."""
    signs = range(len(chosen))
    total: Any = None
    for place in reversed(signs) if is_last else signs:
        others = tuple(column for column in chosen if column != chosen[place])
        product = row[chosen[place]] * minors[others]
        is_negative = (len(chosen) - 1 - place if is_last else place) % 2
        total = product if total is None else total - product if is_negative else total + product
    return total


def _adjugate(matrix: Matrix) -> tuple[Rows, Any]:
    """Return the adjugate of a matrix of at most 4 rows, and its determinant from the same minors."""
    n = len(matrix)
    if n == 1:
        return [[1]], matrix[0][0]
    half = n // 2
    tops, bottoms = _leading_minors(matrix[:half], n), _leading_minors(matrix[half:], n)
    adjugate: Rows = [[None] * n for _ in range(n)]
    for row in range(n):
        # The minors of the half without this row are known; the row is removed from the other half of at most two rows.
        is_upper = row < half
        whole = bottoms if is_upper else tops
        others = [matrix[k] for k in (range(half) if is_upper else range(half, n)) if k != row]
        for column in range(n):
            columns = tuple(k for k in range(n) if k != column)
            minor = _expand(others[0], columns, whole, is_last=not is_upper) if others else whole[columns]
            adjugate[column][row] = -minor if (row + column) % 2 else minor
    return adjugate, _dot(matrix[0], [adjugate[column][0] for column in range(n)])


def _eliminate(matrix: Matrix, right: Rows) -> tuple[tuple[tuple[Any, ...], ...], Any]:
    """Solve by elimination with partial pivoting and back substitution; return the solution and the determinant.

    The determinant is the signed product of the pivots.
    """
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
    """Order rows `k` and `i` by their entries in column `k`, the larger first; negate `value` if they are exchanged.

    After this step for all rows below, the pivot is the largest entry of its column, as in partial pivoting.
    """
    swap = absolute(rows[k][k]) < absolute(rows[i][k])
    upper, lower = rows[k], rows[i]
    rows[k] = [select(swap, b, a) if c >= k else 0 for c, (a, b) in enumerate(zip(upper, lower, strict=True))]
    rows[i] = [select(swap, a, b) if c >= k else 0 for c, (a, b) in enumerate(zip(upper, lower, strict=True))]
    return select(swap, -value, value)
