"""Jacobians, their rates and quantities derived from them, against derivatives of poses and closed forms."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from algorithms.kinematics import DescriptionError, JointCountError, NotFiniteError, Robot
from generated import pga3

ARMS = {
    "ur5": Robot.named("ur5"),
    "panda, generic": replace(Robot.named("panda"), module=None),
    "stanford": Robot.named("stanford"),
    "puma560": Robot.named("puma560"),
    "iiwa": Robot.named("iiwa"),
}


def states(arm: Robot, count: int = 10) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    q, qd, qdd = np.random.default_rng(4).uniform(-2, 2, (3, count, arm.n_joints))
    return q, qd, qdd


def slope(function: Callable[[float], np.ndarray], h: float = 4e-3) -> np.ndarray:
    """The derivative at 0, by finite differences of order 8."""
    weights = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
    terms = (w * (function(k * h) - function(-k * h)) for k, w in enumerate(weights, 1))
    total: np.ndarray = sum(terms) / h  # type: ignore[assignment]
    return total


def velocity_of(arm: Robot, q: Callable[[float], np.ndarray]) -> np.ndarray:
    """Angular over linear velocity from the rate of the pose matrix."""
    pose, rate = arm.pose(q(0.0)), slope(lambda t: arm.pose(q(t)))
    spin = rate[:, :3, :3] @ np.swapaxes(pose[:, :3, :3], 1, 2)
    return np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0], *rate[:, :3, 3].T], -1)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_velocities_are_rates_of_poses(arm: Robot) -> None:
    q, qd, qdd = states(arm)
    found = velocity_of(arm, lambda t: q + t * qd)
    assert np.abs(arm.velocity(q, qd) - found).max() < 1e-10
    assert np.abs(np.einsum("bij,bj->bi", arm.jacobian(q), qd) - found).max() < 1e-10
    rate = slope(lambda t: arm.jacobian(q + t * qd))
    assert np.abs(arm.jacobian_rate(q, qd) - rate).max() < 1e-9
    acceleration = slope(lambda t: arm.velocity(q + t * qd + t * t / 2 * qdd, qd + t * qdd))
    assert np.abs(arm.acceleration(q, qd, qdd) - acceleration).max() < 1e-9


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_elements_attached_to_the_end_effector(arm: Robot) -> None:
    q, qd, _ = states(arm)
    rng = np.random.default_rng(5)
    point, plane = rng.normal(size=3), rng.normal(size=4)
    line = pga3.join_points(point, rng.normal(size=3))
    for jacobian, move, element in (
        (arm.jacobian_of_point, pga3.move_point, point),
        (arm.jacobian_of_line, pga3.move_line, line),
        (arm.jacobian_of_plane, pga3.move_plane, plane),
    ):
        rate = slope(lambda t: move(arm.forward(q + t * qd), element))  # noqa: B023
        assert np.abs(np.einsum("bij,bj->bi", jacobian(q, element), qd) - rate).max() < 1e-9
    origin = arm.jacobian_of_point(q, np.zeros(3))
    assert np.abs(origin - arm.jacobian(q)[:, 3:]).max() < 1e-13


def test_twists_of_joints_are_their_axes() -> None:
    """A revolute joint keeps the points of its axis in place; the twist of a prismatic joint is its direction."""
    arm = Robot.named("stanford")
    q, _, _ = states(arm)
    twists, frames = arm.twists_of_joints(q), arm.forward_all(q)
    axis = np.array([1.0, 0, 0, 0, 0, 0])
    before = pga3.move_line(frames, axis)  # z of the frame after a joint is the axis of the next, in this convention
    assert np.abs(twists[:, 0] - axis).max() < 1e-15
    for j in (1, 3, 4, 5):
        assert np.abs(twists[:, j] - before[:, j - 1]).max() < 1e-14
    along = pga3.motor_to_matrix(frames[:, 1])[:, :3, 2]
    assert np.abs(twists[:, 2, :3]).max() == 0 and np.abs(twists[:, 2, 3:] - along).max() < 1e-14


def test_planar_arm_in_closed_form() -> None:
    arm = Robot.from_dh([{"a": 0.7}, {"a": 0.4}])
    q = np.random.default_rng(6).normal(size=(20, 2))
    s1, s12, c1, c12 = np.sin(q[:, 0]), np.sin(q.sum(-1)), np.cos(q[:, 0]), np.cos(q.sum(-1))
    jacobian = arm.jacobian(q)
    x = np.array([[-0.7 * s1 - 0.4 * s12, -0.4 * s12], [0.7 * c1 + 0.4 * c12, 0.4 * c12]]).transpose(2, 0, 1)
    assert np.abs(jacobian[:, 3:5] - x).max() < 1e-15
    assert np.abs(jacobian[:, :3] - [[0, 0], [0, 0], [1, 1]]).max() < 1e-15
    assert arm.manipulability(q) == pytest.approx(0.7 * 0.4 * np.abs(np.sin(q[:, 1])), rel=1e-13)
    assert arm.manipulability([0.3, 0.0]) < 1e-15


def test_manipulability() -> None:
    arm = Robot.named("panda")
    q, _, _ = states(arm)
    j = arm.jacobian(q)
    assert arm.manipulability(q) == pytest.approx(np.sqrt(np.linalg.det(j @ np.swapaxes(j, 1, 2))), rel=1e-9)
    # UR5 with a straight elbow, and with its wrist axes parallel, is singular.
    for k in (2, 4):
        singular = np.array([0.3, -0.8, 1.1, 0.4, 0.9, 0.2])
        singular[k] = 0
        assert Robot.named("ur5").manipulability(singular) < 1e-15


def test_manipulability_of_less_than_six_variables() -> None:
    """Compare with determinants of the Jacobian of the task of each arm."""
    rng = np.random.default_rng(7)
    reach = {
        "three in a plane": ([{"a": 0.7}, {"a": 0.4}, {"a": 0.2}], 0.28, 1),
        "scara": ([{"a": 0.5}, {"a": 0.3, "alpha": np.pi}, {"kind": "prismatic"}, {}], 0.15, 1),
    }
    for rows, product, elbow in reach.values():
        arm = Robot.from_dh(rows)
        q = rng.normal(size=(20, arm.n_joints))
        assert arm.manipulability(q) == pytest.approx(product * np.abs(np.sin(q[:, elbow])), rel=1e-12)
        straight = q.copy()
        straight[:, elbow] = 0
        assert arm.manipulability(straight).max() < 1e-15
    # for three joints in space the task is the position, for four or five the space of their motions
    shoulder = Robot.from_dh([{"d": 0.3, "alpha": np.pi / 2}, {"a": 0.4}, {"a": 0.2}])
    q = rng.normal(size=(20, 3))
    s1, s12, c1, c12 = np.sin(q[:, 1]), np.sin(q[:, 1] + q[:, 2]), np.cos(q[:, 1]), np.cos(q[:, 1] + q[:, 2])
    plane = np.abs((0.4 * s1 + 0.2 * s12) * 0.2 * c12 - 0.2 * s12 * (0.4 * c1 + 0.2 * c12))
    assert shoulder.manipulability(q) == pytest.approx(plane * np.abs(0.4 * c1 + 0.2 * c12), rel=1e-12)
    five = Robot.from_dh([{"d": 0.2, "a": 0.1 * k, "alpha": 0.3 + k} for k in range(5)])
    q = rng.normal(size=(20, 5))
    j = five.jacobian(q)
    assert five.manipulability(q) == pytest.approx(np.sqrt(np.linalg.det(np.swapaxes(j, 1, 2) @ j)), rel=1e-9)
    assert Robot.from_dh([{"a": 0.7}]).manipulability([0.3]) == pytest.approx(0.7)
    assert Robot.from_dh([{"kind": "prismatic"}]).manipulability([0.3]) == pytest.approx(1.0)


def test_screws_give_the_same_robot_as_the_table() -> None:
    for name in ("puma560", "stanford", "iiwa"):
        arm = Robot.named(name)
        again = Robot.from_screws(2 * arm.axes, arm.tool, [kind.value for kind in arm.kinds])
        q, qd, _ = states(arm)
        assert np.abs(again.pose(q) - arm.pose(q)).max() < 1e-14
        assert np.abs(again.jacobian_rate(q, qd) - arm.jacobian_rate(q, qd)).max() < 1e-13


def test_invalid_screws() -> None:
    z, one = np.array([[1.0, 0, 0, 0, 0, 0]]), np.eye(8)[0]
    for axes in ([[0.0, 0, 0, 1, 0, 0]], [[1.0, 0, 0, 0, 0, 1]], [[np.nan, 0, 0, 0, 0, 0]]):
        with pytest.raises(DescriptionError, match="axes: not lines"):
            Robot.from_screws(axes, one)
    with pytest.raises(DescriptionError, match="expected a unit motor"):
        Robot.from_screws(z, 2 * one)
    with pytest.raises(DescriptionError, match="kind 'round'"):
        Robot.from_screws(z, one, ["round"])
    with pytest.raises(JointCountError, match="2 kinds for 1 axes"):
        Robot.from_screws(z, one, ["revolute", "revolute"])
    with pytest.raises(JointCountError, match="no joint"):
        Robot.from_screws(np.empty((0, 6)), one)
    with pytest.raises(NotFiniteError):
        replace(Robot.named("iiwa"), tool=np.full(8, np.nan))


def test_manipulability_of_non_finite_configurations() -> None:
    arm = Robot.named("ur5")
    q = np.linspace(-1, 1, 18).reshape(3, 6)
    expected = arm.manipulability(q)
    q[1, 2] = np.nan
    found = arm.manipulability(q)
    assert np.isnan(found[1]) and np.array_equal(found[::2], expected[::2])
    assert np.isnan(arm.manipulability(q[1]))


def test_robots_are_pickled_and_copied() -> None:
    for name in ("ur5", "stanford"):
        arm = Robot.named(name)
        for other in (pickle.loads(pickle.dumps(arm)), copy.deepcopy(arm)):
            q = np.linspace(-1, 1, 6)
            assert np.array_equal(other.forward(q), arm.forward(q)) and other.module is arm.module
            assert np.array_equal(other.limits, arm.limits)


def test_reversed_limits_and_unknown_names() -> None:
    with pytest.raises(DescriptionError, match="limits of joint 1"):
        replace(Robot.named("ur5"), limits=np.array([[-1.0, 1, 1, 1], [1, -1, 1, 1], *[[0, 0, 1, 1]] * 4]))
    with pytest.raises(TypeError, match="expected one of the names"):
        Robot.named(5)  # type: ignore[arg-type]
    assert Robot.named("KUKA iiwa").name == "iiwa" and Robot.named("UR-5").name == "ur5"


def test_models_cannot_be_changed() -> None:
    arm = Robot.named("ur5")
    for array in (arm.axes, arm.home, arm.tool, arm.bodies, arm.limits):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(AttributeError):
        arm.name = "other"  # type: ignore[misc]


def test_batches_and_single_configurations_agree() -> None:
    arm = replace(Robot.named("panda"), module=None)
    q, qd, _ = states(arm, 2100)
    for method, *given in (
        (arm.jacobian, q),
        (arm.jacobian_rate, q, qd),
        (arm.forward_all, q),
        (arm.twists_of_joints, q),
    ):
        batch = method(*given)
        for k in (0, 1023, 1024, 2099):
            assert np.array_equal(method(*(rows[k].tolist() for rows in given)), method(*(rows[k] for rows in given)))
            assert np.abs(method(*(rows[k] for rows in given)) - batch[k]).max() <= 1e-14 * np.abs(batch[k]).max()
    single = arm.jacobian(q.astype(np.float32))
    assert single.dtype == np.float32 and np.abs(single - arm.jacobian(q)).max() < 1e-4
    assert arm.jacobian(np.empty((0, 3, 7))).shape == (0, 3, 6, 7)
    assert arm.jacobian(q.reshape(3, 700, 7)).shape == (3, 700, 6, 7)
