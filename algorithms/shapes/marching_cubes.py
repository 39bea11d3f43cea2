"""Marching cubes: a triangulated surface of equal values in a volume (section 22.1.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite, finite_number, unmasked
from .cubes import CORNERS, EDGES, Integers, table
from .rasterising import MOST_VOXELS, checked_spacing


@dataclass(frozen=True, eq=False)
class CubeMesh:
    """A triangulated surface.

    Attributes
    ----------
    points : array, (n, 3)
        In the unit of the spacing.
    triangles : array of int, (m, 3)
        Counterclockwise for an observer where values are smaller.
    """

    points: Reals
    triangles: Integers

    def volume(self) -> float:
        """Return the volume inside, if the surface is closed."""
        if not len(self.points):
            return 0.0
        a, b, c = np.moveaxis(self.points[self.triangles], 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)

    def area(self) -> float:
        """Return the sum of the areas of the triangles."""
        a, b, c = np.moveaxis(self.points[self.triangles], 1, 0)
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def marching_cubes(volume: ArrayLike, level: float = 0.5, spacing: ArrayLike = (1, 1, 1)) -> CubeMesh:
    """Triangulate the surface on which a volume, interpolated along the edges of its grid, has a value.

    The surface is closed unless it meets the border of the volume; pad the volume to close it there. Two inside corners
    that are opposite on a face of a cell are separated.

    Parameters
    ----------
    volume : array_like, three axes
        Numbers or booleans.
    level : float, optional
        The value on the surface; greater values are inside.
    spacing : array_like, (3,), optional
        The edges of a voxel.
    """
    values, edges, at = _checked(volume), checked_spacing(spacing), finite_number(level, "level")
    inside = values > at
    points, numbers = _crossings(values, inside, at)
    if not len(points):
        return CubeMesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    cells = [n - 1 for n in values.shape]
    code = np.zeros(cells, np.uint8)
    bits = inside.view(np.uint8)
    for i, (x, y, z) in enumerate(CORNERS):
        code |= bits[x : x + cells[0], y : y + cells[1], z : z + cells[2]] << np.uint8(i)
    return CubeMesh(points * edges, _triangles(code, numbers, values.shape))


def _checked(volume: ArrayLike) -> Reals:
    values = np.asarray(unmasked(volume, "volume"))
    if values.dtype.kind not in "biuf":
        raise TypeError(f"volume: dtype {values.dtype}; expected booleans or real numbers")
    if values.ndim != 3 or min(values.shape) < 2:
        raise ValueError(f"volume: shape {values.shape}; expected three axes of at least 2")
    if values.size > MOST_VOXELS:
        raise ValueError(f"volume: {values.size} voxels of shape {values.shape}; expected at most {MOST_VOXELS}")
    return finite(values, "volume") if values.dtype.kind == "f" else values


def _crossings(values: Reals, inside: Reals, level: float) -> tuple[Reals, Integers]:
    """Return the points on edges of the grid, and for each axis the number of the point after each voxel."""
    points, count = [], 0
    numbers = np.empty((3, values.size), np.int32)
    strides = np.array([values.shape[1] * values.shape[2], values.shape[2], 1])
    flat = values.reshape(-1)
    for axis in range(3):
        here = [slice(None)] * 3
        there = [slice(None)] * 3
        here[axis], there[axis] = slice(None, -1), slice(1, None)
        crossed = np.zeros(values.shape, bool)
        np.not_equal(inside[tuple(here)], inside[tuple(there)], out=crossed[tuple(here)])
        found = np.flatnonzero(crossed)
        start, end = flat[found].astype(float), flat[found + strides[axis]].astype(float)
        place = np.stack(np.unravel_index(found, values.shape), 1).astype(float)
        place[:, axis] += (level - start) / (end - start)
        numbers[axis, found] = np.arange(count, count + len(found), dtype=np.int32)
        points.append(place)
        count += len(found)
    return np.vstack(points), numbers


def _triangles(code: Reals, numbers: Integers, shape: tuple[int, ...]) -> Integers:
    rows = table()
    active = np.flatnonzero((code - np.uint8(1)) < 254)
    codes = code.reshape(-1)[active]
    x, y, z = np.unravel_index(active, code.shape)
    origin = (x * shape[1] + y) * shape[2] + z
    counts = rows.counts[codes]
    total = np.cumsum(counts)
    within = np.arange(total[-1]) - np.repeat(total - counts, counts)
    edges = rows.triangles[np.repeat(rows.starts[codes], counts) + within]
    first = np.array([CORNERS[i] @ [shape[1] * shape[2], shape[2], 1] for i, _ in EDGES])
    voxel = np.repeat(origin, counts)[:, None] + first[edges]
    return np.asarray(numbers[edges >> 2, voxel].astype(np.int64))
