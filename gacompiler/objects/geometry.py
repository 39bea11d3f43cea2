"""Geometric methods of elements: what they are, where they are, and how they are related.

`MultivectorArray` inherits them. Each works on single elements and on arrays of any shape. An element that lacks a
property raises an `AlgebraError` that says which elements have it. In arrays, elements of the right kind without it,
such as the radius of an imaginary sphere, give NaN.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, Self

import numpy as np

from ..algebra.multivector import Multivector
from ..errors import AlgebraError, LayoutError
from ..gac_runtime.annotations import Array, Real, Truth
from ..gac_runtime.array_element import Element
from . import blades, explaining, motions, quick, relations, shapes
from .checks import number_of, require_blade
from .definitions import BINARY
from .methods import applied
from .shapes import CONFORMAL, Shape

_WITH_NORMAL = ("plane", "circle")
_WITH_DIRECTION = ("line", "point pair", "direction", "vector")


class Geometry(Element):
    """Geometric methods of multivectors."""

    __slots__ = ()
    _of_rows: ClassVar[Callable[..., Any]]
    _objects_of: ClassVar[Callable[..., tuple[Any, ...]]]

    def project(self, onto: Self | Multivector) -> Self:
        """Return the projection onto a blade, ``(x . b) b**-1``; for points of conformal space, the nearest point.

        Raises
        ------
        AlgebraError
            If `onto` is not a blade, or has no inverse.
        """
        _, onto = self._objects_of("project", (self, onto))
        require_blade("project", onto)
        if self.layout.algebra in CONFORMAL and shapes.grades_of(self) == {1}:
            self._require_same("project", onto)
            own = self._shape("project")
            if own.kind == "point":
                return self._points("project", relations.nearest_to(own, shapes.shape_of("project", onto)))
        return _projected(self, onto)

    def reject(self, onto: Self | Multivector) -> Self:
        """Return the rest of the projection onto a blade, ``x - (x . b) b**-1``; errors as in `project`.

        For vectors it is orthogonal to the blade.
        """
        _, onto = self._objects_of("reject", (self, onto))
        require_blade("reject", onto)
        return applied(BINARY["subtract"], self, _projected(self, onto))

    def distance(self, other: Self) -> Real:
        """Return the minimum distance to another element, 0 if they intersect.

        Parameters
        ----------
        other : MultivectorArray
            A point, line, plane, circle, sphere or point pair of the same algebra; shapes broadcast. Spheres are
            surfaces, pairs consist of two points, and vectors of Euclidean algebras are points.

        Returns
        -------
        float or array
            NaN for imaginary rounds.

        Raises
        ------
        AlgebraError
            If the distance is not defined, or has no closed form, as that of two circles in space.
        """
        found = quick.distance(self, other)
        if found is not None:
            return found
        _, element = self._objects_of("distance", (self, other))
        if element is not other:
            return self.distance(element)
        self._require_same("distance", other)
        return number_of(relations.distance_of(self._shape("distance"), shapes.shape_of("distance", other)))

    def angle(self, other: Self | None = None) -> Real:
        """Return the angle to another element in radians; without one, the angle by which a rotor or motor turns.

        The angle between two directions or two normals is in [0, pi]. That of a line with a plane is in [-pi/2, pi/2],
        positive in the direction of the normal. Spheres, and circles of the plane, have an angle where they intersect,
        else NaN. The turning angle
        is that of the shorter rotation: in [0, pi] about `axis` in space, in [-pi, pi] in the plane.

        Parameters
        ----------
        other : MultivectorArray, optional
            An element of the same algebra; shapes broadcast.

        Raises
        ------
        AlgebraError
            If the elements have no angle; without `other`, if this is not a rotor, motor or unit quaternion.
        LayoutError
            If a rotor is not of unit norm.
        """
        if other is None:
            return number_of(motions.motion_of("angle", self).angle)
        _, other = self._objects_of("angle", (self, other))
        self._require_same("angle", other)
        return number_of(relations.angle_of(self._shape("angle"), shapes.shape_of("angle", other)))

    def center(self) -> Array:
        """Return the coordinates of the centre: of a point pair, circle or sphere; of a point, the point itself.

        The centre of a motor of the plane is the point that it does not move.
        """
        if self._is_motion:
            moved = motions.motion_of("center", self)
            if moved.dimension == 2 and moved.translates:
                return self._defined("center", moved.place, "a translation, which moves all points", "a rotation")
            raise AlgebraError("center", f"a {self.layout}", "a point or round", "axis() is what a motor does not move")
        found = self._shape("center")
        self._require("center", found, ("point", *shapes.ROUNDS, "vector"))
        return self._defined("center", found.place, "coordinates that are not finite", "a point or round")

    def radius(self) -> Real:
        """Return the radius of a circle or sphere, and half of the distance of the points of a pair.

        Raises
        ------
        LayoutError
            If this is a single imaginary round; `radius_squared` of its space is negative.
        """
        found = self._shape("radius")
        self._require("radius", found, shapes.ROUNDS)
        return self._defined("radius", found.radius, f"an imaginary {found.kind}", "a real one", axes=0)

    def direction(self) -> Array:
        """Return the unit vector along a line, point pair, direction or vector, as coordinates.

        That of a pair ``p ^ q`` points from p to q.
        """
        found = self._shape("direction")
        self._require("direction", found, _WITH_DIRECTION)
        return self._defined("direction", found.along, f"a {found.kind} of length 0", "a nonzero one")

    def normal(self) -> Array:
        """Return the unit normal of a plane or circle of space, or of a line of the plane, as coordinates."""
        found = self._shape("normal")
        planar = ("line",) if found.dimension == 2 else _WITH_NORMAL
        self._require("normal", found, planar)
        return self._defined("normal", found.normal, f"a {found.kind} of weight 0", "a nonzero one")

    def axis(self) -> Self:
        """Return the axis about which a rotor, motor or unit quaternion turns by `angle`, by the right-hand rule.

        It is a line of unit weight in PGA3 and CGA3, and an array with the coordinates of a unit vector in VGA3 and
        QUATERNIONS.

        Raises
        ------
        LayoutError
            If a single motor does not turn; in arrays such axes are NaN.
        """
        found = quick.axis(self)
        if found is not None:
            return found
        moved = self._moved_in_space("axis")
        turns = np.isfinite(moved.direction[..., 0])
        if not moved.angle.shape and not turns:
            raise LayoutError("axis", "a motion that does not turn", "a rotation", "translation() is what it moves by")
        return motions.axis_of(self, moved)

    def pitch(self) -> Real:
        """Return the translation of a motor along its axis per radian, infinite for translations."""
        moved = self._moved_in_space("pitch")
        with np.errstate(invalid="ignore", divide="ignore"):
            turning = moved.distance / moved.angle
            shift = shapes.length(moved.translation)
        still = np.where(shift > 0, np.inf, 0.0)
        return number_of(np.where(moved.angle == 0, still, turning))

    def translation(self) -> Array:
        """Return the coordinates of the translation of a motor, which follows its rotation."""
        moved = motions.motion_of("translation", self)
        if not moved.translates:
            raise AlgebraError("translation", f"a {self.layout}", "a motor of PGA2, PGA3, CGA2 or CGA3")
        return moved.translation

    def points(self) -> tuple[Self, Self]:
        """Return the two points of a point pair; those of ``p ^ q`` are p and q.

        Raises
        ------
        LayoutError
            If this is a single imaginary pair; in arrays such points are NaN.
        """
        found = self._shape("points")
        self._require("points", found, ("point pair",))
        one, two = relations.ends_of(found)
        return self._points("points", one), self._points("points", two)

    def is_blade(self) -> Truth:
        """Whether this is an outer product of vectors, to half of the digits; an array of booleans for arrays."""
        return blades.are_blades(self)

    def is_versor(self) -> Truth:
        """Whether this is a product of invertible vectors, to half of the digits; an array of booleans for arrays."""
        return blades.are_versors(self)

    def is_null(self) -> Truth:
        """Whether the scalar part of ``x ~x`` is 0, to half of the digits; an array of booleans for arrays."""
        return blades.are_null(self)

    def grades(self) -> tuple[int, ...]:
        """Return the grades whose coefficients are not all 0 up to the rounding error of one product."""
        return shapes.grades_in(self)

    def factorize(self) -> tuple[Real, tuple[Self, ...]]:
        """Return a weight and orthogonal vectors whose outer product, times the weight, is this blade.

        Returns
        -------
        weight : float or array
        vectors : tuple of MultivectorArray
            One for each grade. Their squares are 1, -1 or 0.

        Raises
        ------
        AlgebraError
            If this is not a blade.
        """
        return blades.factors_of(self)

    def to_matrix(self) -> Array:
        """Return the matrix of a rotor, motor or unit quaternion; `from_matrix` of the space is the inverse.

        Returns
        -------
        array
            (..., 4, 4) in PGA3 and CGA3, (..., 3, 3) in PGA2 and CGA2, matrices of homogeneous coordinates. In VGA3 and
            QUATERNIONS (..., 3, 3) and in VGA2 (..., 2, 2), matrices of rotations.
        """
        return motions.matrix_of(motions.motion_of("to_matrix", self))

    def quaternion(self) -> Array:
        """Return the rotation of a rotor or motor as quaternions w, x, y, z, (..., 4), with the scalar first.

        `from_quaternion` of the space is the inverse for rotors.
        """
        return motions.motion_of("quaternion", self).quaternion

    def dual_quaternion(self) -> Array:
        """Return a motor of space as dual quaternions, (..., 8): q of its rotation, then ``t q / 2``.

        Both quaternions have their scalar first, and t is the translation after the rotation, a quaternion without
        scalar. `from_dual_quaternion` of the space is the inverse.
        """
        return motions.dual_quaternion_of(self._moved_in_space("dual_quaternion"))

    def explain(self) -> str:
        """Return one line that says what this element is, with numbers of three significant digits.

        Returns
        -------
        str
            For example ``circle, centre (0, 0, 1), normal (0, 0, 1), radius 1.73``. For an array, its shape, the kind
            of its elements, and the line of the first one.
        """
        return explaining.line_of(self)

    @property
    def _is_motion(self) -> bool:
        support = self.layout.support
        return 0 in support and len(support) > 1 and self.layout.algebra in motions.MOTIONS

    def _shape(self, where: str) -> Shape:
        return shapes.shape_of(where, self)

    def _require_same(self, where: str, other: Any) -> None:
        if getattr(other, "algebra", None) != self.layout.algebra:
            found = f"multivectors of {other.algebra.name}" if hasattr(other, "algebra") else type(other).__name__
            raise AlgebraError(where, f"{found} with a {self.layout}", f"an element of {self.layout.algebra.name}")

    def _require(self, where: str, found: Shape, kinds: tuple[str, ...]) -> None:
        if found.kind.removeprefix("dual ") not in kinds:
            raise AlgebraError(
                where, f"a {found.kind}, {self.layout}", f"a {', '.join(kinds[:-1])}{' or ' * (len(kinds) > 1)}"
                f"{kinds[-1]}", "explain() says what an element is",
            )  # fmt: skip

    def _moved_in_space(self, where: str) -> motions.Motion:
        moved = motions.motion_of(where, self)
        needs_translation = where in ("pitch", "dual_quaternion")
        if moved.dimension == 2 or (needs_translation and not moved.translates):
            spaces = "PGA3 or CGA3" if needs_translation else "PGA3, CGA3, VGA3 or QUATERNIONS"
            raise AlgebraError(
                where, f"a {self.layout}", f"a motion of {spaces}",
                "center() is what a motor of the plane does not move" if moved.dimension == 2 else "",
            )  # fmt: skip
        return moved

    def _defined(self, where: str, values: Any, found: str, expected: str, axes: int = 1) -> Any:
        """Return numbers of elements; raise if those of a single element are NaN although its coefficients are not."""
        values = np.asarray(values) + 0.0  # without negative zeros
        if values.ndim == axes and np.any(np.isnan(values)) and not np.any(np.isnan(self.values)):
            raise LayoutError(where, found, expected)
        return values if axes else number_of(values)

    def _points(self, where: str, coordinates: Any) -> Any:
        given = self._defined(where, coordinates, "no real point", "a real round, and a point off its centre")
        return self._of_rows(self.layout.algebra.POINT, given)


def _projected(x: Any, onto: Any) -> Any:
    if np.any(np.abs(np.asarray(onto.norm_squared())) <= 1e-12 * np.max(onto.values**2, axis=-1, initial=1e-300)):
        raise AlgebraError("project", f"onto a {onto.layout} whose norm is 0", "a blade with an inverse")
    grades = shapes.grades_of(x)
    return (x.inner_product(onto) * onto.inverse()).grade(*grades)  # The other grades cancel.
