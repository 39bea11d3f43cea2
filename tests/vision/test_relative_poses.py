"""Kernels of relative poses: five points, motions, distances and least squares, against closed forms and scipy."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from relative_scenes import K, cloud, essential, rotation, views
from scipy.spatial.transform import Rotation

from algorithms import vision
from algorithms.vision.relative_motions import essential_of_sets
from generated import pga3, relative_poses
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]
CENTRED = np.diag([800.0, 800.0, 1.0])
BACK = np.linalg.inv(CENTRED)
ALL = 1e20


def directions(sets: int, seed: int) -> tuple[Array, Array, Array]:
    """Return sets of five pairs of directions, and their essential matrices."""
    rng = np.random.default_rng(seed)
    scenes = [views(rng, cloud(rng, 5, 2, 9), angle=1.0, k=np.eye(3)) for _ in range(3 * sets)]
    scenes = [each for each in scenes if len(each.first) == 5][:sets]
    truth = np.array([essential(each.turn, each.shift) for each in scenes])
    return np.array([each.first for each in scenes]), np.array([each.second for each in scenes]), truth


def test_five_points_have_the_true_matrix_among_their_solutions() -> None:
    """At most ten; without iterations on the result, errors are those of a polynomial of degree ten."""
    first, second, truth = directions(400, 1)
    found, sets = essential_of_sets(first, second)
    assert np.bincount(sets, minlength=400).max() <= 10 and len(np.unique(sets)) == 400
    off = np.minimum(*(np.abs(found - sign * truth[sets]).max((1, 2)) for sign in (1, -1)))
    least = np.full(400, np.inf)
    np.minimum.at(least, sets, off)
    assert np.median(least) < 1e-12 and np.quantile(least, 0.9) < 1e-9 and (least < 1e-4).mean() > 0.99


def test_five_points_give_essential_matrices_that_fit() -> None:
    """The determinant, the trace constraint and the five equations hold, and the norm is that of unit translations."""
    first, second, _ = directions(200, 2)
    found, sets = essential_of_sets(first, second)
    square = found @ np.swapaxes(found, 1, 2)
    cubic = 2 * square @ found - np.trace(square, axis1=1, axis2=2)[:, None, None] * found
    x, y = (np.concatenate([each[sets], np.ones((len(sets), 5, 1))], 2) for each in (first, second))
    equations = np.einsum("mki,mij,mkj->mk", y, found, x) / np.linalg.norm(x, axis=2) / np.linalg.norm(y, axis=2)
    assert np.allclose((found**2).sum((1, 2)), 2, atol=1e-12)
    for values in (np.linalg.det(found), np.abs(cubic).max((1, 2)), np.abs(equations).max(1)):
        assert np.quantile(np.abs(values), 0.95) < 1e-9 and np.median(np.abs(values)) < 1e-12


def test_repeated_and_infinite_pairs_give_no_matrices() -> None:
    first, second, _ = directions(2, 3)
    first[0, 1], second[1, 2, 0] = np.nan, np.inf
    assert not len(essential_of_sets(first, second)[0])
    assert np.isfinite(essential_of_sets(np.zeros((1, 5, 2)), np.zeros((1, 5, 2)))[0]).all()


def test_four_motions_of_an_essential_matrix() -> None:
    """They have unit translations, one is the true one, and two have a rotation that is turned by half about it."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        turn, shift = rotation(rng.normal(size=3)), rng.normal(size=3)
        shift /= np.linalg.norm(shift)
        motors = np.array(relative_poses.motions_of_essential(essential(turn, shift)))
        found = pga3.motor_to_matrix(motors)
        half = 2 * np.outer(shift, shift) - np.eye(3)
        expected = [(turn, shift), (turn, -shift), (half @ turn, shift), (half @ turn, -shift)]
        for matrix, own in expected:
            off = np.abs(found[:, :3, :3] - matrix).max((1, 2)) + np.abs(found[:, :3, 3] - own).max(1)
            assert off.min() < 1e-12
        again = np.array(relative_poses.essential_of_motion(motors))
        assert np.minimum(*(np.abs(again - s * essential(turn, shift)).max((1, 2)) for s in (1, -1))).max() < 1e-12


def residuals(step: Array, turn: Array, shift: Array, first: Array, second: Array) -> Array:
    """Return signed Sampson distances of centred pixels after a step from a motion."""
    u, v = relative_poses.tangents_of_direction(shift)
    moved = shift + step[3] * u + step[4] * v
    matrix = BACK.T @ essential(rotation(step[:3]) @ turn, moved / np.linalg.norm(moved)) @ BACK
    x, y = (np.concatenate([each, np.ones((len(each), 1))], 1) for each in (first, second))
    line, other = x @ matrix.T, y @ matrix
    return np.asarray((y * line).sum(1) / np.sqrt((line[:, :2] ** 2).sum(1) + (other[:, :2] ** 2).sum(1)))


