"""Sparse normal equations whose parts have few parameters each: their sum, steps, and columns of the inverse."""

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

    Parameters
    ----------
    tables : sequence of array, (m, p) of int
        The parameters of parts, -1 for those that are held. Parts of one table are computed together.
    n : int
        The number of parameters.
    """

    def __init__(self, tables: Sequence[Reals], n: int) -> None:
        self.n, self._tables = n, [np.asarray(table, np.int64) for table in tables]
        keys = [table[:, :, None] + n * table[:, None, :] for table in self._tables]
        usable = [(table[:, :, None] >= 0) & (table[:, None, :] >= 0) for table in self._tables]
        diagonal = np.arange(n) * (n + 1)
        every = np.concatenate([*(key[use] for key, use in zip(keys, usable, strict=True)), diagonal])
        found, place = np.unique(every, return_inverse=True)
        self._indices = found % max(n, 1)
        self._starts = np.searchsorted(found, n * np.arange(n + 1))
        self._diagonal = place[len(every) - n :]
        sizes = np.cumsum([0, *(int(use.sum()) for use in usable)])
        self._places = []
        for use, start, end in zip(usable, sizes[:-1], sizes[1:], strict=True):
            # What is held is added to one more entry, which is dropped.
            where = np.full(use.shape, len(found))
            where[use] = place[start:end]
            self._places.append(where)

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

    def step(self, parts: Parts, damping: float, least: float = 0.0) -> Reals | None:
        """Return the damped Gauss-Newton step (n,), or None if the equations are singular."""
        if not self.n:
            return np.zeros(0)
        factor = factorized(self.matrix(parts, damping, least))
        return None if factor is None else np.asarray(-factor.solve(self.gradient(parts)))

    def factor(self, parts: Parts, damping: float = 0.0, least: float = 0.0) -> Factor | None:
        """Return the factors of the sum of products, or None if it is singular."""
        return factorized(self.matrix(parts, damping, least)) if self.n else None


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
