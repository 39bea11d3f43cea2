"""Metrics: validation and properties of the inner products of basis vectors."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import real_array
from ..precision import ROUNDING, TINY
from .blade import Floats


def gram_matrix(gram: ArrayLike | None, n: int) -> Floats:
    """Return the Gram matrix of `n` vectors, from squares ``(n,)``, the matrix ``(n, n)``, or None (Euclidean).

    Raises
    ------
    TypeError, ValueError
        If the matrix is not real and symmetric, or has a wrong shape.
    """
    if gram is None:
        return np.eye(n)
    array = real_array(gram, "gram").astype(np.float64)
    matrix = np.diag(array) if array.ndim == 1 else array
    if matrix.shape != (n, n) or not np.isfinite(matrix).all():
        raise ValueError(f"gram: shape {array.shape}; expected ({n},) squares or ({n}, {n}) finite inner products")
    if np.abs(matrix - matrix.T).max() > ROUNDING * np.abs(matrix).max():
        raise ValueError("gram: matrix not symmetric; expected inner products")
    return np.asarray((matrix + matrix.T) / 2)


def is_degenerate(gram: Floats) -> bool:
    """Return whether some nonzero vector is orthogonal to all vectors."""
    sizes = np.abs(np.linalg.eigvalsh(gram))
    return bool(sizes.min() <= ROUNDING * max(sizes.max(), TINY))


def nullity(gram: Floats) -> int:
    """Return the dimension of the space of vectors that are orthogonal to all vectors."""
    sizes = np.abs(np.linalg.eigvalsh(gram))
    return int((sizes <= ROUNDING * sizes.max()).sum())
