"""Refinement to points, planes and lines, and its covariance beside simulations."""

import numpy as np
import pytest

from algorithms.registration import refine
from generated import pga3


def small_motor(rng, size):
    return pga3.motor_exponential(size * rng.normal(size=6))


@pytest.mark.parametrize("to", ["points", "planes", "lines"])
def test_exact_data_give_the_motor(to):
    rng = np.random.default_rng(1)
    target = 10 * rng.random((200, 3))
    directions = rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    motor = small_motor(rng, 0.01)
    source = pga3.move_point(pga3.motor_inverse(motor), target)
    found = refine(source, target, np.eye(8)[0], 1.0, to=to, directions=directions)
    assert np.abs(found.motor - motor).max() < 1e-9 and found.inliers.all() and found.residual < 1e-8


@pytest.mark.parametrize("to", ["points", "planes", "lines"])
def test_covariance_is_that_of_simulations(to):
    """The mean of normalised squared errors of six unknowns is about 6: robust weights lose a little."""
    rng = np.random.default_rng(2)
    target = 10 * rng.random((60, 3))
    directions = rng.normal(size=(60, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    squares = []
    for _ in range(25):
        motor = small_motor(rng, 0.002)
        noisy = target + 0.02 * rng.normal(size=target.shape)
        source = pga3.move_point(pga3.motor_inverse(motor), noisy)
        found = refine(source, target, np.eye(8)[0], 0.6, to=to, directions=directions)
        off = pga3.motor_logarithm(pga3.motor_product(motor, pga3.motor_inverse(found.motor)))
        squares.append(off @ np.linalg.solve(found.covariance, off))
    assert 4.5 < np.mean(squares) < 9


def test_lines_without_directions_are_refused():
    with pytest.raises(ValueError, match="directions"):
        refine(np.zeros((30, 3)), np.eye(3), np.eye(8)[0], 1.0, to="lines")


def test_degenerate_targets_and_gates_are_named():
    source = np.random.default_rng(3).normal(size=(30, 3))
    still = np.eye(8)[0]
    for target in (np.zeros((0, 3)), np.zeros((1, 3))):
        with pytest.raises(ValueError, match=r"target: \d points; expected at least two"):
            refine(source, target, still, 1.0)
    for pair, name in (((source[None], source), "source"), ((source, source[None]), "target")):
        with pytest.raises(ValueError, match=rf"{name}: shape \(1, 30, 3\)"):
            refine(*pair, still, 1.0)
    with pytest.raises(ValueError, match="target: coordinates up to"):
        refine(source, 1e200 * source, still, 1.0)
    for gate in (0.0, np.nan):
        with pytest.raises(ValueError, match="gate"):
            refine(source, source, still, gate)


@pytest.mark.filterwarnings("error")
def test_a_target_whose_points_mostly_coincide_has_weights():
    source = np.random.default_rng(4).normal(size=(40, 3))
    target = np.concatenate([source, np.zeros((80, 3)) + source[0]])
    assert np.allclose(refine(source, target, np.eye(8)[0], 0.1, to="points").motor, np.eye(8)[0])
