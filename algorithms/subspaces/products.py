"""Products of coefficient arrays computed from tables of terms, for any dimension and grade."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated.tables import product_by_table

from . import index_tables as tables

Floats = NDArray[np.float64]
Product = Callable[..., Any]
"""A function of two arrays of coefficients, ``(..., p)`` and ``(..., q)``, whose leading axes broadcast."""


def product_of_terms(left: ArrayLike, right: ArrayLike, sign: ArrayLike, target: ArrayLike, size: int) -> Product:
    """Return the product that adds each term ``sign a[left] b[right]`` to the coefficient `target` of `size`.

    Parameters
    ----------
    left, right, target : array_like of int
        Indices, arrays of equal shape.
    sign : array_like
    size : int
    """
    columns = (np.ascontiguousarray(column, np.int64).reshape(-1) for column in (left, right, target))
    one, other, to = columns
    factors = np.ascontiguousarray(sign, np.float64).reshape(-1)
    product: Product = product_by_table.bind(left=one, right=other, sign=factors, target=to, zero=np.zeros(size))
    return product


@cache
def outer_of_grades(n: int, a: int, b: int) -> Product:
    """Return the outer product of blades of two grades in `n` dimensions."""
    table = tables.outer_table(n, a, b)
    target = np.broadcast_to(np.arange(len(table.left))[:, None], table.left.shape)
    return product_of_terms(table.left, table.right, table.sign, target, len(table.left))


@cache
def outer_by_vector(n: int, grade: int) -> Product:
    """Return the outer product of a blade of a grade below `n` and a vector."""
    table, k = tables.wedge_table(n), grade + 1
    size, start = int(table.size[k]), int(table.start[k])
    terms = slice(start, start + size * k)
    sign = np.tile((-1.0) ** (k - 1 - np.arange(k)), size)
    return product_of_terms(table.rest[terms], table.vector[terms], sign, np.repeat(np.arange(size), k), size)
