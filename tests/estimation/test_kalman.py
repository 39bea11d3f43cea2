"""Kalman filters: numpy's matrices, the batch solution, the steady state, gates, missing numbers, batches."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import block_diag, expm, solve_discrete_are
from scipy.stats import chi2

from algorithms.arguments import Reals
from algorithms.estimation import (
    EstimationStatus,
    ExtendedKalmanFilter,
    KalmanFilter,
    MotorFilter,
    UnscentedKalmanFilter,
)
from tests.support.all_cases import all_cases


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(2)


class Problem(NamedTuple):
    """A linear system."""

    state: Reals
    covariance: Reals
    transition: Reals
    process: Reals
    rows: Reals
    noise: Reals


def moving(order: int, axes: int, dt: float = 0.1) -> Problem:
    """Points on axes with constant velocity or acceleration, of which positions are measured."""
    one = expm(dt * np.eye(order, k=1))
    side = np.array([dt**k for k in range(order, 0, -1)])
    process = 0.3 * np.outer(side, side) + 1e-6 * np.eye(order)
    rows = np.eye(1, order)
    n = order * axes
    r = np.eye(axes) * 0.2 + 0.05
    return Problem(np.zeros(n), 2 * np.eye(n), block_diag(*[one] * axes), block_diag(*[process] * axes),
                   block_diag(*[rows] * axes), r)  # fmt: skip


PROBLEMS = [
    moving(2, 1), moving(2, 2), moving(2, 3), moving(3, 1), moving(1, 1), moving(3, 3), moving(2, 4), moving(4, 5),
]  # fmt: skip


def simulated(rng: np.random.Generator, p: Problem, t: int) -> tuple[Reals, Reals]:
    x = np.linalg.cholesky(p.covariance) @ rng.normal(size=len(p.state)) + p.state
    truth, seen = [], []
    for _ in range(t):
        x = p.transition @ x + np.linalg.cholesky(p.process) @ rng.normal(size=len(x))
        truth.append(x)
        seen.append(p.rows @ x + np.linalg.cholesky(p.noise) @ rng.normal(size=len(p.rows)))
    return np.array(truth), np.array(seen)


def by_batch(p: Problem, measurements: Reals) -> tuple[Reals, Reals]:
    """All states given all measurements, and their covariances, by the equations of conditional Gaussians."""
    t, n = len(measurements), len(p.state)
    powers = [np.linalg.matrix_power(p.transition, k) for k in range(t + 1)]
    mean = np.concatenate([powers[k + 1] @ p.state for k in range(t)])
    spread = np.zeros((t * n, t * n))
    own = p.covariance
    for j in range(t):
        own = p.transition @ own @ p.transition.T + p.process
        for k in range(j, t):
            block = powers[k - j] @ own
            spread[k * n : (k + 1) * n, j * n : (j + 1) * n] = block
            spread[j * n : (j + 1) * n, k * n : (k + 1) * n] = block.T
    rows = block_diag(*[p.rows] * t)
    seen = rows @ spread @ rows.T + block_diag(*[p.noise] * t)
    gain = np.linalg.solve(seen, rows @ spread).T
    after = mean + gain @ (measurements.ravel() - rows @ mean)
    return after.reshape(t, n), np.array(
        [(spread - gain @ rows @ spread)[k * n : (k + 1) * n, k * n : (k + 1) * n] for k in range(t)]
    )


@all_cases("p", PROBLEMS)
def test_filter_and_smoother_equal_the_batch(rng: np.random.Generator, p: Problem) -> None:
    """The last filtered and all smoothed states are those of the joint distribution of all states."""
    measurements = simulated(rng, p, 12)[1]
    f = KalmanFilter(*p)
    found = f.run(measurements)
    smoothed = f.smooth(found)
    states, covariances = by_batch(p, measurements)
    assert np.abs(found.states[-1] - states[-1]).max() < 1e-11
    assert np.abs(smoothed.states - states).max() < 1e-10
    assert np.abs(smoothed.covariances - covariances).max() < 1e-10
    assert np.array_equal(f.state, found.states[-1]) and found.used.all()
    assert np.abs(np.swapaxes(found.covariances, -1, -2) - found.covariances).max() == 0


@all_cases("p", PROBLEMS)
def test_steps_equal_the_recording(rng: np.random.Generator, p: Problem) -> None:
    """Steps, joint and in sequence, give what the kernel of a recording gives."""
    measurements = simulated(rng, p, 20)[1]
    found = KalmanFilter(*p).run(measurements)
    for in_sequence in (False, True):
        f = KalmanFilter(*p)
        for k, z in enumerate(measurements):
            f.predict()
            f.update(z, in_sequence=in_sequence)
            assert f.status == EstimationStatus.OK
            assert np.abs(f.state - found.states[k]).max() < 1e-12
            assert np.abs(f.covariance - found.covariances[k]).max() < 1e-12
            assert abs(f.square - found.squares[k]) < 1e-9 * (1 + found.squares[k])


@pytest.mark.parametrize("p", [PROBLEMS[1], PROBLEMS[3], PROBLEMS[6]], ids=lambda p: f"{len(p.state)}x{len(p.rows)}")
def test_steps_of_lists_and_batches(rng: np.random.Generator, p: Problem) -> None:
    """Lists, batches of states and batches of measurements give what single arrays give."""
    measurements = simulated(rng, p, 5)[1]
    single, listed, batch = KalmanFilter(*p), KalmanFilter(*p), KalmanFilter(np.tile(p.state, (3, 1)), *p[1:])
    for z in measurements:
        for f in (single, listed, batch):
            f.predict()
            assert (f.status == EstimationStatus.OK).all() and f.status.shape == f.state.shape[:-1]
        single.update(z)
        listed.update(z.tolist())
        batch.update(np.stack([z, z + 1, np.full_like(z, np.nan)]))
        assert np.array_equal(single.state, listed.state) and np.array_equal(single.covariance, listed.covariance)
        assert np.allclose(batch.state[0], single.state, rtol=0, atol=1e-13)
        assert batch.status.tolist() == [EstimationStatus.OK, EstimationStatus.OK, EstimationStatus.SKIPPED]
        assert batch.square.shape == (3,) and batch.innovation.shape == (3, len(z))
    other = np.eye(len(p.state))
    single.predict(other, 0 * other)
    assert np.array_equal(single.state, listed.state) and np.array_equal(single.covariance, listed.covariance)
    column = np.ones((2, *np.shape(measurements[0])))
    with pytest.raises(ValueError, match=r"measurement: shape .*; expected"):
        KalmanFilter(*p).update(column)


def test_singular_noise() -> None:
    """Two numbers with exactly the same error: their difference is exact."""
    f = KalmanFilter(np.zeros(3), np.eye(3), np.eye(3), np.zeros((3, 3)), np.eye(3)[:2], np.ones((2, 2)))
    f.update([2.0, 1.0])
    assert f.status == EstimationStatus.OK and abs(f.state[0] - f.state[1] - 1) < 1e-12


@pytest.mark.parametrize("p", PROBLEMS[:3], ids=lambda p: f"{len(p.state)}x{len(p.rows)}")
def test_steady_state_solves_the_riccati_equation(p: Problem) -> None:
    found = KalmanFilter(*p).run(np.zeros((2000, len(p.rows))))
    exact = solve_discrete_are(p.transition.T, p.rows.T, p.process, p.noise)
    assert np.abs(found.predicted_covariances[-1] - exact).max() < 1e-9


def test_innovations_have_their_covariance(rng: np.random.Generator) -> None:
    """Squared innovations and errors of 120 filters, run as one batch, are in the 95 % band."""
    p, n_runs, t = PROBLEMS[1], 120, 30
    truths, measurements = (np.array(x) for x in zip(*(simulated(rng, p, t) for _ in range(n_runs)), strict=True))
    found = KalmanFilter(np.zeros((n_runs, 4)), *p[1:]).run(measurements)
    assert found.states.shape == (n_runs, t, 4)
    low, high = chi2.interval(0.95, 2 * n_runs * t)
    assert low < found.squares.sum() < high
    last = truths[:, -1] - found.states[:, -1]
    squares = np.einsum("ki,kij,kj", last, np.linalg.inv(found.covariances[:, -1]), last)
    low, high = chi2.interval(0.95, 4 * n_runs)
    assert low < squares < high
    single = KalmanFilter(*p).run(measurements[7])
    assert np.abs(single.states - found.states[7]).max() < 1e-12


@pytest.mark.parametrize("p", [PROBLEMS[1], PROBLEMS[6]], ids=["4x2", "8x4"])
def test_missing_numbers_are_left_out(rng: np.random.Generator, p: Problem) -> None:
    """A missing number is as if it were not measured: the filter with fewer rows, or the prediction."""
    measurements = simulated(rng, p, 10)[1]
    measurements[3, 0] = np.nan
    measurements[5] = np.nan
    found = KalmanFilter(*p).run(measurements)
    assert found.n_missing == 1 + len(p.rows)
    x, spread = p.state, p.covariance
    for k, z in enumerate(measurements):
        x, spread = p.transition @ x, p.transition @ spread @ p.transition.T + p.process
        seen = np.isfinite(z)
        rows, noise = p.rows[seen], p.noise[np.ix_(seen, seen)]
        gain = spread @ rows.T @ np.linalg.inv(rows @ spread @ rows.T + noise)
        x, spread = x + gain @ (z[seen] - rows @ x), spread - gain @ rows @ spread
        assert np.abs(found.states[k] - x).max() < 1e-11
        assert np.abs(found.covariances[k] - spread).max() < 1e-11
    f = KalmanFilter(*p)
    f.update(np.full(len(p.rows), np.nan))
    assert f.status == EstimationStatus.SKIPPED


def test_gate(rng: np.random.Generator) -> None:
    p = PROBLEMS[1]
    measurements = simulated(rng, p, 50)[1]
    measurements[20] += 100
    found = KalmanFilter(*p, gate=30.0).run(measurements)
    assert not found.used[20] and found.used.sum() == 49
    assert np.array_equal(found.states[20], found.predicted[20])
    f = KalmanFilter(*p, gate=30.0)
    f.update(np.array([1e3, 0]))
    assert f.status == EstimationStatus.REJECTED and not f.state.any()
    f = KalmanFilter(*p[:5], 0.2 * np.eye(2), gate=30.0)
    f.update(np.array([1e3, 0.1]), in_sequence=True)
    assert f.status == EstimationStatus.OK and f.state[2] > 0 and f.state[0] < 1


def test_controls_and_matrices_that_change(rng: np.random.Generator) -> None:
    """A recording with other matrices for each row is that of steps, and of numpy's equations."""
    n, m, t = 3, 2, 15
    start, control = np.diag([1.0, 2, 3]), rng.normal(size=(n, 2))
    u, z = rng.normal(size=(t, 2)), rng.normal(size=(t, m))
    moves, seen = np.eye(n) + 0.2 * rng.normal(size=(t, n, n)), rng.normal(size=(t, m, n))
    processes, noises = (x @ np.swapaxes(x, -1, -2) for x in (rng.normal(size=(t, k, k)) for k in (n, m)))
    f, g = (
        KalmanFilter(np.ones(n), start, np.eye(n), np.eye(n), np.eye(m, n), np.eye(m), control=control) for _ in "ab"
    )
    found = f.run(z, controls=u, transitions=moves, process_noises=processes, rows=seen, noises=noises)
    x, spread = np.ones(n), start
    for k in range(t):
        x, spread = moves[k] @ x + control @ u[k], moves[k] @ spread @ moves[k].T + processes[k]
        gain = spread @ seen[k].T @ np.linalg.inv(seen[k] @ spread @ seen[k].T + noises[k])
        x, spread = x + gain @ (z[k] - seen[k] @ x), spread - gain @ seen[k] @ spread
        g.predict(moves[k], processes[k], control=u[k])
        g.update(z[k], rows=seen[k], noise=noises[k])
        for state, covariance in ((found.states[k], found.covariances[k]), (g.state, g.covariance)):
            assert np.abs(state - x).max() < 1e-11 * (1 + np.abs(x).max())
            assert np.abs(covariance - spread).max() < 1e-11 * (1 + np.abs(spread).max())
    # The smoother uses the transition of the next row: it is the mean given all numbers, the minimum of all squares.
    smoothed = f.smooth(found)
    after = np.concatenate([moves, np.zeros((1, n, n))])[1:]
    whole = np.zeros((t * n, t * n))
    right = np.zeros(t * n)
    first = np.linalg.inv(moves[0] @ start @ moves[0].T + processes[0])
    whole[:n, :n], right[:n] = first, first @ (moves[0] @ np.ones(n) + control @ u[0])
    for k in range(t):
        own = slice(k * n, (k + 1) * n)
        whole[own, own] += seen[k].T @ np.linalg.solve(noises[k], seen[k])
        right[own] += seen[k].T @ np.linalg.solve(noises[k], z[k])
        if k + 1 < t:
            both = slice(k * n, (k + 2) * n)
            difference = np.hstack([-after[k], np.eye(n)])
            weight = difference.T @ np.linalg.inv(processes[k + 1])
            whole[both, both] += weight @ difference
            right[both] += weight @ control @ u[k + 1]
    assert np.abs(smoothed.states.ravel() - np.linalg.solve(whole, right)).max() < 1e-8
    assert np.abs(smoothed.covariances[4] - np.linalg.inv(whole)[4 * n : 5 * n, 4 * n : 5 * n]).max() < 1e-8


