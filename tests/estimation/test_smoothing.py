"""Smoothing of motors: scipy's dense minimum, closed forms, derivatives by differences, consistency, and bad input."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from rigid_motions import matrices, matrix_exponential, matrix_logarithm, moved, of_matrices
from scipy.optimize import least_squares
from scipy.stats import chi2

from algorithms.arguments import Reals
from algorithms.estimation import MotorGraph, SmoothingStatus, preintegrate, smooth_motors
from generated import motor_graphs, pga2, pga3
from tests.support.all_cases import all_cases

ONE = np.eye(8)[0]
DEVIATIONS = np.array([0.02] * 3 + [0.05] * 3)
FLAT = np.array([[0.0025, 0.001, 0], [0.001, 0.0016, -0.0005], [0, -0.0005, 0.0036]])
"""The covariance of an angle and a translation in the plane."""


def turns_between(found: Reals, seen: Reals) -> Reals:
    """The rotation vectors between unit vectors; two of their numbers are those of the factors, in another frame."""
    across = np.cross(seen, found)
    sine = np.maximum(np.linalg.norm(across, axis=-1), 1e-12)
    return across * (np.arctan2(sine, (found * seen).sum(-1)) / sine)[:, None]


def in_plane(turns: Reals) -> Reals:
    """The matrices (n, 4, 4) of motions in the x-y plane from their logarithms, angles and translations (n, 3)."""
    return np.asarray(matrix_exponential(np.pad(turns, ((0, 0), (2, 1)))))


class World:
    """A walk of poses, and measurements of all kinds with known deviations, whose cost numpy and scipy compute."""

    def __init__(self, seed: int, n: int = 6) -> None:
        rng = self.rng = np.random.default_rng(seed)
        steps = rng.normal(size=(n - 1, 6)) * 0.2 + [0, 0, 0.3, 1, 0, 0]
        chain = [ONE]
        for step in steps:
            chain.append(moved(chain[-1], step))
        self.truth, self.n = np.array(chain), n
        self.first = np.r_[np.arange(n - 1), 0]
        self.second = np.r_[np.arange(1, n), n - 1]
        between = np.linalg.inv(matrices(self.truth[self.first])) @ matrices(self.truth[self.second])
        self.motions = moved(of_matrices(between), DEVIATIONS * rng.normal(size=(len(self.first), 6)))
        self.at = rng.integers(0, n, 12)
        self.points = rng.normal(size=(12, 3)) * 4
        seen = np.linalg.inv(matrices(self.truth[self.at])) @ np.c_[self.points, np.ones(12)][..., None]
        self.seen_points = seen[:, :3, 0] + 0.05 * rng.normal(size=(12, 3))
        ends = rng.normal(size=(2, 12, 3)) * 4
        self.lines = np.asarray(pga3.normalize_line(pga3.join_points(*ends)))
        back = moved(of_matrices(np.linalg.inv(matrices(self.truth[self.at]))), 0.01 * rng.normal(size=(12, 6)))
        self.seen_lines = np.asarray(pga3.move_line(back, self.lines))
        self.planes = np.asarray(pga3.normalize_plane(rng.normal(size=(12, 4))))
        self.seen_planes = np.asarray(pga3.move_plane(back, self.planes))
        self.lever = np.array([0.1, -0.2, 0.3])
        self.places = (matrices(self.truth) @ np.r_[self.lever, 1])[:, :3] + 0.1 * rng.normal(size=(n, 3))
        self.mount = moved(ONE, np.array([0.4, -0.2, 0.5, 0.3, 0.2, -0.1]))
        own = matrices(self.truth) @ matrices(self.mount)
        step, self.flat = np.linalg.inv(own[:-1]) @ own[1:], np.tile(np.eye(4), (n - 1, 1, 1))
        # The motions in the plane of the sensor whose misfits in this plane are 0, and then noise.
        for _ in range(50):
            self.flat = self.flat @ in_plane(matrix_logarithm(np.linalg.inv(self.flat) @ step)[:, 2:5])
        self.flat = self.flat @ in_plane(rng.normal(size=(n - 1, 3)) @ np.linalg.cholesky(FLAT).T)

    def graph(self) -> MotorGraph:
        graph = MotorGraph()
        graph.add_priors(0, self.truth[0], DEVIATIONS**2)
        graph.add_motions(self.first, self.second, self.motions, DEVIATIONS**2)
        graph.add_points(self.at, self.points, self.seen_points, np.full(3, 0.05**2))
        graph.add_lines(self.at, self.lines, 3 * self.seen_lines, [0.01**2, 0.01**2, 0.02**2, 0.02**2])
        graph.add_planes(self.at, self.planes, 2 * self.seen_planes, [0.01**2, 0.01**2, 0.02**2])
        graph.add_positions(np.arange(self.n), self.places, np.full(3, 0.1**2), lever=self.lever)
        angles = np.arctan2(self.flat[:, 1, 0], self.flat[:, 0, 0])
        flat = pga2.motor_from_angle_translation(angles, self.flat[:, :2, 3])
        graph.add_flat_motions(np.arange(self.n - 1), np.arange(1, self.n), flat, FLAT, mount=self.mount)
        return graph

    def residuals(self, poses: Reals) -> Reals:
        """All residuals in deviations from matrices (n, 4, 4) alone."""
        inverse = np.linalg.inv(poses)
        prior = matrix_logarithm(np.linalg.inv(matrices(self.truth[:1])) @ poses[:1]) / DEVIATIONS
        measured = np.linalg.inv(matrices(self.motions))
        motion = matrix_logarithm(measured @ inverse[self.first] @ poses[self.second]) / DEVIATIONS
        back = inverse[self.at]
        points = (back @ np.c_[self.points, np.ones(12)][..., None])[:, :3, 0] - self.seen_points
        direction, moment = (np.asarray(x) for x in pga3.line_to_direction_moment(self.lines))
        e, own = (np.asarray(x) for x in pga3.line_to_direction_moment(self.seen_lines))
        d = (back[:, :3, :3] @ direction[..., None])[..., 0]
        m = (back[:, :3, :3] @ moment[..., None])[..., 0] + np.cross(back[:, :3, 3], d)
        off = m - np.cross(np.cross(e, own), d)
        off = off - (off * e).sum(1, keepdims=True) * e
        normal = (back[:, :3, :3] @ self.planes[:, :3, None])[..., 0]
        height = self.planes[:, 3] - (normal * back[:, :3, 3]).sum(1)
        g = self.seen_planes[:, 3] * (normal * self.seen_planes[:, :3]).sum(1)
        places = (poses @ np.r_[self.lever, 1])[:, :3] - self.places
        own = poses @ matrices(self.mount)
        flat = matrix_logarithm(np.linalg.inv(self.flat) @ np.linalg.inv(own[:-1]) @ own[1:])[:, 2:5]
        return np.concatenate([
            prior.ravel(), motion.ravel(), points.ravel() / 0.05, turns_between(d, e).ravel() / 0.01,
            off.ravel() / 0.02,
            turns_between(normal, self.seen_planes[:, :3]).ravel() / 0.01, (height - g) / 0.02, places.ravel() / 0.1,
            np.linalg.solve(np.linalg.cholesky(FLAT), flat.T).ravel(),
        ])  # fmt: skip


@pytest.mark.parametrize(("seed", "n"), [(0, 3), pytest.param(1, 8, marks=pytest.mark.slow)])
def test_minimum_is_that_of_scipy(seed: int, n: int) -> None:
    """Factors of all kinds: the cost is that of a dense minimum with derivatives by differences, to 1e-9."""
    world = World(seed, n)
    start = moved(world.truth, 0.2 * world.rng.normal(size=(world.n, 6)))
    found = smooth_motors(world.graph(), start)
    about = matrices(found.motors)

    def cost(turns: Reals) -> Reals:
        return world.residuals(about @ matrix_exponential(turns.reshape(-1, 6)))

    here = cost(np.zeros(6 * world.n))
    assert found.cost == pytest.approx(0.5 * here @ here, rel=1e-12)
    other = least_squares(cost, 0.01 * world.rng.normal(size=6 * world.n), xtol=1e-12, ftol=1e-14, gtol=1e-10)
    assert found.cost == pytest.approx(other.cost, rel=1e-9)
    assert found.status == SmoothingStatus.OK


def test_chain_has_the_closed_form() -> None:
    """Translations along a line: the Kalman smoother of a random walk, and covariances that add up."""
    n, rng = 30, np.random.default_rng(3)
    steps = rng.normal(size=n - 1)
    graph = MotorGraph()
    graph.add_priors(0, ONE, np.full(6, 0.04))
    motions = pga3.motor_from_rotation_vector_translation(np.zeros((n - 1, 3)), steps[:, None] * [1, 0, 0])
    graph.add_motions(np.arange(n - 1), np.arange(1, n), motions, [1e-8] * 3 + [0.01] * 3)
    graph.add_positions(n - 1, [20.0, 0, 0], np.full(3, 0.25))
    found = smooth_motors(graph, np.tile(ONE, (n, 1)), marginals=[0, n - 1])
    matrix = np.zeros((n + 1, n))
    matrix[0, 0], matrix[n, n - 1] = 1 / 0.2, 1 / 0.5
    matrix[np.arange(1, n), np.arange(1, n)], matrix[np.arange(1, n), np.arange(n - 1)] = 10, -10
    want = np.linalg.lstsq(matrix, np.r_[0, 10 * steps, 40.0], rcond=None)[0]
    assert matrices(found.motors)[:, 0, 3] == pytest.approx(want, abs=1e-9)
    spread = np.linalg.inv(matrix.T @ matrix)
    assert found.covariances[:, 3, 3] == pytest.approx(spread[[0, n - 1], [0, n - 1]], rel=1e-6)


def test_covariances_are_those_of_the_inverse() -> None:
    """The marginal covariances are blocks of the inverse of the information by differences."""
    world = World(4)
    found = smooth_motors(world.graph(), world.truth, marginals=[2, 5])
    about, step, n = matrices(found.motors), 1e-5, 6 * world.n
    both = [
        [world.residuals(about @ matrix_exponential(sign * step * turn.reshape(-1, 6))) for sign in (1, -1)]
        for turn in np.eye(n)
    ]
    rows = np.array([(a - b) / (2 * step) for a, b in both]).T
    every = np.linalg.inv(rows.T @ rows)
    for covariance, state in zip(found.covariances, (2, 5), strict=True):
        block = every[6 * state : 6 * state + 6, 6 * state : 6 * state + 6]
        assert np.linalg.norm(covariance - block) < 1e-6 * np.linalg.norm(block)


@pytest.mark.slow
def test_errors_are_within_the_band() -> None:
    """The normalised squared errors of the last pose over 1,000 runs are within their 95 % band."""
    n, runs, rng = 4, 1000, np.random.default_rng(5)
    truth = World(6, n).truth
    between = of_matrices(np.linalg.inv(matrices(truth[:-1])) @ matrices(truth[1:]))
    total = 0.0
    for _ in range(runs):
        noise = DEVIATIONS * rng.normal(size=(n, 6))
        graph = MotorGraph()
        graph.add_priors(0, moved(truth[0], noise[0]), DEVIATIONS**2)
        graph.add_motions(np.arange(n - 1), np.arange(1, n), moved(between, noise[1:]), DEVIATIONS**2)
        places = matrices(truth[2:])[:, :3, 3] + 0.1 * rng.normal(size=(2, 3))
        graph.add_positions([2, 3], places, np.full(3, 0.01))
        found = smooth_motors(graph, moved(truth, noise), marginals=[n - 1])
        assert found.status in (SmoothingStatus.OK, SmoothingStatus.INCONSISTENT)
        error = matrix_logarithm(np.linalg.inv(matrices(found.motors[-1])) @ matrices(truth[-1]))
        total += float(error @ np.linalg.solve(found.covariances[0], error))
    low, high = chi2.ppf([0.025, 0.975], 6 * runs)
    assert low < total < high


def test_wrong_loops_are_rejected() -> None:
    world = World(7, 30)
    graph = world.graph()
    wrong = np.array([[0, 12], [3, 20], [8, 25]])
    graph.add_motions(wrong[:, 0], wrong[:, 1], np.tile(ONE, (3, 1)), DEVIATIONS**2, robust=True)
    graph.add_motions([0, 1], [15, 16], between(world.truth, [0, 1], [15, 16]), DEVIATIONS**2, robust=True)
    graph.add_motions([2, 4], [17, 19], between(world.truth, [2, 4], [17, 19]), DEVIATIONS**2, robust=True)
    start = [world.truth[0]]
    for k in range(29):
        start.append(np.asarray(pga3.motor_product(start[-1], world.motions[k])))
    found = smooth_motors(graph, start)
    assert found.status == SmoothingStatus.OK
    assert (found.weights[-7:-4] < 0.01).all() and (found.weights[-4:] > 0.25).all()


def between(motors: Reals, first: Any, second: Any) -> Reals:
    return of_matrices(np.linalg.inv(matrices(motors[first])) @ matrices(motors[second]))


def test_undetermined_directions_are_named() -> None:
    world = World(8)
    graph = MotorGraph()
    graph.add_motions(world.first, world.second, world.motions, DEVIATIONS**2)
    found = smooth_motors(graph, world.truth)
    assert found.status == SmoothingStatus.UNDETERMINED and len(found.directions) == 6
    assert all("states 0 to 5" in name and "translation" in name for name in found.undetermined)
    graph.add_positions([0, 5], world.places[[0, 5]], np.full(3, 0.01))
    turning = smooth_motors(graph, world.truth)
    assert len(turning.directions) == 1 and "rotation" in turning.undetermined[0]
    graph.add_positions(3, world.places[3], np.full(3, 0.01))
    assert smooth_motors(graph, world.truth).status == SmoothingStatus.OK
    alone = smooth_motors(graph, np.r_[world.truth, world.truth[:1]], marginals=[1, 6])
    assert alone.status == SmoothingStatus.UNDETERMINED and alone.undetermined == ("pose of state 6",)
    assert np.isfinite(alone.covariances[0]).all() and np.isinf(alone.covariances[1]).all()


def test_contradictions_are_reported() -> None:
    graph = MotorGraph()
    graph.add_priors([0, 0], [ONE, pga3.motor_from_rotation_vector_translation([0, 0, 0.0], [1.0, 0, 0])], [1e-4] * 6)
    assert smooth_motors(graph, ONE[None]).status == SmoothingStatus.INCONSISTENT
    assert smooth_motors(MotorGraph(), np.zeros((0, 8))).status == SmoothingStatus.EMPTY


def test_sign_and_unit_of_length_do_not_matter() -> None:
    world = World(9)
    graph, flipped = world.graph(), MotorGraph()
    flipped.factors = list(graph.factors)
    one = smooth_motors(graph, world.truth)
    two = smooth_motors(flipped, -world.truth)
    assert np.allclose(matrices(one.motors), matrices(two.motors), atol=1e-9)


FAR = np.asarray(pga3.motor_from_rotation_vector_translation([0, 0, 0.1], [1e9, 0, 0]))
UNSYMMETRIC = np.array([1e9 * np.eye(6), np.eye(6) + 0.1 * np.eye(6, k=1)])
SUM = preintegrate(np.zeros((2, 3)), np.ones((2, 3)), 0.1, [1e-4, 1e-3])
BAD: list[tuple[Callable[[MotorGraph], Any], type[Exception], str]] = [
    (lambda g: g.add_priors(0, np.ones(8), np.ones(6)), ValueError, "unit motors"),
    (lambda g: g.add_priors([1, 2], [FAR, 2 * ONE], np.ones(6)), ValueError, "unit motors"),
    (lambda g: g.add_priors([1, 2], ONE, UNSYMMETRIC), ValueError, "not symmetric"),
    (lambda g: g.add_priors(-1, ONE, np.ones(6)), ValueError, "from 0"),
    (lambda g: g.add_priors(0.5, ONE, np.ones(6)), TypeError, "whole numbers"),
    (lambda g: g.add_priors(0, ONE, np.zeros(6)), ValueError, "positive definite"),
    (lambda g: g.add_priors(0, ONE, np.ones(5)), ValueError, "shape"),
    (lambda g: g.add_priors([0, 1], np.tile(ONE, (3, 1)), np.ones(6)), ValueError, "rows"),
    (lambda g: g.add_motions(1, 1, ONE, np.ones(6)), ValueError, "itself"),
    (lambda g: g.add_points(0, [np.nan, 0, 0], [0, 0, 0], np.ones(3)), ValueError, "finite"),
    (lambda g: g.add_planes(0, [0, 0, 0, 1.0], [1, 0, 0, 0], np.ones(3)), ValueError, "direction"),
    (lambda g: g.add_priors(0, ONE, np.ones(6), robust=2), TypeError, "bool"),
    (lambda g: g.add_flat_motions(0, 1, np.ones(4), np.ones(3)), ValueError, "motions: not unit motors"),
    (lambda g: g.add_flat_motions(0, 1, np.eye(4)[0], np.ones(6)), ValueError, "covariance: shape"),
    (lambda g: g.add_flat_motions(0, 1, np.eye(4)[0], np.ones(3), mount=[ONE]), ValueError, "mount: shape"),
    (lambda g: g.add_inertial(0, 1, [], np.ones(6)), ValueError, "none"),
    (lambda g: g.add_inertial(0, 1, [3], np.ones(6)), TypeError, "int; expected InertialSum"),
    (lambda g: g.add_inertial(0, 1, 3, np.ones(6)), TypeError, "int; expected InertialSum"),
    (lambda g: g.add_inertial([0, 1], [1, 2], [SUM] * 2, np.ones((3, 6, 6))), ValueError, "walk: 3 covariances"),
    (lambda g: g.add_inertial(0, 1, SUM, np.zeros(6)), ValueError, "positive definite"),
    (lambda g: smooth_motors(g, ONE), ValueError, "motors"),
    (lambda g: smooth_motors(g, ONE[None], marginals=[1]), ValueError, "marginals"),
]


@all_cases("call, error, text", BAD)
def test_bad_input_is_named(call: Callable[[MotorGraph], Any], error: type[Exception], text: str) -> None:
    graph = MotorGraph()
    with pytest.raises(error, match=text):
        call(graph)
    assert not graph.factors


def test_derivatives_are_differences() -> None:
    """All kernels, near and far from agreement, and at rest."""
    rng = np.random.default_rng(10)
    for size in (0.0, 1e-9, 0.1, 2.5):
        turn = rng.normal(size=6)
        a, motion = moved(np.tile(ONE, (2, 1)), rng.normal(size=(2, 6)))
        b = moved(of_matrices(matrices(a) @ matrices(motion)), size * turn / np.linalg.norm(turn[:3]))
        misfit, by_a, by_b = motor_graphs.relative_motion(a, b, motion)
        assert misfit == pytest.approx(size * turn / np.linalg.norm(turn[:3]), abs=1e-9)
        for k, unit in enumerate(1e-6 * np.eye(6)):
            two = [motor_graphs.relative_motion(a, moved(b, sign * unit), motion)[0] for sign in (1, -1)]
            assert (two[0] - two[1]) / 2e-6 == pytest.approx(by_b[:, k], abs=1e-7)
            two = [motor_graphs.relative_motion(moved(a, sign * unit), b, motion)[0] for sign in (1, -1)]
            assert (two[0] - two[1]) / 2e-6 == pytest.approx(by_a[:, k], abs=1e-7)
