"""Axes and poses of an eye from tracked points, some of which are wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_body_eye import BASELINE, FOCAL_LENGTH, PAN_ANGLES, TILT_ANGLES, Rig, angle, rig, stereo

from algorithms.estimation import BodyEye, BodyEyeStatus, body_eye, joint_axis, stereo_information
from generated import pga3

Array = np.ndarray[Any, Any]
THRESHOLD = 4.0
"""In standard deviations: one right point of 3,000 is rejected."""


def wandering(rng: np.random.Generator, points: Array, share: float) -> Array:
    """Tracks of a share of the points that leave their point and follow the surroundings; returns which are right."""
    n_frames, n_points = points.shape[:2]
    bad = rng.permutation(n_points)[: round(share * n_points)]
    steps = np.cumsum(rng.normal(size=(n_frames, len(bad), 3)), 0)
    points[:, bad] += 0.05 * steps
    right = np.ones((n_frames, n_points), bool)
    right[:, bad] = False
    return right


def exchanged(rng: np.random.Generator, points: Array, share: float) -> Array:
    """Single observations that are those of another point of the same frame; returns which are right."""
    wrong = rng.random(points.shape[:2]) < share
    others = np.roll(points, rng.integers(1, points.shape[1] - 1), axis=1)
    points[wrong] = others[wrong]
    return np.asarray(~wrong)


def calibrated(head: Rig, rng: np.random.Generator, mistake: Any, threshold: float | None) -> tuple[BodyEye, Any]:
    points = [stereo(rng, head.sweep(0, PAN_ANGLES), 0.1), stereo(rng, head.sweep(1, TILT_ANGLES), 0.1)]
    right = [mistake(rng, each, 0.2) for each in points]
    information = [stereo_information(each, FOCAL_LENGTH, BASELINE, 0.1) for each in points]
    found = body_eye(
        *points, head.axes, pan_information=information[0], tilt_information=information[1], threshold=threshold
    )
    return found, right


@pytest.mark.parametrize("mistake", [wandering, exchanged])
@pytest.mark.slow
def test_a_fifth_of_the_tracks_is_wrong(mistake: Any) -> None:
    """Axes to 0.05 degrees in all trials, as without wrong points; nearly all points are classified correctly."""
    rng = np.random.default_rng(3)
    head = rig()
    truth = head.axis_in_eye(0), head.axis_in_eye(1)
    worst, poses = [], []
    for _ in range(2):
        found, right = calibrated(head, rng, mistake, THRESHOLD)
        assert found.status == BodyEyeStatus.OK
        for axis, line, mask in zip((found.pan, found.tilt), truth, right, strict=True):
            worst.append(angle(axis.line, line))
            assert axis.inliers.shape == mask.shape
            assert (axis.inliers & ~mask).sum() <= 0.01 * (~mask).sum() + 1
            assert (axis.inliers & mask).sum() >= 0.99 * mask.sum()
        poses.append(np.linalg.norm(pga3.motor_to_matrix(found.motor)[:3, 3] - head.place))
    assert max(worst) < 0.05 and max(poses) < 1e-3
    found, _ = calibrated(head, rng, mistake, None)
    assert found.status == BodyEyeStatus.OK and angle(found.pan.line, truth[0]) < 0.05  # noise is the threshold


def test_without_covariances() -> None:
    """The threshold is a length; jumps of one point in one frame are found."""
    rng = np.random.default_rng(0)
    head = rig()
    clean = head.sweep(0, PAN_ANGLES)
    points = clean + 1e-4 * rng.normal(size=clean.shape)
    points[5, 3] += 0.3
    points[:, 7] += 0.2 * rng.normal(size=(20, 3))
    found = joint_axis(points, threshold=5e-4)
    expected = np.ones((20, 20), bool)
    expected[5, 3], expected[:, 7] = False, False
    assert found.status == BodyEyeStatus.OK and (found.inliers != expected).sum() <= 1
    assert np.isnan(found.radii[7]) and np.isfinite(np.delete(found.radii, 7)).all()
    assert max(angle(each.line, head.axis_in_eye(0)) for each in (found, joint_axis(points))) < 0.01
    assert found.residual < 2e-4


@pytest.mark.parametrize("n_wrong", [8, 12])
def test_most_points_are_to_move_on_circles(n_wrong: int) -> None:
    """Twelve of twenty that follow the surroundings are no evidence of a joint, although the axis of eight is right."""
    head, rng = rig(), np.random.default_rng(1)
    points = head.sweep(0, PAN_ANGLES)
    points[:, :n_wrong] += 0.1 * np.cumsum(rng.normal(size=(20, n_wrong, 3)), 0)
    found = joint_axis(points, threshold=1e-6)
    assert found.status == (BodyEyeStatus.OK if n_wrong < 10 else BodyEyeStatus.NOT_CIRCLES)
    assert angle(found.line, head.axis_in_eye(0)) < 1e-4


def test_right_points_are_kept() -> None:
    """Without wrong points the result is that without a threshold, for clean points and with missing ones."""
    head = rig()
    points = head.sweep(0, PAN_ANGLES)
    points[3, 4], points[:18, 5] = np.nan, np.nan
    one, two = joint_axis(points), joint_axis(points, threshold=1e-9)
    expected = np.isfinite(points).all(-1)
    expected[:, 5] = False
    assert np.array_equal(one.inliers, expected) and np.array_equal(two.inliers, expected)
    assert np.array_equal(one.line, two.line) and np.array_equal(one.radii, two.radii, equal_nan=True)
    assert np.array_equal(two.line, joint_axis(points, threshold=1e-9, seed=5).line)


@pytest.mark.slow
def test_degenerate_points() -> None:
    """No axis, or none with which most points agree: a status, and finite results."""
    rng = np.random.default_rng(0)
    head = rig()
    pan = head.sweep(0, PAN_ANGLES)
    still = np.tile(head.points, (20, 1, 1))
    straight = head.points + np.linspace(0, 1, 20)[:, None, None] * np.array([1.0, 2.0, 0.0])
    cases = {
        "two frames": (pan[:2], BodyEyeStatus.TOO_FEW),
        "no point": (pan[:, :0], BodyEyeStatus.TOO_FEW),
        "not seen": (np.full_like(pan, np.nan), BodyEyeStatus.TOO_FEW),
        "no motion": (still, BodyEyeStatus.COLLINEAR),
        "collinear": (straight, BodyEyeStatus.COLLINEAR),
    }
    for name, (points, status) in cases.items():
        found = body_eye(points, pan, head.axes, threshold=1e-3)
        assert found.status == status and np.isfinite(found.motor).all(), name
        assert found.pan.inliers.shape == points.shape[:2]
    clouds = rng.normal(size=(20, 20, 3))
    for points in (clouds, np.where(rng.random((20, 20, 1)) < 0.7, clouds, pan)):
        lost = body_eye(points, pan, head.axes, threshold=1e-3)
        assert lost.status != BodyEyeStatus.OK and np.isfinite(lost.motor).all()
    one_circle = joint_axis(pan[:, :1], threshold=1e-6)
    assert one_circle.status == BodyEyeStatus.OK and angle(one_circle.line, head.axis_in_eye(0)) < 1e-6
    for threshold in (0.0, -1.0, np.nan):
        with pytest.raises(ValueError, match="threshold"):
            joint_axis(pan, threshold=threshold)
