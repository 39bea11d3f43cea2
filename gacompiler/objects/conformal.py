"""Points, rounds, flats and versors of the plane and of space, in conformal geometric algebra.

Rounds and flats are outer products of their points: a sphere has four, a plane three and ``einf``. ``a ^ b`` spans, and
`polarity` gives the dual. Imaginary rounds have a negative squared radius.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..algebra.catalog import CGA2 as _CGA2
from ..algebra.catalog import CGA3 as _CGA3
from ..errors import AlgebraError, LayoutError
from .arrays import MultivectorArray
from .checks import require_blade
from .spaces import Rigid, define, numbers

_EINF = '{A}.multivector({"einf": 1})'
_NORMAL = "(normal / ga.norm(normal))"


def _on(text: str) -> str:
    return text.replace("einf", _EINF).replace("normal", _NORMAL)


_SPHERE = define("round", "centre squared", _on("(centre - squared / 2 * einf) * {A}.pseudoscalar"))
_CIRCLE = define(
    "circle", "centre normal squared",
    _on("((centre - squared / 2 * einf) ^ (normal + ga.scalar_product(normal, centre) * einf)) * {A}.pseudoscalar"),
)  # fmt: skip
_PLANE = define("flat", "normal distance", _on("(normal + distance * einf) * {A}.pseudoscalar"))
_LINE = define("line", "point direction", _on("point ^ direction ^ einf"))
_TRANSLATOR = define("translator", "direction", _on("1 - direction * einf / 2"), unit=True)
_DILATOR = define("dilator", "factor", 'ga.exp(ga.log(factor) / 2 * {A}.multivector({"e0inf": 1}))', unit=True)
_ROTOR2 = define("rotor", "angle", 'ga.exp(-angle / 2 * {A}.multivector({"e12": 1}))', unit=True)
_ROTOR3 = define(
    "rotor", "axis angle", 'ga.exp(-angle / 2 * (axis / ga.norm(axis)) * {A}.multivector({"e123": 1}))', unit=True
)
_CENTRE = define("centre", "x", _on("(x * einf * x).grade(1)"))
_SQUARED = define(
    "radius_squared", "x",
    _on("ga.scalar_product(x, ga.grade_involution(x)) / ga.scalar_product(ga.left_contraction(einf, x), "
        "ga.left_contraction(einf, x))"),
)  # fmt: skip


class Conformal(Rigid):
    """What the plane and space have in common: points, points pairs, versors, and the parts of rounds."""

    _names: tuple[str, ...]

    def point(self, *coordinates: Any) -> Any:
        """Points from coordinates, or an array with these along its last axis."""
        return self.of(self.algebra.POINT, *coordinates)

    def direction(self, *coordinates: Any) -> Any:
        """Euclidean vectors from coordinates."""
        return self._directions("direction", " ".join(self._names), coordinates)

    def point_pair(self, a: Any, b: Any) -> Any:
        """The pair of two points."""
        return a ^ b

    def line(self, point: Any, other: Any) -> Any:
        """The line from a point to another point, or along a direction of coordinates or a Euclidean vector."""
        if isinstance(other, MultivectorArray) and other.layout.implied:
            return point ^ other ^ self.einf
        return self._make(_LINE, point, self.direction(other))

    def translator(self, *coordinates: Any) -> Any:
        """The translator by coordinates."""
        return self._make(_TRANSLATOR, self.direction(*coordinates))

    def dilator(self, factor: Any) -> Any:
        """The versor that scales by a positive factor about the origin."""
        if np.any(np.asarray(factor) <= 0):
            raise LayoutError("dilator", f"a factor of {np.min(factor):.6g}", "positive factors")
        return self._make(_DILATOR, factor)

    def coordinates(self, points: MultivectorArray) -> Any:
        """Coordinates of points of any weight but 0, along the last axis."""
        weight = np.asarray(points["e0"])
        if np.any(weight == 0):
            raise LayoutError("coordinates", "a vector without e0", "a point")
        parts = np.broadcast_arrays(*(np.asarray(points[name]) for name in self._names))
        return np.stack(parts, -1) / weight[..., None]

    def centre(self, x: Any) -> Any:
        """Coordinates of the centres of rounds: point pairs, circles, spheres."""
        require_blade("centre", x)
        point = self._make(_CENTRE, x)
        if np.any(np.abs(np.asarray(point["e0"])) <= 1e-14 * np.max(x.values**2, axis=-1)):
            raise AlgebraError("centre", f"a flat {x.layout}", "a round: a point pair, circle or sphere")
        return self.coordinates(point)

    def radius_squared(self, x: Any) -> Any:
        """The squared radii of rounds, negative for imaginary ones."""
        require_blade("radius_squared", x)
        return self._make(_SQUARED, x)

    def is_flat(self, x: Any) -> Any:
        """Whether blades contain the point at infinity: lines, planes, flat points; to 1e-10 of their size."""
        spanned = x ^ self.einf
        found = np.abs(np.asarray(spanned.values if isinstance(spanned, MultivectorArray) else spanned))
        found = found.max(axis=-1) if isinstance(spanned, MultivectorArray) else found
        return found <= 1e-10 * np.abs(x.values).max(axis=-1)


def _squared(what: str, radius: Any, radius_squared: Any) -> Any:
    if (radius is None) == (radius_squared is None):
        raise LayoutError(what, "no radius" if radius is None else "two radii", "a radius, or radius_squared=")
    if radius is None:
        return numbers(f"{what}: radius_squared", radius_squared)
    r = numbers(f"{what}: radius", radius)
    if np.any(np.real(r) < 0):
        raise LayoutError(what, f"a radius of {np.min(r):.6g}", "0 or more, or radius_squared= of an imaginary one")
    return r * r


class PlaneConformal(Conformal):
    """The plane, G(3, 1)."""

    _names = ("e1", "e2")

    def circle(self, centre: Any, radius: Any = None, *, radius_squared: Any = None) -> Any:
        """The circle about a point; with a negative `radius_squared` an imaginary one."""
        centre = centre if isinstance(centre, MultivectorArray) else self.point(centre)
        return self._make(_SPHERE, centre, _squared("circle", radius, radius_squared))

    def rotor(self, angle: Any, centre: Any = None) -> Any:
        """The rotor by an angle in radians, counterclockwise, about coordinates, by default the origin."""
        turned = self._make(_ROTOR2, angle)
        return turned if centre is None else _moved(self.translator(centre), turned)

    def motor(self, angle: Any, *translation: Any) -> Any:
        """The motor that rotates about the origin and then translates."""
        return self.translator(*translation) * self.rotor(angle)


class RoomConformal(Conformal):
    """Space, G(4, 1)."""

    _names = ("e1", "e2", "e3")

    def sphere(self, centre: Any, radius: Any = None, *, radius_squared: Any = None) -> Any:
        """The sphere about a point or coordinates; with a negative `radius_squared` an imaginary one."""
        centre = centre if isinstance(centre, MultivectorArray) else self.point(centre)
        return self._make(_SPHERE, centre, _squared("sphere", radius, radius_squared))

    def circle(self, centre: Any, normal: Any, radius: Any = None, *, radius_squared: Any = None) -> Any:
        """The circle about a point, in the plane with a normal of any length but 0."""
        centre = centre if isinstance(centre, MultivectorArray) else self.point(centre)
        return self._make(_CIRCLE, centre, self.direction(normal), _squared("circle", radius, radius_squared))

    def plane(self, normal: Any, distance: Any) -> Any:
        """The plane with a normal of any length but 0, at a distance from the origin along it."""
        return self._make(_PLANE, self.direction(normal), distance)

    def rotor(self, axis: Any, angle: Any, centre: Any = None) -> Any:
        """The rotor by an angle in radians about an axis through the origin or `centre`, by the right-hand rule."""
        turned = self._make(_ROTOR3, self.direction(axis), angle)
        return turned if centre is None else _moved(self.translator(centre), turned)

    def motor(self, axis: Any, angle: Any, *translation: Any) -> Any:
        """The motor that rotates about an axis through the origin and then translates."""
        return self.translator(*translation) * self.rotor(axis, angle)


def _moved(translator: Any, versor: Any) -> Any:
    return translator * versor * ~translator


CGA2 = PlaneConformal(_CGA2)
CGA3 = RoomConformal(_CGA3)
