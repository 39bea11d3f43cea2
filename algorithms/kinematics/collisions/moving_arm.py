"""An arm and what it carries as capsules: their distances from obstacles and each other, and how fast they move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from generated import collisions, pga3

from ...arguments import Reals
from ...geometry.meshes import Integers
from ...precision import NEGLIGIBLE
from .. import Robot
from ..denavit_hartenberg import Joint
from .arm_capsules import ArmCapsules
from .obstacles import Obstacle

_STILL = np.eye(8)[0]

Bodies = Sequence[tuple[Obstacle, float]]
"""Obstacles, and the distance to keep from each."""


@dataclass(frozen=True, slots=True, eq=False)
class MovingArm:
    """Capsules that joints carry. Made by `moving_arm`."""

    robot: Robot
    carriers: Integers
    """(c,) The joint that carries each capsule; -1 for the base."""
    ends: Reals
    """(c, 2, 3) In the frames after the joints."""
    radii: Reals
    """(c,)"""
    pairs: Integers
    """(p, 2) Capsules that must not meet."""
    speeds: Reals
    """(c, n) Bounds of the displacement of each capsule for a change of each variable by 1."""
    pair_speeds: Reals
    """(p, n) The same for the distances of pairs."""

    def placed(self, q: Reals) -> Reals:
        """Return the ends (..., c, 2, 3) of the capsules in the base frame at joints (..., n)."""
        frames = self.robot.forward_all(q)
        still = np.broadcast_to(_STILL, (*frames.shape[:-2], 1, 8))
        motors = np.concatenate([frames, still], -2)[..., self.carriers, :]
        return pga3.move_point(motors[..., None, :], self.ends)

    def clearances(self, q: Reals, bodies: Bodies) -> Reals:
        """Return for joints (..., n) the clearances of the capsules beyond the distances to keep, and those of pairs.

        Returns
        -------
        array, (..., c + p)
        """
        ends = self.placed(q)
        moves = np.flatnonzero(self.carriers >= 0)
        found = np.full(ends.shape[:-2], np.inf)
        for one, least in bodies:
            each = one.clearance(np.ascontiguousarray(ends[..., moves, :, :]), self.radii[moves]) - least
            found[..., moves] = np.minimum(found[..., moves], each)
        a, b = self.pairs.T
        own = collisions.capsule_pair_clearance(
            ends[..., a, 0, :],
            ends[..., a, 1, :],
            ends[..., b, 0, :],
            ends[..., b, 1, :],
            self.radii[a] + self.radii[b],
        )
        return np.concatenate([found, own], -1)

    @property
    def all_speeds(self) -> Reals:
        """Bounds (c + p, n) of the changes of `clearances`."""
        return np.concatenate([self.speeds, self.pair_speeds])


def moving_arm(robot: Robot, arm: ArmCapsules, ends: Reals, radii: Reals, mount: Reals) -> MovingArm:
    """Return an arm that carries a body, such as a hand in a posture.

    Parameters
    ----------
    robot : Robot
    arm : ArmCapsules
    ends, radii : array, (h, 2, 3) and (h,)
        The capsules of the body, in its own frame.
    mount : array, (8,)
        The motor from the frame of the body to that of the end effector.
    """
    tool = pga3.motor_product(robot.tool, mount)
    held = pga3.move_point(tool, ends)
    count = len(arm.carriers)
    carriers = np.concatenate([arm.carriers, np.full(len(held), robot.tip)])
    at_home = np.concatenate([arm.ends, held])
    radii = np.concatenate([arm.radii, radii])
    homes = np.concatenate([robot.home, _STILL[None]])[carriers]
    local = pga3.move_point_back(homes[:, None], at_home)
    path = list(robot.path)
    order = np.array([path.index(k) if k >= 0 else -1 for k in carriers])
    reach = _reaches(robot, path, order, at_home)
    pairs = np.array(
        [pair for pair in combinations(range(len(carriers)), 2) if _can_meet(pair, order, at_home, arm, count)]
    ).reshape(-1, 2)
    a, b = pairs.T
    # Only the joints between two links change their distance.
    between = (np.arange(len(path)) > order[a][:, None]) & (np.arange(len(path)) <= order[b][:, None])
    variables = _variables(robot, path)
    return MovingArm(
        robot, carriers, local, radii, pairs, reach @ variables, np.where(between, reach[b], 0.0) @ variables
    )


def _variables(robot: Robot, path: list[int]) -> Reals:
    """Return how much each joint of the path changes with each variable, (joints, n)."""
    if robot.coupling.size:
        return np.abs(robot.coupling[path, :-1])
    return np.eye(len(robot.kinds))[path]


def _reaches(robot: Robot, path: list[int], order: Integers, ends: Reals) -> Reals:
    """Return bounds of the distances of the capsules' axes from the joint axes in all configurations, (c, joints).

    A point of an axis is fixed in both links that the joint connects. Hence the distance of a capsule from an axis is
    at most the length of a polygon through points of the axes between them.
    """
    found = np.zeros((len(ends), len(path)))
    for row, (last, (start, end)) in enumerate(zip(order, ends, strict=True)):
        points, length = np.stack([start, end]), np.zeros(2)
        for at in range(last, -1, -1):
            if robot.kinds[path[at]] is Joint.PRISMATIC:
                found[row, at] = 1.0
                # A slide displaces the axes that follow it: their distance grows with its variable.
                length = length + np.abs(robot.limits[at, :2]).max()
                continue
            feet = pga3.project_point_on_line(points, robot.axes[path[at]])
            length = length + np.linalg.norm(points - feet, axis=1)
            found[row, at] = length.max()
            points = feet
    return found


def _can_meet(pair: tuple[int, int], order: Integers, ends: Reals, arm: ArmCapsules, count: int) -> bool:
    a, b = pair
    if a >= count or pair in arm.apart or order[b] - order[a] <= 1:
        return False
    touching = collisions.capsule_pair_clearance(ends[a, 0], ends[a, 1], ends[b, 0], ends[b, 1], 0.0) < NEGLIGIBLE
    return not (b < count and touching)