def test_indefinite_covariances_and_bad_arguments() -> None:
    p = PROBLEMS[0]
    f = KalmanFilter(p.state, np.diag([1.0, -1]), *p[2:])
    assert f.status == EstimationStatus.NOT_DEFINITE and np.linalg.eigvalsh(f.covariance)[0] > 0
    f.predict()
    f.update([0.3])
    assert np.isfinite(f.state).all() and np.linalg.eigvalsh(f.covariance)[0] > 0
    with pytest.raises(ValueError, match=r"transition: shape \(3, 3\); expected \(2, 2\)"):
        KalmanFilter(p.state, p.covariance, np.eye(3), *p[3:])
    with pytest.raises(ValueError, match="process_noise"):
        KalmanFilter(*p[:3], np.full((2, 2), np.nan), *p[4:])
    none = np.zeros((0, 0))
    with pytest.raises(ValueError, match="state: no numbers"):
        KalmanFilter([], none, none, none, none, none)
    with pytest.raises(ValueError, match="gate: nan"):
        KalmanFilter(*p, gate=np.nan)
    f = KalmanFilter(*p)
    with pytest.raises(ValueError, match="control: given, but the filter has no matrix of controls"):
        f.predict(control=[1.0])
    with pytest.raises(ValueError, match="rows: 2 measured numbers; expected 1, or noise="):
        f.update([1.0, 2.0], rows=np.eye(2))
    empty = f.run(np.zeros((0, 1)))
    assert f.smooth(empty).states.shape == (0, 2) and np.array_equal(f.state, p.state)
    with pytest.raises(ValueError, match=r"noises: shape \(3, 1, 1\); expected \(4, 1, 1\)"):
        f.run(np.zeros((4, 1)), noises=np.ones((3, 1, 1)))
    with pytest.raises(ValueError, match=r"noises: nan at \(2, 0, 0\)"):
        f.run(np.zeros((4, 1)), noises=np.array([1, 1, np.nan, 1]).reshape(4, 1, 1))


