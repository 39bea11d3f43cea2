"""Branches that joint limits allow, and the results if they allow none."""

from __future__ import annotations

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest

from algorithms.kinematics import DescriptionError, JointCountError, Robot, Status
from tests.support.all_cases import all_cases

PLANAR = [{"a": 0.5}, {"a": 0.4}, {"a": 0.2}]


def limited(robot: Robot, pairs: list[tuple[float, float]]) -> Robot:
    return replace(robot, limits=np.array([(low, high, np.inf, np.inf) for low, high in pairs]))


def test_an_elbow_outside_of_its_limits() -> None:
    """Of two branches, elbow up and down, one is left if the elbow bends only to one side."""
    arm = limited(Robot.from_dh(PLANAR), [(-pi, pi), (0.0, 2.5), (-pi, pi)])
    q = np.random.default_rng(0).uniform((-3, 0.1, -3), (3, 2.4, 3), (200, 3))
    found = arm.inverse(arm.forward(q))
    assert found.valid.all() and (found.within_limits.sum(-1) == 1).all()
    assert np.abs(found.q[found.within_limits] - q).max() < 1e-9
    assert np.abs(found.nearest - q).max() < 1e-9


def test_full_turns_are_added() -> None:
    """The elbow has limits of 3 and 4 radians, beyond a half turn: the branch is shifted into this range."""
    arm = limited(Robot.from_dh(PLANAR), [(-10, 10), (3.0, 4.0), (-10, 10)])
    q = np.array([0.3, 3.6, 0.2])
    found = arm.inverse(arm.forward(q))
    there = found.within_limits
    assert there.sum() == 1 and np.abs(found.q[there] - q).max() < 1e-9 and np.abs(found.nearest - q).max() < 1e-9


@all_cases("low", [-20.0, -3.0, 0.0, pi / 2, 5.0, 100.0])
@all_cases("name", ["ur5", "puma560", "stanford"])
def test_flagged_branches_are_within_limits(name: str, low: float) -> None:
    """For any limits less than a full turn wide, a branch is flagged if adding full turns puts it inside."""
    arm = Robot.named(name)
    turns = np.array([kind.value == "revolute" for kind in arm.kinds])
    pairs = [(low, low + 5.0) if turn else (-0.4, 0.7) for turn in turns]
    arm = limited(arm, pairs)
    lows, highs = arm.limits[:, 0], arm.limits[:, 1]
    q = np.random.default_rng(4).uniform(lows, highs, (300, 6))
    found = arm.inverse(arm.forward(q))
    assert found.within_limits.any(-1).all()
    some = found.q[found.within_limits]
    assert ((some >= lows) & (some <= highs)).all()
    assert ((found.nearest >= lows) & (found.nearest <= highs)).all()
    assert np.abs(arm.pose(found.nearest) - arm.pose(q)).max() < 1e-10
    # the flag by its definition, for every branch
    several = found.q[found.valid][:, None] + 2 * pi * np.arange(-20, 21)[:, None] * turns
    possible = ((several >= lows) & (several <= highs)).any(1).all(-1)
    assert np.array_equal(possible, found.within_limits[found.valid])


def test_a_joint_at_its_limit() -> None:
    """Rounding puts a joint at its limit slightly beyond it: the result is exactly the limit."""
    arm = limited(Robot.named("ur5"), [(-1.0, 0.7)] * 6)
    q = np.where(np.random.default_rng(5).random((200, 6)) < 0.5, 0.7, -1.0)
    found = arm.inverse(arm.forward(q))
    assert found.within_limits.any(-1).all()
    assert (found.nearest <= 0.7).all() and (found.nearest >= -1.0).all()


def test_the_branch_nearest_to_the_current_configuration() -> None:
    arm = Robot.named("ur5")  # two full turns in each direction
    rng = np.random.default_rng(6)
    q = rng.uniform(-2 * pi, 2 * pi, (200, 6))
    near = np.clip(q + rng.normal(size=(200, 6)) * 0.02, -2 * pi, 2 * pi)
    found = arm.inverse(arm.forward(q), near=near)
    assert np.abs(found.nearest - q).max() < 1e-9
    assert (np.abs(found.q[found.within_limits]) <= 2 * pi).all()
    free = Robot.from_dh(PLANAR)
    there = free.inverse(free.forward([0.3, 0.9, 0.2]), near=[50.0, -70.0, 20.0])
    assert np.abs(there.q - [50.0, -70.0, 20.0]).max() <= pi
    one = arm.inverse(arm.forward(q), near=np.zeros(6))
    assert np.array_equal(one.q, arm.inverse(arm.forward(q)).q, equal_nan=True)
    with pytest.raises(ValueError, match=r"ur5: near: shape \(5,\); expected \(..., 6\)"):
        arm.inverse(arm.forward(q), near=np.zeros(5))
    with pytest.raises(
        ValueError, match=r"ur5: near: shape \(3, 6\); expected one configuration, or one for each pose"
    ):
        arm.inverse(arm.forward(q), near=np.zeros((3, 6)))
    with pytest.raises(ValueError, match="ur5: near: nan at"):
        arm.inverse(arm.forward(q), near=np.full(6, np.nan))


