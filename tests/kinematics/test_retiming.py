"""The fastest motions along paths against closed forms, quadrature, linear programs and the limits themselves."""

from __future__ import annotations

from math import sin, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.optimize import brentq, linprog

from algorithms.kinematics import Body, RetimingStatus, Robot, retime
from generated import retiming
from tests.support.all_cases import all_cases

PANDA = Robot.named("panda")
LOW, HIGH = PANDA.limits[:, :2].T
TORQUE = np.array([87, 87, 87, 87, 12, 12, 12.0])
TURN = Robot.from_dh([{"a": 0.5}])


@pytest.mark.parametrize(("length", "duration"), [(2.0, 2.0 / 0.8 + 0.8 / 3), (0.1, 2 * sqrt(0.1 / 3))])
def test_one_joint_is_timed_by_a_trapezoid_or_a_triangle(length: float, duration: float) -> None:
    found = retime(TURN, [[0.2], [0.2 + length]], velocity=0.8, acceleration=3.0)
    assert found.status is RetimingStatus.OK
    assert found.duration == pytest.approx(duration, rel=1e-4)
    q, qd, qdd = found.at([0.0, 0.1, found.duration, found.duration + 1])
    assert q[:, 0] == pytest.approx([0.2, 0.2 + 3.0 * 0.01 / 2, 0.2 + length, 0.2 + length], abs=1e-6)
    assert qd[:, 0] == pytest.approx([0, 0.3, 0, 0], abs=1e-6) and qdd[1, 0] == pytest.approx(3, rel=1e-6)
    assert qdd[3, 0] == 0


def test_a_pendulum_is_raised_by_a_limited_torque() -> None:
    """Full torque, then full torque in the other direction: the time is an integral of the speed from the energy."""
    mass, arm, most, end = 2.0, 0.5, 25.0, 1.2
    body = Body(mass, (0.0, 0.0, 0.0), (0.0,) * 6)
    robot = Robot.from_dh([{"a": arm}], bodies=[body]).with_gravity([0, -9.81, 0])
    inertia, weight = mass * arm**2, mass * arm * 9.81
    found = retime(robot, [[0.0], [end]], torque=most, stages=2000)

    def rising(angle: float) -> float:
        return 2 * (most * angle - weight * sin(angle)) / inertia

    def braking(angle: float) -> float:
        """The squared speed from which a torque of -most stops the pendulum at the end."""
        return 2 * (most * (end - angle) + weight * (sin(end) - sin(angle))) / inertia

    change = brentq(lambda angle: rising(angle) - braking(angle), 1e-6, end - 1e-6)
    first = quad(lambda root: 2 * root / sqrt(rising(root**2)), 1e-9, sqrt(change))[0]
    second = quad(lambda root: 2 * root / sqrt(braking(end - root**2)), 1e-9, sqrt(end - change))[0]
    assert found.duration == pytest.approx(first + second, rel=2e-4)


