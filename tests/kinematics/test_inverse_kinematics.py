"""Inverse kinematics against products of 4 x 4 matrices, the law of cosines, and the configurations of poses."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

from algorithms.kinematics import Robot
from algorithms.kinematics.denavit_hartenberg import Joint
from algorithms.kinematics.inverse import Solutions, Status, elbow_angle
from generated import arms, pga3
from tests.support.all_cases import all_cases

Rows = list[dict[str, Any]]
QUARTER, SLIDE = pi / 2, "prismatic"
POSES = 800

PUMA560: Rows = [
    {"d": 0.67183, "alpha": QUARTER},
    {"a": 0.4318},
    {"d": 0.15005, "a": 0.0203, "alpha": -QUARTER},
    {"d": 0.4318, "alpha": QUARTER},
    {"alpha": -QUARTER},
    {},
]
UR5: Rows = [
    {"d": 0.089459, "alpha": QUARTER},
    {"a": -0.425},
    {"a": -0.39225},
    {"d": 0.10915, "alpha": QUARTER},
    {"d": 0.09465, "alpha": -QUARTER},
    {"d": 0.0823},
]
PRISMATIC = Joint.PRISMATIC
STANFORD: Rows = [
    {"d": 0.412, "alpha": -QUARTER},
    {"d": 0.154, "alpha": QUARTER},
    {"a": 0.0203, "theta": -QUARTER, "kind": SLIDE},
    {"alpha": -QUARTER},
    {"alpha": QUARTER},
    {"theta": 0.3, "d": 0.263},
]
PANDA: Rows = [
    {"d": 0.333},
    {"alpha": -QUARTER},
    {"alpha": QUARTER, "d": 0.316},
    {"a": 0.0825, "alpha": QUARTER},
    {"a": -0.0825, "alpha": -QUARTER, "d": 0.384},
    {"alpha": QUARTER},
    {"a": 0.088, "alpha": QUARTER, "d": 0.107},
]
IIWA: Rows = [
    {"d": 0.36, "alpha": -QUARTER},
    {"alpha": QUARTER},
    {"d": 0.42, "alpha": QUARTER},
    {"alpha": -QUARTER},
    {"d": 0.4, "alpha": -QUARTER},
    {"alpha": QUARTER},
    {"d": 0.126},
]
CRAIG_PUMA: Rows = [
    {},
    {"alpha": -QUARTER, "d": 0.2435},
    {"a": 0.4318, "d": -0.0934},
    {"a": -0.0203, "alpha": QUARTER, "d": 0.4331},
    {"alpha": -QUARTER},
    {"alpha": QUARTER, "theta": 0.5},
]
CRAIG_UR5: Rows = [
    {"d": 0.089},
    {"alpha": QUARTER, "theta": 0.2},
    {"a": -0.425},
    {"a": -0.392, "d": 0.109},
    {"alpha": QUARTER, "d": 0.095},
    {"alpha": -QUARTER, "d": 0.082},
]
CRAIG_SKEW: Rows = [
    {"d": 0.2, "a": 0.1, "alpha": 0.3},
    {"a": 0.3, "alpha": 1.1, "d": 0.15},
    {"a": 0.25, "alpha": -0.8, "d": 0.1},
    {"a": 0.2, "alpha": 0.9, "d": 0.3},
    {"alpha": 1.2},
    {"alpha": -1.3, "d": 0.1},
]
SCARA: Rows = [{"a": 0.4, "d": 0.3}, {"a": 0.3, "alpha": pi}, {"kind": SLIDE}, {"d": 0.05, "theta": 0.2}]
PLANAR: Rows = [{"a": 0.5}, {"a": 0.4}, {"a": 0.2}]
CYLINDRICAL: Rows = [
    {"d": 0.2},
    {"alpha": -QUARTER, "kind": SLIDE},
    {"kind": SLIDE},
    {"alpha": QUARTER},
    {"alpha": -QUARTER},
    {"d": 0.1},
]
SKEW: Rows = [
    {"d": 0.3, "a": 0.1, "alpha": 1.2},
    {"a": 0.4, "d": 0.1, "alpha": 0.3},
    {"a": 0.2, "d": 0.1, "alpha": -1.0},
    {"a": 0.05, "d": 0.3, "alpha": 1.3},
    {"a": 0.06, "d": 0.05, "alpha": -1.1},
    {"d": 0.1},
]


def random_wrist(seed: int) -> Rows:
    """Three skew axes, then three oblique ones through a point, and a tool."""
    rng = np.random.default_rng(seed)
    rows: Rows = [
        {
            "d": rng.uniform(-0.5, 0.5),
            "a": rng.uniform(0.1, 0.5),
            "alpha": rng.uniform(-pi, pi),
            "theta": rng.uniform(-1, 1),
        }
        for _ in range(3)
    ]
    rows += [{"d": rng.uniform(-0.5, 0.5), "alpha": rng.uniform(0.6, 2.5)}, {"alpha": rng.uniform(0.6, 2.5)}]
    return [*rows, {"d": 0.1, "a": 0.2, "alpha": 0.4, "theta": 1.0}]


def pose_by_matrices(rows: Rows, q: np.ndarray, convention: str = "standard") -> np.ndarray:
    """Poses (..., 4, 4) from the formulas of Denavit-Hartenberg tables."""
    pose = np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4))
    for j, row in enumerate(rows):
        slides = row.get("kind") == SLIDE
        d = row.get("d", 0.0) + (q[..., j] if slides else 0.0 * q[..., j])
        theta = row.get("theta", 0.0) + (0.0 if slides else q[..., j])
        c, s, o = np.cos(theta) + 0 * d, np.sin(theta) + 0 * d, 0 * d
        about_z = np.stack([c, -s, o, o, s, c, o, o, o, o, o + 1, d, o, o, o, o + 1], -1).reshape(*c.shape, 4, 4)
        ca, sa = np.cos(row.get("alpha", 0.0)), np.sin(row.get("alpha", 0.0))
        about_x = np.array([[1, 0, 0, row.get("a", 0.0)], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]])
        pose = pose @ (about_z @ about_x if convention == "standard" else about_x @ about_z)
    return pose


def configurations(rows: Rows, count: int, seed: int = 1) -> np.ndarray:
    q = np.random.default_rng(seed).uniform(-pi, pi, (count, len(rows)))
    slides = [row.get("kind") == SLIDE for row in rows]
    q[:, slides] /= pi
    return q


def check(rows: Rows, q: np.ndarray, found: Solutions, convention: str = "standard") -> None:
    """Every valid branch reaches the pose of `q` to 1e-10, and one of them is `q`."""
    poses = pose_by_matrices(rows, q, convention)
    reached = pose_by_matrices(rows, np.where(found.valid[..., None], found.q, 0.0), convention)
    assert np.abs(reached - poses[:, None])[found.valid].max() < 1e-10
    away = found.q - q[:, None]
    turns = [row.get("kind") != SLIDE for row in rows]
    away[..., turns] = (away[..., turns] + pi) % (2 * pi) - pi
    nearest = np.where(found.valid, np.abs(away).max(-1), np.inf).min(-1)
    assert nearest.max() < 1e-5 and np.mean(nearest < 1e-9) > 0.99
    assert np.isin(found.status, (Status.FOUND, Status.SINGULAR)).all()
    assert np.isnan(found.q[~found.valid]).all()
    angles = found.q[found.valid][:, turns]
    assert (angles > -pi).all() and (angles <= pi).all()
    assert np.array_equal(found.nearest, found.q[np.arange(len(q)), found.valid.argmax(-1)])


@all_cases(
    "rows, method, branches",
    [
        (PUMA560, "spherical wrist", {8}),
        (UR5, "three parallel axes", {2, 4, 6, 8}),
        (STANFORD, "spherical wrist", {8}),
        (CYLINDRICAL, "spherical wrist", {4}),
        (random_wrist(1), "spherical wrist", {2, 4, 6, 8}),
        (random_wrist(2), "spherical wrist", {2, 4, 6, 8}),
        (random_wrist(3), "spherical wrist", {2, 4, 6, 8}),
        (SCARA, "parallel axes", {2}),
        (PLANAR, "parallel axes", {2}),
        (PLANAR[:2], "parallel axes", {1}),
    ],
)
def test_all_branches_of_arms_with_closed_forms(rows: Rows, method: str, branches: set[int]) -> None:
    q = configurations(rows, POSES)
    found = Robot.from_dh(rows).inverse(pga3.motor_from_matrix(pose_by_matrices(rows, q)))
    check(rows, q, found)
    assert found.method == method
    assert set(found.valid.sum(-1)) == branches


@pytest.mark.parametrize("rows", [CRAIG_PUMA, CRAIG_UR5, CRAIG_SKEW])
def test_the_modified_convention(rows: Rows) -> None:
    q = configurations(rows, 500, 5)
    found = Robot.from_dh(rows, "modified").inverse(pose_by_matrices(rows, q, "modified"))
    check(rows, q, found, "modified")


def test_an_arm_in_reverse_order() -> None:
    """Only the first three axes of this arm meet: the table of an arm with a wrist in reverse order."""
    rows: Rows = [
        {"alpha": -QUARTER},
        {"alpha": QUARTER},
        {"d": 0.4, "alpha": -QUARTER, "a": 0.1},
        {"a": 0.4},
        {"a": 0.2, "alpha": 1.0},
        {"d": 0.1},
    ]
    q = configurations(rows, 2000, 6)
    found = Robot.from_dh(rows).inverse(pose_by_matrices(rows, q))
    check(rows, q, found)
    assert found.method == "spherical shoulder"


def test_panda_with_its_last_joint_fixed() -> None:
    q = configurations(PANDA, POSES, 2)
    arm = Robot.from_dh(PANDA, "modified")
    found = arm.inverse(pose_by_matrices(PANDA, q, "modified"), locked={6: q[:, 6]})
    check(PANDA, q, found, "modified")
    assert set(found.valid.sum(-1)) <= {2, 4, 6, 8} and found.method == "spherical shoulder"
    assert np.array_equal(found.q[..., 6][found.valid], np.repeat(q[:, 6], found.valid.sum(-1)))


def test_seven_joints_with_an_angle_of_the_elbow() -> None:
    q = configurations(IIWA, POSES, 3)
    arm = Robot.from_dh(IIWA)
    poses = pose_by_matrices(IIWA, q)
    found = arm.inverse(poses, elbow=elbow_angle(arm, q))
    check(IIWA, q, found)
    assert (found.valid.sum(-1) == 8).all()
    # A different angle: the same pose and wrist, with the elbow at the requested position.
    turned = arm.inverse(poses[:200], elbow=0.7)
    assert turned.valid.all() and np.abs(elbow_angle(arm, turned.q) - 0.7).max() < 1e-7
    assert np.abs(pose_by_matrices(IIWA, turned.q) - poses[:200, None]).max() < 1e-10


def test_seven_joints_with_any_joint_fixed() -> None:
    for joint in (0, 2):
        q = configurations(IIWA, 300, 4)
        q[:, joint] = np.repeat([0.4, -1.1, 2.0], 100)
        found = Robot.from_dh(IIWA).inverse(pose_by_matrices(IIWA, q), locked={joint: q[:, joint]})
        check(IIWA, q, found)


def test_a_planar_arm_by_the_law_of_cosines() -> None:
    """Two links of 0.5 and 0.4, wrist at (x, y): the elbow's cosine is ``(x^2 + y^2 - 0.41) / 0.4``."""
    rng = np.random.default_rng(8)
    distance, bearing, heading = rng.uniform(0.11, 0.89, 500), rng.uniform(-pi, pi, 500), rng.uniform(-pi, pi, 500)
    x, y = distance * np.cos(bearing), distance * np.sin(bearing)
    poses = np.tile(np.eye(4), (500, 1, 1))
    poses[:, :2, :2] = np.moveaxis([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]], -1, 0)
    poses[:, 0, 3], poses[:, 1, 3] = x + 0.2 * np.cos(heading), y + 0.2 * np.sin(heading)
    found = Robot.from_dh(PLANAR).inverse(poses)
    assert found.valid.all()
    elbow = np.arccos((distance**2 - 0.41) / 0.4)
    assert np.sort(found.q[..., 1], -1) == pytest.approx(np.stack([-elbow, elbow], -1), abs=1e-9)


