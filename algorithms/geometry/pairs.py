"""Distances, angles, meets and projections of pairs of points, point pairs, lines, circles, planes and spheres.

Elements say what they are. Arrays do not, and the name of their kind comes before them: a plane has the four
coefficients of `generated.cga3`, a point three coordinates. Tables map pairs of kinds to kernels or combinations of
kernels. Meaningless operations are omitted from the tables; requesting one raises an error that lists the available
kinds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, overload

import numpy as np

from generated import cga3
from generated.gac_runtime.annotations import Numbers, Stored

from ..arguments import Reals
from ..elements import Coefficients, E
from .circles import nearest_on_circles
from .kinds import Kind, given, listed

TOLERANCE = 1e-9
"""A point lies on an object if their distance is at most this, times the point's distance from the origin if above 1.
"""

Operation = Callable[[Reals, Reals], Reals]


@dataclass(frozen=True, slots=True, eq=False)
class Meet:
    """The intersection of two objects."""

    kind: str
    """Kind of the intersection: ``point``, ``point pair``, ``line`` or ``circle``; ``points`` for the points of a pair
    that lie on an object."""
    common: Coefficients
    """Coefficients of that kind, as an element if elements were passed. Meaningless, infinite or NaN if `how` indicates
    that there is no intersection."""
    how: Reals
    """(...) 1: the objects intersect; 0: they are tangent (or one point of a pair lies on the object); -1: they do not
    intersect; 2: parallel or concentric; 3: one contains the other. The tolerance is that of the kernels
    `meet_..._kind`."""


def _ends(pair: Reals) -> tuple[Reals, Reals]:
    first, second = cga3.point_pair_points(pair)
    return first, second


def _dual_sphere(sphere: Reals) -> Reals:
    return np.asarray(cga3.sphere_polarity(sphere))


def _dual_plane(plane: Reals) -> Reals:
    return np.asarray(cga3.sphere_polarity(cga3.sphere_from_plane(plane)))


def _of_ends(kind: str) -> Operation:
    """Return the operation for the minimum of the distances of a pair's points."""

    def distance_of_pair(pair: Reals, other: Reals) -> Reals:
        one, two = (_in_order(DISTANCES, "point", end, kind, other) for end in _ends(pair))
        return np.minimum(one, two)

    return distance_of_pair


def _in_order(table: dict[tuple[str, str], Operation], kind: str, one: Reals, other: str, two: Reals) -> Reals:
    """Apply an operation of a table to two kinds in either order."""
    known = table.get((kind, other))
    return known(one, two) if known is not None else table[other, kind](two, one)


def _line_to_circle(line: Reals, circle: Reals) -> Reals:
    return np.asarray(cga3.distance_points(*cga3.closest_points_line_circle(line, circle)))


DISTANCES: dict[tuple[str, str], Operation] = {
    ("point", "point"): cga3.distance_points,
    ("point", "point pair"): lambda p, pair: _of_ends("point")(pair, p),
    ("point", "line"): cga3.distance_point_line,
    ("point", "circle"): cga3.distance_point_circle,
    ("point", "plane"): lambda p, plane: np.abs(cga3.signed_distance_point_plane(p, cga3.plane_polarity(plane))),
    ("point", "sphere"): lambda p, sphere: np.abs(cga3.signed_distance_point_sphere(p, sphere)),
    ("point pair", "point pair"): _of_ends("point pair"),
    ("point pair", "line"): _of_ends("line"),
    ("point pair", "circle"): _of_ends("circle"),
    ("point pair", "plane"): _of_ends("plane"),
    ("point pair", "sphere"): _of_ends("sphere"),
    ("line", "line"): cga3.distance_lines,
    ("line", "circle"): _line_to_circle,
    ("line", "plane"): lambda line, plane: np.abs(cga3.signed_distance_line_plane(line, plane)),
    ("line", "sphere"): cga3.distance_line_sphere,
    ("circle", "circle"): lambda a, b: nearest_on_circles(a, b).distance,
    ("circle", "plane"): lambda circle, plane: cga3.distance_plane_circle(plane, circle),
    ("circle", "sphere"): cga3.distance_circle_sphere,
    ("plane", "plane"): lambda a, b: np.abs(cga3.signed_distance_planes(a, b)),
    ("plane", "sphere"): cga3.distance_plane_sphere,
    ("sphere", "sphere"): cga3.distance_spheres,
}
"""Minimum distances between points of two objects: 21 pairs of kinds."""


