"""Rotors, translators, motors and unit quaternions as quaternions, translations and matrices.

A motion rotates first and translates afterwards. Quaternions have their scalar first. In the plane, rotations are about
the z axis, and translations have two coordinates.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.catalog import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, STA, VGA2, VGA3
from ..algebra.layout import Layout
from ..errors import AlgebraError
from .definitions import Definition
from .methods import applied
from .shapes import Reals, length, read, unit

MOTIONS: dict[Algebra, Layout] = {
    PGA2: PGA2.MOTOR, PGA3: PGA3.MOTOR, CGA2: CGA2.MOTOR, CGA3: CGA3.MOTOR, VGA2: VGA2.ROTOR, VGA3: VGA3.ROTOR,
    QUATERNIONS: QUATERNIONS.UNIT_QUATERNION,
}  # fmt: skip
"""The layout of all motions of each algebra."""
IN_SPACE = (PGA3, CGA3, VGA3)
TRANSLATING = {
    PGA2: (("e01", "e20"), (-2, 2)), PGA3: (("e01", "e02", "e03"), (-2, -2, -2)),
    CGA2: (("e1inf", "e2inf"), (-2, -2)), CGA3: (("e1inf", "e2inf", "e3inf"), (-2, -2, -2)),
}  # fmt: skip
"""The coefficients of a translator, and their factors in the translation."""


def _rotor_part(blades: tuple[str, ...]) -> str:
    return " + ".join(['m["1"]', *(f'm["{name}"] * {{A}}.multivector({{"{name}": 1}})' for name in blades)])


_TRANSLATOR = {
    2: Definition("translator_of", ("m",), f"m * ~({_rotor_part(('e12',))})"),
    3: Definition("translator_of", ("m",), f"m * ~({_rotor_part(('e12', 'e13', 'e23'))})"),
}
"""The translation of a motor as a translator, in the plane and in space."""
_MOVED_TIME = Definition("moved_time", ("r",), '(r * {A}.multivector({"g0": 1}) * ~r).grade(1)')
_THROUGH = {
    PGA3: Definition("line_through", ("point", "direction"), "point & direction"),
    CGA3: Definition("line_through", ("point", "direction"), 'point ^ direction ^ {A}.multivector({"einf": 1})'),
}


class Motion(NamedTuple):
    """A rigid motion in numbers."""

    quaternion: Reals
    """(..., 4) The rotation, of unit norm, with its scalar first."""
    translation: Reals
    """(..., d) The translation after the rotation; 0 in algebras without translations."""
    translates: bool
    """Whether the algebra has translations."""

    @property
    def dimension(self) -> int:
        """2 in the plane, 3 in space."""
        return int(self.translation.shape[-1])

    @property
    def positive(self) -> Reals:
        """(..., 4) The quaternion of the same rotation whose scalar is not negative, which turns by at most pi."""
        return np.where(self.quaternion[..., :1] < 0, -self.quaternion, self.quaternion)

    @property
    def angle(self) -> Reals:
        """(...) The angle of the shorter rotation: in [0, pi] in space, in [-pi, pi] in the plane."""
        q = self.positive
        sine = q[..., 3] if self.dimension == 2 else length(q[..., 1:])
        return np.asarray(2 * np.arctan2(sine, q[..., 0]))

    @property
    def direction(self) -> Reals:
        """(..., 3) The unit vector of the axis; NaN if nothing turns."""
        return unit(self.positive[..., 1:])

    @property
    def distance(self) -> Reals:
        """(...) The translation along the axis, in space."""
        return np.asarray(np.sum(self.translation * self.direction, axis=-1))

    @property
    def place(self) -> Reals:
        """(..., d) The fixed point in the plane, the point of the axis nearest to the origin in space."""
        t = self.translation
        if self.dimension == 2:
            t = np.concatenate([t, np.zeros_like(t[..., :1])], -1)
        u = self.direction
        across = t - np.sum(t * u, axis=-1, keepdims=True) * u
        q = self.positive
        with np.errstate(invalid="ignore", divide="ignore"):
            cotangent = q[..., 0] / length(q[..., 1:])
            found = (across + cotangent[..., None] * np.cross(u, across)) / 2
        return np.asarray(found[..., : self.dimension])


def motion_of(where: str, x: Any) -> Motion:
    """Return the motion of a rotor, translator, motor or unit quaternion.

    Raises
    ------
    AlgebraError
        If this is another element.
    LayoutError
        If it is not of unit norm.
    """
    layout = MOTIONS.get(x.algebra)
    if layout is None or 0 not in x.layout.support or not x.layout.support <= layout.support:
        raise AlgebraError(where, f"a {x.layout}", "a rotor, a motor, a translator or a unit quaternion")
    # Half of the digits may be lost by the products that gave the versor.
    m = x if x.layout.unit else x.as_layout(layout, tolerance=float(np.finfo(x.values.dtype).eps) ** 0.5, what=where)
    scalar = np.asarray(m["1"])
    if x.algebra == QUATERNIONS:
        rest = read(m, ("e1", "e2", "e12"))
    elif x.algebra in IN_SPACE:
        rest = read(m, ("e23", "e13", "e12")) * [-1, 1, -1]
    else:
        rest = np.stack([np.zeros(m.shape), np.zeros(m.shape), -np.asarray(m["e12"])], -1)
    quaternion = np.concatenate([scalar[..., None], rest], -1)
    return Motion(quaternion + 0.0, _translation(m), m.algebra in TRANSLATING)


def _translation(m: Any) -> Reals:
    d = 2 if m.algebra in (PGA2, CGA2, VGA2) else 3
    if m.algebra not in TRANSLATING:
        return np.zeros((*m.shape, d))
    names, factors = TRANSLATING[m.algebra]
    if not any(m.algebra.blade(name)[1] in m.layout.support for name in names):
        return np.zeros((*m.shape, d))
    return np.asarray(read(applied(_TRANSLATOR[d], m), names) * np.array(factors))


def axis_of(x: Any, motion: Motion) -> Any:
    """Return the axis as a line of unit weight, or as coordinates of a unit vector in algebras without points."""
    if x.algebra not in _THROUGH:
        return motion.direction
    place, direction = motion.place, motion.direction
    algebra = x.algebra
    along = algebra.DIRECTION if algebra == PGA3 else algebra.layout("(e1 e2 e3)", "e1 e2 e3")
    return applied(_THROUGH[algebra], x._of_rows(algebra.POINT, place), x._of_rows(along, direction))


def matrix_of(motion: Motion) -> Reals:
    """Return the matrix of a motion: of homogeneous coordinates, or of vectors in algebras without translations."""
    d = motion.dimension
    rotation = _rotation_matrix(motion.quaternion)[..., :d, :d]
    if not motion.translates:
        return rotation
    found = np.zeros((*rotation.shape[:-2], d + 1, d + 1))
    found[..., :d, :d], found[..., :d, d], found[..., d, d] = rotation, motion.translation, 1
    return found


def _rotation_matrix(q: Reals) -> Reals:
    w, v = q[..., 0, None, None], q[..., 1:]
    cross = np.zeros((*v.shape, 3))
    for row, column, place, sign in ((0, 1, 2, -1), (0, 2, 1, 1), (1, 2, 0, -1)):
        cross[..., row, column], cross[..., column, row] = sign * v[..., place], -sign * v[..., place]
    return np.asarray(np.eye(3) + 2 * w * cross + 2 * cross @ cross)


def dual_quaternion_of(motion: Motion) -> Reals:
    """Return (..., 8): the quaternion q of the rotation, and ``t q / 2`` for the translation t as a pure quaternion."""
    q, t = motion.quaternion, motion.translation
    w, v = q[..., :1], q[..., 1:]
    scalar = -np.sum(t * v, axis=-1, keepdims=True)
    return np.concatenate([q, scalar / 2, (w * t + np.cross(t, v)) / 2], -1)


def velocity_of(r: Any) -> Reals:
    """Return the velocity of g0 after a Lorentz transformation ``r g0 ~r``, (..., 3)."""
    if r.algebra != STA:
        raise AlgebraError("velocity", f"a {r.layout}", "a rotor of STA")
    moved = applied(_MOVED_TIME, r)
    return np.asarray(read(moved, ("g1", "g2", "g3")) / np.asarray(moved["g0"])[..., None])