def test_the_search_finds_configurations_of_an_arm_of_seven_joints() -> None:
    rows = [*SKEW, {"a": 0.1, "d": 0.1, "alpha": 0.5}]
    q = configurations(rows, 40, 9)
    poses = pose_by_matrices(rows, q)
    found = Robot.from_dh(rows).inverse(poses)
    assert found.method == "search"
    assert np.mean(found.valid.any(-1)) > 0.95
    assert np.isin(found.status[~found.valid.any(-1)], Status.NOT_FOUND).all()
    reached = pose_by_matrices(rows, np.where(found.valid[..., None], found.q, 0.0))
    assert np.abs(reached - poses[:, None])[found.valid].max() < 1e-10
    for branches, valid in zip(found.q, found.valid, strict=True):
        some = branches[valid]
        away = np.abs((some[:, None] - some + pi) % (2 * pi) - pi).max(-1)
        assert (away + np.eye(len(some)) > 1e-5).all()


@pytest.mark.parametrize("rows", [PUMA560, UR5, STANFORD[:2] + SKEW[2:3] + PUMA560[3:], random_wrist(1), PLANAR, IIWA])
def test_unreachable_poses(rows: Rows) -> None:
    q = configurations(rows, 300, 10)
    poses = pose_by_matrices(rows, q)
    total = sum(abs(row.get("a", 0.0)) + abs(row.get("d", 0.0)) for row in rows)
    direction = np.random.default_rng(11).normal(size=(300, 3)) * ([1, 1, 0] if rows is PLANAR else 1)
    poses[:, :3, 3] = 1.5 * total * direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    arm = Robot.from_dh(rows)
    found = arm.inverse(poses, **({"elbow": 0.3} if rows is IIWA else {}))
    assert (found.status == Status.OUT_OF_REACH).all()
    assert not found.valid.any() and np.isnan(found.q).all()
    near = pose_by_matrices(rows, found.nearest)
    assert np.isfinite(near).all()
    # No pose of random configurations is nearer in the metric of lengths and scaled angles.
    others = pose_by_matrices(rows, configurations(rows, 2000, 12))
    for k in range(0, 300, 30):
        far = np.linalg.norm(others[:, :3, 3] - poses[k, :3, 3], axis=-1)
        assert np.linalg.norm(near[k, :3, 3] - poses[k, :3, 3]) < np.median(far)