@pytest.mark.parametrize("gate", [9.0, np.inf])
def test_numbers_whose_squares_overflow(gate: float) -> None:
    """They exceed every gate; one of them does not hide another number of a sequence."""
    p = PROBLEMS[1]
    f = KalmanFilter(*p, gate=gate)
    f.update([1e308, 0.1])
    assert f.status == EstimationStatus.REJECTED and np.array_equal(f.state, p.state) and not np.isnan(f.square)
    run = f.run(np.array([[1e308, 0.1], [0.1, 0.1]]))
    assert run.used.tolist() == [False, True] and np.isfinite(run.states).all()
    f, other = KalmanFilter(*p, gate=9), KalmanFilter(*p, gate=9)
    f.update([1e308, 0.1], in_sequence=True)
    other.update([np.nan, 0.1], in_sequence=True)
    assert f.status == EstimationStatus.OK and np.allclose(f.state, other.state) and f.square == other.square


def test_a_recording_leaves_the_status_of_its_last_measurement() -> None:
    p = PROBLEMS[0]
    f = KalmanFilter(p.state, np.diag([1.0, -1]), *p[2:], gate=9)
    for last, status in (
        (0.1, EstimationStatus.OK),
        (np.nan, EstimationStatus.SKIPPED),
        (99.0, EstimationStatus.REJECTED),
    ):
        run = f.run([[0.2], [last]])
        assert f.status == status
        assert np.array_equal(f.innovation, run.innovations[-1], equal_nan=True) and f.square == run.squares[-1]
    f.run(np.zeros((3, 4, 1)))
    assert f.status.shape == f.square.shape == (3,) and f.innovation.shape == (3, 1)


