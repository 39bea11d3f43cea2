"""The geometric kind of elements, and their place, direction and radius as numbers.

The kind is read from the layout, and from the coefficients where the layout leaves it open: a vector of conformal space
may be a point or a dual sphere. A number counts as 0 if it is within the rounding error of one operation.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.catalog import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, VGA2, VGA3
from ..errors import AlgebraError
from ..gac_runtime.array_element import Element
from .definitions import Definition
from .methods import applied

Reals = np.ndarray[Any, Any]

_EINF = '{A}.multivector({"einf": 1})'
CENTRE = Definition("centre", ("x",), f"(x * {_EINF} * x).grade(1)")
"""A multiple of the centre of a round, as a vector of conformal space."""
SQUARED = Definition(
    "radius_squared", ("x",),
    f"ga.scalar_product(x, ga.grade_involution(x)) / ga.scalar_product(ga.left_contraction({_EINF}, x), "
    f"ga.left_contraction({_EINF}, x))",
)  # fmt: skip
"""The squared radius of a round."""
_EQUATION = Definition("equation", ("x",), "x * {A}.pseudoscalar")
"""The vector ``normal + distance * einf`` of a plane of space or a line of the plane."""
_PLANE_OF_CIRCLE = Definition("plane_of_circle", ("x",), f"-ga.left_contraction({_EINF}, x * {{A}}.pseudoscalar)")
"""The same vector for the plane of a circle."""
_DIRECT = Definition("direct", ("x",), "x * {A}.pseudoscalar")

PROJECTIVE = {PGA2: (("e20", "e01"), "e12"), PGA3: (("e032", "e013", "e021"), "e123")}
"""Names of the coordinates and of the weight of a point."""
CONFORMAL = {CGA2: 2, CGA3: 3}
"""Dimensions of the conformal spaces."""
EUCLIDEAN = {VGA2: ("e1", "e2"), VGA3: ("e1", "e2", "e3"), QUATERNIONS: ("e1", "e2", "e12")}
"""Names of the coordinates of a vector."""
ROUNDS = ("point pair", "circle", "sphere")


class Shape(NamedTuple):
    """What an element is, in numbers; attributes that the kind lacks are NaN."""

    kind: str
    place: Reals
    """(..., d) The centre of a round, the point of a flat that is nearest to the origin, or the coordinates."""
    along: Reals
    """(..., d) The unit vector of a line, point pair, direction or vector; the unit normal of a plane or circle."""
    squared: Reals
    """(...) The squared radius of a round; the pitch of a screw."""
    across: Reals | None = None
    """(..., 2) The unit normal of a line of the plane."""

    @property
    def radius(self) -> Reals:
        """(...) The radius; NaN for imaginary rounds."""
        with np.errstate(invalid="ignore"):
            return np.sqrt(self.squared)

    @property
    def dimension(self) -> int:
        """2 in the plane, 3 in space."""
        return int(self.place.shape[-1])

    @property
    def normal(self) -> Reals:
        """(..., d) The unit normal of a plane, of a circle of space, or of a line of the plane."""
        return self.along if self.across is None else self.across


def rounding(x: Element) -> float:
    """Return the relative rounding error of one product: it adds up to 2**n terms, each with the error of a number."""
    return float(2**x.layout.algebra.dimension * np.finfo(x.values.dtype).eps)


def read(x: Element, names: tuple[str, ...], sign: float = 1.0) -> Reals:
    """Return coefficients along the last axis, times a sign."""
    return sign * np.stack(np.broadcast_arrays(*(np.asarray(x[name]) for name in names)), -1)


def length(v: Reals) -> Reals:
    """Return the lengths of vectors, whose squares may overflow only if the lengths almost do."""
    size = np.max(np.abs(v), axis=-1, keepdims=True, initial=0.0)
    scale = np.where(size > 0, size, 1.0)
    return np.asarray(np.sqrt(np.sum((v / scale) ** 2, axis=-1)) * scale[..., 0])


def unit(v: Reals) -> Reals:
    """Return unit vectors; NaN for vectors of length 0."""
    size = np.max(np.abs(v), axis=-1, keepdims=True, initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        scaled = v / size
        return np.asarray(scaled / np.sqrt(np.sum(scaled * scaled, axis=-1, keepdims=True)))


def grades_of(x: Element) -> set[int]:
    """Return the grades that the layout of an element allows."""
    return {blade.bit_count() for blade in x.layout.support}


def dense(x: Any) -> Reals:
    """Return all coefficients of an element, (..., 2**n), by the bitmaps of blades in ascending order of vectors."""
    layout = x.layout
    found = np.zeros((*x.shape, 2**layout.algebra.dimension), x.values.dtype)
    for slot in (*layout.stored, *(slot for slot, _ in layout.fixed), *(slot for slot, _ in layout.implied)):
        found[..., slot.blade] = np.asarray(x[slot.name]) * slot.sign
    return found


def grades_in(x: Any) -> tuple[int, ...]:
    """Return the grades of which some coefficient of some element exceeds the rounding error of one product."""
    if x.size == 0:
        return ()
    coefficients = np.abs(dense(x))
    # NaN counts as a nonzero coefficient.
    above = ~(coefficients <= rounding(x) * np.max(coefficients, axis=-1, keepdims=True)) & (coefficients != 0)
    return tuple(
        sorted({int(blade).bit_count() for blade in np.flatnonzero(above.reshape(-1, above.shape[-1]).any(0))})
    )


def shape_of(where: str, x: Any) -> Shape:
    """Return the shape of elements of one kind.

    Raises
    ------
    AlgebraError
        If the elements of an array are of different kinds.
    """
    algebra: Algebra = x.algebra
    grades = grades_of(x)
    if len(grades) > 1 and algebra != QUATERNIONS and len(grades_in(x)) == 1 and grades_in(x) != (0,):
        x = x.grade(*grades_in(x))  # a product whose layout allows more grades than it has
        grades = grades_of(x)
    if algebra == QUATERNIONS and 0 not in grades and x.values.dtype.kind != "c":
        return _of_vector("vector", read(x, EUCLIDEAN[algebra]))
    if x.values.dtype.kind == "c" or len(grades) != 1:
        return _without_numbers("multivector", x)
    (grade,) = grades
    if algebra in PROJECTIVE:
        return _projective(where, x, grade)
    if algebra in CONFORMAL:
        return _conformal(where, x, grade)
    if algebra in EUCLIDEAN and grade == 1:
        return _of_vector("vector", read(x, EUCLIDEAN[algebra]))
    if algebra == VGA3 and grade == 2:
        return _flat("plane", np.zeros((*x.shape, 3)), unit(read(x, ("e23", "e13", "e12")) * [1, -1, 1]))
    return _without_numbers({0: "number", 1: "vector", 2: "bivector", 3: "trivector"}.get(grade, "blade"), x)


def alternatives(where: str, x: Element, condition: Any, yes: str, no: str) -> str:
    """Return the kind of all elements by a condition.

    Raises
    ------
    AlgebraError
        If the condition holds for some elements of an array only.
    """
    if np.all(condition):
        return yes
    if np.any(condition):
        raise AlgebraError(
            where, f"an array of shape {x.shape} with elements of the kinds {yes} and {no}", "elements of one kind",
            "select the elements of one kind by an index first",
        )  # fmt: skip
    return no


def _without_numbers(kind: str, x: Any) -> Shape:
    nothing = np.full((*x.shape, 3), np.nan)
    return Shape(kind, nothing, nothing, nothing[..., 0])


def _of_vector(kind: str, coordinates: Reals) -> Shape:
    return Shape(kind, coordinates, unit(coordinates), np.full(coordinates.shape[:-1], np.nan))


def _flat(kind: str, place: Reals, along: Reals) -> Shape:
    return Shape(kind, place, along, np.full(place.shape[:-1], np.nan))


def _at_infinity(x: Element, part: Reals, others: Reals) -> Any:
    """Whether the part of a flat that is 0 at infinity is within rounding error."""
    return length(part) <= rounding(x) * length(others)


def _projective(where: str, x: Any, grade: int) -> Shape:
    names, weight = PROJECTIVE[x.algebra]
    n = len(names) + 1
    if grade == n - 1:
        return _projective_point(where, x, read(x, names), np.asarray(x[weight]))
    if grade == 1:
        equation = read(x, (*("e1", "e2", "e3")[: n - 1], "e0"))
        return _hyperplane(where, x, equation[..., :-1], -equation[..., -1])
    if grade != 2:
        return _without_numbers("number" if grade == 0 else "pseudoscalar", x)
    d, m = read(x, ("e23", "e13", "e12")) * [1, -1, 1], read(x, ("e01", "e02", "e03"))
    return _line(where, x, d, m)


def _projective_point(where: str, x: Any, coordinates: Reals, weight: Reals) -> Shape:
    far = _at_infinity(x, weight[..., None], coordinates)
    if alternatives(where, x, far, "direction", "point") == "direction":
        return _of_vector("direction", coordinates)
    with np.errstate(invalid="ignore", divide="ignore"):
        return _of_vector("point", coordinates / weight[..., None])


def _hyperplane(where: str, x: Any, normal: Reals, distance: Reals) -> Shape:
    """Return the shape of a plane of space or a line of the plane, ``normal . p = distance``."""
    kind = "plane" if normal.shape[-1] == 3 else "line"
    far = _at_infinity(x, normal, distance[..., None])
    kind = alternatives(where, x, far, f"{kind} at infinity", kind)
    along = unit(normal)
    with np.errstate(invalid="ignore", divide="ignore"):
        place = along * (distance / length(normal))[..., None]
    if normal.shape[-1] == 3:
        return _flat(kind, place, along)
    # The join of p and q points from p to q. Conformal lines through points have the opposite normal.
    turn = 1 if x.algebra in PROJECTIVE else -1
    direction = turn * np.stack([along[..., 1], -along[..., 0]], -1)
    return _flat(kind, place, direction)._replace(across=along)


def _line(where: str, x: Any, direction: Reals, moment: Reals) -> Shape:
    """Return the shape of a line of space with the moment ``p x direction`` for all points p on it."""
    far = _at_infinity(x, direction, moment)
    kind = alternatives(where, x, far, "line at infinity", "line")
    # Half of the digits may be lost by the operations that gave the line.
    limit = float(np.finfo(x.values.dtype).eps) ** 0.5
    skew = np.abs(np.sum(direction * moment, axis=-1)) > limit * length(direction) * length(moment)
    kind = alternatives(where, x, skew & ~far, "screw", kind)
    along = unit(direction)
    with np.errstate(invalid="ignore", divide="ignore"):
        place = np.cross(along, moment) / length(direction)[..., None]
        pitch = np.sum(direction * moment, axis=-1) / length(direction) ** 2
    return Shape(kind, place, along, pitch if kind == "screw" else np.full_like(pitch, np.nan))


def _conformal(where: str, x: Any, grade: int) -> Shape:
    d, layout = CONFORMAL[x.algebra], x.layout
    euclidean = ("e1", "e2", "e3")[:d]
    if grade == 1:
        return _conformal_vector(where, x, euclidean)
    if d == 3 and layout == CGA3.DUAL_LINE:
        return _dual("line", where, applied(_DIRECT, x))
    if grade == 2:
        return _conformal_pair(where, x, euclidean)
    if grade == d + 1:
        round_name, flat_name = ("circle", "line") if d == 2 else ("sphere", "plane")
        equation = applied(_EQUATION, x)
        flat = np.abs(np.asarray(equation["e0"])) <= rounding(x) * np.max(np.abs(x.values), axis=-1)
        if alternatives(where, x, flat, flat_name, round_name) == flat_name:
            return _hyperplane(where, x, read(equation, euclidean), np.asarray(equation["einf"]))
        return _round(round_name, x, np.full((*x.shape, d), np.nan))
    if grade == 3:
        return _conformal_circle(where, x)
    return _without_numbers("number" if grade == 0 else "pseudoscalar", x)


def _dual(kind: str, where: str, direct: Any) -> Shape:
    found = _conformal(where, direct, grades_of(direct).pop())
    return found._replace(kind=f"dual {found.kind}")


def _conformal_vector(where: str, x: Any, names: tuple[str, ...]) -> Shape:
    parts, e0, einf = read(x, names), np.asarray(x["e0"]), np.asarray(x["einf"])
    size = np.max(np.abs(x.values), axis=-1, initial=0.0)
    flat = np.abs(e0) <= rounding(x) * size
    if x.layout != x.algebra.POINT and alternatives(where, x, flat, "flat", "round") == "flat":
        if "einf" not in x.layout.blades:
            return _of_vector("direction", parts)
        # The dual is the `polarity` of a plane, the negative of its equation.
        found = _hyperplane(where, x, -parts, -einf)
        return found._replace(kind="point at infinity" if "infinity" in found.kind else f"dual {found.kind}")
    terms = np.sum(parts * parts, axis=-1), 2 * e0 * einf
    null = np.abs(terms[0] - terms[1]) <= rounding(x) * (terms[0] + np.abs(terms[1]))
    with np.errstate(invalid="ignore", divide="ignore"):
        place = parts / e0[..., None]
    if x.layout == x.algebra.POINT or alternatives(where, x, null, "point", "dual round") == "point":
        return _of_vector("point", place)
    nothing = np.full_like(parts, np.nan)
    name = "dual sphere" if len(names) == 3 else "dual circle"
    return Shape(name, place, nothing, (terms[0] - terms[1]) / e0**2)


def _conformal_pair(where: str, x: Any, euclidean: tuple[str, ...]) -> Shape:
    at_infinity = tuple(f"{name}inf" for name in euclidean)
    euclidean_part = [name for name in x.layout.blades if not name.endswith("inf")]
    size = np.max(np.abs(x.values), axis=-1, initial=0.0)
    part = read(x, tuple(euclidean_part)) if euclidean_part else np.zeros((*x.shape, 1))
    flat = np.max(np.abs(part), axis=-1) <= rounding(x) * size
    if alternatives(where, x, flat, "flat", "point pair") == "flat":
        return _projective_point(where, x, read(x, at_infinity), np.asarray(x["e0inf"]))
    # The line of p ^ q is p ^ q ^ einf, and its direction is q - p.
    return _round("point pair", x, unit(read(x, tuple(f"{name}0" for name in euclidean), -1.0)))


def _conformal_circle(where: str, x: Any) -> Shape:
    plane = applied(_PLANE_OF_CIRCLE, x)
    size = np.max(np.abs(x.values), axis=-1, initial=0.0)
    finite = tuple(name for name in x.layout.blades if not name.endswith("inf"))
    flat = np.ones(x.shape, bool)
    if finite:
        flat = np.max(np.abs(read(x, finite)), axis=-1) <= rounding(x) * size
    if alternatives(where, x, flat, "line", "circle") == "line":
        direction = read(x, ("e10inf", "e20inf", "e30inf"), -1.0)
        return _line(where, x, direction, read(x, ("e23inf", "e13inf", "e12inf")) * [1, -1, 1])
    return _round("circle", x, unit(read(plane, ("e1", "e2", "e3"))))


def _round(kind: str, x: Any, along: Reals) -> Shape:
    centre, euclidean = applied(CENTRE, x), ("e1", "e2", "e3")[: along.shape[-1]]
    with np.errstate(invalid="ignore", divide="ignore"):
        place = read(centre, euclidean) / np.asarray(centre["e0"])[..., None]
        return Shape(kind, place, along, np.asarray(applied(SQUARED, x)))