def test_the_nearest_configuration_of_a_planar_arm_is_stretched() -> None:
    """Two links and a goal on the x axis without rotation: both links are along x."""
    goal = np.eye(4)
    goal[0, 3] = 2.0
    found = Robot.from_dh(PLANAR[:2]).inverse(goal)
    assert found.status == Status.OUT_OF_REACH
    assert found.nearest == pytest.approx([0, 0], abs=1e-5)


def test_a_pose_outside_the_motions_of_a_planar_arm() -> None:
    arm = Robot.from_dh(PLANAR)
    goals = arm.pose(configurations(PLANAR, 20))
    goals[:, 2, 3] = 0.1
    assert (arm.inverse(goals).status == Status.OUT_OF_REACH).all()


@pytest.mark.parametrize(
    ("rows", "q"),
    [
        (PUMA560, [0.3, 0.4, 0.5, 0.6, 0.0, 0.7]),
        (PUMA560, [0.3, 0.4, np.arctan2(0.0203, 0.4318) - QUARTER, 0.6, 0.5, 0.7]),
        (UR5, [0.3, 0.4, 0.5, 0.6, 0.0, 0.7]),
        (UR5, [0.3, 0.4, 0.0, 0.6, 0.5, 0.7]),
        (STANFORD, [0.3, 0.4, 0.5, 0.6, 0.0, 0.7]),
        (STANFORD, [0.3, 0.4, 0.0, 0.6, 0.5, 0.7]),
        (PLANAR, [0.3, 0.0, 0.4]),
    ],
)
def test_singular_poses_are_flagged_and_solved(rows: Rows, q: list[float]) -> None:
    pose = pose_by_matrices(rows, np.array(q))
    found = Robot.from_dh(rows).inverse(pose)
    assert found.status == Status.SINGULAR
    assert np.abs(pose_by_matrices(rows, found.q[found.valid]) - pose).max() < 1e-10


