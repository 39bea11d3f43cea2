"""Narrow objects in front of others, such as people, who may have moved on by the next scan."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals
from .scan import Scan

_JOINED = 0.35
"""Points that are farther apart are not on one surface, in metres."""
_NARROW, _IN_FRONT = 0.6, 0.3
"""Objects are left out if they are narrower than the first, and nearer than what is beside them by the second."""


def joined_points(scan: Scan) -> Reals:
    """Return for each pair of neighbouring readings whether they are on one surface, (k - 1,) bool."""
    points = scan.points()
    # A step that is long near the scanner is usual at a distance.
    reach = np.maximum(_JOINED, 4 * abs(scan.angle_step) * np.hypot(*points[1:].T))
    return np.asarray((np.hypot(*np.diff(points, axis=0).T) < reach) & (np.diff(scan.beams) <= 2))


def narrow_objects(scan: Scan, joined: Reals | None = None) -> Reals:
    """Return which points are of narrow objects in front of what is beside them, (k,) bool.

    Parameters
    ----------
    scan : Scan
    joined : array of bool, (k - 1,), optional
        The result of `joined_points`, if it is known.
    """
    points = scan.points()
    if len(points) < 3:
        return np.zeros(len(points), bool)
    if joined is None:
        joined = joined_points(scan)
    bounds = np.concatenate([[0], np.flatnonzero(~joined) + 1, [len(points)]])
    first, last = bounds[:-1], bounds[1:] - 1
    narrow = np.hypot(*(points[last] - points[first]).T) < _NARROW
    ranges = scan.ranges[scan.beams]
    begin, end = ranges[first], ranges[last]
    # The first and the last object of a scan may continue beyond it.
    before, after = np.append(-np.inf, end[:-1]), np.append(begin[1:], -np.inf)
    in_front = narrow & (before > begin + _IN_FRONT) & (after > end + _IN_FRONT)
    return np.repeat(in_front, np.diff(bounds))
