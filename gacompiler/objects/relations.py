"""Distances, angles and nearest points of elements, by vector algebra on their shapes.

In the plane, lines are treated as planes and circles as spheres: the formulas are the same in every dimension.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import AlgebraError
from .shapes import Reals, Shape, length, unit

Relation = Callable[[Shape, Shape], Reals]


def _dot(a: Reals, b: Reals) -> Reals:
    return np.asarray(np.sum(a * b, axis=-1))


def _role(shape: Shape) -> str:
    """Return the kind under which an element appears in the table of distances."""
    kind = _role_of_angle(shape)
    return "plane" if kind == "line" and shape.dimension == 2 else kind


def _role_of_angle(shape: Shape) -> str:
    """Return the kind under which an element appears in the table of angles."""
    kind = shape.kind.removeprefix("dual ")
    return "sphere" if kind == "circle" and shape.dimension == 2 else kind


def _above(p: Reals, plane: Shape) -> Reals:
    return _dot(p - plane.place, plane.normal)


def _beside(p: Reals, line: Shape) -> Reals:
    """Return the vector from a line to points."""
    away = p - line.place
    return np.asarray(away - _dot(away, line.along)[..., None] * line.along)


def ends_of(pair: Shape) -> tuple[Reals, Reals]:
    """Return the coordinates of the points of a pair, in the order of its direction."""
    reach = pair.radius[..., None] * pair.along
    return pair.place - reach, pair.place + reach


def _parallel(sine: Reals, a: Shape, b: Shape) -> Any:
    """Whether the sine of an angle is within rounding error: unit vectors have errors of some units in the last place,
    and the products of their coordinates add up."""
    return np.abs(sine) <= 2 ** (2 + a.dimension) * np.finfo(np.result_type(a.along, b.along)).eps


def _sine(a: Shape, b: Shape) -> Reals:
    """Return the sine of the angle between the vectors of two shapes."""
    u, v = np.broadcast_arrays(
        a.normal if _role(a) == "plane" else a.along, b.normal if _role(b) == "plane" else b.along
    )
    if u.shape[-1] == 2:
        return np.asarray(np.abs(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]))
    return length(np.cross(u, v))


def _point_circle(p: Reals, circle: Shape) -> tuple[Reals, Reals, Reals]:
    """Return the height of points above the plane of a circle, the distance from its axis, and that in the plane."""
    away = p - circle.place
    height = _dot(away, circle.along)
    across = length(away - height[..., None] * circle.along)
    return height, across, across - circle.radius


def _line_line(a: Shape, b: Shape) -> Reals:
    sine = _sine(a, b)
    with np.errstate(invalid="ignore", divide="ignore"):
        skew = np.abs(_dot(b.place - a.place, np.cross(a.along, b.along))) / sine
    return np.where(_parallel(sine, a, b), length(_beside(b.place, a)), skew)


def _plane_plane(a: Shape, b: Shape) -> Reals:
    return np.where(_parallel(_sine(a, b), a, b), np.abs(_above(b.place, a)), 0.0)


def _line_plane(line: Shape, plane: Shape) -> Reals:
    return np.where(_parallel(_dot(line.along, plane.normal), line, plane), np.abs(_above(line.place, plane)), 0.0)


def _outside(gap: Reals) -> Reals:
    return np.maximum(gap, 0.0)


def _sphere_sphere(a: Shape, b: Shape) -> Reals:
    between = length(b.place - a.place)
    return _outside(np.maximum(between - a.radius - b.radius, np.abs(a.radius - b.radius) - between))


def _circle_plane(circle: Shape, plane: Shape) -> Reals:
    reach = circle.radius * _sine(circle, plane)
    return _outside(np.abs(_above(circle.place, plane)) - reach)


def _circle_sphere(circle: Shape, sphere: Shape) -> Reals:
    height, across, beside = _point_circle(sphere.place, circle)
    nearest, farthest = np.hypot(height, beside), np.hypot(height, across + circle.radius)
    return _outside(np.maximum(nearest - sphere.radius, sphere.radius - farthest))


def _of_pair(pair: Shape, other: Shape) -> Reals:
    return np.minimum(*(distance_of(pair._replace(kind="point", place=end), other) for end in ends_of(pair)))


_DISTANCES: dict[tuple[str, str], Relation] = {
    ("point", "point"): lambda a, b: length(b.place - a.place),
    ("point", "line"): lambda p, line: length(_beside(p.place, line)),
    ("point", "plane"): lambda p, plane: np.abs(_above(p.place, plane)),
    ("point", "circle"): lambda p, circle: np.hypot(*_point_circle(p.place, circle)[::2]),
    ("point", "sphere"): lambda p, sphere: np.abs(length(p.place - sphere.place) - sphere.radius),
    **{("point pair", kind): _of_pair for kind in ("point", "point pair", "line", "plane", "circle", "sphere")},
    ("line", "line"): _line_line,
    ("line", "plane"): _line_plane,
    ("line", "sphere"): lambda line, sphere: _outside(length(_beside(sphere.place, line)) - sphere.radius),
    ("plane", "plane"): _plane_plane,
    ("plane", "circle"): lambda plane, circle: _circle_plane(circle, plane),
    ("plane", "sphere"): lambda plane, sphere: _outside(np.abs(_above(sphere.place, plane)) - sphere.radius),
    ("circle", "sphere"): _circle_sphere,
    ("sphere", "sphere"): _sphere_sphere,
}
"""Minimum distances between points of two elements; spheres are surfaces, and pairs consist of two points."""


def _between(u: Reals, v: Reals) -> Reals:
    """Return the angle between unit vectors, accurate for small angles as well."""
    return np.asarray(2 * np.arctan2(length(u - v), length(u + v)))


def _vectors(a: Shape, b: Shape) -> Reals:
    return _between(a.along, b.along)


def _rising(a: Shape, b: Shape) -> Reals:
    """Return the angle of a direction with a plane, positive on the side of the normal."""
    return np.asarray(np.arctan2(_dot(a.along, b.normal), _sine(a, b)))


def _arccos(cosine: Reals, a: Shape, b: Shape, scale: Reals) -> Reals:
    """Return the angle of a cosine; elements that touch may have one beyond 1 by a rounding error, as in `_parallel`.

    The cosine is computed from squared distances and radii, as differences of squared coordinates, divided by `scale`.
    """
    squares = sum(_dot(each.place, each.place) + np.nan_to_num(each.squared) for each in (a, b))
    beyond = 2 ** (2 + a.dimension) * np.finfo(np.result_type(a.place, b.place)).eps * (1 + squares / scale)
    return np.asarray(np.arccos(np.where(np.abs(cosine) <= 1 + beyond, np.clip(cosine, -1, 1), cosine)))


def _spheres(a: Shape, b: Shape) -> Reals:
    with np.errstate(invalid="ignore", divide="ignore"):
        squares = a.squared + b.squared - _dot(a.place - b.place, a.place - b.place)
        scale = 2 * a.radius * b.radius
        return _arccos(squares / scale, a, b, scale)


def _plane_sphere(plane: Shape, sphere: Shape) -> Reals:
    with np.errstate(invalid="ignore", divide="ignore"):
        return _arccos(-_above(sphere.place, plane) / sphere.radius, plane, sphere, sphere.squared)


def _line_sphere(line: Shape, sphere: Shape) -> Reals:
    """Return the angle at which a line crosses a sphere, whose cosine is the line's distance over the radius."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return _arccos(length(_beside(sphere.place, line)) / sphere.radius, line, sphere, sphere.squared)


