"""Graphs of poses: derivatives, exact graphs, scipy's dense minimum, wrong closures, and degenerate graphs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import chi2

from algorithms.arguments import Reals
from algorithms.mapping.g2o import read_g2o
from algorithms.mapping.pose_graph import GraphStatus, optimise_poses
from generated import line_maps, pga2, pga3

KILLIAN = Path(__file__).parents[1] / "data" / "maps" / "killian_start.g2o.gz"


def motors(poses: Reals) -> Reals:
    return np.asarray(pga2.motor_from_angle_translation(poses[..., 2], poses[..., :2]))


def matrices(poses: Reals) -> Reals:
    """Homogeneous matrices by numpy alone."""
    c, s, o, i = np.cos(poses[..., 2]), np.sin(poses[..., 2]), np.zeros(poses.shape[:-1]), np.ones(poses.shape[:-1])
    return np.stack([np.stack(row, -1) for row in ((c, -s, poses[..., 0]), (s, c, poses[..., 1]), (o, o, i))], -2)


def by_numpy(poses: Reals, edges: Reals, motions: Reals) -> Reals:
    """Misfits (m, 3): angle, x, y."""
    first, second, motion = matrices(poses[edges[:, 0]]), matrices(poses[edges[:, 1]]), matrices(motions)
    misfit = np.linalg.inv(motion) @ np.linalg.inv(first) @ second
    return np.stack([np.arctan2(misfit[:, 1, 0], misfit[:, 0, 0]), misfit[:, 0, 2], misfit[:, 1, 2]], -1)


@pytest.fixture
def loop() -> tuple[Reals, Reals, Reals, Reals]:
    """True poses on two rounds of a square, edges between neighbours and rounds, their motions, and information."""
    rng = np.random.default_rng(4)
    steps = np.tile([[1.0, 0, 0]] * 4 + [[1.0, 0, np.pi / 2]], (8, 1))
    chain = [np.eye(3)]
    for step in steps[:-1]:
        chain.append(chain[-1] @ matrices(step))
    poses = np.array([[m[0, 2], m[1, 2], np.arctan2(m[1, 0], m[0, 0])] for m in chain])
    n = len(poses)
    edges = np.array([(k, k + 1) for k in range(n - 1)] + [(k, k + 20) for k in range(0, n - 20, 4)])
    relative = np.linalg.inv(matrices(poses[edges[:, 0]])) @ matrices(poses[edges[:, 1]])
    motions = np.stack([relative[:, 0, 2], relative[:, 1, 2], np.arctan2(relative[:, 1, 0], relative[:, 0, 0])], -1)
    random = rng.normal(size=(len(edges), 3, 3))
    return poses, edges, motions, random @ random.transpose(0, 2, 1) + 100 * np.eye(3)


def test_misfit_is_that_of_matrices() -> None:
    rng = np.random.default_rng(0)
    poses, motions = rng.normal(size=(6, 3)), rng.normal(size=(3, 3))
    edges = np.arange(6).reshape(3, 2)
    misfit, _, _ = line_maps.edge_of_poses(motors(poses[edges[:, 0]]), motors(poses[edges[:, 1]]), motors(motions))
    assert np.allclose(misfit, by_numpy(poses, edges, motions), atol=1e-12)


def test_derivatives_are_differences() -> None:
    rng = np.random.default_rng(1)
    a, b, motion = motors(rng.normal(size=(3, 3)))
    _, by_a, by_b = line_maps.edge_of_poses(a, b, motion)
    step = 1e-6
    for k in range(3):
        turn = pga2.motor_from_angle_translation(step * (k == 0), step * np.array([k == 1, k == 2]))
        moved_a = line_maps.edge_of_poses(pga2.motor_product(a, turn), b, motion)[0]
        moved_b = line_maps.edge_of_poses(a, pga2.motor_product(b, turn), motion)[0]
        start = line_maps.edge_of_poses(a, b, motion)[0]
        assert np.allclose((moved_a - start) / step, by_a[:, k], atol=1e-5)
        assert np.allclose((moved_b - start) / step, by_b[:, k], atol=1e-5)


def test_exact_graph_from_a_wrong_start(loop: tuple[Reals, Reals, Reals, Reals]) -> None:
    poses, edges, motions, information = loop
    start = poses + np.random.default_rng(2).normal(size=poses.shape) * [0.3, 0.3, 0.2]
    start[0] = poses[0]
    found = optimise_poses(motors(start), edges, motors(motions), information)
    assert found.status == GraphStatus.OK and found.cost < 1e-16
    assert np.allclose(np.asarray(pga2.motor_to_angle_translation(found.motors)[1]), poses[:, :2], atol=1e-9)
    # Opposite motors are the same poses.
    signs = np.where(np.arange(len(start)) % 2, 1.0, -1.0)[:, None]
    other = optimise_poses(signs * motors(start), edges, -motors(motions), information)
    assert np.allclose(pga2.motor_to_angle_translation(other.motors)[1], poses[:, :2], atol=1e-9)


def test_minimum_is_that_of_scipy(loop: tuple[Reals, Reals, Reals, Reals]) -> None:
    """A dense Levenberg-Marquardt of scipy, with misfits of numpy, finds the same minimum of a graph with noise."""
    poses, edges, motions, information = loop
    noisy = motions + 0.03 * np.random.default_rng(3).normal(size=motions.shape)
    root = np.linalg.cholesky(information)

    def residuals(free: Reals) -> Reals:
        moved = np.concatenate([poses[:1], free.reshape(-1, 3)])
        return np.einsum("mji,mj->mi", root, by_numpy(moved, edges, noisy)).ravel()

    truth = least_squares(residuals, poses[1:].ravel(), xtol=1e-12, ftol=1e-12)
    found = optimise_poses(motors(poses), edges, motors(noisy), information)
    assert found.status == GraphStatus.OK
    assert found.cost == pytest.approx(truth.cost, rel=1e-9)
    places = pga2.motor_to_angle_translation(found.motors)[1]
    assert np.allclose(places[1:], truth.x.reshape(-1, 3)[:, :2], atol=1e-5)


def test_wrong_closures_have_little_influence(loop: tuple[Reals, Reals, Reals, Reals]) -> None:
    poses, edges, motions, information = loop
    wrong = np.array([[2, 17], [5, 30]])
    all_edges, all_motions = np.concatenate([edges, wrong]), np.concatenate([motions, [[0.2, 0.1, 0], [0, 0, 1.0]]])
    weights = np.concatenate([information, information[:2]])
    robust = all_edges[:, 1] != all_edges[:, 0] + 1
    found = optimise_poses(motors(poses), all_edges, motors(all_motions), weights, robust)
    assert np.abs(pga2.motor_to_angle_translation(found.motors)[1] - poses[:, :2]).max() < 0.02
    assert (found.weights[-2:] < 0.01).all() and (found.weights[:-2] > 0.9).all()
    trusting = optimise_poses(motors(poses), all_edges, motors(all_motions), weights)
    assert np.abs(pga2.motor_to_angle_translation(trusting.motors)[1] - poses[:, :2]).max() > 0.3


def test_long_loop_is_closed_by_one_robust_edge() -> None:
    """A chain that has drifted by metres is closed, though the misfit of its closure is hundreds of deviations."""
    n = 100
    poses = np.stack([np.cos(t := np.linspace(0, 2 * np.pi, n)), np.sin(t), t + np.pi / 2], 1) * [10, 10, 1]
    edges = np.stack([np.arange(n - 1), np.arange(1, n)], 1)
    exact = np.linalg.inv(matrices(poses[:-1])) @ matrices(poses[1:])
    motions = np.stack([exact[:, 0, 2], exact[:, 1, 2], np.arctan2(exact[:, 1, 0], exact[:, 0, 0])], -1)
    motions[:, 2] += 0.004
    start = [motors(poses[0])]
    for motion in motors(motions):
        start.append(pga2.motor_product(start[-1], motion))
    assert np.abs(pga2.motor_to_angle_translation(start[-1])[1] - poses[-1, :2]).max() > 3
    weights = np.concatenate([np.tile(np.diag([1e4, 1e4, 1e4]), (n - 1, 1, 1)), np.diag([1e4, 1e4, 1e4])[None]])
    all_edges = np.concatenate([edges, [[0, n - 1]]])
    all_motions = np.concatenate([motors(motions), motors(np.zeros((1, 3)))])
    found = optimise_poses(np.array(start), all_edges, all_motions, weights, all_edges[:, 1] - all_edges[:, 0] > 1)
    assert found.weights[-1] > 0.5
    assert np.abs(pga2.motor_to_angle_translation(found.motors)[1] - poses[:, :2]).max() < 0.3


def test_graph_of_killian_court_from_its_chain() -> None:
    """Chained motions drift by more than half a metre; with the closures, the poses are those of the file."""
    graph = read_g2o(KILLIAN)
    of_edge = {tuple(edge): motion for edge, motion in zip(graph.edges.tolist(), motors(graph.motions), strict=True)}
    chain = [motors(graph.poses[0])]
    for k in range(len(graph.poses) - 1):
        chain.append(pga2.motor_product(chain[-1], of_edge[k, k + 1]))
    information = graph.information[:, [2, 0, 1]][:, :, [2, 0, 1]]
    found = optimise_poses(np.array(chain), graph.edges, motors(graph.motions), information)
    unlinked = optimise_poses(np.array(chain), graph.edges[:0], np.zeros((0, 4)), information[:0])
    assert found.status == GraphStatus.OK and unlinked.status == GraphStatus.DISCONNECTED
    before, after = (np.abs(line_maps.edge_of_poses(
        each[graph.edges[:, 0]], each[graph.edges[:, 1]], motors(graph.motions))[0]).max()
        for each in (np.array(chain), found.motors))  # fmt: skip
    assert after < 0.25 * before


def test_degenerate_graphs() -> None:
    nothing = optimise_poses(np.zeros((0, 4)), np.zeros((0, 2), int), np.zeros((0, 4)), np.zeros((0, 3, 3)))
    assert nothing.status == GraphStatus.OK and nothing.motors.shape == (0, 4)
    one = optimise_poses(np.eye(4)[:1], np.zeros((0, 2), int), np.zeros((0, 4)), np.zeros((0, 3, 3)))
    assert one.status == GraphStatus.OK and np.array_equal(one.motors, np.eye(4)[:1])
    apart = optimise_poses(
        motors(np.array([[0.0, 0, 0], [1, 0, 0], [5, 5, 1]])), np.array([[0, 1]]), motors(np.array([[2.0, 0, 0]])),
        np.eye(3)[None],
    )  # fmt: skip
    assert apart.status == GraphStatus.DISCONNECTED
    places = np.asarray(pga2.motor_to_angle_translation(apart.motors)[1])
    assert places == pytest.approx(np.array([[0, 0], [2, 0], [5, 5]]))


@pytest.mark.parametrize(
    ("edges", "match"),
    [([[0, 3]], "expected 0 to 1"), ([[0.0, 1.0]], "expected .m, 2. integers"), ([[0, 1, 2]], "expected .m, 2.")],
)
def test_wrong_edges(edges: list[list[float]], match: str) -> None:
    with pytest.raises(ValueError, match=match):
        optimise_poses(np.eye(4)[[0, 0]], edges, np.eye(4)[:1], np.eye(3)[None])


def walk_with_closures(seed: int, n_wrong: int) -> tuple[Reals, ...]:
    """Three times around a square of 10 m, by odometry, with 30 closures between the rounds, and wrong ones."""
    rng = np.random.default_rng(seed)
    count, sigma = 120, np.array([0.02, 0.05, 0.05])
    k = np.arange(count)
    side, along = k // 10 % 4, k % 10
    corners = np.array([[0, 0], [10, 0], [10, 10], [0, 10.0]])
    headings = side * np.pi / 2
    places = corners[side] + along[:, None] * np.stack([np.cos(headings), np.sin(headings)], 1)
    truth = pga2.motor_from_angle_translation(headings, places)
    later = rng.integers(40, count, 30)
    closures = np.stack([later - 40 * rng.integers(1, later // 40 + 1), later], 1)
    wrong = np.sort(np.array([rng.permutation(count)[:2] for _ in range(n_wrong)], int).reshape(-1, 2), 1)
    edges = np.concatenate([np.stack([k[:-1], k[1:]], 1), closures, wrong])
    motions = pga2.motor_product(pga2.motor_inverse(truth[edges[:, 0]]), truth[edges[:, 1]])
    noise = sigma * rng.normal(size=(len(edges), 3))
    motions = np.asarray(pga2.motor_product(motions, pga2.motor_from_angle_translation(noise[:, 0], noise[:, 1:])))
    if n_wrong:
        off = rng.uniform([-np.pi, -2, -2], [np.pi, 2, 2], (n_wrong, 3))
        motions[-n_wrong:] = pga2.motor_from_angle_translation(off[:, 0], off[:, 1:])
    start = [truth[0]]
    for motion in motions[: count - 1]:
        start.append(np.asarray(pga2.normalize_motor(pga2.motor_product(start[-1], motion))))
    return np.array(start), edges, motions, np.tile(np.diag(1 / sigma**2), (len(edges), 1, 1)), truth


@pytest.mark.parametrize("seed", range(4))
def test_a_third_of_the_closures_is_wrong(seed: int) -> None:
    """The poses are near to those by the right closures alone, and the wrong ones have no weight."""
    start, edges, motions, information, _ = walk_with_closures(seed, 13)
    best = optimise_poses(start, edges[:-13], motions[:-13], information[:-13])
    found = optimise_poses(start, edges, motions, information, np.arange(len(edges)) >= 119)
    assert found.status == GraphStatus.OK and (found.weights[-13:] < 0.25).all()
    places = [pga2.motor_to_angle_translation(each)[1] for each in (best.motors, found.motors)]
    assert np.linalg.norm(places[0] - places[1], axis=1).max() < 0.3


def test_closures_that_contradict_each_other() -> None:
    """If most robust edges are wrong, the status says so."""
    start, edges, motions, information, _ = walk_with_closures(5, 40)
    found = optimise_poses(start, edges, motions, information, np.arange(len(edges)) >= 119)
    assert found.status != GraphStatus.OK


@pytest.mark.parametrize("partial", [False, True])
def test_misfits_larger_than_stated_are_inconsistent(loop: tuple[Reals, Reals, Reals, Reals], partial: bool) -> None:
    """The cost reaches its quantile of the chi-square distribution if the information is that of too little noise.

    Partial closures measure no angle.
    """
    poses, edges, motions, information = loop
    closures = edges[:, 1] != edges[:, 0] + 1
    if partial:
        information[closures, 0], information[closures, :, 0] = 0, 0
    noisy = motions + 0.02 * np.random.default_rng(11).normal(size=motions.shape)
    cost = optimise_poses(motors(poses), edges, motors(noisy), information).cost
    limit = float(chi2.isf(1e-3, (2 if partial else 3) * closures.sum()))
    for factor, status in ((0.97, GraphStatus.OK), (1.03, GraphStatus.INCONSISTENT)):
        # By least squares, the poses do not depend on a common factor.
        scaled = factor * limit / (2 * cost) * information
        assert optimise_poses(motors(poses), edges, motors(noisy), scaled).status == status


def test_a_wrong_edge_or_a_biased_gyroscope_contradicts_a_graph() -> None:
    for seed in range(5):
        start, edges, motions, information, _ = walk_with_closures(20 + seed, 0)
        assert optimise_poses(start, edges, motions, information).status == GraphStatus.OK
        turned = pga2.motor_from_angle_translation(np.where(edges[:, 1] == edges[:, 0] + 1, 0.05, 0.0), np.zeros(2))
        wrong = motions.copy()
        wrong[-1] = pga2.motor_product(wrong[-1], pga2.motor_from_angle_translation(0.4, np.array([0.5, 0.5])))
        for contradicting in (np.asarray(pga2.motor_product(motions, turned)), wrong):
            assert optimise_poses(start, edges, contradicting, information).status == GraphStatus.INCONSISTENT


@pytest.mark.parametrize("in_space", [False, True])
def test_copies_of_edges_carry_no_information(in_space: bool) -> None:
    """Covariances and the test of misfits are those of different edges; there are misfits of all of them."""
    rng = np.random.default_rng(31)
    n, k, module = 12, 6 if in_space else 3, pga3 if in_space else pga2
    create = pga3.motor_from_rotation_vector_translation if in_space else pga2.motor_from_angle_translation
    step = create([0.0, 0, 0.3], [1.0, 0, 0]) if in_space else create(0.3, [1.0, 0])
    poses = [np.eye(len(step))[0]]
    for _ in range(n - 1):
        poses.append(np.asarray(module.motor_product(poses[-1], step)))
    truth, edges = np.array(poses), np.array([(a, b) for a in range(n) for b in range(a + 1, min(a + 3, n))])
    noise = 0.01 * rng.normal(size=(len(edges), k))
    moved = create(noise[:, :3], noise[:, 3:]) if in_space else create(noise[:, 0], noise[:, 1:])
    first, second = truth[edges[:, 0]], truth[edges[:, 1]]
    motions = module.motor_product(module.motor_product(module.motor_inverse(first), second), moved)
    information = np.tile(1e4 * np.eye(k), (len(edges), 1, 1))
    once = optimise_poses(truth, edges, motions, information, marginals=[n - 1])
    order = rng.permutation(np.tile(np.arange(len(edges)), 4))
    again = optimise_poses(truth, edges[order], motions[order], information[order], marginals=[n - 1])
    assert once.status == again.status == GraphStatus.OK
    np.testing.assert_allclose(again.covariances, once.covariances, rtol=1e-9)
    np.testing.assert_allclose(again.motors, once.motors, atol=1e-10)
    np.testing.assert_allclose(again.misfits, once.misfits[order], atol=1e-10)
    assert again.cost == pytest.approx(once.cost)
