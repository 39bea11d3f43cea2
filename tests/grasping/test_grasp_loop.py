"""The loop from rendered images to a reached grasp, compared with the true pose of the object."""

from dataclasses import replace

import numpy as np
import pytest

from algorithms.grasping import GraspStatus, plan_grasps
from algorithms.grasping.grasp_loop import LoopStatus, contact_bound, guided_grasp
from algorithms.vision.objects import PoseStatus
from algorithms.vision.objects.pose_estimation import estimate_pose
from algorithms.vision.objects.pose_models import ObjectModel
from algorithms.vision.objects.scene import Scene, SceneObject, simulate
from generated import pga3
from tests.support.grasp_scene import FACES, HOME, MODEL, MOUNT, TARGET, VERTICES, motor, pose, scene
from tests.support.scans import box


@pytest.fixture(scope="module")
def plans():
    return plan_grasps(VERTICES, FACES, style=1)


def loop(built, plans, noise=0.3, seed=0, **more):
    views = built.render("box", noise, seed)
    return guided_grasp(built.robot, HOME, MODEL, views, plans, mount=MOUNT, **more)


@pytest.mark.parametrize("distortion", [0.0, -0.2])
def test_contacts_are_within_a_millimetre(plans, distortion: float) -> None:
    rng = np.random.default_rng(0)
    reached = 0
    for k in range(4):
        truth = pose(rng)
        found = loop(scene(truth, distortion=distortion), plans, seed=k)
        if found.status == LoopStatus.OUT_OF_REACH:
            continue
        assert found.status == LoopStatus.OK and found.estimate.status == PoseStatus.OK
        assert np.linalg.norm(found.contacts - pga3.move_point(truth, found.grasp.contacts), axis=1).max() < 1e-3
        reached += 1
        # The path begins at the current joints, is continuous from the approach on, and keeps to the limits.
        robot = scene(truth).robot
        assert (found.path[0] == HOME).all() and np.abs(np.diff(found.path[1:], axis=0)).max() < 0.5
        assert (found.path >= robot.limits[:, 0]).all() and (found.path <= robot.limits[:, 1]).all()
        # At the end, the hand is where the plan places it on the object, and 8 cm above it where the approach begins.
        hands = pga3.motor_product(robot.forward(found.path[found.approach_at :]), MOUNT)
        wanted = pga3.move_point(pga3.motor_product(truth, found.grasp.motor), np.array([[0, 0, -0.08], [0, 0, 0]]))
        assert np.linalg.norm(pga3.move_point(hands[[0, -1]], np.zeros(3)) - wanted, axis=1).max() < 1e-3
    assert reached >= 3


def test_one_camera_is_enough_for_an_accuracy_that_is_passed(plans) -> None:
    rng = np.random.default_rng(0)
    for seed in range(3):
        truth = pose(rng)
        built = scene(truth)
        views = built.render("box", 0.3, seed)[:1]
        unknown = guided_grasp(built.robot, HOME, MODEL, views, plans, mount=MOUNT)
        # The bound of Cramer and Rao for one image of this box is larger than a millimetre.
        assert unknown.status == LoopStatus.POSE_UNKNOWN and stays(unknown)
        assert unknown.estimate.status == PoseStatus.UNCERTAIN and unknown.estimate.bounds[1] > 0.7e-3
        found = guided_grasp(built.robot, HOME, MODEL, views, plans, mount=MOUNT, start=truth, accuracy=3e-3)
        assert found.status == LoopStatus.OK
        bound = contact_bound(found.estimate, MODEL, found.grasp)
        off = np.linalg.norm(found.contacts - pga3.move_point(truth, found.grasp.contacts), axis=1).max()
        assert off <= bound <= 3e-3


