"""Filters whose innovations contradict their noise over several updates, or that gave up an estimate."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import norm

from algorithms.arguments import Reals
from algorithms.estimation import EstimationStatus, MotorFilter, RotorFilter
from algorithms.evidence.gates import LATELY, Record
from generated import pga3


def test_odds_are_the_largest_likelihood_ratio_of_twice_the_variance() -> None:
    rng = np.random.default_rng(1)
    record, contradicted = Record(), []
    innovations = rng.normal(0, 1, 40) * np.where(np.arange(40) < 20, 1, 1.8)
    ratios = norm.logpdf(innovations, scale=np.sqrt(2)) - norm.logpdf(innovations)
    for each in innovations:
        contradicted.append(record.add(each**2, 1, 1))
    sums = [max(ratios[k : n + 1].sum() for k in range(n + 1)) for n in range(40)]
    assert contradicted == [each > np.log(1000) for each in sums] and contradicted[-1] and not contradicted[19]


def test_right_innovations_are_contradicted_at_most_once_in_a_thousand() -> None:
    rng = np.random.default_rng(2)
    found = 0
    for _ in range(2000):
        record = Record()
        found += [record.add(each, 2, 1) for each in rng.chisquare(2, 50)][-1]
    # The expected number is at most 2; 9 or more have a probability of 2e-4.
    assert found < 9


def test_another_estimate_needs_as_many_measurements_as_the_one_before() -> None:
    record = Record()
    for _ in range(5):
        assert not record.add(2.0, 3, 1)
    record.begin()
    record.give_up()
    assert [record.again(2.0 * n, 3 * n, n) for n in (3, 4, 5)] == [True, True, False]
    for _ in range(100):
        record.add(2.0, 3, 1)
    record.begin()
    record.give_up()
    assert [record.again(2.0 * n, 3 * n, n) for n in (LATELY - 1, LATELY)] == [True, False]


def vectors(rng: np.random.Generator, truth: Rotation, factor: float) -> tuple[Reals, Reals]:
    model = rng.normal(size=(3, 3))
    model /= np.linalg.norm(model, axis=1)[:, None]
    return model, truth.apply(model) + factor * 0.03 * rng.normal(size=(3, 3))


def test_rotor_filters_with_more_noise_than_stated_or_a_rotation_that_they_do_not_know() -> None:
    rng = np.random.default_rng(3)
    for factor, step in ((1.0, 0.0), (1.5, 0.0), (1.0, 0.03)):
        found, axis = [], rng.normal(size=3)
        for _ in range(6):
            truth, f = Rotation.identity(), RotorFilter([1.0, 0, 0, 0], 0.01 * np.eye(3))
            for _ in range(30):
                truth = Rotation.from_rotvec(step * axis / np.linalg.norm(axis)) * truth
                f.update(*vectors(rng, truth, factor), 0.03)
            found.append(f.status)
        expected = EstimationStatus.OK if (factor, step) == (1.0, 0.0) else EstimationStatus.INCONSISTENT
        assert found == [expected] * 6


def test_motor_filters_of_two_structures_are_not_sure_of_the_smaller_one() -> None:
    rng = np.random.default_rng(4)
    wrong = 0
    for _ in range(20):
        truth, other = (pga3.motor_exponential(rng.normal(size=6)) for _ in range(2))
        f = MotorFilter(truth, 0.01 * np.eye(6), gate=16.3)
        for _ in range(12):
            model = rng.normal(size=(5, 3))
            seen = np.asarray(pga3.move_point(truth, model)) + 0.01 * rng.normal(size=(5, 3))
            moved = np.asarray(pga3.move_point(other, model))
            f.update_points(model, np.where(rng.random((5, 1)) < 0.35, moved, seen), 0.01)
        error = pga3.motor_product(truth, pga3.motor_inverse(f.motor))
        wrong += f.status == EstimationStatus.OK and abs(error[0]) < np.cos(0.05)
    assert wrong == 0
