"""The least distance of two circles by Newton's method, compiled by numba: one pair after the other. Nothing raises."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

STARTS = 6
"""The best of the angles given are refined."""
STEPS = 40
"""The most steps of a refinement; quadratic convergence needs some five, circles that touch in one curve more."""
ROUNDING = 1e-16
"""Of values that are at most 1."""


@njit(cache=True, error_model="numpy")
def half_square(curve: Any, e: int, radius: float, angle: float) -> tuple[float, float, float]:
    """Half the squared distance to the second circle of a point at an angle, and its first and second derivative.

    It is ``(h**2 + (l - r)**2) / 2`` by the height h over the plane of that circle and the distance l from its axis.
    """
    cosine, sine = math.cos(angle), math.sin(angle)
    # the point from the centre of its circle, whose second derivative is its negative, and its first derivative
    px = curve[e, 0, 1] * cosine + curve[e, 0, 2] * sine
    py = curve[e, 1, 1] * cosine + curve[e, 1, 2] * sine
    ph = curve[e, 2, 1] * cosine + curve[e, 2, 2] * sine
    dx = curve[e, 0, 2] * cosine - curve[e, 0, 1] * sine
    dy = curve[e, 1, 2] * cosine - curve[e, 1, 1] * sine
    dh = curve[e, 2, 2] * cosine - curve[e, 2, 1] * sine
    x, y, h = curve[e, 0, 0] + px, curve[e, 1, 0] + py, curve[e, 2, 0] + ph
    length = math.hypot(x, y)
    reciprocal = 1 / length if length > 0 else 1.0
    dl = (x * dx + y * dy) * reciprocal
    ddl = (dx * dx + dy * dy - x * px - y * py - dl * dl) * reciprocal
    gap = length - radius
    return (h * h + gap * gap) / 2, h * dh + gap * dl, dh * dh - h * ph + dl * dl + gap * ddl


@njit(cache=True, error_model="numpy")
def refined(curve: Any, e: int, radius: float, angle: float, span: float) -> tuple[float, float]:
    """The angle of a least distance near to one, and half the square of that distance; steps are `span` at most."""
    value, slope, bend = half_square(curve, e, radius, angle)
    for _ in range(STEPS):
        step = -slope / abs(bend) if bend != 0 else -slope
        step = min(max(step, -span), span)
        if not abs(step) > ROUNDING:
            break
        new, new_slope, new_bend = half_square(curve, e, radius, angle + step)
        if new < value - ROUNDING or (new <= value + ROUNDING and abs(new_slope) < abs(slope)):
            angle += step
            value, slope, bend = new, new_slope, new_bend
        else:
            span /= 8
    return angle, value


@njit(cache=True, error_model="numpy")
def nearest_angles(curve: Any, radius: Any, roots: Any, samples: int, angle: Any, spread: Any) -> None:
    """The angle of least distance on each first circle, and how much half the square of the distance varies.

    Parameters
    ----------
    curve : array, (n, 3, 3)
        In its columns the centre and two half axes of the first circle, in coordinates in which the second lies about
        the third axis.
    radius : array, (n,)
        Of the second circle.
    roots : array, (n, k)
        Angles from which the least may be found, beside `samples` evenly spaced ones.
    samples : int
    angle, spread : array, (n,)
        Results.
    """
    k = roots.shape[1]
    angles, values = np.empty(k + samples), np.empty(k + samples)
    for e in range(len(curve)):
        least, most = np.inf, -np.inf
        for i in range(k + samples):
            angles[i] = roots[e, i] if i < k else 2 * np.pi * (i - k) / samples
            values[i] = half_square(curve, e, radius[e], angles[i])[0]
            if math.isnan(values[i]):  # argmin would find it first
                values[i] = np.inf
            if i >= k:
                least, most = min(least, values[i]), max(most, values[i])
        spread[e] = most - least
        angle[e], best = angles[0], np.inf
        for _ in range(STARTS):
            at = np.argmin(values)
            found, value = refined(curve, e, radius[e], angles[at], np.pi / samples)
            values[at] = np.inf
            if value < best:
                angle[e], best = found, value
