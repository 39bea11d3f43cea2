"""The motion of an arm to a planned grasp: transfer, straight approach, and the closing of the hand."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from generated import pga3

from .. import evidence
from ..arguments import Reals
from ..kinematics import Robot
from ..kinematics.collisions.arm_capsules import ArmCapsules
from ..kinematics.collisions.arm_paths import find_path, resampled
from ..kinematics.collisions.clear_motion import is_clear
from ..kinematics.collisions.moving_arm import Bodies, MovingArm, moving_arm
from ..kinematics.collisions.obstacles import MeshObstacle, Obstacle
from ..kinematics.denavit_hartenberg import Joint
from .closing import OPENINGS, closing_speeds, opened
from .hands import Hand
from .planning import Grasp

_STEPS = 25
"""Number of poses between the approach and the grasp."""
_LARGEST_STEP = 0.5
"""The largest change of a joint between two poses of the approach, in radians."""
_TRANSFER_STEP = 0.1
"""The largest change of a joint between two rows of the transfer, in radians."""
_TOUCH = -0.002
"""The least clearance from the object that is to be held, in metres: the skin of the hand yields."""


class PathStatus(evidence.Status):
    """Whether there is a motion to a grasp."""

    OK = 0
    OUT_OF_REACH = 1
    COLLISION = 2
    NO_PATH = 3


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """What moves, and what must not be touched."""

    robot: Robot
    arm: ArmCapsules
    hand: Hand
    mount: Reals
    obstacles: tuple[Obstacle, ...]
    target: MeshObstacle | None
    """The object that is to be held, in the world."""
    margin: float

    def bodies(self, of_target: float) -> Bodies:
        """Return all obstacles with the distances to keep from them."""
        others = tuple((one, self.margin) for one in self.obstacles)
        return others if self.target is None else (*others, (self.target, of_target))


@dataclass(frozen=True, slots=True, eq=False)
class GraspMotion:
    """Result of `grasp_motion`."""

    status: PathStatus
    grasp: Grasp | None = None
    path: Reals = field(default_factory=lambda: np.zeros((0, 0)))
    approach_at: int = 0
    open_joints: Reals = field(default_factory=lambda: np.zeros(0))
    """(m,) The joints of the open hand; empty without a grasp."""


@dataclass(frozen=True, slots=True, eq=False)
class _Candidate:
    grasp: Grasp
    start: Reals
    """(m,) The joints of the open hand."""
    mover: MovingArm
    approach: Reals
    """(k, n)"""
    free: Callable[[Reals], bool]
    """Whether a polygon of joints is free on the way to the approach."""


def grasp_motion(
    setting: Setting, q: Reals, grasps: Sequence[Grasp], pose: Reals, approach: float, trials: int, seed: int
) -> GraspMotion:
    """Find a motion to the first of some grasps that can be reached without collisions.

    Straight transfers to all approaches are tried before searches. All searches together use `trials`.

    Parameters
    ----------
    setting : Setting
    q : array, (n,)
        The current joints.
    grasps : sequence of Grasp
    pose : array, (8,)
        The motor from the frame of the object to the world.
    approach : float
        The length of the straight approach.
    trials, seed : int
        The largest number of random configurations, and their seed.
    """
    status = PathStatus.OUT_OF_REACH
    blocked: list[_Candidate] = []
    for grasp in grasps:
        hands = _straight(pga3.motor_product(pose, grasp.motor), approach * setting.hand.approach)
        branches = _branches(setting, q, hands[-1])
        if not len(branches):
            continue
        postures = list(_postures(setting, grasp, hands))
        if not postures:
            status = max(status, PathStatus.COLLISION)
            continue
        hand = setting.hand
        movers = [
            moving_arm(setting.robot, setting.arm, hand.placed_capsules(start), hand.radii, setting.mount)
            for start in postures
        ]
        for branch in _approaches(setting, branches, hands):
            status = max(status, PathStatus.COLLISION)
            for start, mover in zip(postures, movers, strict=True):
                one = _candidate(setting, grasp, start, mover, branch)
                if one is None or not one.free(q[None]) or _is_inside(setting, one.mover, q):
                    continue
                status = PathStatus.NO_PATH
                for turned in _turns(one.approach, setting.robot):
                    same = replace(one, approach=turned)
                    if one.free(np.stack([q, turned[0]])):
                        return _motion(same, np.stack([q, turned[0]]))
                    blocked.append(same)
                break
    limits = setting.robot.limits[:, :2]
    blocked.sort(key=lambda one: float(np.abs(one.approach[0] - q).max()))
    for k, one in enumerate(blocked):
        share = (trials * (k + 1)) // len(blocked) - (trials * k) // len(blocked)
        if share:
            path = find_path(q, one.approach[0], limits, one.free, share, seed)
            if path is not None:
                return _motion(one, path)
    return GraspMotion(status)


def _is_inside(setting: Setting, mover: MovingArm, q: Reals) -> bool:
    """Determine whether a capsule is inside a body, whose surface it may be far from."""
    points = mover.placed(q)[mover.carriers >= 0].reshape(-1, 3)
    return any(one.contains(points).any() for one, _ in setting.bodies(0.0))


def _turns(approach: Reals, robot: Robot) -> Iterator[Reals]:
    """Generate an approach, and the same one with one joint turned by a full turn, within the limits."""
    yield approach
    if robot.coupling.size:
        return
    for joint, kind in enumerate(robot.kinds):
        for turn in (-2 * np.pi, 2 * np.pi) if kind is Joint.REVOLUTE else ():
            moved = approach[:, joint] + turn
            if (moved >= robot.limits[joint, 0]).all() and (moved <= robot.limits[joint, 1]).all():
                found = approach.copy()
                found[:, joint] = moved
                yield found


def _motion(one: _Candidate, transfer: Reals) -> GraspMotion:
    rows = resampled(transfer, _TRANSFER_STEP)
    path = np.concatenate([rows, one.approach[1:]])
    return GraspMotion(PathStatus.OK, one.grasp, path, len(rows) - 1, one.start)


def _postures(setting: Setting, grasp: Grasp, hands: Reals) -> Iterator[Reals]:
    """Generate joints of the open hand that is clear on the straight approach, and from which it closes so as well.

    Poses of the approach are tested here, and the motion between them later, with the arm.
    """
    hand, speeds = setting.hand, closing_speeds(setting.hand)
    a, b = hand.pairs.T
    bounds = np.concatenate([speeds, speeds[a] + speeds[b]])
    bodies = setting.bodies(_TOUCH)

    def clearances(joints: Reals) -> Reals:
        placed = hand.placed_capsules(joints)
        ends = pga3.move_point(hands[-1], placed)
        found = np.full(ends.shape[:-2], np.inf)
        for one, least in bodies:
            found = np.minimum(found, one.clearance(ends, hand.radii) - least)
        return np.concatenate([found, hand.own_clearances(placed)], -1)

    starts = [grasp.open_joints, *(opened(hand, grasp.joints, by) for by in OPENINGS)]
    tried: list[Reals] = []
    for start in starts:
        if any(np.array_equal(start, other) for other in tried):
            continue
        tried.append(start)
        if not is_clear(np.stack([start, grasp.joints]), clearances, bounds):
            continue
        ends = pga3.move_point(hands[:, None, None], hand.placed_capsules(start))
        if all((one.clearance(ends, hand.radii) > least).all() for one, least in bodies):
            yield start


def _candidate(setting: Setting, grasp: Grasp, start: Reals, mover: MovingArm, approach: Reals) -> _Candidate | None:
    """Return an approach with an open hand if it is clear of obstacles."""
    bodies = setting.bodies(_TOUCH)
    if not is_clear(approach, lambda q: mover.clearances(q, bodies), mover.all_speeds):
        return None
    least = _TOUCH
    if setting.target is not None:
        # Farther from the object than the approach begins there is no reason to be nearer to it.
        ends = mover.placed(approach[0])[mover.carriers >= 0]
        nearest = float(setting.target.clearance(ends, mover.radii[mover.carriers >= 0]).min())
        least = max(_TOUCH, min(setting.margin, nearest - 1e-3))
    others = setting.bodies(least)
    return _Candidate(
        grasp,
        start,
        mover,
        approach,
        lambda path: is_clear(path, lambda q: mover.clearances(q, others), mover.all_speeds),
    )


def _straight(hand: Reals, approach: Reals) -> Reals:
    """Return poses (k, 8) along a vector in the frame of the hand up to a given one."""
    away = np.linspace(-1, 0, _STEPS)[:, None] * approach
    still = np.tile([1.0, 0, 0, 0], (_STEPS, 1))
    return pga3.motor_product(hand, pga3.motor_from_rotor_translation(still, away))  # type: ignore[no-any-return]


def _branches(setting: Setting, q: Reals, hand: Reals) -> Reals:
    """Return the joints (b, n) within the limits that put the hand at a pose, the nearest first."""
    solutions = setting.robot.inverse(pga3.motor_product(hand, pga3.motor_inverse(setting.mount)), near=q)
    found = solutions.q[solutions.within_limits]
    return found[np.argsort(np.abs(found - q).max(1), kind="stable")]


def _approaches(setting: Setting, branches: Reals, hands: Reals) -> Iterator[Reals]:
    """Generate joints (k, n) within the limits along poses of the hand, for each branch at the last one."""
    robot = setting.robot
    tools = pga3.motor_product(hands, pga3.motor_inverse(setting.mount))
    for branch in branches:
        # Backwards from the grasp, each pose has the branch nearest to the following one.
        path = [branch]
        for tool in tools[-2::-1]:
            found = robot.inverse(tool, near=path[-1])
            jump = np.abs(found.nearest - path[-1]).max()
            if not found.valid.any() or not jump <= _LARGEST_STEP:
                break
            if not ((found.nearest >= robot.limits[:, 0]) & (found.nearest <= robot.limits[:, 1])).all():
                break
            path.append(found.nearest)
        else:
            yield np.array(path[::-1])