@all_cases("rows, joint, value", [(PUMA560, 4, 0.0), (UR5, 4, 0.0), (UR5, 2, 0.0), (STANFORD, 4, pi)])
@all_cases("away", [0.0, 1e-14, 1e-10, 1e-8, 1e-7, 1e-6, 1e-4])
def test_near_singular_poses_are_reached(rows: Rows, joint: int, value: float, away: float) -> None:
    q = configurations(rows, 300, 18)
    q[:, joint] = value + away
    poses = pose_by_matrices(rows, q)
    found = Robot.from_dh(rows).inverse(poses)
    assert found.valid.any(-1).all()
    reached = pose_by_matrices(rows, np.where(found.valid[..., None], found.q, 0.0))
    assert np.abs(reached - poses[:, None])[found.valid].max() < 1e-10
    if rows is not UR5:
        assert found.valid.all()


def test_both_signs_batches_and_matrices_are_the_same() -> None:
    arm = Robot.named("ur5")
    motors = arm.forward(configurations(UR5, 60, 13))
    found, minus = arm.inverse(motors), arm.inverse(-motors)
    for name in ("q", "valid", "status", "nearest"):
        assert np.array_equal(getattr(found, name), getattr(minus, name), equal_nan=True)
    shaped = arm.inverse(motors.reshape(5, 12, 8))
    assert shaped.q.shape == (5, 12, 8, 6) and shaped.valid.shape == (5, 12, 8)
    assert shaped.status.shape == (5, 12) and shaped.nearest.shape == (5, 12, 6)
    assert np.array_equal(shaped.q.reshape(60, 8, 6), found.q, equal_nan=True)
    assert arm.inverse(np.zeros((0, 8))).q.shape == (0, 8, 6)
    assert arm.inverse(np.zeros((3, 0, 4, 4))).valid.shape == (3, 0, 8)
    assert Robot.from_dh(SKEW).inverse(np.zeros((0, 8))).status.shape == (0,)


