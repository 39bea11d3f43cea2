"""Extremal surfaces and curves of known shapes among outliers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_matrix, csgraph

from algorithms.registration import CurveStatus, extract_curves, extract_surface


@pytest.mark.slow
def test_a_sphere_among_outliers_is_a_surface_with_few_gaps() -> None:
    rng = np.random.default_rng(0)
    sphere = rng.normal(size=(1500, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    found = extract_surface(
        np.concatenate([sphere, rng.uniform(-1.5, 1.5, (300, 3))]), sigma=0.25, spacing=0.1, least=0.1
    )
    radius = np.linalg.norm(found.vertices, axis=1)
    assert len(found.pieces) > 500 and np.quantile(np.abs(radius - 1), 0.95) < 0.03 and np.abs(radius - 1).mean() < 0.01
    edges = np.sort(np.stack([found.pieces, np.roll(found.pieces, -1, 1)], -1).reshape(-1, 2), 1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).mean() > 0.9


@pytest.mark.parametrize("outliers", [0, 1])
def test_circles_are_closed_curves(outliers: int) -> None:
    rng = np.random.default_rng(1)
    turn = rng.uniform(0, 2 * np.pi, 500)
    rings = np.stack([np.cos(turn) + 3 * (np.arange(500) % 2), np.sin(turn)], 1)
    low, high = rings.min(0) - 0.4, rings.max(0) + 0.4
    tokens = np.concatenate([rings, rng.uniform(low, high, (500 * outliers, 2))])
    found = extract_curves(tokens, sigma=0.2)
    radius = np.minimum(*(np.abs(np.hypot(found.vertices[:, 0] - x, found.vertices[:, 1]) - 1) for x in (0, 3)))
    assert np.median(radius) < 0.002 and np.quantile(radius, 0.95) < 0.006 and radius.max() < 0.02
    # Two rings: each vertex belongs to two segments.
    assert (np.bincount(found.pieces.ravel()) == 2).all() and len(found.vertices) > 200
    links = coo_matrix((np.ones(len(found.pieces)), found.pieces.T), shape=(len(found.vertices),) * 2)
    assert csgraph.connected_components(links, directed=False)[0] == 2


def test_noise_of_the_plane_has_no_curves() -> None:
    rng = np.random.default_rng(0)
    assert len(extract_curves(rng.uniform(-1, 1, (250, 2)), sigma=0.2).pieces) == 0


def test_nothing_gives_nothing() -> None:
    assert len(extract_surface(np.zeros((0, 3)), sigma=1.0).vertices) == 0
    assert len(extract_surface([[0, 0, 0], [9, 9, 9]], sigma=1.0).pieces) == 0
    with pytest.raises(ValueError, match="points: shape"):
        extract_curves(np.zeros((3, 4)), sigma=1.0)
    with pytest.raises(ValueError, match="nodes; expected at most"):
        extract_surface([[0, 0, 0], [1e6, 1e6, 1e6]], sigma=1.0)


@pytest.mark.parametrize("noise", [0.0, 0.06])
def test_scale_of_curves_follows_from_their_noise(noise: float) -> None:
    """Rings with a given scale of 0.12 are broken and UNEXPLAINED if the noise is half of it."""
    rng = np.random.default_rng(3)
    turn = rng.uniform(0, 2 * np.pi, 400)
    ring = np.stack([np.cos(turn), np.sin(turn)], 1) + noise * rng.normal(size=(400, 2))
    tokens = np.concatenate([ring, rng.uniform(-1.8, 1.8, (150, 2))])
    found = extract_curves(tokens)
    assert found.status == CurveStatus.OK and found.sigma > 3 * noise
    dense = np.stack([np.cos(np.linspace(0, 7, 500)), np.sin(np.linspace(0, 7, 500))], 1)
    assert np.linalg.norm(dense[:, None] - found.vertices, axis=-1).min(1).max() < found.sigma
    given = extract_curves(tokens, sigma=0.12)
    assert given.sigma == 0.12 and (given.status == CurveStatus.OK) is (noise < 0.03)


@pytest.mark.slow
def test_tokens_without_curves_have_a_status() -> None:
    rng = np.random.default_rng(4)
    assert extract_curves(rng.uniform(-1, 1, (400, 2)), sigma=0.2).status == CurveStatus.NOTHING
    assert extract_curves(np.zeros((0, 2)), sigma=0.2).status == CurveStatus.NOTHING
    disc = rng.normal(size=(300, 3)) * 0.1
    around = rng.uniform(-2, 2, (300, 3))
    assert extract_curves(np.concatenate([disc, around]), sigma=0.2).status == CurveStatus.UNEXPLAINED
    sphere = rng.normal(size=(2000, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    assert extract_curves(sphere, sigma=0.25).status == CurveStatus.NOTHING
