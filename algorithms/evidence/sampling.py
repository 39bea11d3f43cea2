"""Reproducible random sets of items for robust estimates."""

from __future__ import annotations

from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray


def random_sets(n_items: int, size: int, count: int) -> NDArray[np.intp]:
    """Return `count` sets (count, size) of different items out of `n_items`; they depend only on these numbers."""
    order = np.random.default_rng(n_items).random((count, n_items))
    return np.argpartition(order, size - 1, axis=1)[:, :size]


def random_subsets(rng: np.random.Generator, n_items: int, size: int, count: int) -> NDArray[np.intp]:
    """Return `count` sets (count, size) of different items, all equally likely (Floyd's algorithm)."""
    sets = np.empty((count, size), np.intp)
    for k in range(size):
        last = n_items - size + k
        drawn = rng.integers(0, last + 1, count)
        sets[:, k] = np.where((sets[:, :k] == drawn[:, None]).any(1), last, drawn)
    return sets


def all_or_some_sets(n_items: int, size: int, most: int) -> NDArray[np.intp]:
    """Return all sets (k, size) of different items if there are at most `most`, or else `most` random ones."""
    if comb(n_items, size) <= most:
        return np.array(list(combinations(range(n_items), size)), np.intp).reshape(-1, size)
    return random_sets(n_items, size, most)
