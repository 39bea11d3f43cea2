"""Robust alignment of two outlines: each point to the nearest line of the other, in both directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from generated import mapping as kernels
from generated import pga2

from ..arguments import Reals
from ..precision import ROOT
from .outlines import Outline

_GATE = 3.0
"""Points farther than this multiple of the scale from all lines are left out."""
_UNDETERMINED = 0.01
"""Share of the information along a direction, relative to the best one, below which it is degenerate."""


class Aligned(NamedTuple):
    """Motors, upper triangles of their information by x, y and angle, and sums of weights, squares and steps."""

    motors: Reals
    information: Reals
    sums: Reals


def aligned(a: Outline, b: Outline, motors: Reals, scales: list[float], stride: int = 1) -> Aligned:
    """Refine motors (..., 4) from `b` to `a`, with one Gauss-Newton step for each scale of residuals.

    With a stride, only every so many points of `b` are moved, and every other one of `a` is a target.
    """
    moving = np.ascontiguousarray(b.rows[::stride])
    points = np.ascontiguousarray(moving[:, :2])
    targets, rows = (a.targets, a.rows) if stride == 1 else (a.few, np.ascontiguousarray(a.rows[::2]))
    found = Aligned(motors, np.zeros(6), np.zeros(4))
    for scale in scales:
        near = kernels.nearest(kernels.moved_points(found.motors, points), targets)
        # Without points that are moved back, as with a coarse step.
        back = np.zeros((0, 6)), np.zeros(0), np.zeros(0)
        if stride == 1:
            # In the frame of `b`, the points of `a` move the other way.
            back = rows, *kernels.nearest(kernels.moved_points(pga2.motor_inverse(found.motors), a.points), b.targets)
        found = Aligned(*kernels.step_between(found.motors, moving, *near, rows, *back, scale, _GATE * scale))
        if scale == scales[-1] and (found.sums[..., 2:] < ROOT).all():
            break
    return found


def covariance_of(triangle: Reals, variance: float, centre: Reals | None = None) -> tuple[Reals, Reals]:
    """Return the covariance (3, 3) and the degenerate directions (k, 3) of the upper triangle of an information.

    With a centre, they are of motions about this point instead of the origin.
    """
    xx, xy, xa, yy, ya, aa = triangle
    information = np.array([[xx, xy, xa], [xy, yy, ya], [xa, ya, aa]])
    if centre is not None:
        shifted = np.array([[1.0, 0.0, centre[1]], [0.0, 1.0, -centre[0]], [0.0, 0.0, 1.0]])
        information = shifted.T @ information @ shifted
    aa = information[2, 2]
    # Angles count by the size of the scene, which makes the three coordinates comparable.
    unit = np.array([1.0, 1.0, np.sqrt(max(aa / max(xx + yy, 1e-9), 1e-9))])
    values, vectors = np.linalg.eigh(information / np.outer(unit, unit))
    weak = values < _UNDETERMINED * max(values[-1], 1e-9)
    directions = (vectors / unit[:, None]).T[weak]
    kept = np.maximum(values, 1e-9 * max(values[-1], 1e-9))
    scaled = (vectors / unit[:, None]) / np.sqrt(kept)
    return variance * scaled @ scaled.T, directions / np.linalg.norm(directions, axis=1, keepdims=True)
