"""Points, rounds, flats and versors of the plane and of space, in conformal geometric algebra.

Rounds and flats are outer products of their points: a sphere has four, a plane three and ``einf``. Points of a circle
or a plane are in counterclockwise order about its normal. ``a ^ b`` spans, and `polarity` gives the dual. Imaginary
rounds have a negative squared radius.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..algebra.catalog import CGA2 as _CGA2
from ..algebra.catalog import CGA3 as _CGA3
from ..algebra.layout import Layout
from ..errors import AlgebraError, LayoutError
from ..frontend.expression import Expression
from ..gac_runtime.annotations import Array, Real, Truth
from .arrays import MultivectorArray
from .caches import cached_by_name
from .checks import refuse, require_blade, require_element
from .constructors import Rigid, given_of, round_arguments
from .direct import ROTATE, SCREW
from .expressions import is_symbolic, layout_in
from .layouts import layout_of
from .shapes import CENTRE, SQUARED
from .spaces import Argument, M, define, numbers, unit

if TYPE_CHECKING:
    from .names import Cga2Space, Cga3Space

_EINF = '{A}.multivector({"einf": 1})'


def _on(text: str) -> str:
    return text.replace("einf", _EINF)


_SPHERE = define("round", "centre squared", _on("(centre - squared / 2 * einf) * {A}.pseudoscalar"))
_CIRCLE = define(
    "circle", "centre normal squared",
    _on("((normal + ga.scalar_product(normal, centre) * einf) ^ (centre - squared / 2 * einf)) * {A}.pseudoscalar"),
)  # fmt: skip
_PLANE = define("flat", "normal distance", _on("-(normal + distance * einf) * {A}.pseudoscalar"))
_WITH_INFINITY = define("flat", "spanned", _on("spanned ^ einf"))
_TRANSLATOR = define("translator", "direction", _on("1 - direction * einf / 2"), unit=True)
_DILATOR = define("dilator", "factor", 'ga.exp(ga.log(factor) / 2 * {A}.multivector({"e0inf": 1}))', unit=True)
_ROTOR2 = define("rotor", "angle", 'ga.exp(-angle / 2 * {A}.multivector({"e12": 1}))', unit=True)
_ROTOR3 = define("rotor", "axis angle", 'ga.exp(-angle / 2 * axis * {A}.multivector({"e123": 1}))', unit=True)


@cached_by_name
def _kind_of(layout: Layout) -> str:
    """Return the geometric kind of elements of a layout; vectors may be points, circles and spheres may be flat."""
    algebra = layout.algebra
    blades = [algebra.spelling(blade)[1] for blade in layout.support]
    grades = {blade.bit_count() for blade in layout.support}
    euclidean = {name for name in algebra.vectors if name not in ("e0", "einf")}
    if {name.removesuffix("inf") for name in blades} <= euclidean and len(grades) == 1:
        return "direction"
    if layout == algebra.POINT:
        return "point"
    names = {1: "vector", 2: "point pair", 3: "circle", 4: "sphere"}
    kind = names.get(grades.pop(), "multivector") if len(grades) == 1 else "multivector"
    if kind in ("circle", "sphere") and all(name.endswith("inf") for name in blades):
        return "line" if kind == "circle" else "plane"
    return kind


class Conformal(Rigid[M]):
    """Common base of the conformal plane and conformal space: points, point pairs, versors, and parts of rounds."""

    def direction(self, *coordinates: Argument[M]) -> M:
        """Create Euclidean vectors from coordinates."""
        return self.of(self._direction_layout, *coordinates)

    def point_pair(self, a: Argument[M], b: Argument[M]) -> M:
        """Create the point pair of two points."""
        return self._construct("point_pair", (a, b))

    def dilator(self, factor: Argument[M]) -> M:
        """Create the versor that scales by a positive factor about the origin."""
        if (type(factor) is float and factor > 0) or is_symbolic(factor):
            return self._make(_DILATOR, factor)
        factors = np.asarray(numbers("dilator", factor))
        if np.any(factors <= 0):
            raise LayoutError("dilator", f"a factor of {np.min(factors):.6g}", "positive factors")
        return self._make(_DILATOR, factor)

    def coordinates(self, points: M) -> Array:
        """Return the coordinates of points with nonzero weight, along the last axis."""
        require_element("coordinates", points, self.algebra)
        weight = np.asarray(points["e0"])
        if np.any(weight == 0):
            raise LayoutError("coordinates", "a vector without e0", "a point")
        parts = np.broadcast_arrays(*(np.asarray(points[name]) for name in self._names))
        return np.stack(parts, -1) / weight[..., None]

    def centre(self, x: M) -> Array:
        """Return the coordinates of the centres of rounds: point pairs, circles, spheres."""
        require_blade("centre", x)
        point = self._make(CENTRE, x)
        if np.any(np.abs(np.asarray(point["e0"])) <= 1e-14 * np.max(x.values**2, axis=-1)):
            raise AlgebraError("centre", f"a flat {x.layout}", "a round: a point pair, circle or sphere")
        return self.coordinates(point)

    def radius_squared(self, x: M) -> Real:
        """Return the squared radii of rounds, which are negative for imaginary rounds."""
        require_blade("radius_squared", x)
        return self._make(SQUARED, x)

    def is_flat(self, x: M) -> Truth:
        """Whether blades contain the point at infinity, as lines, planes and flat points do; to 1e-10 of their size."""
        spanned = x ^ self.algebra.multivector({"einf": 1})
        found = np.abs(np.asarray(spanned.values if isinstance(spanned, MultivectorArray) else spanned))
        found = found.max(axis=-1) if isinstance(spanned, MultivectorArray) else found
        return found <= 1e-10 * np.abs(x.values).max(axis=-1)

    def _components(self, x: Any) -> Any:
        end = "inf" if {blade.bit_count() for blade in x.layout.support} == {2} else ""
        return np.stack(np.broadcast_arrays(*(np.asarray(x[f"{name}{end}"]) for name in self._names)), -1)

    def _scaled(self, role: str, x: Any) -> Any:
        """Divide a point by its weight."""
        return x / x["e0"] if role == "point" else x

    def _of_equation(self, name: str, coefficients: Any) -> Any:
        if len(coefficients) == 6:
            e12, e13, e23, e01, e02, e03 = coefficients
            return self.of(_CGA3.LINE, e03, -e02, e01, -e23, e13, -e12)
        *normal, last = coefficients
        return self._make(_PLANE, self.direction(*normal), -last)

    def _kind(self, x: Any) -> str:
        kind = _kind_of(layout_in(x))
        if isinstance(x, Expression):
            return "point" if kind == "vector" else kind
        if kind == "vector":
            square = np.abs(np.asarray(x.scalar_product(x)))
            is_null = np.all(square <= 1e-9 * np.max(np.abs(x.values), axis=-1, initial=0.0) ** 2)
            return "point" if is_null and np.all(np.asarray(x["e0"]) != 0) else kind
        flat = {"circle": "line", "sphere": "plane"}.get(kind)
        return flat if flat is not None and np.all(self.is_flat(x)) else kind

    def _spanned(self, *parts: Any) -> Any:
        return self._make(_WITH_INFINITY, self._wedge(*parts))

    def _wedge(self, *parts: Any) -> Any:
        found = parts[0]
        for each in parts[1:]:
            found = found ^ each
        return found

    def _round(self, name: str, *points: Any) -> Any:
        """Create the round through points."""
        return self._independent(name, self._wedge(*points), points)

    def _ball(self, name: str, centre: Any, squared: Any) -> Any:
        return self._make(_SPHERE, centre, squared)

    def _translator(self, name: str, shift: Any) -> Any:
        return self._make(_TRANSLATOR, shift)

    def _hyperplane(self, name: str, coefficients: Any) -> Any:
        """Create a line of the plane or a plane of space from the coefficients of its equation."""
        normal = self.direction(coefficients[..., :-1])
        made = self._make(_PLANE, normal, -coefficients[..., -1])
        return refuse(name, made, np.all(normal.values == 0, axis=-1), "a normal of length 0", "a nonzero normal")


class PlaneConformal(Conformal[M]):
    """The plane, G(3, 1)."""

    _names = ("e1", "e2")
    _direction_layout = layout_of(_CGA2, _CGA2.blades(1)[:2])

    def circle(
        self,
        centre: Argument[M],
        radius: Argument[M] | None = None,
        *others: Argument[M],
        radius_squared: Argument[M] | None = None,
    ) -> M:
        """Create a circle from its centre and radius, or through three points.

        A negative `radius_squared` gives an imaginary circle.

        Raises
        ------
        LayoutError
            If the radius is negative, or three points are collinear; in arrays circles through collinear points are
            NaN.
        """
        return self._construct("circle", round_arguments("circle", (centre, radius, *others), radius_squared, 1))

    def rotor(self, angle: Argument[M], centre: Argument[M] | None = None) -> M:
        """Create the rotor by an angle in radians, counterclockwise, about a point, by default the origin."""
        return self._construct("rotor", given_of(angle, centre))

    def motor(self, angle: Argument[M], *translation: Argument[M]) -> M:
        """Create the motor that rotates about the origin by an angle in radians, and then translates."""
        return self._construct(
            "motor", (angle, self._shift("motor: translation", translation)) if translation else (angle,)
        )

    def _line_of(self, name: str, coefficients: Any) -> Any:
        return self._hyperplane(name, coefficients)

    def _rotate(self, name: str, angle: Any, centre: Any = None) -> Any:
        rotated = self._make(_ROTOR2, angle)
        if centre is None:
            return rotated
        if isinstance(centre, Expression):
            moved = self.translator(*(centre[each] for each in self._names))  # its weight is 1
        else:
            moved = self.translator(self.coordinates(centre))
        return moved * rotated * ~moved


class SpaceConformal(Conformal[M]):
    """Space, G(4, 1)."""

    _names = ("e1", "e2", "e3")
    _along_names = ("e10inf", "e20inf", "e30inf")
    _direction_layout = layout_of(_CGA3, _CGA3.blades(1)[:3])

    def sphere(
        self,
        centre: Argument[M],
        radius: Argument[M] | None = None,
        *others: Argument[M],
        radius_squared: Argument[M] | None = None,
    ) -> M:
        """Create a sphere from its centre and radius, or through four points.

        A negative `radius_squared` gives an imaginary sphere.

        Raises
        ------
        LayoutError
            If the radius is negative, or four points are coplanar; in arrays spheres through coplanar points are NaN.
        """
        return self._construct("sphere", round_arguments("sphere", (centre, radius, *others), radius_squared, 1))

    def circle(
        self,
        centre: Argument[M],
        normal: Argument[M],
        radius: Argument[M] | None = None,
        *,
        radius_squared: Argument[M] | None = None,
    ) -> M:
        """Create a circle from its centre, normal and radius, or through three points.

        The normal of the plane may have any nonzero length.

        Raises
        ------
        LayoutError
            If the radius is negative, the normal is 0, or three points are collinear. In arrays such circles are NaN,
            except that a negative radius always raises.

        Notes
        -----
        A third argument with as many axes as the other two is a point. Pass an array of radii for a single centre and
        normal as ``radius_squared=``.
        """
        return self._construct("circle", round_arguments("circle", (centre, normal, radius), radius_squared, 2))

    def plane(self, normal: Argument[M], distance: Argument[M] | None = None, *others: Argument[M]) -> M:
        """Create a plane from a normal and a distance, through three points, or through a line and a point.

        The normal may have any nonzero length; the distance from the origin is measured along it. The four coefficients
        of ``a x + b y + c z + d = 0`` are also accepted. Errors as in `line`.

        Notes
        -----
        Three points span ``a ^ b ^ c ^ einf``. Seen from the side to which the normal of its `polarity` points, the
        three points are in clockwise order.
        """
        return self._construct("plane", given_of(normal, distance, *others))

    def rotor(self, axis: Argument[M], angle: Argument[M], centre: Argument[M] | None = None) -> M:
        """Create the versor that rotates about a line by an angle in radians, by the right-hand rule.

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
            As in `rotor`; must not have length 0.
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
        # In PGA3, the direction is (e23, -e13, e12) and the moment is (e01, e02, e03).
        e12, e13, e23, e01, e02, e03 = np.moveaxis(coefficients, -1, 0)
        line = self.of(_CGA3.LINE, np.stack([e03, -e02, e01, -e23, e13, -e12], -1))
        require_blade(name, line)
        return refuse(name, line, np.all(self._along(line) == 0, axis=-1), "a direction of length 0", "a line")

    def _plane_of(self, name: str, coefficients: Any) -> Any:
        return self._hyperplane(name, coefficients)

    def _plane_at(self, name: str, normal: Any, distance: Any) -> Any:
        return self._make(_PLANE, unit(name, normal), distance)

    def _plane_with(self, name: str, line: Any, point: Any) -> Any:
        made = point ^ self._as_line(line)
        size = np.max(np.abs(line.values), axis=-1) * np.max(np.abs(point.values), axis=-1, initial=1.0)
        bad = np.max(np.abs(made.values), axis=-1) <= 8 * np.finfo(made.values.dtype).eps * size
        return refuse(name, made, bad, "a point on the line", "a point off the line")

    def _circle(self, name: str, centre: Any, normal: Any, squared: Any) -> Any:
        return self._make(_CIRCLE, centre, unit(name, normal), squared)

    def _rotate(self, name: str, axis: Any, angle: Any, centre: Any = None) -> Any:
        rotated = unit(name, axis)
        if centre is None:
            return self._make(_ROTOR3, rotated, angle)
        return self._make(ROTATE, self._spanned(centre, rotated), angle)

    def _rotate_about(self, name: str, line: Any, angle: Any) -> Any:
        return self._make(ROTATE, self._axis(name, self._as_line(line)), angle)

    def _screw(self, name: str, line: Any, angle: Any, distance: Any) -> Any:
        return self._make(SCREW, self._axis(name, self._as_line(line)), angle, distance)

    def _as_line(self, x: Any) -> Any:
        """Convert a circle that is flat to the layout of lines."""
        return x if isinstance(x, Expression) or x.layout == _CGA3.LINE else x.as_layout(_CGA3.LINE)

    def _along(self, line: Any) -> Any:
        return np.stack(np.broadcast_arrays(*(np.asarray(line[name]) for name in self._along_names)), -1)


CGA2 = cast("Cga2Space", PlaneConformal(_CGA2))
CGA3 = cast("Cga3Space", SpaceConformal(_CGA3))
