"""Narrow objects in front of others, such as people, who may have moved on by the next scan."""

from __future__ import annotations

import numpy as np

from generated import mapping as kernels

from ..arguments import Reals
from .scan import Scan

JOINED = 0.35
"""Points that are farther apart are not on one surface, in metres."""
NARROW, _IN_FRONT = 0.6, 0.3
"""Objects are left out if they are narrower than the first, and nearer than what is beside them by the second."""


def joined_points(scan: Scan) -> Reals:
    """Return for each pair of neighbouring readings whether they are on one surface, (k - 1,) bool."""
    readings = scan.points(), scan.ranges[scan.beams], scan.beams.astype(float)
    return np.asarray(kernels.surface_begins(*readings, scan.angle_step, JOINED)[1:] == 0)


def narrow_objects(scan: Scan) -> Reals:
    """Return which points are of narrow objects in front of what is beside them, (k,) bool."""
    points = scan.points()
    if len(points) < 3:
        return np.zeros(len(points), bool)
    rules = np.array([JOINED, NARROW, _IN_FRONT])
    found = kernels.narrow_readings(points, scan.ranges[scan.beams], scan.beams.astype(float), scan.angle_step, rules)
    return np.asarray(found, bool)
