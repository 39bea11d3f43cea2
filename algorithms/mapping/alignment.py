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
_UNDETERMINED = 0.01
"""Share of the information along a direction, relative to the best one, below which it is degenerate."""
_STILL = 1e-7
"""Squared steps, in metres and radians, at which an alignment is complete."""


class Aligned(NamedTuple):
    """Motors, upper triangles of their information by x, y and angle, and sums of weights, squares and steps."""

    motors: Reals
    information: Reals
    sums: Reals


def aligned(a: Outline, b: Outline, motors: Reals, scales: list[float], stride: int = 1) -> Aligned:
    """Refine motors (..., 4) from `b` to `a`, with one Gauss-Newton step for each scale of residuals.

    With a stride, only every so many points of `b` are moved, and every other one of `a` is a target.
    """
    points, weights = b.points[::stride], b.weights[::stride]
    found = Aligned(motors, np.zeros(6), np.zeros(4))
    targets = a.targets if stride == 1 else a.few
    every = 1 if stride == 1 else 2
    for scale in scales:
        square, row = kernels.nearest(pga2.move_point(found.motors[..., None, :], points), targets)
        j = every * row.astype(int)
        target, normal, along_target = a.points[j], a.normals[j], a.along[j]
        weight = weights * a.weights[j] * (square < (_GATE * scale) ** 2)
        terms = [points, target, normal, along_target, weight]
        if stride == 1:
            others = _back(a, b, found.motors, scale)
            terms = [np.concatenate(pair, -1 if pair[0].ndim == 1 else -2) for pair in zip(terms, others, strict=True)]
        found = Aligned(*kernels.alignment_step(found.motors, *terms, scale))  # type: ignore[call-overload]
        if scale == scales[-1] and (found.sums[..., 2:] < _STILL).all():
            break
    return found


def _back(a: Outline, b: Outline, motor: Reals, scale: float) -> tuple[Reals, ...]:
    """Return the terms of the points of `a` at lines of `b`: in the frame of `b`, they move the other way."""
    square, row = kernels.nearest(pga2.move_point(pga2.motor_inverse(motor), a.points), b.targets)
    k = row.astype(int)
    weights = b.weights[k] * a.weights * (square < (_GATE * scale) ** 2)
    return b.points[k], a.points, pga2.move_direction(motor, b.normals[k]), b.along[k], weights


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
