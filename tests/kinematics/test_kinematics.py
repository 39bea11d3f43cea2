"""Robot arms against products of 4 x 4 matrices, closed forms and published poses."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

from algorithms.kinematics import Robot
from algorithms.kinematics.named import TABLES
from generated import pga3
from tests.support.all_cases import all_cases

QUARTER = pi / 2
PUMA560: list[dict[str, Any]] = [
    {"d": 0.67183, "alpha": QUARTER},
    {"a": 0.4318},
    {"d": 0.15005, "a": 0.0203, "alpha": -QUARTER},
    {"d": 0.4318, "alpha": QUARTER},
    {"alpha": -QUARTER},
    {},
]
UR5: list[dict[str, Any]] = [
    {"d": 0.089459, "alpha": QUARTER},
    {"a": -0.425},
    {"a": -0.39225},
    {"d": 0.10915, "alpha": QUARTER},
    {"d": 0.09465, "alpha": -QUARTER},
    {"d": 0.0823},
]
STANFORD: list[dict[str, Any]] = [
    {"d": 0.412, "alpha": -QUARTER},
    {"d": 0.154, "alpha": QUARTER},
    {"a": 0.0203, "theta": -QUARTER, "kind": "prismatic"},
    {"alpha": -QUARTER},
    {"alpha": QUARTER},
    {"theta": 0.3, "d": 0.263},
]
TOOLBOX_NOMINAL = np.array([0, pi / 4, pi, 0, pi / 4, 0])


def turn(axis: int, angle: float) -> np.ndarray:
    matrix = np.eye(4)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[[i, i, j, j], [i, j, i, j]] = cos(angle), -sin(angle), sin(angle), cos(angle)
    return matrix


def shift(axis: int, distance: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[axis, 3] = distance
    return matrix


def frames_by_matrices(rows: list[dict[str, Any]], q: np.ndarray, convention: str = "standard") -> np.ndarray:
    """The frame after each joint, from elementary 4 x 4 matrices."""
    pose, frames = np.eye(4), []
    for row, value in zip(rows, q, strict=True):
        slides = row.get("kind") == "prismatic"
        d = row.get("d", 0.0) + (value if slides else 0.0)
        theta = row.get("theta", 0.0) + (0.0 if slides else value)
        about_z = turn(2, theta) @ shift(2, d)
        about_x = turn(0, row.get("alpha", 0.0)) @ shift(0, row.get("a", 0.0))
        pose = pose @ (about_z @ about_x if convention == "standard" else about_x @ about_z)
        frames.append(pose)
    return np.array(frames)


def joints(n: int, *shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-pi, pi, (*shape, n))


def ur(one: float, four: float, five: float, six: float, arms: float) -> list[list[float]]:
    """The tip and the approach of an arm of Universal Robots at zero, stretched out backwards."""
    return [[-arms, -four - six, one - five], [0, -1, 0]]


def kinova(one: float, two: float, three: float, wrist: float, six: float, offset: float) -> list[list[float]]:
    """The upper arm hangs down, the forearm stands up; both parts of the wrist lean by 30 degrees."""
    return [[0, wrist - offset, one - two + three + 3**0.5 * wrist + six], [0, 0, 1]]


@all_cases("name, home", [
    ("ur3", ur(0.1519, 0.11235, 0.08535, 0.0819, 0.4569)),
    ("ur10", ur(0.1273, 0.163941, 0.1157, 0.0922, 1.1843)),
    ("ur3e", ur(0.15185, 0.13105, 0.08535, 0.0921, 0.45675)),
    ("ur5e", ur(0.1625, 0.1333, 0.0997, 0.0996, 0.8172)),
    ("ur10e", ur(0.1807, 0.17415, 0.11985, 0.11655, 1.18425)),
    ("ur16e", ur(0.1807, 0.17415, 0.11985, 0.11655, 0.8384)),
    ("ur20", ur(0.2363, 0.2010, 0.1593, 0.1543, 1.5907)),
    ("ur30", ur(0.2363, 0.2010, 0.1593, 0.1543, 1.1407)),
    ("jaco", kinova(0.2755, 0.41, 0.2073, 0.0743, 0.1687, 0.0098)),
    ("mico", kinova(0.2755, 0.29, 0.1233, 0.0741, 0.16, 0.007)),
    ("irb140", [[0.07 + 0.36, 0, 0.352 - 0.38 - 0.065], [0, 0, -1]]),
    ("kr5", [[0.18 + 0.6 + 0.12, 0, 0.4 - 0.62 - 0.115], [0, 0, -1]]),
    ("cobra600", [[0.325 + 0.275, 0, 0.387], [0, 0, -1]]),
    ("sawyer", [[0.081, 0.1925 - 0.1685 + 0.1363, 0.317 - 0.13375], [0, 0, -1]]),
    ("crx10ia", [[0.54, -0.15, -0.54 - 0.16], [0, 0, 1]]),
])  # fmt: skip
def test_arms_at_zero_by_lengths_of_their_makers(name: str, home: list[list[float]]) -> None:
    arm = Robot.named(name)
    pose = pga3.motor_to_matrix(arm.forward(np.zeros(arm.n_joints)))
    assert np.abs(pose[:3, [3, 2]].T - home).max() < 1e-6  # lengths of Kinova are rounded
    assert (arm.limits[:, 0] <= 0).all() and (arm.limits[:, 1] >= 0).all()
    assert not name.startswith("ur") or (arm.limits[:, :2] == [-2 * pi, 2 * pi]).all()


def test_puma_at_its_nominal_pose() -> None:
    """The translation that the Robotics Toolbox prints for ``puma.fkine(puma.qn)``."""
    pose = Robot.named("puma560").pose(TOOLBOX_NOMINAL)
    assert pose[:3, 3] == pytest.approx((0.596303, -0.15005, 0.657476), abs=5e-7)
    assert pose[:3, :3] == pytest.approx(np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]), abs=1e-15)


@pytest.mark.parametrize(("name", "rows"), [("puma560", PUMA560), ("ur5", UR5)])
def test_named_robots_have_the_published_tables(name: str, rows: list[dict[str, Any]]) -> None:
    q = joints(6, 50)
    expected = np.array([frames_by_matrices(rows, one)[-1] for one in q])
    assert np.abs(Robot.named(name).pose(q) - expected).max() < 1e-14


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("rows", [PUMA560, UR5, STANFORD], ids=["puma560", "ur5", "stanford"])
def test_every_frame_equals_the_product_of_matrices(rows: list[dict[str, Any]], convention: str) -> None:
    """Tables with prismatic joints and offsets, read in both conventions."""
    arm, q = Robot.from_dh(rows, convention), joints(6, 100, seed=1)
    motors = arm.forward_all(q)
    expected = np.array([frames_by_matrices(rows, one, convention) for one in q])
    assert np.abs(pga3.motor_to_matrix(motors) - expected).max() < 2e-14
    assert np.abs(arm.pose(q) - expected[:, -1]).max() < 2e-14
    assert np.abs(arm.forward(q) - motors[:, -1]).max() < 2e-15


def test_random_tables() -> None:
    rng = np.random.default_rng(2)
    for n in range(1, 9):
        rows = [
            {**dict(zip(("d", "a", "alpha", "theta"), rng.normal(size=4), strict=True)), "kind": kind}
            for kind in rng.choice(["revolute", "prismatic"], n)
        ]
        q = joints(n, 20, seed=n)
        for convention in ("standard", "modified"):
            expected = np.array([frames_by_matrices(rows, one, convention)[-1] for one in q])
            assert np.abs(Robot.from_dh(rows, convention).pose(q) - expected).max() < 1e-13


def test_planar_arm_in_closed_form() -> None:
    """Two links in a plane: x = a cos q1 + b cos(q1 + q2), y likewise with sines."""
    q = joints(2, 100)
    pose = Robot.from_dh([{"a": 0.7}, {"a": 0.4}]).pose(q)
    first, both = q[:, 0], q.sum(-1)
    assert np.abs(pose[:, 0, 3] - (0.7 * np.cos(first) + 0.4 * np.cos(both))).max() < 1e-15
    assert np.abs(pose[:, 1, 3] - (0.7 * np.sin(first) + 0.4 * np.sin(both))).max() < 1e-15
    assert np.abs(pose[:, 2, 3]).max() == 0


def test_motors_are_unit_and_follow_the_right_hand_rule() -> None:
    arm = Robot.from_dh([{}])
    quarter = pga3.move_point(arm.forward([QUARTER]), np.array([1.0, 0.0, 0.0]))
    assert quarter == pytest.approx((0, 1, 0), abs=1e-15)
    motors = Robot.named("ur5").forward(joints(6, 1000))
    assert np.abs(pga3.normalize_motor(motors) - motors).max() < 1e-14


def test_a_full_turn_is_the_same_pose_and_the_other_motor() -> None:
    arm, q = Robot.named("puma560"), joints(6, 20)
    turned = q + 2 * pi * np.eye(6)[3]
    assert np.abs(arm.pose(turned) - arm.pose(q)).max() < 1e-14
    assert np.abs(arm.forward(turned) + arm.forward(q)).max() < 1e-14


def test_units_of_length_do_not_matter() -> None:
    q = joints(6, 50)
    in_millimetres = [{**row, "d": 1e3 * row.get("d", 0.0), "a": 1e3 * row.get("a", 0.0)} for row in UR5]
    small, large = Robot.from_dh(UR5).pose(q), Robot.from_dh(in_millimetres).pose(q)
    assert np.abs(large[:, :3, 3] - 1e3 * small[:, :3, 3]).max() < 1e-11
    assert np.array_equal(large[:, :3, :3], small[:, :3, :3])


def test_leading_axes_blocks_and_empty_batches() -> None:
    """Batches larger than one block give the same results as single configurations."""
    arm, q = Robot.named("puma560"), joints(6, 3, 3001)
    motors = arm.forward(q)
    assert motors.shape == (3, 3001, 8)
    for index in ((0, 0), (1, 1094), (1, 1095), (2, 2189), (2, 3000)):
        assert np.abs(arm.forward(q[index]) - motors[index]).max() < 1e-15
    assert arm.forward(q[0, 0]).shape == (8,)
    for shape in ((0,), (2, 0, 3)):
        empty = np.empty((*shape, 6))
        assert arm.forward(empty).shape == (*shape, 8)
        assert arm.forward_all(empty).shape == (*shape, 6, 8)
        assert arm.pose(empty).shape == (*shape, 4, 4)


def test_any_memory_order_and_nothing_is_written() -> None:
    arm, q = Robot.named("ur5"), joints(6, 40, 5)
    expected = arm.forward(q)
    wide = np.zeros((40, 10, 12))
    wide[:, ::2, ::2] = q
    frozen = q.copy()
    frozen.flags.writeable = False
    for same in (np.asfortranarray(q), wide[:, ::2, ::2], q[::-1, ::-1][::-1, ::-1], frozen, q.astype(">f8")):
        assert np.array_equal(arm.forward(same), expected)
    assert np.array_equal(frozen, q)


def test_single_precision_is_preserved() -> None:
    arm, q = Robot.named("puma560"), joints(6, 200)
    single = q.astype(np.float32)
    assert arm.forward(single).dtype == arm.forward_all(single).dtype == arm.pose(single).dtype == np.float32
    assert np.abs(arm.pose(single) - arm.pose(single.astype(float))).max() < 2e-6


def test_integers_and_lists_are_joint_variables_too() -> None:
    arm = Robot.named("puma560")
    expected = arm.forward(np.array([0.0, 1.0, 2.0, 0.0, 1.0, 0.0]))
    assert arm.forward([0, 1, 2, 0, 1, 0]) == pytest.approx(expected, abs=1e-15)
    assert arm.forward(np.array([0, 1, 2, 0, 1, 0])) == pytest.approx(expected, abs=1e-15)


def test_a_nan_affects_only_its_configuration() -> None:
    arm, q = Robot.named("ur5"), joints(6, 5)
    good = arm.forward(q)
    q[2, 4] = np.nan
    bad = arm.forward(q)
    assert np.isnan(bad[2]).any()
    assert np.array_equal(np.delete(bad, 2, 0), np.delete(good, 2, 0))


@pytest.mark.parametrize(
    ("q", "error", "message"),
    [
        (np.zeros(5), ValueError, r"ur5: q: shape \(5,\); expected \(\.\.\., 6\), 6 joint variables"),
        (np.zeros((6, 1)), ValueError, r"shape \(6, 1\)"),
        (1.0, ValueError, r"shape \(\)"),
        ([[0.0], [0.0, 1.0]], ValueError, "not an array of numbers"),
        (np.zeros(6, complex), TypeError, "dtype complex128; expected real numbers"),
        (np.array([None] * 6), TypeError, "dtype object"),
        (["a"] * 6, TypeError, "expected real numbers"),
    ],
)
def test_wrong_joint_variables(q: Any, error: type[Exception], message: str) -> None:
    arm = Robot.named("ur5")
    for method in (arm.forward, arm.forward_all, arm.pose):
        with pytest.raises(error, match=message):
            method(q)


@all_cases(
    "rows, convention, error, message",
    [
        ([{"a": 1.0}, {"alfa": 1.0}], "standard", ValueError, "row 1: unknown key 'alfa'; expected d, a, alpha, theta"),
        ([{"a": float("nan")}], "standard", ValueError, "row 0: a: nan; expected a finite number"),
        ([{}, {}, {"d": float("inf")}], "standard", ValueError, "row 2: d: inf"),
        ([{"alpha": "90"}], "standard", TypeError, "row 0: alpha: '90'; expected a number"),
        ([{"theta": None}], "standard", TypeError, "row 0: theta"),
        ([{"d": True}], "standard", TypeError, "row 0: d: True"),
        (
            [{"kind": "spherical"}],
            "standard",
            ValueError,
            "row 0: kind 'spherical'; expected 'revolute' or 'prismatic'",
        ),
        ([{}], "craig", ValueError, "convention: 'craig'; expected 'standard' or 'modified'"),
        ([{}], None, ValueError, "convention: None"),
        ([], "standard", ValueError, "rows: none"),
        ([1.0], "standard", TypeError, "row 0: float; expected a mapping"),
        ({"a": 1.0}, "standard", TypeError, "rows: dict; expected a list"),
    ],
)
def test_wrong_tables(rows: Any, convention: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        Robot.from_dh(rows, convention)


def test_unknown_robot() -> None:
    with pytest.raises(ValueError, match="robot 'puma': unknown; expected one of puma560, stanford, ur5, panda"):
        Robot.named("puma")


def test_a_robot_is_shown_in_one_screen() -> None:
    lines = repr(Robot.named("panda")).splitlines()
    assert lines[0] == "Robot 'panda': 7 joints, 7 variables, 16.06 kg; the end effector is carried by joint 6"
    assert lines[4] == "  joint 3              revolute     -3.072 to -0.0698" and len(lines) == 8
    many = repr(Robot.from_dh([{"a": 0.1}] * 60)).splitlines()
    assert len(many) == 42 and many[-1] == "  ... and 20 more" and "unknown masses" in many[0]
    for name, table in TABLES.items():
        arm = Robot.named(name)
        assert table.source and np.isfinite(arm.pose(np.zeros(arm.n_joints))).all()
