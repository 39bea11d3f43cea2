"""Inertial sums beside small steps, and fixed-lag smoothing beside the batch: exact, late, and consistent."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigid_motions import matrices, matrix_exponential, matrix_logarithm, moved, of_matrices
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from algorithms.arguments import Reals
from algorithms.estimation import (
    InertialSum,
    MotorGraph,
    MotorSmoother,
    SmoothedMotors,
    SmoothingStatus,
    preintegrate,
    smooth_motors,
)
from generated import pga3

ONE = np.eye(8)[0]
DEVIATIONS = np.array([0.02] * 3 + [0.05] * 3)
GRAVITY = np.array([0, 0, -9.81])
NOISE = np.array([1e-4, 1e-3])
WALK = np.array([1e-4] * 3 + [1e-3] * 3)


def small_steps(rates: Reals, forces: Reals, dt: Reals, bias: Reals, parts: int) -> tuple[Rotation, Reals, Reals]:
    """The rotation, the velocity and the place by midpoints of small parts of samples."""
    turn, velocity, place = Rotation.identity(), np.zeros(3), np.zeros(3)
    for rate, force, step in zip(rates - bias[:3], forces - bias[3:], dt, strict=True):
        h = step / parts
        middles = turn * Rotation.from_rotvec((np.arange(parts) + 0.5)[:, None] * h * rate)
        gains = middles.apply(force) * h
        speeds = velocity + np.cumsum(gains, 0)
        place = place + (speeds - gains / 2).sum(0) * h
        velocity, turn = speeds[-1], turn * Rotation.from_rotvec(rate * step)
    return turn, velocity, place


def numbers_of(found: InertialSum, about: InertialSum) -> Reals:
    """The rotation from another sum in the last frame, the velocity, and the place."""
    one, two = matrices(about.motion), matrices(found.motion)
    turn = Rotation.from_matrix(one[:3, :3].T @ two[:3, :3]).as_rotvec()
    return np.concatenate([turn, two[:3, 3], found.place])


@pytest.fixture
def samples() -> tuple[Reals, Reals, Reals, Reals]:
    rng = np.random.default_rng(0)
    rates, forces = rng.normal(size=(20, 3)), 3 * rng.normal(size=(20, 3))
    return rates, forces, rng.uniform(0.01, 0.03, 20), 0.1 * rng.normal(size=6)


def test_sum_is_that_of_small_steps(samples: tuple[Reals, Reals, Reals, Reals]) -> None:
    rates, forces, dt, bias = samples
    found = preintegrate(rates, forces, dt, NOISE, bias)
    turn, velocity, place = small_steps(rates, forces, dt, bias, 500)
    rows = matrices(found.motion)
    assert np.allclose(rows[:3, :3], turn.as_matrix(), atol=1e-13)
    assert np.allclose(rows[:3, 3], velocity, atol=1e-9) and np.allclose(found.place, place, atol=1e-9)
    assert found.duration == pytest.approx(dt.sum(), rel=1e-15)


def test_fast_turns_are_exact() -> None:
    """Samples of half a radian: a rotation about z and a force along x, in closed form."""
    found = preintegrate(np.tile([0, 0, 0.5], (4, 1)), np.tile([1.0, 0, 0], (4, 1)), 1.0, NOISE)
    sine, cosine = np.sin(2.0), np.cos(2.0)
    assert matrices(found.motion)[:3, 3] == pytest.approx([2 * sine, 2 * (1 - cosine), 0], abs=1e-14)
    assert found.place == pytest.approx([4 * (1 - cosine), 4 * (2 - sine), 0], abs=1e-14)


def test_derivatives_by_biases_are_differences(samples: tuple[Reals, Reals, Reals, Reals]) -> None:
    rates, forces, dt, bias = samples
    about = preintegrate(rates, forces, dt, NOISE, bias)
    for k, unit in enumerate(1e-6 * np.eye(6)):
        two = [numbers_of(preintegrate(rates, forces, dt, NOISE, bias + sign * unit), about) for sign in (1, -1)]
        assert (two[0] - two[1]) / 2e-6 == pytest.approx(about.by_bias[:, k], abs=1e-8)


@pytest.mark.slow
def test_covariance_is_that_of_many_runs(samples: tuple[Reals, Reals, Reals, Reals]) -> None:
    """Squared errors of 3,000 noisy sums, divided by their covariance, are within the 99.9 % band."""
    rates, forces, dt, bias = samples
    about, rng, runs = preintegrate(rates, forces, dt, NOISE, bias), np.random.default_rng(1), 3000
    each = [
        numbers_of(
            preintegrate(
                rates + np.sqrt(NOISE[0] / dt)[:, None] * rng.normal(size=(20, 3)),
                forces + np.sqrt(NOISE[1] / dt)[:, None] * rng.normal(size=(20, 3)), dt, NOISE, bias,
            ),
            about,
        )
        for _ in range(runs)
    ]  # fmt: skip
    errors = np.array(each) - numbers_of(about, about)
    whitened = np.linalg.solve(np.linalg.cholesky(about.covariance), errors.T)
    low, high = chi2.ppf([0.0005, 0.9995], 9 * runs)
    assert low < (whitened**2).sum() < high
    assert np.allclose(whitened @ whitened.T / runs, np.eye(9), atol=0.1)


class Flight:
    """A path with inertial samples, places by satellites, and their noise."""

    def __init__(self, seed: int, n: int = 6, per: int = 20) -> None:
        rng = self.rng = np.random.default_rng(seed)
        self.n, self.per, self.dt = n, per, 0.02
        self.bias = np.sqrt(WALK) * rng.normal(size=6)
        pose, velocity = matrices(moved(ONE, rng.normal(size=6))), rng.normal(size=3)
        self.poses, self.velocities, self.sums = [pose], [velocity], []
        for _ in range(n - 1):
            rates = 0.5 * rng.normal(size=3) + np.zeros((per, 3))
            forces = pose[:3, :3].T @ -GRAVITY + 2 * rng.normal(size=3) + np.zeros((per, 3))
            turn, change, way = small_steps(rates, forces, np.full(per, self.dt), np.zeros(6), 50)
            noise = np.sqrt(NOISE / self.dt)
            self.sums.append(preintegrate(
                rates + self.bias[:3] + noise[0] * rng.normal(size=(per, 3)),
                forces + self.bias[3:] + noise[1] * rng.normal(size=(per, 3)), self.dt, NOISE,
            ))  # fmt: skip
            after, time = np.eye(4), per * self.dt
            after[:3, :3] = pose[:3, :3] @ turn.as_matrix()
            after[:3, 3] = pose[:3, 3] + velocity * time + GRAVITY * time**2 / 2 + pose[:3, :3] @ way
            velocity = velocity + GRAVITY * time + pose[:3, :3] @ change
            pose = after
            self.poses.append(pose)
            self.velocities.append(velocity)
        self.truth, self.speeds = np.array(self.poses), np.array(self.velocities)
        self.prior = of_matrices(self.truth[0] @ matrix_exponential(DEVIATIONS * rng.normal(size=6)))
        self.speed = self.speeds[0] + 0.1 * rng.normal(size=3)
        self.places = self.truth[:, :3, 3] + 0.1 * rng.normal(size=(n, 3))

    def begin(self, graph: MotorGraph) -> None:
        graph.add_priors(0, self.prior, DEVIATIONS**2)
        graph.add_velocities(0, self.speed, np.full(3, 0.01))
        graph.add_biases(0, np.zeros(6), WALK)

    def graph(self) -> MotorGraph:
        graph = MotorGraph()
        self.begin(graph)
        graph.add_inertial(np.arange(self.n - 1), np.arange(1, self.n), self.sums, WALK * 1e-2)
        graph.add_positions(np.arange(self.n), self.places, np.full(3, 0.01))
        return graph

    def start(self) -> dict[str, Reals]:
        """The states that follow from the first ones by inertial sums alone."""
        poses, speeds = [matrices(self.prior)], [self.speed]
        for each in self.sums:
            pose, speed, time, rows = poses[-1], speeds[-1], each.duration, matrices(each.motion)
            after = np.eye(4)
            after[:3, :3] = pose[:3, :3] @ rows[:3, :3]
            after[:3, 3] = pose[:3, 3] + speed * time + GRAVITY * time**2 / 2 + pose[:3, :3] @ each.place
            poses.append(after)
            speeds.append(speed + GRAVITY * time + pose[:3, :3] @ rows[:3, 3])
        return {"motors": of_matrices(np.array(poses)), "velocities": np.array(speeds)}

    def residuals(self, poses: Reals, speeds: Reals, biases: Reals) -> Reals:
        """All residuals by matrices, in deviations."""
        found = [
            matrix_logarithm(np.linalg.inv(matrices(self.prior)) @ poses[0]) / DEVIATIONS,
            (speeds[0] - self.speed) / 0.1, biases[0] / np.sqrt(WALK), (poses[:, :3, 3] - self.places).ravel() / 0.1,
        ]  # fmt: skip
        for k, each in enumerate(self.sums):
            change, back, rows = each.by_bias @ biases[k], poses[k, :3, :3].T, matrices(each.motion)
            turn = rows[:3, :3] @ Rotation.from_rotvec(change[:3]).as_matrix()
            time = each.duration
            way = poses[k + 1, :3, 3] - poses[k, :3, 3] - speeds[k] * time - GRAVITY * time**2 / 2
            off = np.concatenate([
                Rotation.from_matrix(turn.T @ back @ poses[k + 1, :3, :3]).as_rotvec(),
                back @ (speeds[k + 1] - speeds[k] - GRAVITY * time) - rows[:3, 3] - change[3:6],
                back @ way - each.place - change[6:],
            ])  # fmt: skip
            found.append(np.linalg.solve(np.linalg.cholesky(each.covariance), off))
            found.append((biases[k + 1] - biases[k]) / np.sqrt(WALK * 1e-2 * time))
        return np.concatenate(found)

    def error(self, found: SmoothedMotors, k: int) -> Reals:
        """The error of a state, of its pose, velocity and bias."""
        turn = matrix_logarithm(np.linalg.inv(matrices(found.motors[k])) @ self.truth[k])
        return np.concatenate([turn, self.speeds[k] - found.velocities[k], self.bias - found.biases[k]])


@pytest.mark.parametrize(("seed", "n"), [(0, 3), pytest.param(1, 6, marks=pytest.mark.slow)])
def test_inertial_minimum_is_that_of_scipy(seed: int, n: int) -> None:
    flight = Flight(seed, n)
    found = smooth_motors(flight.graph(), **flight.start())
    about = matrices(found.motors)

    def cost(changes: Reals) -> Reals:
        change = changes.reshape(-1, 15)
        poses = about @ matrix_exponential(change[:, :6])
        return flight.residuals(poses, found.velocities + change[:, 6:9], found.biases + change[:, 9:])

    here = cost(np.zeros(15 * n))
    assert found.cost == pytest.approx(0.5 * here @ here, rel=1e-9)
    signs = np.where(np.arange(n) % 2, 1, -1)[:, None]
    start = flight.start()
    again = smooth_motors(flight.graph(), signs * start["motors"], start["velocities"])
    assert again.cost == pytest.approx(found.cost, rel=1e-9)
    scale = np.tile([0.01] * 6 + [0.01] * 3 + [0.001] * 6, n)
    other = least_squares(lambda x: cost(scale * x), 0.1 * flight.rng.normal(size=15 * n), xtol=1e-12, ftol=1e-14)
    assert found.cost == pytest.approx(other.cost, rel=1e-9)
    assert found.status == SmoothingStatus.OK


@pytest.mark.slow
def test_inertial_errors_are_within_the_band() -> None:
    """The normalised squared errors of the last state over 100 flights are within the 95 % band."""
    total, runs = 0.0, 100
    for seed in range(runs):
        flight = Flight(1000 + seed, 4)
        found = smooth_motors(flight.graph(), **flight.start(), marginals=[3])
        error = flight.error(found, 3)
        # The true bias is constant; its modelled walk only adds variance.
        total += float(error[:9] @ np.linalg.solve(found.covariances[0][:9, :9], error[:9]))
    low, high = chi2.ppf([0.025, 0.975], 9 * runs)
    assert low < total < high


def walk(n: int, seed: int = 0) -> tuple[Reals, Reals, Reals]:
    """True poses (n, 8), noisy motions between them, and noisy places."""
    rng = np.random.default_rng(seed)
    chain = [ONE]
    for _ in range(n - 1):
        chain.append(moved(chain[-1], 0.05 * rng.normal(size=6) + [0, 0, 0.1, 1, 0, 0]))
    truth = np.array(chain)
    between = of_matrices(np.linalg.inv(matrices(truth[:-1])) @ matrices(truth[1:]))
    motions = moved(between, DEVIATIONS * rng.normal(size=(n - 1, 6)))
    return truth, motions, matrices(truth)[:, :3, 3] + 0.1 * rng.normal(size=(n, 3))


def run(smoother: MotorSmoother, truth: Reals, motions: Reals, places: Reals, delay: int) -> SmoothingStatus:
    """Smooth a walk with places that arrive late; at the end, all have arrived."""
    n, status = len(truth), SmoothingStatus.EMPTY
    for k in range(n):
        start = truth[0] if k == 0 else np.asarray(pga3.motor_product(smoother.motors[-1], motions[k - 1]))
        state = smoother.add_state(float(k), start)
        if k == 0:
            smoother.add_priors(0, truth[0], DEVIATIONS**2)
        else:
            smoother.add_motions(k - 1, k, motions[k - 1], DEVIATIONS**2)
        arrived = [k - delay] if k >= delay else []
        if k == n - 1:
            arrived = list(range(max(k - delay, 0), n))
        for each in arrived:
            smoother.add_positions(each, places[each], np.full(3, 0.01))
        status = smoother.update([state])
    return status


def test_lag_longer_than_the_recording_is_the_batch() -> None:
    truth, motions, places = walk(12)
    smoother = MotorSmoother(100.0, tolerance=1e-15)
    assert run(smoother, truth, motions, places, 3) == SmoothingStatus.OK
    graph = MotorGraph()
    graph.add_priors(0, truth[0], DEVIATIONS**2)
    graph.add_motions(np.arange(11), np.arange(1, 12), motions, DEVIATIONS**2)
    assert repr(graph) == "MotorGraph of 12 states: 1 prior, 11 motion"
    assert repr(MotorGraph()) == "MotorGraph of 0 states: no factors"
    graph.add_positions(np.arange(12), places, np.full(3, 0.01))
    batch = smooth_motors(graph, truth, marginals=[11], tolerance=1e-15)
    assert np.allclose(matrices(smoother.motors), matrices(batch.motors), atol=1e-7)
    assert smoother.found is not None and smoother.found.cost == pytest.approx(batch.cost, rel=1e-9)
    assert np.allclose(smoother.found.covariances[0], batch.covariances[0], rtol=1e-6, atol=1e-12)


def test_linear_measurements_lose_nothing() -> None:
    """Translations alone: the last state of a short window is that of the batch by numpy, with its variance."""
    n, rng = 25, np.random.default_rng(2)
    steps, places = rng.normal(size=n - 1), rng.normal(size=n)
    smoother = MotorSmoother(4.5)
    for k in range(n):
        state = smoother.add_state(float(k), ONE)
        if k == 0:
            smoother.add_priors(0, ONE, [1e-10] * 3 + [1.0] * 3)
        else:
            motion = pga3.motor_from_rotation_vector_translation(np.zeros(3), np.array([steps[k - 1], 0, 0]))
            smoother.add_motions(state - 1, state, motion, [1e-10] * 3 + [0.01] * 3)
        # A place arrives three states late, and the last ones at once.
        for each in [k - 3] if k < n - 1 else range(k - 3, n):
            if each >= 0:
                smoother.add_positions(each, [places[each], 0, 0], np.full(3, 0.25))
        status = smoother.update([state])
    rows = np.zeros((2 * n, n))
    rows[0, 0] = 1
    rows[np.arange(1, n), np.arange(1, n)], rows[np.arange(1, n), np.arange(n - 1)] = 10, -10
    rows[n:] = 2 * np.eye(n)
    want = np.linalg.lstsq(rows, np.r_[0, 10 * steps, 2 * places], rcond=None)[0]
    assert status == SmoothingStatus.OK and smoother.numbers.tolist() == [20, 21, 22, 23, 24]
    assert matrices(smoother.motors)[:, 0, 3] == pytest.approx(want[-5:], abs=1e-6)
    assert smoother.found is not None
    assert smoother.found.covariances[0][3, 3] == pytest.approx(np.linalg.inv(rows.T @ rows)[-1, -1], rel=1e-6)


def test_window_is_near_the_batch() -> None:
    """With rotations, the last state is within a hundredth of its deviation of the batch."""
    truth, motions, places = walk(24, 3)
    smoother = MotorSmoother(8.5)
    assert run(smoother, truth, motions, places, 3) == SmoothingStatus.OK
    graph = MotorGraph()
    graph.add_priors(0, truth[0], DEVIATIONS**2)
    graph.add_motions(np.arange(23), np.arange(1, 24), motions, DEVIATIONS**2)
    graph.add_positions(np.arange(24), places, np.full(3, 0.01))
    batch = smooth_motors(graph, truth, marginals=[23])
    off = matrix_logarithm(np.linalg.inv(matrices(batch.motors[-1])) @ matrices(smoother.motors[-1]))
    assert (np.abs(off) < 0.01 * np.sqrt(np.diag(batch.covariances[0]))).all()
    assert smoother.found is not None
    assert np.diag(smoother.found.covariances[0]) == pytest.approx(np.diag(batch.covariances[0]), rel=0.02)


@pytest.mark.slow
def test_window_errors_are_within_the_band() -> None:
    """The normalised squared errors of the last state of 60 windows are within the 95 % band."""
    total, runs = 0.0, 60
    for seed in range(runs):
        rng = np.random.default_rng(10_000 + seed)
        truth, motions, places = walk(15, seed)
        smoother = MotorSmoother(4.5)
        run(smoother, moved(truth, DEVIATIONS * rng.normal(size=6)), motions, places, 2)
        assert smoother.found is not None
        error = matrix_logarithm(np.linalg.inv(matrices(smoother.motors[-1])) @ matrices(truth[-1]))
        total += float(error @ np.linalg.solve(smoother.found.covariances[0], error))
    low, high = chi2.ppf([0.025, 0.975], 6 * runs)
    assert low < total < high


def test_inertial_window() -> None:
    flight = Flight(5, 8)
    start, smoother = flight.start(), MotorSmoother(1.0)
    for k in range(8):
        smoother.add_state(0.4 * k, start["motors"][k], start["velocities"][k])
        if k == 0:
            flight.begin(smoother)
        else:
            smoother.add_inertial(k - 1, k, flight.sums[k - 1], WALK * 1e-2)
        smoother.add_positions(k, flight.places[k], np.full(3, 0.01))
        assert smoother.update([k]) == SmoothingStatus.OK
    batch = smooth_motors(flight.graph(), **start, marginals=[7])
    assert smoother.found is not None
    deviations = np.sqrt(np.diag(batch.covariances[0]))
    off = matrix_logarithm(np.linalg.inv(matrices(batch.motors[-1])) @ matrices(smoother.motors[-1]))
    both = np.concatenate([off, smoother.velocities[-1] - batch.velocities[-1], smoother.biases[-1] - batch.biases[-1]])
    assert (np.abs(both) < 0.02 * deviations).all()
    assert np.diag(smoother.found.covariances[0]) == pytest.approx(deviations**2, rel=0.02)


def test_states_may_be_added_late() -> None:
    """A state between two others gives the same window, whenever it is added."""
    truth, motions, places = walk(4, 6)
    results = []
    for order in ([0, 1, 2, 3], [0, 3, 1, 2]):
        smoother, number = MotorSmoother(10.0), {}
        for k in order:
            number[k] = smoother.add_state(float(k), truth[k])
            smoother.add_positions(number[k], places[k], np.full(3, 0.01))
        smoother.add_priors(number[0], truth[0], DEVIATIONS**2)
        for k in range(3):
            smoother.add_motions(number[k], number[k + 1], motions[k], DEVIATIONS**2)
        assert smoother.update() == SmoothingStatus.OK and smoother.times.tolist() == [0, 1, 2, 3]
        results.append(matrices(smoother.motors))
    assert np.allclose(*results, atol=1e-9)


def test_stored_smoothers_continue(tmp_path: Path) -> None:
    """After half of the recording, with a summary of older states and late places, a copy from a file goes on alike."""
    rng = np.random.default_rng(8)
    step = pga3.motor_from_rotation_vector_translation([0, 0.1, 0.3], [1.0, 0, 0])
    one = MotorSmoother(lag=3.0)
    one.add_priors(one.add_state(0.0, ONE), ONE, DEVIATIONS**2)
    two = one
    for k in range(1, 12):
        if k == 6:
            (tmp_path / "smoother.pickle").write_bytes(pickle.dumps(one))
            two = pickle.loads((tmp_path / "smoother.pickle").read_bytes())
        place = rng.normal(size=3)
        for each in (one, two) if two is not one else (one,):
            state = each.add_state(float(k), each.motors[-1])
            each.add_motions(state - 1, state, step, DEVIATIONS**2)
            each.add_positions(state - 1, place, np.full(3, 0.01), robust=True)
            each.update()
    assert two is not one and two.status == one.status and two.numbers.tolist() == [8, 9, 10, 11]
    assert np.array_equal(two.motors, one.motors)


def test_what_is_too_late_is_reported() -> None:
    truth, motions, places = walk(12, 7)
    smoother = MotorSmoother(3.0)
    run(smoother, truth, motions, places, 0)
    before = smoother.motors
    smoother.add_positions([2, 11], places[[2, 11]], np.full(3, 0.01))
    for wrong in ([2], [99], [11.0]):
        with pytest.raises(ValueError, match="marginals"):
            smoother.update(wrong)
    assert smoother.update() == SmoothingStatus.TOO_LATE and smoother.n_too_late == 1
    assert not np.array_equal(before, smoother.motors)
    assert smoother.update() == SmoothingStatus.OK
    with pytest.raises(ValueError, match="expected at least 8"):
        smoother.add_state(7.9, ONE)
    with pytest.raises(ValueError, match="add_state returned"):
        smoother.add_positions(12, places[0], np.ones(3))
    with pytest.raises(ValueError, match="states of the window"):
        smoother.update([2])
    with pytest.raises(ValueError, match="lag"):
        MotorSmoother(0.0)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"rates": np.zeros((1, 3)), "forces": np.zeros((1, 3))}, "two samples"),
        ({"rates": np.full((4, 3), np.nan)}, "finite"),
        ({"dt": 0.0}, "positive"),
        ({"dt": np.ones(3)}, "dt"),
        ({"noise": [1.0, 0.0]}, "positive"),
        ({"bias": np.zeros(5)}, "bias"),
    ],
)
def test_bad_samples_are_named(arguments: dict[str, Any], text: str) -> None:
    good = {"rates": np.zeros((4, 3)), "forces": np.zeros((4, 3)), "dt": 0.1, "noise": NOISE}
    with pytest.raises(ValueError, match=text):
        preintegrate(**{**good, **arguments})