def _angle_of_crossing(line_or_circle: Reals, dual: Reals) -> Reals:
    sine = np.minimum(1, cga3.conformal_sine_circle_sphere(line_or_circle, dual))
    apart = cga3.meet_circle_dual_sphere_kind(line_or_circle, dual) == -1
    return np.where(apart, np.nan, np.arcsin(sine))


ANGLES: dict[tuple[str, str], Operation] = {
    ("point pair", "point pair"): lambda a, b: cga3.angle_between_lines(
        cga3.point_pair_line(a), cga3.point_pair_line(b)
    ),
    ("point pair", "line"): lambda pair, line: cga3.angle_between_lines(cga3.point_pair_line(pair), line),
    ("point pair", "circle"): lambda pair, circle: cga3.signed_angle_line_plane(
        cga3.point_pair_line(pair), cga3.circle_plane(circle)
    ),
    ("point pair", "plane"): lambda pair, plane: cga3.signed_angle_line_plane(cga3.point_pair_line(pair), plane),
    ("point pair", "sphere"): lambda pair, sphere: ANGLES["line", "sphere"](cga3.point_pair_line(pair), sphere),
    ("line", "line"): cga3.angle_between_lines,
    ("line", "circle"): lambda line, circle: cga3.signed_angle_line_plane(line, cga3.circle_plane(circle)),
    ("line", "plane"): cga3.signed_angle_line_plane,
    ("line", "sphere"): lambda line, sphere: _angle_of_crossing(cga3.circle_from_line(line), _dual_sphere(sphere)),
    ("circle", "circle"): cga3.angle_between_circles,
    ("circle", "plane"): lambda circle, plane: cga3.angle_between_planes(cga3.circle_plane(circle), plane),
    ("circle", "sphere"): lambda circle, sphere: _angle_of_crossing(circle, _dual_sphere(sphere)),
    ("plane", "plane"): cga3.angle_between_planes,
    ("plane", "sphere"): lambda plane, sphere: cga3.angle_between_dual_spheres(
        _dual_plane(plane), _dual_sphere(sphere)
    ),
    ("sphere", "sphere"): lambda a, b: cga3.angle_between_dual_spheres(_dual_sphere(a), _dual_sphere(b)),
}
"""Angles between directions and normals: the direction of a pair is that of its line, the normal of a circle that of
its plane. Angles with a sphere are those at the intersection, NaN if there is none. Points have no angle."""


def _common_line_line(a: Reals, b: Reals) -> tuple[str, Reals, Reals]:
    how = cga3.meet_circles_kind(cga3.circle_from_line(a), cga3.circle_from_line(b))
    return "point", cga3.closest_points_of_lines(a, b)[0], how


def _common_line_circle(line: Reals, circle: Reals) -> tuple[str, Reals, Reals]:
    how = cga3.meet_circles_kind(cga3.circle_from_line(line), circle)
    return "point pair", cga3.meet_line_circle(line, circle), how


def _common_line_plane(line: Reals, plane: Reals) -> tuple[str, Reals, Reals]:
    how = cga3.meet_circle_dual_sphere_kind(cga3.circle_from_line(line), _dual_plane(plane))
    with np.errstate(divide="ignore", invalid="ignore"):
        return "point", cga3.meet_line_plane(line, plane), how


def _common_line_sphere(line: Reals, sphere: Reals) -> tuple[str, Reals, Reals]:
    how = cga3.meet_circle_dual_sphere_kind(cga3.circle_from_line(line), _dual_sphere(sphere))
    return "point pair", cga3.meet_line_sphere(line, sphere), how


MEETS: dict[tuple[str, str], Callable[[Reals, Reals], tuple[str, Reals, Reals]]] = {
    ("line", "line"): _common_line_line,
    ("line", "circle"): _common_line_circle,
    ("line", "plane"): _common_line_plane,
    ("line", "sphere"): _common_line_sphere,
    ("circle", "circle"): lambda a, b: ("point pair", cga3.meet_circles(a, b), cga3.meet_circles_kind(a, b)),
    ("circle", "plane"): lambda circle, plane: (
        "point pair",
        cga3.meet_circle_plane(circle, plane),
        cga3.meet_circle_dual_sphere_kind(circle, _dual_plane(plane)),
    ),
    ("circle", "sphere"): lambda circle, sphere: (
        "point pair",
        cga3.meet_circle_sphere(circle, sphere),
        cga3.meet_circle_dual_sphere_kind(circle, _dual_sphere(sphere)),
    ),
    ("plane", "plane"): lambda a, b: (
        "line",
        cga3.meet_planes(a, b),
        cga3.meet_dual_spheres_kind(_dual_plane(a), _dual_plane(b)),
    ),
    ("plane", "sphere"): lambda plane, sphere: (
        "circle",
        cga3.meet_sphere_plane(sphere, plane),
        cga3.meet_dual_spheres_kind(_dual_plane(plane), _dual_sphere(sphere)),
    ),
    ("sphere", "sphere"): lambda a, b: (
        "circle",
        cga3.meet_spheres(a, b),
        cga3.meet_dual_spheres_kind(_dual_sphere(a), _dual_sphere(b)),
    ),
}
"""Intersections of two objects other than points and point pairs, which are handled by their distance."""


