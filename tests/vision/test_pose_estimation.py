"""Poses of objects from points, edges and silhouettes, compared with the truth of simulated images and with numbers."""

import numpy as np
import pytest

from algorithms.vision.camera import Camera
from algorithms.vision.objects.pose_estimation import estimate_pose
from algorithms.vision.objects.pose_models import ObjectModel, View
from algorithms.vision.objects.pose_status import PoseStatus
from generated import pga3
from tests.support.object_views import BOX as CUBE
from tests.support.object_views import BOX_EDGES as EDGES
from tests.support.object_views import ball_silhouette, motor, view_of

NOISE = 0.3
WIDE = (0.1, 0.1)
"""A tolerance that every verified pose meets."""


def cameras(n=2):
    return [Camera.from_intrinsics(900.0, (320.0, 240.0), motor((0, 0, 0), (0.25 * k, 0, 0))) for k in range(n)]


def pose(rng):
    return motor(rng.normal(size=3), rng.uniform([-0.05, -0.05, 0.55], [0.1, 0.05, 0.75]))


def views_of_points(points, truth, rng, n=2, noise=NOISE):
    there = pga3.move_point(truth, points)
    return [View(c, points=c.project(there) + rng.normal(0, noise, (len(points), 2))) for c in cameras(n)]


def distance(found, truth, centre):
    """The rotation in degrees and the displacement of a point in millimetres between two poses."""
    turn = pga3.motor_to_matrix(pga3.motor_product(pga3.motor_inverse(truth), found))[:3, :3]
    angle = np.degrees(np.arcsin(min(1.0, np.linalg.norm(turn - np.eye(3)) / np.sqrt(8)))) * 2
    return angle, 1e3 * np.linalg.norm(pga3.move_point(found, centre) - pga3.move_point(truth, centre))


def can_views(model, truth, rng, n=2, noise=NOISE):
    return [view_of(model, truth, camera, rng, noise=noise) for camera in cameras(n)]


def test_points_and_edges_without_noise() -> None:
    rng = np.random.default_rng(1)
    model = ObjectModel.of(points=CUBE, edges=EDGES)
    for _ in range(20):
        truth = pose(rng)
        views = views_of_points(CUBE, truth, rng, noise=0)
        found = estimate_pose(model, views)
        assert found.status == PoseStatus.OK
        assert np.abs(pga3.motor_to_matrix(found.motor) - pga3.motor_to_matrix(truth)).max() < 1e-8


def test_errors_are_within_the_target_and_agree_with_the_covariance() -> None:
    rng = np.random.default_rng(2)
    model = ObjectModel.of(points=CUBE, edges=EDGES)
    errors, squares, uncertain = [], [], 0
    for _ in range(60):
        truth = pose(rng)
        views = views_of_points(CUBE, truth, rng)
        for k, camera in enumerate(cameras()):
            ends = pga3.move_point(truth, model.edges)
            t = np.linspace(0, 1, 20)[:, None]
            pixels = np.concatenate([camera.project(a + t * (b - a)) for a, b in ends])
            pixels += rng.normal(0, NOISE, pixels.shape)
            views[k] = View(camera, points=views[k].points, edges=(np.repeat(np.arange(len(ends)), 20), pixels))
        found = estimate_pose(model, views)
        # Noise looks like another camera in a twentieth of the data, whose bounds are larger.
        uncertain += found.status == PoseStatus.UNCERTAIN
        assert found.status in (PoseStatus.OK, PoseStatus.UNCERTAIN)
        errors.append(distance(found.motor, truth, model.centre))
        between = pga3.motor_logarithm(pga3.motor_product(pga3.motor_inverse(found.motor), truth))
        turn = -2 * np.array([between[2], -between[1], between[0]])
        shift = np.asarray(pga3.move_point(pga3.motor_exponential(between), model.centre)) - model.centre
        e = np.concatenate([turn, shift])
        squares.append(e @ np.linalg.solve(found.covariance, e))
    assert uncertain <= 3 and np.max(errors, 0)[0] < 0.2 and np.max(errors, 0)[1] < 0.5
    # A sum of 60 chi-square numbers of six degrees has the mean 360 and the standard deviation 27.
    assert 250 < np.sum(squares) < 495


