"""Arms of six joints without structure: all branches, against poses by matrices and a search from many starts."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from arm_tables import JACO, OFFSET_WRIST, QUARTER, Rows, pose_by_matrices, random_arm
from selection import some_slow

from algorithms.kinematics import Robot, Status
from algorithms.kinematics.inverse.chain import Chain
from algorithms.kinematics.inverse.search import search
from algorithms.kinematics.inverse.slides import Scan
from algorithms.kinematics.named import TABLES
from generated import pga3

SIXTEEN: Rows = [
    {"a": 0.3, "alpha": QUARTER},
    {"a": 1.0, "alpha": pi / 180},
    {"d": 0.2, "alpha": QUARTER},
    {"a": 1.5, "alpha": pi / 180},
    {"alpha": QUARTER},
    {},
]
"""The arm of Manseur and Doty (*Int. J. Robotics Research* 8(5):75, 1989), which has sixteen configurations."""


def calibrated(name: str, size: float) -> Rows:
    """A known arm with manufacturing errors in every parameter: its axes nearly intersect, but not exactly."""
    rng = np.random.default_rng(0)
    keys = ("d", "a", "alpha", "theta")
    return [{key: getattr(row, key) + size * float(rng.normal()) for key in keys} for row in TABLES[name].rows]


ARMS = {
    **{f"random {seed}": random_arm(seed) for seed in range(6)},
    **{f"slide {joint}": random_arm(20 + joint, joint) for joint in range(6)},
    "jaco": JACO,
    "offset wrist": OFFSET_WRIST,
    "sixteen": SIXTEEN,
    "puma of 1 mm": calibrated("puma560", 1e-3),
    "puma of 0.1 mm": calibrated("puma560", 1e-4),
    "ur5 of 0.1 mm": calibrated("ur5", 1e-4),
}


@pytest.mark.parametrize("name", some_slow(ARMS, "puma of 1 mm", "jaco"))
def test_all_branches(name: str) -> None:
    rows = ARMS[name]
    slides = np.array([row.get("kind") == "prismatic" for row in rows])
    q = np.random.default_rng(3).uniform(-pi, pi, (60 if name == "sixteen" else 12, 6))
    q[:, slides] /= pi
    poses = pose_by_matrices(rows, q)
    found = Robot.from_dh(rows).inverse(poses)
    assert found.method == "elimination" and np.isin(found.status, (Status.FOUND, Status.SINGULAR)).all()
    reached = pose_by_matrices(rows, np.where(found.valid[..., None], found.q, 0.0))
    assert np.abs(reached - poses[:, None])[found.valid].max() < 1e-10
    away = found.q - q[:, None]
    away[..., ~slides] = (away[..., ~slides] + pi) % (2 * pi) - pi
    assert np.where(found.valid, np.abs(away).max(-1), np.inf).min(-1).max() < 1e-5
    # Real roots of a polynomial of even degree, and no branch twice.
    assert (found.valid.sum(-1) % 2 == 0).all() and found.valid.sum(-1).max() <= 16
    if name == "sixteen":
        assert found.valid.sum(-1).max() == 16


@pytest.mark.parametrize(("name", "size"), [("puma560", 1e-4), ("ur5", 1e-5)])
def test_rounding_loses_no_branch_where_roots_are_close(name: str, size: float) -> None:
    """Axes nearly meet or wrists are nearly straight, where eigenvectors depend on the processor."""
    rows, rng = calibrated(name, size), np.random.default_rng(5)
    q = rng.uniform(-pi, pi, (96, 6))
    q[:32, 4] *= 1e-3
    q[32:64, 2] *= 1e-3
    poses, robot = pose_by_matrices(rows, q), Robot.from_dh(rows)
    counts = []
    for copy in range(2):
        slightly = np.where(rng.random(poses.shape) < 0.5, poses, np.nextafter(poses, 10.0)) if copy else poses
        found = robot.inverse(slightly)
        away = (found.q - q[:, None] + pi) % (2 * pi) - pi
        assert found.method == "elimination" and np.nanmin(np.abs(away).max(-1), axis=-1).max() < 1e-5
        counts.append(found.valid.sum(-1))
        assert (counts[-1] % 2 == 0).all()
    assert np.array_equal(*counts)


@pytest.mark.parametrize("slides", [(0, 1, 2), (1, 3, 5), (0, 4), (1, 4), (2, 3)], ids=str)
def test_arms_with_several_prismatic_joints(slides: tuple[int, ...]) -> None:
    rows = random_arm(sum(2**joint for joint in slides), *slides)
    turns = np.array([joint not in slides for joint in range(6)])
    q = np.random.default_rng(4).uniform(-pi, pi, (30, 6))
    q[:, ~turns] /= pi
    poses = pose_by_matrices(rows, q)
    found = Robot.from_dh(rows).inverse(poses)
    assert found.method == ("three slides" if len(slides) == 3 else "search")
    reached = pose_by_matrices(rows, np.where(found.valid[..., None], found.q, 0.0))
    assert np.abs(reached - poses[:, None])[found.valid].max() < 1e-10
    away = found.q - q[:, None]
    away[..., turns] = (away[..., turns] + pi) % (2 * pi) - pi
    recalled = np.where(found.valid, np.abs(away).max(-1), np.inf).min(-1) < 1e-5
    assert recalled.all() and (found.valid.sum(-1) % 2 == 0).mean() >= 0.99
    if len(slides) == 3:
        assert found.valid.all() and found.valid.shape == (30, 2)


@pytest.mark.slow
def test_coplanar_prismatic_and_parallel_revolute_joints_are_searched() -> None:
    for kinds, alphas in (("ppprrr", (0, 0, 0, 1, 1, 1)), ("pprrrr", (0, 1, 0, 0, 0, 0))):
        words = {"p": "prismatic", "r": "revolute"}
        rows: Rows = [{"a": 0.3, "alpha": a, "kind": words[k]} for k, a in zip(kinds, alphas, strict=True)]
        arm = Robot.from_dh(rows)
        poses = arm.pose(np.random.default_rng(0).uniform(-1, 1, (3, 6)))
        found = arm.inverse(poses)
        assert found.method != "three slides" and found.valid.any(-1).all()
        assert np.abs(arm.pose(found.nearest) - poses).max() < 1e-9


@pytest.mark.parametrize("name", ["random 0", "jaco"])
def test_no_branch_is_missed_that_a_search_finds(name: str) -> None:
    rows = ARMS[name]
    robot = Robot.from_dh(rows)
    q = np.random.default_rng(5).uniform(-pi, pi, (2, 6))
    motors = robot.forward(q)
    found = robot.inverse(motors)
    assert np.array_equal(robot.inverse(-motors).q, found.q, equal_nan=True)
    chain = Chain(robot.axes, (False,) * 6)
    starts = np.random.default_rng(6).uniform(-pi, pi, (100, 6))
    for k in range(2):
        other = search(chain, pga3.motor_between_frames(robot.tool, motors[k : k + 1]), starts)[0]
        other = other[~np.isnan(other).any(-1)]
        away = np.abs((found.q[k][:, None] - other + pi) % (2 * pi) - pi).max(-1)
        assert len(other) and np.nanmin(away, axis=0).max() < 1e-5


@pytest.mark.parametrize("rows", [OFFSET_WRIST, random_arm(22, 2)], ids=["turns", "a slide"])
def test_bases_that_are_far_from_the_origin(rows: Rows) -> None:
    """Rates of the joints about a point far away are nearly the same, which says nothing about the branches."""
    q = np.random.default_rng(1).uniform(-1, 1, (4, 6))
    for far in (10.0, 1e3, 1e6):
        base = np.eye(4)
        base[:3, 3] = far, -far, far
        arm = Robot.from_dh(rows).with_base(base)
        found = arm.inverse(arm.pose(q))
        assert (found.status == Status.FOUND).all()
        assert np.nanmin(np.abs(found.q - q[:, None]).max(-1), axis=-1).max() < 1e-6


def test_unreachable_poses_are_flagged() -> None:
    for name in ("random 1", "jaco"):
        robot = Robot.from_dh(ARMS[name])
        poses = robot.pose(np.random.default_rng(8).uniform(-1, 1, (60, 6)))
        away = np.random.default_rng(9).normal(size=(60, 3))
        poses[:, :3, 3] += 10 * away / np.linalg.norm(away, axis=-1, keepdims=True)
        found = robot.inverse(poses)
        assert (found.status == Status.OUT_OF_REACH).all() and not found.valid.any()
        assert np.isfinite(found.nearest).all() and np.isnan(found.q).all()


def test_where_two_branches_meet() -> None:
    """Between a reachable pose and an unreachable one, branches meet in pairs at singular configurations."""
    rows = random_arm(1)
    robot = Robot.from_dh(rows)
    rng = np.random.default_rng(10)
    q = rng.uniform(-pi, pi, (4000, 6))
    determinant = np.linalg.det(robot.jacobian(q))
    pairs = np.flatnonzero(determinant[:-1] * determinant[1:] < 0)[:20]
    low, high = q[pairs], q[pairs + 1]
    for _ in range(60):
        middle = (low + high) / 2
        same = np.linalg.det(robot.jacobian(middle)) * np.linalg.det(robot.jacobian(low)) > 0
        low, high = np.where(same[:, None], middle, low), np.where(same[:, None], high, middle)
    poses = robot.pose(low)
    found = robot.inverse(poses)
    assert found.valid.any(-1).all() and (found.status == Status.SINGULAR).all()
    assert np.abs(robot.pose(found.nearest) - poses).max() < 1e-10


def test_a_robot_of_seven_joints_with_one_fixed() -> None:
    rows = [*random_arm(2), {"d": 0.2, "a": 0.1, "alpha": 0.4}]
    robot = Robot.from_dh(rows)
    q = np.random.default_rng(11).uniform(-pi, pi, (50, 7))
    found = robot.inverse(robot.forward(q), locked={6: q[:, 6]})
    away = np.abs((found.q - q[:, None] + pi) % (2 * pi) - pi).max(-1)
    assert found.method == "elimination" and np.nanmin(away, axis=-1).max() < 1e-6


@pytest.mark.parametrize("slides", [(0, 4), (1, 4), (2, 3)], ids=str)
def test_roots_of_a_scan_are_bracketed_before_they_are_improved(slides: tuple[int, ...]) -> None:
    """Bisection of a bracketed sign change gives configurations that reach the goal without a Newton step."""
    arm = Robot.from_dh(random_arm(3, *slides), "standard")
    chain = Chain(arm.axes, tuple(kind.value == "prismatic" for kind in arm.kinds))
    scan = Scan.of(chain)
    assert scan is not None
    q = np.random.default_rng(1).uniform(-1, 1, (60, 6))
    goals = pga3.motor_between_frames(arm.tool, arm.forward(q))
    which, found, _ = scan.candidates(goals)
    off = chain.distance(found, goals[which])
    best = np.full(len(goals), np.inf)
    np.minimum.at(best, which, off)
    assert (best < 1e-4).mean() > 0.8
