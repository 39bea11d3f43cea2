"""Covariance matrices that are positive semidefinite."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals

_SMALLEST = 1e-14
"""Eigenvalues of covariances are at least this fraction of the largest one."""


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