def test_spheres_determine_a_pose_by_silhouettes() -> None:
    rng = np.random.default_rng(3)
    balls = np.array([[0, 0, 0, 0.03], [0.1, 0, 0, 0.02], [0, 0.08, 0.02, 0.025], [0.03, 0.03, 0.09, 0.015]])
    model = ObjectModel.of(spheres=balls)
    angles = np.linspace(0, 6.28, 60)
    for _ in range(10):
        truth = pose(rng)
        views = []
        for camera in cameras():
            parts = [ball_silhouette(camera, pga3.move_point(truth, b[:3]), b[3], angles) for b in balls]
            pixels = np.concatenate(parts) + rng.normal(0, NOISE, (240, 2))
            views.append(View(camera, balls=(np.repeat(np.arange(4), 60), pixels)))
        found = estimate_pose(model, views)
        assert found.status == PoseStatus.OK
        angle, shift = distance(found.motor, truth, model.centre)
        assert angle < 0.2 and shift < 0.5


def test_a_can_is_symmetric_and_its_axis_is_found() -> None:
    rng = np.random.default_rng(4)
    model = ObjectModel.of(cylinders=[[0, 0, -0.05, 0, 0, 0.05, 0.033]])
    for _ in range(5):
        truth = motor(rng.normal(size=3) * 0.3 + [1.2, 0, 0], (0.05, 0.02, 0.65))
        views = can_views(model, truth, rng)
        near = pga3.motor_product(truth, motor((0.02, -0.02, 0.2), (0.002, 0.003, -0.002)))
        for start in (near, None):
            found = estimate_pose(model, views, start)
            assert found.status == PoseStatus.SYMMETRIC and len(found.freedoms) == 1
            # The freedom is a turn about the axis z, e12, alone.
            assert np.abs(found.freedoms[0] / np.abs(found.freedoms[0]).max())[1:].max() < 1e-3
            ends = model.tubes[0, :6].reshape(2, 3)
            assert np.abs(pga3.move_point(found.motor, ends) - pga3.move_point(truth, ends)).max() < 5e-4


def test_one_sphere_has_three_freedoms() -> None:
    rng = np.random.default_rng(5)
    model = ObjectModel.of(spheres=[[0.0, 0, 0, 0.04]])
    truth = pose(rng)
    angles = np.linspace(0, 6.28, 60)
    views = [
        View(c, balls=(np.zeros(60, int), ball_silhouette(c, pga3.move_point(truth, np.zeros(3)), 0.04, angles)))
        for c in cameras()
    ]
    found = estimate_pose(model, views)
    assert found.status == PoseStatus.SYMMETRIC and len(found.freedoms) == 3
    assert np.abs(pga3.move_point(found.motor, np.zeros(3)) - pga3.move_point(truth, np.zeros(3))).max() < 1e-6


def test_wrong_pixels_are_rejected() -> None:
    rng = np.random.default_rng(6)
    points = rng.uniform(-0.08, 0.08, (30, 3))
    model = ObjectModel.of(points=points)
    for _ in range(10):
        truth = pose(rng)
        views = views_of_points(points, truth, rng)
        for view in views:
            view.points[:6] += rng.uniform(20, 80, (6, 2))
        found = estimate_pose(model, views, tolerance=WIDE)
        assert found.status == PoseStatus.OK
        assert not found.inliers["points"][:6].any() and found.inliers["points"][6:30].all()
        angle, shift = distance(found.motor, truth, model.centre)
        assert angle < 0.3 and shift < 0.5


