"""Least-squares fits of lines, planes, circles and spheres to points.

The initial estimates of spheres and circles are the vectors of conformal space that are most nearly orthogonal to all
points, as in L. Dorst, *Total least squares fitting of k-spheres*, Journal of Mathematical Imaging and Vision
50:214-234, 2014. Gauss-Newton steps then minimise the sum of squared distances.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3
from generated.gac_runtime.arrays import element_of

from ..arguments import Reals, finite, moderate, real_array
from ..precision import CONVERGED, TINY
from .fit_evidence import (
    FitStatus,
    Fitted,
    Judged,
    arc_of,
    box_of,
    fitted_line,
    fitted_plane,
    judged_sets,
    rounding_of,
)
from .kinds import named

STEPS = 30
"""Maximum number of Gauss-Newton steps."""
_ROUNDINGS = 8
"""From floating point: points are considered equal if the ratio of their spread and their distance from the origin is
below this number of rounding errors."""
_METRIC = np.array([[1.0, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 1, 0, 0], [0, 0, 0, 0, -1], [0, 0, 0, -1, 0]])
"""Inner products of e1 e2 e3 e0 einf; its own inverse."""


class Judgement:
    """What the evidence says of a fit; computed when it is read."""

    _evidence: tuple[Any, ...]

    @functools.cached_property
    def _judged(self) -> Judged:
        return judged_sets(*self._evidence)

    @property
    def status(self) -> FitStatus | Reals:
        """A `FitStatus`, or an array (...) of them. OK if the points determine the object and do not contradict it.

        Points are taken to be off by independent normal numbers, of one variance in all directions and for all points.
        """
        status = self._judged[0]
        return status if status.ndim else FitStatus(int(status))

    @property
    def deviations(self) -> Reals:
        """(..., k) Standard deviations, of which an error is at most 4.03 with a probability of 0.999.

        Of planes and lines, those of the direction in radians and of the place at the centroid; of spheres those of
        the centre and of the radius; of circles those of the centre, the radius and the normal; of cylinders those of
        the axis at the centroid and of its direction, and of the radius; of cones those of the apex, of the direction
        of the axis and of the angle. They include what the distances show of other shapes.
        """
        return self._judged[1]


@dataclass(frozen=True, eq=False)
class Fit(Judgement):
    """The best object of a kind, and whether the points determine it."""

    object: Any
    """Coefficients in the layout of `generated.cga3`, or an element for elements; NaN if there is no such object.

    An array does not say to which algebra it belongs: for a plane of PGA3 fit points of PGA3."""
    residual: Reals
    """(...) The root mean square of the distances."""
    determined: Reals
    """(...) bool. False if the object is not unique, for example for collinear points in a plane fit; up to rounding:
    `status` considers the noise."""
    _evidence: tuple[Any, ...] = field(repr=False)


def _of_points(kind: str) -> Callable[[Callable[[ArrayLike], Fit]], Callable[[ArrayLike], Fit]]:
    """Return a decorator of fits for which points that are elements give an element."""

    def decorated(fit: Callable[[ArrayLike], Fit]) -> Callable[[ArrayLike], Fit]:
        @functools.wraps(fit)
        def run(points: ArrayLike) -> Fit:
            if element_of(points) is None:
                return fit(points)
            given = named("point", points, "points")
            found = fit(given.values)
            return replace(found, object=given.returned(kind, found.object))

        return run

    return decorated


@_of_points("plane")
def fit_plane(points: ArrayLike) -> Fit:
    """Return the plane that minimises the sum of squared distances.

    It contains the centroid and is orthogonal to the direction of smallest spread.

    Parameters
    ----------
    points : array_like, (..., n, 3), or multivector, (..., n)
        At least three points. For points of PGA3 or CGA3 the object is an element of that algebra, if it has the kind.

    Returns
    -------
    Fit
        A plane, (..., 4).

    Raises
    ------
    TypeError, ValueError
        If the points have a wrong shape or type, are not finite, or are too few.
    """
    places, centre, values, axes = _spread(points, 3)
    plane = cga3.plane_from_point_normal(centre, axes[..., 0])
    offsets = cga3.signed_distance_point_plane(places, cga3.plane_polarity(plane)[..., None, :])
    determined = values[..., 1] > CONVERGED**2 * values[..., 2]
    return Fit(plane, _mean_root(offsets), determined, (fitted_plane, determined, 2, places, centre, axes))


@_of_points("line")
def fit_line(points: ArrayLike) -> Fit:
    """Return the line that minimises the sum of squared distances.

    It contains the centroid and has the direction of largest spread.

    Parameters
    ----------
    points : array_like, (..., n, 3)
        At least two points.

    Returns
    -------
    Fit
        A line, (..., 6).

    Raises
    ------
    TypeError, ValueError
        As in `fit_plane`.
    """
    places, centre, values, axes = _spread(points, 2)
    line = cga3.line_from_point_direction(centre, axes[..., 2])
    offsets = cga3.distance_point_line(places, line[..., None, :])
    gap = values[..., 2] - values[..., 1]
    determined = (gap > CONVERGED * values[..., 2]) & (values[..., 2] > 0)
    return Fit(line, _mean_root(offsets), determined, (fitted_line, determined, 2, places, centre, axes))


@_of_points("sphere")
def fit_sphere(points: ArrayLike) -> Fit:
    """Return the sphere that minimises the sum of squared distances.

    Parameters
    ----------
    points : array_like, (..., n, 3)
        At least four points.

    Returns
    -------
    Fit
        A sphere, (..., 5). NaN for coplanar or nearly coplanar points.

    Raises
    ------
    TypeError, ValueError
        As in `fit_plane`.
    """
    places, middle, values, _ = _spread(points, 4, True)
    scaled, size, determined = _scaled(places, middle, values, values[..., 0])
    dual = _duals(scaled)[..., 0]
    radius = np.sqrt(np.abs(cga3.dual_sphere_radius_squared(dual)))
    state = np.concatenate([cga3.extract_point(dual), radius[..., None]], -1)
    state, off = descend(scaled, state, _off_sphere, lambda state, step: state + step)
    wrong = np.where(determined, 0, np.nan)
    sphere = cga3.sphere_from_centre_radius_squared(
        middle + size[..., None] * state[..., :3], (size * state[..., 3]) ** 2
    )
    evidence = _fitted_sphere, determined, 2, places, scaled, size, state
    return Fit(sphere + wrong[..., None], size * off + wrong, determined, evidence)


@_of_points("circle")
def fit_circle(points: ArrayLike) -> Fit:
    """Return the circle in space that minimises the sum of squared distances.

    Parameters
    ----------
    points : array_like, (..., n, 3)
        At least three points.

    Returns
    -------
    Fit
        A circle, (..., 10). NaN for collinear or nearly collinear points.

    Raises
    ------
    TypeError, ValueError
        As in `fit_plane`.
    """
    places, middle, values, _ = _spread(points, 3, True)
    scaled, size, determined = _scaled(places, middle, values, values[..., 1])
    duals = _duals(scaled)
    circle = cga3.circle_from_dual_spheres(duals[..., 0], duals[..., 1])
    radius = np.sqrt(np.abs(cga3.circle_radius_squared(circle)))
    state = np.concatenate([cga3.circle_centre(circle), cga3.circle_normal(circle), radius[..., None]], -1)
    state, off = descend(scaled, state, _off_circle, axis_after)
    wrong = np.where(determined, 0, np.nan)
    centre = middle + size[..., None] * state[..., :3]
    circle = cga3.circle_from_centre(centre, state[..., 3:6], (size * state[..., 6]) ** 2)
    wide = values[..., 1] / np.where(determined, values[..., 2], 1)
    evidence = _fitted_circle, determined, 3, places, scaled, size, state, wide
    return Fit(circle + wrong[..., None], size * off + wrong, determined, evidence)


def _fitted_sphere(places: Reals, scaled: Reals, size: Reals, state: Reals) -> Fitted:
    off, jacobian = _off_sphere(scaled, state)
    away, unit, radius = -jacobian[:, :3], float(size), abs(float(state[3]))
    middle = away.mean(0)
    cap = 1 - float((away @ middle).min()) / max(float(np.linalg.norm(middle)), TINY)
    thickness = box_of(scaled, 3) / (2 * np.pi * radius**2 * min(cap, 2))
    parts, rounding = (((0, 1, 2), unit), ((3,), unit)), rounding_of(places, unit, 2)
    return Fitted(off[None], jacobian[None], away, parts, np.full(4, np.inf), rounding, True, thickness, radius, 3)


def _fitted_circle(places: Reals, scaled: Reals, size: Reals, state: Reals, wide: Reals) -> Fitted:
    off, jacobian = (each.reshape(2, len(places), *each.shape[1:]) for each in _off_circle(scaled, state))
    c, s = -jacobian[1, :, :2].T
    unit, radius, extents = float(size), abs(float(state[6])), np.full(6, np.inf)
    extents[3:5] = wide
    thickness = box_of(scaled, 2) / (radius * arc_of(c, s))
    parts, rounding = (((0, 1, 2), unit), ((5,), unit), ((3, 4), None)), rounding_of(places, unit, 2)
    return Fitted(off, jacobian, np.stack([c, s], -1), parts, extents, rounding, True, thickness, radius, 5)


def enough_points(points: ArrayLike, least: int, is_round: bool = False) -> tuple[Reals, float]:
    """Validate points and copy them in double precision, with the part of them that may be rounding.

    Raises
    ------
    ValueError
        If there are fewer than `least`.

    Notes
    -----
    What is computed later, such as the status of a fit, needs points that nobody changes. Coefficients of round objects
    are squares and cubes of coordinates, which may overflow.
    """
    places = finite(real_array(points, "points", (-1, 3), "points as rows"), "points")
    if is_round:
        moderate(places.reshape(-1, 3), "points")
    if places.shape[-2] < least:
        raise ValueError(f"points: {places.shape[-2]} points; expected at least {least}")
    return places.astype(np.float64), _ROUNDINGS * float(np.finfo(places.dtype).eps)


def _spread(points: ArrayLike, least: int, is_round: bool = False) -> tuple[Reals, Reals, Reals, Reals]:
    """Return the points, their centroid, the ascending mean squares along the principal axes, and these as columns.

    Mean squares of the size of rounding errors of the coordinates are set to 0.
    """
    places, part = enough_points(points, least, is_round)
    centre = places.mean(-2)
    rows: Reals = np.asarray(np.linalg.qr(places - centre[..., None, :], mode="r"))
    _, roots, axes = np.linalg.svd(np.concatenate([rows, np.zeros_like(rows)], -2)[..., :4, :], full_matrices=False)
    values = roots[..., ::-1] ** 2 / places.shape[-2]
    rounding = part**2 * np.mean(np.sum(places**2, -1), -1)
    values = np.where(values > rounding[..., None], values, 0)
    return places, centre, values, np.swapaxes(axes[..., ::-1, :], -1, -2)


def _scaled(places: Reals, middle: Reals, values: Reals, least: Reals) -> tuple[Reals, Reals, Reals]:
    """Return points scaled to spread 1 about the origin, their size, and whether they determine the object.

    Points that do not are replaced by fixed points that do.
    """
    determined = least > CONVERGED**2 * values[..., 2]
    size = np.sqrt(np.where(determined, values[..., 2], 1))
    corners = np.resize(np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]), places.shape[-2:])
    scaled = (places - middle[..., None, :]) / size[..., None, None]
    return np.where(determined[..., None, None], scaled, corners), size, determined


def _duals(points: Reals) -> Reals:
    """Return dual spheres as columns, in ascending order of their inner products with all points."""
    products: Reals = np.asarray(np.linalg.qr(cga3.embed_point(points) @ _METRIC, mode="r"))
    rows = np.concatenate([products, np.zeros((*products.shape[:-2], 5, 5))], -2)
    axes = np.linalg.svd(rows, full_matrices=False)[2]
    return np.swapaxes(axes[..., ::-1, :], -1, -2)


Residuals = Callable[[Reals, Reals], tuple[Reals, Reals]]


def descend(
    points: Reals, state: Reals, residuals: Residuals, after: Callable[[Reals, Reals], Reals]
) -> tuple[Reals, Reals]:
    """Apply Gauss-Newton steps, shortened where the sum of squares grows; return the state and the final RMS error."""
    off, jacobian = residuals(points, state)
    share = np.ones(state.shape[:-1])
    for _ in range(STEPS):
        step = -(np.linalg.pinv(jacobian) @ off[..., None])[..., 0]
        there = after(state, share[..., None] * step)
        new_off, new_jacobian = residuals(points, there)
        better = _squares(new_off) <= _squares(off)
        state = np.where(better[..., None], there, state)
        off = np.where(better[..., None], new_off, off)
        jacobian = np.where(better[..., None, None], new_jacobian, jacobian)
        share = np.where(better, 1, share / 4)
        if np.all(np.abs(share[..., None] * step) <= 1e-15 * (1 + np.abs(state).max(-1, keepdims=True, initial=0))):
            break
    return state, np.sqrt(_squares(off) / points.shape[-2])


def _off_sphere(points: Reals, state: Reals) -> tuple[Reals, Reals]:
    away = points - state[..., None, :3]
    length = np.linalg.norm(away, axis=-1)
    jacobian = np.concatenate([-away / length[..., None], -np.ones((*length.shape, 1))], -1)
    return length - state[..., None, 3], jacobian


def axis_frame(normal: Reals) -> Reals:
    """Return an orthonormal frame whose third row is a given unit normal."""
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal), -1)])
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    return np.stack([u, np.cross(normal, u), normal], -2)


def seen_along(points: Reals, state: Reals) -> tuple[Reals, Reals, Reals, Reals, Reals]:
    """Return coordinates x, y across and h along an axis, and the unit vector of x, y, which is 0 on the axis."""
    frame = axis_frame(state[..., 3:6])
    x, y, h = np.moveaxis((points - state[..., None, :3]) @ np.swapaxes(frame, -1, -2), -1, 0)
    length = np.hypot(x, y)
    over = np.where(length > 0, length, 1)
    return x, y, h, x / over, y / over


def off_cylinder(points: Reals, state: Reals) -> tuple[Reals, Reals]:
    """Return distances, and their derivatives with respect to position, tilt and radius.

    The derivative for translations along the axis is 0.
    """
    x, y, h, c, s = seen_along(points, state)
    o = np.zeros_like(x)
    return np.hypot(x, y) - state[..., None, 6], np.stack([-c, -s, o, -h * c, -h * s, o - 1], -1)


def _off_circle(points: Reals, state: Reals) -> tuple[Reals, Reals]:
    """Return heights over the plane and distances to the cylinder, and their derivatives.

    The derivatives are with respect to the centre, the tilt of the normal and the radius.
    """
    x, y, h, _, _ = seen_along(points, state)
    o = np.zeros_like(x)
    off, jacobian = off_cylinder(points, state)
    return np.concatenate([h, off], -1), np.concatenate([np.stack([o, o, o - 1, x, y, o], -1), jacobian], -2)


def axis_after(state: Reals, step: Reals) -> Reals:
    """Return the state after a step: position moved in the frame, axis tilted by two numbers, other entries added."""
    frame = axis_frame(state[..., 3:6])
    centre = state[..., :3] + np.einsum("...i,...ij->...j", step[..., :3], frame)
    normal = state[..., 3:6] + np.einsum("...i,...ij->...j", step[..., 3:5], frame[..., :2, :])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.concatenate([centre, normal, state[..., 6:] + step[..., 5:]], -1)


def _squares(off: Reals) -> Reals:
    return np.asarray(np.sum(off * off, -1))


def _mean_root(offsets: Reals) -> Reals:
    return np.asarray(np.sqrt(np.mean(offsets * offsets, -1)))
