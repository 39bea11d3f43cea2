"""The surroundings of a lidar as cells of equal size, each with the sums of the points in it, and its plane."""

from __future__ import annotations

import numpy as np
import scipy

from generated import lidar as kernels

from ..arguments import Reals
from ..cubes import cube_keys

_FEWEST = 5
"""Points of a cell from which on its plane counts: fewer are on a plane by chance."""
_NEIGHBOURS, _PARALLEL, _OFF = 5, 0.97, 4.0
"""Of the nearest planes, this many are compared with a plane. One of them is to be parallel to it, by the cosine of the
angle between normals, and with its mean on it, within this many deviations of readings: a ring of beams that crosses an
edge is on a plane by chance, which other cells do not continue."""
_MOST = 80
"""A limit on influence: cells with that many points are complete, so that later poses do not move them."""


class PointCells:
    """A map of cells. It has one owner, the odometry, which adds points.

    Parameters
    ----------
    size : float
        The size of cells in metres.
    noise : float
        The standard deviation of readings in metres.
    """

    def __init__(self, size: float, noise: float) -> None:
        self._size, self._noise = size, noise
        self._keys = np.zeros(0, np.int64)
        self._centres = np.zeros((0, 3))
        self._sums = np.zeros((0, 10))
        """Of the points of each cell, relative to its centre: 1, x, y, z, and the six products of coordinates."""
        self.surfaces = np.zeros((0, 5))
        """(k, 5) Planes of cells with a plane, and the variances of their tilts."""
        self._tree: scipy.spatial.cKDTree | None = None

    def __len__(self) -> int:
        """Return the number of cells with a plane."""
        return len(self.surfaces)

    def add(self, points: Reals) -> None:
        """Add points (n, 3) to cells that are not complete."""
        keys, first, inverse = np.unique(cube_keys(points, self._size), return_index=True, return_inverse=True)
        centres = (np.floor(points[first] / self._size) + 0.5) * self._size
        x, y, z = (points - centres[inverse]).T
        terms = (np.ones(len(points)), x, y, z, x * x, x * y, x * z, y * y, y * z, z * z)
        sums = np.stack([np.bincount(inverse, each, len(keys)) for each in terms], 1)
        place = np.searchsorted(self._keys, keys)
        is_old = np.zeros(len(keys), bool)
        inside = place < len(self._keys)
        is_old[inside] = self._keys[place[inside]] == keys[inside]
        rows = place[is_old]
        open_cells = self._sums[rows, 0] < _MOST
        self._sums[rows[open_cells]] += sums[is_old][open_cells]
        new = ~is_old
        self._keys = np.insert(self._keys, place[new], keys[new])
        self._centres = np.insert(self._centres, place[new], centres[new], axis=0)
        self._sums = np.insert(self._sums, place[new], sums[new], axis=0)

    def keep_near(self, place: Reals, distance: float) -> None:
        """Drop cells that are farther from a place than a distance, and fit planes to the others."""
        near = ((self._centres - place) ** 2).sum(1) <= distance * distance
        self._keys, self._centres, self._sums = self._keys[near], self._centres[near], self._sums[near]
        full = self._sums[:, 0] >= _FEWEST
        count, sums, products = np.split(self._sums[full], [1, 4], axis=1)
        sums, products = np.ascontiguousarray(sums), np.ascontiguousarray(products)
        found = kernels.plane_of_points(count[:, 0], sums, products, self._centres[full], self._noise)
        means, surfaces = (np.asarray(each) for each in found)
        is_plane = surfaces[:, 4] >= 0
        means, surfaces = means[is_plane], surfaces[is_plane]
        goes_on = self._continued(means, surfaces)
        self.surfaces = surfaces[goes_on]
        self._tree = scipy.spatial.cKDTree(means[goes_on]) if goes_on.any() else None

    def _continued(self, means: Reals, surfaces: Reals) -> Reals:
        """Return which planes others near by continue."""
        if len(means) < 2:
            return np.zeros(len(means), bool)
        distances, rows = scipy.spatial.cKDTree(means).query(means, k=min(_NEIGHBOURS + 1, len(means)))
        others = rows[:, 1:]
        offsets = np.einsum("ij,ikj->ik", surfaces[:, :3], means[others]) + surfaces[:, 3:4]
        cosines = np.einsum("ij,ikj->ik", surfaces[:, :3], surfaces[others, :3])
        near = distances[:, 1:] < 2 * self._size
        return np.asarray((near & (np.abs(offsets) < _OFF * self._noise) & (np.abs(cosines) > _PARALLEL)).any(1))

    def nearest(self, points: Reals) -> Reals:
        """Return the row of the plane with the nearest mean for each point (n, 3); -1 beyond the size of a cell."""
        if self._tree is None:
            return np.full(len(points), -1.0)
        distances, rows = self._tree.query(points, distance_upper_bound=self._size)
        return np.where(np.isfinite(distances), rows, -1).astype(float)
