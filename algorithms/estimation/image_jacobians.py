"""Images of points, lines and planes in a camera on a robot, and their Jacobians."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3
from generated import tracking as kernels

from ..arguments import Reals, real_array
from ..kinematics import FloatingRobot, JointCountError, Robot
from ..kinematics.denavit_hartenberg import Joint
from ..precision import NEGLIGIBLE


@dataclass(frozen=True, slots=True, eq=False)
class Image:
    """The image of an element, and how it depends on the joints."""

    values: Reals
    """(..., k) The coordinates."""
    jacobian: Reals
    """(..., k, n) The derivatives of the coordinates with respect to the joint variables."""
    seen: Reals
    """(...) bool. Whether the element has an image; if not, numbers are finite but meaningless."""


class Chain(NamedTuple):
    """The joints from the base of a robot to its camera."""

    axes: Reals
    """(m, 6) Twists of the joints at unit speed, at home."""
    turns: Reals
    """(m,) 1 for revolute and 0 for prismatic joints."""
    camera: Reals
    """(8,) The motor from the frame of the camera to the base, at home."""
    path: tuple[int, ...]
    n_joints: int

    @property
    def is_whole(self) -> bool:
        """Whether all joints of the robot move the camera, in order."""
        return self.path == tuple(range(self.n_joints))

    @property
    def tables(self) -> dict[str, Any]:
        """The arguments of the kernels."""
        return {"axes": self.axes, "turns": self.turns, "camera": self.camera}

    def own(self, q: Reals) -> Reals:
        """Return the variables (..., m) of the joints of the chain."""
        return q if self.is_whole else np.ascontiguousarray(q[..., list(self.path)])

    def of_robot(self, values: Reals) -> Reals:
        """Return values (..., m) of the joints of the chain for all joints (..., n), 0 for others."""
        if self.is_whole:
            return values
        found = np.zeros((*values.shape[:-1], self.n_joints))
        found[..., list(self.path)] = values
        return found


def chain_of(robot: Robot, camera: ArrayLike | None = None) -> Chain:
    """Return the joints from the base of a robot to a camera on its end effector.

    Parameters
    ----------
    robot : Robot
        With a fixed base, and a variable for each joint.
    camera : array_like, (8,), optional
        The motor from the frame of the camera to that of the end effector. By default they coincide.

    Raises
    ------
    JointCountError
        If the base floats, or joints follow others.
    TypeError, ValueError
        If `camera` is not a unit motor.
    """
    if robot.coupling.size or isinstance(robot, FloatingRobot):
        raise JointCountError(f"{robot.name}: expected a fixed base and a variable for each joint")
    mount = np.eye(8)[0] if camera is None else real_array(camera, "camera", (8,), "a motor").astype(np.float64)
    if not np.abs(pga3.normalize_motor(mount) - mount).max() < NEGLIGIBLE:
        raise ValueError(f"camera {mount}; expected a unit motor of generated.pga3")
    path = list(robot.path)
    turns = np.array([float(robot.kinds[joint] is Joint.REVOLUTE) for joint in path])
    axes = robot.axes[path].copy()
    directions = pga3.line_to_direction_moment(axes)[0]
    slides = turns == 0
    axes[slides, :3], axes[slides, 3:] = 0.0, directions[slides]
    return Chain(axes, turns, pga3.motor_product(robot.tool, mount), tuple(path), robot.n_joints)


def image_of_point(
    robot: Robot, q: ArrayLike, point: ArrayLike, camera: ArrayLike | None = None, mirror: float = 0.0
) -> Image:
    """Return the image of a point and its Jacobian.

    The frame of the camera has z along the optical axis, x to the right and y down. The coordinates are x/z and y/z for
    a pinhole camera. In general they are ``x / (z + mirror r)`` and ``y / (z + mirror r)`` with the distance r: the
    unified model of cameras with mirrors, which for ``mirror=1`` is stereographic and has an image of every point but
    those directly behind the camera.

    Parameters
    ----------
    robot : Robot
    q : array_like, (..., n)
        Joint variables.
    point : array_like, (..., 3)
        In the base frame.
    camera : array_like, (8,), optional
        The motor from the frame of the camera to that of the end effector. By default they coincide.
    mirror : float, optional
        The parameter of the mirror, in [0, 1].

    Returns
    -------
    Image
        With two coordinates.

    Raises
    ------
    JointCountError, TypeError, ValueError
        If an argument has a different shape or type, or as in `chain_of`.
    """
    chain, variables = chain_of(robot, camera), _variables(robot, q)
    place = real_array(point, "point", (3,), "a point").astype(np.float64)
    return _image(chain, kernels.image_of_point(chain.own(variables), **chain.tables, point=place, mirror=mirror))


def image_of_line(robot: Robot, q: ArrayLike, line: ArrayLike, camera: ArrayLike | None = None) -> Image:
    """Return the image of a line and its Jacobian.

    The image is the line ``x cos(theta) + y sin(theta) = rho`` with coordinates theta, in (-pi, pi], and rho.

    Parameters
    ----------
    robot, q, camera
        As in `image_of_point`.
    line : array_like, (..., 6)
        A line of `generated.pga3` in the base frame.

    Returns
    -------
    Image
        With two coordinates. A line through the centre of the camera, or in its focal plane, is not seen.

    Raises
    ------
    JointCountError, TypeError, ValueError
        As in `image_of_point`.
    """
    chain, variables = chain_of(robot, camera), _variables(robot, q)
    element = real_array(line, "line", (6,), "a line").astype(np.float64)
    return _image(chain, kernels.image_of_line(chain.own(variables), **chain.tables, line=element))


def image_of_plane(robot: Robot, q: ArrayLike, plane: ArrayLike, camera: ArrayLike | None = None) -> Image:
    """Return the image of a plane, its inverse depth ``1/z = a x + b y + c``, and the Jacobian of (a, b, c).

    Parameters
    ----------
    robot, q, camera
        As in `image_of_point`.
    plane : array_like, (..., 4)
        A plane of `generated.pga3` in the base frame.

    Returns
    -------
    Image
        With three coordinates. A plane through the centre of the camera is not seen.

    Raises
    ------
    JointCountError, TypeError, ValueError
        As in `image_of_point`.
    """
    chain, variables = chain_of(robot, camera), _variables(robot, q)
    element = real_array(plane, "plane", (4,), "a plane").astype(np.float64)
    return _image(chain, kernels.image_of_plane(chain.own(variables), **chain.tables, plane=element))


def _variables(robot: Robot, q: ArrayLike) -> Reals:
    return real_array(q, f"{robot.name}: q", (robot.n_joints,), f"{robot.n_joints} joint variables").astype(np.float64)


def _image(chain: Chain, found: tuple[Reals, Reals, Reals]) -> Image:
    values, entries, seen = found
    return Image(np.asarray(values), chain.of_robot(np.swapaxes(entries, -1, -2)), np.asarray(seen) > 0)
