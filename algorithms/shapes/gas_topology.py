"""Graphs of witnesses between nodes, and the Betti numbers of their simplicial complexes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.intp]


def witnessed(nearest: Integers, count: int) -> tuple[Integers, NDArray[np.intp]]:
    """Return the edges (e, 2) between nodes that are nearest to one sample, and how many samples have each.

    Parameters
    ----------
    nearest : int array, (s, k)
        The k nearest nodes of each sample; all pairs of them are edges.
    count : int
        Number of nodes.
    """
    keys = [np.sort(nearest[:, pair], axis=1) @ [count, 1] for pair in combinations(range(nearest.shape[1]), 2)]
    found, times = np.unique(np.concatenate(keys), return_counts=True)
    return np.stack([found // count, found % count], 1), times


def betti_numbers(edges: Integers, count: int) -> tuple[int, int, int]:
    """Return the numbers of parts, of loops and of cavities of the complex of all cliques of a graph.

    They are ranks over the field of two elements: integers are sets of faces, and exclusive or adds them.
    """
    near: list[set[int]] = [set() for _ in range(count)]
    for a, b in edges.tolist():
        near[a].add(b)
        near[b].add(a)
    pairs = [(a, b) for a, b in sorted(map(tuple, edges.tolist()))]
    triangles = [(a, b, c) for a, b in pairs for c in sorted(near[a] & near[b]) if c > b]
    solids = [(*t, d) for t in triangles for d in sorted(near[t[0]] & near[t[1]] & near[t[2]]) if d > t[2]]
    first = _rank(pairs, [(k,) for k in range(count)])
    second = _rank(triangles, pairs)
    third = _rank(solids, triangles)
    return count - first, len(pairs) - first - second, len(triangles) - second - third


def _rank(simplices: Sequence[tuple[int, ...]], faces: Sequence[tuple[int, ...]]) -> int:
    """Return the rank of the boundary map from simplices to their faces."""
    place = {face: k for k, face in enumerate(faces)}
    pivots: dict[int, int] = {}
    for simplex in simplices:
        column = 0
        for face in combinations(simplex, len(simplex) - 1):
            column ^= 1 << place[face]
        while column:
            top = column.bit_length()
            if top not in pivots:
                pivots[top] = column
                break
            column ^= pivots[top]
    return len(pivots)