def test_indefinite_noise_of_one_step_is_not_ok() -> None:
    """A variance of -1 is used as 0, so that the measurement is taken to be exact."""
    p = PROBLEMS[0]
    calls: list[Callable[[KalmanFilter], object]] = [
        lambda f: f.predict(process_noise=-np.eye(2)),
        lambda f: f.update([0.1], noise=[[-1.0]]),
        lambda f: f.run([[0.1]], noises=[[[-1.0]]]),
        lambda f: f.run([[0.1]], process_noises=[-np.eye(2)]),
    ]
    for call in calls:
        f = KalmanFilter(*p)
        call(f)
        assert f.status == EstimationStatus.NOT_DEFINITE
        f.predict()
        f.update([0.1])
        assert f.status == EstimationStatus.OK
    extended, unscented = ExtendedKalmanFilter([0, 0], np.eye(2)), UnscentedKalmanFilter([0, 0], np.eye(2))
    for noise, status in ((-1.0, EstimationStatus.NOT_DEFINITE), (1.0, EstimationStatus.OK)):
        assert extended.predict(lambda x: (x, np.eye(2)), noise * np.eye(2)) == status
        assert extended.update([0.1], lambda x: (x[:1], np.eye(1, 2)), [[noise]]) == status
        assert unscented.predict(lambda x: x, noise * np.eye(2)) == status
        assert unscented.update([0.1], lambda x: x[:, :1], [[noise]]) == status


