"""Every public function of vision on degenerate points: a status, an error or a result that is not finite.

There is one table for all functions. Combinations without a row have a reason in `NOT_APPLICABLE`.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Any

import numpy as np
import pytest
from selection import some_slow
from test_views import GRID, scene

import algorithms.vision as vision
from algorithms.vision import (
    MOTORCYCLE,
    Camera,
    DegenerateError,
    Distortion,
    HandEyeStatus,
    LandmarkMap,
    OmnidirectionalCamera,
    VisionStatus,
    fundamental,
)
from algorithms.vision.status import distinct
from generated import pga3
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]
RNG = np.random.default_rng(31)
CAMERAS, MATRICES, POINTS, PIXELS = scene(RNG, 4, 30)
K = CAMERAS[0].intrinsics
MIDDLE = K[:2, 2]
FLAT = [camera.project(POINTS * [1, 1, 0]) for camera in CAMERAS]
STRAIGHT = np.outer(np.linspace(-1, 1, 30), [1.0, 2, 3])
LINE = [camera.project(STRAIGHT) for camera in CAMERAS]
SPOILED = [np.where(np.arange(30)[:, None] == 7, np.nan, x) for x in PIXELS]
FAR = [np.where(np.arange(30)[:, None] == 7, np.inf, x) for x in PIXELS]
F, T = vision.fundamental_matrix(*CAMERAS[:2]), vision.trifocal_tensor(*CAMERAS[:3])
BOARD = [camera.project(np.insert(GRID * 0.1, 2, 0, axis=1)) for camera in CAMERAS]
MOTORS = pga3.motor_exponential(RNG.normal(size=(6, 6)))
X = pga3.motor_exponential(RNG.normal(size=6))
OTHERS = pga3.motor_product(pga3.motor_inverse(X), pga3.motor_product(MOTORS, X))
SCREWS = pga3.motor_exponential(np.linspace(0.2, 1, 6)[:, None] * np.array([0.3, 0, 0.4, 0, 0, 0.2]))
BAD_MOTORS = np.where(np.arange(6)[:, None] == 2, np.nan, MOTORS)
EYE = OmnidirectionalCamera.from_intrinsics(300.0, (320, 240), 1.0)
LENS = Camera.from_intrinsics(600.0, (320, 240), distortion=Distortion("brown", (-0.3,)))
RAYS = EYE.directions(RNG.uniform(200, 400, (10, 2)))
MAP = LandmarkMap.learn([RAYS[None]])
SIX = [x[:6] for x in PIXELS]
OUT = POINTS * np.where(np.arange(30)[:, None] == 7, [1, 1, 1], [1, 1, 0])  # all but one on a plane
NEARLY_FLAT = [camera.project(OUT) for camera in CAMERAS]
FEW = {n: np.arange(30) % n for n in (3, 6)}  # a few points, repeated
RANDOM = RNG.uniform(0, 600, (30, 2))
BEHIND = 2 * pga3.motor_to_matrix(CAMERAS[0].pose)[:3, 3] - POINTS  # the same lines of sight, behind the camera
SAME = [np.tile(x[:1], (30, 1)) for x in PIXELS]
NOISE = 0.3 * np.random.default_rng(32).normal(size=(4, 30, 2))
SEEN = [*(table.ravel() for table in np.indices((4, 30))), np.concatenate(PIXELS)]


class Result(Enum):
    """The required outcome of a call."""

    TOO_FEW = VisionStatus.TOO_FEW
    DEGENERATE = VisionStatus.DEGENERATE
    NOT_FINITE = VisionStatus.NOT_FINITE
    NO_CONSENSUS = VisionStatus.NO_CONSENSUS
    NOT_CONVERGED = VisionStatus.NOT_CONVERGED
    MOTIONS_TOO_FEW = HandEyeStatus.TOO_FEW * 10
    MOTIONS_PARALLEL = HandEyeStatus.PARALLEL_AXES * 10
    MOTIONS_SMALL = HandEyeStatus.SMALL_ANGLES * 10
    MOTIONS_NOT_FINITE = HandEyeStatus.NOT_FINITE * 10
    REFUSED = "ValueError"
    NAN = "a result that is not finite"
    UNDEFINED_THERE = "not finite for the point at fault, finite for the others"


R = Result
TABLE: list[tuple[str, Callable[[], Any], Result]] = [
    # F
    ("fundamental_matrix", lambda: vision.fundamental_matrix(PIXELS[0][:7], PIXELS[1][:7]), R.TOO_FEW),
    ("fundamental_matrix", lambda: vision.fundamental_matrix(*FLAT[:2]), R.DEGENERATE),
    ("fundamental_matrix", lambda: vision.fundamental_matrix(*LINE[:2]), R.DEGENERATE),
    ("fundamental_matrix", lambda: vision.fundamental_matrix(PIXELS[0], SPOILED[1]), R.NOT_FINITE),
    ("fundamental_matrix", lambda: vision.fundamental_matrix(FAR[0], PIXELS[1]), R.NOT_FINITE),
    ("fundamental_matrix", lambda: vision.fundamental_matrix(PIXELS[0], PIXELS[1][1:]), R.REFUSED),
    ("fundamental_matrix", lambda: vision.fundamental_matrix(FLAT[0][:7], FLAT[1][:7], "7-point"), R.DEGENERATE),
    ("fundamental_matrix", lambda: vision.fundamental_matrix(FLAT[0], FLAT[1], "robust"), R.DEGENERATE),
    ("fundamental_matrix", lambda: vision.fundamental_matrix(MATRICES[0], np.full((3, 4), np.nan)), R.REFUSED),
    ("fundamental_matrices", lambda: vision.fundamental_matrices(PIXELS[0][:7], PIXELS[1][:7]), R.TOO_FEW),
    ("fundamental_matrices", lambda: vision.fundamental_matrices(*FLAT[:2]), R.DEGENERATE),
    ("fundamental_matrices", lambda: vision.fundamental_matrices(*LINE[:2]), R.DEGENERATE),
    ("fundamental_matrices", lambda: vision.fundamental_matrices(PIXELS[0], SPOILED[1]), R.NOT_FINITE),
    ("fundamental_matrices", lambda: vision.fundamental_matrices(FAR[0], PIXELS[1]), R.NOT_FINITE),
    ("fundamental_matrices", lambda: vision.fundamental_matrices(PIXELS[0], PIXELS[1][1:]), R.REFUSED),
    ("robust_fundamental_matrix", lambda: vision.robust_fundamental_matrix(SIX[0], SIX[1]), R.TOO_FEW),
    ("robust_fundamental_matrix", lambda: vision.robust_fundamental_matrix(*FLAT[:2]), R.DEGENERATE),
    ("robust_fundamental_matrix", lambda: vision.robust_fundamental_matrix(*LINE[:2]), R.DEGENERATE),
    ("robust_fundamental_matrix", lambda: vision.robust_fundamental_matrix(PIXELS[0], SPOILED[1]), R.NOT_FINITE),
    ("robust_fundamental_matrix", lambda: vision.robust_fundamental_matrix(FAR[0], PIXELS[1]), R.NOT_FINITE),
    ("robust_fundamental_matrix", lambda: vision.robust_fundamental_matrix(PIXELS[0], PIXELS[1][1:]), R.REFUSED),
    # Relative poses
    ("relative_pose", lambda: vision.relative_pose(PIXELS[0][:4], PIXELS[1][:4], K), R.TOO_FEW),
    ("relative_pose", lambda: vision.relative_pose(*(x[FEW[3]] for x in PIXELS[:2]), K), R.TOO_FEW),
    ("relative_pose", lambda: vision.relative_pose(*LINE[:2], K), R.DEGENERATE),
    ("relative_pose", lambda: vision.relative_pose(PIXELS[0], PIXELS[0], K, threshold=1.0), R.DEGENERATE),
    ("relative_pose", lambda: vision.relative_pose(PIXELS[0], RANDOM, K, threshold=1.0), R.NO_CONSENSUS),
    ("relative_pose", lambda: vision.relative_pose(PIXELS[0], SPOILED[1], K), R.NOT_FINITE),
    ("relative_pose", lambda: vision.relative_pose(FAR[0], PIXELS[1], K, threshold=1.0), R.NOT_FINITE),
    ("relative_pose", lambda: vision.relative_pose(PIXELS[0], PIXELS[1][1:], K), R.REFUSED),
    # Homographies
    ("fundamental_matrix", lambda: vision.fundamental_matrix(*NEARLY_FLAT[:2]), R.DEGENERATE),
    ("fundamental_matrix", lambda: vision.fundamental_matrix(*(NEARLY_FLAT[:2] + NOISE[:2]), noise=0.3), R.DEGENERATE),
    ("fundamental_matrix", lambda: vision.fundamental_matrix(PIXELS[0][FEW[6]], PIXELS[1][FEW[6]]), R.DEGENERATE),
    ("fundamental_matrix", lambda: vision.fundamental_matrix(*SAME[:2]), R.DEGENERATE),
    ("robust_fundamental_matrix", lambda: vision.robust_fundamental_matrix(*NEARLY_FLAT[:2]), R.DEGENERATE),
    ("fundamental_matrices", lambda: vision.fundamental_matrices(*NEARLY_FLAT[:2]), R.DEGENERATE),
    ("homography", lambda: vision.homography(*(LINE[:2] + NOISE[:2])), R.DEGENERATE),
    ("homography", lambda: vision.homography(FLAT[0][FEW[3]] + NOISE[0], FLAT[1][FEW[3]] + NOISE[1]), R.DEGENERATE),
    ("localize", lambda: vision.localize(POINTS[FEW[3]], PIXELS[0][FEW[3]], K), R.TOO_FEW),
    ("localize", lambda: vision.localize(POINTS[FEW[3]], PIXELS[0][FEW[3]] + NOISE[0], K), R.TOO_FEW),
    ("camera_centre", lambda: vision.camera_centre(POINTS[FEW[3]], PIXELS[0][FEW[3]] + NOISE[0]), R.TOO_FEW),
    ("factorize", lambda: vision.factorize(SAME), R.DEGENERATE),
    ("hand_eye", lambda: vision.hand_eye(2 * MOTORS, OTHERS), R.REFUSED),
    ("homography", lambda: vision.homography(PIXELS[0][:3], PIXELS[1][:3]), R.TOO_FEW),
    ("homography", lambda: vision.homography(*LINE[:2]), R.DEGENERATE),
    ("homography", lambda: vision.homography(PIXELS[0], SPOILED[1]), R.NOT_FINITE),
    ("homography", lambda: vision.homography(FAR[0], PIXELS[1]), R.NOT_FINITE),
    ("homography", lambda: vision.homography(PIXELS[0], PIXELS[1][1:]), R.REFUSED),
    ("homographies", lambda: vision.homographies(PIXELS[0][:3], PIXELS[1][:3]), R.TOO_FEW),
    ("homographies", lambda: vision.homographies(*LINE[:2]), R.DEGENERATE),
    ("homographies", lambda: vision.homographies(LINE[0][:4], LINE[1][:4]), R.DEGENERATE),
    ("homographies", lambda: vision.homographies(PIXELS[0], SPOILED[1]), R.NOT_FINITE),
    ("homographies", lambda: vision.homographies(PIXELS[0], PIXELS[1][1:]), R.REFUSED),
    ("robust_homography", lambda: vision.robust_homography(PIXELS[0][:3], PIXELS[1][:3]), R.TOO_FEW),
    ("robust_homography", lambda: vision.robust_homography(*LINE[:2]), R.NO_CONSENSUS),
    ("robust_homography", lambda: vision.robust_homography(PIXELS[0], SPOILED[1]), R.NOT_FINITE),
    ("robust_homography", lambda: vision.robust_homography(FAR[0], PIXELS[1]), R.NOT_FINITE),
    ("robust_homography", lambda: vision.robust_homography(PIXELS[0], PIXELS[1][1:]), R.REFUSED),
    ("motions_of_plane", lambda: vision.motions_of_plane(np.ones((3, 3)), K), R.DEGENERATE),
    ("motions_of_plane", lambda: vision.motions_of_plane(np.full((3, 3), np.inf), K), R.NOT_FINITE),
    ("motions_of_plane", lambda: vision.motions_of_plane(K, K, pixels=SPOILED[0]), R.NOT_FINITE),
    ("motions_of_plane", lambda: vision.motions_of_plane(K, np.zeros((3, 3))), R.REFUSED),
    # Tensors and transfer
    ("trifocal_tensor", lambda: vision.trifocal_tensor(*SIX[:3]), R.TOO_FEW),
    ("trifocal_tensor", lambda: vision.trifocal_tensor(*FLAT[:3]), R.DEGENERATE),
    ("trifocal_tensor", lambda: vision.trifocal_tensor(*LINE[:3]), R.DEGENERATE),
    ("trifocal_tensor", lambda: vision.trifocal_tensor(*PIXELS[:2], SPOILED[2]), R.NOT_FINITE),
    ("trifocal_tensor", lambda: vision.trifocal_tensor(FAR[0], *PIXELS[1:3]), R.NOT_FINITE),
    ("trifocal_tensor", lambda: vision.trifocal_tensor(*PIXELS[:2], PIXELS[2][1:]), R.REFUSED),
    ("trifocal_tensor", lambda: vision.trifocal_tensor(MATRICES[0], MATRICES[0], MATRICES[0]), R.DEGENERATE),
    ("quadrifocal_tensor", lambda: vision.quadrifocal_tensor(*(x[:5] for x in PIXELS)), R.TOO_FEW),
    ("quadrifocal_tensor", lambda: vision.quadrifocal_tensor(*FLAT), R.DEGENERATE),
    ("quadrifocal_tensor", lambda: vision.quadrifocal_tensor(*LINE), R.DEGENERATE),
    ("quadrifocal_tensor", lambda: vision.quadrifocal_tensor(*PIXELS[:3], SPOILED[3]), R.NOT_FINITE),
    ("quadrifocal_tensor", lambda: vision.quadrifocal_tensor(*PIXELS[:3], PIXELS[3][1:]), R.REFUSED),
    ("transfer_point", lambda: vision.transfer_point(T, SPOILED[0], PIXELS[1]), R.UNDEFINED_THERE),
    ("transfer_point", lambda: vision.transfer_point(np.zeros((3, 3, 3)), PIXELS[0], PIXELS[1]), R.NAN),
    ("transfer_point", lambda: vision.transfer_point(T, PIXELS[0], PIXELS[1][1:]), R.REFUSED),
    ("transfer_line", lambda: vision.transfer_line(T, [1, np.nan, 3], [1, 2, 3]), R.NAN),
    ("transfer_line", lambda: vision.transfer_line(T, np.ones((2, 3)), np.ones((3, 3))), R.REFUSED),
    ("epipoles", lambda: vision.epipoles(np.full((3, 3), np.nan)), R.REFUSED),
    ("epipoles", lambda: vision.epipoles(np.outer([1, 2, 3], [1, 0, 2])), R.REFUSED),
    ("epipoles_of_tensor", lambda: vision.epipoles_of_tensor(np.full((3, 3, 3), np.nan)), R.REFUSED),
    ("epipolar_lines", lambda: vision.epipolar_lines(F, SPOILED[0]), R.UNDEFINED_THERE),
    ("epipolar_distance", lambda: vision.epipolar_distance(F, PIXELS[0], SPOILED[1]), R.UNDEFINED_THERE),
    ("epipolar_distance", lambda: vision.epipolar_distance(F, PIXELS[0], PIXELS[1][1:]), R.REFUSED),
    ("sampson_distance", lambda: vision.sampson_distance(F, PIXELS[0], SPOILED[1]), R.UNDEFINED_THERE),
    ("sampson_distance", lambda: vision.sampson_distance(F, PIXELS[0], PIXELS[1][1:]), R.REFUSED),
    ("triangulate", lambda: vision.triangulate(CAMERAS[:2], (PIXELS[0], SPOILED[1])), R.UNDEFINED_THERE),
    ("essential_matrices", lambda: vision.essential_matrices(PIXELS[0][:4], PIXELS[1][:4], K), R.TOO_FEW),
    ("essential_matrices", lambda: vision.essential_matrices(*FLAT[:2], K), R.DEGENERATE),
    ("essential_matrices", lambda: vision.essential_matrices(PIXELS[0], SPOILED[1], K), R.NOT_FINITE),
    ("essential_matrices", lambda: vision.essential_matrices(SIX[0], SIX[1], K), R.REFUSED),
    ("motions_of_essential", lambda: vision.motions_of_essential(np.zeros((3, 3))), R.DEGENERATE),
    ("motions_of_essential", lambda: vision.motions_of_essential(np.full((3, 3), np.nan)), R.NOT_FINITE),
    ("triangulate_views", lambda: vision.triangulate_views(CAMERAS[:2], PIXELS[:1]), R.REFUSED),
    (
        "metric_upgrade",
        lambda: vision.metric_upgrade(vision.factorize(PIXELS[:2]), PIXELS[:2], CAMERAS[0]),
        R.DEGENERATE,
    ),
    ("triangulate", lambda: vision.triangulate(MOTORCYCLE.cameras(), ([[0, 0]], [[31.086, 0]])), R.NAN),
    ("triangulate", lambda: vision.triangulate(CAMERAS[:2], (PIXELS[0], PIXELS[1][1:])), R.REFUSED),
    ("triangulate", lambda: vision.triangulate(CAMERAS[:1], PIXELS[:1]), R.REFUSED),
    ("triangulation", lambda: vision.triangulation(CAMERAS[:1], PIXELS[:1]), R.REFUSED),
    ("triangulation", lambda: vision.triangulation(CAMERAS[:2], PIXELS[:2], -1.0), R.REFUSED),
    # Depth, completion, pose
    ("projective_depths", lambda: vision.projective_depths(F, PIXELS[0], SPOILED[1]), R.UNDEFINED_THERE),
    ("projective_depths", lambda: vision.projective_depths(F, PIXELS[0], PIXELS[1][1:]), R.REFUSED),
    ("projective_depths", lambda: vision.projective_depths(np.eye(3), PIXELS[0], PIXELS[1]), R.REFUSED),
    ("complete_points", lambda: vision.complete_points(*(x[:5] for x in PIXELS[:3]), F), R.TOO_FEW),
    ("complete_points", lambda: vision.complete_points(*FLAT[:3], F), R.DEGENERATE),
    ("complete_points", lambda: vision.complete_points(*LINE[:3], F), R.DEGENERATE),
    ("complete_points", lambda: vision.complete_points(SPOILED[0], *PIXELS[1:3], F), R.NOT_FINITE),
    ("complete_points", lambda: vision.complete_points(*PIXELS[:2], FAR[2], F), R.NOT_FINITE),
    ("complete_points", lambda: vision.complete_points(*PIXELS[:2], PIXELS[2][1:], F), R.REFUSED),
    ("camera_centre", lambda: vision.camera_centre(POINTS[:5], PIXELS[0][:5]), R.TOO_FEW),
    ("camera_centre", lambda: vision.camera_centre(POINTS * [1, 1, 0], FLAT[0]), R.DEGENERATE),
    ("camera_centre", lambda: vision.camera_centre(STRAIGHT, LINE[0]), R.DEGENERATE),
    ("camera_centre", lambda: vision.camera_centre(POINTS, SPOILED[0]), R.NOT_FINITE),
    ("camera_centre", lambda: vision.camera_centre(POINTS, PIXELS[0][1:]), R.REFUSED),
    (
        "cameras_of_four_points",
        lambda: vision.cameras_of_four_points(STRAIGHT[::9], LINE[0][::9], (0, 0)),
        R.DEGENERATE,
    ),
    ("cameras_of_four_points", lambda: vision.cameras_of_four_points(POINTS, PIXELS[0], (0, 0)), R.REFUSED),
    ("cameras_of_four_points", lambda: vision.cameras_of_four_points(POINTS[5:9], FAR[0][5:9], (0, 0)), R.NOT_FINITE),
    ("poses_of_three_points", lambda: vision.poses_of_three_points(STRAIGHT[::12], LINE[0][::12], K), R.DEGENERATE),
    ("poses_of_three_points", lambda: vision.poses_of_three_points(POINTS, PIXELS[0], K), R.REFUSED),
    ("poses_of_three_points", lambda: vision.poses_of_three_points(POINTS[6:9], FAR[0][6:9], K), R.NOT_FINITE),
    ("localize", lambda: vision.localize(POINTS[:3], PIXELS[0][:3], K), R.TOO_FEW),
    ("localize", lambda: vision.localize(STRAIGHT, LINE[0], K), R.DEGENERATE),
    ("localize", lambda: vision.localize(POINTS, SPOILED[0], K), R.NOT_FINITE),
    ("localize", lambda: vision.localize(POINTS, FAR[0], K), R.NOT_FINITE),
    ("localize", lambda: vision.localize(POINTS, PIXELS[0][1:], K), R.REFUSED),
    ("localize", lambda: vision.localize(POINTS, RANDOM, K, threshold=1e-3), R.NO_CONSENSUS),
    ("localize", lambda: vision.localize(POINTS, RANDOM, K), R.NOT_CONVERGED),
    ("localize", lambda: vision.localize(BEHIND, PIXELS[0], K), R.NOT_CONVERGED),
    ("localize", lambda: vision.localize(POINTS, PIXELS[0], K, threshold=-1.0), R.REFUSED),
    ("localize", lambda: vision.localize(POINTS, PIXELS[0], K, threshold=1.0, confidence=1.0), R.REFUSED),
    ("localize", lambda: vision.localize(POINTS, PIXELS[0], K, threshold=1.0, max_samples=0), R.REFUSED),
    ("localizations", lambda: vision.localizations(POINTS[:3], PIXELS[0][:3], K), R.TOO_FEW),
    ("localizations", lambda: vision.localizations(STRAIGHT, LINE[0], K), R.DEGENERATE),
    ("localizations", lambda: vision.localizations(POINTS[FEW[3]], PIXELS[0][FEW[3]] + NOISE[0], K), R.TOO_FEW),
    ("localizations", lambda: vision.localizations(POINTS, RANDOM, K), R.NOT_CONVERGED),
    ("localizations", lambda: vision.localizations(BEHIND, PIXELS[0], K), R.NOT_CONVERGED),
    ("localizations", lambda: vision.localizations(POINTS, SPOILED[0], K), R.NOT_FINITE),
    ("localizations", lambda: vision.localizations(POINTS, PIXELS[0][1:], K), R.REFUSED),
    # Calibration
    ("calibrate_from_planes", lambda: vision.calibrate_from_planes(GRID, BOARD[:1]), R.TOO_FEW),
    ("calibrate_from_planes", lambda: vision.calibrate_from_planes(GRID[:3], [b[:3] for b in BOARD]), R.TOO_FEW),
    ("calibrate_from_planes", lambda: vision.calibrate_from_planes(GRID[:9], [b[:9] for b in BOARD]), R.DEGENERATE),
    ("calibrate_from_planes", lambda: vision.calibrate_from_planes(GRID, [BOARD[0]] * 3, True), R.DEGENERATE),
    ("calibrate_from_planes", lambda: vision.calibrate_from_planes(GRID, [BOARD[0] * np.nan, *BOARD]), R.NOT_FINITE),
    ("calibrate_from_planes", lambda: vision.calibrate_from_planes(GRID[1:], BOARD), R.REFUSED),
    ("calibrate_from_planes", lambda: vision.calibrate_from_planes(GRID, BOARD[:1], distortion="brown"), R.TOO_FEW),
    (
        "calibrate_from_planes",
        lambda: vision.calibrate_from_planes(GRID, [BOARD[0]] * 4, distortion="fisheye"),
        R.DEGENERATE,
    ),
    ("calibrate_from_planes", lambda: vision.calibrate_from_planes(GRID, BOARD, distortion="cubic"), R.REFUSED),
    ("calibrate_by_pascal", lambda: vision.calibrate_by_pascal(GRID, BOARD[:2]), R.TOO_FEW),
    ("calibrate_by_pascal", lambda: vision.calibrate_by_pascal(GRID[:9], [b[:9] for b in BOARD]), R.DEGENERATE),
    ("calibrate_by_pascal", lambda: vision.calibrate_by_pascal(GRID, [BOARD[0]] * 3), R.DEGENERATE),
    ("calibrate_by_pascal", lambda: vision.calibrate_by_pascal(GRID, [BOARD[0] * np.inf, *BOARD]), R.NOT_FINITE),
    ("calibrate_by_pascal", lambda: vision.calibrate_by_pascal(GRID[1:], BOARD), R.REFUSED),
    # Pairs and rigs
    ("calibrate_stereo", lambda: vision.calibrate_stereo(GRID, BOARD[:1], BOARD[:1], CAMERAS[0]), R.TOO_FEW),
    ("calibrate_stereo", lambda: vision.calibrate_stereo(GRID, [BOARD[0] * np.inf] * 2, BOARD[:2], LENS), R.NOT_FINITE),
    ("calibrate_stereo", lambda: vision.calibrate_stereo(GRID, BOARD, BOARD[:1], CAMERAS[0]), R.REFUSED),
    ("rectify", lambda: vision.rectify(CAMERAS[0], CAMERAS[0], (640, 480)), R.DEGENERATE),
    ("rectify", lambda: vision.rectify(CAMERAS[0], CAMERAS[1], (640, 0)), R.REFUSED),
    ("localize_rig", lambda: vision.localize_rig(POINTS[:3], PIXELS[0][:3], CAMERAS, [0, 0, 0]), R.TOO_FEW),
    ("localize_rig", lambda: vision.localize_rig(STRAIGHT, LINE[0], CAMERAS, np.zeros(30, int)), R.DEGENERATE),
    ("localize_rig", lambda: vision.localize_rig(POINTS, SPOILED[0], CAMERAS, np.zeros(30, int)), R.NOT_FINITE),
    ("localize_rig", lambda: vision.localize_rig(POINTS, PIXELS[0], CAMERAS, np.full(30, 9)), R.REFUSED),
    # Unknown focal lengths; test_focal_lengths.py has the arrangements that leave them undetermined.
    ("localize_unknown_focal", lambda: vision.localize_unknown_focal(POINTS[:4], PIXELS[0][:4], MIDDLE), R.TOO_FEW),
    ("localize_unknown_focal", lambda: vision.localize_unknown_focal(STRAIGHT, LINE[0], MIDDLE), R.DEGENERATE),
    ("localize_unknown_focal", lambda: vision.localize_unknown_focal(POINTS, FAR[0], MIDDLE), R.NOT_FINITE),
    ("localize_unknown_focal", lambda: vision.localize_unknown_focal(POINTS, PIXELS[0], [0.0]), R.REFUSED),
    ("relative_pose_unknown_focal", lambda: vision.relative_pose_unknown_focal(SAME[0], SAME[1], MIDDLE), R.TOO_FEW),
    ("relative_pose_unknown_focal", lambda: vision.relative_pose_unknown_focal(*FLAT[:2], MIDDLE), R.DEGENERATE),
    ("relative_pose_unknown_focal", lambda: vision.relative_pose_unknown_focal(*LINE[:2], MIDDLE), R.DEGENERATE),
    ("relative_pose_unknown_focal", lambda: vision.relative_pose_unknown_focal(*FAR[:2], MIDDLE), R.NOT_FINITE),
    ("relative_pose_unknown_focal", lambda: vision.relative_pose_unknown_focal(*PIXELS[:2], [0.0]), R.REFUSED),
    # Hand and eye
    ("hand_eye", lambda: vision.hand_eye(MOTORS[:1], OTHERS[:1]), R.MOTIONS_TOO_FEW),
    ("hand_eye", lambda: vision.hand_eye(SCREWS, SCREWS), R.MOTIONS_PARALLEL),
    ("hand_eye", lambda: vision.hand_eye(np.eye(8)[[0, 0, 0]], np.eye(8)[[0, 0, 0]]), R.MOTIONS_SMALL),
    ("hand_eye", lambda: vision.hand_eye(BAD_MOTORS, OTHERS), R.MOTIONS_NOT_FINITE),
    ("hand_eye", lambda: vision.hand_eye(MOTORS, OTHERS[1:]), R.REFUSED),
    ("hand_eye_from_poses", lambda: vision.hand_eye_from_poses(MOTORS[:2], OTHERS[:2]), R.MOTIONS_TOO_FEW),
    ("hand_eye_from_poses", lambda: vision.hand_eye_from_poses(SCREWS, SCREWS), R.MOTIONS_PARALLEL),
    (
        "hand_eye_from_poses",
        lambda: vision.hand_eye_from_poses(MOTORS[:3], np.full((3, 8), np.nan)),
        R.MOTIONS_NOT_FINITE,
    ),
    ("hand_eye_from_poses", lambda: vision.hand_eye_from_poses(MOTORS, OTHERS[1:]), R.REFUSED),
    (
        "calibrate_endoscope",
        lambda: vision.calibrate_endoscope(MOTORS[:2], POINTS, np.stack([PIXELS[0]] * 2), K),
        R.MOTIONS_TOO_FEW,
    ),
    (
        "calibrate_endoscope",
        lambda: vision.calibrate_endoscope(MOTORS[:4], STRAIGHT, np.stack(LINE), K),
        R.MOTIONS_NOT_FINITE,
    ),
    (
        "calibrate_endoscope",
        lambda: vision.calibrate_endoscope(MOTORS[:4], POINTS, np.stack(SPOILED), K),
        R.MOTIONS_NOT_FINITE,
    ),
    ("calibrate_endoscope", lambda: vision.calibrate_endoscope(MOTORS[:3], POINTS, np.stack(PIXELS), K), R.REFUSED),
    # Invariants
    ("cross_ratio", lambda: vision.cross_ratio(np.zeros((3, 1))), R.REFUSED),
    ("cross_ratio", lambda: vision.cross_ratio([[0.0], [0.0], [0.0], [1.0]]), R.NAN),
    ("cross_ratio", lambda: vision.cross_ratio(np.outer(np.arange(5.0), [1, 2])), R.NAN),
    ("cross_ratio", lambda: vision.cross_ratio([[0.0], [np.nan], [2.0], [1.0]]), R.NAN),
    ("permutation_invariant", lambda: vision.permutation_invariant([np.nan]), R.NAN),
    ("p2_invariants", lambda: vision.p2_invariants(np.zeros((4, 2))), R.REFUSED),
    ("p2_invariants", lambda: vision.p2_invariants(np.outer(np.arange(5.0), [1, 2])), R.NAN),
    ("p2_invariants", lambda: vision.p2_invariants(np.full((5, 2), np.nan)), R.NAN),
    ("invariants_3d_deviation", lambda: vision.invariants_3d_deviation(*SIX[:2]), R.REFUSED),
    ("invariants_3d_deviation", lambda: vision.invariants_3d_deviation(*SIX[:2], fundamental=F * np.nan), R.REFUSED),
    ("invariants_3d_deviation", lambda: vision.invariants_3d_deviation(SIX[0], SIX[1] * np.nan, fundamental=F), R.NAN),
    ("invariants_3d", lambda: vision.invariants_3d(np.zeros((5, 3))), R.REFUSED),
    ("invariants_3d", lambda: vision.invariants_3d(POINTS[:6] * [1, 1, 0]), R.NAN),
    ("invariants_3d", lambda: vision.invariants_3d(STRAIGHT[:6]), R.NAN),
    ("invariants_3d", lambda: vision.invariants_3d(*SIX[:2]), R.REFUSED),
    ("invariants_3d", lambda: vision.invariants_3d(SIX[0], SIX[1] * np.nan, fundamental=F), R.NAN),
    ("invariants_3d", lambda: vision.invariants_3d(*SIX[:2], fundamental=F * np.nan), R.REFUSED),
    ("invariants_3d", lambda: vision.invariants_3d(*SIX[:2], SIX[2] * np.nan, tensor=T), R.NAN),
    ("invariants_3d", lambda: vision.invariants_3d(SIX[0], SIX[1][1:], fundamental=F), R.REFUSED),
    ("conic_value", lambda: vision.conic_value(np.ones(6), SPOILED[0]), R.UNDEFINED_THERE),
    # Shape and motion
    ("factorize", lambda: vision.factorize(np.stack(PIXELS)[:1]), R.TOO_FEW),
    ("factorize", lambda: vision.factorize(np.stack(PIXELS)[:, :7]), R.TOO_FEW),
    ("factorize", lambda: vision.factorize(np.stack(FLAT)), R.DEGENERATE),
    ("factorize", lambda: vision.factorize(np.stack(LINE)), R.DEGENERATE),
    ("factorize", lambda: vision.factorize(np.stack(FAR)), R.NOT_FINITE),
    ("factorize", lambda: vision.factorize(np.stack(PIXELS), np.ones((4, 29), bool)), R.REFUSED),
    # Bundles; test_bundle_status.py has the statuses, with which cameras and points remain as they are.
    ("bundle_adjust", lambda: vision.bundle_adjust(CAMERAS, POINTS, SEEN, fixed_points=[-1]), R.REFUSED),
    ("bundle_adjust", lambda: vision.bundle_adjust(CAMERAS, POINTS[:2], SEEN), R.REFUSED),
    # Classes
    ("Camera", lambda: Camera.from_intrinsics(np.nan, (0, 0)), R.REFUSED),
    ("Camera", lambda: CAMERAS[0].project(np.where(np.arange(30)[:, None] == 7, np.nan, POINTS)), R.UNDEFINED_THERE),
    ("Camera", lambda: LENS.project([[9.0, 0, 1]]), R.NAN),
    ("Camera", lambda: LENS.undistort(SPOILED[0] / 100 + 300), R.UNDEFINED_THERE),
    ("Distortion", lambda: Distortion("cubic", ()), R.REFUSED),  # type: ignore[arg-type]
    ("Distortion", lambda: Distortion("brown", (-0.3,)).distort([2.0, 0, 1]), R.NAN),
    ("undistort_image", lambda: vision.undistort_image(np.zeros(5), LENS), R.REFUSED),
    ("read_camera", lambda: vision.read_camera(__file__), R.REFUSED),
    ("write_camera", lambda: vision.write_camera("nowhere.yml", LENS, format="ros"), R.REFUSED),
    ("OmnidirectionalCamera", lambda: EYE.project([[0, 0, 0.0]]), R.NAN),
    ("OmnidirectionalCamera", lambda: EYE.directions(SPOILED[0]), R.UNDEFINED_THERE),
    ("OmnidirectionalCamera", lambda: EYE.conic_of_line([0, 0, 1.0], [0, 0, 2.0]), R.NAN),
    ("OmnidirectionalCamera", lambda: EYE.circle_of_line([0, 0, 1.0], [0, 0, 2.0])[1], R.NAN),
    ("RectifiedPair", lambda: MOTORCYCLE.depth([[np.nan, np.inf], [-40.0, np.nan]]), R.NAN),
    ("conic_through_points", lambda: vision.conic_through_points(LINE[0][:5]), R.DEGENERATE),
    ("conic_through_points", lambda: vision.conic_through_points(SAME[0][:5]), R.DEGENERATE),
    ("conic_through_points", lambda: vision.conic_through_points(SPOILED[0][5:10]), R.NOT_FINITE),
    ("conic_through_points", lambda: vision.conic_through_points(PIXELS[0][:4]), R.REFUSED),
    ("LandmarkMap", lambda: LandmarkMap.learn([RAYS[None, :7]]), R.TOO_FEW),
    ("LandmarkMap", lambda: LandmarkMap.learn([np.linspace(RAYS[0], RAYS[1], 9)[None]]), R.DEGENERATE),
    ("LandmarkMap", lambda: LandmarkMap.learn([RAYS[None] * np.nan]), R.NOT_FINITE),
    ("LandmarkMap", lambda: LandmarkMap.learn([RAYS]), R.REFUSED),
    ("LandmarkMap", lambda: MAP.recognize(RAYS[:7], 1e-3), R.TOO_FEW),
    ("LandmarkMap", lambda: MAP.recognize(np.linspace(RAYS[0], RAYS[1], 9), 1e-3), R.DEGENERATE),
    ("LandmarkMap", lambda: MAP.recognize(RAYS * np.nan, 1e-3), R.NOT_FINITE),
    ("localize_by_landmarks", lambda: vision.localize_by_landmarks(MAP, [RAYS], [], 1e-3), R.TOO_FEW),
    ("localize_by_landmarks", lambda: vision.localize_by_landmarks(MAP, [RAYS[1:]], [RAYS], 1e-3), R.REFUSED),
]

NOT_APPLICABLE = {
    "Triangulation": "a result",
    "MOTORCYCLE": "a constant",
    "BalProblem": "a problem as it is in a file",
    "BatchEstimate": "a result",
    "BundleAdjustment": "a result",
    "BundleProblem": "arguments",
    "BundleStep": "a report",
    "ColmapCamera": "a line of a file",
    "ColmapImage": "two lines of a file",
    "ColmapModel": "a model as it is in files",
    "ColmapPoint": "a line of a file",
    "ConicThroughPoints": "a result",
    "DegenerateError": "an error",
    "Factorization": "a result",
    "FocalLocalization": "a result",
    "FocalMotion": "a result",
    "HandEye": "a result",
    "HandEyeOfPoses": "a result",
    "HandEyeStatus": "a status",
    "LandmarkPose": "a result",
    "Localization": "a result",
    "Observations": "arguments",
    "PlaneCalibration": "a result",
    "PlaneMotions": "a result",
    "Recognition": "a result",
    "Rectification": "a result",
    "StereoCalibration": "a result",
    "RelativePose": "a result",
    "RobustEstimate": "a result",
    "VisionStatus": "a status",
    "read_bal": "a file, which test_bundle_files.py spoils",
    "read_colmap": "files, which test_bundle_files.py spoils",
    "write_bal": "a file",
    "write_colmap": "files",
}


def test_the_table_has_all_public_functions() -> None:
    assert {name for name, _, _ in TABLE} | set(NOT_APPLICABLE) == set(vision.__all__)
    assert not {name for name, _, _ in TABLE} & set(NOT_APPLICABLE)


@all_cases("name, call, expected", TABLE)
def test_wrong_results_are_reported(name: str, call: Callable[[], Any], expected: Result) -> None:
    with np.errstate(all="ignore"):
        if expected == Result.REFUSED:
            with pytest.raises(ValueError, match=r"expected|broadcast") as refused:
                call()
            assert not isinstance(refused.value, DegenerateError)
            return
        try:
            found = call()
        except DegenerateError as error:
            assert isinstance(expected.value, VisionStatus) and error.status == expected.value
            return
    if expected == Result.NAN:
        assert not np.isfinite(found).any() or (name == "invariants_3d" and not np.isfinite(found).all())
    elif expected == Result.UNDEFINED_THERE:
        rows = np.asarray(found).reshape(30, -1)
        assert not np.isfinite(rows[7]).all() and np.isfinite(np.delete(rows, 7, 0)).all()
    else:
        code = expected.value if isinstance(expected.value, VisionStatus) else HandEyeStatus(int(expected.value) // 10)
        assert found.status == code
        # No model, or one of several solutions if motions allow several.
        model = next(getattr(found, k) for k in MODELS if hasattr(found, k))
        reported = isinstance(code, HandEyeStatus) and expected in (Result.MOTIONS_PARALLEL, Result.MOTIONS_SMALL)
        assert reported or name == "LandmarkMap" or not np.isfinite(model).any()


MODELS = ("coefficients", "motor", "models", "model", "pose", "intrinsics", "pixels", "landmark")


def test_minus_zero_is_equal_to_zero() -> None:
    signs = np.array([[0.0, 0], [-0.0, 0], [0, -0.0], [-0.0, -0.0]])
    assert distinct(signs, 4) == 1 and distinct(np.vstack([signs, [[0, 1]]]), 4) == 2
    places = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    places = np.vstack([places, places[:1] * [-1, 1, 1]])
    assert vision.localize(places, CAMERAS[0].project(places), K).status == VisionStatus.TOO_FEW


def test_a_pixel_on_both_epipoles_has_no_influence() -> None:
    """Its distance is 0 / 0."""
    exact = vision.fundamental_matrix(*PIXELS[:2])
    left, _, right = np.linalg.svd(exact)
    pair = [(v[:2] / v[2])[None] for v in (right[2], left[:, 2])]
    noisy = [pixels + noise for pixels, noise in zip(PIXELS[:2], NOISE[:2], strict=True)]
    spoiled = [np.concatenate(both) for both in zip(noisy, pair, strict=True)]
    start = exact + 1e-9
    found, known = fundamental.refined(start, *spoiled), fundamental.refined(start, *noisy)
    before, after, best = (np.sum(vision.sampson_distance(each, *noisy) ** 2) for each in (start, found, known))
    assert np.isfinite(found).all() and after < before and after < 1.5 * best


def seen_twice(rng: np.random.Generator, points: Array, base: float, noise: float = 1.0) -> Array:
    """Pixels (2, ..., n, 2) with noise, of cameras at this baseline and six units from the points."""
    views = []
    for k in (-0.5, 0.5):
        turn = pga3.rotor_to_matrix(pga3.rotor_from_rotation_vector([0.02, -k * base / 6, 0.05 * k]))
        seen = (points - [k * base, 0.1 * k * base, -6]) @ np.transpose(turn)
        views.append(700 * seen[..., :2] / seen[..., 2:] + [320, 240])
    return np.array(views) + noise * rng.normal(size=(2, *views[0].shape))


def refused(pairs: Array, noise: float | None = None) -> float:
    """The share of point sets that do not determine F, one by one and in a batch; the batch has no refinement."""
    status = vision.fundamental_matrices(*pairs, noise).status
    alone = 0
    for first, second in zip(pairs[0][:10], pairs[1][:10], strict=True):
        try:
            vision.fundamental_matrix(first, second, noise=noise)
        except DegenerateError as error:
            assert error.status == VisionStatus.DEGENERATE
            alone += 1
    assert abs(alone - np.sum(status[:10] != VisionStatus.OK)) <= 1
    return float(np.mean(status != VisionStatus.OK))


ENOUGH = [(8, 0.02), (9, 0.02), (10, 0.01), (12, 0.0), (20, 0.0)]


@pytest.mark.parametrize(("n_points", "allowed"), some_slow(ENOUGH, *ENOUGH[1:]))
def test_few_good_points_suffice(n_points: int, allowed: float) -> None:
    """Scenes at half a pixel and one pixel of noise; planes and lines of as many points are rejected."""
    rng = np.random.default_rng(n_points)
    points = rng.uniform(-1, 1, (100, n_points, 3)) * [2, 1.5, 1.5]
    flat, line = points * [1, 1, 0] + points[..., :1] * [0, 0, 0.3], points[..., :1] * [1, 0.5, 0.3]
    for noise, of_planes in ((0.5, 0.99), (1.0, 0.95)):
        for known in (None, noise):
            assert refused(seen_twice(rng, points, 1.5, noise), known) <= allowed
            assert refused(seen_twice(rng, flat, 1.5, noise), known) >= (of_planes if known is None else 0.99)
            assert refused(seen_twice(rng, line, 1.5, noise), known) >= (of_planes if known is None else 0.99)


@pytest.mark.parametrize("n_points", some_slow([10, 15, 20], 15, 20))
def test_repeated_points_and_planes_except_one_point_if_noise_is_known(n_points: int) -> None:
    rng = np.random.default_rng(n_points)
    points = rng.uniform(-1, 1, (200, n_points, 3)) * [2, 1.5, 1.5]
    repeated = seen_twice(rng, points, 1.5)[..., np.arange(n_points) % 6, :]
    repeated = repeated + rng.normal(size=repeated.shape)
    assert refused(repeated, np.sqrt(2)) > 0.95
    points[:, 1:, 2] = 0.3 * points[:, 1:, 0]
    assert refused(seen_twice(rng, points, 1.5), 1.0) > 0.95
    exact = seen_twice(rng, points, 1.5, 0.0)
    assert refused(exact) == 1.0
    assert refused(exact[..., np.arange(n_points) % 6, :]) == 1.0


@all_cases("far", [1.0, 1e4])
@all_cases(
    "name, call",
    [
        ("fundamental_matrix", lambda x: vision.fundamental_matrix(*x[:2])),
        ("homography", lambda x: vision.homography(*x[:2])),
        ("trifocal_tensor", lambda x: vision.trifocal_tensor(*x[:3])),
        ("factorize", lambda x: vision.factorize(x)),
        ("conic_through_points", lambda x: vision.conic_through_points(x[0][:5])),
    ],
)
def test_rounding_of_the_same_pixel_determines_nothing(name: str, call: Callable[[Any], Any], far: float) -> None:
    rng = np.random.default_rng(33)
    for k in range(20):
        pixels = [far * x * (1 + np.finfo(float).eps * rng.integers(-1, 2, x.shape) * (k > 0)) for x in SAME]
        try:
            status = call(pixels).status
        except DegenerateError as error:
            status = error.status
        assert status == VisionStatus.DEGENERATE, name
