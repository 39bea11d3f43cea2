"""How many readings on lines that both scans show determine the translation between them."""

from __future__ import annotations

import numpy as np

from generated import mapping as kernels
from generated import pga2

from ..arguments import Reals
from .outlines import Outline

_ON = 0.1
"""Metres from a line up to which a reading is on it."""
_PARALLEL = 0.9
"""The least cosine of the angle between the normals of a reading and of the line that it is on."""
_SPACING = 0.1
"""Metres between neighbouring beams on a wall from which on each reading counts fully; nearer ones count less."""


def support(a: Outline, b: Outline, motor: Reals) -> float:
    """Return the count of readings of either scan on lines of the other one that determine the worst direction.

    It is the least eigenvalue of the sum of ``n n^T`` over the normals n of readings on lines of both scans whose
    normals agree, for the scan that has less. A corridor without doors has almost none, even if all readings agree.
    """
    return min(_one_way(a, b, motor), _one_way(b, a, np.asarray(pga2.motor_inverse(motor))))


def _one_way(a: Outline, b: Outline, motor: Reals) -> float:
    near = kernels.nearest(kernels.moved_points(motor, b.points), a.targets)
    farther = _SPACING / (abs(b.scan.angle_step) * b.stride)
    xx, xy, yy = b.stride * np.asarray(
        kernels.normals_on_lines(motor, b.rows, *near, a.rows, np.array([_ON * _ON, _PARALLEL, farther]))
    )
    return float((xx + yy) / 2 - np.hypot((xx - yy) / 2, xy))