@pytest.mark.parametrize("name", ["ur5", "puma560", "irb140"])
def test_branches_of_one_pose_are_those_of_a_batch_in_the_same_order(name: str) -> None:
    """A single pose is computed branch by branch in vectors: equal up to rounding errors, which conditions enlarge."""
    arm = Robot.named(name)
    q = np.random.default_rng(14).uniform(-3, 3, (60, 6))
    q = q[np.linalg.svd(arm.jacobian(q), compute_uv=False)[:, -1] > 0.02]
    poses = arm.pose(q)
    found, near = arm.inverse(poses), arm.inverse(poses, near=q)
    for k, pose in enumerate(poses):
        for many, one in ((found, arm.inverse(pose)), (near, arm.inverse(pose, near=q[k]))):
            assert one.status.shape == () and one.status == many.status[k]
            assert np.array_equal(one.valid, many.valid[k]) and np.array_equal(one.within_limits, many.within_limits[k])
            away = np.abs(np.exp(1j * one.q) - np.exp(1j * many.q[k]))[one.valid]
            assert away.max() < 1e-10 and np.isnan(one.q[~one.valid]).all()
            assert np.abs(arm.pose(one.q[one.valid]) - pose).max() < 1e-13
            assert np.abs(np.exp(1j * one.nearest) - np.exp(1j * many.nearest[k])).max() < 1e-10


def test_poses_that_are_not_finite_have_a_status() -> None:
    arm = Robot.named("puma560")
    motors = arm.forward(configurations(PUMA560, 4, 14))
    motors[1, 3], motors[2], motors[3, 0] = np.nan, 0.0, np.inf
    found = arm.inverse(motors)
    assert found.status.tolist() == [Status.FOUND, *[Status.NOT_FINITE] * 3]
    assert found.valid[0].all() and not found.valid[1:].any()
    assert np.isnan(found.q[1:]).all() and np.isnan(found.nearest[1:]).all()
    panda = Robot.from_dh(PANDA, "modified")
    assert panda.inverse(panda.forward(np.ones(7)), locked={6: np.nan}).status == Status.NOT_FINITE
    reachable = arm.pose(np.ones(6))
    for change in (np.diag([1.0, 1, -1, 1]), np.diag([2.0, 2, 2, 1]), np.full((4, 4), np.nan)):
        assert arm.inverse(reachable @ change).status == Status.NOT_FINITE
    assert arm.inverse(reachable.astype(np.float32)).status == Status.FOUND


