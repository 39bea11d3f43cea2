"""Pixels and points in the shape (n, 1, d) of OpenCV's, and in single precision."""

from typing import Any

import numpy as np

from algorithms.vision import (
    Camera,
    calibrate_from_planes,
    calibrate_stereo,
    camera_centre,
    cameras_of_four_points,
    fundamental_matrix,
    homography,
    localize,
    localize_rig,
    localize_unknown_focal,
    motions_of_plane,
    poses_of_three_points,
    relative_pose,
    relative_pose_unknown_focal,
    robust_fundamental_matrix,
    robust_homography,
)
from generated import pga3
from tests.support.all_cases import all_cases

RNG = np.random.default_rng(120)
CENTRE = (320.0, 240.0)
VIEWS = [
    Camera.from_intrinsics(
        600.0, CENTRE, pga3.motor_from_rotation_vector_translation(turn * np.array([0.2, 1, 0.1]), np.array(place))
    )
    for turn, place in ((0.1, [-1.0, 0.5, -6]), (-0.1, [1.0, -0.2, -5]))
]
K = VIEWS[0].intrinsics
POINTS = RNG.normal(size=(40, 3))
FLAT = POINTS * [1, 1, 0]
BOARD = np.stack(np.meshgrid(np.arange(6.0), np.arange(5.0)), -1).reshape(-1, 2) / 4
A, B = (view.project(POINTS) for view in VIEWS)
C, D = (view.project(FLAT) for view in VIEWS)
POSES = pga3.motor_from_rotation_vector_translation(RNG.uniform(-0.5, 0.5, (5, 3)), np.array([-0.5, -0.5, 4.0]))
SEEN = [Camera(K, np.eye(8)[0]).project(pga3.move_point(pose, np.insert(BOARD, 2, 0, axis=1))) for pose in POSES]
EYE = Camera(K, np.eye(8)[0])

CALLS: dict[str, Any] = {
    "fundamental_matrix": lambda f: fundamental_matrix(f(A), f(B)),
    "robust_fundamental_matrix": lambda f: robust_fundamental_matrix(f(A), f(B)).model,
    "homography": lambda f: homography(f(C), f(D)),
    "robust_homography": lambda f: robust_homography(f(C), f(D)).model,
    "motions_of_plane": lambda f: motions_of_plane(homography(C, D), K, pixels=f(C)).motors,
    "localize": lambda f: localize(f(POINTS), f(A), K).pose,
    "localize with a threshold": lambda f: localize(f(POINTS), f(A), K, threshold=2.0).pose,
    "localize_unknown_focal": lambda f: localize_unknown_focal(f(POINTS), f(A), CENTRE).pose,
    "localize_rig": lambda f: localize_rig(f(POINTS), f(A), [EYE], np.zeros(40, int)).pose,
    "poses_of_three_points": lambda f: poses_of_three_points(f(POINTS[:3]), f(A[:3]), K),
    "cameras_of_four_points": lambda f: cameras_of_four_points(f(POINTS[:4]), f(A[:4]), CENTRE)[0],
    "camera_centre": lambda f: camera_centre(f(POINTS), f(A)),
    "relative_pose": lambda f: relative_pose(f(A), f(B), K).motor,
    "relative_pose_unknown_focal": lambda f: relative_pose_unknown_focal(f(A), f(B), CENTRE).motor,
    "calibrate_from_planes": lambda f: calibrate_from_planes(BOARD, [f(view) for view in SEEN]).intrinsics,
    "calibrate_stereo": lambda f: calibrate_stereo(BOARD, [f(v) for v in SEEN], [f(v) for v in SEEN], EYE).motor,
}


@all_cases("name", sorted(CALLS))
def test_columns_are_sets_of_points(name: str) -> None:
    plain, columns = CALLS[name](lambda x: x), CALLS[name](lambda x: x[:, None])
    assert np.isfinite(plain).any() and np.array_equal(plain, columns, equal_nan=True)


@all_cases("name", sorted(CALLS))
def test_single_precision_gives_the_result_of_the_rounded_numbers(name: str) -> None:
    single = CALLS[name](lambda x: x.astype(np.float32))
    rounded = CALLS[name](lambda x: x.astype(np.float32).astype(np.float64))
    scale = np.nanmax(np.abs(rounded))
    assert np.isfinite(rounded).any() and np.allclose(single, rounded, atol=1e-5 * scale, equal_nan=True)
