"""Stereo calibration, rectification and rigs against OpenCV and PoseLib on the same pixels."""

from __future__ import annotations

import numpy as np
import pytest
from rig_scenes import BOARD, PAIR, motor, offsets, rig, seen_by, stereo_views

from algorithms.vision import Camera, Distortion, VisionStatus, calibrate_stereo, localize_rig, rectify
from generated import pga3

pytestmark = pytest.mark.peers


def test_the_motion_between_cameras_is_as_near_as_that_of_opencv() -> None:
    """Errors in units of the covariance; the noise of the cameras differs by a factor of two."""
    cv2 = pytest.importorskip("cv2")
    ours, theirs = [], []
    plane = np.insert(BOARD, 2, 0, axis=1).astype(np.float32)
    for seed in range(10):
        first, second, motion = stereo_views(np.random.default_rng([70, seed]), 6)
        found = calibrate_stereo(BOARD, first, second, *PAIR)
        views = [[v.astype(np.float32)[:, None] for v in each] for each in (first, second)]
        lenses = [(c.intrinsics, c.distortion.array[:5] if c.distortion else np.zeros(5)) for c in PAIR]
        result = cv2.stereoCalibrate(
            [plane] * 6, *views, *lenses[0], *lenses[1], (1280, 800), flags=cv2.CALIB_FIX_INTRINSIC
        )
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = result[5], result[6][:, 0]
        weight = np.linalg.inv(found.covariance)
        for own, kept in ((found.motor, ours), (pga3.motor_from_matrix(matrix), theirs)):
            off = offsets(np.asarray(own), motion)
            kept.append(off @ weight @ off)
        assert abs(offsets(np.asarray(pga3.motor_from_matrix(matrix)), found.motor)).max() < 0.01
    assert np.mean(ours) < 1.1 * np.mean(theirs)


@pytest.mark.parametrize("lens", [None, Distortion("brown", (-0.2, 0.05, 1e-3, -2e-3))])
def test_maps_are_those_of_opencv_and_rotations_are_near(lens: Distortion | None) -> None:
    cv2 = pytest.importorskip("cv2")
    first = Camera.from_intrinsics((800.0, 790.0), (640, 400), distortion=lens)
    second = Camera.from_intrinsics(700.0, (630, 410), motor([0.05, -0.1, 0.08], [1.0, 0.1, 0.2]), distortion=lens)
    found = rectify(first, second, (1280, 800))
    coefficients = lens.array[:4] if lens else np.zeros(4)
    for k, camera in enumerate((first, second)):
        table = cv2.initUndistortRectifyMap(
            camera.intrinsics, coefficients, found.rotations[k], found.cameras[k].intrinsics, found.size, cv2.CV_32FC1
        )
        own = found.map(k)
        seen = np.isfinite(own).all(-1)
        assert np.abs(np.stack(table, -1) - own)[seen].max() < 0.01 and seen.mean() > 0.5  # float32
    back = pga3.motor_to_matrix(pga3.motor_inverse(second.pose))
    result = cv2.stereoRectify(
        first.intrinsics, coefficients, second.intrinsics, coefficients, (1280, 800), back[:3, :3], back[:3, 3], alpha=1
    )
    for turn, own in zip(result[:2], found.rotations, strict=True):
        assert np.degrees(np.arccos((np.trace(turn.T @ own) - 1) / 2)) < 2  # the z axes differ
        assert np.allclose(turn[0], own[0], atol=1e-9)  # the line between the centres


@pytest.mark.parametrize("wrong", [0.3, 0.6, 0.8])
def test_poses_of_rigs_are_as_accurate_as_those_of_poselib(wrong: float) -> None:
    poselib = pytest.importorskip("poselib")
    model = {"model": "PINHOLE", "width": 640, "height": 480, "params": [700.0, 700.0, 320.0, 240.0]}
    ours, theirs = [], []
    for seed in range(20):
        rng = np.random.default_rng([71, round(10 * wrong), seed])
        cameras, pose = rig(rng), motor(rng.normal(size=3), rng.normal(size=3))
        points, pixels, which, _ = seen_by(rng, cameras, pose, 200, wrong=wrong)
        found = localize_rig(points, pixels, cameras, which, threshold=2.0)
        assert found.status == VisionStatus.OK
        inside = []
        for camera in cameras:
            back = pga3.motor_to_matrix(pga3.motor_inverse(camera.pose))
            inside.append(poselib.CameraPose())
            inside[-1].R, inside[-1].t = back[:3, :3], back[:3, 3]
        parts = [[each[which == k] for k in range(3)] for each in (pixels, points)]
        options = {"max_reproj_error": 2.0, "success_prob": 0.999}
        other, _ = poselib.estimate_generalized_absolute_pose(*parts, inside, [model] * 3, options, {})
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = other.R, other.t
        ours.append(np.linalg.norm(offsets(found.pose, pose)))
        theirs.append(np.linalg.norm(offsets(np.asarray(pga3.motor_inverse(pga3.motor_from_matrix(matrix))), pose)))
    assert np.exp(np.mean(np.log(ours) - np.log(theirs))) < 1.1
