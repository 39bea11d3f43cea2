"""Sparse normal equations whose parts have few parameters each: their sum, steps, and blocks of the inverse."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from ..arguments import Reals
from .sparse_factors import Factor, factorized

Parts = Sequence[tuple[Reals, Reals, Reals]]
"""For each table of `NormalEquations`: residuals (m, r), their derivatives (m, r, p), and the latter times weights."""


class NormalEquations:
    """The places of the products of derivatives in a sparse matrix, for parts that always have the same parameters.

    Parameters are ordered for elimination once, by the nodes of which they are parts. `matrix` has this order;
    all other results have that of the parameters.

    Parameters
    ----------
    tables : sequence of array, (m, p) of int
        The parameters of parts, -1 for those that are held. Parts of one table are computed together.
    nodes : array, (n,) of int
        The node of each parameter, in ascending order, such as the pose that it moves.
    """

    def __init__(self, tables: Sequence[Reals], nodes: Reals) -> None:
        self.n = n = len(nodes)
        self._last: tuple[float, Factor, Parts] | None = None
        self._tables = [np.asarray(table, np.int64) for table in tables]
        _, node = np.unique(nodes, return_inverse=True)
        n_nodes = int(node.max(initial=-1)) + 1
        pairs = [_pairs(np.where(table < 0, -1, node[table]) if n else table, n_nodes) for table in self._tables]
        every = np.concatenate([np.arange(n_nodes) * (n_nodes + 1), *(keys[keys >= 0] for keys, _ in pairs)])
        found = np.unique(every)
        rank = _elimination(found // max(n_nodes, 1), found % max(n_nodes, 1), n_nodes)
        # Nodes are renumbered in the order of elimination.
        node = rank[node]
        self.order = np.argsort(node, kind="stable")
        self.place = np.empty(n, np.int64)
        self.place[self.order] = np.arange(n)
        sizes = np.bincount(node, minlength=n_nodes)
        first = np.cumsum(sizes) - sizes
        blocks = np.sort(rank[found // max(n_nodes, 1)] * n_nodes + rank[found % max(n_nodes, 1)])
        column, row = blocks // max(n_nodes, 1), blocks % max(n_nodes, 1)
        # The rows of a column are those of its blocks, one block below the other.
        ends = np.cumsum(sizes[row])
        above = ends - sizes[row]
        starts = above[np.searchsorted(column, np.arange(n_nodes))] if n_nodes else above
        heights = np.bincount(column, sizes[row], n_nodes).astype(np.int64)
        above = above - starts[column]
        height = np.repeat(heights, sizes)
        self._starts = np.concatenate([[0], np.cumsum(height)])
        rows = np.arange(ends[-1] if len(ends) else 0)
        rows = rows - np.repeat(ends - sizes[row] - first[row], sizes[row])
        shift = np.repeat(starts, sizes) - self._starts[:-1]
        self._indices = rows[np.arange(self._starts[-1]) + np.repeat(shift, height)]
        inside = np.arange(n) - first[node[self.order]] if n else np.zeros(0, np.int64)
        inside = inside[self.place]
        self._places = []
        for table, (keys, runs) in zip(self._tables, pairs, strict=True):
            use = (table[:, :, None] >= 0) & (table[:, None, :] >= 0)
            a, b = keys // max(n_nodes, 1), keys % max(n_nodes, 1)
            block = np.searchsorted(blocks, rank[b] * n_nodes + rank[a]) if n_nodes else keys
            base = above[np.where(keys >= 0, np.minimum(block, len(blocks) - 1), 0)][:, runs][:, :, runs]
            where = base + inside[table][:, :, None] + self._starts[self.place[table]][:, None, :] if n else base
            self._places.append(np.where(use, where, len(self._indices)))
        diagonal = above[np.searchsorted(blocks, np.arange(n_nodes) * (n_nodes + 1))] if n_nodes else above
        self._diagonal = (diagonal[node] + inside + self._starts[self.place] if n else np.zeros(0, np.int64))[
            self.order
        ]

    def matrix(self, parts: Parts, damping: float = 0.0, least: float = 0.0) -> Any:
        """Return the sum of products as a sparse array (n, n), its diagonal increased by a share and a constant."""
        values = np.zeros(len(self._indices) + 1)
        for (_, rows, weighed), places in zip(parts, self._places, strict=True):
            products = np.swapaxes(rows, 1, 2) @ weighed
            values += np.bincount(places.ravel(), products.ravel(), len(values))
        values = values[:-1]
        values[self._diagonal] = values[self._diagonal] * (1 + damping) + least
        return scipy.sparse.csc_array((values, self._indices, self._starts), shape=(self.n, self.n))

    def gradient(self, parts: Parts) -> Reals:
        """Return the derivatives (n,) of half the sum of squares."""
        found = np.zeros(self.n + 1)
        for (residual, _, weighed), table in zip(parts, self._tables, strict=True):
            each = np.swapaxes(weighed, 1, 2) @ residual[:, :, None]
            found += np.bincount(np.where(table < 0, self.n, table).ravel(), each.ravel(), self.n + 1)
        return found[:-1]

    def diagonal(self, parts: Parts) -> Reals:
        """Return the diagonal (n,) of the sum of products."""
        found = np.zeros(self.n + 1)
        for (_, rows, weighed), table in zip(parts, self._tables, strict=True):
            each = np.einsum("mrp,mrp->mp", rows, weighed)
            found += np.bincount(np.where(table < 0, self.n, table).ravel(), each.ravel(), self.n + 1)
        return found[:-1]

    def factor(self, parts: Parts, damping: float = 0.0, least: float = 0.0) -> Factor | None:
        """Return the factors of the sum of products, or None if it is singular."""
        if not self.n:
            return None
        found = factorized(self.matrix(parts, damping, least), ordered=True)
        return None if found is None else Factor(lambda b: found.solve(b[self.order])[self.place])

    def step(self, parts: Parts, damping: float, reused: bool, least: float = 0.0) -> Reals | None:
        """Return the damped Gauss-Newton step (n,), or None if the equations are singular.

        With `reused`, the factors of the last step are used again.
        """
        if not self.n:
            return np.zeros(0)
        last = self.last(damping) if reused else None
        factor = last[0] if last is not None else self.factor(parts, damping, least)
        if factor is None:
            return None
        if last is None:
            self._last = damping, factor, parts
        step = -factor.solve(self.gradient(parts))
        return step if np.isfinite(step).all() else None

    def last(self, damping: float) -> tuple[Factor, Parts] | None:
        """Return the last factors that a step computed, and what they are of, if they had some damping."""
        return self._last[1:] if self._last is not None and self._last[0] == damping else None

    def change(self, parts: Parts, direction: Reals) -> float:
        """Return the square of the derivatives of all residuals along a direction (n,)."""
        padded, found = np.concatenate([direction, [0.0]]), 0.0
        for (_, rows, weighed), table in zip(parts, self._tables, strict=True):
            along = padded[table][:, :, None]
            found += float(((rows @ along) * (weighed @ along)).sum())
        return found


def _pairs(nodes: Reals, n: int) -> tuple[Reals, Reals]:
    """Return keys (m, k, k) of the pairs of nodes of each part, -1 for held ones, and the run (p,) of each parameter.

    Parameters of a run belong to one node in all parts, so that a pair of runs is a pair of nodes.
    """
    p = nodes.shape[1]
    leads = np.ones(p, bool)
    leads[1:] = (nodes[:, 1:] != nodes[:, :-1]).any(0)
    some = nodes[:, leads]
    keys = some[:, :, None] * n + some[:, None, :]
    return np.where((some[:, :, None] >= 0) & (some[:, None, :] >= 0), keys, -1), np.cumsum(leads) - 1


def _elimination(rows: Reals, columns: Reals, n: int) -> Reals:
    """Return the rank of each of n nodes in an order of elimination that keeps factors sparse (minimum degree)."""
    if n < 2:
        return np.arange(n)
    values = np.where(rows == columns, float(n), 1.0)
    graph = scipy.sparse.csc_array((values, (rows, columns)), shape=(n, n))
    return np.asarray(
        scipy.sparse.linalg.splu(
            graph, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        ).perm_c,
        np.int64,
    )


def blocks_of_inverse(factor: Factor, places: Reals, n: int) -> Reals:
    """Return blocks (k, p, p) of the inverse of a matrix (n, n), at rows and columns `places` (k, p).

    Blocks have 0 where a place is -1.
    """
    found = np.zeros((len(places), places.shape[1], places.shape[1]))
    for block, place in zip(found, places, strict=True):
        known = place >= 0
        columns = np.zeros((n, int(known.sum())))
        columns[place[known], np.arange(columns.shape[1])] = 1
        block[np.ix_(known, known)] = factor.solve(columns)[place[known]]
    return found