def test_least_squares_and_information_are_those_of_scipy() -> None:
    rng = np.random.default_rng(5)
    scene = views(rng, cloud(rng, 40), noise=0.5)
    first, second = scene.first - K[:2, 2], scene.second - K[:2, 2]
    near = rotation(np.array([0.02, -0.01, 0.03])) @ scene.turn
    start = pga3.motor_from_matrix(np.block([[near, scene.shift[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]]))
    motor, triangle, (cost, converged, _) = relative_poses.descend_motion(start, BACK, BACK, first, second, ALL, 50.0)
    matrix = pga3.motor_to_matrix(motor)
    arguments = matrix[:3, :3], matrix[:3, 3], first, second
    best = scipy.optimize.least_squares(residuals, np.zeros(5), args=arguments, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert converged and np.isclose(cost, 2 * best.cost, rtol=1e-10) and np.abs(best.x).max() < 1e-6
    information = (best.jac.T @ best.jac)[np.triu_indices(5)]
    assert np.allclose(triangle, information, rtol=0, atol=1e-6 * np.abs(information).max())
    distances = residuals(np.zeros(5), *arguments)
    f = BACK.T @ essential(matrix[:3, :3], matrix[:3, 3]) @ BACK
    assert np.allclose(relative_poses.squared_distances(f, first, second), distances**2, atol=1e-12)
    assert np.isclose(relative_poses.truncated_squares(f, first, second, 0.2), np.minimum(distances**2, 0.2).sum())


def test_truncated_squares_are_not_moved_by_wrong_pairs() -> None:
    """Pairs beyond the limit change the cost by the limit each, and nothing else."""
    rng = np.random.default_rng(6)
    scene = views(rng, cloud(rng, 60), noise=0.3)
    first, second = scene.first - K[:2, 2], scene.second - K[:2, 2]
    whole = np.block([[scene.turn, scene.shift[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])
    start = pga3.motor_from_matrix(whole)
    good = relative_poses.descend_motion(start, BACK, BACK, first, second, 4.0, 50.0)
    f = BACK.T @ essential(scene.turn, scene.shift) @ BACK
    bad = rng.uniform(-200, 200, (40, 2, 2))
    bad = bad[relative_poses.squared_distances(f, bad[:, 0], bad[:, 1]) > 100]
    more = np.concatenate([first, bad[:, 0]]), np.concatenate([second, bad[:, 1]])
    all_pairs = relative_poses.descend_motion(start, BACK, BACK, *more, 4.0, 50.0)
    assert np.abs(all_pairs[0] - good[0]).max() < 1e-9
    assert np.isclose(all_pairs[2][0], good[2][0] + 4.0 * len(bad))


def test_pairs_behind_are_as_far_off_as_from_infinity() -> None:
    """The distance from points at infinity is that of the pair that a rotation explains, by scipy."""
    rng = np.random.default_rng(7)
    scene = views(rng, cloud(rng, 12), noise=0.5)
    first, second = scene.first - K[:2, 2], scene.second - K[:2, 2]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = scene.turn, scene.shift
    squares, far, points, in_front = relative_poses.explain_pairs(
        pga3.motor_from_matrix(matrix), BACK, BACK, CENTRED, first, second
    )
    assert in_front.all() and np.abs(points - scene.points).max() < 0.3
    homography = CENTRED @ scene.turn @ BACK
    for x, y, square in zip(first, second, far, strict=True):

        def gap(x_: Array, x: Array = x, y: Array = y) -> Array:
            moved = homography @ np.append(x_, 1)
            return np.concatenate([x_ - x, moved[:2] / moved[2] - y])

        assert np.isclose(square, 2 * scipy.optimize.least_squares(gap, x, xtol=1e-14).cost, rtol=0.02)
    assert (far > squares).all()
    matrix[:3, 3] *= -1
    _, _, _, in_front = relative_poses.explain_pairs(pga3.motor_from_matrix(matrix), BACK, BACK, CENTRED, first, second)
    assert not in_front.any()


@all_cases("n", [5, 8, 40])
def test_public_essential_matrices_and_their_motions(n: int) -> None:
    """The true matrix is one of them, and the true motion, with points in front, one of its four."""
    rng = np.random.default_rng([160, n])
    k, other = (
        np.array([[700.0, 0, 320], [0, 710, 240], [0, 0, 1]]),
        np.array([[500.0, 0, 300], [0, 500, 250], [0, 0, 1]]),
    )
    for _ in range(20):
        z = rng.uniform(4, 9, n)
        points = np.c_[rng.uniform(-0.4, 0.4, (n, 2)) * z[:, None], z]
        turn = Rotation.from_rotvec(0.2 * rng.normal(size=3)).as_matrix()
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        there = points @ turn.T + way
        pixels = [(p / p[:, 2:] @ m.T)[:, :2] for p, m in ((points, k), (there, other))]
        truth = np.cross(np.eye(3), -way) @ turn
        found = vision.essential_matrices(*pixels, k, other)
        signs = np.sign((found * truth).sum((1, 2)))[:, None, None]
        nearest = np.abs(signs * found - truth).max((1, 2)).argmin()
        assert np.allclose(signs[nearest] * found[nearest], truth, atol=1e-6)
        motions = pga3.motor_to_matrix(vision.motions_of_essential(-3 * found[nearest]))
        ahead = [(points @ m[:3, :3].T + m[:3, 3])[:, 2] for m in motions]
        off = np.abs(motions[:, :3] - np.c_[turn, way]).max((1, 2))
        assert off.min() < 1e-5 and (ahead[off.argmin()] > 0).all() and len(motions) == 4
    motions = vision.motions_of_essential(found)
    assert motions.shape == (len(found), 4, 8)
    for unit in (2.0**900, 2.0**-900):
        assert np.abs(vision.motions_of_essential(unit * found) - motions).max() < 1e-12