def test_an_indefinite_model_is_never_ok() -> None:
    """Unlike that of one step, the noise of a model is used at every step."""
    p = PROBLEMS[0]
    for noise, process in (([[-1.0]], p.process), (p.noise, -np.eye(2))):
        f = KalmanFilter(*p[:3], process, p.rows, noise)
        for call in (lambda f: f.run([[0.1], [0.1]]), lambda f: f.run([[0.1]], transitions=[np.eye(2)])):
            call(f)
            assert f.status == EstimationStatus.NOT_DEFINITE
        f.predict()
        assert (f.status == EstimationStatus.NOT_DEFINITE) == (process is not p.process)
        f.update([0.1])
        assert (f.status == EstimationStatus.NOT_DEFINITE) == (noise is not p.noise)
        f.run([[0.1]], process_noises=[np.eye(2)], noises=[[[1.0]]])
        assert f.status == EstimationStatus.OK


def test_a_triangular_root_is_no_covariance() -> None:
    p = PROBLEMS[0]
    assert KalmanFilter(p.state, [[1.0, 0.9], [0.0, 1.0]], *p[2:]).status == EstimationStatus.NOT_DEFINITE
    start = np.eye(8)[0]
    assert MotorFilter(start, np.eye(6) + np.eye(6, k=1) / 2).status == EstimationStatus.NOT_DEFINITE
    assert MotorFilter(start, np.eye(6), noise=-np.eye(6)).predict(1.0) == EstimationStatus.NOT_DEFINITE
    assert MotorFilter(start, np.eye(6)).move(start, -np.eye(6)) == EstimationStatus.NOT_DEFINITE


