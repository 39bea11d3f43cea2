"""Curves in space against closed forms, among as many outliers as points."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.sparse import coo_matrix, csgraph
from scipy.spatial import cKDTree

from algorithms.registration import Extremal, extract_curves
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]


def _circle(turn: Array) -> Array:
    return np.stack([np.cos(turn), np.sin(turn), 0 * turn], 1)


def _helix(turn: Array) -> Array:
    return np.stack([np.cos(2 * turn), np.sin(2 * turn), 0.3 * turn], 1)


def _line(turn: Array) -> Array:
    return (turn[:, None] / np.pi - 1) * [1, 0.3, -0.2]


def _trefoil(turn: Array) -> Array:
    return np.stack([np.sin(turn) + 2 * np.sin(2 * turn), np.cos(turn) - 2 * np.cos(2 * turn), -np.sin(3 * turn)], 1)


def _among_outliers(points: Array, rng: Any, share: float) -> Array:
    low, high = points.min(0) - 0.4, points.max(0) + 0.4
    return np.concatenate([points, rng.uniform(low, high, (int(share * len(points)), points.shape[1]))])


def _parts(found: Extremal) -> tuple[int, int]:
    """The numbers of polylines and of their ends, after checking that they do not branch."""
    n = len(found.vertices)
    count = np.bincount(found.pieces.ravel(), minlength=n)
    assert count.min() >= 1 and count.max() <= 2
    links = coo_matrix((np.ones(len(found.pieces)), found.pieces.T), shape=(n, n))
    return int(csgraph.connected_components(links, directed=False)[0]), int((count == 1).sum())


@pytest.mark.parametrize(
    ("curve", "n", "sigma", "ends", "share"),
    [
        (_circle, 300, 0.2, 0, 1),
        (_line, 150, 0.15, 2, 1),
        (_trefoil, 800, 0.3, 0, 0),
        *(
            pytest.param(*shape, marks=pytest.mark.slow)
            for shape in (
                *((_helix, 600, 0.2, 2, 1), (_helix, 600, 0.2, 2, 0)),
                *((_circle, 300, 0.2, 0, 0), (_line, 150, 0.15, 2, 0)),
            )
        ),
        pytest.param(_trefoil, 800, 0.3, 0, 1, marks=pytest.mark.slow),
    ],
)
def test_curves_are_single_polylines(curve: Any, n: int, sigma: float, ends: int, share: float) -> None:
    rng = np.random.default_rng(n)
    points = _among_outliers(curve(rng.uniform(0, 2 * np.pi, n)), rng, share)
    points.setflags(write=False)
    found = extract_curves(points, sigma=sigma)
    assert _parts(found) == (1, ends)
    dense = curve(np.linspace(0, 2 * np.pi, 50_001))
    away = cKDTree(dense).query(found.vertices)[0] / sigma
    assert np.median(away) < 0.004 and np.quantile(away, 0.95) < 0.015 and away.max() < 0.5
    assert cKDTree(found.vertices).query(dense)[0].max() < 1.5 * sigma
    steps = np.linalg.norm(found.vertices[found.pieces[:, 0]] - found.vertices[found.pieces[:, 1]], axis=1)
    assert steps.max() < sigma and (found.saliency > 0).all()


def test_two_planes_meet_in_a_curve() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (1000, 3))
    points[:500, 2] = points[500:, 0] = 0
    found = extract_curves(_among_outliers(points, rng, 0.5), sigma=0.2)
    away = np.hypot(found.vertices[:, 0], found.vertices[:, 2]) / 0.2
    assert _parts(found) == (1, 2) and np.median(away) < 0.06 and away.max() < 0.2
    assert np.ptp(found.vertices[:, 1]) > 1.7


def test_linked_rings_are_two_closed_curves() -> None:
    rng = np.random.default_rng(1)
    first, second = (_circle(rng.uniform(0, 2 * np.pi, 300)) for _ in range(2))
    found = extract_curves(np.concatenate([first, second[:, [0, 2, 1]] + [1, 0, 0]]), sigma=0.2)
    assert _parts(found) == (2, 0)
    x, y, z = found.vertices.T
    away = np.minimum(np.hypot(np.hypot(x, y) - 1, z), np.hypot(np.hypot(x - 1, z) - 1, y))
    assert away.max() < 0.01


def test_results_move_with_the_points() -> None:
    rng = np.random.default_rng(2)
    points = _helix(rng.uniform(0, 2 * np.pi, 200))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    here = extract_curves(points, sigma=0.2)
    there = extract_curves(1e3 * (points @ turn.T) + [5, -9, 7], sigma=200.0)
    moved = 1e3 * (here.vertices @ turn.T) + [5, -9, 7]
    # Places of vertices along the curve depend on rounding, those across it do not.
    assert cKDTree(moved).query(there.vertices)[0].max() < 50
    assert _parts(there) == _parts(here) == (1, 2)


def test_surfaces_and_noise_have_no_curves() -> None:
    rng = np.random.default_rng(3)
    sphere = rng.normal(size=(600, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    assert len(extract_curves(sphere, sigma=0.2).pieces) == 0
    assert len(extract_curves(_among_outliers(sphere[:500], rng, 0.5), sigma=0.2).pieces) == 0
    for n, sigma in ((200, 0.3), (200, 0.2)):
        assert len(extract_curves(rng.uniform(-1, 1, (n, 3)), sigma=sigma).pieces) == 0


@all_cases(
    "points",
    [
        np.zeros((0, 3)),
        [[1.0, 2, 3]],
        np.zeros((5, 3)),
        [[0, 0, 0], [9, 9, 9]],
        np.full((4, 3), np.nan),
        [[0, 0, 0]] * 2,
    ],
)
def test_degenerate_tokens_give_nothing(points: Any) -> None:
    found = extract_curves(points, sigma=1.0)
    assert found.vertices.shape == (0, 3) and found.pieces.shape == (0, 2) and found.saliency.shape == (0,)


def test_tokens_that_are_not_finite_are_ignored() -> None:
    points = _circle(np.linspace(0, 6, 120))
    broken = np.concatenate([points, [[np.nan, 0, 0], [np.inf, 0, 0]]])
    assert np.array_equal(extract_curves(points, sigma=0.2).vertices, extract_curves(broken, sigma=0.2).vertices)
    single = extract_curves(points.astype(np.float32), sigma=0.2)
    assert len(single.vertices) > 100 and np.abs(np.hypot(*single.vertices[:, :2].T) - 1).max() < 0.01


@all_cases(
    "arguments, message",
    [
        (dict(points=np.zeros((3, 4)), sigma=1.0), "points: shape"),
        (dict(points=np.zeros((3, 3)), sigma=0.0), "sigma, spacing, least: 0.0"),
        (dict(points=np.zeros((3, 3)), sigma=1.0, least=1.0), "sigma, spacing, least"),
        (dict(points=np.zeros((3, 3)), sigma=1.0, contrast=0.0), "contrast: 0.0"),
    ],
)
def test_errors_name_the_argument(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        extract_curves(**arguments)
