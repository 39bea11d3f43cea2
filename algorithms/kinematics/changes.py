"""The same robot with something changed: tool, base, gravity, payload, limits, armature, or kernels of its own.

Each method gives a new robot. Kernels of the robot's module that were made from what was changed are not used by the
new one (`folded`), and `Robot.uses` says so: as arguments of the kernels, tool and gravity would cost every robot more
operations (`forward` of UR5 18 %, `jacobian` of Panda 18 %, `inverse_dynamics` 4 % and two functions).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import finite, finite_number, real_array
from . import folded
from .bodies import Body
from .constants import Floats
from .errors import DescriptionError, MissingInertiaError
from .masses import joined, placed
from .model import Model

_NO_MOTOR = {np.dtype(np.float64): 1e-9, np.dtype(np.float32): 1e-6}
"""How far a motor may be from its unit, and a matrix from a motion, for numbers of about 1."""


@dataclass(frozen=True, slots=True, eq=False)
class Changes(Model):
    """A robot that can be had with something changed."""

    def with_tool(self, tool: ArrayLike) -> Self:
        """The same robot with a tool at its end effector.

        Parameters
        ----------
        tool : array_like, (8,) or (4, 4)
            Where the new end effector is in the frame of the present one, m: a unit motor, or a matrix. Its mass is a
            matter of `with_payload`.

        Returns
        -------
        Robot
            Its ``forward(q)`` is that of this robot times the tool.

        Raises
        ------
        TypeError, ValueError
            For what is no motor and no matrix of a motion.
        """
        return replace(self, tool=pga3.motor_product(self.tool, _motor(tool, f"{self.name}: tool")))

    def with_base(self, base: ArrayLike) -> Self:
        """The same robot mounted elsewhere: on a wall, on a table, beside another robot.

        Gravity in the world does not change, and the frame that results are given in becomes that of the world. The
        robot's axes are lines about that origin: of torques some 1e-13 is lost at 1 km, 1e-10 at 1,000 km.

        Parameters
        ----------
        base : array_like, (8,) or (4, 4)
            Where the base frame is in the world, m: a unit motor, or a matrix.

        Returns
        -------
        Robot
            Its ``forward(q)`` is the base times that of this robot.

        Raises
        ------
        TypeError, ValueError
            For what is no motor and no matrix of a motion.
        """
        motor = _motor(base, f"{self.name}: base")
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
        """The same robot under another gravity: on the ceiling, on the Moon.

        Parameters
        ----------
        gravity : array_like, (3,)
            The acceleration of free fall in the base frame, m/s²; ``(0, 0, -9.81)`` where nothing else is said.

        Raises
        ------
        TypeError, ValueError
            For what is not three finite numbers.
        """
        return replace(self, free_fall=_finite(gravity, f"{self.name}: gravity", (3,), "x, y, z"))

    def with_payload(
        self, mass: float, centre: Sequence[float] = (0.0, 0.0, 0.0), tensor: Sequence[float] = (0.0,) * 6
    ) -> Self:
        """The same robot with a rigid body held by its end effector, beside what it holds already.

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
            Where nothing is known of the robot's own masses.
        TypeError, ValueError
            For a negative mass or moment of inertia, another number of coordinates, what is not finite.
        """
        if not self.bodies.size:
            raise MissingInertiaError(f"{self.name}: payload: nothing known of the robot's masses; expected bodies")
        where = f"{self.name}: payload"
        place = _finite(centre, f"{where}: centre", (3,), "x, y, z")
        moments = _finite(tensor, f"{where}: tensor", (6,), "xx, xy, xz, yy, yz, zz")
        body = Body(finite_number(mass, f"{where}: mass"), tuple(place), tuple(moments))
        bodies = self.bodies.copy()
        bodies[self.tip] = joined([bodies[self.tip], placed(self.tool, body.row)])
        return replace(self, bodies=bodies)

    def with_limits(self, limits: ArrayLike) -> Self:
        """The same robot with other limits of its variables.

        Parameters
        ----------
        limits : array_like, (n, 2) or (n, 4)
            For each variable lowest and highest, and speed and effort; where these are left out, they remain.
            Infinite where there is no limit.

        Raises
        ------
        TypeError, ValueError
            For another shape, a NaN, a lowest above the highest.
        """
        given = real_array(limits, f"{self.name}: limits", (len(self.limits), -1), "lowest, highest, speed, effort")
        if given.ndim != 2 or given.shape[1] not in (2, 4):
            n = len(self.limits)
            raise ValueError(f"{self.name}: limits: shape {given.shape}; expected ({n}, 2) or ({n}, 4)")
        kept = self.limits.copy()
        kept[:, : given.shape[1]] = given
        return replace(self, limits=kept)

    def with_armature(self, armature: ArrayLike) -> Self:
        """The same robot with other inertias of its motors' rotors.

        Parameters
        ----------
        armature : array_like, (N,)
            As felt at each joint, kg m², or kg where it slides: rotor inertia times the gear ratio squared.

        Raises
        ------
        TypeError, ValueError
            For another shape, what is not finite, a negative number.
        """
        given = _finite(armature, f"{self.name}: armature", (len(self.kinds),), "one for each joint")
        if (given < 0).any():
            raise DescriptionError(f"{self.name}: armature {given}; expected no negative number")
        return replace(self, armature=given)

    def with_module(self, module: Any) -> Self:
        """The same robot with kernels that ``gac robot`` wrote for it.

        Parameters
        ----------
        module : module
            Each kernel takes the place of the method of its name. Its docstring has digests of the constants that they
            were made from.

        Raises
        ------
        DescriptionError
            Where the module was made from other constants than this robot has; the message says which.
        TypeError
            For what is no module with such kernels.
        """
        name = getattr(module, "__name__", repr(module))
        parts = folded.folded_parts(module)
        if not parts:
            raise TypeError(f"{self.name}: module {name}; expected one that gac robot wrote")
        robot = replace(self, module=module)
        other = sorted(folded.differences(robot) & parts)
        if other:
            raise DescriptionError(
                f"{self.name}: module {name} is another robot's, made from other {', '.join(other)}; expected its own "
                "kernels, as gac robot writes them"
            )
        return robot


def _finite(value: ArrayLike, name: str, shape: tuple[int, ...], meaning: str) -> Floats:
    array = np.array(finite(real_array(value, name, shape, meaning), name), float)
    if array.shape != shape:
        raise ValueError(f"{name}: shape {array.shape}; expected {shape}, {meaning}")
    return array


def _motor(value: ArrayLike, name: str) -> Floats:
    """A unit motor from a motor or a matrix."""
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
        raise DescriptionError(f"{name}: a matrix of no motion; expected a rotation, a translation, and 0, 0, 0, 1")
    return motor  # type: ignore[no-any-return]
