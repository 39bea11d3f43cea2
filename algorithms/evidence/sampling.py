"""Reproducible random sets of items for robust estimates."""

from __future__ import annotations

from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray

from generated import samples

from ..arguments import Reals

_LARGEST = 8
"""The number of different numbers that `samples.different` computes."""

Seed = int | np.random.Generator
"""The seed of random numbers, or a generator that goes on; to make one takes as long as many a test."""


def random_sets(n_items: int, size: int, count: int) -> NDArray[np.intp]:
    """Return `count` sets (count, size) of different items out of `n_items`; they depend only on these numbers."""
    order = np.random.default_rng(n_items).random((count, n_items))
    return np.argpartition(order, size - 1, axis=1)[:, :size]


def random_subsets(rng: np.random.Generator, n_items: int, size: int, count: int) -> NDArray[np.intp]:
    """Return `count` sets (count, size) of different items, all equally likely.

    Raises
    ------
    ValueError
        If there are fewer items than a set has.
    """
    if size > n_items:
        raise ValueError(f"size: {size}; expected at most the number of items, {n_items}")
    if size > _LARGEST:
        return rng.permuted(np.tile(np.arange(n_items), (count, 1)), axis=1)[:, :size]
    numbers = np.asarray(samples.different(rng.random((count, _LARGEST)), n_items))
    return numbers[:, :size].astype(np.intp)


def all_or_some_sets(n_items: int, size: int, most: int) -> NDArray[np.intp]:
    """Return all sets (k, size) of different items if there are at most `most`, or else `most` random ones."""
    if comb(n_items, size) <= most:
        return np.array(list(combinations(range(n_items), size)), np.intp).reshape(-1, size)
    return random_sets(n_items, size, most)


def without_copies(*sides: Reals) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the items that are no exact copies of others, and the number of each item among these.

    Noise leaves no two measurements equal, so that copies carry no information; to count them would make a result look
    too certain.

    Parameters
    ----------
    *sides : array, (n, k)
        The numbers of items; copies agree in all of them.

    Returns
    -------
    kept : array of int, (m,)
    again : array of int, (n,)
    """
    n = len(sides[0])
    # Most items differ in the first number.
    first = np.sort(sides[0][:, 0])
    if (first[1:] != first[:-1]).all():
        return np.arange(n), np.arange(n)
    _, kept, again = np.unique(np.concatenate(sides, 1), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(kept)
    return kept[order], np.argsort(order)[again.ravel()]
