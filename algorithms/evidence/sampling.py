"""Reproducible random sets of items for robust estimates."""

from __future__ import annotations

from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import samples

from ..arguments import Reals, real_array
from ..precision import TINY

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


def drawn_sets(rng: np.random.Generator, n_items: int, size: int, count: int, scores: Reals | None) -> NDArray[np.intp]:
    """Return `random_subsets`, of which the second half has items with probabilities in the ratio of `scores` (n,).

    The first half is not weighted, so that misleading scores at most double the number of samples that are needed.
    """
    sets = random_subsets(rng, n_items, size, count)
    if scores is None:
        return sets
    sums = np.cumsum(scores)
    by_score = np.searchsorted(sums, sums[-1] * rng.random((count - count // 2, size)), side="right")
    in_order = np.sort(by_score, axis=1)
    fine = (in_order[:, 1:] != in_order[:, :-1]).all(1) & (in_order[:, -1] < n_items)
    sets[count // 2 :][fine] = by_score[fine]
    return sets


def chance_of_right_sets(scores: Reals, right: NDArray[np.bool_], size: int) -> float:
    """Return at least the probability that a set drawn by `scores` (n,) has different items, all of them `right` (n,).

    The items drawn before are at most those with the highest scores.
    """
    some = scores.compress(right)
    if len(some) < size:
        return 0.0
    highest = np.sort(some)[::-1][: size - 1]
    left = some.sum() - np.concatenate([[0.0], np.cumsum(highest)])
    return float(np.prod(np.maximum(left, 0.0) / max(scores.sum(), TINY)))


def checked_scores(scores: ArrayLike | None, n_items: int) -> Reals | None:
    """Return scores (n,) with 1 as the largest, whose sums are in the range of doubles, or None.

    Raises
    ------
    TypeError, ValueError
        If there are not as many as items, or if they are negative, not finite, or all 0.
    """
    if scores is None:
        return None
    array = real_array(scores, "scores", (-1,)).astype(np.float64)
    if array.shape != (n_items,):
        raise ValueError(f"scores: shape {array.shape}; expected ({n_items},), one for each item")
    if n_items and not (np.isfinite(array).all() and array.min() >= 0 and array.max() > 0):
        raise ValueError("scores: negative, not finite, or all 0; expected numbers of 0 or more, and one more than 0")
    return np.asarray(array / array.max(initial=TINY))


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
