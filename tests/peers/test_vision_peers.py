"""Two views against OpenCV and scikit-image."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.vision import (
    MOTORCYCLE,
    Camera,
    HandEyeStatus,
    epipolar_lines,
    fundamental_matrix,
    hand_eye,
    triangulate,
)
from generated import pga3

pytestmark = pytest.mark.peers


def two_cameras(seed: int) -> tuple[Camera, Camera]:
    """Two cameras with different intrinsics, turned towards points before them."""
    rng = np.random.default_rng(seed)
    cameras = []
    for x in (-1.0, 1.0):
        turn = pga3.rotor_from_rotation_vector(rng.normal(size=3) * 0.1)
        pose = pga3.motor_from_rotor_translation(turn, np.array([x, *rng.normal(size=2) * 0.2]))
        cameras.append(Camera.from_intrinsics((rng.uniform(500, 900), rng.uniform(500, 900)), (320.0, 240.0), pose))
    return cameras[0], cameras[1]


def points_before(seed: int, n: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(n, 3)) + np.array([0, 0, 6])


def same_up_to_scale(a: np.ndarray, b: np.ndarray) -> float:
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    return min(np.abs(a - b).max(), np.abs(a + b).max())


def test_fundamental_matrix_equals_the_one_estimated_from_exact_points() -> None:
    cv2 = pytest.importorskip("cv2")
    for seed in range(10):
        first, second = two_cameras(seed)
        points = points_before(seed, 200)
        estimated, _ = cv2.findFundamentalMat(first.project(points), second.project(points), cv2.FM_8POINT)
        assert same_up_to_scale(fundamental_matrix(first, second), estimated) < 1e-7


def test_fundamental_matrix_of_the_motorcycle_equals_opencvs() -> None:
    cv2 = pytest.importorskip("cv2")
    disparity = pytest.importorskip("skimage.data").stereo_motorcycle()[2].astype(float)
    pixels, partners = MOTORCYCLE.correspondences(disparity)
    estimated, _ = cv2.findFundamentalMat(pixels[::200], partners[::200], cv2.FM_8POINT)
    assert same_up_to_scale(fundamental_matrix(*MOTORCYCLE.cameras()), estimated) < 1e-8


def test_projection_and_lines_equal_opencvs() -> None:
    cv2 = pytest.importorskip("cv2")
    first, second = two_cameras(3)
    points = points_before(3, 100)
    to_camera = np.linalg.inv(pga3.motor_to_matrix(first.pose))
    theirs, _ = cv2.projectPoints(points, cv2.Rodrigues(to_camera[:3, :3])[0], to_camera[:3, 3], first.intrinsics, None)
    assert np.abs(first.project(points) - theirs[:, 0]).max() < 1e-9
    matrix, pixels = fundamental_matrix(first, second), first.project(points)
    lines = epipolar_lines(matrix, pixels)
    lines = lines / np.linalg.norm(lines[:, :2], axis=-1, keepdims=True)
    by_opencv = cv2.computeCorrespondEpilines(pixels[:, None], 1, matrix)[:, 0]
    assert np.abs(lines - by_opencv).max() < 1e-8


def test_triangulation_and_depth_equal_opencvs() -> None:
    cv2 = pytest.importorskip("cv2")
    disparity = pytest.importorskip("skimage.data").stereo_motorcycle()[2].astype(float)
    first, second = MOTORCYCLE.cameras()
    pixels, partners = (part[::100] for part in MOTORCYCLE.correspondences(disparity))
    theirs = cv2.triangulatePoints(first.matrix, second.matrix, pixels.T.copy(), partners.T.copy())
    expected = (theirs[:3] / theirs[3]).T
    assert np.abs(triangulate((first, second), (pixels, partners)) / expected - 1)[:, 2].max() < 1e-9


def test_epipolar_residuals_equal_those_of_scikit_image() -> None:
    transform = pytest.importorskip("skimage.transform")
    first, second = two_cameras(5)
    points = points_before(5, 60)
    model = transform.FundamentalMatrixTransform.from_estimate(first.project(points), second.project(points))
    assert model
    assert same_up_to_scale(fundamental_matrix(first, second), model.params) < 1e-7


def test_hand_eye_is_as_exact_as_opencvs_under_noise() -> None:
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(7)
    ours, theirs = [], []
    for _ in range(100):
        x = _pose(rng)
        hands = [_pose(rng) for _ in range(11)]
        # A pattern seen by the camera on the hand, each view a little wrong.
        pattern = _pose(rng)
        views = [np.linalg.inv(hand @ x) @ pattern @ _pose(rng, 1e-3) for hand in hands]
        a = np.array([np.linalg.inv(p) @ q for p, q in pairwise(hands)])
        b = np.array([p @ np.linalg.inv(q) for p, q in pairwise(views)])
        found = hand_eye(pga3.motor_from_matrix(a), pga3.motor_from_matrix(b))
        assert found.status == HandEyeStatus.OK
        ours.append(_rotation_error(pga3.motor_to_matrix(found.motor), x))
        turned, _ = cv2.calibrateHandEye(
            [hand[:3, :3] for hand in hands],
            [hand[:3, 3] for hand in hands],
            [view[:3, :3] for view in views],
            [view[:3, 3] for view in views],
            method=cv2.CALIB_HAND_EYE_DANIILIDIS,
        )
        theirs.append(_rotation_error(turned, x))
    # OpenCV takes all pairs of poses, this test only successive ones.
    assert np.sqrt(np.mean(np.square(ours))) < 2 * np.sqrt(np.mean(np.square(theirs)))


def _pose(rng: np.random.Generator, size: float = 1.0) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(size * rng.normal(size=3)).as_matrix()
    matrix[:3, 3] = size * rng.normal(size=3)
    return matrix


def _rotation_error(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.linalg.norm(found[:3, :3] - truth[:3, :3]))
