"""How well a motion explains what two scans show, including the space that they show to be free."""

from __future__ import annotations

import numpy as np

from generated import mapping as kernels
from generated import pga2

from ..arguments import Reals
from .outlines import Outline
from .scan import Scan

_IN_FRONT = -0.5
"""Score of a point where the other scan shows free space."""
_HIDDEN, _CONTINUED = 0.3, 0.95
"""Scores of points that the other scan cannot show: of any, and on the continuation of a line."""


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
    moved = pga2.move_point(motors[:, None], points)
    squares = kernels.nearest_square(moved, a.few if coarse else a.targets)
    scores = 1 - squares / (scale * scale)
    distance, angle = kernels.distance_and_angle(moved)
    closest = _at_beams(a.scan, angle, a.closest)
    missed = np.where(distance < 0.97 * closest - 0.2, _IN_FRONT, 0.0)
    hidden = distance > closest + 0.2
    off = kernels.nearest_square(moved[hidden], a.lines)
    missed[hidden] = np.maximum(_HIDDEN, _CONTINUED * (1 - off / (scale * scale)))
    return np.asarray(np.where(scores > 0, scores, missed).mean(-1))


def _at_beams(scan: Scan, angles: Reals, ranges: Reals) -> Reals:
    """Return the ranges of the beams nearest to angles; 0 where there is none or nothing is measured."""
    beam = np.rint(((angles - scan.angle_min) / scan.angle_step) % (2 * np.pi / abs(scan.angle_step))).astype(int)
    padded = np.append(np.where(np.isfinite(ranges), ranges, 0.0), 0.0)
    return np.asarray(padded[np.minimum(beam, len(ranges))])
