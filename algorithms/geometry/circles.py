"""Distance and closest points of two circles in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3

from ..arguments import Reals
from ..precision import NEGLIGIBLE
from .kinds import named

SAMPLES = 24
"""Number of angles at which the distance is evaluated, in addition to the roots of the polynomial."""
STARTS = 6
"""Number of the best angles that are refined."""
_ANGLES = np.linspace(0, 2 * np.pi, 16, endpoint=False)
_ROUND = np.stack([np.ones(16), np.cos(_ANGLES), np.sin(_ANGLES)])
_ROUND_DERIVATIVE = np.stack([np.zeros(16), -np.sin(_ANGLES), np.cos(_ANGLES)])


@dataclass(frozen=True, slots=True, eq=False)
class NearestOnCircles:
    """The closest points of two circles."""

    distance: Reals
    """(...) Distance of the two points. NaN if a circle is imaginary or a line."""
    on_a: Reals
    """(..., 3) The point of the first circle."""
    on_b: Reals
    """(..., 3) The point of the second circle."""
    everywhere: Reals
    """(...) bool. True if all points of the first circle have the same distance: coaxial or identical circles."""


def nearest_on_circles(a: ArrayLike, b: ArrayLike) -> NearestOnCircles:
    """Return the closest points of two circles in space.

    The squared distance of a point of `a` from the circle `b` is a function of the point's angle. At a minimum a
    trigonometric polynomial of degree 4 vanishes, whose eight roots are eigenvalues (D. Vranek, *Journal of Graphics
    Tools* 7:23-32, 2002). The best of these roots, and of evenly spaced angles for the case that the polynomial is ill
    conditioned, are refined by Newton's method on the function itself. If several pairs of points have the minimum
    distance, one of them is returned.

    Parameters
    ----------
    a, b : multivector, or array_like, (..., 10)
        Circles of `generated.cga3`, or elements of CGA2 or CGA3; leading axes broadcast. A circle with
        radius 0 is a point.

    Returns
    -------
    NearestOnCircles
        The error of distances, relative to the radii and the distance of the centres, is 1e-15 for separate or crossing
        circles. It is 1e-8 for circles that touch in a point, where the minimum is flat.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type.
    """
    one, two = (named("circle", x, name).values for x, name in ((a, "a"), (b, "b")))
    one, two = np.broadcast_arrays(one, two)
    radius, curve = cga3.circle_relative_to_circle(one, two)
    size = np.abs(curve).sum((-2, -1)) + radius
    usable = np.isfinite(size)
    scale = np.where(usable & (size > 0), size, 1)[..., None, None]
    scaled = np.where(usable[..., None, None], curve / scale, np.eye(3))
    unit_radius = np.where(usable, radius / scale[..., 0, 0], 1)[..., None]
    angle, spread = _nearest_angle(scaled, unit_radius)
    x, y, _ = np.moveaxis(scaled @ np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], -1)[..., None], -2, 0)
    on_a = cga3.point_on_circle(one, angle)
    on_b = cga3.point_on_circle(two, np.arctan2(y, x)[..., 0])
    wrong = np.where(usable, 0, np.nan)
    distance = np.linalg.norm(on_a - on_b, axis=-1) + wrong
    return NearestOnCircles(distance, on_a + wrong[..., None], on_b + wrong[..., None], (spread <= NEGLIGIBLE) & usable)


def _nearest_angle(curve: Reals, radius: Reals) -> tuple[Reals, Reals]:
    """Return the angle of minimum distance on the first circle, and the range of half the squared distance."""
    curve, radius = np.asarray(curve, np.float64), np.asarray(radius, np.float64)
    return nearest_angles(curve, radius[..., 0], _stationary(curve, radius))


def nearest_angles(curve: Reals, radius: Reals, roots: Reals) -> tuple[Reals, Reals]:
    """Return the angle of minimum distance on each first circle, and the range of half the squared distance.

    Parameters
    ----------
    curve : array, (..., 3, 3)
        Columns are the centre and two semi-axes of the first circle, in coordinates in which the third axis is the axis
        of the second circle.
    radius : array, (...)
        Radius of the second circle.
    roots : array, (..., k)
        Start angles for the minimisation, in addition to evenly spaced ones.

    Returns
    -------
    angle, spread : array, (...)
    """
    samples = np.broadcast_to(2 * np.pi * np.arange(SAMPLES) / SAMPLES, (*roots.shape[:-1], SAMPLES))
    angles = np.concatenate([roots, samples], -1)
    distances = cga3.distance_to_circle(curve[..., None, :, :], radius[..., None], angles)[0]
    values = np.where(np.isnan(distances), np.inf, distances)  # argmin would find it first
    of_samples = values[..., -SAMPLES:]
    with np.errstate(invalid="ignore"):
        spread = of_samples.max(-1) - of_samples.min(-1)
    starts = np.take_along_axis(angles, np.argsort(values, -1, kind="stable")[..., :STARTS], -1)
    found, least = cga3.least_distances_to_circle(curve, radius, starts, np.pi / SAMPLES)
    best = np.argmin(np.where(np.isnan(least), np.inf, least), -1)[..., None]
    angle = np.where(np.isfinite(values).any(-1), np.take_along_axis(found, best, -1)[..., 0], angles[..., 0])
    return angle, spread


def _stationary(curve: Reals, radius: Reals) -> Reals:
    """Return the angles of the eight roots of the polynomial, including those off the unit circle.

    With ``p . p' = s`` and ``x x' + y y' = w`` the derivative ``s - r w / l`` vanishes only if
    ``l**2 s**2 - r**2 w**2`` does. This is a polynomial of degree 8 in ``exp(i angle)``, whose coefficients are the
    Fourier transform of its values.
    """
    x, y, h = np.moveaxis(curve @ _ROUND, -2, 0)
    dx, dy, dh = np.moveaxis(curve @ _ROUND_DERIVATIVE, -2, 0)
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