def test_functions_with_results_of_wrong_shapes_are_named() -> None:
    f, g = ExtendedKalmanFilter([0, 0], np.eye(2)), UnscentedKalmanFilter([0, 0], np.eye(2))
    with pytest.raises(ValueError, match=r"expected: returned shapes \(2,\) and \(1, 2\); expected \(1,\)"):
        f.update([1.0], lambda x: (x, np.eye(1, 2)), [[1.0]])
    with pytest.raises(ValueError, match=r"motion: returned shapes \(1,\) and \(2, 2\); expected \(2,\) and \(2, 2\)"):
        f.predict(lambda x: (x[:1], np.eye(2)), np.eye(2))
    with pytest.raises(TypeError, match="motion: returned ndarray; expected a pair"):
        f.predict(lambda x: x, np.eye(2))  # type: ignore[arg-type, return-value]
    with pytest.raises(ValueError, match=r"noise: shape \(3, 2, 2\); expected \(2, 2\)"):
        f.predict(lambda x: (x, np.eye(2)), np.ones((3, 2, 2)))
    with pytest.raises(ValueError, match=r"expected: returned shape \(5, 2\); expected \(5, 1\)"):
        g.update([1.0], lambda x: x, [[1.0]])


def test_joseph_form_keeps_covariances_positive() -> None:
    """An exact measurement of a state with a large covariance, where P - K H P has negative eigenvalues."""
    x, spread = np.zeros(2), np.array([[1e12, 1e12 - 1], [1e12 - 1, 1e12]])
    f = KalmanFilter(x, spread, np.eye(2), np.zeros((2, 2)), np.array([[1.0, 0]]), np.array([[1e-12]]))
    for _ in range(50):
        f.update([1.0])
    assert np.linalg.eigvalsh(f.covariance)[0] > -1e-4 * np.trace(f.covariance)


def test_extended_filter_of_bearings(rng: np.random.Generator) -> None:
    """Position and velocity by range and bearing from the origin: errors as predicted, better than the measurements."""
    dt, sigma = 0.1, np.array([0.05, 0.02])
    move = np.block([[np.eye(2), dt * np.eye(2)], [np.zeros((2, 2)), np.eye(2)]])
    process = np.diag([1e-6, 1e-6, 1e-4, 1e-4])

    def expected(x: Reals) -> tuple[Reals, Reals]:
        r = np.hypot(x[0], x[1])
        rows = np.array([[x[0] / r, x[1] / r, 0, 0], [-x[1] / r**2, x[0] / r**2, 0, 0]])
        return np.array([r, np.arctan2(x[1], x[0])]), rows

    def difference(a: Reals, b: Reals) -> Reals:
        change = a - b
        change[1] = np.angle(np.exp(1j * change[1]))
        return np.asarray(change)

    squares, errors = [], []
    for _ in range(20):
        first = np.diag([0.1, 0.1, 0.3, 0.3])
        start = np.array([-4.0, 0.0, 0, 0.5])
        x = start + np.sqrt(np.diag(first)) * rng.normal(size=4)
        f = ExtendedKalmanFilter(start, first, n_linearisations=2)
        for _ in range(40):
            x = move @ x + np.sqrt(np.diag(process)) * rng.normal(size=4)
            f.predict(lambda s: (move @ s, move), process)
            status = f.update(
                expected(x)[0] + sigma * rng.normal(size=2), expected, np.diag(sigma**2), difference=difference
            )
            assert status == EstimationStatus.OK
        off = x - f.state
        squares.append(off @ np.linalg.solve(f.covariance, off))
        errors.append(off[:2])
    low, high = chi2.interval(0.999, 4 * len(squares))
    assert low < sum(squares) < high
    assert np.sqrt(np.mean(np.square(errors))) < 0.05


