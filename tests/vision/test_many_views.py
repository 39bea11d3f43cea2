"""Points from many known views, and metric scenes from projective ones, against known scenes."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from algorithms.vision import (
    Camera,
    DegenerateError,
    Distortion,
    VisionStatus,
    factorize,
    metric_upgrade,
    triangulate_views,
)
from generated import pga3

Array = np.ndarray[Any, Any]


def looking_at(place: Array, roll: Array, focal: float = 700.0, lens: Distortion | None = None) -> Camera:
    """A camera at a place that looks at the origin, turned a little."""
    z = -place / np.linalg.norm(place)
    x = np.cross([0, 1, 0.1], z)
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :3] = np.stack([x, np.cross(z, x), z], 1) @ Rotation.from_rotvec(roll).as_matrix()
    frame[:3, 3] = place
    return Camera.from_intrinsics(focal, (320, 240), pga3.motor_from_matrix(frame), distortion=lens)


def scene(
    seed: int, v: int, noise: float, spread: float = 0.0, lens: Distortion | None = None, n: int = 60
) -> tuple[Array, list[Camera], Array]:
    rng = np.random.default_rng([140, seed])
    points, cameras = rng.uniform(-1, 1, (n, 3)), []
    for _ in range(v):
        side = rng.normal(size=3)
        side[2] = -abs(side[2]) - 1
        place = side / np.linalg.norm(side) * rng.uniform(4, 7)
        cameras.append(
            looking_at(place, rng.normal(size=3) * [0.1, 0.1, 0.3], 700 * rng.uniform(1 - spread, 1 + spread), lens)
        )
    return points, cameras, np.array([c.project(points) for c in cameras]) + noise * rng.normal(size=(v, n, 2))


def error_after_similarity(found: Array, points: Array) -> float:
    """The largest distance of points from others after the best motion and scale (Umeyama)."""
    a, b = found - found.mean(0), points - points.mean(0)
    u, _, v = np.linalg.svd(b.T @ a)
    turn = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
    return float(np.abs(np.linalg.norm(b) / np.linalg.norm(a) * a @ turn.T - b).max())


@pytest.mark.parametrize(("unit", "far"), [(1.0, 0.0), (2.0**-10, 0.0), (2.0**10, 0.0), (1.0, 2.0**20)])
def test_points_of_exact_views(unit: float, far: float) -> None:
    points, cameras, pixels = scene(0, 4, 0.0, lens=Distortion("brown", (-0.2, 0.05)))
    frames = [np.asarray(pga3.motor_to_matrix(camera.pose)) for camera in cameras]
    for frame in frames:
        frame[:3, 3] = unit * frame[:3, 3] + far
    moved = [
        Camera(camera.intrinsics, pga3.motor_from_matrix(frame), camera.distortion)
        for camera, frame in zip(cameras, frames, strict=True)
    ]
    pixels[0, :20], pixels[1, 10:30], pixels[:3, 50] = np.nan, np.nan, np.nan
    found = triangulate_views(moved, pixels)
    assert (np.flatnonzero(found.point_status) == [50]).all() and found.point_status[50] == VisionStatus.TOO_FEW
    assert np.isnan(found.points[50]).all()
    assert np.nanmax(np.abs(found.points - unit * points - far)) < 1e-9 * unit + 1e-14 * far


def test_points_at_infinity_and_views_from_one_place_are_degenerate() -> None:
    here = Camera.from_intrinsics(700, (320, 240))
    aside = Camera(here.intrinsics, pga3.motor_from_rotation_vector_translation(np.zeros(3), np.array([1.0, 0, 0])))
    pixels = np.array([[320.0, 240], [330, 250]])
    for other in (here, aside):
        found = triangulate_views([here, other], [pixels, pixels])
        assert (found.point_status == VisionStatus.DEGENERATE).all() and np.isnan(found.points).all()
    with pytest.raises(ValueError, match="at least one"):
        triangulate_views([], np.empty((0, 2, 2)))


def test_points_are_the_minimum_of_scipy_and_errors_agree_with_covariances() -> None:
    points, cameras, pixels = scene(1, 5, 0.4, n=300)
    pixels[2:][np.random.default_rng(141).random((3, 300)) < 0.4] = np.nan
    found = triangulate_views(cameras, pixels, noise=0.4)
    assert (found.point_status == VisionStatus.OK).all()
    for k in range(10):
        views = np.flatnonzero(np.isfinite(pixels[:, k, 0]))
        best = least_squares(
            lambda x, views=views, k=k: np.ravel([cameras[i].project(x) - pixels[i, k] for i in views]),
            points[k],
            xtol=1e-15,
        )
        assert np.abs(found.points[k] - best.x).max() < 1e-7
    off = found.points - points
    squares = np.einsum("ni,nij,nj->n", off, np.linalg.inv(found.point_covariance), off)
    assert 2.6 < squares.mean() < 3.4


def test_points_with_a_wrong_pixel_are_refused() -> None:
    for seed in range(5):
        rng = np.random.default_rng([144, seed])
        _, cameras, pixels = scene(10 + seed, 4, 0.5, n=200)
        turn = rng.uniform(0, 2 * np.pi, 40)
        pixels[2, :40] += rng.uniform(10, 200, (40, 1)) * np.stack([np.cos(turn), np.sin(turn)], 1)
        found = triangulate_views(cameras, pixels, noise=0.5)
        good = found.point_status == VisionStatus.OK
        assert not good[:40].any() and good[40:].mean() > 0.98
        assert (found.point_status[~good] == VisionStatus.NO_CONSENSUS).all()
        usual = triangulate_views(cameras, pixels).point_status
        assert (usual[40:] == VisionStatus.OK).all()


def test_points_beside_the_lines_of_sight_are_refused() -> None:
    _, cameras, pixels = scene(2, 4, 0.0)
    one = [cameras[0]] * 3
    assert (triangulate_views(one, pixels[[0, 0, 0]]).point_status != VisionStatus.OK).all()  # one place
    with pytest.raises(ValueError, match="as many as there are cameras"):
        triangulate_views(cameras, pixels[:3])
    with pytest.raises(TypeError, match="expected a Camera"):
        triangulate_views([np.eye(3, 4)] * 4, pixels)


@pytest.mark.parametrize("v", [3, 6])
@pytest.mark.parametrize("spread", [0.0, 0.3])
def test_exact_scenes_become_metric(v: int, spread: float) -> None:
    points, cameras, pixels = scene(3, v, 0.0, spread)
    model = factorize(pixels)
    found = metric_upgrade(model, pixels, (320, 240) if spread else cameras[0])
    assert found.status == VisionStatus.OK and error_after_similarity(found.points, points) < 1e-8
    for ours, truth in zip(found.cameras, cameras, strict=True):
        assert np.allclose(ours.intrinsics, truth.intrinsics, rtol=1e-8)
        turn = pga3.motor_product(pga3.motor_inverse(ours.pose), found.cameras[0].pose)
        expected = pga3.motor_product(pga3.motor_inverse(truth.pose), cameras[0].pose)
        assert np.allclose(pga3.motor_to_matrix(turn)[:3, :3], pga3.motor_to_matrix(expected)[:3, :3], atol=1e-8)
    assert np.median(np.linalg.norm(found.points, axis=1)) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("spread", [0.0, 0.3])
def test_noisy_scenes_with_hidden_and_wrong_pixels_become_metric(spread: float) -> None:
    points, cameras, pixels = scene(4, 6, 0.3, spread)
    rng = np.random.default_rng(142)
    pixels[rng.random(pixels.shape[:2]) < 0.15] = np.nan
    pixels[2, :4] += 60
    model = factorize(pixels)
    found = metric_upgrade(model, pixels, (320, 240) if spread else cameras[0])
    good = found.point_status == VisionStatus.OK
    assert found.status == VisionStatus.OK and good.sum() > 50
    assert error_after_similarity(found.points[good], points[good]) < 0.03
    focals = [
        ours.intrinsics[0, 0] / truth.intrinsics[0, 0] for ours, truth in zip(found.cameras, cameras, strict=True)
    ]
    assert np.abs(np.subtract(focals, 1)).max() < (0.03 if spread else 1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_critical_motions_are_refused(seed: int) -> None:
    """Parallel axes, and views of one point from one distance, leave focal lengths open, two views everything."""
    rng = np.random.default_rng([143, seed])
    points = rng.uniform(-1, 1, (60, 3))
    ahead = [
        pga3.motor_from_rotation_vector_translation(np.zeros(3), rng.uniform(-1, 1, 3) - [0, 0, 6]) for _ in range(5)
    ]
    sides = rng.normal(size=(5, 3)) - [0, 0, 2]
    around = [looking_at(6 * each / np.linalg.norm(each), np.zeros(3)) for each in sides]
    for cameras in ([Camera.from_intrinsics(700.0, (320, 240), pose) for pose in ahead], around):
        pixels = np.array([c.project(points) for c in cameras]) + 0.3 * rng.normal(size=(5, 60, 2))
        model = factorize(pixels)
        try:
            assert metric_upgrade(model, pixels, (320, 240)).status != VisionStatus.OK
        except DegenerateError as error:
            assert error.status == VisionStatus.DEGENERATE
        found = metric_upgrade(model, pixels, cameras[0])
        assert found.status == VisionStatus.OK and error_after_similarity(found.points, points) < 0.08
    two = factorize(pixels[:2])
    with pytest.raises(DegenerateError, match="three or more"):
        metric_upgrade(two, pixels[:2], cameras[0])
    with pytest.raises(ValueError, match="as in the model"):
        metric_upgrade(two, pixels, cameras[0])
    bent = Camera.from_intrinsics(700.0, (320, 240), distortion=Distortion("brown", (-0.1,)))
    for wrong in (bent, np.ones((3, 3)), np.ones(3)):
        with pytest.raises(ValueError, match="expected"):
            metric_upgrade(two, pixels[:2], wrong)
