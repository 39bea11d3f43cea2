"""The affine and the conformal method give the same branches as motors, and single poses those of batches."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

from algorithms.kinematics import Robot, Status
from algorithms.kinematics.inverse.meets import GEOMETRIES
from algorithms.kinematics.inverse.regional import _apart
from tests.support.all_cases import all_cases

SHOULDER = [
    {"d": 0.3, "alpha": pi / 2},
    {"a": 0.4, "alpha": 0.0},
    {"a": 0.02, "alpha": pi / 2},
    {"d": 0.4, "alpha": -1.2},
    {"alpha": 1.4},
    {"d": 0.1},
]
OFFSET = [{**SHOULDER[0], "a": 0.15}, *SHOULDER[1:]]
"""The first axis does not meet the second; the second and third are parallel."""


@all_cases("method", GEOMETRIES)
@all_cases("robot", ["puma560", "stanford", "ur5", "panda", "shoulder", "offset"])
def test_the_same_branches(robot: str, method: str) -> None:
    rows = {"shoulder": SHOULDER, "offset": OFFSET}
    arm = Robot.from_dh(rows[robot]) if robot in rows else Robot.named(robot)
    q = np.random.default_rng(1).uniform(-pi, pi, (500, arm.n_joints))
    poses = arm.pose(q)
    given: dict[str, Any] = {"locked": {6: q[:, 6]}} if robot == "panda" else {}
    expected, found = arm.inverse(poses, **given), arm.inverse(poses, method=method, **given)
    assert found.method == f"{expected.method}, {method}"
    assert np.array_equal(found.valid.sum(-1), expected.valid.sum(-1))
    turns = np.array([kind.value == "revolute" for kind in arm.kinds])
    away = found.q[:, :, None] - expected.q[:, None]
    away[..., turns] = (away[..., turns] + pi) % (2 * pi) - pi
    nearest = np.where(np.isnan(away).any(-1), np.inf, np.abs(away).max(-1)).min(1)
    assert nearest[expected.valid].max() < 1e-6 and np.mean(nearest[expected.valid] < 1e-9) > 0.99
    reached = arm.pose(np.where(found.valid[..., None], found.q, 0.0))
    assert np.abs(reached - poses[:, None])[found.valid].max() < 1e-10


@all_cases("method", ["motors", *GEOMETRIES])
@all_cases("five", [0.0, 1e-12, 1e-10, 1e-8, 1e-6])
@all_cases("robot", ["puma560", "stanford", "ur5", "shoulder", "offset"])
def test_straight_wrists(robot: str, five: float, method: str) -> None:
    """Circles degenerate to points, and points are on axes: the pose is reached by the same number of branches."""
    rows = {"shoulder": SHOULDER, "offset": OFFSET}
    arm = Robot.from_dh(rows[robot]) if robot in rows else Robot.named(robot)
    turns = np.array([kind.value == "revolute" for kind in arm.kinds])
    for straight in (0.0, pi):
        q = np.random.default_rng(0).uniform(-pi, pi, (60, 6))
        q[:, 4] = straight + five
        poses = arm.pose(q)
        found = arm.inverse(poses, method=method)
        assert found.valid.any(-1).all() and (found.status <= Status.SINGULAR).all()
        reached = arm.pose(np.where(found.valid[..., None], found.q, 0.0))
        assert np.abs(reached - poses[:, None])[found.valid].max() < 1e-10
        # q is found again as exactly as the rounding of the pose allows
        away = found.q - q[:, None]
        away[..., turns] = (away[..., turns] + pi) % (2 * pi) - pi
        nearest = np.nanmin(np.abs(away).max(-1), axis=-1)
        assert (nearest * np.linalg.svd(arm.jacobian(q))[1][:, -1]).max() < 1e-13
        if five == 0.0:
            assert (found.status == Status.SINGULAR).all()
        if five >= 1e-10:
            expected = arm.inverse(poses)
            assert np.array_equal(found.valid.sum(-1), expected.valid.sum(-1))


@pytest.mark.parametrize("method", ["motors", *GEOMETRIES])
def test_a_wrist_above_the_first_axis(method: str) -> None:
    """The first joint may turn freely: two links of 0.4 m, folded so that the wrist's centre is on the axis."""
    rows = [{"d": 0.3, "alpha": pi / 2}, {"a": 0.4}, {"alpha": pi / 2}, {"d": 0.4, "alpha": -pi / 2}, {"alpha": pi / 2}]
    arm = Robot.from_dh([*rows, {"d": 0.1}])
    q = np.random.default_rng(1).uniform(0.4, 1.2, (200, 6))
    # the second link is along -y of its frame where its angle is 0
    for off in (0.0, 1e-12, 1e-9, 1e-6):
        q[:, 2] = pi - 2 * q[:, 1] + pi / 2 + off
        poses = arm.pose(q)
        assert off > 0 or np.abs(poses[:, :2, 3] - 0.1 * poses[:, :2, 2]).max() < 1e-15
        found = arm.inverse(poses, method=method)
        assert found.valid.any(-1).all()
        reached = arm.pose(np.where(found.valid[..., None], found.q, 0.0))
        assert np.abs(reached - poses[:, None])[found.valid].max() < 1e-10


