"""One line of text that says what an element is, with numbers of three significant digits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..algebra.catalog import CGA2, CGA3, QUATERNIONS, STA, VGA3
from ..errors import GacError
from . import shapes
from .blades import half_of_digits
from .motions import MOTIONS, Motion, motion_of, velocity_of
from .shapes import Shape, grades_in


def line_of(x: Any) -> str:
    """Return the line of an element; of an array, its shape, the kind of all elements, and the line of the first."""
    if not x.shape:
        return _single(x)
    if x.size == 0:
        return f"empty array of shape {x.shape}, {x.layout}"
    return f"array of shape {x.shape}, {_kind_of_all(x)}; the first: {_single(x[(0,) * x.ndim])}"


def _kind_of_all(x: Any) -> str:
    """Return the plural of the kind of all elements, or their layout if there is no such word."""
    try:
        kind = shapes.shape_of("explain", x).kind
    except GacError:
        return str(x.layout)
    return f"{kind}s" if kind.removeprefix("dual ") in _LINES else str(x.layout)


def _single(x: Any) -> str:
    if not np.all(np.isfinite(x.values)):
        return "undefined, with coefficients that are not finite"
    grades = grades_in(x)
    if not grades:
        return "zero"
    if x.values.dtype.kind == "c":
        return _by_grades(x, grades)
    if x.algebra == STA:
        return _of_spacetime(x, grades)
    if 0 in x.layout.support and x.algebra in MOTIONS:
        return _of_versor(x, grades)
    shape = shapes.shape_of("explain", x)
    describe = _LINES.get(shape.kind.removeprefix("dual "))
    if describe is None:
        return shape.kind if "infinity" in shape.kind else _by_grades(x, grades)
    if x.algebra == VGA3 and shape.kind == "plane":
        return f"plane through the origin, normal {_coordinates(shape.along)}"
    if describe in (_round, _pair) and not np.all(np.isfinite(shape.place)):  # as the meet of concentric spheres
        return f"{shape.kind} at infinity"
    name = "imaginary quaternion" if x.algebra == QUATERNIONS else shape.kind
    return _imaginary(f"{name}{describe(shape)}", shape)


def _by_grades(x: Any, grades: tuple[int, ...]) -> str:
    if grades == (0,):
        return f"number {float(np.real(x['1'])):.3g}" if x.values.dtype.kind != "c" else f"number {x['1']:.3g}"
    if len(grades) > 1:
        return f"multivector with grades {', '.join(map(str, grades[:-1]))} and {grades[-1]}"
    (k,) = grades
    names = {1: "vector", 2: "bivector", 3: "trivector"} | {x.algebra.dimension: "pseudoscalar"}
    return f"{names.get(k, f'multivector of grade {k}')} {x:.3g}"


def _number(value: Any, size: Any = 0.0) -> str:
    """Format three significant digits; numbers within the rounding error of a product of a `size` are 0."""
    value = float(value)
    # Products in the algebras of this file, of at most five dimensions, add up to 2**5 terms.
    if abs(value) <= 2**5 * float(np.finfo(float).eps) * abs(float(size)) or value == 0:
        return "0"
    return f"{float(f'{value:.3g}'):g}"  # 1230, where one format would give 1.23e+03


def _coordinates(values: Any, size: Any = 0.0) -> str:
    largest = max(float(abs(size)), *(abs(float(value)) for value in values))
    return f"({', '.join(_number(value, largest) for value in values)})"


def _placed(shape: Shape) -> str:
    return f" {_coordinates(shape.place)}"


def _line(shape: Shape) -> str:
    # A line is as exact as its unit direction.
    return f" through {_coordinates(shape.place, 1.0)} along {_coordinates(shape.along)}"


def _plane(shape: Shape) -> str:
    distance = _number(np.sum(shape.place * shape.along), 1.0)
    return f", normal {_coordinates(shape.along)}, distance {distance}"


def _round(shape: Shape) -> str:
    radius = abs(float(shape.squared)) ** 0.5
    normal = "" if np.any(np.isnan(shape.along)) else f", normal {_coordinates(shape.along)}"
    return f", centre {_coordinates(shape.place, radius)}{normal}, radius {_number(radius)}"


def _pair(shape: Shape) -> str:
    reach = abs(float(shape.squared)) ** 0.5
    if shape.squared < 0:
        return (
            f", centre {_coordinates(shape.place, reach)}, along {_coordinates(shape.along)}, radius {_number(reach)}"
        )
    one, two = (shape.place + sign * reach * shape.along for sign in (-1, 1))
    return f" {_coordinates(one, reach)} and {_coordinates(two, reach)}"


def _screw(shape: Shape) -> str:
    return f"{_line(shape)}, pitch {_number(shape.squared)}"


_LINES: dict[str, Callable[[Shape], str]] = {
    "point": _placed, "direction": _placed, "vector": _placed, "line": _line, "plane": _plane, "point pair": _pair,
    "circle": _round, "sphere": _round, "screw": _screw,
}  # fmt: skip
"""What follows the name of each kind."""


def _imaginary(text: str, shape: Shape) -> str:
    return f"imaginary {text}" if shape.kind != "screw" and shape.squared < 0 else text


def _degrees(angle: Any) -> str:
    return f"{_number(np.degrees(angle))} degrees"


def _of_versor(x: Any, grades: tuple[int, ...]) -> str:
    prefix = ""
    if x.algebra == QUATERNIONS:
        size = float(np.linalg.norm(x.values))
        x = x._of_rows(QUATERNIONS.UNIT_QUATERNION, x.values / size) if x.layout.size == 4 else x
        unit = abs(size - 1) <= half_of_digits(x)
        prefix = "quaternion: " if unit else f"quaternion of norm {_number(size)}: "
    if x.algebra in (CGA2, CGA3) and x.layout.support == x.algebra.DILATOR.support:
        a, b = float(x["1"]), float(x["e0inf"])
        if a > abs(b):
            return f"scaling by {_number((a + b) / (a - b))} about the origin"
    try:
        return prefix + _of_motion(motion_of("explain", x))
    except GacError:
        return _by_grades(x, grades)


def _of_motion(motion: Motion) -> str:
    size = float(shapes.length(motion.translation))
    turns = _number(motion.angle, 1.0) != "0"
    if not turns:
        return f"translation by {_coordinates(motion.translation)}" if _number(size, 1.0) != "0" else "identity"
    turned = f"by {_degrees(motion.angle)}"
    place = _coordinates(motion.place, 1.0)
    if motion.dimension == 2:
        return f"rotation {turned} about {place}" if motion.translates else f"rotation {turned}"
    along = _coordinates(motion.direction)
    if not motion.translates:
        return f"rotation {turned} about {along}"
    moved = _number(motion.distance, max(1.0, size))
    if moved == "0":
        return f"rotation {turned} about the line through {place} along {along}"
    return f"motor, turns {turned} about the line through {place} along {along} and moves {moved} along it"


def _of_spacetime(x: Any, grades: tuple[int, ...]) -> str:
    if grades == (1,):
        square = float((x * x).grade(0))
        size = float(np.sum(x.values**2))
        kind = "null" if _number(square, size) == "0" else "timelike" if square > 0 else "spacelike"
        place = _coordinates([x[name] for name in ("g0", "g1", "g2", "g3")])
        return f"{kind} vector {place}" + (f", length {_number(abs(square) ** 0.5)}" if kind != "null" else "")
    if 0 not in grades or not x.is_versor() or abs(float((x * ~x).grade(0)) - 1) > half_of_digits(x):
        return _by_grades(x, grades)
    boosting, turning = (shapes.read(x, names) for names in (("g10", "g20", "g30", "g0123"), ("g12", "g13", "g23")))
    velocity = _coordinates(velocity_of(x))
    if np.max(np.abs(turning)) <= shapes.rounding(x) and abs(x["g0123"]) <= shapes.rounding(x):
        return f"boost with velocity {velocity}" if np.any(boosting) else "identity"
    if np.max(np.abs(boosting)) <= shapes.rounding(x):
        return f"rotation by {_spatial_rotation(x)}"
    return f"Lorentz transformation that gives g0 the velocity {velocity}"


def _spatial_rotation(x: Any) -> str:
    """Return the angle and the axis of a rotor of space, ``exp(-angle / 2 axis g123)``."""
    scalar = float(x["1"])
    bivector = shapes.read(x, ("g23", "g13", "g12")) * [1, -1, 1] * (-1 if scalar < 0 else 1)
    angle = 2 * np.arctan2(float(shapes.length(bivector)), abs(scalar))
    return f"{_degrees(angle)} about {_coordinates(shapes.unit(bivector))}"
