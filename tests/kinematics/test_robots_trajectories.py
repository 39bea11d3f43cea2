"""Motions between configurations against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.kinematics import Robot
from algorithms.kinematics.trajectories import joint_motion, screw_motion
from generated import pga3


def test_a_motion_of_the_joints_passes_its_points_and_rests_at_its_ends() -> None:
    rng = np.random.default_rng(0)
    points, times = rng.normal(size=(4, 6)), np.array([0.0, 0.7, 1.5, 2.0])
    q, qd, qdd = joint_motion(points, times, times)
    assert np.abs(q - points).max() < 1e-14 and np.abs(qd[[0, -1]]).max() < 1e-13
    t, h = np.linspace(0.1, 1.9, 50), 1e-5
    q, qd, qdd = joint_motion(points, times, t)
    ahead, behind = (joint_motion(points, times, t + s * h) for s in (1, -1))
    assert np.abs((ahead[0] - behind[0]) / (2 * h) - qd).max() < 1e-7
    assert np.abs((ahead[1] - behind[1]) / (2 * h) - qdd).max() < 1e-3
    q, qd, qdd = joint_motion(points, times, [-1.0, 5.0])
    assert np.abs(q - points[[0, -1]]).max() < 1e-14 and not qd.any() and not qdd.any()
    with pytest.raises(ValueError, match="increasing"):
        joint_motion(points, times[::-1], t)


def test_two_points_are_joined_by_the_cubic_of_the_textbook() -> None:
    t = np.linspace(0, 2, 9)
    s = t / 2
    q, qd, _ = joint_motion([[1.0], [3.0]], [0, 2], t)
    assert q[:, 0] == pytest.approx(1 + 2 * (3 * s**2 - 2 * s**3)) and qd[:, 0] == pytest.approx(6 * (s - s**2))


@pytest.mark.parametrize("name", ["ur5", "panda", "stanford"])
def test_a_screw_of_the_end_effector(name: str) -> None:
    arm = Robot.named(name)
    start = np.array([0.3, -0.8, 0.9, -1.4, 0.8, 1.2, 0.4])[: arm.n_joints]
    end = start + 0.35 * np.array([1, -0.5, 0.7, 0.6, -1, 0.8, 0.3])[: arm.n_joints]
    motors = arm.forward([start, end])
    q = screw_motion(arm, start, motors[1], 40)
    assert np.array_equal(q[0], start) and np.abs(arm.pose(q[-1]) - arm.pose(end)).max() < 1e-9
    assert np.abs(np.diff(q, axis=0)).max() < 0.3
    # All displacements have the same axis and pitch, and their distances follow the quintic.
    displacement = pga3.motor_product(arm.forward(q), pga3.motor_inverse(motors[0]))
    displacement *= np.where(displacement[:, :1] < 0, -1, 1)
    twist = pga3.motor_to_twist(displacement)
    whole = twist[-1]
    part = twist @ whole / (whole @ whole)
    t = np.linspace(0, 1, 40)
    assert np.abs(part - (10 * t**3 - 15 * t**4 + 6 * t**5)).max() < 1e-8
    assert np.abs(twist - part[:, None] * whole).max() < 1e-8
    assert np.abs(screw_motion(arm, start, arm.pose(end), 40) - q).max() < 1e-8


def test_a_path_that_leaves_the_workspace() -> None:
    arm = Robot.named("ur5")
    start = np.array([0.3, -0.8, 0.9, -1.4, 0.8, 1.2])
    goal = arm.pose(start)
    goal[0, 3] += 3.0
    with pytest.raises(ArithmeticError, match=r"ur5: step .* of 19: the pose is missed"):
        screw_motion(arm, start, goal, 20)
    with pytest.raises(ValueError, match="ur5: goal: shape"):
        screw_motion(arm, start, goal[:3], 20)
