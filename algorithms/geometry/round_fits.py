"""Least-squares fits of cylinders and cones to points, starting from the best of many directions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3

from ..arguments import Reals
from ..precision import NEGLIGIBLE, TINY
from .circles import STARTS
from .fit_evidence import Fitted, arc_of, box_of, rounding_of
from .fits import Judgement, axis_after, axis_frame, descend, enough_points, off_cylinder, seen_along

DIRECTIONS = 400
"""Number of directions of the axis that are tried, distributed evenly over a hemisphere."""


@dataclass(frozen=True, eq=False)
class CylinderFit(Judgement):
    """The result of `fit_cylinder`."""

    axis: Reals
    """(..., 6) A line of `generated.cga3`. All results are NaN if there is no cylinder."""
    radius: Reals
    """(...)"""
    residual: Reals
    """(...) The root mean square of the distances."""
    determined: Reals
    """(...) bool. False if the cylinder is not unique, or does not exist because all points are coplanar."""
    _evidence: tuple[Any, ...] = field(repr=False)


@dataclass(frozen=True, eq=False)
class ConeFit(Judgement):
    """The result of `fit_cone`."""

    apex: Reals
    """(..., 3)"""
    axis: Reals
    """(..., 6) A line of `generated.cga3` through the apex, directed towards the majority of the points."""
    angle: Reals
    """(...) The angle between axis and cone, in radians, in [0, pi/2]."""
    residual: Reals
    """(...) The root mean square of the distances to the double cone."""
    determined: Reals
    """(...) bool. As in `CylinderFit`."""
    _evidence: tuple[Any, ...] = field(repr=False)


def fit_cylinder(points: ArrayLike) -> CylinderFit:
    """Return the circular cylinder that minimises the sum of squared distances.

    Parameters
    ----------
    points : array_like, (..., n, 3)
        At least six points.

    Returns
    -------
    CylinderFit

    Raises
    ------
    TypeError, ValueError
        If the points have a wrong shape or type, are too few, or are not finite.

    Notes
    -----
    For each of 400 directions, linear equations give the best circle for the points projected along the direction. The
    six best directions are refined by Gauss-Newton steps, and the result with the smallest sum is returned.
    """
    places, part = enough_points(points, 6, True)
    state, residual, determined = _best(places, part, 3, _cylinder_start, off_cylinder, 5)
    line = cga3.line_from_point_direction(state[..., :3], state[..., 3:6])
    evidence = _fitted_cylinder, determined, 3, places, state
    return CylinderFit(line, np.abs(state[..., 6]), residual, determined, evidence)


def fit_cone(points: ArrayLike) -> ConeFit:
    """Return the circular cone that minimises the sum of squared distances.

    Parameters
    ----------
    points : array_like, (..., n, 3)
        At least seven points, on one nappe of the cone or on both.

    Returns
    -------
    ConeFit

    Raises
    ------
    TypeError, ValueError
        As in `fit_cylinder`.

    Notes
    -----
    The method is that of `fit_cylinder`. For a given direction of the axis, a cone is linear in five parameters. A
    cylinder is a cone whose apex is at infinity; therefore points of a cylinder do not determine a cone.
    """
    places, part = enough_points(points, 7, True)
    state, residual, determined = _best(places, part, 5, _cone_start, _off_cone, 6)
    side = np.sign(np.median(((places - state[..., None, :3]) * state[..., None, 3:6]).sum(-1), -1))
    direction = np.where(side < 0, -1, 1)[..., None] * state[..., 3:6]
    line = cga3.line_from_point_direction(state[..., :3], direction)
    evidence = _fitted_cone, determined, 3, places, state
    return ConeFit(state[..., :3], line, state[..., 6], residual, determined, evidence)


def _fitted_cylinder(places: Reals, state: Reals) -> Fitted:
    middle = places.mean(0)
    along = (middle - state[:3]) @ state[3:6]
    scaled, here, size = _in_units(
        places, np.concatenate([state[:3] + along * state[3:6], state[3:6], state[6:]]), middle
    )
    here[6] = state[6] / size
    off, jacobian = off_cylinder(scaled, here)
    h = (scaled - here[:3]) @ here[3:6]
    c, s = -jacobian[:, :2].T
    extents = np.array([np.inf, np.inf, np.inf, h.var(), h.var(), np.inf])
    parts, radius = (((0, 1), size), ((3, 4), None), ((5,), size)), abs(float(here[6]))
    thickness = box_of(scaled, 3) / (radius * arc_of(c, s) * float(np.ptp(h)))
    rounding = rounding_of(places, size)
    return Fitted(
        off[None], jacobian[None], np.stack([h, c, s], -1), parts, extents, rounding, True, thickness, radius, 5
    )


def _fitted_cone(places: Reals, state: Reals) -> Fitted:
    scaled, here, size = _in_units(places, state, places.mean(0))
    off = _off_cone(scaled, here)[0]
    x, y, h, c, s = seen_along(scaled, here)
    # The derivatives are those at the nearest points of the cone, which do not depend on the residuals.
    cosine, sine = np.cos(here[6]), np.sin(here[6])
    along = np.hypot(x, y) * sine + np.abs(h) * cosine
    h = np.where(h < 0, -along, along) * cosine
    on = np.stack([along * sine * c, along * sine * s, h], -1)
    jacobian = _off_cone(here[:3] + on @ axis_frame(here[3:6]), here)[1]
    extents = np.array([np.inf, np.inf, np.inf, h.var(), h.var(), np.inf])
    parts = ((0, 1, 2), size), ((3, 4), None), ((5,), None)
    where = np.stack([h - h.mean(), c, s], -1)
    radius = float(along.mean() * abs(sine))
    thickness = box_of(scaled, 3) / (radius * arc_of(c, s) * max(float(np.ptp(along)), TINY))
    rounding = rounding_of(places, size)
    return Fitted(off[None], jacobian[None], where, parts, extents, rounding, True, thickness, radius)


def _in_units(places: Reals, state: Reals, middle: Reals) -> tuple[Reals, Reals, float]:
    """Return points and a state about their middle, in units of their size."""
    size = float(np.sqrt(((places - middle) ** 2).sum(-1).mean()))
    return (places - middle) / size, np.concatenate([(state[:3] - middle) / size, state[3:]]), size


Start = Callable[[Reals, Reals, Reals], Reals]


def _best(
    places: Reals,
    part: float,
    unknowns: int,
    start: Start,
    off: Callable[[Reals, Reals], tuple[Reals, Reals]],
    dof: int,
) -> tuple[Reals, Reals, Reals]:
    """Return the best state for each set of points: position and direction of the axis, and a radius or angle.

    `part` of the coordinates may be rounding.
    """
    leading = places.shape[:-2]
    states, residuals, known = np.empty((*leading, 7)), np.empty(leading), np.zeros(leading, bool)
    with np.errstate(all="ignore"):
        for k in np.ndindex(leading):
            states[k], residuals[k], known[k] = _one(places[k], part, unknowns, start, off, dof)
    wrong = np.where(known, 0, np.nan)
    return states + wrong[..., None], residuals + wrong, known


def _one(
    places: Reals,
    part: float,
    unknowns: int,
    start: Start,
    off: Callable[[Reals, Reals], tuple[Reals, Reals]],
    dof: int,
) -> tuple[Reals, float, bool]:
    middle = places.mean(0)
    size = np.sqrt(((places - middle) ** 2).sum(-1).mean())
    spread = np.linalg.svd(places - middle, compute_uv=False)
    if not spread[2] > max(NEGLIGIBLE * spread[0], part * np.linalg.norm(places)):
        return np.zeros(7), 0.0, False
    scaled = (places - middle) / size
    frames = axis_frame(_directions())
    x, y, h = np.moveaxis(scaled @ np.swapaxes(frames, -1, -2), -1, 0)
    columns = np.stack([2 * x, 2 * y, np.ones_like(x), h, h * h][:unknowns], -1)
    rows = np.concatenate([columns, (x * x + y * y)[..., None]], -1)
    triangle = np.asarray(np.linalg.qr(rows, mode="r"))
    chosen = np.argsort(np.abs(triangle[:, -1, -1]))[:STARTS]
    solved = np.linalg.pinv(triangle[chosen, :-1, :-1]) @ triangle[chosen, :-1, -1:]
    state = start(solved[..., 0], frames[chosen], h[chosen])
    sets = np.broadcast_to(scaled, (len(state), *scaled.shape))
    usable = np.isfinite(state).all(-1)
    if not usable.any():
        return np.zeros(7), 0.0, False
    found, residual = descend(sets[usable], state[usable], off, axis_after)
    k = int(np.argmin(np.where(np.isfinite(residual), residual, np.inf)))
    jacobian = off(scaled, found[k])[1]
    values = np.linalg.svd(jacobian, compute_uv=False)
    determined = bool(np.isfinite(values).all() and values[dof - 1] > NEGLIGIBLE * values[0])
    best = found[k]
    number = size * best[6] if off is off_cylinder else best[6]
    return np.concatenate([middle + size * best[:3], best[3:6], [number]]), float(size * residual[k]), determined


def _directions() -> Reals:
    """Return unit vectors distributed over a hemisphere by the golden angle."""
    k = np.arange(DIRECTIONS)
    height = (k + 0.5) / DIRECTIONS
    azimuth = np.pi * (3 - np.sqrt(5)) * k
    across = np.sqrt(1 - height * height)
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), height], -1)


def _cylinder_start(solved: Reals, frames: Reals, h: Reals) -> Reals:
    """Return axis and radius from ``x^2 + y^2 = 2 u x + 2 v y + c``: the axis is at (u, v)."""
    u, v, c = np.moveaxis(solved, -1, 0)
    place = u[..., None] * frames[..., 0, :] + v[..., None] * frames[..., 1, :]
    return np.concatenate([place, frames[..., 2, :], np.sqrt(np.abs(c + u * u + v * v))[..., None]], -1)


def _cone_start(solved: Reals, frames: Reals, h: Reals) -> Reals:
    """Return apex, axis and angle from ``x^2 + y^2 = 2 u x + 2 v y + c + b h + a h^2``.

    The height of the apex is ``-b / 2a``, the tangent of the angle is the square root of a.
    """
    u, v, _, b, a = np.moveaxis(solved, -1, 0)
    top = -b / (2 * a)
    place = u[..., None] * frames[..., 0, :] + v[..., None] * frames[..., 1, :] + top[..., None] * frames[..., 2, :]
    return np.concatenate([place, frames[..., 2, :], np.arctan(np.sqrt(np.abs(a)))[..., None]], -1)


def _off_cone(points: Reals, state: Reals) -> tuple[Reals, Reals]:
    """Return distances, and their derivatives with respect to apex, tilt and angle."""
    x, y, h, c, s = seen_along(points, state)
    length, side = np.hypot(x, y), np.where(h < 0, -1.0, 1.0)
    cosine, sine = np.cos(state[..., None, 6]), np.sin(state[..., None, 6])
    o = np.zeros_like(x)
    columns = [
        -c * cosine,
        -s * cosine,
        side * sine + o,
        -h * c * cosine - side * x * sine,
        -h * s * cosine - side * y * sine,
        -length * sine - side * h * cosine,
    ]
    return length * cosine - side * h * sine, np.stack(columns, -1)
