"""Poses with an unknown focal length: exact solutions, stated errors, wrong pixels, and what leaves it undetermined."""

import numpy as np
import pytest
import scipy.optimize
from focal_scenes import CENTRE, SIZE, deviations_off, seen_pairs, seen_points

from algorithms.vision import (
    DegenerateError,
    VisionStatus,
    cameras_of_four_points,
    localize_unknown_focal,
    relative_pose_unknown_focal,
)
from algorithms.vision.focal_motions import motions_of_six
from generated import pga3


@pytest.mark.parametrize("tilt", [None, 0.5])
def test_four_points_have_the_true_camera_among_eight(tilt):
    first, found_first, others = [], 0, []
    for seed in range(100):
        points, pixels, focal, pose, _ = seen_points(
            np.random.default_rng([80, seed]), 4, noise=0.0, tilt=tilt, origin=1e3 * (seed % 2)
        )
        poses, focals, residuals = cameras_of_four_points(points, pixels, CENTRE)
        assert len(poses) == len(focals) == len(residuals) <= 8 and (np.diff(residuals) >= 0).all()
        exact = residuals < 1e-6
        off = np.abs(pga3.motor_to_matrix(poses[exact]) - pose).max((1, 2))
        first.append(np.min(off / (1 + np.abs(pose[:3, 3]).max()) + np.abs(focals[exact] / focal - 1), initial=1.0))
        found_first += exact.sum() == 1
        others += [*residuals[~exact]]
    assert np.median(first) < 1e-11 and np.quantile(first, 0.98) < 1e-6 and found_first > 90
    assert tilt is not None or (len(others) > 5 and np.median(others) > 1)


def test_cameras_of_four_points_are_minima_of_scipy():
    reached = []
    for seed in range(40):
        points, pixels, focal, pose, _ = seen_points(np.random.default_rng([86, seed]), 4, noise=0.3)
        back = np.linalg.inv(pose)

        def residuals(step, back=back, focal=focal, points=points, pixels=pixels):
            turn = pga3.motor_to_matrix(pga3.motor_from_rotation_vector_translation(step[:3], step[3:6]))
            there = points @ (turn @ back)[:3, :3].T + (turn @ back)[:3, 3]
            return (focal * np.exp(step[6]) * there[:, :2] / there[:, 2:] + CENTRE - pixels).ravel()

        known = scipy.optimize.least_squares(residuals, np.zeros(7), xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=2000)
        _, _, left = cameras_of_four_points(points, pixels, CENTRE)
        if known.cost < 4 and len(left):  # the minimum near the truth
            reached.append((np.abs(left - np.sqrt(2 * known.cost / 4)) < 1e-6).any())
    assert len(reached) > 30 and np.mean(reached) > 0.85


@pytest.mark.parametrize("axis", [(1, 0), (0, 1), (0.6, 0.8)])
def test_boards_with_z_0_and_cameras_that_tilt_about_one_axis(axis):
    """Such scenes satisfy some of the equations for every focal length."""
    board = np.insert(np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0)), -1).reshape(-1, 2), 2, 0, axis=1)
    for seed in range(6):
        rng = np.random.default_rng([88, seed])
        turn = np.append(rng.uniform(0.4, 0.9) * np.array(axis), 0)
        motor = pga3.motor_from_rotation_vector_translation(turn, np.array([0.0, 0, 20]))
        there = np.asarray(pga3.move_point(motor, board - board.mean(0)))
        pixels = 900 * there[:, :2] / there[:, 2:] + CENTRE
        _, focals, residuals = cameras_of_four_points(board[[0, 8, 45, 53]], pixels[[0, 8, 45, 53]], CENTRE)
        assert np.abs(focals[residuals < 1e-6] - 900).min() < 1e-6
        wrong = np.arange(54) % 3 == 0
        pixels[wrong] = rng.uniform(0, 1, (18, 2)) * SIZE
        found = localize_unknown_focal(board, pixels, CENTRE, threshold=2.0)
        assert found.status == VisionStatus.OK and abs(found.focal - 900) < 1e-6


