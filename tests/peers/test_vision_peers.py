"""Two views against OpenCV and scikit-image."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.vision import (
    MOTORCYCLE,
    Camera,
    HandEyeStatus,
    VisionStatus,
    calibrate_by_pascal,
    calibrate_from_planes,
    epipolar_lines,
    factorize,
    fundamental_matrices,
    fundamental_matrix,
    hand_eye,
    localize,
    robust_fundamental_matrix,
    robust_homography,
    sampson_distance,
    triangulate,
)
from generated import pga3, projective2

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


def _root_mean_square(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def test_fundamental_matrix_under_noise_has_the_sampson_error_of_opencvs() -> None:
    """True correspondences of the Motorcycle, and cameras in general position, each with noise."""
    cv2 = pytest.importorskip("cv2")
    disparity = pytest.importorskip("skimage.data").stereo_motorcycle()[2].astype(float)
    rng = np.random.default_rng(1)
    pixels, partners = (part[::1000] for part in MOTORCYCLE.correspondences(disparity))
    pairs = [(pixels, partners)]
    for seed in range(10):
        cameras, points = two_cameras(seed), points_before(seed, 100)
        pairs.append((cameras[0].project(points), cameras[1].project(points)))
    for first, second in pairs:
        one, two = (x + 0.5 * rng.normal(size=x.shape) for x in (first, second))
        theirs, _ = cv2.findFundamentalMat(one, two, cv2.FM_8POINT)
        ours = fundamental_matrix(one, two)
        error = _root_mean_square(sampson_distance(ours, one, two))
        assert error <= 1.05 * _root_mean_square(sampson_distance(theirs, one, two))


def test_robust_fundamental_matrix_of_photographs() -> None:
    """Matches of real features in the pairs of mvtb-data: as many agree, as closely, as with OpenCV's best."""
    cv2, data = pytest.importorskip("cv2"), pytest.importorskip("mvtbdata")
    folder = Path(data.__file__).parent / "images"
    for left, right in (("building2-1.png", "building2-2.png"), ("eiffel-1.png", "eiffel-2.png")):
        images = [cv2.imread(str(folder / name), cv2.IMREAD_GRAYSCALE) for name in (left, right)]
        if any(image is None for image in images):
            continue
        (keys, a), (others, b) = (cv2.SIFT_create(2000).detectAndCompute(image, None) for image in images)
        near = [m for m, n in cv2.BFMatcher().knnMatch(a, b, k=2) if m.distance < 0.8 * n.distance]
        one = np.array([keys[m.queryIdx].pt for m in near])
        two = np.array([others[m.trainIdx].pt for m in near])
        theirs, _ = cv2.findFundamentalMat(one, two, cv2.USAC_MAGSAC, 1.0, 0.999, 10000)
        ours = robust_fundamental_matrix(one, two, threshold=1.0)
        assert ours.status == VisionStatus.OK

        def cost(matrix: np.ndarray, one: np.ndarray = one, two: np.ndarray = two) -> float:
            return float(np.minimum(sampson_distance(matrix, one, two) ** 2, 1.0).sum())

        assert cost(ours.model) <= 1.05 * cost(theirs)


def test_robust_fundamental_matrix_of_a_rectified_pair() -> None:
    """True pairs of the Motorcycle are nearer to F from matches of its features than with OpenCV or PoseLib."""
    cv2, poselib = pytest.importorskip("cv2"), pytest.importorskip("poselib")
    left, right, disparity = pytest.importorskip("skimage.data").stereo_motorcycle()
    pixels, partners = (part[::50] for part in MOTORCYCLE.correspondences(disparity.astype(float)))
    images = [cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in (left, right)]
    errors = []
    for most, ratio in ((0, 0.8), (2000, 0.8), (1000, 0.8), (0, 0.75), (2000, 0.75), (1000, 0.75)):
        (keys, a), (others, b) = (cv2.SIFT_create(most).detectAndCompute(image, None) for image in images)
        near = [m for m, n in cv2.BFMatcher().knnMatch(a, b, k=2) if m.distance < ratio * n.distance]
        one = np.array([keys[m.queryIdx].pt for m in near])
        two = np.array([others[m.trainIdx].pt for m in near])
        found = robust_fundamental_matrix(one, two)
        assert found.status == VisionStatus.OK
        theirs, _ = cv2.findFundamentalMat(one, two, cv2.USAC_MAGSAC, 1.0, 0.999, 10000)
        other, _ = poselib.estimate_fundamental(one, two, {"max_epipolar_error": 1.0}, {})
        matrices = found.model, theirs, other
        errors.append([_root_mean_square(sampson_distance(each, pixels, partners)) for each in matrices])
    ours, magsac, of_poselib = np.median(errors, axis=0)
    assert ours < min(magsac, of_poselib) and ours < 0.11


