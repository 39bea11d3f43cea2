"""Scans in graphs of motors: consistent errors, corridors with odometry, wrong matches, and what is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from laser_scenes import box, motion, pair, room, scan_at
from rigid_motions import matrices, matrix_logarithm, moved
from scipy.stats import chi2

from algorithms.arguments import Reals
from algorithms.estimation import MotorGraph, MotorSmoother, SmoothedMotors, SmoothingStatus, smooth_motors
from algorithms.mapping import MappingStatus, add_scans, match_scans
from generated import pga2, pga3

ONE = np.eye(8)[0]
FLOOR = np.array([0, 0, 1.0, 0])
FLAT = np.array([1e-6, 1e-6, 1e-4])
"""Variances of the tilt and the height of a floor."""
MOUNT = moved(ONE, np.array([0.0, 0, 2.0, 0.3, -0.2, 0.4]))
WALLS = np.concatenate([box(6, 4.5, 12, 9), box(1.0, 8.5, 2.0, 1.0), box(9, 2, 1, 0.7, 0.4), box(3, 3, 0.8, 1.1, 1.0)])


def on_floor(pose: Reals) -> Reals:
    """The motor of a pose x, y, angle."""
    return np.asarray(pga3.motor_from_rotation_vector_translation([0, 0, pose[2]], [*pose[:2], 0]))


def poses_of(rng: np.random.Generator, n: int) -> Reals:
    found = [np.array([2.0, 5.0, 0.1])]
    for _ in range(n - 1):
        x, y, angle = found[-1]
        found.append(np.array([x + 0.7 * np.cos(angle), y + 0.7 * np.sin(angle), angle + rng.uniform(-0.2, 0.1)]))
    return np.array(found)


def flat(poses: Reals, k: int, m: int) -> Reals:
    """The motion between two poses."""
    step = motion(poses[k], poses[m])
    return np.asarray(pga2.motor_from_angle_translation(step[2], step[:2]))


def smoothed(poses: Reals, graph: MotorGraph) -> tuple[SmoothedMotors, float]:
    """The smoothed poses on a floor, and the normalised squared error of the angle and place of the last one."""
    n = len(poses)
    truth = np.array([on_floor(pose) for pose in poses])
    graph.add_priors(0, truth[0], np.full(6, 1e-12))
    graph.add_planes(np.arange(n), np.tile(FLOOR, (n, 1)), np.tile(FLOOR, (n, 1)), FLAT)
    found = smooth_motors(graph, truth, marginals=[n - 1])
    off = matrix_logarithm(np.linalg.inv(matrices(found.motors[-1])) @ matrices(truth[-1]))[2:5]
    return found, float(off @ np.linalg.solve(found.covariances[0][2:5, 2:5], off))


def test_errors_are_within_the_band() -> None:
    """Matches whose errors have the stated covariances, of a turned scanner: 300 runs within the 95 % band."""
    rng, runs, n = np.random.default_rng(0), 300, 5
    poses = poses_of(rng, n)
    one = match_scans(scan_at(rng, WALLS, poses[0]), scan_at(rng, WALLS, poses[1]))
    back = np.linalg.inv(matrices(MOUNT))
    seen = [on_floor(pose) for pose in poses]
    ends = [(0, 1), (1, 2), (2, 3), (3, 4), (0, 3)]
    motions = []
    for k, m in ends:
        rows = back @ np.linalg.inv(matrices(seen[k])) @ matrices(seen[m]) @ np.linalg.inv(back)
        motions.append(pga2.motor_from_angle_translation(np.arctan2(rows[1, 0], rows[0, 0]), rows[:2, 3]))
    root = np.linalg.cholesky(one.covariance)
    total = 0.0
    for _ in range(runs):
        graph, matches = MotorGraph(), []
        for motor in motions:
            x, y, angle = root @ rng.normal(size=3)
            off = pga2.motor_from_angle_translation(angle, [x, y])
            matches.append(replace(one, motor=np.asarray(pga2.motor_product(off, motor))))
        used = add_scans(graph, [k for k, _ in ends], [m for _, m in ends], matches, mount=MOUNT)
        assert used.all()
        total += smoothed(poses, graph)[1]
    low, high = chi2.ppf([0.025, 0.975], 3 * runs)
    assert low < total < high


@pytest.mark.slow
def test_errors_of_rooms() -> None:
    """Scans with the noise of 2 cm that matches assume: errors have the size of the covariances."""
    total, runs = 0.0, 0
    for seed in range(80):
        rng = np.random.default_rng([seed, 1])
        walls = room(rng, 6)
        a, b = pair(rng, walls)
        middle = (a + b) / 2
        poses = np.array([a, middle, b])
        scans = [scan_at(rng, walls, pose, n=361, noise=0.02) for pose in poses]
        ends = [(0, 1), (1, 2), (0, 2)]
        matches = [match_scans(scans[k], scans[m]) for k, m in ends]
        if all(each.status == MappingStatus.OK for each in matches):
            graph = MotorGraph()
            add_scans(graph, [0, 1], [1, 2], matches[:2])
            runs += 1
            total += smoothed(poses, graph)[1]
    assert runs >= 40 and 1 < total / runs < 4.5


def test_corridors_need_odometry() -> None:
    """Scans of a corridor say nothing of the way along it, and correct odometry across it."""
    rng, n = np.random.default_rng(1), 5
    walls = np.array([[-500.0, 1, 500, 1], [-500.0, -1, 500, -1]])
    poses = np.array([[0.8 * k, 0.05 * k, 0.1 * (-1) ** k] for k in range(n)])
    scans = [scan_at(rng, walls, pose) for pose in poses]
    variances = np.array([0.05, 0.02, 0.02]) ** 2
    steps = np.array([flat(poses, k, k + 1) for k in range(n - 1)])
    slips = 0.02 * rng.normal(size=(n - 1, 3)) * [2.5, 1, 1]
    measured = np.asarray(
        pga2.motor_product(steps, pga2.motor_from_angle_translation(slips[:, 0], np.ascontiguousarray(slips[:, 1:])))
    )
    # Odometry also decides between a motion and its half turn.
    matches = [match_scans(scans[k], scans[k + 1], measured[k]) for k in range(n - 1)]
    assert all(each.status == MappingStatus.DEGENERATE for each in matches)
    graph = MotorGraph()
    graph.add_flat_motions(np.arange(n - 1), np.arange(1, n), measured, variances)
    assert add_scans(graph, np.arange(n - 1), np.arange(1, n), matches).all()
    found, square = smoothed(poses, graph)
    assert found.status == SmoothingStatus.OK and square < chi2.ppf(0.999, 3)
    deviations = np.sqrt(np.diag(found.covariances[0]))
    # Along the corridor odometry adds up, as if there were no scans; the angle is that of scans.
    assert deviations[3] == pytest.approx(0.02 * np.sqrt(n - 1), rel=0.1) and deviations[2] < 0.05


def test_wrong_matches_are_rejected() -> None:
    rng, n = np.random.default_rng(2), 6
    poses = poses_of(rng, n)
    scans = [scan_at(rng, WALLS, pose) for pose in poses]
    right = [match_scans(scans[k], scans[k + 1]) for k in range(n - 1)]
    across = [match_scans(scans[k], scans[k + 2]) for k in range(n - 2)]
    wrong = replace(across[1], motor=np.asarray(pga2.motor_product(pga2.motor_from_angle_translation(0.5, [1.0, 0]),
                                                                   across[1].motor)))  # fmt: skip
    graph = MotorGraph()
    add_scans(graph, np.arange(n - 1), np.arange(1, n), right)
    add_scans(graph, np.arange(n - 2), np.arange(2, n), across, robust=True)
    add_scans(graph, 1, 3, wrong, robust=True)
    found, square = smoothed(poses, graph)
    loops = slice(n - 1, 2 * n - 2)
    assert found.status == SmoothingStatus.OK and square < chi2.ppf(0.999, 3)
    assert found.weights[loops][-1] < 0.01 and (found.weights[loops][:-1] > 0.25).all()


def test_a_window_of_scans() -> None:
    """A fixed-lag smoother takes scans as it takes other factors."""
    rng, n = np.random.default_rng(3), 8
    poses = poses_of(rng, n)
    smoother, last = MotorSmoother(lag=3.0), scan_at(rng, WALLS, poses[0])
    for k, pose in enumerate(poses):
        state = smoother.add_state(float(k), on_floor(pose))
        smoother.add_planes(state, FLOOR, FLOOR, FLAT)
        if k == 0:
            smoother.add_priors(state, on_floor(pose), np.full(6, 1e-10))
        else:
            scan = scan_at(rng, WALLS, pose)
            assert add_scans(smoother, state - 1, state, match_scans(last, scan)).all()
            last = scan
        assert smoother.update([state]) == SmoothingStatus.OK
    off = matrix_logarithm(np.linalg.inv(matrices(smoother.motors[-1])) @ matrices(on_floor(poses[-1])))[2:5]
    assert smoother.found is not None
    assert off @ np.linalg.solve(smoother.found.covariances[0][2:5, 2:5], off) < chi2.ppf(0.999, 3)


def test_what_matches_do_not_show_is_left_out() -> None:
    rng = np.random.default_rng(4)
    scan = scan_at(rng, WALLS, np.array([2.0, 5.0, 0.1]))
    good = match_scans(scan, scan)
    bad = [replace(good, status=each) for each in MappingStatus if each not in (0, MappingStatus.DEGENERATE)]
    graph = MotorGraph()
    assert not add_scans(graph, np.arange(len(bad)), 9, bad).any() and not graph.factors
    assert add_scans(graph, [], [], []).shape == (0,) and not graph.factors
    with pytest.raises(TypeError, match="mount"):  # also where no match is used
        add_scans(graph, np.arange(len(bad)), 9, bad, mount=8 * ["x"])
    assert add_scans(graph, [0, 1], [1, 2], [bad[0], good]).tolist() == [False, True]
    assert repr(graph) == "MotorGraph of 3 states: 1 flat motion"
    with pytest.raises(ValueError, match="first: shape"):
        add_scans(graph, [0, 1], 2, [good, bad[0], good])
    with pytest.raises(TypeError, match="expected Match"):
        add_scans(graph, 0, 1, [3])  # type: ignore[list-item]
    with pytest.raises(ValueError, match="itself"):
        add_scans(graph, 0, 0, good)
    with pytest.raises(TypeError, match="robust"):
        add_scans(graph, 0, 1, [good, good], robust=np.ones(2))
