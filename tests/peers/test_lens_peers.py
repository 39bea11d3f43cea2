"""Lenses and their calibration, compared with OpenCV and PyYAML on the same bytes."""

import numpy as np
import pytest

from algorithms.vision import (
    Camera,
    Distortion,
    VisionStatus,
    calibrate_from_planes,
    read_camera,
    undistort_image,
    write_camera,
)
from generated import pga3

pytestmark = pytest.mark.peers
BOARD = np.stack(np.meshgrid(np.arange(9.0) - 4, np.arange(6.0) - 2.5), -1).reshape(-1, 2) * 0.03
FLAT = np.insert(BOARD, 2, 0, axis=1)
SIZE = (640, 480)
BROWN = (-0.28, 0.1, 1e-3, -2e-3, 0.02, 0.03, 0.01, -0.005)


def views_of(lens, seed, n=12, focal=600.0, widest=0.35):
    """Views of a board that faces the camera from all directions up to an angle, in pixels of single precision."""
    rng, views = np.random.default_rng(seed), []
    camera = Camera.from_intrinsics((focal, 1.01 * focal), (325.0, 236.0), distortion=lens)
    while len(views) < n:
        side, angle = rng.uniform(0, 2 * np.pi), rng.uniform(0, widest)
        aside = angle * np.array([-np.sin(side), np.cos(side), 0])
        motor = pga3.motor_from_rotation_vector_translation(aside, np.zeros(3))
        for turn, place in (
            (np.zeros(3), [0, 0, rng.uniform(0.2, 0.5)]),
            (rng.uniform(-0.6, 0.6, 3), [0, 0, 0]),
        ):
            motor = pga3.motor_product(motor, pga3.motor_from_rotation_vector_translation(turn, np.array(place, float)))
        pixels = camera.project(pga3.move_point(motor, FLAT))
        if np.isfinite(pixels).all() and (pixels > 0).all() and (pixels < SIZE).all():
            views.append((pixels + 0.3 * rng.normal(size=pixels.shape)).astype(np.float32).astype(float))
    return camera, views


@pytest.mark.parametrize(
    "coefficients", [(-0.3,), (-0.05,), (-0.1,), (0.2,), (-0.25, 0.1, 0.003, -0.002), (-0.3, 0.12, 0, 0, -0.03)]
)
def test_the_minimum_is_that_of_calibrate_camera(coefficients: tuple[float, ...]) -> None:
    cv2 = pytest.importorskip("cv2")
    _, views = views_of(Distortion("brown", coefficients), 1)
    plane = BOARD.astype(np.float32).astype(float)
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 500, 1e-16)
    rms, k, bent, *_, deviations, _, of_views = cv2.calibrateCameraExtended(
        [FLAT.astype(np.float32)] * len(views), [v.astype(np.float32) for v in views], SIZE, None, None, criteria=stop
    )
    found = calibrate_from_planes(plane, views, distortion="brown")
    assert found.status == VisionStatus.OK and found.residual <= rms * (1 + 1e-9)
    assert found.residual == pytest.approx(rms, rel=1e-9)
    assert np.abs(found.intrinsics - k).max() < 1e-6 * k[0, 0]
    deviation = np.sqrt(np.diag(found.covariance))
    assert np.abs(deviation / deviations[:9, 0] - 1).max() < 1e-5
    assert np.abs((np.array(found.distortion.coefficients[:5]) - bent.ravel()) / deviation[4:]).max() < 1e-3
    assert np.abs(found.view_residuals / of_views.ravel() - 1).max() < 1e-5


@pytest.mark.parametrize("seed", range(3))
def test_the_minimum_is_that_of_fisheye_calibrate(seed: int) -> None:
    cv2 = pytest.importorskip("cv2")
    _, views = views_of(Distortion("fisheye", (-0.02, 0.003, 0.001, 0)), 10 + seed, focal=300.0, widest=0.6)
    flags = cv2.fisheye.CALIB_RECOMPUTE_EXTRINSIC | cv2.fisheye.CALIB_FIX_SKEW
    try:
        rms, k, bent, *_ = cv2.fisheye.calibrate(
            [FLAT[None]] * len(views), [v[None] for v in views], SIZE, np.eye(3), np.zeros(4), flags=flags,
            criteria=(3, 500, 1e-14),
        )  # fmt: skip
    except cv2.error as error:
        pytest.skip(f"OpenCV gives up: {error.err}")
    found = calibrate_from_planes(BOARD, views, distortion="fisheye")
    assert found.status == VisionStatus.OK and found.residual == pytest.approx(rms, rel=1e-9)
    assert np.abs(found.intrinsics - k).max() < 1e-6 * k[0, 0]
    off = np.subtract(found.distortion.coefficients, bent.ravel()) / np.sqrt(np.diag(found.covariance)[4:])
    assert np.abs(off).max() < 1e-3