def test_pose_under_noise_is_as_exact_as_opencvs() -> None:
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(2)
    ours, theirs = [], []
    for seed in range(100):
        camera, points = two_cameras(seed)[0], points_before(seed, 20)
        pixels = camera.project(points) + rng.normal(size=(20, 2))
        truth = np.linalg.inv(pga3.motor_to_matrix(camera.pose))
        found = localize(points, pixels, camera.intrinsics)
        assert found.status == VisionStatus.OK
        mine = np.linalg.inv(pga3.motor_to_matrix(found.pose))
        _, turn, shift = cv2.solvePnP(points, pixels, camera.intrinsics, None)
        other = np.eye(4)
        other[:3, :3], other[:3, 3] = cv2.Rodrigues(turn)[0], shift[:, 0]
        ours.append(np.abs(mine - truth).max())
        theirs.append(np.abs(other - truth).max())
    assert np.median(ours) <= 1.05 * np.median(theirs)
    assert _root_mean_square(np.array(ours)) <= 1.05 * _root_mean_square(np.array(theirs))


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


def _mvtb() -> Path:
    return Path(pytest.importorskip("mvtbdata").__file__).parent / "images"


def test_intrinsics_from_corners_that_opencv_finds_in_photographs() -> None:
    """The chessboard views of mvtb-data, by circular points and by Pascal's conics: 1 % and 2 pixels."""
    cv2, folder = pytest.importorskip("cv2"), _mvtb() / "calibration"
    focal, centre = 535.91573396, (342.28315473, 235.57082910)
    distortion = np.array([-0.26637261, -0.0385889, 0.00178319, -0.00028122, 0.23839153])
    k = np.array([[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1]])
    views = []
    for path in sorted(folder.glob("left*.jpg")):
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        found, corners = cv2.findChessboardCorners(image, (9, 6))
        if found:
            stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-4)
            corners = cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), stop)
            views.append(cv2.undistortPoints(corners, k, distortion, P=k)[:, 0].astype(float))
    if len(views) < 10:
        pytest.skip("no photographs of a chessboard")
    grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0)), -1).reshape(-1, 2)
    for calibrate in (calibrate_from_planes, calibrate_by_pascal):
        found = calibrate(grid, views)
        assert found.status == VisionStatus.OK
        assert np.abs(np.diag(found.intrinsics)[:2] / focal - 1).max() < 0.01
        assert np.abs(found.intrinsics[:2, 2] - centre).max() < 2