def test_bounds_of_contacts_are_those_of_random_poses(plans) -> None:
    built = scene(motor((0.2, 0.3, 0.5), TARGET))
    estimate = estimate_pose(MODEL, built.render("box", 0.3, 1), tolerance=(1.0, 1.0))
    rng, contact = np.random.default_rng(2), plans[0].contacts[0]
    errors = rng.multivariate_normal(np.zeros(6), estimate.covariance, 200_000)
    off = np.linalg.norm(np.cross(errors[:, :3], contact - MODEL.centre) + errors[:, 3:], axis=1)
    one = replace(plans[0], contacts=np.tile(contact, (3, 1)))
    assert abs(contact_bound(estimate, MODEL, one) / np.quantile(off, 0.999) - 1) < 0.04


def test_the_pose_is_refined_from_the_start(plans) -> None:
    # The rotation of a ball is that of the start, since no image changes it.
    ball, truth = ObjectModel.of(spheres=[[0, 0, 0, 0.04]]), motor((0.2, 0.3, 0.5), TARGET)
    built = scene(truth)
    views = Scene(built.cameras, (SceneObject("ball", ball, truth),)).render("ball", 0.3, 3)
    for turn in ((0.2, 0.3, 0.5), (-0.9, 0.4, 0.1)):
        start = motor(turn, TARGET + 0.003)
        found = guided_grasp(built.robot, HOME, ball, views, plans, mount=MOUNT, start=start).estimate
        between = pga3.motor_to_matrix(pga3.motor_product(pga3.motor_inverse(start), found.motor))
        assert found.status == PoseStatus.SYMMETRIC and np.abs(between[:3, :3] - np.eye(3)).max() < 1e-3
        assert np.abs(pga3.move_point(found.motor, np.zeros(3)) - TARGET).max() < 1e-3


def test_the_accuracy_holds_for_symmetric_objects(plans) -> None:
    # A ball is seen by its size alone: an error of 0.1 pixels of its radius is millimetres of its distance.
    ball, truth = ObjectModel.of(spheres=[[0, 0, 0, 0.04]]), motor((0, 0, 0), TARGET)
    built = scene(truth)
    objects = (SceneObject("ball", ball, truth),)
    for cameras, status in ((built.cameras[:1], LoopStatus.POSE_UNKNOWN), (built.cameras, LoopStatus.OK)):
        views = Scene(cameras, objects).render("ball", 0.3, 4)
        found = guided_grasp(built.robot, HOME, ball, views, plans, mount=MOUNT)
        assert found.status == status
        off = estimate_pose(ball, views, tolerance=(9.0, 9.0))
        assert off.status == PoseStatus.SYMMETRIC and np.isinf(off.bounds[0]) and np.isfinite(off.determined).all()
        assert estimate_pose(ball, views, tolerance=(9.0, 1e-6)).status == PoseStatus.UNCERTAIN


def test_wrong_starts_and_accuracies_are_refused(plans) -> None:
    built = scene(motor((0, 0, 0), TARGET))
    for accuracy, message in ((0.0, "positive"), (np.nan, "finite"), (-1.0, "positive")):
        with pytest.raises(ValueError, match=f"accuracy.*{message}"):
            loop(built, plans, accuracy=accuracy)
    for start in (np.zeros(8), 2 * motor((0, 0, 0), TARGET), np.zeros(7)):
        with pytest.raises(ValueError, match="start"):
            loop(built, plans, start=start)


def test_without_noise_contacts_are_exact(plans) -> None:
    truth = pose(np.random.default_rng(1))
    found = loop(scene(truth), plans, noise=0.0)
    assert found.status == LoopStatus.OK
    assert np.abs(found.contacts - pga3.move_point(truth, found.grasp.contacts)).max() < 1e-6


def stays(found) -> bool:
    return (found.path == HOME).all() and len(found.path) == 1 and np.isnan(found.contacts).all()


def test_an_object_out_of_reach(plans) -> None:
    # A smaller arm is the same as a farther object: cameras follow it.
    built = scene(motor((0, 0, 0), TARGET))
    far = motor((0, 0, 0), (-1.6, 0, 0))
    views = built.render("box", 0.3)
    moved = [type(v)(type(v.camera)(v.camera.intrinsics, pga3.motor_product(far, v.camera.pose)), v.points, v.edges)
             for v in views]  # fmt: skip
    found = guided_grasp(built.robot, HOME, MODEL, moved, plans, mount=MOUNT)
    assert found.status == LoopStatus.OUT_OF_REACH and found.estimate.status == PoseStatus.OK and stays(found)