def test_invalid_sets_of_four_points():
    points, pixels, *_ = seen_points(np.random.default_rng(87), 4, noise=0.0)
    for wrong in (points * np.nan, points[:1] + np.arange(4)[:, None] * [1.0, 2, 3]):
        with pytest.raises(DegenerateError, match="four"):
            cameras_of_four_points(wrong, pixels, CENTRE)
    with pytest.raises(ValueError, match="four points"):
        cameras_of_four_points(np.tile(points, (2, 1)), np.tile(pixels, (2, 1)), CENTRE)
    with pytest.raises(ValueError, match="centre"):
        cameras_of_four_points(points, pixels, [1.0])


def test_six_pairs_have_the_true_motion_among_fifteen():
    """Solutions near double ones are less exact; descents follow."""
    worst, others = [], []
    for seed in range(100):
        one, two, focal, motion, _ = seen_pairs(np.random.default_rng([81, seed]), 6, noise=0.0)
        x, y, z = motion[:3, 3]
        truth = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ motion[:3, :3]
        matrices, focals, sets = motions_of_six((one - CENTRE)[None] / 500, (two - CENTRE)[None] / 500)
        assert 1 <= len(matrices) <= 15 and not sets.any()
        values = np.linalg.svd(matrices, compute_uv=False)
        others += [*np.abs(values - [1, 1, 0]).max(1)]  # each is essential
        off = np.minimum(*(np.abs(matrices - sign * truth).max((1, 2)) for sign in (1, -1)))
        worst.append((off + np.abs(focals * 500 / focal - 1)).min())
    for errors in (worst, others):
        assert np.median(errors) < 1e-9 and np.quantile(errors, 0.98) < 1e-3


@pytest.mark.parametrize("tilt", [None, 0.6])
@pytest.mark.parametrize(("n", "wrong"), [(5, 0.0), (30, 0.0), (100, 0.5)])
def test_poses_and_focal_lengths_are_as_stated(n, wrong, tilt):
    off = []
    for seed in range(12):
        points, pixels, focal, pose, bad = seen_points(
            np.random.default_rng([82, n, seed]), n, wrong=wrong, tilt=tilt, origin=1e4
        )
        found = localize_unknown_focal(points, pixels, CENTRE, threshold=2.0 if wrong else None)
        if found.status != VisionStatus.OK:
            assert n == 5 and tilt is not None  # one set of three residuals
            continue
        assert found.inliers[bad].sum() <= 0.1 * bad.sum() and found.inliers[~bad].mean() > 0.95
        assert np.allclose(found.intrinsics, [[found.focal, 0, 600], [0, found.focal, 410], [0, 0, 1]])
        frame = pga3.motor_to_matrix(found.pose)
        off.append(deviations_off(found.covariance, found.focal - focal, pose, frame))
    assert len(off) >= 10 and np.max(off) < 5 and np.median(off) > 0.1


@pytest.mark.parametrize(("n", "wrong"), [(40, 0.0), (100, 0.4)])
def test_motions_and_focal_lengths_are_as_stated(n, wrong):
    off = []
    for seed in range(6):
        one, two, focal, motion, bad = seen_pairs(np.random.default_rng([83, n, seed]), n, wrong=wrong)
        found = relative_pose_unknown_focal(one, two, CENTRE, threshold=1.5 if wrong else None)
        if found.status == VisionStatus.DEGENERATE:
            continue
        assert found.status == VisionStatus.OK and np.isclose(np.linalg.norm(found.motor[:4]), 1)
        assert not wrong or (found.inliers[bad].mean() < 0.2 and found.inliers[~bad].mean() > 0.9)
        assert (found.points[found.inliers & np.isfinite(found.points[:, 0])][:, 2] > 0).all()
        frame = pga3.motor_to_matrix(found.motor)
        off.append(deviations_off(found.covariance, found.focal - focal, motion, frame))
    assert len(off) >= 5 and np.max(off) < 5 and np.median(off) > 0.1


