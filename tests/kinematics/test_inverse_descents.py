"""Descents to a pose, within limits and from a configuration nearby, against matrices, differences and scipy."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from arm_tables import Rows, pose_by_matrices, random_arm
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from algorithms.kinematics import Robot, Status
from algorithms.kinematics.inverse.chain import Chain
from generated import pga3

SEVEN: Rows = [*random_arm(41), {"d": 0.2, "a": 0.1, "alpha": 0.7}]
SLIDE: Rows = random_arm(42, 2)
FIVE: Rows = random_arm(43)[:5]
ARMS = {"seven": SEVEN, "slide": SLIDE, "five": FIVE}


def chain_of(rows: Rows) -> tuple[Robot, Chain]:
    robot = Robot.from_dh(rows)
    return robot, Chain(robot.axes, tuple(row.get("kind") == "prismatic" for row in rows))


def errors(rows: Rows, q: np.ndarray, pose: np.ndarray, tool: np.ndarray, size: float) -> np.ndarray:
    """The logarithm of the motion from the arm's pose to another, by matrices: rotation times size, and translation."""
    made = np.linalg.inv(pose_by_matrices(rows, q) @ np.linalg.inv(tool)) @ pose @ np.linalg.inv(tool)
    turn = Rotation.from_matrix(made[:3, :3]).as_rotvec()
    angle = np.linalg.norm(turn)
    cross = np.array([[0, -turn[2], turn[1]], [turn[2], 0, -turn[0]], [-turn[1], turn[0], 0]])
    rest = (1 / angle**2 - (1 + np.cos(angle)) / (2 * angle * np.sin(angle))) * cross @ cross if angle > 1e-9 else 0.0
    return np.concatenate([size * turn, (np.eye(3) - cross / 2 + rest) @ made[:3, 3]])


@pytest.mark.parametrize("name", ARMS)
def test_a_descent_ends_at_the_goal(name: str) -> None:
    robot, chain = chain_of(ARMS[name])
    rng = np.random.default_rng(0)
    q = rng.uniform(-2, 2, (200, len(chain)))
    poses = pose_by_matrices(ARMS[name], q)
    goals = pga3.motor_between_frames(robot.tool, pga3.motor_from_matrix(poses))
    found, error, off = chain.descent(q + 0.05 * rng.uniform(-1, 1, q.shape), goals, 40.0)
    assert np.abs(pose_by_matrices(ARMS[name], found) - poses).max() < 1e-12
    assert error.max() < 1e-12 and off.max() < 1e-12


def test_rates_of_joints_are_those_of_differences() -> None:
    robot, chain = chain_of(SLIDE)
    q, step = np.random.default_rng(1).uniform(-2, 2, 6), 1e-6
    tool = pga3.motor_to_matrix(robot.tool)
    for j, change in enumerate(np.eye(6) * step):
        ahead, behind = (
            errors(SLIDE, q, pose_by_matrices(SLIDE, q + sign * change), tool, chain.size) for sign in (1, -1)
        )
        assert np.allclose(chain.rates(q)[j], (ahead - behind) / (2 * step), atol=1e-8)


@pytest.mark.slow
def test_out_of_reach_the_distance_is_small_within_limits() -> None:
    """Scipy's trust-region method with bounds, from the same start, finds a smaller distance by at most 2 percent."""
    robot, chain = chain_of(SEVEN)
    tool = pga3.motor_to_matrix(robot.tool)
    rng = np.random.default_rng(2)
    low, high = np.full(7, -0.5), np.full(7, 0.6)
    at_limits = 0
    for _ in range(2):
        start = rng.uniform(low, high)
        pose = pose_by_matrices(SEVEN, start + rng.uniform(-1, 1, 7))
        pose[:3, 3] += 0.3 * rng.normal(size=3)
        goal = pga3.motor_between_frames(robot.tool, pga3.motor_from_matrix(pose))
        found, error, _ = chain.descent_inside(start, goal, low, high, 200.0)
        peer = least_squares(lambda q, pose=pose: errors(SEVEN, q, pose, tool, chain.size), start, bounds=(low, high))
        assert (found >= low).all() and (found <= high).all()
        assert np.isclose(np.linalg.norm(errors(SEVEN, found, pose, tool, chain.size)), error)
        at_limits += int((np.isclose(found, low) | np.isclose(found, high)).any())
        assert error <= np.sqrt(2 * peer.cost) * 1.02
    assert at_limits


@pytest.mark.parametrize("name", ["panda", "iiwa"])
def test_redundant_arms_remain_near_and_within_limits(name: str) -> None:
    arm = Robot.named(name)
    low, high = arm.limits[:, :2].T
    rng = np.random.default_rng(3)
    q = rng.uniform(low, high, (1000, 7))
    poses = arm.pose(q)
    assert np.abs(arm.inverse(poses, near=q).nearest - q).max() < 1e-9
    found = arm.inverse(poses, near=q + rng.choice([-0.05, 0.05], q.shape))
    assert found.within_limits.any(-1).all() and (found.status == Status.INCOMPLETE).all()
    assert (np.abs(found.nearest - q).max(-1) < 0.2).mean() >= 0.999
    assert np.abs(arm.pose(found.nearest) - poses).max() < 1e-9
    anywhere = arm.inverse(poses[:100])
    assert anywhere.within_limits.any(-1).mean() >= 0.99


def test_limits_are_left_only_where_nothing_within_them_reaches() -> None:
    free = Robot.from_dh(SEVEN)
    arm = free.with_limits(np.tile([-0.3, 0.3], (7, 1)))
    poses = free.pose(np.random.default_rng(4).uniform(1, 2, (5, 7)))
    found = arm.inverse(poses, near=np.zeros(7))
    assert found.valid.any(-1).all() and not found.within_limits.any()
    assert np.abs(arm.pose(found.nearest) - poses).max() < 1e-9
    half_bounded = free.with_limits(np.array([[-np.inf, 0.5], *[[-pi, np.inf]] * 6]))
    assert half_bounded.inverse(poses).valid.any(-1).all()
