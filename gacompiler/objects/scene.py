"""Geometric shapes, in coordinates, of objects of projective and conformal algebras, for drawing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..algebra.catalog import CGA2, CGA3, PGA2, PGA3
from ..errors import AlgebraError, LayoutError
from .arrays import MultivectorArray
from .checks import require_blade
from .conformal import CGA2 as _PLANE
from .conformal import CGA3 as _ROOM
from .drawn import DIMENSIONS, is_of_motors, numbers_of

Vectors = Any
"""Arrays of coordinates along the last axis."""


@dataclass(frozen=True, slots=True)
class Points:
    """A cloud of points, ``(n, d)``."""

    places: Vectors


@dataclass(frozen=True, slots=True)
class Arrow:
    """A direction, drawn from the origin."""

    direction: Vectors


@dataclass(frozen=True, slots=True)
class Line:
    """The line through a point along a unit vector."""

    point: Vectors
    direction: Vectors


@dataclass(frozen=True, slots=True)
class Plane:
    """The plane ``normal . x = distance``, of a unit normal."""

    normal: Vectors
    distance: float


@dataclass(frozen=True, slots=True)
class PointPair:
    """Two points at a distance from a centre along a unit vector; imaginary pairs are drawn like real ones."""

    centre: Vectors
    direction: Vectors
    radius: float
    is_imaginary: bool


@dataclass(frozen=True, slots=True)
class Circle:
    """A circle; in space with the unit normal of its plane, which is None in two dimensions."""

    centre: Vectors
    normal: Vectors | None
    radius: float
    is_imaginary: bool


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere."""

    centre: Vectors
    radius: float
    is_imaginary: bool


@dataclass(frozen=True, slots=True)
class Frame:
    """A motor, as the origin and the ends of the unit vectors that it moves, ``(1 + d, d)``."""

    places: Vectors


Shape = Points | Arrow | Line | Plane | PointPair | Circle | Sphere | Frame

AXES = ("#d62728", "#2ca02c", "#1f77b4")
"""Colours of the axes of a frame."""


@dataclass(frozen=True, slots=True)
class Item:
    """An object of a scene: its shapes, label and colour."""

    shapes: tuple[Shape, ...]
    label: str
    colour: str


@dataclass(frozen=True, slots=True)
class Scene:
    """The items to be drawn, and the ``(d, 2)`` limits of the axes."""

    items: tuple[Item, ...]
    limits: Vectors

    @property
    def dimension(self) -> int:
        """The dimension, 2 or 3."""
        return len(self.limits)


COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf", "#8c564b", "#e377c2")


def scene_of(
    objects: Sequence[Any],
    labels: Sequence[str] | None = None,
    colours: Sequence[str] | None = None,
    limits: Any = None,
) -> Scene:
    """Convert objects to a scene.

    Raises
    ------
    AlgebraError
        If there are no objects, an object cannot be drawn (a screw), or the dimensions of algebras differ.
    LayoutError
        If the number of labels, colours or limits is wrong.
    """
    if not objects:
        raise AlgebraError("draw", "no object", "at least one")
    for name, given in (("labels", labels), ("colours", colours)):
        if given is not None and len(given) != len(objects):
            raise LayoutError("draw", f"{len(given)} {name}", f"{len(objects)}, one for each object")
    items = []
    dimensions = set()
    for k, each in enumerate(objects):
        shapes = tuple(shapes_of(each))
        dimensions.add(DIMENSIONS[each.algebra])
        label = labels[k] if labels is not None else ""
        items.append(Item(shapes, label, colours[k] if colours is not None else COLOURS[k % len(COLOURS)]))
    if len(dimensions) > 1:
        raise AlgebraError(
            "draw", "objects of the plane and of space", "objects of one dimension", "draw them separately"
        )
    (d,) = dimensions
    return Scene(tuple(items), _limits(items, d) if limits is None else _given(limits, d))


def shapes_of(x: Any) -> list[Shape]:
    """Return the shapes of a blade or motor, or of each one in an array; zeros are omitted.

    Raises
    ------
    AlgebraError
        If `x` is neither a blade nor a motor, or not of PGA2, PGA3, CGA2 or CGA3.
    """
    if not isinstance(x, MultivectorArray) or x.algebra not in DIMENSIONS:
        what = x.algebra.name if isinstance(x, MultivectorArray) else type(x).__name__
        raise AlgebraError("draw", f"an object of {what}", "blades and motors of PGA2, PGA3, CGA2 or CGA3")
    if is_of_motors(x.layout):
        return [_frame(each) for each in _listed(x)]
    grades = sorted({blade.bit_count() for blade in x.layout.support})
    if len(grades) != 1 or grades[0] in (0, x.algebra.dimension):
        raise AlgebraError("draw", f"a {x.layout} of grades {grades}", "a point, line, plane, round or motor")
    require_blade("draw", x)
    cloud = _cloud(x)
    if cloud is not None:
        return [cloud]
    make: Callable[[Any, int], Shape] = _conformal if x.algebra in (CGA2, CGA3) else _projective
    return _gathered(make(each, grades[0]) for each in _listed(x))


