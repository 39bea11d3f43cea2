"""Covariance matrices and their upper triangles, which kernels use."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..arguments import Reals

_SMALLEST = 1e-14
"""Eigenvalues of covariances are at least this fraction of the largest one."""


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


def as_definite(matrix: Reals) -> tuple[Reals, bool]:
    """Return the nearest symmetric positive semidefinite matrix, and whether the matrix is one.

    An indefinite matrix gets small positive eigenvalues instead of those that are not positive.
    """
    symmetric = (matrix + matrix.T) / 2
    values, vectors = np.linalg.eigh(symmetric)
    largest = max(float(values[-1]), 0.0) if len(values) else 0.0
    if not len(values) or values[0] >= -1e-9 * largest:
        return symmetric, True
    kept = np.maximum(values, _SMALLEST * largest)
    return (vectors * kept) @ vectors.T, False
