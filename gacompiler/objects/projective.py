"""Points, lines, planes and motors of the plane and of space, in projective geometric algebra.

Planes of space and lines of the plane are vectors; points are pseudovectors. ``a & b`` joins, ``a ^ b`` meets.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..algebra.catalog import PGA2 as _PGA2
from ..algebra.catalog import PGA3 as _PGA3
from ..algebra.layout import Layout
from ..errors import LayoutError
from ..frontend.expression import Expression
from ..gac_runtime.annotations import Array, Numbers
from .caches import cached_by_name
from .checks import refuse, require_blade, require_element
from .constructors import Rigid, given_of
from .definitions import normalize_of
from .expressions import layout_in
from .spaces import Argument, M, define, unit

if TYPE_CHECKING:
    from .names import Pga2Space, Pga3Space


class Projective(Rigid[M]):
    """Common base of the projective plane and projective space."""

    _weight: str

    def direction(self, *coordinates: Argument[M]) -> M:
        """Create directions (points at infinity) from coordinates, or an array with these along its last axis."""
        return self.of(self._direction_layout, *coordinates)

    def coordinates(self, points: M) -> Array:
        """Return the coordinates of points with nonzero weight, along the last axis."""
        require_element("coordinates", points, self.algebra)
        w = np.asarray(points[self._weight])
        if np.any(w == 0):
            raise LayoutError("coordinates", "a point at infinity", f"a point with nonzero {self._weight}")
        return self._components(points) / w[..., None]

    def _components(self, x: Any) -> Any:
        return np.stack(np.broadcast_arrays(*(np.asarray(x[name]) for name in self._names)), -1)

    def _scaled(self, role: str, x: Any) -> Any:
        """Divide a point by its weight."""
        return x / x[self._weight] if role == "point" else x

    def _kind(self, x: Any) -> str:
        kind = _kind_of(layout_in(x))
        if isinstance(x, Expression):
            return "direction" if kind == "point" and self.algebra.blade(self._weight)[1] not in x.blades else kind
        if kind != "point" or x.layout is self._point_layout or x.layout == self._point_layout:
            return kind
        weight = np.asarray(x[self._weight])
        return "direction" if np.all(weight == 0) else "point" if np.all(weight != 0) else "mixed points and directions"

    def _spanned(self, *parts: Any) -> Any:
        joined = parts[0]
        for each in parts[1:]:
            joined = joined & each
        return joined


_normalize_of = cached_by_name(normalize_of)


@cached_by_name
def _kind_of(layout: Layout) -> str:
    """Return the geometric kind of elements of a layout; points may be at infinity."""
    n, grades = layout.algebra.dimension, {blade.bit_count() for blade in layout.support}
    names = ("multivector", "line", "point") if n == 3 else ("multivector", "plane", "line", "point")
    grade = grades.pop() if len(grades) == 1 else 0
    return names[grade] if grade < n else "multivector"


class PlaneProjective(Projective[M]):
    """The plane, G(2, 0, 1): lines are vectors, points are bivectors."""

    _names, _weight, _direction_layout = ("e20", "e01"), "e12", _PGA2.DIRECTION

    def rotor(self, angle: Argument[M], centre: Argument[M] | None = None) -> M:
        """Create the rotor by an angle in radians, counterclockwise, about a point, by default the origin."""
        return self._construct("rotor", (angle,) if centre is None else (angle, centre))

    def motor(self, angle: Argument[M], *translation: Argument[M]) -> M:
        """Create the motor that rotates about the origin by an angle in radians, and then translates by x and y."""
        return self._construct(
            "motor", (angle, self._shift("motor: translation", translation)) if translation else (angle,)
        )

    def _line_of(self, name: str, coefficients: Any) -> Any:
        made = self.of(_PGA2.LINE, coefficients)
        return refuse(name, made, np.all(coefficients[..., :2] == 0, axis=-1), "a = b = 0", "a line")

    def _of_equation(self, name: str, coefficients: Any) -> Any:
        return self.of(_PGA2.LINE, *coefficients)

    def _translator(self, name: str, shift: Any) -> Any:
        return self._make(_TRANSLATE2, shift)

    def _rotate(self, name: str, angle: Any, centre: Any = None) -> Any:
        return self._make(_ROTATE2, self._origin if centre is None else centre, angle)


class SpaceProjective(Projective[M]):
    """Space, G(3, 0, 1): planes are vectors, lines bivectors, points trivectors."""

    _names, _weight, _direction_layout = ("e032", "e013", "e021"), "e123", _PGA3.DIRECTION
    _along_names = ("e23", "e13", "e12")

    def plane(self, normal: Argument[M], distance: Argument[M] | None = None, *others: Argument[M]) -> M:
        """Create a plane from a normal and a distance, through three points, or through a line and a point.

        The normal may have any nonzero length; the distance from the origin is measured along it. The four coefficients
        of ``a x + b y + c z + d = 0`` are also accepted. Errors as in `line`.
        """
        return self._construct("plane", given_of(normal, distance, *others))

    def motor_from_matrix(self, matrix: Numbers) -> M:
        """Return `from_matrix`, whose former name this is; it will be removed in version 0.3."""
        warnings.warn("PGA3.motor_from_matrix is now from_matrix", DeprecationWarning, stacklevel=2)
        return self.from_matrix(matrix)

    def rotor(self, axis: Argument[M], angle: Argument[M], centre: Argument[M] | None = None) -> M:
        """Create the motor that rotates about a line by an angle in radians, by the right-hand rule.

        The line may have any nonzero weight. Alternatively, `axis` is a direction of any nonzero length, and the axis
        passes through `centre`, by default the origin.
        """
        return self._construct("rotor", given_of(axis, angle, centre))

    def motor(
        self,
        axis: Argument[M],
        angle: Argument[M],
        *shift: Argument[M],
        distance: Argument[M] | None = None,
        translation: Argument[M] | None = None,
    ) -> M:
        """Create the screw motion about a line by an angle, and along the line by a distance, by default 0.

        Parameters
        ----------
        axis
            As in `rotor`; must not have length 0 or be a line at infinity.
        angle
            In radians.
        *shift
            The distance, a number or an array of any shape; or a translation after the rotation, as x, y, z or as a
            direction.
        distance, translation : optional
            The same by name; the coordinates of a translation are along the last axis.
        """
        return self._construct("motor", (axis, angle, self._moved_by(shift, distance, translation)))

    def _line_of(self, name: str, coefficients: Any) -> Any:
        line = self.of(_PGA3.LINE, coefficients)
        require_blade(name, line)
        return refuse(name, line, np.all(coefficients == 0, axis=-1), "six zero coefficients", "a line")

    def _plane_of(self, name: str, coefficients: Any) -> Any:
        made = self.of(_PGA3.PLANE, coefficients)
        return refuse(name, made, np.all(coefficients[..., :3] == 0, axis=-1), "a = b = c = 0", "a plane")

    def _plane_at(self, name: str, normal: Any, distance: Any) -> Any:
        if isinstance(normal, Expression) or isinstance(distance, Expression):
            along = unit(name, normal)
            return self.of(_PGA3.PLANE, *(along[each] for each in self._names), -distance)
        n = unit(name, normal).values
        if n.ndim == 1 and type(distance) is float:
            return self.of(_PGA3.PLANE, *n.tolist(), -distance)
        d = np.broadcast_to(-distance, np.broadcast_shapes(n.shape[:-1], np.shape(distance)))[..., None]
        return self.of(_PGA3.PLANE, np.concatenate([np.broadcast_to(n, (*d.shape[:-1], 3)), d], -1))

    def _plane_with(self, name: str, line: Any, point: Any) -> Any:
        made = line & point
        size = np.max(np.abs(line.values), axis=-1) * np.maximum(1.0, np.max(np.abs(point.values), axis=-1))
        bad = np.max(np.abs(made.values), axis=-1) <= 8 * np.finfo(made.values.dtype).eps * size
        return refuse(name, made, bad, "a point on the line", "a point off the line")

    def _of_equation(self, name: str, coefficients: Any) -> Any:
        return self.of(_PGA3.LINE if name == "line" else _PGA3.PLANE, *coefficients)

    def _translator(self, name: str, shift: Any) -> Any:
        return self._make(_TRANSLATE3, shift)

    def _rotate(self, name: str, axis: Any, angle: Any, centre: Any = None) -> Any:
        line = (self._origin if centre is None else centre) & unit(name, axis)
        return self._make(_ROTATE3, self._make(_normalize_of(layout_in(line)), line), angle)

    def _rotate_about(self, name: str, line: Any, angle: Any) -> Any:
        return self._make(_ROTATE3, self._unit_line(name, line), angle)

    def _screw(self, name: str, line: Any, angle: Any, distance: Any) -> Any:
        return self._make(_SCREW, self._unit_line(name, line), angle, distance)

    def _unit_line(self, name: str, line: Any) -> Any:
        return self._make(_normalize_of(layout_in(line)), self._axis(name, line))

    def _along(self, line: Any) -> Any:
        return np.stack(np.broadcast_arrays(*(np.asarray(line[name]) for name in self._along_names)), -1)


# A translator is 1 plus a bivector at infinity that is orthogonal to the direction and has half its length.
_TRANSLATE2 = define(
    "translator", "d",
    '1 + (d["e20"] * {A}.multivector({"e01": -1}) + d["e01"] * {A}.multivector({"e20": 1})) / 2',
    unit=True,
)  # fmt: skip
_TRANSLATE3 = define(
    "translator", "d",
    '1 - (d["e032"] * {A}.multivector({"e01": 1}) + d["e013"] * {A}.multivector({"e02": 1})'
    ' + d["e021"] * {A}.multivector({"e03": 1})) / 2',
    unit=True,
)  # fmt: skip
_ROTATE2 = define("rotor", "centre angle", "ga.exp(-angle / 2 * centre)", unit=True)
_ROTATE3 = define("rotor", "axis angle", "ga.exp(-angle / 2 * axis)", unit=True)
_SCREW = define(
    "motor",
    "axis angle distance",
    'ga.exp(-angle / 2 * axis) * (1 + distance / 2 * (axis * {A}.multivector({"e0123": 1})))', unit=True,
)  # fmt: skip

PGA2 = cast("Pga2Space", PlaneProjective(_PGA2))
PGA3 = cast("Pga3Space", SpaceProjective(_PGA3))