def test_extended_filter_of_a_linear_problem(rng: np.random.Generator) -> None:
    p = PROBLEMS[2]
    measurements = simulated(rng, p, 10)[1]
    found = KalmanFilter(*p).run(measurements)
    f = ExtendedKalmanFilter(p.state, p.covariance)
    for z in measurements:
        f.predict(lambda x: (p.transition @ x, p.transition), p.process)
        f.update(z, lambda x: (p.rows @ x, p.rows), p.noise)
    assert np.abs(f.state - found.states[-1]).max() < 1e-12
    assert f.update(np.full(3, np.nan), lambda x: (p.rows @ x, p.rows), p.noise) == EstimationStatus.SKIPPED
    assert f.update(np.zeros(3), lambda x: (p.rows @ x * np.nan, p.rows), p.noise) == EstimationStatus.NOT_CONVERGED
    assert np.isfinite(f.state).all()


def linear(matrix: Reals) -> Callable[[Reals], Reals]:
    return lambda x: np.asarray(x @ matrix.T)


def test_unscented_filter_of_a_linear_problem(rng: np.random.Generator) -> None:
    for p in (PROBLEMS[0], PROBLEMS[6]):
        measurements = simulated(rng, p, 10)[1]
        found = KalmanFilter(*p).run(measurements)
        f = UnscentedKalmanFilter(p.state, p.covariance)
        for z in measurements:
            f.predict(linear(p.transition), p.process)
            assert f.update(z, linear(p.rows), p.noise) == EstimationStatus.OK
        assert np.abs(f.state - found.states[-1]).max() < 1e-11
        assert np.abs(f.covariance - found.covariances[-1]).max() < 1e-11
        assert abs(f.square - found.squares[-1]) < 1e-9
        nothing = np.full(len(p.rows), np.nan)
        assert f.update(nothing, linear(p.rows), p.noise) == EstimationStatus.SKIPPED


def test_unscented_moments_of_a_square() -> None:
    """For a Gaussian x, x^2 has the mean m^2 + s^2 and the variance 4 m^2 s^2 + 2 s^4."""
    m, s = 1.5, 0.7
    f = UnscentedKalmanFilter([m], [[s**2]])
    f.predict(lambda x: x**2, [[0.0]])
    assert abs(f.state[0] - (m**2 + s**2)) < 1e-14
    assert abs(f.covariance[0, 0] - (4 * m**2 * s**2 + 2 * s**4)) < 1e-13
    # A singular covariance has no points in some directions.
    f = UnscentedKalmanFilter([1.0, 2, 3], np.ones((3, 3)))
    f.predict(lambda x: x @ np.diag([1.0, 2, 3]), np.zeros((3, 3)))
    assert np.abs(f.covariance - np.outer([1, 2, 3], [1, 2, 3])).max() < 1e-13


def test_unscented_filter_of_far_bearings(rng: np.random.Generator) -> None:
    """Range and bearing across the cut of the angle, where the mean range is not that of the mean: errors as stated."""
    sigma = np.array([0.1, 0.1])

    def expected(x: Reals) -> Reals:
        return np.stack([np.hypot(x[:, 0], x[:, 1]), np.arctan2(x[:, 1], x[:, 0])], 1)

    def difference(a: Reals, b: Reals) -> Reals:
        change = a - b
        return np.stack([change[..., 0], np.angle(np.exp(1j * change[..., 1]))], -1)

    squares = []
    for _ in range(200):
        start, spread = np.array([-3.0, 0.0]), np.diag([0.1, 0.1])
        x = start + np.sqrt(np.diag(spread)) * rng.normal(size=2)
        f = UnscentedKalmanFilter(start, spread)
        for _ in range(5):
            z = expected(x[None])[0] + sigma * rng.normal(size=2)
            assert f.update(z, expected, np.diag(sigma**2), difference=difference) == EstimationStatus.OK
        off = x - f.state
        squares.append(off @ np.linalg.solve(f.covariance, off))
    low, high = chi2.interval(0.999, 2 * len(squares))
    assert low < sum(squares) < high
    with pytest.raises(ValueError, match=r"expected: returned shape \(5,\); expected \(5, 1\), a row for each state"):
        f.update([1.0], lambda x: x[:, 0], [[1.0]])
    assert f.update([1.0], lambda x: np.nan * x[:, :1], [[1.0]]) == EstimationStatus.NOT_CONVERGED
    with pytest.raises(ValueError, match="noise"):
        f.update([1.0], lambda x: x[:, :1], [[np.nan]])


