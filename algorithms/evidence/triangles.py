"""Symmetric matrices and their upper triangles, which kernels use."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..arguments import Reals


@lru_cache(maxsize=100)
def _upper(n: int) -> tuple[Reals, Reals]:
    """Return the places of the entries of a triangle in a flat matrix, and of those of the matrix in a triangle."""
    rows, columns = np.triu_indices(n)
    square = np.zeros((n, n), int)
    square[rows, columns] = square[columns, rows] = np.arange(len(rows))
    return rows * n + columns, square.ravel()


def to_triangle(matrix: Reals) -> Reals:
    """Return the upper triangles of symmetric matrices (..., n, n), row by row."""
    n = matrix.shape[-1]
    return matrix.reshape(*matrix.shape[:-2], n * n)[..., _upper(n)[0]]


def from_triangle(triangle: Reals, n: int) -> Reals:
    """Return the symmetric matrices (..., n, n) with these upper triangles."""
    return triangle[..., _upper(n)[1]].reshape(*triangle.shape[:-1], n, n)
