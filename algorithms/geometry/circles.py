"""The distance of two circles in space, and their closest points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3

from ..arguments import Reals, real_array

SAMPLES = 24
"""Angles at which the distance is looked at, besides the roots of the polynomial."""
STARTS = 6
"""The best of these angles and roots are refined."""
STEPS = 40
"""The most steps of a refinement; quadratic convergence needs some five, circles that touch in one curve more."""
_ROUNDING = 1e-16
"""Of values that are at most 1."""
_SAME = 1e-9
"""Distances are the same everywhere where they differ by less than this part of the sizes."""


@dataclass(frozen=True, slots=True, eq=False)
class NearestOnCircles:
    """The closest points of two circles."""

    distance: Reals
    """(...) Of the two points; not a number where a circle is imaginary or a line."""
    on_a: Reals
    """(..., 3) The point of the first circle."""
    on_b: Reals
    """(..., 3) The point of the second."""
    everywhere: Reals
    """(...) bool. True where every point of the first circle is as near: circles about one axis, or the same."""


def nearest_on_circles(a: ArrayLike, b: ArrayLike) -> NearestOnCircles:
    """The points of two circles of space that are nearest to each other.

    The square of the distance of a point of `a` to the circle `b` is a function of the point's angle. Where it is
    least, a trigonometric polynomial of degree 4 vanishes; its eight roots are eigenvalues (D. Vranek, *Journal of
    Graphics Tools* 7:23-32, 2002). The best of them, and of evenly spaced angles for where the polynomial says little,
    are refined by Newton's method on the function itself. Several pairs of points may be as near; one is given.

    Parameters
    ----------
    a, b : array_like, (..., 10)
        Circles of `generated.cga3`; leading axes broadcast. Of radius 0: a point.

    Returns
    -------
    NearestOnCircles
        Distances to 1e-15 of radii and distance of the centres where circles are apart, and where they cross; to 1e-8
        where they touch in a point, as the distance of points near to it is.

    Raises
    ------
    TypeError, ValueError
        Where an argument has another shape or type.
    """
    one, two = real_array(a, "a", (10,), "a circle"), real_array(b, "b", (10,), "a circle")
    one, two = np.broadcast_arrays(one, two)
    radius, curve = cga3.circle_relative_to_circle(one, two)
    size = np.abs(curve).sum((-2, -1)) + radius
    usable = np.isfinite(size) & (size > 0)
    scale = np.where(usable, size, 1)[..., None, None]
    scaled = np.where(usable[..., None, None], curve / scale, np.eye(3))
    unit_radius = np.where(usable, radius / scale[..., 0, 0], 1)[..., None]
    angle, spread = _nearest_angle(scaled, unit_radius)
    x, y, _ = np.moveaxis(scaled @ np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], -1)[..., None], -2, 0)
    on_a = cga3.point_on_circle(one, angle)
    on_b = cga3.point_on_circle(two, np.arctan2(y, x)[..., 0])
    wrong = np.where(usable, 0, np.nan)
    distance = np.linalg.norm(on_a - on_b, axis=-1) + wrong
    return NearestOnCircles(distance, on_a + wrong[..., None], on_b + wrong[..., None], (spread <= _SAME) & usable)


def _nearest_angle(curve: Reals, radius: Reals) -> tuple[Reals, Reals]:
    """The angle of least distance on the first circle, and how much half the square of the distance varies."""
    even = np.linspace(0, 2 * np.pi, SAMPLES, endpoint=False)
    angles = np.concatenate([_stationary(curve, radius), np.broadcast_to(even, (*curve.shape[:-2], SAMPLES))], -1)
    values = _half_square(curve, radius, angles)[0]
    spread = values[..., 8:].max(-1) - values[..., 8:].min(-1)
    best = np.argsort(values, -1)[..., :STARTS]
    angle = np.take_along_axis(angles, best, -1)
    value, slope, bend = _half_square(curve, radius, angle)
    limit = np.full_like(angle, np.pi / SAMPLES)
    for _ in range(STEPS):
        size = np.abs(bend)
        step = np.clip(-slope / np.where(size > 0, size, 1), -limit, limit)
        there = _half_square(curve, radius, angle + step)
        lower = there[0] < value - _ROUNDING
        better = lower | ((there[0] <= value + _ROUNDING) & (np.abs(there[1]) < np.abs(slope)))
        moved = lower | (better & (np.abs(step) > _ROUNDING))
        angle = np.where(better, angle + step, angle)
        value, slope, bend = (np.where(better, new, old) for new, old in zip(there, (value, slope, bend), strict=True))
        limit = np.where(better, limit, limit / 8)
        if not moved.any():
            break
    least = np.argmin(value, -1)[..., None]
    return np.take_along_axis(angle, least, -1)[..., 0], spread


def _half_square(curve: Reals, radius: Reals, angle: Reals) -> tuple[Reals, Reals, Reals]:
    """Half the squared distance to the second circle of points at angles, and its first and second derivative.

    It is ``(h**2 + (l - r)**2) / 2`` by the height h and the distance l from the axis.
    """
    cosine, sine, one = np.cos(angle), np.sin(angle), np.ones_like(angle)
    x, y, h = np.moveaxis(curve @ np.stack([one, cosine, sine], -2), -2, 0)
    dx, dy, dh = np.moveaxis(curve[..., 1:] @ np.stack([-sine, cosine], -2), -2, 0)
    ddx, ddy, ddh = np.moveaxis(curve[..., 1:] @ np.stack([-cosine, -sine], -2), -2, 0)
    length = np.hypot(x, y)
    safe = np.where(length > 0, length, 1)
    dl = (x * dx + y * dy) / safe
    ddl = (dx * dx + dy * dy + x * ddx + y * ddy - dl * dl) / safe
    gap = length - radius
    return (h * h + gap * gap) / 2, h * dh + gap * dl, dh * dh + h * ddh + dl * dl + gap * ddl


def _stationary(curve: Reals, radius: Reals) -> Reals:
    """The angles of the eight roots of the polynomial, of those off the unit circle too: starts cost little.

    With ``p . p' = s`` and ``x x' + y y' = w`` the slope ``s - r w / l`` vanishes only where ``l**2 s**2 - r**2 w**2``
    does: a polynomial of degree 8 in ``exp(i angle)``, whose coefficients are the Fourier transform of its values.
    """
    angle = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y, h = np.moveaxis(curve @ np.stack([np.ones_like(angle), cosine, sine]), -2, 0)
    dx, dy, dh = np.moveaxis(curve[..., 1:] @ np.stack([-sine, cosine]), -2, 0)
    w = x * dx + y * dy
    values = (x * x + y * y) * (w + h * dh) ** 2 - (radius * w) ** 2
    coefficients = np.fft.fft(values, axis=-1)[..., [4, 3, 2, 1, 0, -1, -2, -3, -4]]
    largest = np.abs(coefficients).max(-1)
    leading = coefficients[..., 0]
    small = np.abs(leading) <= 1e-14 * largest
    leading = np.where(small, np.where(largest > 0, 1e-14 * largest, 1), leading)
    companion = np.zeros((*leading.shape, 8, 8), complex)
    companion[..., 1:, :-1] = np.eye(7)
    companion[..., 0, :] = -coefficients[..., 1:] / leading[..., None]
    return np.angle(np.linalg.eigvals(companion))
