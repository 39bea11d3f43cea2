"""Products of matrices and vectors in kernels."""

from __future__ import annotations

from typing import Any

from ..frontend.loops import each, total, transpose
from ..frontend.operations import equal, select
from ..frontend.searches import row_numbers


def dot(x: Any, y: Any) -> Any:
    """Return the sum of the products of two arrays of n scalars."""
    return total(lambda a, b: a * b, x, y)


def times(a: Any, x: Any) -> Any:
    """Return the product of a matrix (n, m) and a vector (m), a vector (n)."""
    return each(lambda row: dot(row, x), a)


def product(a: Any, b: Any) -> Any:
    """Return the product of matrices (n, m) and (m, k), a matrix (n, k)."""
    return each(lambda row: each(lambda column: dot(row, column), transpose(b)), a)


def gram(a: Any) -> Any:
    """Return the products of the columns of a matrix (n, m) with each other, a symmetric matrix (m, m)."""
    columns = transpose(a)
    return each(lambda x: each(lambda y: dot(x, y), columns), columns)


def identity(rows: Any) -> Any:
    """Return the unit matrix (n, n), for an array of n rows."""
    numbers = row_numbers(rows)
    return each(lambda i: each(lambda j: select(equal(i, j), 1, 0), numbers), numbers)
