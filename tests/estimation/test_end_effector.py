"""Poses of end effectors from reference lines, for a PUMA and a UR5 with wrong tools."""

from __future__ import annotations

import numpy as np
import pytest
from line_scenes import error, lines, seen
from scipy.stats import chi2

from algorithms.estimation import EstimationStatus, track_end_effector
from algorithms.kinematics import Robot
from generated import pga3

SIGMA = (0.005, 0.003)


@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_end_effector_is_found_while_the_robot_moves(name: str) -> None:
    """A tool that is off by 10 degrees and 5 cm is corrected; errors are those of the covariance."""
    rng = np.random.default_rng(8)
    robot = Robot.named(name)
    t, squares = 25, []
    for _ in range(10):
        q = rng.uniform(-1, 1, robot.n_joints) + np.linspace(0, 1, t)[:, None] * rng.uniform(-1, 1, robot.n_joints)
        first = np.diag([0.17**2] * 3 + [0.05**2] * 3)
        x = np.sqrt(np.diag(first)) * rng.normal(size=6)
        poses = robot.forward(q)
        # The error is about the frame of the base at the first pose, and moves with the robot.
        begin = pga3.motor_product(pga3.motor_exponential(-x / 2), poses[0])
        truth = pga3.motor_product(pga3.motor_product(poses, pga3.motor_inverse(poses[0])), begin)
        carried = lines(rng, 3, 0.2)
        measured = np.stack([seen(rng, m, carried, SIGMA) for m in truth])
        measured[5] = np.nan
        measured[7, 1] = np.nan
        found = track_end_effector(robot, q, carried, measured, SIGMA, covariance=first)
        assert found.status[5] == EstimationStatus.SKIPPED and np.delete(found.status, 5).max() == EstimationStatus.OK
        last = error(truth[-1], found.motors[-1])
        squares.append(last @ np.linalg.solve(found.covariances[-1], last))
        assert np.abs(last[:3]).max() < 0.01
    low, high = chi2.interval(0.999, 6 * len(squares))
    assert low < sum(squares) < high