def _project_line_on_plane(line: Reals, plane: Reals) -> Reals:
    support = cga3.line_support(line)
    further = support + cga3.line_to_direction_moment(line)[0]
    return np.asarray(cga3.line_from_points(*(cga3.project_point_on_plane(p, plane) for p in (support, further))))


def _nearer_end(p: Reals, pair: Reals) -> Reals:
    first, second = _ends(pair)
    nearer = cga3.distance_points(p, first) <= cga3.distance_points(p, second)
    return np.where(nearer[..., None], first, second)


PROJECTIONS: dict[tuple[str, str], Operation] = {
    ("point", "point"): lambda p, q: np.broadcast_arrays(p, q)[1],
    ("point", "point pair"): _nearer_end,
    ("point", "line"): cga3.project_point_on_line,
    ("point", "circle"): cga3.project_point_on_circle,
    ("point", "plane"): cga3.project_point_on_plane,
    ("point", "sphere"): cga3.project_point_on_sphere,
    ("line", "point"): lambda line, p: cga3.line_from_point_direction(p, cga3.line_to_direction_moment(line)[0]),
    ("line", "plane"): _project_line_on_plane,
    ("line", "sphere"): lambda line, s: cga3.project_circle_on_sphere(cga3.circle_from_line(line), _dual_sphere(s)),
    ("circle", "plane"): lambda circle, plane: cga3.project_circle_on_sphere(circle, _dual_plane(plane)),
    ("circle", "sphere"): lambda circle, sphere: cga3.project_circle_on_sphere(circle, _dual_sphere(sphere)),
    ("plane", "point"): lambda plane, p: cga3.plane_from_point_normal(p, cga3.plane_to_normal(plane)[0]),
}
"""Projections of the first object on the second. Points: the nearest point. Lines and planes on a point: the parallel
object through the point. Circles and lines on spheres, and circles on planes: the intersection with the sphere through
the projected object that is orthogonal to the second. Pairs: projection of both points."""


@overload
def distance(one: Stored, two: Stored, /) -> Reals: ...
@overload
def distance(kind: Kind, one: Numbers | Stored, other: Kind, two: Numbers | Stored, /) -> Reals: ...
def distance(*arguments: Any) -> Reals:
    """Return the minimum distance of two objects in the units of the coordinates, 0 if they intersect.

    Parameters
    ----------
    one, two : multivector
        Elements of PGA2, PGA3, CGA2 or CGA3, in any layout; elements of the plane lie in z = 0. Leading axes broadcast.
        Or arrays of shape (..., size of the kind), coefficients in the layouts of `generated.cga3`, each after its
        kind: ``distance("point", p, "plane", plane)``. Spheres are surfaces, and pairs consist of two points.
    kind, other : str
        Keys of `KINDS`, in either order.

    Returns
    -------
    array, (...)
        NaN for imaginary circles, spheres and pairs, and for circles and spheres that are flat.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or a kind is unknown.
    """
    one, two = given("distance", arguments, ("one", "two"))
    return np.asarray(_in_order(DISTANCES, one.kind, one.values, two.kind, two.values))


@overload
def angle(one: Stored, two: Stored, /) -> Reals: ...
@overload
def angle(kind: Kind, one: Numbers | Stored, other: Kind, two: Numbers | Stored, /) -> Reals: ...
def angle(*arguments: Any) -> Reals:
    """Return the angle between two objects, in radians; see `ANGLES`.

    The angle between two directions or two normals is in [0, pi]. The angle of a line or pair with a plane or the plane
    of a circle is in [-pi/2, pi/2], positive in the direction of the normal. The angle at which a line or circle
    intersects a sphere is in [0, pi/2].

    Parameters
    ----------
    one, two, kind, other
        As in `distance`.

    Returns
    -------
    array, (...)

    Raises
    ------
    TypeError, ValueError
        As in `distance`, and if no angle is defined for the two kinds.
    """
    one, two = given("angle", arguments, ("one", "two"))
    if not ({(one.kind, two.kind), (two.kind, one.kind)} & ANGLES.keys()):
        raise ValueError(
            f"angle: not defined for {one.kind} and {two.kind}; expected two of {listed(sorted(_kinds_of(ANGLES)))}"
        )
    return np.asarray(_in_order(ANGLES, one.kind, one.values, two.kind, two.values))


