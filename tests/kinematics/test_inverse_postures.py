"""Structured postures, at which roots of the eliminated equations coincide: no regular branch is missing."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from arm_tables import ALMOST_SPHERICAL_WRIST, CRX10, JACO, OFFSET_WRIST, QUARTER, Rows, pose_by_matrices, random_arm
from scipy.optimize import least_squares
from selection import some_slow

from algorithms.kinematics import Robot, Status

SLIDING: Rows = random_arm(33, 2)
ARMS = {"crx10": CRX10, "offset wrist": OFFSET_WRIST, "random": random_arm(31), "slide": SLIDING}
POSTURES = ("fourth joint", "wrist", "quarter turns", "15 degrees")


def posture(name: str, count: int) -> np.ndarray:
    rng = np.random.default_rng(POSTURES.index(name))
    q = rng.uniform(-pi, pi, (count, 6))
    if name == "fourth joint":
        q[:, 3] = 0.0
    elif name == "wrist":
        q[:, 3:] = rng.integers(-1, 3, (count, 3)) * QUARTER
    elif name == "quarter turns":
        q = rng.integers(-1, 3, (count, 6)) * QUARTER
    else:
        q = rng.integers(-11, 13, (count, 6)) * (pi / 12)
    return q


def regular(rows: Rows, q: np.ndarray) -> np.ndarray:
    """Whether the smallest singular value of the Jacobian, by central differences of matrices, is above 0.01."""
    step, columns = 1e-6, []
    for change in np.eye(6) * step:
        rate = (pose_by_matrices(rows, q + change) - pose_by_matrices(rows, q - change)) / (2 * step)
        spin = rate[..., :3, :3] @ pose_by_matrices(rows, q)[..., :3, :3].swapaxes(-1, -2)
        columns.append(np.concatenate([spin[..., [2, 0, 1], [1, 2, 0]], rate[..., :3, 3]], -1))
    return np.linalg.svd(np.stack(columns, -1), compute_uv=False)[..., -1] > 0.01


CASES = [(arm, name) for arm in ARMS for name in POSTURES]


@pytest.mark.parametrize(("arm", "name"), some_slow(CASES, *(case for case in CASES if case[0] in ("random", "slide"))))
def test_no_regular_branch_is_missing(arm: str, name: str) -> None:
    rows = ARMS[arm]
    turns = np.array([row.get("kind") != "prismatic" for row in rows])
    q = posture(name, 16)
    q = q[regular(rows, q)]
    poses = pose_by_matrices(rows, q)
    found = Robot.from_dh(rows).inverse(poses)
    assert found.method == "elimination"
    away = found.q - q[:, None]
    away[..., turns] = (away[..., turns] + pi) % (2 * pi) - pi
    assert np.where(found.valid, np.abs(away).max(-1), np.inf).min(-1).max() < 1e-5
    assert (found.status == Status.INCOMPLETE).mean() <= 0.05
    assert (found.valid.sum(-1) % 2 == 0)[found.status == Status.FOUND].all()


@pytest.mark.parametrize("turns", [(6, 1, -11, -4, -12, -5), (-11, -3, 9, -9, -12, 0)], ids=str)
def test_variants_that_disagree_about_the_zeros_complete_nothing(turns: tuple[int, ...]) -> None:
    """One variant has two zeros fewer than the other one, and as many as there are branches without this pair."""
    q = np.array([turns]) * (pi / 12)
    found = Robot.from_dh(JACO).inverse(pose_by_matrices(JACO, q))
    away = np.abs((found.q - q[:, None] + pi) % (2 * pi) - pi).max(-1)
    assert found.status[0] == Status.FOUND and np.where(found.valid, away, np.inf).min() < 1e-5


def test_two_pairs_of_branches_that_meet_next_to_a_posture_are_counted() -> None:
    """By the symmetry of the shoulder, one neighbour has four branches and the opposite one has none."""
    rest = [(-0.07, 2.994, 1.732), (-2.284, -1.177, 1.357), (-2.617, 0.993, 1.361)]
    wrist = [(0, -1.446, 2.282), (0, -0.994, -1.64), (0, -1.813, -0.57)]
    q = np.hstack([rest, wrist])
    found = Robot.from_dh(OFFSET_WRIST).inverse(pose_by_matrices(OFFSET_WRIST, q))
    assert (found.status == Status.FOUND).all() and (found.valid.sum(-1) == 4).all()


def test_a_search_never_claims_to_be_complete() -> None:
    rows = random_arm(34, 1, 4)
    arm = Robot.from_dh(rows)
    poses = pose_by_matrices(rows, np.random.default_rng(0).uniform(-1, 1, (5, 6)))
    found = arm.inverse(poses)
    assert found.method == "search" and (found.status == Status.INCOMPLETE).all() and found.valid.any(-1).all()
    redundant = Robot.named("panda")
    found = redundant.inverse(redundant.pose(np.array([0.1, -0.4, 0.2, -2.0, 0.1, 1.6, 0.5])))
    assert found.method == "search" and found.status == Status.INCOMPLETE


def test_branches_of_a_structured_posture_are_those_of_its_neighbours() -> None:
    """Branches depend continuously on the pose, so that their number is that of nearby poses without structure."""
    arm = Robot.from_dh(CRX10)
    q = np.array([0.4, -0.3, 0.9, 0.0, 0.7, 1.2])
    counts = {int(arm.inverse(arm.pose(q + shift)).valid.sum()) for shift in 1e-6 * np.eye(7)[:, :6]}
    assert len(counts) == 1


def test_reachable_poses_next_to_singularities_are_not_called_unreachable() -> None:
    """The wrist almost coincides with the shoulder, so that rounding decides about the angles of the shoulder."""
    arm = Robot.named("iiwa")
    q = np.random.default_rng(0).uniform(-pi, pi, (300, 7))
    q[:, 3] = pi + np.random.default_rng(1).choice([1e-12, 1e-10, 1e-9], 300)
    found = arm.inverse(arm.forward(q), locked={6: q[:, 6]})
    assert (found.status != Status.OUT_OF_REACH).all()
    pose = arm.pose(np.zeros(7))
    pose[0, 3] += 10.0
    assert arm.inverse(pose, locked={6: 0.0}).status == Status.OUT_OF_REACH


@pytest.mark.parametrize("name", ["fourth joint", "wrist"])
def test_zeros_closer_than_the_errors_of_their_polynomial(name: str) -> None:
    # All real zeros are in two clusters of four, smaller than 1e-3: about the fourth root of its errors.
    rows = ALMOST_SPHERICAL_WRIST
    q = posture(name, 40)
    q = q[regular(rows, q)]
    found = Robot.from_dh(rows).inverse(pose_by_matrices(rows, q))
    away = (found.q - q[:, None] + pi) % (2 * pi) - pi
    assert np.where(found.valid, np.abs(away).max(-1), np.inf).min(-1).max() < 1e-5
    assert (found.status == Status.INCOMPLETE).mean() <= 0.1


@pytest.mark.parametrize(
    ("rows", "turns"),
    [
        (OFFSET_WRIST, (-2, 0, -6, 6, -1, -6)),
        (CRX10, (5, -2, -6, 11, -5, 2)),
        (CRX10, (-6, 3, -6, -1, 0, 6)),
        (CRX10, (-3, 12, -6, -9, -8, 6)),
    ],
)
def test_regular_branches_beside_a_continuum(rows: Rows, turns: tuple[int, ...]) -> None:
    pose = pose_by_matrices(rows, np.array(turns) * (pi / 12))

    def error(q: np.ndarray) -> np.ndarray:
        return np.ravel(pose_by_matrices(rows, q) - pose)[:12]

    starts = np.random.default_rng(0).uniform(-pi, pi, (16, 6))
    ends = [least_squares(error, start, method="lm", xtol=1e-15, ftol=1e-15, max_nfev=300) for start in starts]
    reached = np.array([end.x for end in ends if np.abs(end.fun).max() < 1e-10])
    reached = reached[regular(rows, reached)]
    assert len(reached) >= 2
    found = Robot.from_dh(rows).inverse(pose)
    away = np.abs((found.q[found.valid] - reached[:, None] + pi) % (2 * pi) - pi).max(-1)
    assert found.status == Status.SINGULAR and away.min(-1).max() < 1e-6


def test_no_branch_is_missing_where_four_zeros_almost_coincide() -> None:
    """Of 3.5 million multiples of 15 degrees of 53 arms, one was missing: CRX-30iA's zeros are .01 from each other."""
    height = 1.3199999999999998
    axes = [
        [1, 0, 0, 0, 0, 0], [0, -1, 0, -0.37, 0, 0], [0, 1, 0, height, 0, 0], [0, 0, -1, 0, -height, 0],
        [0, 1, 0, height, 0, -0.75], [0, 0, -1, 0, -height, -0.185],
    ]  # fmt: skip
    robot = Robot.from_screws(axes, [1, 0, 0, 0, -0.46499999999999997, 0.0925, -0.6599999999999999, 0])
    q = np.array([1, 0, -7, 7, 5, 4]) * pi / 12
    found = robot.inverse(robot.pose(q))
    assert np.abs(np.exp(1j * found.q) - np.exp(1j * q)).max(-1)[found.valid].min() < 1e-9
    assert np.abs(robot.pose(found.q[found.valid]) - robot.pose(q)).max() < 1e-10