def test_shape_and_motion_of_real_corners() -> None:
    """Features that three photographs of a building share: half a pixel and less remains, also of those occluded."""
    cv2, folder = pytest.importorskip("cv2"), _mvtb()
    images = [cv2.imread(str(folder / f"building2-{k}.png"), cv2.IMREAD_GRAYSCALE) for k in (1, 2, 3)]
    if any(image is None for image in images):
        pytest.skip("no photographs of a building")
    found = [cv2.SIFT_create(2000).detectAndCompute(image, None) for image in images]
    places = [np.array([key.pt for key in keys]) for keys, _ in found]
    partners = []
    for k in (1, 2):
        near = [m for m, n in cv2.BFMatcher().knnMatch(found[0][1], found[k][1], k=2) if m.distance < 0.7 * n.distance]
        first, other = np.array([(m.queryIdx, m.trainIdx) for m in near]).T
        inliers = robust_fundamental_matrix(places[0][first], places[k][other], threshold=1.0).inliers
        partners.append(dict(zip(first[inliers].tolist(), other[inliers].tolist(), strict=True)))
    common = sorted(set(partners[0]) & set(partners[1]))
    assert len(common) > 100
    pixels = np.stack([places[0][common]] + [places[k + 1][[m[c] for c in common]] for k, m in enumerate(partners)])
    whole = factorize(pixels)
    assert whole.status == VisionStatus.OK and whole.residual <= 0.5
    hidden = np.zeros(pixels.shape[:2], bool)
    hidden[np.arange(len(common)) % 3, np.arange(len(common))] = np.arange(len(common)) % 5 == 0
    completed = factorize(pixels, ~hidden)
    assert completed.status == VisionStatus.OK
    assert np.median(np.linalg.norm((completed.pixels - pixels)[hidden], axis=-1)) <= 1.0


def test_fundamental_matrices_of_many_small_sets_have_the_sampson_error_of_opencvs() -> None:
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(11)
    cameras, ours, theirs = two_cameras(4), [], []
    points = points_before(4, 2000).reshape(100, 20, 3)
    one, two = (camera.project(points) + 0.5 * rng.normal(size=(100, 20, 2)) for camera in cameras)
    found = fundamental_matrices(one, two)
    for a, b, matrix, status in zip(one, two, found.models, found.status, strict=True):
        if status == VisionStatus.OK:
            ours.append(_root_mean_square(sampson_distance(matrix, a, b)))
            other, _ = cv2.findFundamentalMat(a, b, cv2.FM_8POINT)
            theirs.append(_root_mean_square(sampson_distance(other, a, b)))
    assert len(ours) > 80 and np.mean(ours) <= 1.05 * np.mean(theirs)


def test_robust_poses_and_homographies_are_as_exact_as_poselibs() -> None:
    poselib = pytest.importorskip("poselib")
    rng = np.random.default_rng(12)
    ours, theirs, planes, others = [], [], [], []
    for seed in range(15):
        camera, points = two_cameras(seed)[0], points_before(seed, 100)
        pixels = camera.project(points) + 0.5 * rng.normal(size=(100, 2))
        wrong = rng.random(100) < 0.3
        pixels[wrong] += rng.uniform(20, 80, (int(wrong.sum()), 2))
        k = camera.intrinsics
        found = localize(points, pixels, k, threshold=2.0)
        assert found.status == VisionStatus.OK and not found.inliers[wrong].any()
        model = {"model": "PINHOLE", "width": 640, "height": 480, "params": [k[0, 0], k[1, 1], k[0, 2], k[1, 2]]}
        pose, _ = poselib.estimate_absolute_pose(pixels, points, model, {"max_reproj_error": 2.0}, {})
        truth = np.linalg.inv(pga3.motor_to_matrix(camera.pose))
        ours.append(np.abs(np.linalg.inv(pga3.motor_to_matrix(found.pose))[:3] - truth[:3]).max())
        theirs.append(np.abs(pose.Rt - truth[:3]).max())
        flat = points * [1, 1, 0] + [0, 0, 6]
        one, two = (x.project(flat) + 0.5 * rng.normal(size=(100, 2)) for x in two_cameras(seed))
        exact = [x.project(flat) for x in two_cameras(seed)]
        two[wrong] += 50
        plane = robust_homography(one, two)
        other, _ = poselib.estimate_homography(one, two, {"max_reproj_error": 2.0}, {})
        for matrix, kept in ((plane.model, planes), (other, others)):
            kept.append(_root_mean_square(projective2.transform_point(matrix, exact[0]) - exact[1]))
    assert np.mean(ours) <= 1.1 * np.mean(theirs)
    assert np.mean(planes) <= 1.1 * np.mean(others)
