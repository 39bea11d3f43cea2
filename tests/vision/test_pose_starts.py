"""Initial poses in closed form: places and axes from exact silhouettes, and poses that few starts would miss."""

import numpy as np
import pytest

from algorithms.vision.camera import Camera
from algorithms.vision.objects.pose_estimation import estimate_pose
from algorithms.vision.objects.pose_features import ball_of_rays, circle_of_rays, tube_of_rays
from algorithms.vision.objects.pose_judgement import judged
from algorithms.vision.objects.pose_minima import Minima, PoseTask
from algorithms.vision.objects.pose_models import ObjectModel, View, measurements
from algorithms.vision.objects.pose_starts import quick_starts
from algorithms.vision.objects.pose_status import PoseStatus
from generated import pga3
from tests.support.object_views import (
    ball_silhouette,
    motor,
    random_cameras,
    random_model,
    rim_image,
    tube_silhouette,
    view_of,
)

CAMERA = Camera.from_intrinsics(900.0, (320.0, 240.0))
ANGLES, ALONG = np.linspace(0, 6.2, 40), np.linspace(0, 1, 30)


def rays(pixels):
    found = np.column_stack([(pixels - [320, 240]) / 900, np.ones(len(pixels))])
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def test_a_sphere_is_found_from_its_silhouette() -> None:
    centre = np.array([0.1, -0.05, 0.7])
    found = ball_of_rays(rays(ball_silhouette(CAMERA, centre, 0.03, ANGLES)), 0.03)
    assert np.abs(found - centre).max() < 1e-9
    # A part of the silhouette, a fifth of whose pixels are wrong, is still enough for a start.
    pixels = ball_silhouette(CAMERA, centre, 0.03, ANGLES[:25])
    pixels[::5] += [20, -30]
    assert np.abs(ball_of_rays(rays(pixels), 0.03) - centre).max() < 0.01


def test_the_axis_of_a_cylinder_is_found_from_its_sides() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        middle, axis = np.array([0.05, 0.02, 0.7]), rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        ends = np.array([middle - 0.06 * axis, middle + 0.06 * axis])
        sides = tube_silhouette(CAMERA, ends, 0.025, ALONG)
        if sides is None:
            continue
        direction, place = tube_of_rays(rays(sides), 0.025)
        assert abs(abs(direction @ axis) - 1) < 1e-9
        off = place - middle
        assert np.abs(off - (off @ axis) * axis).max() < 1e-7
    assert tube_of_rays(rays(sides[:30]), 0.025) is None


def test_one_of_two_circles_of_an_ellipse_is_the_true_one() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        centre = np.array([-0.05, 0.08, 0.8])
        if abs(normal @ centre) < 0.1:
            continue
        pixels = rim_image(CAMERA, np.array([*centre, *normal, 0.04]), ANGLES)
        places, normals = circle_of_rays(rays(pixels), 0.04)
        off = np.abs(places - centre).max(1) + 1 - np.abs(normals @ normal)
        assert off.min() < 1e-6


@pytest.mark.parametrize(("count", "thickness"), [(12, 1.0), (12, 0.0), (5, 1.0), (4, 0.0)])
def test_exact_points_determine_a_start_by_linear_equations_or_triples(count: int, thickness: float) -> None:
    rng = np.random.default_rng(2)
    points = rng.uniform(-0.1, 0.1, (count, 3)) * [1, 1, thickness] + [0.3, 0.1, -0.2]
    camera = Camera.from_intrinsics((900.0, 950.0), (320.0, 240.0), motor((0.2, 0.1, 0.4), (0.5, 0.2, 0.1)), skew=2.0)
    truth = pga3.motor_product(camera.pose, motor((0.4, -0.7, 0.2), (0.5, 0.2, 3.0)))
    view = View(camera, points=camera.project(pga3.move_point(truth, points)))
    found = quick_starts(measurements(ObjectModel.of(points=points), (view,)))
    off = [np.abs(pga3.motor_to_matrix(m) - pga3.motor_to_matrix(truth)).max() for m in found]
    assert min(off) < 1e-6
    # Fewer than four points, also of two cameras together, give no start by themselves.
    assert quick_starts(measurements(ObjectModel.of(points=points[:3]), (View(camera, view.points[:3]),) * 2)) is None


