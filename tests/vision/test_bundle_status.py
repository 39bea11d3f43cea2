"""Bundle adjustment of what does not determine cameras or points, inputs of all kinds, and errors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bundle_scenes import BundleScene, bundle_scene, disturbed

from algorithms.vision import BundleAdjustment, BundleStep, Camera, Observations, VisionStatus, bundle_adjust
from generated import pga3
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]


def ours(scene: BundleScene, start: tuple[list[Camera], Array], **options: Any) -> BundleAdjustment:
    return bundle_adjust(start[0], start[1], scene.table, **options)


def statuses(scene: BundleScene, keep: Array, **options: Any) -> BundleAdjustment:
    table = scene.table
    part = Observations(table.camera[keep], table.point[keep], table.pixels[keep])
    return bundle_adjust(scene.cameras, scene.points, part, **options)


def test_points_seen_once_and_cameras_with_few_points() -> None:
    scene = bundle_scene(5, 30, seed=19, share=1.0)
    camera, point = scene.table.camera, scene.table.point
    found = statuses(scene, ((point != 7) | (camera == 2)) & ((camera != 4) | (point < 2)))
    assert found.status == VisionStatus.TOO_FEW
    assert found.camera_status.tolist() == [0, 0, 0, 0, VisionStatus.TOO_FEW]
    assert found.point_status[7] == VisionStatus.TOO_FEW and (np.delete(found.point_status, 7) == 0).all()
    assert np.array_equal(found.points[7], scene.points[7])
    assert np.isnan(found.camera_covariance[4]).all() and np.isfinite(found.camera_covariance[:4]).all()


def test_a_camera_that_only_sees_points_of_one_other() -> None:
    """Leaving out a camera leaves points with one observation, which are left out in turn."""
    scene = bundle_scene(4, 20, seed=20, share=1.0)
    camera, point = scene.table.camera, scene.table.point
    found = statuses(scene, np.where(camera == 3, point >= 18, np.where(camera == 0, True, point < 18)))
    assert found.camera_status[3] == VisionStatus.TOO_FEW
    assert (found.point_status[18:] == VisionStatus.TOO_FEW).all() and (found.point_status[:18] == 0).all()


def test_disconnected_parts() -> None:
    scene = bundle_scene(6, 40, seed=21, share=1.0)
    camera, point = scene.table.camera, scene.table.point
    found = statuses(scene, (camera < 3) == (point < 20))
    assert found.status == VisionStatus.DISCONNECTED
    assert found.camera_status.tolist() == [0, 0, 0] + 3 * [VisionStatus.DISCONNECTED]
    assert (found.point_status[20:] == VisionStatus.DISCONNECTED).all() and (found.point_status[:20] == 0).all()
    both = statuses(scene, (camera < 3) == (point < 20), fixed_cameras=[0, 5])
    assert both.status == VisionStatus.OK and not both.camera_status.any()


@pytest.mark.parametrize("common", [1, 2])
def test_scale_between_parts(common: int) -> None:
    """Parts that share one or two points are connected, but one may turn about these and change its scale."""
    scene = bundle_scene(6, 40, seed=22, share=1.0)
    camera, point = scene.table.camera, scene.table.point
    found = statuses(scene, ((camera < 3) == (point < 20)) | (point < common))
    assert found.status == VisionStatus.DEGENERATE
    assert found.camera_status.tolist() == [0, 0, 0] + 3 * [VisionStatus.DEGENERATE]
    assert np.isnan(found.camera_covariance[3:]).all() or found.camera_covariance.shape == (6, 6, 6)
    assert statuses(scene, ((camera < 3) == (point < 20)) | (point < 3)).status == VisionStatus.OK


def test_a_long_street() -> None:
    """Noise moves the end of a chain of cameras by more than the distance of its points; the chain is determined."""
    rng = np.random.default_rng(36)
    x = rng.uniform((0, -3, 5), (80, 3, 15), (960, 3))
    poses = pga3.motor_from_rotation_vector_translation(
        0.05 * rng.normal(size=(80, 3)), np.arange(80)[:, None] * [1.0, 0, 0]
    )
    cameras = [Camera.from_intrinsics(600.0, (320, 240), pose) for pose in poses]
    near = np.abs(x[:, 0] - np.arange(80)[:, None]) < 2.5
    camera, point = np.nonzero(near)
    pixels = np.concatenate([view.project(x[near[i]]) for i, view in enumerate(cameras)])
    found = bundle_adjust(cameras, x, (camera, point, pixels + 2.0 * rng.normal(size=pixels.shape)))
    assert found.status == VisionStatus.OK and not found.camera_status.any()
    shift = np.sqrt(np.trace(found.camera_covariance[:, 3:, 3:], axis1=1, axis2=2))
    assert 3.3 * shift[-1] > 15 and 3.3 * shift[3] < 1


def test_cameras_with_one_centre() -> None:
    """Turning about the centre determines no depth."""
    rng = np.random.default_rng(23)
    points = rng.uniform((-1, -1, 5), (1, 1, 7), (20, 3))
    turns = pga3.motor_from_rotation_vector_translation(0.1 * rng.normal(size=(3, 3)), np.zeros((3, 3)))
    cameras = [Camera.from_intrinsics(600.0, (320, 240), turn) for turn in turns]
    camera, point = (each.ravel() for each in np.indices((3, 20)))
    pixels = np.concatenate([each.project(points) for each in cameras]) + 0.3 * rng.normal(size=(60, 2))
    found = bundle_adjust(cameras, points, (camera, point, pixels), fixed_cameras=[0, 1, 2])
    assert found.status == VisionStatus.DEGENERATE and (found.point_status == VisionStatus.DEGENERATE).all()
    assert bundle_adjust(cameras, points, (camera, point, pixels)).status == VisionStatus.DEGENERATE


def test_points_on_a_line() -> None:
    scene = bundle_scene(4, 12, seed=24, share=1.0)
    points = np.linspace(-1, 1, 12)[:, None] * [1.0, 0.5, 0.2]
    pixels = np.concatenate([view.project(points) for view in scene.cameras])
    found = bundle_adjust(scene.cameras, points, (scene.table.camera, scene.table.point, pixels))
    assert found.status == VisionStatus.DEGENERATE and (found.camera_status[1:] == VisionStatus.DEGENERATE).all()


def test_points_behind_cameras() -> None:
    scene = bundle_scene(4, 12, seed=25, share=1.0, noise=0.0)
    turn = pga3.motor_from_rotation_vector_translation(np.zeros(3), np.array([0.0, 0.0, 20.0]))
    beyond = scene.points.copy()
    cameras = [*scene.cameras[:3], Camera(scene.cameras[3].intrinsics, pga3.motor_product(scene.cameras[3].pose, turn))]
    pixels = np.concatenate([view.project(beyond) for view in cameras])
    found = bundle_adjust(cameras, beyond, (scene.table.camera, scene.table.point, pixels))
    assert found.status == VisionStatus.BEHIND and found.camera_status.tolist() == [0, 0, 0, VisionStatus.BEHIND]
    assert (found.point_status == VisionStatus.BEHIND).all()


def test_single_wrong_pixels() -> None:
    """One pixel that is off by 15 is no noise; with a robust loss it has no influence."""
    scene = bundle_scene(5, 40, seed=37, share=1.0)
    assert bundle_adjust(scene.cameras, scene.points, scene.table).status == VisionStatus.OK
    scene.table.pixels[77] += [9.0, -12.0]
    assert bundle_adjust(scene.cameras, scene.points, scene.table).status == VisionStatus.NOT_CONVERGED
    robust = bundle_adjust(scene.cameras, scene.points, scene.table, loss="cauchy")
    assert robust.status == VisionStatus.OK and robust.weights.argmin() == 77
    assert not robust.point_status.any()


def test_points_and_cameras_without_consensus() -> None:
    """Three of five pixels of a point are wrong, and two thirds of those of a camera."""
    scene = bundle_scene(5, 60, seed=38, share=1.0)
    camera, point = scene.table.camera, scene.table.point
    wrong = (point == 8) & (camera > 1)
    scene.table.pixels[wrong] += scene.rng.uniform(30, 60, (int(wrong.sum()), 2)) * [[1, -1], [-1, -1], [-1, 1]]
    found = bundle_adjust(scene.cameras, scene.points, scene.table, loss="huber")
    assert found.status == VisionStatus.OK and not found.camera_status.any()
    assert found.point_status.nonzero()[0].tolist() == [8]
    assert found.point_status[8] in (VisionStatus.NO_CONSENSUS, VisionStatus.BEHIND)
    spoiled = (camera == 3) & (point >= 20)
    scene.table.pixels[spoiled] += scene.rng.uniform(-200, 200, (int(spoiled.sum()), 2))
    found = bundle_adjust(scene.cameras, scene.points, scene.table, loss="cauchy")
    assert found.status == VisionStatus.NO_CONSENSUS and found.camera_status[3] == VisionStatus.NO_CONSENSUS
    assert not np.delete(found.camera_status, 3).any()


def test_numbers_that_are_not_finite() -> None:
    scene = bundle_scene(5, 30, seed=26, share=1.0)
    points, poses = scene.points.copy(), np.array([each.pose for each in scene.cameras])
    points[3, 1], poses[4, 2] = np.nan, np.inf
    scene.table.pixels[(scene.table.camera == 1) & (scene.table.point == 5)] = np.nan
    matrices = scene.cameras[0].intrinsics
    found = bundle_adjust((matrices, poses), points, scene.table, covariance="points")
    assert found.status == VisionStatus.NOT_FINITE
    assert found.camera_status.tolist() == [0, 0, 0, 0, VisionStatus.NOT_FINITE]
    assert found.point_status[3] == VisionStatus.NOT_FINITE and (np.delete(found.point_status, 3) == 0).all()
    assert np.isnan(found.residuals[(scene.table.camera == 1) & (scene.table.point == 5)]).all()
    assert np.isfinite(np.delete(found.points, 3, 0)).all() and np.isfinite(found.point_covariance[0]).all()


def test_nothing_to_adjust() -> None:
    empty = bundle_adjust([], np.zeros((0, 3)), ([], [], np.zeros((0, 2))))
    assert empty.status == VisionStatus.TOO_FEW and empty.cameras == () and empty.poses.shape == (0, 8)
    scene = bundle_scene(3, 5, seed=27)
    none = bundle_adjust(scene.cameras, scene.points, ([], [], []))
    assert none.status == VisionStatus.TOO_FEW and np.array_equal(none.points, scene.points)
    assert none.camera_status[1:].tolist() == 2 * [VisionStatus.TOO_FEW]


def test_steps_and_progress() -> None:
    scene = bundle_scene(5, 30, seed=28)
    start, steps = disturbed(scene), list[BundleStep]()
    early = ours(scene, start, max_steps=1)
    assert early.status == VisionStatus.NOT_CONVERGED and early.steps == 1
    found = ours(scene, start, progress=steps.append)
    assert [step.number for step in steps] == list(range(1, found.steps + 1))
    assert steps[0].cost == early.cost and steps[-1].cost == pytest.approx(found.cost)
    assert all(step.decrease >= 0 for step in steps)
    assert steps[0].cost + steps[0].decrease == pytest.approx(ours(scene, start, max_steps=0).cost)
    assert ours(scene, start, noise=0.1).status == VisionStatus.NOT_CONVERGED


def test_inputs_of_all_kinds() -> None:
    scene = bundle_scene(5, 30, seed=29)
    start = disturbed(scene)
    matrices = np.array([each.intrinsics for each in start[0]])
    poses = np.array([each.pose for each in start[0]])
    expected = ours(scene, start)
    table = scene.table
    for array in (table.pixels, start[1]):
        array.flags.writeable = False
    tables = table.camera.tolist(), table.point.astype(np.uint16), table.pixels[:, None]
    found = bundle_adjust((matrices, -poses), start[1].tolist(), tables)
    assert found.cost == pytest.approx(expected.cost, rel=1e-10)
    wide = np.zeros((len(table.pixels), 4), np.float32)
    wide[:, ::2] = table.pixels
    other = bundle_adjust(start[0], start[1].astype(np.float32), (table.camera, table.point, wide[:, ::2]))
    assert other.cost == pytest.approx(expected.cost, rel=1e-4)
    twice = bundle_adjust(
        start[0], start[1], tuple(np.concatenate(2 * [each]) for each in (table.camera, table.point, table.pixels))
    )
    assert twice.cost == pytest.approx(2 * expected.cost, rel=1e-9)
    np.testing.assert_allclose(twice.points, expected.points, atol=1e-6)
    order = scene.rng.permutation(len(table.camera))
    mixed = bundle_adjust(start[0], start[1], (table.camera[order], table.point[order], table.pixels[order]))
    assert mixed.cost == pytest.approx(expected.cost, rel=1e-10)
    np.testing.assert_allclose(mixed.residuals, expected.residuals[order], atol=1e-6)


@all_cases(
    "change, message",
    [
        (dict(observations=([0], [0])), r"observations: 2 arrays; expected 3"),
        (dict(observations=([9], [0], [[1.0, 2.0]])), r"observations: cameras 9 to 9; expected 0 to 3"),
        (dict(observations=([0.5], [0], [[1.0, 2.0]])), r"cameras of dtype float64; expected integers"),
        (dict(observations=([0, 1], [0], [[1.0, 2.0]])), r"cameras of shape \(2,\); expected \(1,\)"),
        (dict(distortion="radial"), r"distortion: 'radial'; expected None, 'brown' or 'fisheye'"),
        (dict(distortion="fisheye", coefficients=np.zeros(5)), r"coefficients: shape \(5,\); expected"),
        (dict(intrinsics="free"), r"intrinsics: 'free'; expected 'fixed', 'shared', 'each'"),
        (dict(estimated=["f"]), r"estimated: f with intrinsics='fixed'"),
        (dict(intrinsics="each", estimated=["k1"]), r"estimated: 'k1'; expected names out of f, fx"),
        (dict(intrinsics="each", estimated=["f", "fx"]), r"estimated: f, fx; expected"),
        (dict(loss="tukey"), r"loss: 'tukey'; expected None, 'huber' or 'cauchy'"),
        (dict(scale=0), r"scale: 0; expected more than 0"),
        (dict(noise=-1.0), r"noise: -1.0; expected more than 0 pixels"),
        (dict(max_steps=-1), r"max_steps: -1; expected an integer"),
        (dict(covariance="all"), r"covariance: 'all'; expected"),
        (dict(fixed_cameras=[4]), r"fixed_cameras: 4 to 4; expected 0 to 3"),
        (dict(fixed_points=[0.5]), r"fixed_points: shape \(1,\), dtype float64"),
        (dict(cameras=[1, 2, 3]), r"cameras: int; expected Camera objects, or a pair"),
        (dict(cameras=(np.eye(3), np.ones((4, 8)))), r"the pose of camera 0 is not a unit motor"),
        (dict(cameras=(np.ones((3, 3)), np.tile(np.eye(8)[0], (4, 1)))), r"K of camera 0 is"),
        (dict(points=np.zeros((2, 2))), r"points: shape \(2, 2\); expected"),
    ],
)
def test_errors(change: dict[str, Any], message: str) -> None:
    scene = bundle_scene(4, 10, seed=30)
    arguments = {"cameras": scene.cameras, "points": scene.points, "observations": scene.table, **change}
    with pytest.raises((TypeError, ValueError), match=message):
        bundle_adjust(**arguments)
