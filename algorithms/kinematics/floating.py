"""Robots with a floating base: its pose is a motor, its velocity a twist in its own frame.

The kernels of `generated.robots` compute its methods, as those of all robots. Dynamics are computed in the frame of the
base, where only the direction of gravity depends on its pose. Results do not depend on the distance from the world's
origin, and no attitude is singular.

The forces on the base are a torque about its origin and a force, both in its frame. One class in one file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NoReturn, Self

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals
from .errors import FloatingBaseError
from .inverse import Solutions
from .robot import Robot, for_base
from .tables import FREEDOMS, MOTOR

_BERNOULLI = (1 / 2, 1 / 12, 0.0, -1 / 720, 0.0, 1 / 30240, 0.0, -1 / 1209600, 0.0, 1 / 47900160)
"""Bernoulli numbers divided by factorials, with the signs for velocities in the moving frame."""
_TWISTS = pga3.twist_from_velocities(np.eye(6)[:, :3], np.eye(6)[:, 3:])
"""The twists of the base at unit rates, in its frame."""


@for_base("floating")
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FloatingRobot(Robot):
    """A robot with a floating base, as returned by ``Robot.from_urdf(path, base="floating")``.

    With m joints besides the base, which is joint 0, `q` has ``8 + m`` entries: the motor of the base frame in the
    world (1, e12, e13, e23, e01, e02, e03, e0123), followed by the joint variables. M and -M are the same pose; motors
    are normalised. Velocities, accelerations and forces have ``n = 6 + m`` entries: the angular velocity x, y, z of the
    base and the linear velocity x, y, z of its origin, both in the base frame, followed by those of the joints.
    Accelerations are the time derivatives of these components. Derivatives with respect to `q` are taken along
    ``integrate(q, dv)``.

    Kinematic results are expressed in the world frame, as for a robot with a fixed base. `inverse` and `with_base`
    raise a `FloatingBaseError`.

    Relative to the largest entry, forces and accelerations of G1, Talos, ANYmal and Solo differ from those of Pinocchio
    by less than 1e-12, within 1,000 km of the origin, at any attitude.
    """

    _floats: ClassVar[bool] = True

    # Kinematics of elements.

    def twists_of_joints(self, q: ArrayLike) -> Reals:
        """As `Robot.twists_of_joints`, (..., n, 6); the first six are those of the base, which has no axis."""
        shape, (flat,) = self._together((q, "q"))
        base = pga3.move_line(pga3.normalize_motor(flat[:, None, :MOTOR]), _TWISTS.astype(flat.dtype))
        joints = Robot.twists_of_joints(self, flat)[:, 1:]
        found: Reals = np.concatenate([base, joints], axis=1)
        return found.reshape(*shape, FREEDOMS - 1 + len(self.kinds), 6)

    def _jacobian_of(self, q: ArrayLike, element: Reals, move: pga3.Kernel, twist_on: pga3.Kernel) -> Reals:
        """Compute with the base at the origin, and move the result."""
        shape, (flat,) = self._together((q, "q"))
        there = flat.copy()
        there[:, :MOTOR] = np.eye(MOTOR)[0]
        now = move(Robot.forward(self, there), element.astype(flat.dtype))
        twists, path = self.twists_of_joints(there), [*range(FREEDOMS), *(FREEDOMS - 1 + j for j in self.path[1:])]
        found = np.zeros((len(flat), len(element), FREEDOMS - 1 + len(self.kinds)), flat.dtype)
        found[..., path] = np.swapaxes(twist_on(twists[:, path], now[:, None]), -1, -2)
        columns = np.swapaxes(self._reduced(found), -1, -2)
        move = pga3.move_direction if move is pga3.move_point else move
        moved: Reals = move(pga3.normalize_motor(flat[:, None, :MOTOR]), columns)
        return np.swapaxes(moved, -1, -2).reshape(*shape, len(element), -1)

    def _reduced(self, columns: Reals) -> Reals:
        if not self.coupling.size:
            return columns
        own = columns[..., :FREEDOMS]
        joints = columns[..., FREEDOMS:] @ self.coupling[1:, FREEDOMS:-1].astype(columns.dtype)
        found: Reals = np.concatenate([own, joints], axis=-1)
        return found

    def _straight(self, x: Reals, v: Reals) -> Reals:
        """Apply the derivative of the inverse exponential (tenth order in the motion `x`) to velocities `v`."""
        motion, change = _line(x), _line(v)
        total = change
        for factor in _BERNOULLI:
            change = pga3.twist_on_line(motion, change)
            total = total + factor * change
        return np.concatenate([*pga3.twist_to_velocities(total), v[..., 6:]], axis=-1)

    # Methods that do not apply to a floating base.

    def with_base(self, base: ArrayLike) -> Self:
        """Raise a FloatingBaseError: `q` determines the pose of the base."""
        self._refuse("with_base", "q determines its pose; use integrate to move it")

    def inverse(
        self,
        poses: ArrayLike,
        *,
        locked: Mapping[int, ArrayLike] | None = None,
        elbow: ArrayLike | None = None,
        method: str = "motors",
        near: ArrayLike | None = None,
        link: str | None = None,
        way: str | None = None,
    ) -> Solutions:
        """Raise a FloatingBaseError: the base alone reaches every pose."""
        self._refuse("inverse", "the base alone reaches every pose; load the robot with base='fixed'")

    def _refuse(self, name: str, why: str) -> NoReturn:
        raise FloatingBaseError(f"{self.name}: {name}: the base floats, and {why}")

    def _arm(self) -> tuple[Robot, list[int]]:
        self._refuse("self_motions", "the base alone reaches every pose; load the robot with base='fixed'")


def _line(v: Reals) -> Reals:
    """Return the base's velocities as a twist in its frame."""
    return pga3.twist_from_velocities(v[..., :3], v[..., 3:6])