def _listed(x: Any) -> list[Any]:
    """Return the elements of an array, without zeros."""
    flat = x.reshape(-1) if x.ndim > 1 else x
    return [each for each in (list(flat) if flat.shape else [flat]) if np.any(each.values) or each.layout.fixed]


def _frame(motor: Any) -> Frame:
    if not np.all(motor.is_versor()):
        raise AlgebraError("draw", "an even element that moves no points to points", "a motor")
    d = DIMENSIONS[motor.algebra]
    moved = np.array([float(x) for x in numbers_of(motor, "frame", 0)]).reshape(d + 1, d + 1)
    return Frame(moved[:, :d] / moved[:, d:])


def _cloud(x: Any) -> Points | None:
    """Return points whose layout guarantees that they are finite as one cloud; None for other objects."""
    names = {PGA2: "e20 e01", PGA3: "e032 e013 e021", CGA2: "e1 e2", CGA3: "e1 e2 e3"}[x.algebra].split()
    if x.layout != x.algebra.POINT:
        return None
    return Points(np.stack([np.ravel(x[name]) for name in names], -1))


def _gathered(shapes: Iterable[Shape]) -> list[Shape]:
    """Merge all points into one cloud, followed by the other shapes."""
    found = list(shapes)
    places = [shape.places for shape in found if isinstance(shape, Points)]
    rest: list[Shape] = [shape for shape in found if not isinstance(shape, Points)]
    return [Points(np.concatenate(places)), *rest] if places else rest


def _projective(x: Any, grade: int) -> Shape:
    if x.algebra == PGA2:
        if grade == 2:
            return _point_or_direction(_named(x, "e20 e01"), x["e12"])
        normal, offset = _named(x, "e1 e2"), x["e0"]
        size = _length("line", normal)
        return Line(-normal * offset / size**2, np.array([-normal[1], normal[0]]) / size)
    if grade == 3:
        return _point_or_direction(_named(x, "e032 e013 e021"), x["e123"])
    if grade == 1:
        normal = _named(x, "e1 e2 e3")
        size = _length("plane", normal)
        return Plane(normal / size, -x["e0"] / size)
    direction, moment = np.array([x["e23"], -x["e13"], x["e12"]]), _named(x, "e01 e02 e03")
    size = _length("line", direction)
    return Line(np.cross(direction, moment) / size**2, direction / size)


def _point_or_direction(coordinates: Vectors, weight: float) -> Shape:
    if abs(weight) <= 1e-12 * np.abs(coordinates).max():
        return Arrow(coordinates)
    return Points((coordinates / weight)[None])


def _conformal(x: Any, grade: int) -> Shape:
    d = DIMENSIONS[x.algebra]
    space: Any = _ROOM if d == 3 else _PLANE
    names = "e1 e2 e3" if d == 3 else "e1 e2"
    if grade == 1:
        return _conformal(x.polarity(), d + 1)  # a vector represents the round or flat that is its dual
    if space.is_flat(x):
        if grade == 2:
            return Points(_named(x, " ".join(f"{name}inf" for name in names.split()))[None] / x["e0inf"])
        if grade == d + 1 and d == 3:
            dual = x.polarity()
            normal = _named(dual, names)
            size = _length("plane", normal)
            return Plane(normal / size, dual["einf"] / size)
        n = names.split()
        direction = np.array([-x[f"{name}0inf"] for name in n])
        size = _length("line", direction)
        moment = np.array([[0.0 if a == b else x[f"{a}{b[1:]}inf"] for b in n] for a in n])
        return Line(moment @ direction / size**2, direction / size)
    centre, squared = np.asarray(space.centre(x)), float(space.radius_squared(x))
    radius, imaginary = float(np.sqrt(abs(squared))), squared < 0
    if radius <= 1e-9 * (1 + np.abs(centre).max()):
        return Points(centre[None])
    if grade == 2:
        direction = _named(space.einf.left_contraction(x), names)
        return PointPair(centre, direction / np.linalg.norm(direction), radius, imaginary)
    if grade == 4:
        return Sphere(centre, radius, imaginary)
    if d == 2:
        return Circle(centre, None, radius, imaginary)
    normal = _named((x ^ space.einf).polarity(), names)
    return Circle(centre, normal / np.linalg.norm(normal), radius, imaginary)


def _named(x: Any, names: str) -> Vectors:
    return np.array([x[name] for name in names.split()])


def _length(what: str, vector: Vectors) -> float:
    size = float(np.linalg.norm(vector))
    if size == 0:
        raise AlgebraError("draw", f"a {what} at infinity", f"a finite {what}")
    return size


