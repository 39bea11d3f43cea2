"""Rotor filters on vectors: consistency, observability, and the linear form of the book beside the error state."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from algorithms.arguments import Reals
from algorithms.estimation import EstimationStatus, LinearRotorFilter, RotorFilter
from algorithms.estimation.rotor_starts import Beginning
from algorithms.precision import HUGE
from generated import vga3
from tests.support.selection import some_slow


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(6)


def rotation(rotor: Reals) -> Rotation:
    return Rotation.from_quat([-rotor[3], rotor[2], -rotor[1], rotor[0]])


def off(truth: Rotation, rotor: Reals) -> Reals:
    return np.asarray((truth * rotation(rotor).inv()).as_rotvec())


@pytest.mark.parametrize("n_runs", some_slow([200, 1000], 1000))
def test_errors_have_their_covariance(rng: np.random.Generator, n_runs: int) -> None:
    """Errors and innovations of all runs are in the 95 % band, while the sensor turns."""
    errors, innovations = [], []
    for _ in range(n_runs):
        start = vga3.rotor_exponential(rng.normal(size=3))
        truth = Rotation.from_rotvec(0.1 * rng.normal(size=3)) * rotation(start)
        f, g = RotorFilter(start, 0.01 * np.eye(3)), LinearRotorFilter(start, 0.0025 * np.eye(4))
        for _ in range(2):
            rate = rng.normal(size=3)
            truth = truth * Rotation.from_rotvec(0.1 * rate)
            f.predict(rate, 0.1)
            vectors = rng.normal(size=(2, 3))
            vectors /= np.linalg.norm(vectors, axis=1)[:, None]
            seen = truth.apply(vectors) + 0.02 * rng.normal(size=(2, 3))
            assert f.update(vectors, seen, 0.02) == EstimationStatus.OK
            innovations.append(f.innovation[0])
        x = off(truth, f.rotor)
        errors.append(x @ np.linalg.solve(f.covariance, x))
        g.update(vectors, seen, 0.02)
        assert abs(np.linalg.norm(g.rotor) - 1) < 1e-14 and abs(np.linalg.norm(f.rotor) - 1) < 1e-14
    low, high = chi2.interval(0.95, 3 * n_runs)
    assert low < sum(errors) < high
    low, high = chi2.interval(0.95, 6 * 2 * n_runs)
    assert low < sum(innovations) < high


@pytest.mark.slow
def test_linear_filter_of_the_book_converges(rng: np.random.Generator) -> None:
    """On the same vectors its errors are at most a little larger than those of the error-state filter."""
    ours, theirs = [], []
    for _ in range(200):
        start = vga3.rotor_exponential(rng.normal(size=3))
        truth = Rotation.from_rotvec(0.2 * rng.normal(size=3)) * rotation(start)
        f, g = RotorFilter(start, 0.04 * np.eye(3)), LinearRotorFilter(start, 0.01 * np.eye(4))
        for _ in range(10):
            vectors = rng.normal(size=(2, 3))
            vectors /= np.linalg.norm(vectors, axis=1)[:, None]
            seen = truth.apply(vectors) + 0.02 * rng.normal(size=(2, 3))
            f.update(vectors, seen, 0.02)
            g.update(vectors, seen, 0.02)
        ours.append(off(truth, f.rotor))
        theirs.append(off(truth, g.rotor))
    ratio = np.sqrt(np.mean(np.square(theirs)) / np.mean(np.square(ours)))
    assert 0.97 < ratio < 1.5


def test_status(rng: np.random.Generator) -> None:
    f = RotorFilter([1.0, 0, 0, 0], 0.01 * np.eye(3), gate=30.0)
    up = np.array([[0, 0, 1.0]])
    assert f.update(up, up, 0.01) == EstimationStatus.UNOBSERVED
    assert f.covariance[2, 2] == pytest.approx(0.01) and f.covariance[0, 0] < 2e-4
    assert f.update(np.eye(3), np.eye(3), 0.01) == EstimationStatus.OK
    assert f.update(np.eye(3), -np.eye(3), 0.01) == EstimationStatus.REJECTED
    assert f.update(up, up * np.nan, 0.01) == EstimationStatus.SKIPPED
    assert f.predict([0, 0, 1.0], -1.0) == EstimationStatus.BAD_TIME
    before = f.covariance
    assert f.predict([0, 0, 1.0], 10.0, 0.1) == EstimationStatus.OK
    assert np.allclose(f.covariance - before, np.eye(3), rtol=0, atol=1e-12)
    assert np.allclose(rotation(f.rotor).as_rotvec(), [0, 0, 10 - 4 * np.pi])
    assert RotorFilter([1.0, 0, 0, 0], -np.eye(3)).status == EstimationStatus.NOT_DEFINITE
    with pytest.raises(ValueError, match="expected one unit rotor"):
        RotorFilter([2.0, 0, 0, 0], np.eye(3))


def test_a_beginning_has_the_covariance_of_its_vectors(rng: np.random.Generator) -> None:
    """The rotation and the covariance of scipy, which minimizes the same sum without a prediction."""
    turn = Rotation.from_rotvec([2.0, -1.0, 0.5])
    vectors, deviations = rng.normal(size=(6, 3)), np.array([0.01, 0.02, 0.05, 0.2, 0.5, 1.0])
    seen = turn.apply(vectors) + deviations[:, None] * rng.normal(size=(6, 3))
    found = Beginning(np.eye(4)[0], 1e8 * np.eye(3), vectors, seen, deviations).best(HUGE)
    truth = least_squares(
        lambda w: ((Rotation.from_rotvec(w).apply(vectors) - seen) / deviations[:, None]).ravel(), turn.as_rotvec()
    )
    best = Rotation.from_rotvec(truth.x)
    assert np.abs(off(best, found.rotor)).max() < 1e-6
    axes = best.apply(vectors) / deviations[:, None]
    information = (axes**2).sum() * np.eye(3) - axes.T @ axes
    assert np.allclose(found.covariance @ information, np.eye(3), atol=1e-5)
    assert found.square == pytest.approx(2 * truth.cost, rel=1e-6)