def _circle_sphere_angle(circle: Shape, sphere: Shape) -> Reals:
    """Return the angle at which a circle crosses a sphere.

    At a common point, the law of cosines gives the angle between the directions to this point and to the foot of the
    sphere's centre in the plane of the circle. The tangent of the circle there has the sine of the angle.
    """
    height, across, _ = _point_circle(sphere.place, circle)
    with np.errstate(invalid="ignore", divide="ignore"):
        squares = circle.squared + across**2 + height**2 - sphere.squared
        scale = 2 * circle.radius * across
        sine = across * np.sin(_arccos(squares / scale, circle, sphere, scale)) / sphere.radius
        return np.asarray(np.arcsin(np.minimum(1.0, sine)))


_ANGLES: dict[tuple[str, str], Relation] = {
    ("direction", "direction"): _vectors,
    ("direction", "plane"): _rising,
    ("direction", "circle"): _rising,
    ("plane", "plane"): lambda a, b: _between(a.normal, b.normal),
    ("plane", "circle"): lambda a, b: _between(a.normal, b.along),
    ("circle", "circle"): _vectors,
    ("line", "sphere"): _line_sphere,
    ("point pair", "sphere"): _line_sphere,
    ("circle", "sphere"): _circle_sphere_angle,
    ("plane", "sphere"): _plane_sphere,
    ("sphere", "sphere"): _spheres,
}
"""Angles between directions and normals, and at the intersection with a sphere, NaN if there is none."""
_AS_DIRECTION = ("line", "point pair", "vector")
"""Kinds whose angles are those of their direction."""