def _extent(shape: Shape) -> Vectors:
    """Return points that the picture should contain."""
    match shape:
        case Points(places) | Frame(places):
            return places
        case Arrow(direction):
            return np.array([np.zeros_like(direction), direction])
        case Line(point, direction):
            return np.array([point - direction, point + direction])
        case Plane(normal, distance):
            return (normal * distance)[None]
        case PointPair(centre, direction, radius, _):
            return np.array([centre - radius * direction, centre + radius * direction])
        case Circle(centre, _, radius, _) | Sphere(centre, radius, _):
            return np.array([centre - radius, centre + radius])


def _limits(items: Sequence[Item], d: int) -> Vectors:
    parts = [_extent(shape) for item in items for shape in item.shapes]
    parts = [part[np.all(np.isfinite(part), axis=-1)] for part in parts]
    found = np.concatenate([*parts, np.zeros((0, d))])
    if not len(found):
        return np.array([[-1.0, 1.0]] * d)
    low, high = found.min(axis=0), found.max(axis=0)
    half = max(float((high - low).max()), 1.0) * 0.6
    centre = (low + high) / 2
    return np.stack([centre - half, centre + half], -1)


def _given(limits: Any, d: int) -> Vectors:
    found = np.asarray(limits, float)
    if found.shape == (2,):
        found = np.broadcast_to(found, (d, 2))
    if found.shape != (d, 2) or np.any(found[:, 0] >= found[:, 1]):
        raise LayoutError("draw", f"limits {np.asarray(limits).tolist()}", f"(low, high), or {d} of these")
    return found


def clipped(line: Line, limits: Vectors) -> Vectors | None:
    """Return the two end points of a line in a box, ``(2, d)``; None if it does not intersect the box."""
    low, high = -np.inf, np.inf
    for p, v, (a, b) in zip(line.point, line.direction, limits, strict=True):
        if abs(v) < 1e-12:
            if not a <= p <= b:
                return None
            continue
        ends = sorted(((a - p) / v, (b - p) / v))
        low, high = max(low, ends[0]), min(high, ends[1])
    return line.point + np.outer([low, high], line.direction) if low < high else None


def polygon(plane: Plane, limits: Vectors) -> Vectors | None:
    """Return the corners of a plane in a box, in order; None if it does not intersect the box."""
    corners = np.array([[x[i] for x, i in zip(limits, (k & 1, k >> 1 & 1, k >> 2), strict=True)] for k in range(8)])
    edges = [(a, a | 1 << axis) for a in range(8) for axis in range(3) if not a >> axis & 1]
    found = []
    for a, b in edges:
        x, y = corners[a] @ plane.normal - plane.distance, corners[b] @ plane.normal - plane.distance
        if x * y <= 0 and x != y:
            found.append(corners[a] + (corners[b] - corners[a]) * x / (x - y))
    if len(found) < 3:
        return None
    places = np.array(found)
    u, v = across(plane.normal)
    middle = places - places.mean(axis=0)
    return places[np.argsort(np.arctan2(middle @ v, middle @ u))]


def across(normal: Vectors) -> tuple[Vectors, Vectors]:
    """Return two unit vectors that form a right-handed frame with a unit normal."""
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    return u, np.cross(normal, u)


def round_of(circle: Circle, n: int = 97) -> Vectors:
    """Return points on a circle in space; the last point is equal to the first."""
    assert circle.normal is not None
    u, v = across(circle.normal)
    angle = np.linspace(0, 2 * np.pi, n)[:, None]
    return circle.centre + circle.radius * (np.cos(angle) * u + np.sin(angle) * v)


def net_of(sphere: Sphere, n: int = 25) -> tuple[Vectors, Vectors, Vectors]:
    """Return x, y and z of a grid of points on a sphere."""
    azimuth, polar = np.meshgrid(np.linspace(0, 2 * np.pi, n), np.linspace(0, np.pi, (n + 1) // 2))
    unit = np.stack([np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)])
    x, y, z = sphere.centre[:, None, None] + sphere.radius * unit
    return x, y, z


def anchor(shape: Shape, limits: Vectors) -> Vectors:
    """Return the position of a label."""
    match shape:
        case Points(places) | Frame(places):
            return places[0]
        case Arrow(direction):
            return direction
        case Line():
            ends = clipped(shape, limits)
            return shape.point if ends is None else ends[1]
        case Plane(normal, distance):
            return normal * distance
        case PointPair(centre, direction, radius, _):
            return centre + radius * direction
        case Circle(centre, None, radius, _):
            return centre + radius * np.sqrt(0.5)
        case Circle():
            return round_of(shape)[12]
        case Sphere(centre, radius, _):
            return centre + np.array([0, 0, radius])