def test_planes_parallel_to_the_image_leave_the_focal_length_undetermined():
    for seed in range(20):
        rng = np.random.default_rng([84, seed])
        points, pixels, *_ = seen_points(rng, 30, wrong=0.2 * (seed % 2), tilt=0.02 * (seed % 3))
        found = localize_unknown_focal(points, pixels, CENTRE, threshold=2.0 if seed % 2 else None)
        assert found.status in (VisionStatus.DEGENERATE, VisionStatus.AMBIGUOUS) and np.isnan(found.focal)


@pytest.mark.parametrize("kind", ["plane", "parallel", "fixation", "rotation"])
@pytest.mark.parametrize("wrong", [0.0, 0.3])
def test_arrangements_that_leave_the_focal_length_of_two_views_undetermined(kind, wrong):
    for seed in range(3):
        one, two, *_ = seen_pairs(np.random.default_rng([85, seed]), 80, kind, wrong=wrong)
        found = relative_pose_unknown_focal(one, two, CENTRE, threshold=1.5 if wrong else None)
        expected = (VisionStatus.DEGENERATE, VisionStatus.AMBIGUOUS)[: 2 if kind == "plane" else 1]
        assert found.status in expected and np.isnan(found.focal) and np.isnan(found.motor).all()


def test_what_is_refused():
    rng = np.random.default_rng(86)
    points, pixels, *_ = seen_points(rng, 30)
    random = rng.uniform(0, 1, pixels.shape) * SIZE
    assert localize_unknown_focal(points, random, CENTRE, threshold=2.0).status == VisionStatus.NO_CONSENSUS
    assert localize_unknown_focal(points, random, CENTRE).status in (
        VisionStatus.NOT_CONVERGED,
        VisionStatus.DEGENERATE,
    )
    assert localize_unknown_focal(points[:4], pixels[:4], CENTRE).status == VisionStatus.TOO_FEW
    assert localize_unknown_focal(points[[0] * 9], pixels[:9], CENTRE).status == VisionStatus.TOO_FEW
    assert localize_unknown_focal(points * np.nan, pixels, CENTRE).status == VisionStatus.NOT_FINITE
    line = np.outer(np.arange(9.0), [1, 2, 3])
    assert localize_unknown_focal(line, pixels[:9], CENTRE).status == VisionStatus.DEGENERATE
    one, two, *_ = seen_pairs(rng, 30)
    found = relative_pose_unknown_focal(one[:12], random[:12], CENTRE, threshold=1.5)
    assert found.status in (VisionStatus.NO_CONSENSUS, VisionStatus.DEGENERATE)
    assert relative_pose_unknown_focal(one[:5], two[:5], CENTRE).status == VisionStatus.TOO_FEW
    assert relative_pose_unknown_focal(one[[0] * 9], two[[0] * 9], CENTRE).status == VisionStatus.TOO_FEW
    assert relative_pose_unknown_focal(one * np.inf, two, CENTRE).status == VisionStatus.NOT_FINITE
    for call in (localize_unknown_focal, relative_pose_unknown_focal):
        arguments = (points, pixels) if call is localize_unknown_focal else (one, two)
        with pytest.raises(ValueError, match="centre"):
            call(*arguments, [np.nan, 0.0])
        with pytest.raises(ValueError, match="threshold"):
            call(*arguments, CENTRE, threshold=-1.0)
        with pytest.raises(ValueError, match="expected 30"):
            call(arguments[0], arguments[1][:7], CENTRE)


@pytest.mark.parametrize(("unit", "origin"), [(1e-3, 0.0), (1e3, 0.0), (1.0, 1e6)])
def test_units_and_origins_do_not_matter(unit, origin):
    for wrong in (0.0, 0.3):
        results = []
        for scale, place in ((1.0, 0.0), (unit, origin)):
            points, pixels, _, pose, _ = seen_points(np.random.default_rng(87), 30, 0.5, wrong, None, scale, place)
            found = localize_unknown_focal(points, pixels, CENTRE, threshold=2.0 if wrong else None)
            frame = pga3.motor_to_matrix(found.pose)
            results.append([found.focal, *((frame[:3, 3] - pose[:3, 3]) / scale)])
        assert np.allclose(*results, rtol=1e-6, atol=2e-9 * max(abs(origin), 1))
