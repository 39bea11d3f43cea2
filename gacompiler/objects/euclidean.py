"""Constructors of vectors, rotors, quaternions and boosts from coordinates, axes, angles and velocities."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..algebra.catalog import QUATERNIONS as _QUATERNIONS
from ..algebra.catalog import STA as _STA
from ..algebra.catalog import VGA2 as _VGA2
from ..algebra.catalog import VGA3 as _VGA3
from ..errors import LayoutError
from .arrays import MultivectorArray, wrap
from .checks import require_finite
from .direct import quickly
from .poses import Poses, stacked_quaternion
from .spaces import Argument, M, Space, define, single_of_numbers, stacked, unit

if TYPE_CHECKING:
    from .names import QuaternionSpace, StaSpace, Vga2Space, Vga3Space

_ROTOR2 = define("rotor", "angle", "ga.exp(-angle / 2 * {A}.pseudoscalar)", unit=True)
_ROTOR3 = define("rotor", "axis angle", "ga.exp(-angle / 2 * axis * {A}.pseudoscalar)", unit=True)
_BETWEEN = define(
    "rotor_between", "a b",
    "(ga.norm(a) * ga.norm(b) + b * a) / ga.norm(ga.norm(a) * ga.norm(b) + b * a)", unit=True,
)  # fmt: skip
_REFLECTION = define("reflection", "mirror x", "-mirror * x * ga.inverse(mirror)")


class Plane(Poses[M], Space[M]):
    """The plane, G(2)."""

    def rotor(self, angle: Argument[M]) -> M:
        """Create the rotor by an angle in radians, from e1 towards e2."""
        return self._make(_ROTOR2, angle)

    def rotor_between(self, a: Argument[M], b: Argument[M]) -> M:
        """Create the rotor by the smaller angle from the direction of `a` to that of `b`.

        Raises
        ------
        LayoutError
            If the vectors are opposite, or one is 0; in arrays such rotors are NaN.
        """
        a, b = (self._directions(name, "e1 e2", (x,)) for name, x in (("a", a), ("b", b)))
        return require_finite("rotor_between", self._make(_BETWEEN, a, b), (a, b), "opposite vectors, or a zero one")


class Room(Poses[M], Space[M]):
    """Space, G(3)."""

    def rotor(self, axis: Argument[M], angle: Argument[M]) -> M:
        """Create the rotor by an angle in radians about an axis of any nonzero length, by the right-hand rule."""
        made = quickly(self, "rotor", (axis, angle))
        if made is not None:
            return cast("M", made)
        return self._make(_ROTOR3, unit("rotor", self._directions("axis", "e1 e2 e3", (axis,))), angle)

    def rotor_between(self, a: Argument[M], b: Argument[M]) -> M:
        """Create the rotor by the smaller angle from the direction of `a` to that of `b`.

        Raises
        ------
        LayoutError
            If the vectors are opposite, or one is 0; in arrays such rotors are NaN.
        """
        a, b = (self._directions(name, "e1 e2 e3", (x,)) for name, x in (("a", a), ("b", b)))
        return require_finite("rotor_between", self._make(_BETWEEN, a, b), (a, b), "opposite vectors, or a zero one")

    def reflect(self, mirror: Argument[M], x: Argument[M]) -> M:
        """Reflect the vectors `x` in planes with the normals `mirror`."""
        mirror, x = (self._directions(name, "e1 e2 e3", (v,)) for name, v in (("mirror", mirror), ("x", x)))
        return self._make(_REFLECTION, mirror, x)


_TURN = define("rotation", "axis angle", "ga.exp(angle / 2 * axis)")
_ROTATE = define("rotate", "q v", "q * v * ~q")


class Quaternions(Poses[M], Space[M]):
    """Hamilton's numbers: i, j and k are e1, e2 and e12, and ``~q`` is the conjugate."""

    @property
    def i(self) -> M:
        """The imaginary unit ``i``."""
        return self.imaginary(1, 0, 0)

    @property
    def j(self) -> M:
        """The imaginary unit ``j``."""
        return self.imaginary(0, 1, 0)

    @property
    def k(self) -> M:
        """The imaginary unit ``k``, ``i j``."""
        return self.imaginary(0, 0, 1)

    def quaternion(self, *coefficients: Argument[M]) -> M:
        """Create quaternions from w, x, y, z, or an array with these along its last axis."""
        if len(coefficients) == 4:
            return self.of(_QUATERNIONS.QUATERNION, *coefficients)
        return wrap(_QUATERNIONS.QUATERNION, stacked_quaternion("quaternion", coefficients))

    def rotation(self, axis: Argument[M], angle: Argument[M]) -> M:
        """Create the unit quaternion of a rotation by an angle in radians about an axis, by the right-hand rule.

        The axis may have any nonzero length.
        """
        quick = quickly(self, "rotation", (axis, angle))
        if quick is not None:
            return cast("M", quick)
        made = self._make(_TURN, unit("rotation", self._imaginary("axis", (axis,))), angle)
        return wrap(_QUATERNIONS.UNIT_QUATERNION, made.values)

    def imaginary(self, *coordinates: Argument[M]) -> M:
        """Create imaginary quaternions from x, y, z, which represent vectors in `rotate`."""
        return self._imaginary("imaginary", coordinates)

    def rotate(self, q: Argument[M], v: Argument[M]) -> M:
        """Rotate the imaginary quaternions `v` by the unit quaternions `q`."""
        q = q if isinstance(q, MultivectorArray) else self.quaternion(q)
        return self._make(_ROTATE, q, self._imaginary("v", (v,)))

    def _imaginary(self, what: str, coordinates: tuple[Any, ...]) -> Any:
        single = single_of_numbers(_QUATERNIONS.VECTOR, coordinates)
        if single is not None:
            return single
        if len(coordinates) == 1 and (found := self._element_in(what, coordinates[0])) is not None:
            return found
        return wrap(_QUATERNIONS.VECTOR, stacked(what, ("x", "y", "z"), coordinates))


