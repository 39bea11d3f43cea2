"""Simplicial meshes of any dimension in space of any dimension: directed measures, boundaries, vector derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from math import factorial

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import as_given, real_array
from .minors import LARGEST, wedge_rows
from .products import embed, product_of

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class SimplicialMesh:
    """A chain of oriented simplices (points, segments, triangles, tetrahedra, ...), oriented by the order of corners.

    Parameters
    ----------
    points : array_like, (V, n)
        n is at most 12.
    cells : array_like, (C, k + 1)
        Indices of the corners of each simplex. The orientation of a triangle is from its first corner over the second
        to the third.
    weights : array_like, (C,), optional
        Integer multiplicities of the simplices, negative for the opposite orientation; the default is 1.

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent, if points are not finite, or if cells have invalid or repeated indices.
    """

    points: Floats
    cells: Integers
    weights: Integers

    def __init__(self, points: ArrayLike, cells: ArrayLike, weights: ArrayLike | None = None) -> None:
        array = real_array(points, "points", (-1, -1), "points").astype(np.float64, copy=False)
        corners = as_given(cells, "cells")
        if array.ndim != 2 or not 1 <= array.shape[1] <= LARGEST or not np.isfinite(array).all():
            raise ValueError(f"points: shape {array.shape}; expected (V, n), finite, n from 1 to {LARGEST}")
        if corners.dtype.kind not in "iu" or corners.ndim != 2 or not 1 <= corners.shape[1] <= array.shape[1] + 1:
            raise ValueError(
                f"cells: shape {corners.shape}, {corners.dtype}; expected (C, k + 1) indices, k up to {array.shape[1]}"
            )
        corners = corners.astype(np.int64)
        if corners.size and not 0 <= corners.min() <= corners.max() < len(array):
            raise ValueError(f"cells: index {corners.min()} or {corners.max()}; expected 0 to {len(array) - 1}")
        ascending = np.sort(corners, axis=1)
        double = (np.diff(ascending, axis=1) == 0).any(1)
        if double.any():
            raise ValueError(f"cells: {int(np.argmax(double))} has a point twice; expected different ones")
        counts = np.ones(len(corners), np.int64) if weights is None else as_given(weights, "weights")
        if counts.dtype.kind not in "iu" or counts.shape != (len(corners),):
            raise ValueError(f"weights: shape {counts.shape}, {counts.dtype}; expected ({len(corners)},) whole numbers")
        object.__setattr__(self, "points", array)
        object.__setattr__(self, "cells", corners)
        object.__setattr__(self, "weights", counts.astype(np.int64))

    @property
    def n(self) -> int:
        """The dimension of space."""
        return int(self.points.shape[1])

    @property
    def dimension(self) -> int:
        """The dimension k of the simplices."""
        return int(self.cells.shape[1]) - 1

    def edges(self) -> Floats:
        """Return the vectors from the first corner of each cell to the others, ``(C, k, n)``."""
        corners = self.points[self.cells]
        return corners[:, 1:] - corners[:, :1]

    def measures(self) -> Floats:
        """Return the directed measure of each cell: ``edge_1 ^ ... ^ edge_k / k!`` times its weight.

        Returns
        -------
        array, (C, C(n, k))
            Coefficients over basis blades ordered by bitmap.
        """
        k = self.dimension
        return np.asarray(wedge_rows(self.edges(), k) * (self.weights / factorial(k))[:, None])

    def contents(self) -> Floats:
        """Return the nonnegative lengths, areas or volumes of the cells, ``(C,)``, without weights."""
        k = self.dimension
        return np.asarray(np.linalg.norm(wedge_rows(self.edges(), k), axis=1) / factorial(k))

    def boundary_matrix(self) -> tuple[Integers, scipy.sparse.csr_array]:
        """Return the boundary operator: the facets, and their incidence with the cells.

        Returns
        -------
        facets : array, (F, k)
            Corners in ascending order, each facet once.
        matrix : sparse array, (F, C)
            Entries 1 and -1: the facet without corner i has the sign ``(-1)**i`` times that of its permutation.

        Raises
        ------
        ValueError
            If the mesh consists of points, which have no boundary.
        """
        count, size = self.cells.shape
        if size == 1:
            raise ValueError("boundary_matrix: a mesh of points; expected segments or more")
        facets = np.stack([np.delete(self.cells, i, axis=1) for i in range(size)], 1).reshape(-1, size - 1)
        signs = np.tile(1 - 2 * (np.arange(size) & 1), count) * _parity(facets)
        found, where = np.unique(np.sort(facets, axis=1), axis=0, return_inverse=True)
        columns = np.repeat(np.arange(count), size)
        return found, scipy.sparse.csr_array(
            (signs, (where.ravel(), columns)), shape=(len(found), count), dtype=np.int64
        )

    def boundary(self) -> SimplicialMesh:
        """Return the boundary: the facets that do not cancel, oriented with an outward vector first.

        Its boundary is empty. Cells should be oriented consistently, otherwise facets between them remain; see
        `oriented`.
        """
        facets, matrix = self.boundary_matrix()
        weights = matrix @ self.weights
        kept = weights != 0
        return SimplicialMesh(self.points, facets[kept], weights[kept])

    def oriented(self) -> SimplicialMesh:
        """Return the mesh with positive measures, for cells of the dimension of space.

        Raises
        ------
        ValueError
            If the cells have fewer dimensions than space, or if the content of a cell is 0.
        """
        if self.dimension != self.n:
            raise ValueError(f"oriented: cells of dimension {self.dimension} in space of {self.n}; expected the same")
        measure = self.measures()[:, 0]
        if (measure == 0).any():
            raise ValueError(f"oriented: cell {int(np.argmax(measure == 0))} has no content; expected some")
        cells = self.cells.copy()
        flipped = measure < 0
        cells[flipped, :2] = cells[flipped, 1::-1]
        return SimplicialMesh(self.points, cells, np.abs(self.weights))

    def reciprocal_vectors(self) -> Floats:
        """Return the gradients of the barycentric coordinates of each cell, in its span: ``(C, k + 1, n)``.

        The last k are the reciprocal frame of `edges`; the sum of all is 0.

        Raises
        ------
        ValueError
            If the edges of a cell are dependent.
        """
        edges = self.edges()
        sizes = np.linalg.svd(edges, compute_uv=False)
        flat = sizes[:, -1:] <= self.n * np.finfo(np.float64).eps * sizes[:, :1] if self.dimension else np.zeros((0, 1))
        if flat.any():
            raise ValueError(f"reciprocal_vectors: cell {int(np.argmax(flat))} is flat; expected independent edges")
        others = np.swapaxes(np.linalg.pinv(edges), -1, -2)
        return np.concatenate([-others.sum(1, keepdims=True), others], 1)

    def vector_derivative(self, values: ArrayLike, at: str = "cells") -> Floats:
        """Compute the vector derivative ``D F`` of a field that is linear on each cell.

        Parameters
        ----------
        values : array_like, (V, 2**n)
            Multivectors at the points, in full layouts (by grade); `embed` converts scalars and vectors.
        at : "cells" or "points"
            "cells" gives one value for each cell, exact for linear fields; "points" gives the means over the adjacent
            cells, weighted by content.

        Returns
        -------
        array, (C, 2**n) or (V, 2**n)
            The derivative within the mesh: derivatives across a surface are 0. It is 0 at points of no cell.

        Raises
        ------
        TypeError, ValueError
            If shapes are inconsistent, or if a cell is flat.

        Notes
        -----
        With `directed_integral` over a cell, this is the definition of Hestenes and Sobczyk: the integral over the
        boundary divided by the directed measure. The error at cells is of first order in their size.
        """
        array = real_array(values, "values", (1 << self.n,), f"multivectors of {self.n} vectors")
        if array.shape != (len(self.points), 1 << self.n):
            raise ValueError(f"values: shape {array.shape}; expected ({len(self.points)}, {1 << self.n}), one a point")
        if at not in ("cells", "points"):
            raise ValueError(f"at: {at!r}; expected 'cells' or 'points'")
        vectors = embed(self.reciprocal_vectors(), self.n, 1)
        found = np.asarray(product_of(self.n)(vectors, array[self.cells])).sum(1)
        if at == "cells":
            return np.asarray(found)
        contents = self.contents()
        total, weight = np.zeros(array.shape), np.zeros(len(array))
        for corner in self.cells.T:
            np.add.at(total, corner, contents[:, None] * found)
            np.add.at(weight, corner, contents)
        return np.asarray(total / np.where(weight > 0, weight, 1.0)[:, None])


def box_mesh(shape: tuple[int, ...], size: ArrayLike) -> SimplicialMesh:
    """Return a box of any dimension, divided into cells and each of them into n! simplices (Kuhn) of positive measure.

    Parameters
    ----------
    shape : tuple of int
        Number of cells along each axis.
    size : array_like, (n,)
        Lengths of the box, which starts at the origin.
    """
    n = len(shape)
    lengths = real_array(size, "size", (n,), "lengths")
    axes = [np.linspace(0, length, m + 1) for m, length in zip(shape, lengths, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    numbers = np.arange(int(np.prod([m + 1 for m in shape]))).reshape([m + 1 for m in shape])
    strides = [int(s) for s in np.array(numbers.strides) // numbers.itemsize]
    lowest = numbers[tuple(slice(m) for m in shape)].ravel()
    cells = []
    for order, sign in _permutations(n):
        corners = np.cumsum([0, *(strides[axis] for axis in order)])
        if sign < 0:
            corners[[-2, -1]] = corners[[-1, -2]]
        cells.append(lowest[:, None] + corners)
    return SimplicialMesh(grid.reshape(-1, n), np.concatenate(cells))


def _permutations(n: int) -> list[tuple[tuple[int, ...], int]]:
    every = list(permutations(range(n)))
    return list(zip(every, _parity(np.array(every)).tolist(), strict=True))


def _parity(rows: Integers) -> Integers:
    """Return the sign of each row of distinct numbers as a permutation."""
    size = rows.shape[1]
    i, j = np.triu_indices(size, 1)
    inversions = (rows[:, i] > rows[:, j]).sum(1)
    return np.asarray(1 - 2 * (inversions & 1))
