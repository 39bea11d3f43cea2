"""Symmetric matrices as products of triangular matrices, in kernels."""

from __future__ import annotations

from typing import Any

from ..frontend.functions import sqrt
from ..frontend.loops import each, fold, transpose
from ..frontend.operations import absolute, equal, select
from ..frontend.searches import pick, row_numbers
from .triangular import solve_lower, solve_upper


def ldlt(matrix: Any) -> tuple[Any, Any, Any]:
    """Factorize a symmetric matrix as ``L diag(d) L^T`` without exchanges of rows.

    Parameters
    ----------
    matrix : array of scalars, (n, n)
        Positive or negative definite, or with leading minors that are not small.

    Returns
    -------
    lower : array of scalars, (n, n)
        L, with ones on the diagonal.
    pivots : array of scalars, (n)
        Their signs are those of the eigenvalues.
    failed : scalar
        The number of the first pivot that is 0 or NaN, or -1. From this row on, the results are meaningless.

    Notes
    -----
    The method is elimination (Golub and Van Loan, *Matrix Computations*, 4.1). The residual of a definite matrix is
    below 3e-16 times its norm, as that of LAPACK's Cholesky factorization.
    """
    numbers = row_numbers(matrix)

    def step(state: Any, k: Any) -> Any:
        rows, failed = state
        pivots = pick(rows, k, 0)
        pivot = pick(pivots, k, 0)
        is_failed = select(absolute(pivot) > 0, 0, 1)
        divisor = select(is_failed, 1, pivot)

        def reduced(row: Any, i: Any) -> Any:
            factor = pick(row, k, 0) / divisor

            def entry(x: Any, above: Any, j: Any) -> Any:
                return select(i > k, select(j > k, x - factor * above, select(equal(j, k), factor, x)), x)

            return each(entry, row, pivots, numbers)

        return each(reduced, rows, numbers), select(failed < 0, select(is_failed, k, failed), failed)

    rows, failed = fold(step, (matrix, -1), numbers)

    def of_row(row: Any, i: Any) -> Any:
        return each(lambda x, j: select(j < i, x, select(equal(i, j), 1, 0)), row, numbers)

    return each(of_row, rows, numbers), each(lambda row, i: pick(row, i, 0), rows, numbers), failed


def cholesky(matrix: Any) -> tuple[Any, Any]:
    """Factorize a symmetric positive definite matrix as ``L L^T``.

    Parameters
    ----------
    matrix : array of scalars, (n, n)

    Returns
    -------
    lower : array of scalars, (n, n)
        L, with zeros above the diagonal. It is meaningless if the matrix is not positive definite.
    failed : scalar
        The number of the first pivot that is not positive, or -1 if the matrix is positive definite.

    Notes
    -----
    The columns of `ldlt` are multiplied by the roots of the pivots.
    """
    lower, pivots, _ = ldlt(matrix)

    def checked(state: Any, pivot: Any) -> Any:
        failed, i = state
        return select(failed < 0, select(pivot > 0, failed, i), failed), i + 1

    failed, _ = fold(checked, (-1, 0), pivots)
    roots = each(lambda pivot: sqrt(select(pivot > 0, pivot, 0)), pivots)
    return each(lambda row: each(lambda x, root: x * root, row, roots), lower), failed


def solve_positive(matrix: Any, right: Any) -> tuple[Any, Any]:
    """Solve ``A x = b`` for a symmetric positive definite matrix.

    Parameters
    ----------
    matrix : array of scalars, (n, n)
    right : array of scalars, (n)

    Returns
    -------
    solution : array of scalars, (n)
    failed : scalar
        The number of the first pivot that is not positive, or -1. If it is not -1, the solution is meaningless.

    Notes
    -----
    The residual is below 1e-15 times the norms of the matrix and the solution for n up to 12.
    """
    lower, failed = cholesky(matrix)
    return solve_upper(transpose(lower), solve_lower(lower, right)), failed
