"""Votes against integrals by scipy and sums by numpy, spectra against LAPACK, and surfaces among outliers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial import cKDTree

from algorithms.registration import VoteStatus, estimate_normals, published_curvature, tensor_vote
from generated import tensor_voting, vga3
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]
Q = published_curvature(10.0)


def _vote(normal: Array, v: Array, q: float = Q) -> Array:
    """The vote of one stick at the offset v in units of sigma, by the text of the definition."""
    length = np.linalg.norm(v)
    sine = abs(normal @ v) / length
    if sine > np.sqrt(0.5):
        return np.zeros((len(v), len(v)))
    angle = np.arcsin(sine)
    arc = length if sine == 0 else angle * length / sine
    decay = np.exp(-(arc**2) - q * (2 * sine / length) ** 2)
    turned = normal - 2 * (normal @ v) * v / length**2
    return decay * np.outer(turned, turned)


def _integral(of: Any, kinks: list[float], low: float, high: float) -> float:
    points = [k for k in kinks if low < k < high]
    return float(quad(of, low, high, points=points, epsabs=1e-11, epsrel=1e-11, limit=400)[0])


def _ball(length: float) -> Array:
    """The vote of a ball along the first axis: an integral over the angle of normal and offset."""
    v = np.array([length, 0.0, 0.0])

    def of(angle: float) -> Array:
        turned = _vote(np.array([np.cos(angle), np.sin(angle), 0.0]), v)
        # The mean over turns about the offset.
        return np.array([turned[0, 0], turned[1, 1] / 2]) * 3 / 2 * np.sin(angle)

    edge = np.pi / 4
    return np.array([2 * _integral(lambda a, k=k: of(a)[k], [], edge, np.pi / 2) for k in range(2)])


def _plate(v: Array) -> Array:
    """The vote of a plate with the third axis as tangent: an integral over normals in the plane of the others."""

    def of(angle: float) -> Array:
        return _vote(np.array([np.cos(angle), np.sin(angle), 0.0]), v) / np.pi

    flat, length = np.hypot(v[0], v[1]), np.linalg.norm(v)
    start = np.arctan2(v[1], v[0])
    # Near the token, the vote has narrow peaks at the normals across the offset.
    kinks = [(start + s * np.pi / 2) % (2 * np.pi) for s in (-1, 1)]
    if flat > length * np.sqrt(0.5):
        half = np.arccos(length * np.sqrt(0.5) / flat)
        kinks += [(start + s * half + k * np.pi) % (2 * np.pi) for s in (-1, 1) for k in (0, 1)]
    return np.array(
        [[_integral(lambda a, i=i, j=j: of(a)[i, j], kinks, 0, 2 * np.pi) for j in range(3)] for i in range(3)]
    )


def test_a_stick_votes_for_the_normal_of_the_circle() -> None:
    radius, turn = 0.8, 0.6
    place, at = np.array([radius, 0, 0]), radius * np.array([np.cos(turn), np.sin(turn), 0])
    voted, decay = tensor_voting.stick_vote(np.array([1.0, 0, 0]), place, at, 0.5, Q)
    assert np.allclose(abs(voted @ at) / radius, 1, atol=1e-14)
    assert np.isclose(decay, np.exp(-((radius * turn / 0.5) ** 2) - Q * (0.5 / radius) ** 2), rtol=1e-13)
    assert np.allclose(voted, vga3.reflect_vector(np.array([1.0, 0, 0]), at - place), atol=1e-15)


@all_cases("length", [0.02, 0.1, 0.3, 0.7, 1.1, 2.9])
def test_a_ball_votes_by_the_integral(length: float) -> None:
    found = tensor_vote([[0.0, 0, 0]], sigma=1.0, at=[[length, 0, 0]], passes=1).tensors[0]
    along, across = _ball(length)
    assert np.allclose(found, np.diag([along, across, across]), atol=1e-7)


def test_ball_votes_agree_with_published_figures() -> None:
    # Monte Carlo integrals with 4e5 samples: the ratio of the vote along the offset to that across it.
    for sigma, length, ratio in ((5, 3, 0.373), (10, 5, 0.389)):
        found = tensor_vote(
            [[0.0, 0, 0]], sigma=sigma, at=[[length, 0, 0]], passes=1, curvature=published_curvature(sigma)
        )
        assert abs(found.tensors[0, 0, 0] / found.tensors[0, 1, 1] - ratio) < 2e-3


@pytest.mark.parametrize(
    "v",
    [
        (0.3, 0.2, 0.5), (0.5, 0.1, 0.05), (0.0, 0.0, 0.8), (0.9, 0.0, 0.0), (0.02, 0.03, 0.01), (0.0, 1e-4, 0.02),
        (-0.016, 0.028, 0.031), (3e-4, 0.0, 1e-3), (0.7, 0.1, 0.72), (1.2, 0.5, -2.4),
    ],
)  # fmt: skip
def test_a_plate_votes_by_the_integral(v: tuple[float, ...]) -> None:
    place = np.array(v)
    found = tensor_vote([[0.0, 0, 0]], tangents=[[0, 0, 1]], sigma=1.0, at=[place]).tensors[0]
    assert np.allclose(found, _plate(place), rtol=0, atol=1e-6)


def test_a_ball_of_the_plane_votes_by_the_integral() -> None:
    length = 0.6
    v = np.array([length, 0.0])
    parts = [(np.pi / 4, 3 * np.pi / 4), (5 * np.pi / 4, 7 * np.pi / 4)]
    want = [
        sum(_integral(lambda a, k=k: _vote(np.array([np.cos(a), np.sin(a)]), v)[k, k] / np.pi, [], *p) for p in parts)
        for k in range(2)
    ]
    found = tensor_vote([[0.0, 0]], sigma=1.0, at=[v], passes=1).tensors[0]
    assert np.allclose(found, np.diag(want), atol=1e-7)


@pytest.mark.parametrize("d", [2, 3])
def test_sums_of_sticks_agree_with_numpy(d: int) -> None:
    rng = np.random.default_rng(d)
    points, normals = rng.normal(size=(40, d)), rng.normal(size=(40, d))
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    want = np.zeros((40, d, d))
    for i in range(40):
        for j in range(40):
            v = (points[j] - points[i]) / 0.7
            if i != j and np.linalg.norm(v) <= 3:
                want[j] += _vote(unit[i], v)
    found = tensor_vote(points, normals=normals, sigma=0.7)
    assert np.allclose(found.tensors, want, atol=1e-12)
    assert np.allclose(found.eigenvalues, np.linalg.eigvalsh(want)[:, ::-1], atol=1e-12)


def test_spectra_agree_with_lapack() -> None:
    rng = np.random.default_rng(0)
    basis = np.linalg.qr(rng.normal(size=(300, 3, 3)))[0]
    values = rng.uniform(0, 1, (300, 3))
    values[:100, 1] = values[:100, 0]
    values[50:100, 2] = values[50:100, 0]
    values[100:200] *= [1, 1e-9, 1e-15]
    matrices = np.einsum("nik,nk,njk->nij", basis, values, basis)
    matrices = (matrices + matrices.transpose(0, 2, 1)) / 2
    found, axes = tensor_voting.spectrum(matrices[:, *np.triu_indices(3)])
    assert np.allclose(found, np.linalg.eigvalsh(matrices)[:, ::-1], atol=5e-15)
    assert np.allclose(axes @ axes.transpose(0, 2, 1), np.eye(3), atol=5e-15)
    assert np.allclose(np.einsum("nki,nk,nkj->nij", axes, found, axes), matrices, atol=1e-14)
    pairs, rows = tensor_voting.spectrum_in_plane(matrices[:, [0, 0, 1], [0, 1, 1]])
    assert np.allclose(pairs, np.linalg.eigvalsh(matrices[:, :2, :2])[:, ::-1], atol=5e-15)
    assert np.allclose(np.einsum("nki,nk,nkj->nij", rows, pairs, rows), matrices[:, :2, :2], atol=1e-14)


def test_votes_move_with_the_points() -> None:
    rng = np.random.default_rng(3)
    points = rng.normal(size=(300, 3))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    here, there = tensor_vote(points, sigma=0.4), tensor_vote(points @ turn.T + [1, -2, 3], sigma=0.4)
    size = here.eigenvalues.max()
    assert np.allclose(there.tensors, turn @ here.tensors @ turn.T, atol=1e-12 * size)
    assert np.allclose(there.surface, here.surface, atol=1e-12 * size)


def _auc(score: Array, truth: Array) -> float:
    rank = np.argsort(np.argsort(score)) + 1
    n = int(truth.sum())
    return float((rank[truth].sum() - n * (n + 1) / 2) / (n * (len(truth) - n)))


def _sphere(n: int, half: float, seed: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    on = rng.normal(size=(n, 3))
    on /= np.linalg.norm(on, axis=1, keepdims=True)
    return np.concatenate([on, rng.uniform(-half, half, (3 * n, 3))]), np.arange(4 * n) < n


@pytest.mark.parametrize(
    ("n", "half", "sigma", "area", "degrees"),
    [
        pytest.param(2500, 2, 0.15, 0.998, 0.8, marks=pytest.mark.slow),
        pytest.param(2500, 1.5, 0.2, 0.995, 1.0, marks=pytest.mark.slow),
        (1000, 1.5, 0.2, 0.99, 2.2),
    ],
)
def test_a_sphere_among_outliers(n: int, half: float, sigma: float, area: float, degrees: float) -> None:
    points, truth = _sphere(n, half, 1)
    found = tensor_vote(points, sigma=sigma)
    angle = np.degrees(np.arccos(np.minimum(np.abs((found.normals * points).sum(1)), 1)))[truth]
    assert _auc(found.surface, truth) >= area
    assert angle.mean() <= degrees


@pytest.mark.slow
def test_the_default_scale_reaches_the_sixteenth_neighbour() -> None:
    # On a grid of a plane in space, the neighbours 13 to 20 are at the distance sqrt(5); without noise, the scale is
    # the least one.
    grid = np.stack([*np.meshgrid(np.arange(40.0), np.arange(40.0)), np.zeros((40, 40))], -1).reshape(-1, 3)
    found = tensor_vote(grid, passes=1)
    assert np.array_equal(found.tensors, tensor_vote(grid, sigma=1.4 * (np.sqrt(5) / 3), passes=1).tensors)
    points, truth = _sphere(1000, 2, 0)
    sixteenth = cKDTree(points).query(points, 17)[0][:, 16]
    assert _auc(tensor_vote(points).surface, truth) > max(0.98, _auc(-sixteenth, truth))


def test_tokens_vote_relative_to_their_first_eigenvalue() -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    first = tensor_vote(points, sigma=0.4, passes=1)
    want = np.zeros((60, 2, 2))
    for i in range(60):
        large, small = first.eigenvalues[i]
        for j in range(60):
            v = (points[j] - points[i]) / 0.4
            if i != j and np.linalg.norm(v) <= 3:
                want[j] += (large - small) / large * _vote(first.normals[i], v, 2.0)
    assert np.allclose(tensor_vote(points, sigma=0.4, passes=2).tensors, want, atol=1e-12)


def test_degenerate_tokens_have_statuses() -> None:
    assert len(tensor_vote(np.zeros((0, 3)), sigma=1.0).status) == 0
    assert tensor_vote([[1, 2, 3]], sigma=1.0).status.tolist() == [VoteStatus.ISOLATED]
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [np.nan, 0, 0], [90, 0, 0]])
    points.setflags(write=False)
    found = tensor_vote(points, sigma=1)
    assert found.status[3:].tolist() == [VoteStatus.NOT_FINITE, VoteStatus.ISOLATED]
    assert (found.surface[3:] == 0).all() and (found.curve[:3] > 100 * found.surface[:3]).all()
    assert np.allclose(np.abs(found.tangents[:3, 0]), 1)
    assert (tensor_vote(np.arange(30).reshape(10, 3), sigma=0.001).status == VoteStatus.ISOLATED).all()
    same = tensor_vote(np.zeros((5, 3)), sigma=1.0)
    assert (same.status == VoteStatus.ISOLATED).all() and not same.tensors.any()
    alike = tensor_vote(np.repeat(np.random.default_rng(0).normal(size=(20, 2)), 2, axis=0), sigma=1.0)
    assert np.isfinite(alike.tensors).all()


@all_cases(
    "arguments, message",
    [
        (dict(points=np.zeros((3, 4)), sigma=1.0), "points: shape"),
        (dict(points=np.zeros((3, 3)), sigma=0.0), "sigma, curvature: 0.0"),
        (dict(points=np.zeros((3, 3)), sigma=np.nan), "sigma: nan"),
        (dict(points=np.zeros((3, 3)), normals=np.zeros((2, 3)), sigma=1.0), "normals: 2 rows"),
        (dict(points=np.zeros((3, 3)), passes=0, sigma=1.0), "passes: 0"),
    ],
)
def test_errors_name_the_argument(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        tensor_vote(**arguments)


@pytest.mark.parametrize("function", [tensor_vote, estimate_normals])
def test_points_whose_squares_overflow_are_rejected(function: Any) -> None:
    with pytest.raises(ValueError, match="points: coordinates up to"):
        function(1e200 * np.random.default_rng(8).normal(size=(60, 3)))
