"""Invariants of views, of orders and of images, and landmarks, against determinants and points of space."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import chessboard
import numpy as np
import pytest
from test_views import GRID, scene, undistorted
from test_vision import homogeneous, random_camera, through_matrix

from algorithms.vision import (
    DegenerateError,
    LandmarkMap,
    OmnidirectionalCamera,
    VisionStatus,
    calibrate_by_pascal,
    cross_ratio,
    fundamental_matrix,
    invariants_3d,
    invariants_3d_deviation,
    p2_invariants,
    trifocal_tensor,
)
from generated import omnidirectional, pga3, projective2

Array = np.ndarray[Any, Any]


def in_views(rng: np.random.Generator, noise: float, method: Any, n_scenes: int = 20) -> tuple[Array, Array, Array]:
    """Errors from two and from three views, and the effect of rounding of pixels on those from two."""
    errors: list[Array] = []
    floors = []
    for _ in range(n_scenes):
        cameras, _, points, pixels = scene(rng, 3, 180)
        x = [v.reshape(30, 6, 2) + noise * rng.normal(size=(30, 6, 2)) for v in pixels]
        truth = invariants_3d(points.reshape(30, 6, 3))
        matrix, tensor = fundamental_matrix(*cameras[:2]), trifocal_tensor(*cameras)
        two = invariants_3d(*x[:2], fundamental=matrix, method=method)
        three = invariants_3d(*x, tensor=tensor, method=method)
        errors.append(np.abs([two - truth, three - truth]) / (1 + np.abs(truth)))
        if not noise:
            # Pixels of some 300 units are rounded by 3e-14.
            floor = invariants_3d_deviation(*x[:2], fundamental=matrix, noise=3e-14)
            floors.append(floor / (1 + np.abs(truth)))
    both = np.concatenate(errors, 1)
    return both[0].ravel(), both[1].ravel(), np.concatenate(floors).ravel() if floors else np.empty(0)


def test_views_give_the_invariants_of_space_to_the_accuracy_of_pixels() -> None:
    """The error is 1e-12 wherever the last digit of the pixels permits, according to the reported deviation."""
    two, three, floor = in_views(np.random.default_rng(1), 0.0, "points", 4)
    assert (floor < 1e-13).mean() > 0.97
    assert max(two[floor < 1e-13].max(), three[floor < 1e-13].max()) < 1e-12
    assert (two < 40 * floor + 1e-13).all() and (three < 40 * floor + 1e-13).all()
    two, three, _ = in_views(np.random.default_rng(1), 0.0, "joins", 2)
    assert (two < 1e-12).mean() > 0.95 and (three < 1e-12).mean() > 0.97 and max(two.max(), three.max()) < 1e-7


def test_the_deviation_of_invariants_under_noise() -> None:
    """Compare with the spread of invariants of noisy pixels."""
    rng = np.random.default_rng(8)
    cameras, _, _, pixels = scene(rng, 3, 60)
    views = [v.reshape(10, 6, 2) for v in pixels]
    noisy = [v + 0.01 * rng.normal(size=(400, *v.shape)) for v in views]
    matrix, tensor = fundamental_matrix(*cameras[:2]), trifocal_tensor(*cameras)
    for known in ({"fundamental": matrix}, {"tensor": tensor}):
        count = 2 if "fundamental" in known else 3
        found = invariants_3d(*noisy[:count], **known)
        middle = np.quantile(found, [0.16, 0.84], axis=0)
        deviation = invariants_3d_deviation(*views[:count], noise=0.01, **known)
        assert deviation.shape == (10, 3)
        assert np.median((middle[1] - middle[0]) / (2 * deviation)) == pytest.approx(1, abs=0.1)
    with pytest.raises(ValueError, match="2 or 3 views"):
        invariants_3d_deviation(views[0])
    with pytest.raises(ValueError, match="noise"):
        invariants_3d_deviation(*views[:2], fundamental=matrix, noise=np.nan)


def test_the_deviation_is_computed_for_each_set_alone() -> None:
    """The deviation does not depend on the size of other sets and views."""
    rng = np.random.default_rng(10)
    cameras, _, _, pixels = scene(rng, 3, 24)
    views = [v.reshape(4, 6, 2) for v in pixels]
    matrix = fundamental_matrix(*cameras[:2])
    alone = [invariants_3d_deviation(views[0][k], views[1][k], fundamental=matrix) for k in range(3)]
    views[0][3] *= 1e6
    views[1][2, 1] = np.nan
    found = invariants_3d_deviation(*views[:2], fundamental=matrix)
    np.testing.assert_allclose(found[:2], alone[:2], rtol=1e-9)
    assert np.isnan(found[2]).all() and np.isfinite(found[3]).all()
    # The second image in a unit that scales it by 1e7.
    large = np.diag([1, 1, 1e7]) @ matrix
    other = [invariants_3d_deviation(views[0][k], 1e7 * views[1][k], fundamental=large) for k in range(2)]
    first_alone = invariants_3d_deviation(views[0][:2], 1e7 * views[1][:2], fundamental=large)
    np.testing.assert_allclose(other, first_alone, rtol=1e-9)
    assert (first_alone < alone[:2]).all() and (first_alone > 0.2 * np.array(alone[:2])).any()
    with pytest.raises(ValueError, match="noise: -1"):
        invariants_3d_deviation(*views[:2], fundamental=matrix, noise=-1)


def test_three_views_are_at_least_as_accurate_as_two_under_noise() -> None:
    """The first and the last row of the table of the page: medians for 0.1 and 1 pixels."""
    for noise, of_two, of_three in (
        (0.1, 0.0026, 0.0017),
        (1.0, 0.026, 0.017),
    ):
        two, three, _ = in_views(np.random.default_rng(2), noise, "points", 12)
        assert np.median(three) <= np.median(two)
        assert np.quantile(three, 0.9) <= np.quantile(two, 0.9)
        assert np.median(two) == pytest.approx(of_two, rel=0.25)
        assert np.median(three) == pytest.approx(of_three, rel=0.25)
        joined = in_views(np.random.default_rng(2), noise, "joins", 4)
        assert np.median(joined[1]) <= np.median(joined[0]) and np.median(two) < np.median(joined[0])


def test_five_points_of_a_plane_in_any_order_and_under_any_map() -> None:
    rng = np.random.default_rng(3)
    points = rng.normal(size=(1000, 5, 2))
    maps = np.linalg.qr(rng.normal(size=(1000, 3, 3)))[0] * rng.uniform(0.5, 2, (1000, 1, 3))
    orders = rng.permuted(np.tile(np.arange(5), (1000, 1)), axis=1)
    moved = np.take_along_axis(homogeneous(points) @ maps, orders[..., None], 1)
    found = p2_invariants(points)
    assert found.shape == (1000, 5) and (found >= 2).all() and (found <= 2.8 + 1e-12).all()
    assert np.abs(p2_invariants(moved) - found).max() < 1e-9
    every = np.array([p2_invariants(points[0][list(order)]) for order in permutations(range(5))])
    assert np.ptp(every, 0).max() < 1e-12
    assert np.abs(found[:-1] - found[1:]).max(-1).min() > 1e-3
    with pytest.raises(ValueError, match="five points"):
        p2_invariants(points[0, :4])


def test_conformal_brackets_of_rays_are_those_of_the_plane() -> None:
    """In images of an omnidirectional camera, five points of a plane have the cross-ratio of the scene."""
    rng = np.random.default_rng(4)
    camera = OmnidirectionalCamera.from_intrinsics(300.0, (320, 240), 0.8, pga3.motor_exponential(rng.normal(size=6)))
    inside = np.linalg.inv(pga3.motor_to_matrix(camera.camera.pose))
    flat = rng.normal(size=(10000, 5, 2))
    axes, origin = rng.normal(size=(10000, 2, 3)), rng.normal(size=(10000, 1, 3)) * 3
    places = flat @ axes + origin
    seen = ((places @ inside[:3, :3].T + inside[:3, 3])[..., 2] > 0.2).all(1)
    assert seen.sum() > 1000
    rays = camera.directions(camera.project(places[seen]))
    in_scene = cross_ratio(flat[seen])
    assert np.abs(omnidirectional.cross_ratio_of_rays(rays) / in_scene - 1).max() < 1e-9
    assert np.abs(cross_ratio(rays) / in_scene - 1).max() < 1e-9
    assert np.abs(p2_invariants(rays) - p2_invariants(flat[seen])).max() < 1e-9


def test_pascals_theorem_on_complex_points() -> None:
    """Six points of a conic with complex coordinates, the circular points of two planes among them."""
    rng = np.random.default_rng(5)

    def complex_normal(*shape: int) -> Array:
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    t = complex_normal(50, 6)
    points = np.stack([1 - t * t, 2 * t, 1 + t * t], -1) @ complex_normal(50, 3, 3)
    points /= np.linalg.norm(points, axis=-1, keepdims=True)
    assert np.abs(projective2.pascal_bracket(points)).max() < 1e-13
    assert np.abs(projective2.pascal_bracket(complex_normal(50, 6, 3))).min() > 1e-6
    conic = projective2.conic_from_points(points[:, :5])
    x, y, w = (points[:, 5, k] for k in range(3))
    value = np.einsum("nk,nk->n", conic, np.stack([x * x, x * y, y * y, x * w, y * w, w * w], -1))
    assert np.abs(value / np.linalg.norm(conic, axis=-1)).max() < 1e-11


# Landmarks


CAMERA = OmnidirectionalCamera.from_intrinsics(400.0, (640, 480), 1.0)


def landmarks(rng: np.random.Generator, n: int, size: int = 10) -> list[Array]:
    """Points of planes, 1.5 wide, with a minimum distance of a quarter."""
    found: list[Array] = []
    while len(found) < n:
        points = rng.uniform(-0.75, 0.75, (size, 2))
        if (np.linalg.norm(points[:, None] - points, axis=-1) + np.eye(size)).min() > 0.25:
            found.append(points)
    return found


def seen(rng: np.random.Generator, points: Array, noise: float) -> Array:
    """Directions of a landmark at a distance of 1.5 to 3 that approximately faces the camera, with noise in pixels."""
    turn = rng.uniform(0, 2 * np.pi)
    centre = rng.uniform(1.5, 3) * np.array([np.cos(turn), np.sin(turn), rng.uniform(-0.2, 0.6)])
    normal = -centre / np.linalg.norm(centre) + 0.35 * rng.normal(size=3)
    one = np.cross(normal, [0, 0, 1])
    axes = np.stack([one, np.cross(normal, one)])
    pixels = CAMERA.project(centre + points @ (axes / np.linalg.norm(axes, axis=1, keepdims=True)))
    return CAMERA.directions(pixels + noise * rng.normal(size=pixels.shape))


@pytest.mark.slow
def test_fifty_landmarks_are_recognised_under_noise_of_one_pixel() -> None:
    rng = np.random.default_rng(6)
    shapes = landmarks(rng, 50)
    learned = LandmarkMap.learn([np.stack([seen(rng, shape, 1.0) for _ in range(5)]) for shape in shapes])
    confusion = np.zeros((20, 51), int)
    for k in range(20):
        order = rng.permutation(10)
        found = learned.recognize(seen(rng, shapes[k][order], 1.0), 2 / 400)
        confusion[k, found.landmark] += 1
        if found.landmark == k:
            matched = found.matches >= 0
            assert (found.matches[matched] == order[matched]).mean() > 0.7 and found.distance < 0.0125
    assert np.trace(confusion) >= 19
    unknown = [learned.recognize(seen(rng, shape, 1.0), 2 / 400).status for shape in landmarks(rng, 4)]
    assert unknown.count(VisionStatus.NO_CONSENSUS) == 4


def test_landmarks_of_other_points() -> None:
    rng = np.random.default_rng(7)
    shapes = landmarks(rng, 3)
    learned = LandmarkMap.learn([np.stack([seen(rng, shape, 0.0) for _ in range(2)]) for shape in shapes])
    view = seen(rng, shapes[1], 0.0)
    exact = learned.recognize(view, 1e-3)
    assert exact.landmark == 1 and exact.distance < 1e-9 and np.array_equal(exact.matches, np.arange(10))
    assert learned.recognize(view[:9], 1e-3).landmark == 1
    assert learned.recognize(view[:7], 1e-3).status == VisionStatus.TOO_FEW
    assert learned.recognize(np.vstack([view[:9], [np.nan] * 3]), 1e-3).status == VisionStatus.NOT_FINITE
    line = np.linspace(view[0], view[1], 10)
    assert learned.recognize(line, 1e-3).status == VisionStatus.DEGENERATE
    assert learned.recognize(np.vstack([view, -view]), 1e-3).status == VisionStatus.DEGENERATE
    with pytest.raises(DegenerateError, match="found 7"):
        LandmarkMap.learn([view[None, :7]])
    with pytest.raises(DegenerateError, match="expected at least 8"):
        LandmarkMap.learn([line[None]])
    with pytest.raises(ValueError, match="noise: 0"):
        learned.recognize(view, 0.0)


# Calibration by Pascal's theorem


def test_intrinsics_by_pascals_theorem() -> None:
    rng = np.random.default_rng(8)
    k = np.array([[700.0, 3.0, 310], [0, 650, 250], [0, 0, 1]])
    board = np.insert(GRID * 0.1, 2, 0, 1)
    views = []
    for _ in range(5):
        camera, matrix = random_camera(rng)
        views.append(through_matrix(k @ np.linalg.inv(camera.intrinsics) @ matrix, board))
    found = calibrate_by_pascal(GRID, views)
    assert found.status == VisionStatus.OK and np.abs(found.intrinsics - k).max() < 1e-6
    assert found.singular_values.shape == (10,) and found.singular_values.max() < 1e-12
    noisy = calibrate_by_pascal(GRID, [view + 0.5 * rng.normal(size=view.shape) for view in views])
    assert noisy.singular_values.max() > 1e-12
    assert calibrate_by_pascal(GRID, views[:2]).status == VisionStatus.TOO_FEW
    assert calibrate_by_pascal(GRID, [views[0]] * 3).status == VisionStatus.DEGENERATE
    assert calibrate_by_pascal(GRID, [views[0] * np.nan, *views]).status == VisionStatus.NOT_FINITE
    assert calibrate_by_pascal(GRID[:9], [view[:9] for view in views]).status == VisionStatus.DEGENERATE


def test_pascals_conics_of_photographs_of_a_chessboard() -> None:
    """364 triples of views: within 1 % and 2 pixels of the calibration that came with the photographs."""
    corners = np.array(chessboard.CORNERS.split(), float).reshape(14, 54, 2)
    found = calibrate_by_pascal(GRID, undistorted(corners))
    assert found.status == VisionStatus.OK and found.singular_values.shape == (364,)
    assert np.abs(np.diag(found.intrinsics)[:2] / chessboard.FOCAL_LENGTH - 1).max() < 0.01
    assert np.abs(found.intrinsics[:2, 2] - chessboard.CENTRE).max() < 2
    assert abs(found.intrinsics[0, 1]) < 2
