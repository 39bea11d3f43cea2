"""Points, lines, planes and motors of the plane and of space, in projective geometric algebra.

Planes of space and lines of the plane are vectors; points are pseudovectors. ``a & b`` joins, ``a ^ b`` meets.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..algebra.catalog import PGA2 as _PGA2
from ..algebra.catalog import PGA3 as _PGA3
from ..errors import LayoutError
from .arrays import MultivectorArray
from .checks import require_blade
from .definitions import normalize_of
from .spaces import Rigid, define


class PlaneProjective(Rigid):
    """The plane, G(2, 0, 1): lines are vectors, points are bivectors."""

    def point(self, *coordinates: Any) -> Any:
        """Points from x and y, or an array with these along its last axis."""
        return self.of(_PGA2.POINT, *coordinates)

    def direction(self, *coordinates: Any) -> Any:
        """Directions, points at infinity, from x and y."""
        return self.of(_PGA2.DIRECTION, *coordinates)

    def line(self, *coefficients: Any) -> Any:
        """Lines ``a x + b y + c = 0`` from a, b, c; or the line from one point to another or along a direction."""
        joined = _joined("line", coefficients)
        return self.of(_PGA2.LINE, *coefficients) if joined is None else joined

    def translator(self, *coordinates: Any) -> Any:
        """The translator by x and y."""
        return self._make(_TRANSLATE2, self._directions("translator", "e20 e01", coordinates))

    def rotor(self, angle: Any, centre: Any = None) -> Any:
        """The rotor by an angle in radians, counterclockwise, about a point, by default the origin."""
        return self._make(_ROTATE2, self.point(0.0, 0.0) if centre is None else centre, angle)

    def motor(self, angle: Any, *translation: Any) -> Any:
        """The motor that rotates about the origin and then translates by x and y."""
        return self.translator(*translation) * self.rotor(angle)

    def coordinates(self, points: MultivectorArray) -> Any:
        """x and y of points of any weight but 0, along the last axis."""
        return _coordinates(points, ("e20", "e01"), "e12")


class Projective(Rigid):
    """Space, G(3, 0, 1): planes are vectors, lines bivectors, points trivectors."""

    def point(self, *coordinates: Any) -> Any:
        """Points from x, y, z, or an array with these along its last axis."""
        return self.of(_PGA3.POINT, *coordinates)

    def direction(self, *coordinates: Any) -> Any:
        """Directions, points at infinity, from x, y, z."""
        return self.of(_PGA3.DIRECTION, *coordinates)

    def plane(self, *coefficients: Any) -> Any:
        """Planes ``a x + b y + c z + d = 0`` from a, b, c, d; or the plane through three points."""
        joined = _joined("plane", coefficients)
        return self.of(_PGA3.PLANE, *coefficients) if joined is None else joined

    def line(self, *coefficients: Any) -> Any:
        """The line from one point to another point, or along a direction; or from six coefficients.

        Raises
        ------
        AlgebraError
            When six coefficients are no line but a screw: the direction is to be orthogonal to the moment.
        """
        joined = _joined("line", coefficients)
        if joined is not None:
            return joined
        line = self.of(_PGA3.LINE, *coefficients)
        require_blade("line", line)
        return line

    def translator(self, *coordinates: Any) -> Any:
        """The translator by x, y, z."""
        return self._make(_TRANSLATE3, self._directions("translator", "e032 e013 e021", coordinates))

    def rotor(self, axis: Any, angle: Any) -> Any:
        """The motor that rotates about a line of any weight, or an axis through the origin, by the right-hand rule."""
        return self._make(_ROTATE3, self._axis(axis), angle)

    def motor(self, axis: Any, angle: Any, distance: Any = 0.0) -> Any:
        """The screw motion about a line by an angle in radians, and along it by a distance; the axis as in `rotor`."""
        return self._make(_SCREW, self._axis(axis), angle, distance)

    def motor_from_matrix(self, matrix: Any) -> Any:
        """The motor of a rigid motion given as a 4 x 4 matrix, ``(..., 4, 4)``.

        Raises
        ------
        LayoutError
            When the matrix is none of a rigid motion, to 1e-6.
        """
        from scipy.spatial.transform import Rotation

        m = np.asarray(matrix, float)
        if m.ndim < 2 or m.shape[-2:] != (4, 4):
            raise LayoutError("motor_from_matrix", f"an array of shape {m.shape}", "(..., 4, 4)")
        r = m[..., :3, :3]
        rigid = np.abs(r @ np.swapaxes(r, -1, -2) - np.eye(3)).max(initial=0.0) < 1e-6 and np.all(np.linalg.det(r) > 0)
        if not rigid or np.abs(m[..., 3, :] - [0, 0, 0, 1]).max(initial=0.0) > 1e-6:
            raise LayoutError("motor_from_matrix", "a matrix of no rigid motion", "a rotation, a translation, 0 0 0 1")
        q = Rotation.from_matrix(r.reshape(-1, 3, 3)).as_quat().reshape((*r.shape[:-2], 4))
        x, y, z, w = (q[..., k] for k in range(4))
        return self.translator(m[..., :3, 3]) * self.of(_PGA3.ROTOR, w, -z, y, -x)

    def coordinates(self, points: MultivectorArray) -> Any:
        """x, y, z of points of any weight but 0, along the last axis."""
        return _coordinates(points, ("e032", "e013", "e021"), "e123")

    def _axis(self, axis: Any) -> Any:
        if isinstance(axis, MultivectorArray):
            require_blade("axis", axis)
            return self._make(normalize_of(axis.layout), axis)
        return self._axis(self.point(0.0, 0.0, 0.0) & self.direction(axis))


def _joined(what: str, objects: tuple[Any, ...]) -> Any:
    """The join of objects; None where they are numbers."""
    if not all(isinstance(each, MultivectorArray) for each in objects):
        return None
    joined = objects[0]
    for each in objects[1:]:
        joined = joined & each
    if len(objects) < 2:
        raise LayoutError(what, f"{len(objects)} objects", "coefficients, or objects to join")
    return joined


def _coordinates(points: MultivectorArray, names: tuple[str, ...], weight: str) -> Any:
    w = np.asarray(points[weight])
    if np.any(w == 0):
        raise LayoutError("coordinates", "a point at infinity", f"{weight} other than 0")
    return np.stack(np.broadcast_arrays(*(np.asarray(points[name]) for name in names)), -1) / w[..., None]


# The ideal line or plane through a direction, from its coefficients: half the way, in planes orthogonal to it.
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

PGA2 = PlaneProjective(_PGA2)
PGA3 = Projective(_PGA3)