@pytest.mark.parametrize("method", GEOMETRIES)
@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_imaginary_point_pairs(name: str, method: str) -> None:
    arm = Robot.named(name)
    poses = arm.pose(np.random.default_rng(2).uniform(-pi, pi, (50, 6)))
    poses[:, :3, 3] *= 5.0 / np.linalg.norm(poses[:, :3, 3], axis=-1, keepdims=True)
    found = arm.inverse(poses, method=method)
    assert (found.status == Status.OUT_OF_REACH).all() and np.isfinite(found.nearest).all()


def test_a_circle_and_a_sphere_meet_in_the_same_points_in_both() -> None:
    """The unit circle about z, and the sphere of radius 1 about (1, 0, 0): at angles of 60 degrees."""
    axis, p = np.array([1.0, 0, 0, 0, 0, 0]), np.array([[0.0, 1.0, 0.0]])
    for geometry in GEOMETRIES.values():
        points, gap = geometry.circle_sphere(axis, p, np.array([[1.0, 0, 0]]), np.array([1.0]))
        assert sorted(points[0, :, 1]) == pytest.approx([-np.sqrt(0.75), np.sqrt(0.75)], abs=1e-14)
        assert points[0, :, 0] == pytest.approx([0.5, 0.5], abs=1e-14) and gap == pytest.approx(0.75)
        _, gap = geometry.circle_sphere(axis, p, np.array([[3.0, 0, 0]]), np.array([1.0]))
        assert gap < 0


def test_the_deprecated_name_of_the_method() -> None:
    arm = Robot.named("ur5")
    poses = arm.pose(np.random.default_rng(3).uniform(-pi, pi, (5, 6)))
    with pytest.warns(DeprecationWarning, match="parameter way is now method.*removed in version 0.3") as caught:
        found = arm.inverse(poses, way="conformal")
    assert caught[0].filename == __file__
    assert found.method == "three parallel axes, conformal"
    assert np.array_equal(found.q, arm.inverse(poses, method="conformal").q, equal_nan=True)


def test_arms_without_another_method() -> None:
    rows = [{"d": 0.2, "a": 0.3, "alpha": 0.9}] * 6
    with pytest.raises(ValueError, match="method 'conformal': not available for this arm"):
        Robot.from_dh(rows).inverse(np.eye(4), method="conformal")
    with pytest.raises(ValueError, match="expected 'motors' or 'affine' or 'conformal'"):
        Robot.named("ur5").inverse(np.eye(4), method="matrices")


@pytest.mark.parametrize("name", ["crx10ia", "puma560", "ur5", "stanford", "cobra600"])
def test_one_pose_has_the_result_of_a_batch_of_one(name: str) -> None:
    arm = Robot.named(name)
    rng = np.random.default_rng(2)
    for k in range(12):
        q = rng.uniform(-3, 3, arm.n_joints) if k % 3 else rng.integers(-11, 13, arm.n_joints) * (np.pi / 12)
        pose = arm.pose(q)
        if k % 4 == 1:
            pose[:3, 3] *= 1.7
        elif k in (6, 7):
            pose[0, 0] = np.nan if k == 6 else pose[0, 0] + 0.1
        for near in (None, q + 0.1):
            one, batch = arm.inverse(pose, near=near), arm.inverse(pose[None], near=near)
            assert one.method == batch.method and one.status.shape == ()
            for column in ("q", "valid", "status", "nearest", "within_limits"):
                here, there = getattr(one, column), getattr(batch, column)[0]
                assert here.dtype == there.dtype
                np.testing.assert_allclose(here, there, rtol=0, atol=1e-7)


def test_distances_of_angles_are_those_of_the_nearest_other_solution() -> None:
    """Squared sines of half the differences, also across a whole turn; one solution is complex."""
    angles = np.array([[0, pi / 3, pi / 2, 2 * pi - 2 * pi / 3], [pi / 6, -pi, pi - 1e-3, 2.0]])
    found = _apart(angles, np.array([[0, 0, 0, -0.25], [0, 0, 0, 0]]))
    sixth = np.sin(pi / 12) ** 2
    np.testing.assert_allclose(found[0], [0.25, sixth, sixth, -0.25], atol=1e-15)
    np.testing.assert_allclose(found[1, 1:3], np.sin(5e-4) ** 2, rtol=1e-9)
