"""Modified copies of a robot: another tool, base, gravity, payload, limits, armature, or specialised kernels.

Each method returns a new robot. It does not use kernels of the robot's module that were generated from the changed
constants (`folded`); `Robot.uses` reports which are used. Tool and gravity are not arguments of these kernels because
that would cost every robot more operations (`forward` of UR5 18 %, `jacobian` of Panda 18 %, `inverse_dynamics` 4 % and
two functions).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import finite, finite_number, real_array
from ..elements import MOTOR, elements
from . import folded
from .bodies import Body
from .constants import Floats
from .errors import DescriptionError, MissingInertiaError
from .masses import joined, placed
from .model import Model
from .tables import is_floating

_NO_MOTOR = {np.dtype(np.float64): 1e-9, np.dtype(np.float32): 1e-6}
"""Tolerated deviation of a motor from a unit motor, and of a matrix from a rigid motion, for numbers of about 1."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Changes(Model):
    """A robot with methods that return modified copies."""

    @elements(tool=MOTOR)
    def with_tool(self, tool: ArrayLike) -> Self:
        """Return the same robot with a tool at its end effector.

        Parameters
        ----------
        tool : array_like, (8,) or (4, 4)
            Pose of the new end effector in the frame of the present one, m: a unit motor, or a matrix. Its mass can be
            added with `with_payload`.

        Returns
        -------
        Robot
            Its ``forward(q)`` is that of this robot times the tool.

        Raises
        ------
        TypeError, ValueError
            If `tool` is neither a motor nor the matrix of a rigid motion.
        """
        return replace(self, tool=pga3.motor_product(self.tool, rigid_motor(tool, f"{self.name}: tool")))

    @elements(base=MOTOR)
    def with_base(self, base: ArrayLike) -> Self:
        """Return the same robot mounted elsewhere, for example on a wall, on a table or next to another robot.

        Gravity in the world does not change. Results are expressed in the world frame. The robot's axes become lines
        relative to the origin of the world, so that torques lose accuracy at large distances: about 1e-13 (relative) at
        1 km, 1e-10 at 1,000 km.

        Parameters
        ----------
        base : array_like, (8,) or (4, 4)
            Pose of the base frame in the world, m: a unit motor, or a matrix.

        Returns
        -------
        Robot
            Its ``forward(q)`` is the base times that of this robot.

        Raises
        ------
        TypeError, ValueError
            If `base` is neither a motor nor the matrix of a rigid motion.
        """
        motor = rigid_motor(base, f"{self.name}: base")
        bodies = np.array([placed(motor, body) for body in self.bodies]) if self.bodies.size else self.bodies
        return replace(
            self,
            axes=pga3.move_line(motor, self.axes),
            home=pga3.motor_product(motor, self.home),
            tool=pga3.motor_product(motor, self.tool),
            bodies=bodies,
            links={name: (joint, pga3.motor_product(motor, place)) for name, (joint, place) in self.links.items()},
        )

    def with_gravity(self, gravity: ArrayLike) -> Self:
        """Return the same robot under another gravity, for example on the ceiling or on the Moon.

        Parameters
        ----------
        gravity : array_like, (3,)
            Gravitational acceleration in the base frame, m/s². That of new robots is ``(0, 0, -9.81)``.

        Raises
        ------
        TypeError, ValueError
            If `gravity` is not an array of three finite numbers.
        """
        return replace(self, free_fall=_finite(gravity, f"{self.name}: gravity", (3,), "a vector"))

    def with_payload(
        self, mass: float, centre: Sequence[float] = (0.0, 0.0, 0.0), tensor: Sequence[float] = (0.0,) * 6
    ) -> Self:
        """Return the same robot with a rigid body added to its end effector.

        Parameters
        ----------
        mass : float
            kg.
        centre : 3 floats, optional
            Centre of mass in the end effector's frame, m.
        tensor : 6 floats, optional
            Moments of inertia about the centre in the directions of that frame, xx, xy, xz, yy, yz, zz, kg m².

        Raises
        ------
        MissingInertiaError
            If the robot's own masses are unknown.
        TypeError, ValueError
            For a negative mass or moment of inertia, a wrong number of coordinates, or non-finite numbers.
        """
        if not self.bodies.size:
            raise MissingInertiaError(f"{self.name}: payload: the robot's masses are unknown; expected bodies")
        where = f"{self.name}: payload"
        place = _finite(centre, f"{where}: centre", (3,), "x, y, z")
        moments = _finite(tensor, f"{where}: tensor", (6,), "xx, xy, xz, yy, yz, zz")
        body = Body(finite_number(mass, f"{where}: mass"), tuple(place), tuple(moments))
        bodies = self.bodies.copy()
        bodies[self.tip] = joined([bodies[self.tip], placed(self.tool, body.row)])
        return replace(self, bodies=bodies)

    def with_limits(self, limits: ArrayLike) -> Self:
        """Return the same robot with other joint limits.

        Parameters
        ----------
        limits : array_like, (n, 2) or (n, 4)
            For each variable the lower and upper limit, and optionally the maximum velocity and effort, which otherwise
            remain unchanged. Infinite if unlimited.

        Raises
        ------
        TypeError, ValueError
            For a wrong shape, a NaN, or a lower limit above the upper limit.
        """
        given = real_array(limits, f"{self.name}: limits", (len(self.limits), -1), "lower, upper, velocity, effort")
        if given.ndim != 2 or given.shape[1] not in (2, 4):
            n = len(self.limits)
            raise ValueError(f"{self.name}: limits: shape {given.shape}; expected ({n}, 2) or ({n}, 4)")
        kept = self.limits.copy()
        kept[:, : given.shape[1]] = given
        return replace(self, limits=kept)

    def with_armature(self, armature: ArrayLike) -> Self:
        """Return the same robot with other rotor inertias.

        Parameters
        ----------
        armature : array_like, (N,)
            Inertia reflected at each joint, kg m², or kg for prismatic joints: rotor inertia times the gear ratio
            squared.

        Raises
        ------
        TypeError, ValueError
            For a wrong shape, numbers that are not finite or negative, or an inertia of a floating base.
        """
        given = _finite(armature, f"{self.name}: armature", (len(self.kinds),), "one for each joint")
        if (given < 0).any():
            raise DescriptionError(f"{self.name}: armature {given}; expected no negative number")
        if is_floating(self) and given[0]:
            raise DescriptionError(f"{self.name}: armature {given[0]} of joint 0, the floating base; expected 0")
        return replace(self, armature=given)

    def with_module(self, module: ModuleType) -> Self:
        """Return the same robot with specialised kernels that ``gac robot`` wrote for it.

        Parameters
        ----------
        module : module
            Each of its kernels replaces the method of the same name. The docstring of the module contains digests of
            the constants that the kernels were generated from.

        Raises
        ------
        DescriptionError
            If the module was generated from constants that differ from those of this robot. The message names them.
        TypeError
            If `module` is not a module with such kernels.
        """
        name = getattr(module, "__name__", repr(module))
        parts = folded.folded_parts(module)
        if not parts:
            raise TypeError(f"{self.name}: module {name}; expected a module written by gac robot")
        robot = replace(self, module=module)
        other = sorted(folded.differences(robot) & parts)
        if other:
            raise DescriptionError(
                f"{self.name}: module {name} belongs to another robot: different {', '.join(other)}; expected kernels "
                "that gac robot wrote for this robot"
            )
        return robot


