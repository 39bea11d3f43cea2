"""Paths of an arm between two configurations: straight, or found by growing two trees."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from ...arguments import Reals

_REACH = 0.6
"""The largest change of a joint along an edge of a tree, in radians."""
_WIDE = 1.6
"""Joints are drawn between those of the ends, extended by this at either side, in radians."""
_SHORTCUTS = 40
"""A limit on work: how often a part of a path is replaced by a segment."""
_GREEDY = 40
"""The largest number of edges by which one tree grows towards a new vertex of the other."""

Free = Callable[[Reals], bool]
"""Determines whether the segments between consecutive points (k, n) are free."""


def find_path(start: Reals, goal: Reals, limits: Reals, free: Free, trials: int, seed: int = 0) -> Reals | None:
    """Find a path between two configurations, the straight one if it is free.

    Otherwise two trees grow from the ends towards random configurations and towards each other (RRT-Connect; Kuffner
    and LaValle, 2000), and the path is shortened.

    Parameters
    ----------
    start, goal : array, (n,)
    limits : array, (n, 2)
        The lowest and the highest value of each variable.
    free : callable
        Determines whether all segments of a polygon (k, n) are free.
    trials : int
        The largest number of random configurations.
    seed : int

    Returns
    -------
    array, (k, n), or None
        The corners of the path, from `start` to `goal`.
    """
    straight = np.stack([start, goal])
    if free(straight):
        return straight
    rng = np.random.default_rng(seed)
    low = np.maximum(limits[:, 0], np.minimum(start, goal) - _WIDE)
    high = np.minimum(limits[:, 1], np.maximum(start, goal) + _WIDE)
    trees = _Tree(start), _Tree(goal)
    for trial in range(trials):
        near, far = trees[trial % 2], trees[1 - trial % 2]
        at = near.grow(rng.uniform(low, high), free)
        if at is None:
            continue
        other = far.connect(near.points[at], free)
        if other is not None and np.array_equal(far.points[other], near.points[at]):
            path = np.concatenate([near.branch(at)[::-1], far.branch(other)[1:]])
            return _shortened(path if near is trees[0] else path[::-1], free, rng)
    return None


def resampled(path: Reals, step: float) -> Reals:
    """Return a polygon with further points, so that no variable changes by more than a step between two of them."""
    rows = [path[:1]]
    for a, b in pairwise(path):
        count = max(1, int(np.ceil(np.abs(b - a).max() / step - 1e-9)))
        shares = np.arange(1, count + 1)[:, None] / count
        rows.append(np.where(shares < 1, a + shares * (b - a), b))
    return np.concatenate(rows)


class _Tree:
    """Configurations that free segments connect to a root. It grows."""

    def __init__(self, root: Reals) -> None:
        self.points = [root]
        self.parents = [-1]

    def grow(self, towards: Reals, free: Free) -> int | None:
        """Add a configuration one edge towards another one, and return its number, or None if the edge is not free."""
        at = int(np.abs(np.array(self.points) - towards).max(1).argmin())
        change = towards - self.points[at]
        size = float(np.abs(change).max())
        new = towards if size <= _REACH else self.points[at] + change * (_REACH / size)
        if size == 0:
            return at
        if not free(np.stack([self.points[at], new])):
            return None
        self.points.append(new)
        self.parents.append(at)
        return len(self.points) - 1

    def connect(self, goal: Reals, free: Free) -> int | None:
        """Grow towards a configuration while edges are free, and return its number if it is reached."""
        for _ in range(_GREEDY):
            at = self.grow(goal, free)
            if at is None or np.array_equal(self.points[at], goal):
                return at
        return None

    def branch(self, at: int) -> Reals:
        """Return the configurations from a number to the root."""
        found = []
        while at >= 0:
            found.append(self.points[at])
            at = self.parents[at]
        return np.array(found)


def _shortened(path: Reals, free: Free, rng: np.random.Generator) -> Reals:
    """Replace parts of a polygon by free segments between random points of it."""
    for _ in range(_SHORTCUTS):
        if len(path) <= 2:
            break
        (i, s), (j, t) = sorted((int(rng.integers(len(path) - 1)), float(rng.uniform())) for _ in range(2))
        if i == j:
            continue
        a, b = path[i] + s * (path[i + 1] - path[i]), path[j] + t * (path[j + 1] - path[j])
        if free(np.stack([a, b])):
            path = np.concatenate([path[: i + 1], a[None], b[None], path[j + 1 :]])
    return path
