"""Sparse normal equations whose parts have few parameters each: their sum, steps, and blocks of the inverse."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from ..arguments import Reals
from .sparse_factors import Factor, factorized, factorized_band

Parts = Sequence[tuple[Reals, Reals, Reals]]
"""For each table of `NormalEquations`: residuals (m, r), their derivatives (m, r, p), and the latter times weights."""


_NARROW = 32
"""A limit on work: LAPACK factorizes bands up to this width without blocks. Products of blocks are spread over threads,
which wait for each other on a busy machine ten times as long as they work."""


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
        rows, columns, sizes = found // max(n_nodes, 1), found % max(n_nodes, 1), np.bincount(node, minlength=n_nodes)
        rank, width = _order(rows, columns, sizes)
        # Nodes are renumbered in the order of elimination.
        node = rank[node]
        self.order = np.argsort(node, kind="stable")
        self.place = np.empty(n, np.int64)
        self.place[self.order] = np.arange(n)
        self._width = width
        if width is None:
            blocks = np.sort(rank[rows] * n_nodes + rank[columns])
            self._set_places(blocks, n_nodes, node, pairs, rank)
        else:
            size = n * (width + 1)
            self._places = [_in_band(table, self.place, width) for table in self._tables]
            self._n_values, self._diagonal = size, np.arange(n) * (width + 1)

    def _set_places(
        self, blocks: Reals, n_nodes: int, node: Reals, pairs: list[tuple[Reals, Reals]], rank: Reals
    ) -> None:
        """Set the places of products in the columns of a sparse matrix."""
        n, sizes = self.n, np.bincount(node, minlength=n_nodes)
        first = np.cumsum(sizes) - sizes
        column, row = blocks // n_nodes, blocks % n_nodes
        # The rows of a column are those of its blocks, one block below the other.
        ends = np.cumsum(sizes[row])
        above = ends - sizes[row]
        starts = above[np.searchsorted(column, np.arange(n_nodes))]
        heights = np.bincount(column, sizes[row], n_nodes).astype(np.int64)
        above = above - starts[column]
        height = np.repeat(heights, sizes)
        self._starts = np.concatenate([[0], np.cumsum(height)])
        rows = np.arange(ends[-1])
        rows = rows - np.repeat(ends - sizes[row] - first[row], sizes[row])
        shift = np.repeat(starts, sizes) - self._starts[:-1]
        self._indices = rows[np.arange(self._starts[-1]) + np.repeat(shift, height)]
        inside = (np.arange(n) - first[node[self.order]])[self.place]
        self._n_values, self._places = len(self._indices), []
        for table, (keys, runs) in zip(self._tables, pairs, strict=True):
            use = (table[:, :, None] >= 0) & (table[:, None, :] >= 0)
            block = np.searchsorted(blocks, rank[keys % n_nodes] * n_nodes + rank[keys // n_nodes])
            base = above[np.where(keys >= 0, np.minimum(block, len(blocks) - 1), 0)][:, runs][:, :, runs]
            where = base + inside[table][:, :, None] + self._starts[self.place[table]][:, None, :]
            self._places.append(np.where(use, where, self._n_values))
        diagonal = above[np.searchsorted(blocks, np.arange(n_nodes) * (n_nodes + 1))]
        self._diagonal = (diagonal[node] + inside + self._starts[self.place])[self.order]

    def _values(self, parts: Parts, damping: float, least: float) -> Reals:
        """Return the entries of the sum of products that are stored."""
        values = np.zeros(self._n_values + 1)
        for (_, rows, weighed), places in zip(parts, self._places, strict=True):
            products = np.swapaxes(rows, 1, 2) @ weighed
            values += np.bincount(places.ravel(), products.ravel(), len(values))
        values = values[:-1]
        values[self._diagonal] = values[self._diagonal] * (1 + damping) + least
        return values

    def matrix(self, parts: Parts) -> Any:
        """Return the sum of products as a sparse array (n, n)."""
        values = self._values(parts, 0.0, 0.0)
        if self._width is None:
            return scipy.sparse.csc_array((values, self._indices, self._starts), shape=(self.n, self.n))
        band = values.reshape(self.n, self._width + 1).T
        lower = scipy.sparse.dia_array((band, -np.arange(self._width + 1)), shape=(self.n, self.n))
        return (lower + lower.T - scipy.sparse.diags_array(band[0])).tocsc()

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
        values = self._values(parts, damping, least)
        found = (
            factorized(scipy.sparse.csc_array((values, self._indices, self._starts), shape=(self.n,) * 2), ordered=True)
            if self._width is None
            else factorized_band(values.reshape(self.n, self._width + 1).T)
        )
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


def _order(rows: Reals, columns: Reals, sizes: Reals) -> tuple[Reals, int | None]:
    """Return the rank of nodes in an order of elimination, and the width of the band in which that is dense.

    The width is None for an order of minimum degree, whose factors are sparse.
    """
    n = len(sizes)
    if n < 2:
        return np.arange(n), max(int(sizes.sum()) - 1, 0)
    graph = scipy.sparse.csc_array((np.where(rows == columns, float(n), 1.0), (rows, columns)), shape=(n, n))
    rank = np.empty(n, np.int64)
    links = scipy.sparse.csr_array(graph)
    rank[scipy.sparse.csgraph.reverse_cuthill_mckee(links, symmetric_mode=True)] = np.arange(n)
    first = np.zeros(n, np.int64)
    order = np.argsort(rank)
    first[order] = np.cumsum(sizes[order]) - sizes[order]
    width = int((first[rows] + sizes[rows] - 1 - first[columns]).max())
    if width <= _NARROW:
        return rank, width
    lu = scipy.sparse.linalg.splu(
        graph, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    return np.asarray(lu.perm_c, np.int64), None


def _in_band(table: Reals, place: Reals, width: int) -> Reals:
    """Return the places of products of the parameters of parts in a band, whose columns are contiguous."""
    at = np.where(table < 0, 0, place[table]) if len(place) else table
    row, column = at[:, :, None], at[:, None, :]
    use = (row >= column) & (table[:, :, None] >= 0) & (table[:, None, :] >= 0)
    return np.where(use, column * width + row, len(place) * (width + 1))


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
