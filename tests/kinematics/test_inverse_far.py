"""Inverse kinematics of robots far from the origin."""

import numpy as np
import pytest

from algorithms.kinematics import Robot, Status, elbow_angle
from generated import pga3

ARMS = ("ur5", "puma560", "stanford", "jaco", "cobra600")
PLACE = np.array([0.8, -0.5, 0.3])


def moved(robot: Robot, distance: float) -> Robot:
    """Return the robot on a turned base, a distance from the origin."""
    return robot.with_base(pga3.motor_from_twist(pga3.twist_from_velocities([0.4, 0.3, -0.7], distance * PLACE)))


def configurations(robot: Robot, count: int) -> np.ndarray:
    q = np.random.default_rng(46).uniform(-2.4, 2.4, (count, robot.n_joints))
    q[:, [kind.value == "prismatic" for kind in robot.kinds]] *= 0.1
    return q


def away(found: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the smallest difference of branches, NaN for missing ones, from configurations, up to whole turns."""
    turned = np.abs((found - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(-1)
    return np.nanmin(turned, axis=-1)


@pytest.mark.parametrize("distance", [30.0, 1e3, 1e6])
@pytest.mark.parametrize("name", ARMS)
def test_branches_do_not_depend_on_the_place_of_the_base(name: str, distance: float) -> None:
    robot = Robot.named(name)
    q = configurations(robot, 60)
    far = moved(robot, distance)
    home, there = robot.inverse(robot.forward(q)), far.inverse(far.forward(q))
    assert np.array_equal(there.status, home.status)
    assert np.array_equal(there.valid.sum(-1), home.valid.sum(-1))
    # Positions are rounded to 1e-16 of the distance; near singularities, angles change by the root of that.
    assert np.median(away(there.q, q)) < 1e-13 * distance
    assert away(there.q, q).max() < 1e-6 * distance**0.5
    reached = far.pose(there.q[there.valid]) - np.repeat(far.pose(q), there.valid.sum(-1), axis=0)
    assert np.abs(reached).max() < 2e-14 * distance


@pytest.mark.parametrize("distance", [30.0, 1e6])
def test_redundant_arms_far_away_reach_their_poses(distance: float) -> None:
    panda, iiwa = (moved(Robot.named(name), distance) for name in ("panda", "iiwa"))
    q = np.clip(configurations(panda, 30), *panda.limits.T[:2])
    near = panda.inverse(panda.forward(q), near=q)
    assert np.array_equal(near.status, np.full(30, Status.INCOMPLETE))
    assert away(near.nearest[:, None], q).max() < 1e-6 * distance**0.5 + 1e-6
    q = configurations(iiwa, 30)
    circle = iiwa.inverse(iiwa.forward(q), elbow=elbow_angle(iiwa, q))
    assert not circle.status.any()
    assert away(circle.q, q).max() < 1e-6 * distance**0.5 + 1e-6
    curve = iiwa.self_motions(iiwa.forward(q[0]))[0]
    assert np.abs(iiwa.pose(curve.q) - iiwa.pose(q[0])).max() < 1e-8 * distance


def test_poses_out_of_reach_far_away_are_called_so() -> None:
    far = moved(Robot.named("puma560"), 1e6)
    pose = far.pose(np.zeros(6))
    pose[:3, 3] += [0.0, 0.0, 5.0]
    assert far.inverse(pose).status == Status.OUT_OF_REACH


@pytest.mark.parametrize("value", [-np.pi, np.pi, -3 * np.pi])
def test_slides_are_not_taken_for_angles(value: float) -> None:
    """The variable of a slide is a length: half a turn is not the same as the opposite one."""
    robot = Robot.named("stanford").with_limits([[-10.0, 10.0]] * 6)
    q = np.array([0.3, -0.5, value, 0.7, 1.1, -0.4])
    pose = robot.pose(q)
    for poses in (pose, pose[None]):
        found = robot.inverse(poses)
        branches = found.q.reshape(-1, 6)[found.valid.reshape(-1)]
        assert np.abs(branches[:, 2] - value).min() < 1e-12
        assert np.abs(robot.pose(branches) - pose).max() < 1e-12
