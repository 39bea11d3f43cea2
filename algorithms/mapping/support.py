"""How many readings determine the translation between two scans, and how many contradict it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from generated import mapping as kernels
from generated import pga2

from ..arguments import Reals
from .free_space import Sight
from .outlines import Outline

_ON = 0.1
"""Metres from a line up to which a reading is on it."""
_PARALLEL = 0.9
"""The least cosine of the angle between the normals of a reading and of the line that it is on."""
_SPACING = 0.1
"""Metres between neighbouring beams on a wall from which on each reading counts fully; nearer ones count less."""


class Support(NamedTuple):
    """Readings that determine motions (...,), and readings that contradict them."""

    readings: Reals
    """The least eigenvalue of the sum of ``n n^T`` over the normals n of readings on lines of both scans whose normals
    agree: the count of readings that determine the worst direction."""
    contradicting: Reals
    """The count of readings where the other scan has seen through."""
    share: Reals
    """The share of readings where the other scan has seen through, of the scan that has more of them."""

    @property
    def is_outvoted(self) -> Reals:
        """Whether more readings contradict a motion than determine each direction of it."""
        return np.asarray(self.contradicting > self.readings)


def support(a: Outline, b: Outline, motors: Reals, apart: float, every: int = 1) -> Support:
    """Return the readings of either scan that determine the worst direction of motions (..., 4), or contradict them.

    Readings count for both alike, and the scan decides that has less support. A corridor without doors has almost none,
    even if all readings agree. Readings contradict a motion if they are farther than `apart`, in metres, from all lines
    of the other scan and in the space that it shows to be free. With `every`, only every so many readings are counted,
    which takes less time, so that counts are lower bounds.
    """
    one, two = (
        _one_way(*scans, np.asarray(each), apart, every)
        for scans, each in (((a, b), motors), ((b, a), pga2.motor_inverse(motors)))
    )
    return Support(np.minimum(one[0], two[0]), np.maximum(one[1], two[1]), np.maximum(one[2], two[2]))


def _one_way(a: Outline, b: Outline, motors: Reals, apart: float, every: int) -> Support:
    points, rows = (np.ascontiguousarray(each[::every]) for each in (b.points, b.rows))
    moved = np.asarray(kernels.moved_points(motors, points))
    near = kernels.nearest(moved, a.targets)
    farther = _SPACING / (abs(b.scan.angle_step) * b.stride)
    limits = np.array([_ON * _ON, _PARALLEL, farther])
    sums = b.stride * np.asarray(kernels.normals_on_lines(motors, rows, *near, a.rows, limits))
    xx, xy, yy = sums[..., 0], sums[..., 1], sums[..., 2]
    is_free = (near[0] > apart * apart) & Sight(a.closest, a.scan.angle_min, a.scan.angle_step).sees_through(moved)
    counts = np.minimum(np.hypot(*points.T) / farther, 1.0)
    readings = np.asarray((xx + yy) / 2 - np.hypot((xx - yy) / 2, xy))
    return Support(readings, b.stride * (is_free @ counts), is_free.mean(-1))