@pytest.mark.parametrize("seed", range(3))
def test_limits_hold_and_one_of_them_is_always_reached(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = 0.7 * rng.uniform(LOW, HIGH, (5, 7))
    found = retime(PANDA, points, velocity=2.0, acceleration=10.0, torque=TORQUE, stages=1000)
    q, qd, qdd = found.at(np.linspace(0, found.duration, 4001)[1:-1])
    shares = [np.abs(qd) / 2, np.abs(qdd) / 10, np.abs(PANDA.inverse_dynamics(q, qd, qdd)) / TORQUE]
    largest = np.concatenate(shares, -1).max(-1)
    assert largest.max() < 1.001
    assert (largest > 0.95).mean() > 0.98
    assert np.abs(q[0] - points[0]).max() < 1e-3 and np.abs(q[-1] - points[-1]).max() < 1e-3


def test_bounds_of_stages_are_those_of_linear_programs() -> None:
    """The largest x for which some u fulfils all limits and leads into the bound of the next stage."""
    rng = np.random.default_rng(3)
    for _ in range(30):
        slopes, above, below = rng.normal(size=(1, 4)), rng.uniform(0, 2, (1, 4)), -rng.uniform(0, 2, (1, 4))
        step, after, most = rng.uniform(0.05, 1), rng.uniform(0, 2), rng.uniform(0.1, 9)
        found = retiming.reachable_speeds(above, below, slopes, np.array([most]), np.array([step]), after)
        rows = np.column_stack([np.ones(4), -slopes[0]])
        limits = np.vstack([rows, -rows, [2 * step, 1], [-2 * step, -1]])
        right = np.concatenate([above[0], -below[0], [after, 0]])
        best = linprog([0, -1], limits, right, bounds=[(None, None), (0, most)])
        assert found[0] == pytest.approx(-best.fun, rel=1e-9, abs=1e-9)


def test_splines_are_paths_of_their_own() -> None:
    """The same curve with another parameter takes the same time."""
    points = np.array([[0, 0, 0, -1.5, 0, 1.5, 0], [0.5, 0.2, 0, -1, 0, 1, 0.3], [1, 0.5, 0.1, -1.2, 0, 1, 0]])
    curve = CubicSpline([0, 2, 3], points)
    same = [curve, CubicSpline([0, 20, 30], points), make_interp_spline([0, 2, 3], points, k=2)]
    times = [retime(PANDA, path, velocity=2.0, acceleration=5.0).duration for path in same]
    assert times[0] == pytest.approx(times[1], rel=1e-9) and times[2] == pytest.approx(times[0], rel=0.2)


def test_torques_that_only_hold_the_robot_do_not_move_it() -> None:
    body = Body(1.0, (0.0, 0.0, 0.0), (0.0,) * 6)
    robot = Robot.from_dh([{"a": 0.5}], bodies=[body]).with_gravity([0, -9.81, 0])
    holding = float(abs(robot.gravity([0.0])[0]))
    assert retime(robot, [[0.0], [0.5]], torque=holding).status is RetimingStatus.TOO_HEAVY
    found = retime(robot, [[0.0], [0.5]], torque=1.01 * holding)
    assert found.status is RetimingStatus.OK and np.isfinite(found.duration)
    assert all(np.isnan(part).all() for part in found.at(np.nan))


def test_a_load_that_cannot_be_held() -> None:
    path = [[0, 0.2, 0, -0.5, 0, 1.5, 0], [0, 1.5, 0, -0.3, 0, 1.5, 0]]
    found = retime(PANDA, path, torque=TORQUE / 10)
    assert found.status is RetimingStatus.TOO_HEAVY and np.isnan(found.duration) and np.isnan(found.at(0.5)[0]).all()


@all_cases(
    "options, message",
    [
        ({}, "at least one of them"),
        ({"acceleration": 0.0}, "positive numbers"),
        ({"acceleration": np.nan}, "positive numbers"),
        ({"acceleration": [1.0, 2.0]}, "acceleration: shape"),
        ({"acceleration": np.inf}, "nothing limits the motion"),
        ({"acceleration": np.inf, "velocity": 1.0}, "nothing limits the motion"),
        ({"acceleration": 1.0, "path": make_interp_spline([0, 1, 2], [[0.0], [1.0], [0.0]], k=1)}, "degree 1"),
        ({"acceleration": 1.0, "stages": 1}, "stages: 1"),
        ({"acceleration": 1.0, "path": [[0.0], [0.0]]}, "rows 0 and 1 are equal"),
        ({"acceleration": 1.0, "path": [[0.0]]}, "at least two rows"),
        ({"acceleration": 1.0, "path": [[0.0], [np.nan]]}, "path"),
        ({"acceleration": 1.0, "path": CubicSpline([0, 1], np.eye(2))}, "values of shape"),
    ],
)
def test_wrong_arguments(options: dict[str, Any], message: str) -> None:
    path = options.pop("path", [[0.0], [1.0]])
    with pytest.raises(ValueError, match=message):
        retime(TURN, path, **options)