@overload
def meet(one: Stored, two: Stored, /, *, tolerance: float = TOLERANCE) -> Meet: ...
@overload
def meet(
    kind: Kind, one: Numbers | Stored, other: Kind, two: Numbers | Stored, /, *, tolerance: float = TOLERANCE
) -> Meet: ...
def meet(*arguments: Any, tolerance: float = TOLERANCE) -> Meet:
    """Return the intersection of two objects and its type.

    Parameters
    ----------
    one, two, kind, other
        As in `distance`. The intersection of elements is an element of the algebra of the first one, or of CGA3 if that
        has no such kind: two spheres have a circle.
    tolerance : float
        A point lies on an object if their distance is at most this, times the point's distance from the origin if that
        is above 1.

    Returns
    -------
    Meet

    Raises
    ------
    TypeError, ValueError
        As in `distance`.
    """
    one, two = given("meet", arguments, ("one", "two"))
    found = _meet(one.kind, one.values, two.kind, two.values, tolerance)
    return Meet(found.kind, one.returned(found.kind.removesuffix("s"), found.common), found.how)


def _meet(kind: str, first: Reals, other: str, second: Reals, tolerance: float) -> Meet:
    if (kind, other) in MEETS:
        return Meet(*MEETS[kind, other](first, second))
    if (other, kind) in MEETS:
        return Meet(*MEETS[other, kind](second, first))
    if "point" not in (kind, other):  # then one is a pair
        kind, first, other, second = (
            (kind, first, other, second) if kind == "point pair" else (other, second, kind, first)
        )
        ends = np.stack(_ends(first), -2)
        there = np.stack([_lies_on(end, other, second, tolerance) for end in _ends(first)], -1)
        how = there.sum(-1) - 1.0
        same = other == "point pair"
        return Meet("points", np.where(there[..., None], ends, np.nan), np.where(same & (how == 1), 3.0, how))
    kind, first, other, second = (kind, first, other, second) if kind == "point" else (other, second, kind, first)
    there = _lies_on(first, other, second, tolerance)
    return Meet("point", np.where(there[..., None], first, np.nan), np.where(there, 3.0, -1.0))


@overload
def project(one: E, two: Stored, /) -> E: ...
@overload
def project(kind: Kind, one: Numbers | Stored, other: Kind, two: Numbers | Stored, /) -> Coefficients: ...
def project(*arguments: Any) -> Any:
    """Return the projection of the first object on the second; see `PROJECTIONS`.

    Parameters
    ----------
    one, two, kind, other
        As in `distance`, but the order matters.

    Returns
    -------
    array or multivector
        An object of the first kind, except that a line on a sphere gives a circle. NaN or 0 where the projection is
        undetermined: the centre of a sphere on the sphere, a line on an orthogonal plane. Elements give an element, as
        in `meet`.

    Raises
    ------
    TypeError, ValueError
        As in `distance`, and if the projection is not defined.
    """
    one, two = given("project", arguments, ("one", "two"))
    if one.kind == "point pair":
        ends = (PROJECTIONS["point", two.kind](p, two.values) for p in _ends(one.values))
        return one.returned("point pair", np.asarray(cga3.point_pair_from_points(*ends)))
    known = PROJECTIONS.get((one.kind, two.kind))
    if known is None:
        onto = [b for a, b in PROJECTIONS if a == one.kind]
        raise ValueError(
            f"project: not defined for a {one.kind} on a {two.kind}; "
            f"expected it on {listed(onto) if onto else 'nothing'}"
        )
    kind = "circle" if (one.kind, two.kind) == ("line", "sphere") else one.kind
    return one.returned(kind, np.asarray(known(one.values, two.values)))


def _lies_on(p: Reals, kind: str, other: Reals, tolerance: float) -> Reals:
    size = np.maximum(1, np.linalg.norm(p, axis=-1))
    return np.asarray(_in_order(DISTANCES, "point", p, kind, other) <= tolerance * size)


def _kinds_of(table: dict[tuple[str, str], Operation]) -> set[str]:
    return {kind for pair in table for kind in pair}
