"""What scans see through: which points of other scans were people or doors, and not walls."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from generated import mapping as kernels

from ..arguments import Reals
from .scan import Scan

_FREE, _BEFORE = 0.97, 0.2
"""A point is in free space if it is nearer than this part of the range of the beam through it, less metres: closer to a
surface, errors of angles and ranges may have moved it there. `sum_of_scores` has the same limits."""


class Sight(NamedTuple):
    """What a scanner sees along each of its beams."""

    closest: Reals
    """(n,) The least range of each beam and its neighbours; 0 where none is measured."""
    angle_min: float
    angle_step: float

    def sees_through(self, points: Reals) -> Reals:
        """Return which points (..., 2) are before all that is seen near the beam through them."""
        return self._compared(points)[0]

    def looks(self, points: Reals) -> Reals:
        """Return (2, ...) whether points are on what ends the free space, and whether they are seen through."""
        through, distances, ranges = self._compared(np.asarray(points, float))
        return np.stack([~through & (_FREE * distances - _BEFORE < ranges), through])

    def _compared(self, points: Reals) -> tuple[Reals, Reals, Reals]:
        """Return what `sees_through` does, the distances of points, and the ranges of the beams through them."""
        distances, angles = (np.asarray(each) for each in kernels.distance_and_angle(points))
        turns = (angles - self.angle_min) * (np.sign(self.angle_step) / (2 * np.pi))
        beams = np.floor((turns - np.floor(turns)) * (2 * np.pi / abs(self.angle_step)) + 0.5).astype(int)
        ranges = np.append(self.closest, 0.0)[np.minimum(beams, len(self.closest))]
        return np.asarray(distances < _FREE * ranges - _BEFORE), distances, ranges


def sight_of(scan: Scan) -> Sight:
    """Return what a scan sees."""
    ranges = np.full(len(scan) + 2, np.inf)
    ranges[1:-1][scan.beams] = scan.ranges[scan.beams]
    least = np.minimum(np.minimum(ranges[:-2], ranges[1:-1]), ranges[2:])
    return Sight(np.where(np.isfinite(least), least, 0.0), scan.angle_min, scan.angle_step)