def test_a_minimum_behind_the_camera_does_not_hide_the_pose() -> None:
    model = ObjectModel.of(points=np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0.5, 0.2, 0]]) * 0.1)
    whole = np.asarray(pga3.motor_to_matrix(motor((0.3, 0.7, 0.1), (0.0, 0.05, 0.7))))
    # The mirror image of a plane in the centre of the camera has the same pixels: R p + t = -(R' p - t) for p in it.
    mirrored = whole * [-1, -1, 1, 1]
    mirrored[:3, 3] = -whole[:3, 3]
    truth, behind = (np.asarray(pga3.motor_from_matrix(each)) for each in (whole, mirrored))
    view = View(CAMERA, points=CAMERA.project(pga3.move_point(truth, model.points)))
    task = PoseTask(model, measurements(model, (view,)), 0.3, (1.0, 1.0))
    found = judged(Minima(np.array([behind, truth]), np.array([0.0, 1e-6])), task)
    assert found.status == PoseStatus.OK
    assert np.abs(pga3.motor_to_matrix(found.motor) - whole).max() < 1e-6


def test_a_wrong_start_does_not_prevent_the_pose() -> None:
    rng = np.random.default_rng(3)
    model = random_model("20 points", rng)
    truth = motor((0.2, 0.4, -0.3), (0.1, 0.2, 0.3))
    views = [view_of(model, truth, c, rng) for c in random_cameras(rng, np.array([0.1, 0.2, 0.3]), 2)]
    found = estimate_pose(model, views, start=motor((3.0, 0, 0), (-2.0, 0.5, 4.0)), tolerance=(0.1, 0.1))
    assert found.status == PoseStatus.OK
    assert np.abs(pga3.motor_to_matrix(found.motor) - pga3.motor_to_matrix(truth)).max() < 0.01


def check_without_start(kind: str, count: int) -> None:
    allowed = {PoseStatus.OK, PoseStatus.SYMMETRIC}
    statuses = []
    for seed in range(count):
        rng = np.random.default_rng([5, seed])
        model = random_model(kind, rng)
        truth = motor(1.2 * rng.normal(size=3), rng.uniform(-1, 1, 3))
        n_views = int(rng.integers(1, 4))
        cameras = random_cameras(rng, pga3.move_point(truth, model.centre), n_views)
        found = estimate_pose(model, [view_of(model, truth, c, rng) for c in cameras], tolerance=(1.0, 1.0))
        statuses.append(found.status)
        if found.status in allowed:
            places = np.concatenate([model.points, model.balls[:, :3], model.tubes[:, :6].reshape(-1, 3)])
            off = pga3.move_point(found.motor, places) - pga3.move_point(truth, places)
            assert np.linalg.norm(off, axis=1).max() < (0.02 if n_views == 1 else 0.003)
        else:
            # One image of an object with few features may have two poses.
            assert found.status == PoseStatus.AMBIGUOUS and n_views == 1
    assert statuses.count(PoseStatus.AMBIGUOUS) <= count // 50


@pytest.mark.parametrize("kind", ["can", "spheres", "mixed"])
def test_silhouettes_need_no_start(kind: str) -> None:
    check_without_start(kind, 5)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["can", "spheres", "mixed"])
def test_silhouettes_need_no_start_often(kind: str) -> None:
    check_without_start(kind, 100)


def test_points_and_silhouettes_of_a_float32_list_are_accepted() -> None:
    rng = np.random.default_rng(4)
    model = ObjectModel.of(points=rng.uniform(-0.05, 0.05, (8, 3)).tolist())
    truth = motor((0.1, 0.2, 0.3), (0.0, 0.0, 0.7))
    pixels = CAMERA.project(pga3.move_point(truth, model.points)).astype(np.float32)
    pixels.flags.writeable = False
    found = estimate_pose(model, View(CAMERA, points=pixels), tolerance=(1.0, 1.0))
    assert found.status == PoseStatus.OK
    assert np.abs(pga3.motor_to_matrix(found.motor) - pga3.motor_to_matrix(truth)).max() < 1e-4