_EXP_HALF = define("boost", "generator", "ga.exp(generator / 2)", unit=True)
_SPACE = _STA.layout("SPACE", "g10 g20 g30")
_SPATIAL_ROTOR = define(
    "rotor", "axis angle", 'ga.exp(-angle / 2 * axis * {A}.multivector({"g123": 1}))', unit=True,
)  # fmt: skip


class Spacetime(Space[M]):
    """Spacetime, G(1, 3), with c = 1."""

    def rotor(self, axis: Argument[M], angle: Argument[M]) -> M:
        """Create the rotor by an angle in radians about a spatial axis (g1, g2, g3), by the right-hand rule."""
        return self._make(_SPATIAL_ROTOR, unit("rotor", self._directions("axis", "g1 g2 g3", (axis,))), angle)

    def boost(self, *velocity: Argument[M]) -> M:
        """Create the boost that maps g0 to the velocity of an observer with (x, y, z) below 1, the speed of light."""
        if len(velocity) == 3 and all(type(x) is float or type(x) is int for x in velocity):
            single: tuple[Any, ...] = velocity
            speed = math.hypot(*single)
            if speed < 1:
                factor = math.atanh(speed) / speed if speed > 0 else 1.0
                return self._make(_EXP_HALF, self.of(_SPACE, *[x * factor for x in single]))
        v = stacked("boost", ("x", "y", "z"), velocity)
        speed = np.sqrt(np.sum(v * v, axis=-1))
        if np.any(speed >= 1):
            raise LayoutError("boost", f"a speed of {np.max(speed):.6g}", "less than 1, the speed of light")
        rapidity = np.arctanh(speed)
        scale = np.divide(rapidity, speed, out=np.ones_like(speed), where=speed > 0)
        generator = self.of(_SPACE, v * scale[..., None])
        return self._make(_EXP_HALF, generator)


VGA2 = cast("Vga2Space", Plane(_VGA2))
VGA3 = cast("Vga3Space", Room(_VGA3))
QUATERNIONS = cast("QuaternionSpace", Quaternions(_QUATERNIONS))
STA = cast("StaSpace", Spacetime(_STA))
