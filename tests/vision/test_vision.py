"""Cameras and two views against numpy's linear algebra, closed forms and a real stereo pair with true disparities."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.vision import (
    MOTORCYCLE,
    Camera,
    RectifiedPair,
    epipolar_distance,
    epipolar_lines,
    fundamental_matrix,
    triangulate,
)
from generated import pga3
from tests.support.all_cases import all_cases


def random_camera(rng: np.random.Generator) -> tuple[Camera, np.ndarray]:
    """A camera about 5 units from the origin that looks towards it, and its matrix by numpy."""
    pose = np.eye(4)
    axis, angle = rng.normal(size=3), rng.uniform(0.1, 0.5)
    axis /= np.linalg.norm(axis)
    cross = np.cross(np.eye(3), axis)
    pose[:3, :3] = np.eye(3) - np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    pose[:3, 3] = rng.normal(size=3) - 5 * pose[:3, 2]
    fx, fy, cx, cy, skew = *rng.uniform(500, 900, 2), *rng.uniform(200, 400, 2), rng.normal()
    camera = Camera.from_intrinsics((fx, fy), (cx, cy), pga3.motor_from_matrix(pose), skew)
    return camera, np.array([[fx, skew, cx], [0, fy, cy], [0, 0, 1]]) @ np.linalg.inv(pose)[:3]


def homogeneous(x: np.ndarray) -> np.ndarray:
    return np.concatenate([x, np.ones((*x.shape[:-1], 1))], -1)


def through_matrix(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    x = homogeneous(points) @ matrix.T
    return x[..., :2] / x[..., 2:]


def fundamental_by_pseudoinverse(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """``[e']x P' P^+`` (Hartley and Zisserman, *Multiple View Geometry*, eq. 9.1)."""
    centre = np.linalg.svd(one)[2][-1]
    a, b, c = two @ centre
    return np.array([[0, -c, b], [c, 0, -a], [-b, a, 0]]) @ two @ np.linalg.pinv(one)


def same_up_to_scale(a: np.ndarray, b: np.ndarray) -> float:
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    return min(np.abs(a - b).max(), np.abs(a + b).max())


@pytest.fixture(scope="module")
def motorcycle() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    data = pytest.importorskip("skimage.data")
    left, right, disparity = data.stereo_motorcycle()
    return left, right, disparity.astype(float)


def test_camera_matrix_and_projection() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        camera, matrix = random_camera(rng)
        points = rng.normal(size=(30, 3))
        assert np.abs(camera.matrix - matrix).max() < 1e-11
        assert np.abs(camera.project(points) - through_matrix(matrix, points)).max() < 1e-10
        assert np.abs(camera.depth(points) - homogeneous(points) @ matrix[2]).max() < 1e-13
        assert camera.depth(points).min() > 0


def test_a_camera_at_the_origin() -> None:
    """The pixel of (x, y, z) is ``f x / z + c``."""
    camera = Camera.from_intrinsics(100.0, (320.0, 240.0))
    assert camera.project([1.0, -2.0, 4.0]) == pytest.approx((345.0, 190.0), abs=1e-13)
    assert camera.project([0, 0, 1]) == pytest.approx((320, 240))
    assert camera.depth([1.0, -2.0, 4.0]) == 4.0
    assert camera.depth(np.array([[0.0, 0.0, -1.0]])) == -1.0
    assert not np.isfinite(camera.project([1.0, 1.0, 0.0])).any()


def test_fundamental_matrix_of_random_cameras() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        (first, one), (second, two) = random_camera(rng), random_camera(rng)
        matrix = fundamental_matrix(first, second)
        assert same_up_to_scale(matrix, fundamental_by_pseudoinverse(one, two)) < 1e-12
        assert same_up_to_scale(matrix, fundamental_matrix(one, two)) < 1e-12
        assert same_up_to_scale(matrix.T, fundamental_matrix(second, first)) < 1e-12
        singular = np.linalg.svd(matrix, compute_uv=False)
        assert singular[2] < 1e-12 * singular[0]
        points = rng.normal(size=(40, 3))
        x1, x2 = through_matrix(one, points), through_matrix(two, points)
        assert np.abs(epipolar_distance(matrix, x1, x2)).max() < 1e-8
        lines = epipolar_lines(matrix, x1)
        by_hand = (lines * homogeneous(x2)).sum(-1) / np.hypot(lines[:, 0], lines[:, 1])
        assert np.abs(epipolar_distance(matrix, x1, x2 + 1) - by_hand).max() > 1e-3
        assert np.abs(by_hand).max() < 1e-8


def test_distance_to_the_epipolar_line_is_in_pixels() -> None:
    """In a rectified pair the lines are rows, so that a partner k rows off is k pixels off."""
    matrix = fundamental_matrix(*MOTORCYCLE.cameras())
    rows = np.arange(-5.0, 6.0)
    partners = np.stack([np.full_like(rows, 3.0), 100 + rows], -1)
    off = epipolar_distance(matrix, [50.0, 100.0], partners)
    assert np.abs(off) == pytest.approx(np.abs(rows), abs=1e-11)
    assert off[0] * off[-1] < 0


def test_projective_cameras_and_batches() -> None:
    """Any matrices of rank 3 are accepted, and leading axes broadcast."""
    rng = np.random.default_rng(2)
    one, two = rng.normal(size=(3, 4)), rng.normal(size=(5, 3, 4))
    matrices = fundamental_matrix(one, two)
    assert matrices.shape == (5, 3, 3)
    for matrix, other in zip(matrices, two, strict=True):
        assert same_up_to_scale(matrix, fundamental_by_pseudoinverse(one, other)) < 1e-11
    assert fundamental_matrix(one.astype(np.float32), two.astype(np.float32)).dtype == np.float32


def test_triangulation_recovers_points() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        (first, one), (second, two) = random_camera(rng), random_camera(rng)
        points = rng.normal(size=(6, 7, 3))
        pixels = through_matrix(one, points), through_matrix(two, points)
        assert np.abs(triangulate((first, second), pixels) - points).max() < 1e-9
        assert np.abs(triangulate((one, second), pixels) - points).max() < 1e-9


def test_triangulation_with_noise_takes_the_nearest_point_of_the_first_line_of_sight() -> None:
    """Its first image is the pixel; its second one is the foot of the partner on the epipolar line."""
    rng = np.random.default_rng(4)
    (first, one), (second, two) = random_camera(rng), random_camera(rng)
    points = rng.normal(size=(50, 3))
    x1 = through_matrix(one, points) + rng.normal(size=(50, 2))
    x2 = through_matrix(two, points) + rng.normal(size=(50, 2))
    found = triangulate((first, second), (x1, x2))
    line = homogeneous(x1) @ fundamental_by_pseudoinverse(one, two).T
    normal = line[:, :2] / np.linalg.norm(line[:, :2], axis=-1, keepdims=True)
    distance = (line * homogeneous(x2)).sum(-1, keepdims=True) / np.linalg.norm(line[:, :2], axis=-1, keepdims=True)
    assert np.abs(first.project(found) - x1).max() < 1e-8
    assert np.abs(second.project(found) - (x2 - distance * normal)).max() < 1e-6


def test_parallel_lines_of_sight_meet_at_no_finite_point() -> None:
    pair = RectifiedPair(100.0, (50.0, 50.0), 0.0, 1.0)
    far = triangulate(pair.cameras(), ([[50.0, 50.0], [60.0, 50.0]], [[50.0, 50.0], [50.0, 50.0]]))
    assert not np.isfinite(far[0]).any()
    assert far[1] == pytest.approx((1.0, 0.0, 10.0), abs=1e-13)


def test_rectified_pair_in_closed_form() -> None:
    """Depth 10 at focal length 100 and baseline 1 is a disparity of 10 minus the offset."""
    pair = RectifiedPair(focal_length=100.0, centre=(50.0, 40.0), offset=4.0, baseline=1.0)
    left, right = pair.cameras()
    point = np.array([2.0, -1.0, 10.0])
    assert left.project(point) == pytest.approx((70, 30), abs=1e-13)
    assert right.project(point) == pytest.approx((64, 30), abs=1e-13)
    assert pair.depth(6.0) == pytest.approx(10.0)
    depth = pair.depth([6.0, np.inf, -np.inf, np.nan, -4.0, -5.0])
    assert depth[0] == pytest.approx(10.0)
    assert np.isnan(depth[1:]).all()
    assert pair.valid([6.0, np.inf, -np.inf, np.nan, -4.0, -5.0]).tolist() == [True] + 5 * [False]


def test_motorcycle_epipolar_constraint_and_depth(motorcycle: tuple[np.ndarray, ...]) -> None:
    """Of 343274 true correspondences: on their lines, and at the depth of Z = f B / (d + doffs)."""
    disparity = motorcycle[2]
    known = np.isfinite(disparity)
    assert 0.9 < known.mean() < 0.95
    cameras = MOTORCYCLE.cameras()
    pixels, partners = MOTORCYCLE.correspondences(disparity)
    y, x = np.nonzero(known)
    assert np.array_equal(pixels, np.stack([x, y], -1))
    assert np.array_equal(partners, np.stack([x - disparity[known], y], -1))
    matrix = fundamental_matrix(*cameras)
    constraint = (homogeneous(partners) @ (matrix / np.abs(matrix).max()) * homogeneous(pixels)).sum(-1)
    assert np.abs(constraint).max() < 1e-12
    assert np.abs(epipolar_distance(matrix, pixels, partners)).max() < 1e-12
    expected = 994.978 * 193.001 / (disparity[known] + 31.086)
    depth = MOTORCYCLE.depth(disparity)
    assert np.array_equal(np.isfinite(depth), known)
    assert np.abs(depth[known] / expected - 1).max() < 1e-14
    points = triangulate(cameras, (pixels, partners))
    assert np.abs(points[:, 2] / expected - 1).max() < 1e-13
    assert np.abs(cameras[1].project(points) - partners).max() < 1e-11
    assert 2000 < depth[known].min() < depth[known].max() < 5100


def test_motorcycle_disparities_are_those_of_the_left_image(motorcycle: tuple[np.ndarray, ...]) -> None:
    """The colours of partners agree far better than with the opposite sign or without disparity."""
    left, right, disparity = motorcycle
    pixels, partners = MOTORCYCLE.correspondences(disparity)
    inside = (partners[:, 0] > 0) & (2 * pixels[:, 0] - partners[:, 0] < left.shape[1] - 1)
    pixels, partners = pixels[inside], partners[inside]
    x, y = pixels.T.astype(int)
    colours = left[y, x].astype(float)

    def difference(columns: np.ndarray) -> float:
        return float(np.abs(right[y, np.round(columns).astype(int)] - colours).mean())

    assert difference(partners[:, 0]) < 0.4 * difference(pixels[:, 0])
    assert difference(partners[:, 0]) < 0.4 * difference(2 * pixels[:, 0] - partners[:, 0])


def test_single_precision_and_memory_order(motorcycle: tuple[np.ndarray, ...]) -> None:
    disparity = motorcycle[2]
    single = MOTORCYCLE.depth(disparity.astype(np.float32))
    assert single.dtype == np.float32
    known = np.isfinite(disparity)
    assert np.abs(single[known] / MOTORCYCLE.depth(disparity)[known] - 1).max() < 1e-6
    camera, points = (
        Camera.from_intrinsics(100.0, (3.0, 4.0)),
        np.random.default_rng(5).normal(size=(20, 3)) + np.array([0, 0, 9]),
    )
    expected = camera.project(points)
    wide = np.zeros((40, 6))
    wide[::2, ::2] = points
    frozen = points.copy()
    frozen.flags.writeable = False
    for same in (np.asfortranarray(points), wide[::2, ::2], frozen):
        assert np.array_equal(camera.project(same), expected)
    assert camera.project(points.astype(np.float32)).dtype == np.float32
    assert camera.project(np.empty((0, 3))).shape == (0, 2)
    assert MOTORCYCLE.depth(np.empty((0, 4))).shape == (0, 4)
    assert triangulate(MOTORCYCLE.cameras(), (np.empty((0, 2)), np.empty((0, 2)))).shape == (0, 3)


def test_units_of_length_do_not_matter(motorcycle: tuple[np.ndarray, ...]) -> None:
    disparity = motorcycle[2][::50, ::50]
    metres = RectifiedPair(MOTORCYCLE.focal_length, MOTORCYCLE.centre, MOTORCYCLE.offset, MOTORCYCLE.baseline / 1e3)
    matches = MOTORCYCLE.correspondences(disparity)
    in_metres, in_millimetres = triangulate(metres.cameras(), matches), triangulate(MOTORCYCLE.cameras(), matches)
    assert np.abs(1e3 * in_metres / in_millimetres - 1)[:, 2].max() < 1e-13


def test_pixels_that_are_nan_give_nan() -> None:
    pixels, partners = MOTORCYCLE.correspondences(np.full((4, 5), np.nan))
    assert pixels.shape == partners.shape == (0, 2)
    points = triangulate(MOTORCYCLE.cameras(), ([[np.nan, 1.0], [300.0, 200.0]], [[1.0, 1.0], [250.0, 200.0]]))
    assert np.isnan(points[0]).any()
    assert np.isfinite(points[1]).all()


def test_degenerate_cameras() -> None:
    left, right = MOTORCYCLE.cameras()
    turned = Camera.from_intrinsics(500.0, (1.0, 2.0), pga3.motor_from_line(np.eye(6)[0], 0.3))
    with pytest.raises(ValueError, match="first, second: cameras with the same centre"):
        fundamental_matrix(left, turned)
    with pytest.raises(ValueError, match="same centre"):
        fundamental_matrix(right, right)
    with pytest.raises(ValueError, match="second: a camera matrix of rank less than 3"):
        fundamental_matrix(left, np.ones((3, 4)))
    with pytest.raises(ValueError, match="first: a camera matrix of rank less than 3"):
        fundamental_matrix(np.zeros((3, 4)), left)


@all_cases(
    "call, error, message",
    [
        (lambda: fundamental_matrix(np.eye(3), np.eye(4)[:3]), ValueError, r"first: shape \(3, 3\); expected"),
        (lambda: fundamental_matrix(np.eye(4)[:3], np.eye(4)[:3] * 1j), TypeError, "second: dtype complex128"),
        (
            lambda: epipolar_lines(np.eye(3), np.zeros((4, 3))),
            ValueError,
            r"pixels: shape \(4, 3\); expected \(..., 2\)",
        ),
        (lambda: epipolar_lines(np.eye(2), np.zeros(2)), ValueError, "fundamental: shape"),
        (lambda: epipolar_distance(np.eye(3), [0, 0], [0]), ValueError, "partners: shape"),
        (
            lambda: triangulate(MOTORCYCLE.cameras(), [[0, 0]]),
            ValueError,
            "2 cameras, 1 arrays of pixels; expected 2 and 2",
        ),
        (lambda: triangulate(MOTORCYCLE.cameras(), ([0, 0], [0, 0, 1])), ValueError, r"pixels\[1\]: shape"),
        (lambda: Camera.from_intrinsics(0.0, (0, 0)), ValueError, "focal_length: 0"),
        (lambda: Camera.from_intrinsics(float("nan"), (0, 0)), ValueError, "focal_length: nan"),
        (lambda: Camera.from_intrinsics(1.0, (0, float("inf"))), ValueError, "centre: inf"),
        (lambda: Camera.from_intrinsics(1.0, (0, 0, 1)), ValueError, "centre: 3 numbers; expected 2"),
        (lambda: Camera.from_intrinsics((1.0,), (0, 0)), ValueError, "focal_length: 1 numbers; expected 2"),
        (lambda: Camera.from_intrinsics(1.0, (0, 0), np.eye(4)), ValueError, "pose: shape"),
        (lambda: Camera.from_intrinsics(1.0, (0, 0), 2 * np.eye(8)[0]), ValueError, "pose: not a unit motor"),
        (lambda: Camera.from_intrinsics(1.0, (0, 0), np.eye(8)[7]), ValueError, "pose: not a unit motor"),
        (lambda: Camera.from_intrinsics(1.0, (0, 0)).project([1.0, 2.0]), ValueError, "points: shape"),
        (lambda: MOTORCYCLE.correspondences(np.zeros(3)), ValueError, "disparity: shape"),
        (lambda: MOTORCYCLE.correspondences(np.zeros((2, 3, 4))), ValueError, "disparity: shape"),
        (lambda: MOTORCYCLE.depth(["a"]), TypeError, "disparity: dtype"),
    ],
)
def test_bad_input(call: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()