def test_locked_joints_keep_the_given_values() -> None:
    arm = limited(Robot.named("iiwa"), [(pi / 2, 3 * pi / 2)] * 7)
    q = np.random.default_rng(7).uniform(pi / 2, 3 * pi / 2, (50, 7))
    found = arm.inverse(arm.forward(q), locked={0: q[:, 0]})
    assert np.abs(found.nearest - q).max(-1).min() < 1e-9 and found.within_limits.any(-1).all()
    assert (found.nearest[:, 0] == q[:, 0]).all()
    beside = arm.inverse(arm.forward(q), locked={0: q[:, 0] - 2 * pi})
    assert beside.valid.any() and not beside.within_limits.any()


def test_prismatic_joints_have_no_full_turns() -> None:
    rows = [{"a": 0.4}, {"a": 0.3}, {"kind": "prismatic"}, {}]
    arm = limited(Robot.from_dh(rows), [(-pi, pi)] * 2 + [(0.0, 0.2), (-pi, pi)])
    q = np.array([[0.3, 0.5, 0.1, 0.2], [0.3, 0.5, -0.1, 0.2], [0.3, 0.5, 0.1 + 2 * pi, 0.2]])
    found = arm.inverse(arm.forward(q))
    assert found.valid.all() and found.within_limits.any(-1).tolist() == [True, False, False]


@pytest.mark.parametrize(("name", "locked"), [("puma560", ()), ("stanford", ()), ("panda", (6,)), ("iiwa", (0,))])
def test_named_robots(name: str, locked: tuple[int, ...]) -> None:
    arm = Robot.named(name)
    low, high = arm.limits[:, 0], arm.limits[:, 1]
    q = np.random.default_rng(1).uniform(low, high, (100, arm.n_joints))
    found = arm.inverse(arm.forward(q), locked={joint: q[:, joint] for joint in locked} or None)
    assert (found.status <= Status.SINGULAR).all() and (found.within_limits <= found.valid).all()
    assert found.within_limits.any(-1).all() and found.within_limits.sum() < found.valid.sum()
    turns = np.array([kind.value == "revolute" for kind in arm.kinds])
    for branch, inside in zip(found.q[found.valid], found.within_limits[found.valid], strict=True):
        several = branch + 2 * pi * np.arange(-2, 3)[:, None] * turns
        assert bool(((several >= low - 1e-9) & (several <= high + 1e-9)).any(0).all()) == inside
    chosen = found.nearest + 2 * pi * np.arange(-2, 3)[:, None, None] * turns
    assert ((chosen >= low - 1e-9) & (chosen <= high + 1e-9)).any(0).all()


def test_limits_of_the_panda_are_those_of_the_manufacturer() -> None:
    assert Robot.named("panda").limits[3, :2].tolist() == [-3.0718, -0.0698]
    assert Robot.named("puma560").limits[0, 1] == pytest.approx(radians(160))


def test_a_robot_whose_tool_is_on_a_branch() -> None:
    arm = limited(Robot.from_dh(PLANAR), [(-pi, pi), (0.0, 2.5), (-pi, pi)])
    fields = ("name", "kinds", "axes", "home", "limits", "joint_names")
    part = Robot(**{field: getattr(arm, field) for field in fields}, tip=1)
    q = np.array([0.4, 0.9, 0.0])
    found = part.inverse(part.forward(q))
    assert found.within_limits.any() and np.abs(found.nearest - q).max() < 1e-9
    beyond = part.inverse(part.forward([0.4, -0.9, 0.0]))
    assert beyond.valid.any() and not beyond.within_limits.any()
    # the joint after the tool is within its limits
    moved = limited(part, [(-pi, pi), (0.0, 2.5), (0.5, 1.0)])
    found = moved.inverse(moved.forward(q))
    assert found.within_limits.any() and found.nearest[2] == 0.5
    assert moved.inverse(moved.forward(q), near=[0.0, 0.0, 0.8]).nearest[2] == 0.8


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ([1, -1, np.inf, np.inf], "1.0 to -1.0; expected the lower first"),
        ([-1, 1, -2, np.inf], "speed -2.0, effort inf; expected no negative number"),
        ([-1, 1, 2, -np.inf], "speed 2.0, effort -inf; expected no negative number"),
    ],
)
def test_invalid_limits(row: list[float], words: str) -> None:
    arm = Robot.named("ur5")
    limits = arm.limits.copy()
    limits[2] = row
    with pytest.raises(DescriptionError, match=f"limits of joint 2: {words}"):
        replace(arm, limits=limits)
    with pytest.raises(JointCountError, match=r"limits of shape \(6, 2\); expected \(6, 4\)"):
        replace(arm, limits=limits[:, :2])