def test_pixels_and_images_are_those_of_opencv() -> None:
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(4)
    pose = pga3.motor_from_rotation_vector_translation(np.array([0.1, 0.2, 0.3]), np.array([0.1, 0.2, -5.0]))
    points = rng.uniform(-1.5, 1.5, (60, 3))
    to_camera = np.linalg.inv(pga3.motor_to_matrix(pose))
    turn, shift = cv2.Rodrigues(to_camera[:3, :3])[0], np.ascontiguousarray(to_camera[:3, 3:])
    brown, fisheye = Distortion("brown", BROWN), Distortion("fisheye", (-0.02, 0.003, 0.001, -5e-4))
    bent = Camera.from_intrinsics((600.0, 610.0), (320.0, 240.0), pose, distortion=brown)
    round_ = Camera.from_intrinsics((600.0, 610.0), (320.0, 240.0), pose, distortion=fisheye)
    theirs, _ = cv2.projectPoints(points, turn, shift, bent.intrinsics, brown.array)
    assert np.abs(bent.project(points) - theirs[:, 0]).max() < 1e-10
    theirs, _ = cv2.fisheye.projectPoints(points[:, None], turn, shift, round_.intrinsics, fisheye.array)
    assert np.abs(round_.project(points) - theirs[:, 0]).max() < 1e-10
    x, y = np.meshgrid(np.arange(640.0), np.arange(480.0))
    maps = cv2.initUndistortRectifyMap(bent.intrinsics, brown.array, None, bent.intrinsics, SIZE, cv2.CV_32FC1)
    assert np.abs(bent.distort(np.stack([x, y], -1)) - np.stack(maps, -1)).max() < 1e-4
    image = cv2.GaussianBlur(rng.normal(size=(480, 640, 3)), (0, 0), 2)
    ours, theirs = undistort_image(image, bent), cv2.undistort(image, bent.intrinsics, brown.array)
    inside = np.isfinite(ours).all(-1)
    # OpenCV rounds places to 1/32 of a pixel.
    assert inside.mean() > 0.5 and np.abs(ours - theirs)[inside].max() < np.abs(image).max() / 32


def test_files_are_those_of_opencv_and_yaml(tmp_path) -> None:
    cv2 = pytest.importorskip("cv2")
    yaml = pytest.importorskip("yaml")
    path, camera = (
        tmp_path / "camera.yml",
        Camera.from_intrinsics((600 / 7, 5.0), (1 / 3, 2.0), distortion=Distortion("brown", BROWN)),
    )
    write_camera(path, camera, SIZE)
    file = cv2.FileStorage(str(path), cv2.FileStorage_READ)
    assert np.array_equal(file.getNode("camera_matrix").mat(), camera.intrinsics)
    assert np.array_equal(file.getNode("distortion_coefficients").mat().ravel(), BROWN)
    file.release()
    write_camera(path, camera, SIZE, format="ros")
    entries = yaml.safe_load(path.read_text())
    assert entries["distortion_model"] == "rational_polynomial" and entries["image_width"] == 640
    assert entries["camera_matrix"]["data"] == camera.intrinsics.ravel().tolist()
    file = cv2.FileStorage(str(path), cv2.FileStorage_WRITE)
    file.write("image_width", 640)
    file.write("image_height", 480)
    file.write("camera_matrix", camera.intrinsics)
    file.write("distortion_coefficients", np.array(BROWN)[:5, None])
    file.write("names", ["a.jpg", "b.jpg"])
    file.write("per_view", np.linspace(0, 1, 40))
    file.release()
    found, size = read_camera(path)
    assert size == SIZE and np.array_equal(found.intrinsics, camera.intrinsics)
    assert found.distortion == Distortion("brown", BROWN[:5])


def test_the_photographs_of_two_cameras_within_the_deviations_of_opencv() -> None:
    """Corners in the boards of stereo_calib, as stored in tests/support: the same minimum."""
    cv2 = pytest.importorskip("cv2")
    from tests.support import stereo_boards

    grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0)), -1).reshape(-1, 2)
    for corners in np.array(stereo_boards.CORNERS.split(), np.float32).reshape(2, 4, 54, 2):
        rms, k, *_ = cv2.calibrateCamera(
            [np.insert(grid, 2, 0, axis=1).astype(np.float32)] * 4, list(corners), (1024, 768), None, None,
            criteria=(3, 500, 1e-16),
        )  # fmt: skip
        found = calibrate_from_planes(grid, corners.astype(float), distortion="brown")
        assert found.status == VisionStatus.OK and found.residual == pytest.approx(rms, rel=1e-9)
        assert np.abs(found.intrinsics - k).max() < 1e-6 * k[0, 0]