def _falling(
    rng: np.random.Generator, n: int, noise: float, gravity: float
) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Heights of n balls of which 40 are measured, as (n, 40, 1), and the system of a ball without gravity."""
    move = np.array([[1, 0.05, 0.00125], [0, 1, 0.05], [0, 0, 1]])
    process = 1e-4 * np.eye(3)
    state, heights = rng.normal(size=(n, 3)), []
    for _ in range(40):
        state = state @ move.T + 1e-2 * rng.normal(size=(n, 3)) - [0, 0.05 * gravity, 0]
        heights.append(state[:, :1] + 0.1 * noise * rng.normal(size=(n, 1)))
    return (np.zeros((n, 3)), np.eye(3), move, process, np.eye(3)[:1], [[0.01]]), np.stack(heights, 1)


@pytest.mark.parametrize(("noise", "gravity", "kept"), [(1.0, 0.0, True), (2.0, 0.0, False), (1.0, 9.8, False)])
def test_recordings_that_contradict_the_model_are_inconsistent(noise: float, gravity: float, kept: bool) -> None:
    """The sum of squared innovations is compared with scipy's distribution for each of 300 filters."""
    system, heights = _falling(np.random.default_rng(8), 300, noise, gravity)
    own = KalmanFilter(*system)
    found = own.run(heights)
    expected = found.squares.sum(-1) > chi2.isf(1e-3, 40)
    assert np.array_equal(own.status == EstimationStatus.INCONSISTENT, expected)
    assert expected.sum() <= 3 if kept else expected.sum() >= 290
    # One filter alone says the same.
    alone = KalmanFilter(system[0][0], *system[1:])
    alone.run(heights[0])
    assert alone.status == own.status[0]


def test_a_measurement_far_from_the_prediction_is_inconsistent() -> None:
    system, heights = _falling(np.random.default_rng(9), 2, 1.0, 0.0)
    own = KalmanFilter(*system)
    own.run(heights)
    own.predict()
    own.update(own.state[:, :1] + np.array([[0.0], [5.0]]))
    assert own.status.tolist() == [EstimationStatus.OK, EstimationStatus.INCONSISTENT]
    gated = KalmanFilter(*system, gate=10.8)
    heights[:, 5:35] += np.array([[[0.0]], [[60.0]]])
    gated.run(heights)
    assert gated.status.tolist() == [EstimationStatus.OK, EstimationStatus.INCONSISTENT]


def test_far_measurements_contradict_nonlinear_filters() -> None:
    """The distance of a place that is known to 0.1, which is measured to 0.1: 0.3 off, and 3 off."""
    for off, status in ((0.3, EstimationStatus.OK), (3.0, EstimationStatus.INCONSISTENT)):
        extended, unscented = (
            kind([3.0, 4.0], 0.01 * np.eye(2)) for kind in (ExtendedKalmanFilter, UnscentedKalmanFilter)
        )
        distance = np.array([5.0 + off])
        extended.update(distance, lambda x: (np.hypot(*x)[None], x[None] / np.hypot(*x)), [[0.01]])
        unscented.update(distance, lambda x: np.hypot(x[:, :1], x[:, 1:]), [[0.01]])
        assert extended.status == unscented.status == status
