"""Robust alignment of two outlines: each point to the nearest line of the other, in both directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from generated import mapping as kernels
from generated import pga2

from ..arguments import Reals
from .outlines import Outline

_GATE = 3.0
"""Points farther than this multiple of the scale from all lines are left out."""
_STILL = 1e-8
"""Squared steps, in metres and radians, at which an alignment is complete."""


class Aligned(NamedTuple):
    """A motor, the upper triangle of its information by x, y and angle, and sums: weights, weighted squares, steps."""

    motor: Reals
    information: Reals
    sums: Reals


def aligned(a: Outline, b: Outline, motor: Reals, scales: list[float], stride: int = 1) -> Aligned:
    """Refine the motor from `b` to `a`, with one Gauss-Newton step for each scale of residuals.

    With a stride, only every so many points of `b` are moved, and none of `a`.
    """
    points, along, weights = b.points[::stride], b.along[::stride], b.weights[::stride]
    both = stride == 1
    found = Aligned(motor, np.zeros(6), np.zeros(4))
    for scale in scales:
        limit = (_GATE * scale) ** 2
        square, row = kernels.nearest(pga2.move_point(found.motor, points), a.targets)
        j = row.astype(int)
        terms = [points, a.points[j], a.normals[j], a.along[j], weights * a.weights[j] * (square < limit)]
        if both:
            back = pga2.move_point(pga2.motor_inverse(found.motor), a.points)
            square, row = kernels.nearest(back, b.targets)
            k = row.astype(int)
            normals = pga2.move_direction(found.motor, b.normals[k])
            others = (b.points[k], a.points, normals, along[k], weights[k] * a.weights * (square < limit))
            terms = [np.concatenate(pair) for pair in zip(terms, others, strict=True)]
        found = Aligned(*kernels.alignment_step(found.motor, *terms, scale))
        if scale == scales[-1] and found.sums[2] < _STILL and found.sums[3] < _STILL:
            break
    return found
