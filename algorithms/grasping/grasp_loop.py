"""From images of an object to a hand that holds it: pose, grasp, path of the arm (sections 20.5 and 20.6)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite, finite_number, real_array
from ..elements import MOTOR, elements
from ..evidence import Status
from ..kinematics import Robot
from ..kinematics.collisions.arm_capsules import ArmCapsules, default_capsules
from ..kinematics.collisions.obstacles import MeshObstacle, Obstacle, mesh_obstacle
from ..vision.objects.pose_estimation import PoseEstimate, estimate_pose
from ..vision.objects.pose_models import ObjectModel, SharedErrors, View
from ..vision.objects.pose_record import bound_of
from ..vision.objects.pose_status import PoseStatus
from ..vision.objects.scene import Scene
from .barrett import hand_of_table
from .closing import APPROACH
from .grasp_motion import PathStatus, Setting, grasp_motion
from .hands import Hand
from .planning import Grasp, GraspPlan
from .status import GraspStatus


class LoopStatus(Status):
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
    COLLISION = 6
    """The arm or the hand touches something now, or in each approach or closing motion within reach."""
    NO_PATH = 7
    """No path to an approach was found that is clear of obstacles, within the given number of trials."""


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
    """(k, n) Joints of the arm: first the given ones, then to the start of the approach, and along it to the grasp. One
    row if it does not move. The motion is linear between two rows, and no joint moves by more than 0.5 rad."""
    contacts: Reals
    """(c, 3) Where the fingers touch, in the world, by forward kinematics; NaN if the hand does not move."""
    approach_at: int
    """The row of `path` at which the straight approach begins; 0 if the hand does not move."""
    open_joints: Reals
    """(m,) The joints of the hand along the path. Then it closes: they change linearly to those of the grasp. Zeros if
    the hand does not move."""


@elements(mount=MOTOR, expected=MOTOR, start=MOTOR)
def guided_grasp(
    robot: Robot,
    q: ArrayLike,
    model: ObjectModel,
    views: Sequence[View],
    plans: GraspPlan | Sequence[Grasp],
    *,
    mount: ArrayLike | None = None,
    expected: ArrayLike | None = None,
    start: ArrayLike | None = None,
    noise: float = 0.3,
    shared: SharedErrors | None = None,
    accuracy: float = 1e-3,
    approach: float = APPROACH,
    obstacles: Sequence[Obstacle] = (),
    arm: ArmCapsules | None = None,
    hand: Hand | None = None,
    target: MeshObstacle | None = None,
    margin: float = 0.003,
    trials: int = 400,
    seed: int = 0,
) -> GuidedGrasp:
    """Find an object in images, choose a planned grasp, and compute a path of the arm that is clear of obstacles.

    The arm and the hand are capsules. Along the whole path and while the fingers close, they are clear of all obstacles
    and of each other, and do not intersect the object by more than 2 mm, not only at rows of the path but also between
    them.

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
    start : array_like, (8,), optional
        A pose near the true one, such as that of the preceding image, from which `estimate_pose` begins.
    noise : float
        The standard deviation of a pixel's coordinate.
    shared : SharedErrors, optional
        How well the cameras and the model are known, as in `estimate_pose`.
    accuracy : float
        The largest error of a contact, in metres, for which the hand moves: by the covariance of the pose, it is
        exceeded with a probability of one in a thousand. Grasps with larger errors are left out; if all are, the status
        is POSE_UNKNOWN, and that of the estimate is UNCERTAIN. For symmetric objects, these are errors of the place on
        the object, which its symmetries do not change.
    approach : float
        The hand arrives in its direction, `Hand.approach`, over this distance, in metres.
    obstacles : sequence of Obstacle
        Bodies in the world: `mesh_obstacle`, `plane_obstacle`, `capsule_obstacle`, or `scene_obstacles`. They do not
        affect the base of the arm, which is at rest.
    arm : ArmCapsules, optional
        By default, the table of a named robot, or capsules between its joint frames.
    hand : Hand, optional
        The hand of the plan by default, or the BH8-280.
    target : MeshObstacle, optional
        The surface of the object, in its own frame; that of the plan by default. Without any, the object is no
        obstacle.
    margin : float
        The least distance of the capsules from obstacles, in metres. The meshes of the BH8-280 are at most 3 mm outside
        its capsules.
    trials : int
        The largest number of random configurations in a search for a path; 0 permits straight paths only.
    seed : int
        Of the random configurations. The same arguments give the same path.

    Returns
    -------
    GuidedGrasp
        Unless the status is OK, the path is the current configuration alone.

    Raises
    ------
    TypeError, ValueError
        If shapes or types disagree, a number is negative, or the robot needs a table of capsules.
    """
    joints = finite(real_array(q, "q", (robot.n_joints,), "joint variables"), "q").astype(np.float64)
    on_hand = np.eye(8)[0] if mount is None else finite(real_array(mount, "mount", (8,), "a motor"), "mount")
    _check_numbers(approach, margin, trials, accuracy)
    hand = hand or (plans.hand if isinstance(plans, GraspPlan) else hand_of_table())
    estimate = _pose_of_object(model, tuple(views), start, expected, noise, shared)
    choice = _chosen(estimate, model, plans, accuracy)
    if not choice.grasps:
        return _still(choice.status, choice.estimate, choice.plan_status, joints, hand)
    if target is None and isinstance(plans, GraspPlan) and len(plans.faces):
        target = mesh_obstacle(plans.vertices, plans.faces)
    setting = Setting(
        robot,
        default_capsules(robot) if arm is None else arm,
        hand,
        on_hand.astype(np.float64),
        tuple(obstacles),
        None if target is None else target.moved(estimate.motor),
        margin,
    )
    found = grasp_motion(setting, joints, choice.grasps, estimate.motor, approach, int(trials), seed)
    if found.grasp is None:
        return _still(_REASONS[found.status], estimate, GraspStatus.OK, joints, hand)
    grasp, path = found.grasp, found.path
    reached = pga3.motor_product(robot.forward(path[-1]), on_hand)
    contacts = pga3.move_point(reached, pga3.move_point_back(grasp.motor, grasp.contacts))
    return GuidedGrasp(
        LoopStatus.OK, estimate, GraspStatus.OK, grasp, path, contacts, found.approach_at, found.open_joints
    )


def _check_numbers(approach: float, margin: float, trials: int, accuracy: float) -> None:
    for name, length in (("approach", approach), ("margin", margin)):
        if finite_number(length, name) < 0:
            raise ValueError(f"{name}: {length}; expected at least 0 metres")
    if isinstance(trials, bool) or not isinstance(trials, (int, np.integer)) or trials < 0:
        raise ValueError(f"trials: {trials!r}; expected an integer of at least 0")
    if not finite_number(accuracy, "accuracy") > 0:
        raise ValueError(f"accuracy: {accuracy}; expected a positive number of metres")


class _Choice(NamedTuple):
    """The grasps that may be tried; if there is none, the rest says why, as in `GuidedGrasp`."""

    grasps: list[Grasp]
    status: LoopStatus
    estimate: PoseEstimate
    plan_status: GraspStatus | None


def _chosen(estimate: PoseEstimate, model: ObjectModel, plans: Iterable[Grasp], accuracy: float) -> _Choice:
    """Choose the planned grasps whose contacts the pose of the object determines well enough."""
    if not estimate.is_found:
        return _Choice([], _CAUSES.get(estimate.status, LoopStatus.POSE_UNKNOWN), estimate, None)
    grasps = tuple(plans)
    planned = [grasp for grasp in grasps if grasp.status == GraspStatus.OK]
    if not planned:
        return _Choice([], LoopStatus.NO_GRASP, estimate, grasps[0].status if grasps else GraspStatus.NO_CONTACTS)
    exact = [grasp for grasp in planned if contact_bound(estimate, model, grasp) <= accuracy]
    if not exact:
        uncertain = replace(estimate, status=PoseStatus.UNCERTAIN)
        return _Choice([], LoopStatus.POSE_UNKNOWN, uncertain, GraspStatus.OK)
    return _Choice(exact, LoopStatus.OK, estimate, GraspStatus.OK)


def _pose_of_object(
    model: ObjectModel, views: tuple[View, ...], start: ArrayLike | None, expected: ArrayLike | None, noise: float,
    shared: SharedErrors | None,
) -> PoseEstimate:  # fmt: skip
    """Return the pose of an object, or why it is not found where it is expected."""
    found = estimate_pose(model, views, start, noise, _ANY, shared)
    if start is None and expected is not None and found.status in (PoseStatus.OCCLUDED, PoseStatus.TOO_FEW):
        return estimate_pose(model, views, expected, noise, _ANY, shared)
    return found


def contact_bound(estimate: PoseEstimate, model: ObjectModel, grasp: Grasp) -> float:
    """Return the error that no contact of a grasp exceeds, each with a probability of 0.999.

    Parameters
    ----------
    estimate : PoseEstimate
    model : ObjectModel
        That of the estimate.
    grasp : Grasp
        In the frame of the model.

    Returns
    -------
    float
        In metres, by the covariance of what images determine of the pose.
    """
    bounds = []
    for arm in grasp.contacts - model.centre:
        moved = np.concatenate([np.cross(np.eye(3), arm), np.eye(3)])
        bounds.append(bound_of(moved.T @ estimate.determined @ moved))
    return float(max(bounds))


_ANY = np.pi, 1e100
"""A tolerance of poses that does not limit them."""
_CAUSES = {
    PoseStatus.OCCLUDED: LoopStatus.OCCLUDED,
    PoseStatus.BEHIND_CAMERA: LoopStatus.BEHIND_CAMERA,
}


_REASONS = {
    PathStatus.OUT_OF_REACH: LoopStatus.OUT_OF_REACH,
    PathStatus.COLLISION: LoopStatus.COLLISION,
    PathStatus.NO_PATH: LoopStatus.NO_PATH,
}


def scene_obstacles(scene: Scene, without: str) -> tuple[MeshObstacle, ...]:
    """Return the meshes of all objects of a scene but one, at their poses, as obstacles.

    Parameters
    ----------
    scene : Scene
    without : str
        The name of the object that the hand is to hold. Objects without faces are no obstacles.

    Raises
    ------
    ValueError
        If there is no such object.
    """
    scene.object(without)
    others = (one for one in scene.objects if one.name != without and len(one.faces))
    return tuple(mesh_obstacle(one.vertices, one.faces, one.pose) for one in others)


def _still(status: LoopStatus, estimate: PoseEstimate, plan: GraspStatus | None, q: Reals, hand: Hand) -> GuidedGrasp:
    nowhere = np.full((hand.contacts, 3), np.nan)
    return GuidedGrasp(status, estimate, plan, None, q[None].copy(), nowhere, 0, np.zeros(len(hand.limits)))
