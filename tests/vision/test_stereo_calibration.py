"""The motion between two cameras from boards that both see: known pairs, wrong views, missing corners, refusals."""

import numpy as np
import pytest
from rig_scenes import BOARD, PAIR, motor, offsets, stereo_views

from algorithms.vision import VisionStatus, calibrate_from_planes, calibrate_stereo
from generated import pga3
from tests.support import stereo_boards

GRID = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0)), -1).reshape(-1, 2)


def test_exact_boards_give_the_exact_motion_and_poses():
    first, second, motion = stereo_views(np.random.default_rng(50), 3, noise=0.0)
    found = calibrate_stereo(BOARD, first, second, *PAIR)
    assert found.status == VisionStatus.OK and found.inliers.all() and found.residual < 1e-6
    assert np.abs(offsets(found.motor, motion)).max() < 1e-8
    points = pga3.move_point(found.poses[1], np.insert(BOARD, 2, 0, axis=1))
    assert np.abs(found.cameras[0].project(points) - first[1]).max() < 1e-5
    # The second camera is in the frame of the first, so that it projects points of that frame.
    assert np.abs(found.cameras[1].project(points) - second[1]).max() < 1e-5


def test_errors_have_the_stated_covariance_in_any_unit():
    squares = []
    for seed, unit in enumerate([1.0] * 4 + [1e-3, 1e-3, 1e3, 1e3]):
        first, second, motion = stereo_views(np.random.default_rng([51, seed]), 4)
        found = calibrate_stereo(unit * BOARD, first, second, *PAIR)
        assert found.status == VisionStatus.OK and found.inliers.all()
        off = offsets(found.motor, motion)
        off[3:] = pga3.motor_to_matrix(found.motor)[:3, 3] - unit * pga3.motor_to_matrix(motion)[:3, 3]
        squares.append(off @ np.linalg.solve(found.covariance, off))
    # The mean of eight sums of six squares is between 2.7 and 10.9 with a probability of 0.999.
    assert 2.7 < np.mean(squares) < 10.9 and np.allclose(found.view_residuals.mean(0), [0.42, 0.85], rtol=0.1)


def test_views_of_another_instant_and_corners_from_another_side_are_left_out():
    first, second, motion = stereo_views(np.random.default_rng(52), 9)
    second[0] = second[0] + [9.0, -14.0]
    second[3] = second[3][::-1]
    first[5] = first[5] + [-11.0, 4.0]
    found = calibrate_stereo(BOARD, first, second, *PAIR)
    assert found.status == VisionStatus.OK and np.flatnonzero(~found.inliers).tolist() == [0, 3, 5]
    off = offsets(found.motor, motion)
    assert off @ np.linalg.solve(found.covariance, off) < 22.5  # chi-square of 6 at 0.001
    assert np.isnan(found.poses[[0, 3, 5]]).all() and np.isfinite(found.view_residuals[1]).all()


def test_corners_that_a_camera_does_not_show_may_be_missing():
    first, second, motion = stereo_views(np.random.default_rng(53), 4)
    rng = np.random.default_rng(54)
    for views in (first, second):
        for view in views:
            view[rng.random(len(view)) < 0.3] = np.nan
    second[2][:] = np.nan
    found = calibrate_stereo([BOARD] * 4, first, [view[:, None] for view in second], *PAIR)
    assert found.status == VisionStatus.OK and found.inliers.tolist() == [True, True, False, True]
    off = offsets(found.motor, motion)
    assert off @ np.linalg.solve(found.covariance, off) < 22.5


def test_photographs_of_a_stereo_pair():
    """With everything estimated, all four pairs of photographs agree; the baseline is 3.5 squares."""
    left, right = np.array(stereo_boards.CORNERS.split(), float).reshape(2, 4, 54, 2)
    cameras = [calibrate_from_planes(GRID, list(views), distortion="brown").camera for views in (left, right)]
    found = calibrate_stereo(GRID, list(left), list(right), *cameras, refine=True)
    assert found.status == VisionStatus.OK and found.inliers.all() and found.residual < 0.18
    x, y, z = pga3.motor_to_matrix(found.motor)[:3, 3]
    assert abs(x + 3.51) < 0.05 and abs(y) < 0.05 and abs(z) < 0.1
    # Held at the values of four views each, the cameras are less certain than the noise of one view.
    held = calibrate_stereo(GRID, list(left), list(right), *cameras)
    assert held.status == VisionStatus.OK and held.inliers.sum() >= 3


def test_what_is_refused():
    first, second, _ = stereo_views(np.random.default_rng(55), 4)
    rng = np.random.default_rng(56)
    assert calibrate_stereo(BOARD, first[:1], second[:1], *PAIR).status == VisionStatus.TOO_FEW
    assert calibrate_stereo(BOARD, [], [], *PAIR).status == VisionStatus.TOO_FEW
    moved = [view + rng.uniform(-60, 60, 2) for view in second]
    assert calibrate_stereo(BOARD, first, moved, *PAIR).status == VisionStatus.NO_CONSENSUS
    random = [rng.uniform(0, 480, view.shape) for view in second]
    found = calibrate_stereo(BOARD, first, random, *PAIR)
    assert found.status == VisionStatus.TOO_FEW and np.isnan(found.motor).all() and not found.inliers.any()
    line = np.stack([np.arange(8.0), np.zeros(8)], 1)
    views = [view[:8] for view in first]
    assert calibrate_stereo(line, views, views, *PAIR).status == VisionStatus.TOO_FEW
    bad = [np.where(np.arange(54)[:, None] == 3, np.inf, view) for view in first]
    assert calibrate_stereo(BOARD, bad, second, *PAIR).status == VisionStatus.NOT_FINITE
    with pytest.raises(ValueError, match="second: 3 views; expected 4"):
        calibrate_stereo(BOARD, first, second[:3], *PAIR)
    with pytest.raises(ValueError, match=r"first\[0\]: shape \(53, 2\)"):
        calibrate_stereo(BOARD, [first[0][:53], *first[1:]], second, *PAIR)
    with pytest.raises(TypeError, match="camera: ndarray"):
        calibrate_stereo(BOARD, first, second, np.eye(3))


@pytest.mark.slow
def test_small_distant_boards_are_ambiguous_or_right():
    """Two boards of 4 cm at 1.6 m: where a mirrored pose of each is as likely, so is another motion."""
    n_ambiguous = 0
    for seed in range(6):
        first, second, motion = stereo_views(np.random.default_rng([57, seed]), 2, size=1 / 6, depth=(1.4, 1.8))
        found = calibrate_stereo(BOARD / 6, first, second, *PAIR)
        assert found.status in (VisionStatus.OK, VisionStatus.AMBIGUOUS)
        n_ambiguous += found.status == VisionStatus.AMBIGUOUS
        off = [offsets(each, motion) for each in found.motors]
        assert min(x @ np.linalg.solve(found.covariance, x) for x in off) < 60
    assert n_ambiguous >= 1


def test_a_motor_and_its_negative_are_one_motion():
    first, second, motion = stereo_views(np.random.default_rng(58), 3)
    found = calibrate_stereo(BOARD.astype(np.float32).tolist(), first, second, *PAIR)
    assert found.motor[0] > 0 and np.abs(offsets(-found.motor, motion)).max() < 0.01
    assert np.allclose(pga3.motor_to_matrix(found.cameras[1].pose) @ pga3.motor_to_matrix(found.motor), np.eye(4))
    assert np.allclose(found.cameras[0].pose, motor([0, 0, 0], [0, 0, 0]))
