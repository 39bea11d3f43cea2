"""From images of an object to a hand that holds it: pose, grasp, reach (sections 20.5 and 20.6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite, finite_number, real_array
from ..kinematics import Robot, Status
from .planning import Grasp, GraspPlan
from .pose_estimation import PoseEstimate, estimate_pose
from .pose_models import ObjectModel, View
from .pose_status import PoseStatus
from .status import GraspStatus

_STEPS = 25
"""Number of poses between the approach and the grasp."""
_LARGEST_STEP = 0.5
"""The largest change of a joint between two poses of the path, in radians."""


class LoopStatus(IntEnum):
    """Whether an object was grasped, or why the hand did not move."""

    OK = 0
    OCCLUDED = 1
    """Too little of the object is seen."""
    BEHIND_CAMERA = 2
    """The object is behind a camera."""
    POSE_UNKNOWN = 3
    """Images do not determine the pose: see the status of the estimate."""
    NO_GRASP = 4
    """The planner found no grasp: see the status of the plan."""
    OUT_OF_REACH = 5
    """No planned grasp can be reached, together with its approach, within the limits of the joints."""


@dataclass(frozen=True, slots=True, eq=False)
class GuidedGrasp:
    """Result of `guided_grasp`."""

    status: LoopStatus
    estimate: PoseEstimate
    plan_status: GraspStatus | None
    """None if the pose was not found."""
    grasp: Grasp | None
    """The grasp that the robot reaches, in the frame of the object."""
    path: Reals
    """(k, n) Joints of the arm: first the given ones, then from the approach to the grasp. One row if it
    does not move."""
    contacts: Reals
    """(3, 3) Where the fingers touch, in the world, by forward kinematics; NaN if the hand does not move."""


def guided_grasp(
    robot: Robot,
    q: ArrayLike,
    model: ObjectModel,
    views: Sequence[View],
    plans: GraspPlan | Sequence[Grasp],
    *,
    mount: ArrayLike | None = None,
    expected: ArrayLike | None = None,
    noise: float = 0.3,
    approach: float = 0.08,
) -> GuidedGrasp:
    """Find an object in images, choose a planned grasp that the arm reaches, and compute its path.

    Parameters
    ----------
    robot : Robot
    q : array_like, (n,)
        The current joints.
    model : ObjectModel
    views : sequence of View
        Of calibrated cameras; `Scene.render` returns such views.
    plans : GraspPlan or sequence of Grasp
        Grasps of `plan_grasps` in the frame of the object, best first.
    mount : array_like, (8,), optional
        The motor from the frame of the hand to that of the end effector. By default they coincide.
    expected : array_like, (8,), optional
        A rough pose of the object, with which the status can name why it is not seen.
    noise : float
        The standard deviation of a pixel's coordinate.
    approach : float
        The hand arrives along its axis z over this distance, in metres.

    Returns
    -------
    GuidedGrasp
        Unless the status is OK, the path is the current configuration alone.

    Raises
    ------
    TypeError, ValueError
        If shapes or types disagree, or `approach` is negative.
    """
    joints = finite(real_array(q, "q", (robot.n_joints,), "joint variables"), "q").astype(np.float64)
    on_hand = np.eye(8)[0] if mount is None else finite(real_array(mount, "mount", (8,), "a motor"), "mount")
    if finite_number(approach, "approach") < 0:
        raise ValueError(f"approach: {approach}; expected at least 0 metres")
    estimate = estimate_pose(model, tuple(views), noise=noise)
    if estimate.status in (PoseStatus.OCCLUDED, PoseStatus.TOO_FEW) and expected is not None:
        estimate = estimate_pose(model, tuple(views), expected, noise)
    if not estimate.is_found:
        return _still(_CAUSES.get(estimate.status, LoopStatus.POSE_UNKNOWN), estimate, None, joints)
    grasps = tuple(plans)
    usable = [grasp for grasp in grasps if grasp.status == GraspStatus.OK]
    if not usable:
        cause = grasps[0].status if grasps else GraspStatus.NO_CONTACTS
        return _still(LoopStatus.NO_GRASP, estimate, cause, joints)
    for grasp in usable:
        hand = pga3.motor_product(estimate.motor, grasp.motor)
        path = _path(robot, joints, hand, on_hand, approach)
        if path is not None:
            reached = pga3.motor_product(robot.forward(path[-1]), on_hand)
            contacts = pga3.move_point(reached, pga3.move_point_back(grasp.motor, grasp.contacts))
            return GuidedGrasp(LoopStatus.OK, estimate, GraspStatus.OK, grasp, path, contacts)
    return _still(LoopStatus.OUT_OF_REACH, estimate, GraspStatus.OK, joints)


_CAUSES = {
    PoseStatus.OCCLUDED: LoopStatus.OCCLUDED,
    PoseStatus.BEHIND_CAMERA: LoopStatus.BEHIND_CAMERA,
}


def _path(robot: Robot, q: Reals, hand: Reals, mount: Reals, approach: float) -> Reals | None:
    """Return the joints now and along a straight approach to a pose of the hand; None if it leaves the reach."""
    away = np.linspace(-approach, 0, _STEPS)[:, None] * [0.0, 0.0, 1.0]
    still = np.tile([1.0, 0, 0, 0], (_STEPS, 1))
    hands = pga3.motor_product(hand, pga3.motor_from_rotor_translation(still, away))
    tools = pga3.motor_product(hands, pga3.motor_inverse(mount))
    solutions = robot.inverse(tools[-1], near=q)
    for branch in solutions.q[solutions.within_limits]:
        # Backwards from the grasp, each pose has the branch nearest to the following one.
        path = [branch]
        for tool in tools[-2::-1]:
            found = robot.inverse(tool, near=path[-1])
            jump = np.abs(found.nearest - path[-1]).max()
            if found.status not in (Status.FOUND, Status.SINGULAR) or not jump <= _LARGEST_STEP:
                break
            if not ((found.nearest >= robot.limits[:, 0]) & (found.nearest <= robot.limits[:, 1])).all():
                break
            path.append(found.nearest)
        else:
            return np.array([q, *path[::-1]])
    return None


def _still(status: LoopStatus, estimate: PoseEstimate, plan: GraspStatus | None, q: Reals) -> GuidedGrasp:
    return GuidedGrasp(status, estimate, plan, None, q[None].copy(), np.full((3, 3), np.nan))
