"""Reproducible random sets of items for robust estimates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def random_sets(n_items: int, size: int, count: int) -> NDArray[np.intp]:
    """Return `count` sets (count, size) of different items out of `n_items`; they depend only on these numbers."""
    order = np.random.default_rng(n_items).random((count, n_items))
    return np.argpartition(order, size - 1, axis=1)[:, :size]