def test_configurations_next_to_singular_ones_are_among_the_branches() -> None:
    """A few of 1e5 random configurations are so close to a singularity that normal equations would be inaccurate."""
    arm, q = Robot.named("panda"), np.random.default_rng(12).uniform(-np.pi, np.pi, (100_000, 7))
    q = q[np.abs(np.linalg.det(arm.jacobian(q)[..., :6])).argsort()[:300]]
    found = arm.inverse(arm.forward(q), locked={6: q[:, 6]})
    away = np.abs((found.q - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(-1)
    assert np.where(found.valid, away, np.inf).min(-1).max() < 1e-6


def test_wrong_arguments_are_named() -> None:
    arm = Robot.named("puma560")
    pose = np.eye(4)
    with pytest.raises(TypeError, match="locked: list; expected a mapping"):
        arm.inverse(pose, locked=[5])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="puma560: poses"):
        arm.inverse(np.ones(7))
    with pytest.raises(TypeError, match="puma560: poses"):
        arm.inverse(["a"] * 8)
    with pytest.raises(ValueError, match="joint 6; expected 0 to 5"):
        arm.inverse(pose, locked={6: 0.0})
    with pytest.raises(ValueError, match=r"locked\[5\]"):
        arm.inverse(pose, locked={5: np.zeros(3)})
    with pytest.raises(ValueError, match="elbow"):
        arm.inverse(pose, elbow=0.0)
    with pytest.raises(ValueError, match="one of them"):
        Robot.from_dh(IIWA).inverse(pose, elbow=0.0, locked={6: 0.0})
    with pytest.raises(ValueError, match="q"):
        elbow_angle(Robot.from_dh(IIWA), np.zeros(6))


# Steps of the method on vectors rotated by Rodrigues' formula.


def turned(v: np.ndarray, axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    return c * v + s * np.cross(axis, v) + (1 - c) * np.sum(axis * v, -1, keepdims=True) * axis


def unit(rng: np.random.Generator, count: int) -> np.ndarray:
    v = rng.normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def test_rotations_to_a_plane_and_to_a_sphere() -> None:
    rng = np.random.default_rng(15)
    n = 500
    axis, through, p, centre, normal = (
        unit(rng, n),
        rng.normal(size=(n, 3)),
        rng.normal(size=(n, 3)),
        rng.normal(size=(n, 3)),
        unit(rng, n),
    )
    line = pga3.join_point_direction(through, axis)
    around = np.linspace(-pi, pi, 721)
    circle = through[:, None] + turned((p - through)[:, None], axis[:, None], around[None])
    angles, gap = arms.turns_to_plane(line, p, pga3.plane_from_normal(normal, 0.3))
    heights = np.sum(circle * normal[:, None], -1) - 0.3
    assert np.array_equal(
        gap[np.abs(gap) > 1e-3] > 0, ((heights.min(-1) < 0) & (heights.max(-1) > 0))[np.abs(gap) > 1e-3]
    )
    moved = through[:, None] + turned((p - through)[:, None], axis[:, None], angles)
    assert np.abs(np.sum(moved * normal[:, None], -1) - 0.3)[gap > 0].max() < 1e-9
    angles, gap = arms.turns_to_sphere(line, p, centre, 1.5)
    heights = np.linalg.norm(circle - centre[:, None], axis=-1) - 1.5
    assert np.array_equal(
        gap[np.abs(gap) > 1e-3] > 0, ((heights.min(-1) < 0) & (heights.max(-1) > 0))[np.abs(gap) > 1e-3]
    )
    moved = through[:, None] + turned((p - through)[:, None], axis[:, None], angles)
    assert np.abs(np.linalg.norm(moved - centre[:, None], axis=-1) - 1.5)[gap > 0].max() < 1e-9
    # If there is no solution, the nearest angle is returned.
    missed = gap < -1e-3
    assert np.abs(np.linalg.norm(moved - centre[:, None], axis=-1) - 1.5)[missed].max(-1) == pytest.approx(
        np.abs(heights[missed]).min(-1), abs=1e-3
    )


def test_rotations_about_two_axes() -> None:
    rng = np.random.default_rng(16)
    n = 2000
    first, second, a = unit(rng, n), unit(rng, n), unit(rng, n)
    q = rng.uniform(-pi, pi, (n, 2))
    b = turned(turned(a, second, q[:, 1]), first, q[:, 0])
    lines = [pga3.join_point_direction(np.zeros(3), v) for v in (first, second, a, b)]
    one, other, gap = arms.turns_about_two_axes(*lines)
    for found in (one, other):
        assert np.abs(turned(turned(a, second, found[:, 1]), first, found[:, 0]) - b).max() < 1e-7
    nearest = np.minimum(*(np.abs((found - q + pi) % (2 * pi) - pi).max(-1) for found in (one, other)))
    assert nearest.max() < 1e-5 and (gap > -1e-12).all()


def test_intersections_of_ellipse_and_circle_agree_with_sampling() -> None:
    rng = np.random.default_rng(17)
    p, s = rng.normal(size=(100, 2, 2)), 0.5 * rng.normal(size=(100, 2))
    angles, imaginary = arms.turns_of_ellipse(p, s)
    around = np.linspace(-pi, pi, 10_001)
    samples = np.einsum("nij,jk->nik", p, np.array([np.cos(around), np.sin(around)])) + s[..., None]
    outside = np.linalg.norm(samples, axis=1) > 1
    crossings = np.sum(outside[:, 1:] != outside[:, :-1], -1)
    clear = np.abs(np.linalg.norm(samples, axis=1) - 1).min(-1) < 1e-3
    assert np.mean((imaginary == 0).sum(-1) == crossings) > 0.99
    at = np.einsum("nij,njk->nik", p, np.stack([np.cos(angles), np.sin(angles)], 1)) + s[..., None]
    assert np.abs(np.linalg.norm(at, axis=1) - 1)[imaginary == 0].max() < 1e-8
    assert clear.any() and set(crossings) == {0, 2, 4}


def test_joints_that_do_not_move_the_end_effector_are_kept() -> None:
    """A finger of a gripper that is not in the chain of the arm, and another that mimics it."""
    arm = Robot.from_dh(UR5)
    kinds = (arm.kinds[0], PRISMATIC, *arm.kinds[1:], PRISMATIC, PRISMATIC)
    order = [0, 0, *range(1, 6), 5, 5]
    parents = (-1, -1, 0, 2, 3, 4, 5, 6, 6)
    coupling = np.zeros((9, 9))
    coupling[range(8), range(8)] = 1.0
    coupling[8, 7] = -1.0
    tree = Robot("tree", kinds, arm.axes[order], arm.home[order], parents=parents, tip=6, coupling=coupling)
    moving = [0, 2, 3, 4, 5, 6]
    q = np.random.default_rng(2).uniform(-3, 3, (50, 8))
    goals = tree.forward(q)
    np.testing.assert_allclose(goals, arm.forward(q[:, moving]), atol=1e-14)
    found, alone = tree.inverse(goals), arm.inverse(goals)
    np.testing.assert_array_equal(found.valid, alone.valid)
    np.testing.assert_array_equal(found.q[..., moving], alone.q)
    assert not found.q[found.valid][:, [1, 7]].any()
    with pytest.raises(ValueError, match="joint 7 does not move the end effector"):
        tree.inverse(goals, locked={7: 0.0})
    coupling = coupling.copy()
    coupling[2, :] = 0.0
    coupling[2, 0] = 0.5
    follower = Robot("tree", kinds, arm.axes[order], arm.home[order], parents=parents, tip=6, coupling=coupling)
    with pytest.raises(ValueError, match="follows another joint"):
        follower.inverse(goals)
