"""Metrics: the inner products of basis vectors, as callers hand them in."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import real_array
from .blade import Floats

_SINGULAR = 1e-12
"""An eigenvalue below this, of the largest, is zero."""


def gram_matrix(gram: ArrayLike | None, n: int) -> Floats:
    """The Gram matrix of `n` vectors: from squares ``(n,)``, from the whole matrix ``(n, n)``, or Euclidean for None.

    Raises
    ------
    TypeError, ValueError
        Where it is not real and symmetric, or not of `n` vectors.
    """
    if gram is None:
        return np.eye(n)
    array = real_array(gram, "gram").astype(np.float64)
    matrix = np.diag(array) if array.ndim == 1 else array
    if matrix.shape != (n, n) or not np.isfinite(matrix).all():
        raise ValueError(f"gram: shape {array.shape}; expected ({n},) squares or ({n}, {n}) finite inner products")
    if np.abs(matrix - matrix.T).max() > _SINGULAR * np.abs(matrix).max():
        raise ValueError("gram: a matrix that is not symmetric; expected inner products")
    return np.asarray((matrix + matrix.T) / 2)


def is_degenerate(gram: Floats) -> bool:
    """Whether some vector is orthogonal to all."""
    sizes = np.abs(np.linalg.eigvalsh(gram))
    return bool(sizes.min() <= _SINGULAR * max(sizes.max(), 1e-300))


def nullity(gram: Floats) -> int:
    """The dimension of the vectors that are orthogonal to all."""
    sizes = np.abs(np.linalg.eigvalsh(gram))
    return int((sizes <= _SINGULAR * sizes.max()).sum())