def _finite(value: ArrayLike, name: str, shape: tuple[int, ...], meaning: str) -> Floats:
    array = np.array(finite(real_array(value, name, shape, meaning), name), float)
    if array.shape != shape:
        raise ValueError(f"{name}: shape {array.shape}; expected {shape}, {meaning}")
    return array


def rigid_motor(value: ArrayLike, name: str) -> Floats:
    """Return a unit motor from a motor or a matrix."""
    given = finite(real_array(value, name), name)
    array = given.astype(float)
    most = _NO_MOTOR[given.dtype] * max(1.0, np.abs(array).max(initial=0.0))
    if array.shape == (8,):
        unit = pga3.normalize_motor(array)
        if not np.abs(unit - array).max() <= most:
            raise DescriptionError(f"{name}: {array}; expected a unit motor")
        return unit  # type: ignore[no-any-return]
    if array.shape != (4, 4):
        raise ValueError(f"{name}: shape {array.shape}; expected a motor (8,) or a matrix (4, 4)")
    motor = pga3.motor_from_matrix(array)
    if not np.abs(pga3.motor_to_matrix(motor) - array).max() <= most:
        raise DescriptionError(
            f"{name}: not the matrix of a rigid motion; expected a rotation, a translation, and the last row 0, 0, 0, 1"
        )
    return motor