def test_flips_of_flat_objects_are_reported_and_never_ok() -> None:
    rng = np.random.default_rng(7)
    model = ObjectModel.of(points=CUBE[CUBE[:, 2] > 0])
    statuses = []
    for _ in range(50):
        truth = motor(rng.normal(size=3) * 0.5, (0, 0, 2.5))
        found = estimate_pose(model, views_of_points(model.points, truth, rng, n=1), tolerance=(10.0, 10.0))
        statuses.append(found.status)
        if found.status == PoseStatus.OK:
            angle, shift = distance(found.motor, truth, model.centre)
            assert np.radians(angle) < 5 * found.deviations[0] and 1e-3 * shift < 5 * found.deviations[1]
        if found.status == PoseStatus.AMBIGUOUS:
            every = [found.motor, *found.alternatives]
            nearest = min(distance(m, truth, model.centre)[0] for m in every)
            assert np.radians(nearest) < 5 * found.deviations[0]
    assert PoseStatus.AMBIGUOUS in statuses


@pytest.mark.parametrize("case", ["occluded", "few", "behind", "infinite", "wrong"])
def test_statuses_name_the_cause(case: str) -> None:
    rng = np.random.default_rng(8)
    model = ObjectModel.of(points=CUBE)
    truth = pose(rng)
    view = views_of_points(CUBE, truth, rng, n=1)[0]
    start = None
    if case == "occluded":
        view.points[1:] = np.nan
    elif case == "few":
        model, view = ObjectModel.of(points=CUBE[:2]), View(view.camera, points=view.points[:2])
    elif case == "behind":
        view.points[:] = np.nan
        start = motor((0, 0, 0), (0, 0, -0.5))
    elif case == "infinite":
        view.points[2, 0] = np.inf
    else:
        view = View(view.camera, points=rng.uniform(0, 600, (8, 2)))
    found = estimate_pose(model, view, start)
    wanted = {
        "occluded": {PoseStatus.OCCLUDED}, "few": {PoseStatus.TOO_FEW}, "behind": {PoseStatus.BEHIND_CAMERA},
        "infinite": {PoseStatus.NOT_FINITE}, "wrong": {PoseStatus.INCONSISTENT, PoseStatus.NOT_CONVERGED},
    }  # fmt: skip
    assert found.status in wanted[case] and np.isnan(found.motor).all()


def test_a_given_start_tracks() -> None:
    rng = np.random.default_rng(9)
    model = ObjectModel.of(points=CUBE)
    truth = pose(rng)
    before = pga3.motor_product(truth, motor((0.1, -0.05, 0.1), (0.01, 0.01, -0.02)))
    found = estimate_pose(model, views_of_points(CUBE, truth, rng), start=before, tolerance=WIDE)
    assert found.status == PoseStatus.OK and distance(found.motor, truth, model.centre)[1] < 0.7


def test_wrong_arguments_are_refused() -> None:
    model = ObjectModel.of(points=CUBE)
    with pytest.raises(ValueError, match="expected"):
        estimate_pose(model, View(cameras()[0], points=np.zeros((3, 2))))
    with pytest.raises(ValueError, match="at least one View"):
        estimate_pose(model, ())
    with pytest.raises(ValueError, match="positive"):
        estimate_pose(model, View(cameras()[0], points=np.zeros((8, 2))), noise=0.0)
    with pytest.raises(ValueError, match="unit motor"):
        estimate_pose(model, View(cameras()[0], points=np.zeros((8, 2))), start=np.ones(8))
    with pytest.raises(ValueError, match="two positive numbers"):
        estimate_pose(model, View(cameras()[0], points=np.zeros((8, 2))), tolerance=(0.1, 0.0))
    with pytest.raises(ValueError, match="the pixels of one image"):
        estimate_pose(model, View(cameras()[0], points=np.zeros((2, 8, 2))))
    with pytest.raises(ValueError, match="no element"):
        ObjectModel.of()
    with pytest.raises(ValueError, match="radius"):
        ObjectModel.of(spheres=[[0, 0, 0, -1.0]])
