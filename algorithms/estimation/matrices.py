"""Covariance matrices that are positive semidefinite."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite, real_array
from ..precision import NEGLIGIBLE, SINGLE

_SMALLEST = 1e-14
"""Eigenvalues of covariances are at least this fraction of the largest one."""


def as_definite(matrices: Reals) -> tuple[Reals, bool]:
    """Return the nearest symmetric positive semidefinite matrices (..., n, n), and whether all given ones are.

    An indefinite matrix gets small positive eigenvalues instead of those that are not positive. A matrix that is not
    symmetric, such as a triangular root, is replaced by its symmetric part.
    """
    turned = np.swapaxes(matrices, -1, -2)
    symmetric = (matrices + turned) / 2
    if not symmetric.size:
        return symmetric, True
    skew, size = np.abs(matrices - turned).max((-1, -2)), np.abs(symmetric).max((-1, -2))
    is_symmetric = not np.any(skew > SINGLE * size)
    values, vectors = np.linalg.eigh(symmetric)
    largest = np.maximum(values[..., -1:], 0)
    bad = values[..., 0] < -NEGLIGIBLE * largest[..., 0]
    if not bad.any():
        return symmetric, is_symmetric
    kept = np.maximum(values, _SMALLEST * largest)
    nearest = (vectors * kept[..., None, :]) @ np.swapaxes(vectors, -1, -2)
    nearest = (nearest + np.swapaxes(nearest, -1, -2)) / 2
    return np.where(bad[..., None, None], nearest, symmetric), False


def definite_once(matrix: ArrayLike, name: str, n: int) -> tuple[Reals, bool]:
    """Return what `as_definite` does, for one matrix (n, n); the same noise is usually given again and again.

    Raises
    ------
    TypeError, ValueError
        If the argument is not a matrix (n, n) of finite numbers.
    """
    given = real_array(matrix, name)
    if given.shape != (n, n):
        raise ValueError(f"{name}: shape {given.shape}; expected ({n}, {n})")
    return _known(given.astype(float, copy=False).tobytes(), name, n)


@lru_cache(maxsize=64)
def _known(matrix: bytes, name: str, n: int) -> tuple[Reals, bool]:
    found, definite = as_definite(finite(np.frombuffer(matrix).reshape(n, n), name))
    found.flags.writeable = False
    return found, definite
