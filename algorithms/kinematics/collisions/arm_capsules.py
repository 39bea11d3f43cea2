"""Capsules that cover the links of an arm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generated import pga3

from ...arguments import Reals, finite_number
from ...geometry.meshes import Integers
from ...precision import NEGLIGIBLE
from .. import Robot

_RADIUS = 0.06
"""The radius of links without geometry, in metres, by default."""


@dataclass(frozen=True, slots=True, eq=False)
class ArmCapsules:
    """Capsules that cover the links of an arm in its home configuration, where all joint variables are 0.

    `arm_capsules` makes them from the joints of a robot. `UR5_CAPSULES` is a table.
    """

    carriers: Integers
    """(c,) The joint that carries each capsule, counted from 0; -1 for the base."""
    ends: Reals
    """(c, 2, 3) The ends of the axes at home, in the base frame, in metres."""
    radii: Reals
    """(c,)"""
    apart: tuple[tuple[int, int], ...] = ()
    """Pairs of capsules that cannot meet in any configuration, and are not tested."""

    def __post_init__(self) -> None:
        count = len(self.carriers)
        shapes = self.carriers.shape, self.ends.shape, self.radii.shape
        if shapes != ((count,), (count, 2, 3), (count,)):
            raise ValueError(f"ArmCapsules: shapes {shapes}; expected (c,), (c, 2, 3) and (c,)")
        if not (np.isfinite(self.ends).all() and np.isfinite(self.radii).all() and (self.radii > 0).all()):
            raise ValueError("ArmCapsules: expected finite ends and positive radii")


def _ur5() -> ArmCapsules:
    z, low = 0.089459, 0.089459 - 0.09465
    # The shoulder and the elbow displace the upper arm and the forearm along y; the table of the robot has only the
    # difference, 0.10915 = 0.13585 - 0.1197 + 0.093.
    shoulder, forearm, wrist, tip = -0.13585, -0.01615, -0.10915, -0.10915 - 0.0823
    rows = (
        (-1, (0, 0, 0), (0, 0, z), 0.075),
        (0, (0, 0, z), (0, shoulder, z), 0.065),
        (1, (0, shoulder, z), (-0.425, shoulder, z), 0.06),
        (2, (-0.425, shoulder, z), (-0.425, forearm, z), 0.06),
        (2, (-0.425, forearm, z), (-0.81725, forearm, z), 0.045),
        (3, (-0.81725, forearm, z), (-0.81725, wrist, z), 0.045),
        (4, (-0.81725, wrist, z), (-0.81725, wrist, low), 0.045),
        (5, (-0.81725, wrist, low), (-0.81725, tip, low), 0.04),
    )
    return ArmCapsules(
        np.array([row[0] for row in rows]), np.array([row[1:3] for row in rows], float),
        np.array([row[3] for row in rows]), ((0, 2), (4, 6), (5, 7)),
    )  # fmt: skip


UR5_CAPSULES = _ur5()
"""The links of the UR5. Lengths are those of the maker; radii are ours, chosen to cover the drawings of its data
sheet."""


def arm_capsules(robot: Robot, radius: float = _RADIUS) -> ArmCapsules:
    """Return capsules between consecutive joint frames of a robot.

    The ends of the axes are the base, the origins of the frames after the joints, and the end effector, all at home.
    Links of length 0 have no capsule.

    Parameters
    ----------
    robot : Robot
        The origin of each frame is on the axis of its joint, as in URDF files and modified Denavit-Hartenberg tables,
        or on that of the following joint, as in standard ones.
    radius : float
        The radius of all capsules, in metres.

    Raises
    ------
    TypeError, ValueError
        If `radius` is not a positive number, no link has a length, or origins are not on axes. Then use a table.
    """
    if not finite_number(radius, "arm_capsules: radius") > 0:
        raise ValueError(f"arm_capsules: radius: {radius}; expected a positive number")
    path = list(robot.path)
    origins = pga3.move_point(robot.home[path], np.zeros(3))
    tool = pga3.move_point(robot.tool, np.zeros(3))
    axes = robot.axes[path]
    # The part of the first link along the first axis is at rest.
    foot = pga3.project_point_on_line(origins[0], axes[0])[None]
    points = np.concatenate([np.zeros((1, 3)), foot, origins, tool[None]])
    if (pga3.distance_point_line(origins, axes) < NEGLIGIBLE).all():
        carriers = [-1, path[0], *path]
    elif (pga3.distance_point_line(origins[:-1], axes[1:]) < NEGLIGIBLE).all():
        carriers = [-1, *path, path[-1]]
    else:
        raise ValueError(f"arm_capsules: {robot.name}: frames are not on joint axes; expected a table, ArmCapsules")
    kept = [k for k in range(len(carriers)) if np.linalg.norm(points[k + 1] - points[k]) > NEGLIGIBLE]
    if not kept:
        raise ValueError(f"arm_capsules: {robot.name}: all joint frames coincide; expected links with a length")
    return ArmCapsules(
        np.array([carriers[k] for k in kept]), np.array([[points[k], points[k + 1]] for k in kept]),
        np.full(len(kept), float(radius)),
    )  # fmt: skip


def default_capsules(robot: Robot) -> ArmCapsules:
    """Return the table of a named robot, or capsules between its joint frames."""
    return UR5_CAPSULES if robot.name == "ur5" else arm_capsules(robot)
