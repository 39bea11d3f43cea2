"""Self-motions of arms with seven joints against the closed form of the elbow's circle, and against known members."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from algorithms.kinematics import Robot, SelfMotion, elbow_angle
from generated import pga3

STEP = 0.1


def apart(q: np.ndarray, curve: SelfMotion) -> float:
    """The distance of a configuration from the nearest one of a curve."""
    away = curve.q - q
    return float(np.linalg.norm(away - 2 * np.pi * np.rint(away / (2 * np.pi)), axis=-1).min())


def random_pose(arm: Robot, seed: int) -> tuple[np.ndarray, np.ndarray]:
    q = np.random.default_rng(seed).uniform(arm.limits[:, 0], arm.limits[:, 1])
    return q, arm.forward(q)


@pytest.mark.parametrize("seed", range(3))
def test_branches_are_those_of_the_circle_of_the_elbow(seed: int) -> None:
    arm = Robot.named("iiwa")
    pose = random_pose(arm, seed)[1]
    curves = arm.self_motions(pose, step=STEP)
    assert len(curves) == 8 and all(curve.is_closed for curve in curves)
    for curve in curves:
        # Each configuration is one of the branches for its own elbow angle, and the curve goes once around.
        some = curve.q[::10]
        found = arm.inverse(np.tile(pose, (len(some), 1)), elbow=elbow_angle(arm, some))
        away = found.q - some[:, None]
        away -= 2 * np.pi * np.rint(away / (2 * np.pi))
        assert np.nanmin(np.abs(away).max(-1), -1).max() < 1e-6
        turned = np.unwrap(elbow_angle(arm, curve.q))
        assert abs(turned[-1] - turned[0]) == pytest.approx(2 * np.pi, abs=1e-9)
        assert np.diff(curve.parameter).max() < 1.5 * STEP
    for angle in (-2.0, 0.5, 1.7):
        branches = arm.inverse(pose, elbow=angle)
        for q in branches.q[branches.valid]:
            assert min(apart(q, curve) for curve in curves) < STEP


@pytest.mark.parametrize("seed", range(4))
def test_the_generating_configuration_is_on_a_branch(seed: int) -> None:
    arm = Robot.named("panda")
    q, pose = random_pose(arm, seed)
    curves = arm.self_motions(pga3.motor_to_matrix(pose), step=STEP)
    there = min(curves, key=lambda curve: apart(q, curve))
    assert apart(q, there) < STEP
    nearest = int(np.linalg.norm(there.q - q, axis=-1).argmin())
    inside = ((q > arm.limits[:, 0] + STEP) & (q < arm.limits[:, 1] - STEP)).all()
    assert there.within_limits[nearest] or not inside
    for curve in curves:
        assert np.abs(arm.pose(curve.q) - pga3.motor_to_matrix(pose)).max() < 1e-9
        low, high = arm.limits[:, 0], arm.limits[:, 1]
        strictly = ((curve.q >= low) & (curve.q <= high)).all(-1)
        assert (curve.within_limits >= strictly).all()


def test_wrong_arguments_and_poses_out_of_reach() -> None:
    arm = Robot.named("iiwa")
    pose = random_pose(arm, 0)[1]
    far = pga3.motor_to_matrix(pose) + np.outer([1, 0, 0, 0], [0, 0, 0, 10.0])
    assert arm.self_motions(far) == ()
    with pytest.raises(ValueError, match="step"):
        arm.self_motions(pose, step=0.0)
    with pytest.raises(ValueError, match="expected an arm with seven joints"):
        Robot.named("ur5").self_motions(pose)
    with pytest.raises(ValueError, match="pose: shape"):
        arm.self_motions(np.tile(pose, (2, 1)))
    with pytest.raises(ValueError, match="pose: NaN"):
        arm.self_motions(np.full(8, np.nan))


def test_limits_of_one_side_only() -> None:
    """Angles of at most -3.5 are all angles after whole turns; at least 10 too."""
    arm = Robot.named("iiwa")
    pose = random_pose(arm, 1)[1]
    wide = np.tile([-np.inf, np.inf, np.inf, np.inf], (7, 1))
    for side in ((-np.inf, -3.5), (10.0, np.inf)):
        limits = wide.copy()
        limits[0, :2] = side
        assert all(curve.within_limits.all() for curve in replace(arm, limits=limits).self_motions(pose, step=0.3))
    narrow = wide.copy()
    narrow[:, :2] = -0.1, 0.1
    assert not any(curve.within_limits.all() for curve in replace(arm, limits=narrow).self_motions(pose, step=0.3))