def test_a_hidden_object(plans) -> None:
    vertices, faces = box(0.6, 0.8, 0.02)
    truth = motor((0, 0, 0), TARGET)
    wall = SceneObject("wall", MODEL, motor((0, 0.8, 0), TARGET + np.array([0.2, 0.02, 0.15])), vertices, faces)
    built = scene(truth, [wall])
    found = loop(built, plans)
    assert found.status == LoopStatus.OCCLUDED and stays(found)
    assert found.estimate.status == PoseStatus.OCCLUDED


def test_an_object_behind_the_cameras(plans) -> None:
    truth = motor((0, 0, 0), (1.8, 0.2, 1.0))
    found = loop(scene(truth), plans, expected=truth)
    assert found.status == LoopStatus.BEHIND_CAMERA and stays(found)


def test_an_object_too_thin_to_hold() -> None:
    plans = plan_grasps(*box(0.05, 0.07, 0.0005))
    assert plans.status != GraspStatus.OK
    found = loop(scene(motor((0, 0, 0), TARGET)), plans)
    assert found.status == LoopStatus.NO_GRASP and found.plan_status == plans.status and stays(found)


def test_points_behind_the_object_are_hidden() -> None:
    built = scene(motor((0, 0, 0), TARGET))
    shown = built.shows(0, pga3.move_point(built.object("box").pose, MODEL.points))
    # Seven corners of a box at most are visible from outside.
    assert 4 <= shown.sum() <= 7


def test_a_mounted_camera_moves_with_the_robot_and_finds_the_same_pose() -> None:
    truth = motor((0.2, 0.1, 0.3), TARGET)
    built = scene(truth)
    tool = built.robot.forward(HOME)
    fixed = built.cameras[0]
    own = pga3.motor_product(pga3.motor_inverse(tool), fixed.camera.pose)
    camera = type(fixed.camera)(fixed.camera.intrinsics, own)
    mounted = type(built)(
        (type(fixed)(camera, is_mounted=True),), built.objects, built.robot, HOME,
    )  # fmt: skip
    assert np.allclose(mounted.camera(0).pose, fixed.camera.pose, atol=1e-12)
    moved = mounted.with_joints(HOME + 0.05 * np.eye(6)[0])
    assert not np.allclose(moved.camera(0).pose, fixed.camera.pose, atol=1e-3)
    for one in (mounted, moved):
        found = estimate_pose(MODEL, one.render("box"))
        assert found.status == PoseStatus.OK
        assert np.abs(pga3.motor_to_matrix(found.motor) - pga3.motor_to_matrix(truth)).max() < 1e-6


def test_closed_loop_with_delay_reaches_the_goal_later() -> None:
    built = scene(motor((0, 0, 0), TARGET))
    goal = HOME + 0.1

    def control(views, q):
        assert len(views) == 2
        return 5 * (goal - q)

    ends = {delay: [one.q for one in simulate(built, "box", control, 8, delay=delay)] for delay in (0, 3)}
    gaps = {delay: np.abs(np.array(q) - goal).max(1) for delay, q in ends.items()}
    # A step leaves the part 1 - 5 * 0.04 of the gap.
    assert np.allclose(gaps[0], 0.1 * 0.8 ** np.arange(1, 9))
    assert np.allclose(gaps[3][:3], 0.1) and np.allclose(gaps[3][3:], 0.1 * 0.8 ** np.arange(1, 6))


def test_wrong_arguments_are_refused() -> None:
    built = scene(motor((0, 0, 0), TARGET))
    with pytest.raises(ValueError, match="expected one of"):
        built.object("cup")
    with pytest.raises(ValueError, match="noise"):
        built.render("box", -1.0)
    with pytest.raises(ValueError, match="delay"):
        next(simulate(built, "box", lambda views, q: q, 2, delay=-1))