def _in_order(table: dict[tuple[str, str], Relation], a: Shape, one: str, b: Shape, two: str) -> Reals | None:
    """Return the relation of two shapes with these roles, in either order; None if the table has none."""
    if (one, two) in table:
        return table[one, two](a, b)
    return table[two, one](b, a) if (two, one) in table else None


def distance_of(a: Shape, b: Shape) -> Reals:
    """Return the minimum distance of two elements; vectors are points.

    Raises
    ------
    AlgebraError
        If it is not defined, or has no closed form.
    """
    a, b = (each._replace(kind="point") if each.kind == "vector" else each for each in (a, b))
    found = _in_order(_DISTANCES, a, _role(a), b, _role(b))
    if found is None:
        rest = "algorithms.geometry.distance" if "circle" in (a.kind, b.kind) else ""
        raise AlgebraError(
            "distance", f"a {a.kind} and a {b.kind}", "two of point, point pair, line, plane, circle, sphere",
            f"there is no closed form; {rest} computes it" if rest else "",
        )  # fmt: skip
    return found


def angle_of(a: Shape, b: Shape) -> Reals:
    """Return the angle between two elements.

    Raises
    ------
    AlgebraError
        If it is not defined.
    """
    roles = [_role_of_angle(each) for each in (a, b)]
    found = _in_order(_ANGLES, a, roles[0], b, roles[1])
    if found is None:
        one, two = ("direction" if each in _AS_DIRECTION else each for each in roles)
        found = _in_order(_ANGLES, a, one, b, two)
    if found is None:
        raise AlgebraError(
            "angle", f"a {a.kind} and a {b.kind}", "two of direction, point pair, line, plane, circle, sphere",
            "points have no angle; lines and circles cross a sphere, see algorithms.geometry.angle",
        )  # fmt: skip
    return found


def nearest_to(point: Shape, other: Shape) -> Reals:
    """Return the coordinates of the points of an element that are nearest to points.

    Raises
    ------
    AlgebraError
        If the element is of another kind.
    """
    p, role = np.broadcast_arrays(point.place, other.place)[0], _role(other)
    if role == "point":
        return np.broadcast_arrays(other.place, point.place)[0]
    if role == "line":
        return np.asarray(p - _beside(p, other))
    if role in ("plane", "circle"):
        foot = p - _above(p, other._replace(kind="plane") if role == "circle" else other)[..., None] * other.normal
        return foot if role == "plane" else _on_sphere(foot, other)
    if role == "sphere":
        return _on_sphere(p, other)
    if role == "point pair":
        one, two = ends_of(other)
        return np.where((length(p - one) <= length(p - two))[..., None], one, two)
    raise AlgebraError("project", f"a point onto a {other.kind}", "a point, point pair, line, plane, circle or sphere")


def _on_sphere(p: Reals, sphere: Shape) -> Reals:
    return np.asarray(sphere.place + sphere.radius[..., None] * unit(p - sphere.place))
