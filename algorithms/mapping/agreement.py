"""How well a motion explains what two scans show, including the space that they show to be free."""

from __future__ import annotations

import numpy as np

from generated import mapping as kernels
from generated import pga2

from ..arguments import Reals
from .outlines import Outline


def agreement(a: Outline, b: Outline, motors: Reals, scale: float, most: int = 60, *, coarse: bool = False) -> Reals:
    """Return the mean score (c,) of points of both scans, for motors (c, 4) from `b` to `a`; at most 1.

    A point at the distance d from the nearest line of the other scan scores ``1 - d d / scale scale``. A point that the
    other scan cannot show scores almost as much on the continuation of a line, as walls are expected to continue:
    otherwise motions with more overlap would be preferred along corridors.
    """
    forth = _mean_score(a, motors, b.points[:: max(1, len(b.points) // most)], scale, coarse)
    back = _mean_score(b, pga2.motor_inverse(motors), a.points[:: max(1, len(a.points) // most)], scale, coarse)
    return np.asarray((forth + back) / 2)


def _mean_score(a: Outline, motors: Reals, points: Reals, scale: float, coarse: bool) -> Reals:
    moved = kernels.moved_points(motors, np.ascontiguousarray(points))
    squares = kernels.nearest_square(moved, a.few_fours if coarse else a.fours)
    distances, angles = kernels.distance_and_angle(moved)
    sums = kernels.sum_of_scores(
        moved, squares, distances, angles, a.closest, a.lines, a.scan.angle_min, a.scan.angle_step, scale
    )
    return np.asarray(sums) / len(points)
