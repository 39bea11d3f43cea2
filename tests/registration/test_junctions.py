"""Junctions of known shapes, among as many outliers as points."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.registration import extract_junctions
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]


def _crossing(rng: Any, angle: float, low: float = -1) -> Array:
    first, second = rng.uniform(-1, 1, (100, 1)), rng.uniform(low, 1, (100, 1))
    return np.concatenate([first * [1, 0], second * [np.cos(angle), np.sin(angle)]])


def _among_outliers(points: Array, rng: Any, share: float = 1) -> Array:
    low, high = points.min(0) - 0.3, points.max(0) + 0.3
    return np.concatenate([points, rng.uniform(low, high, (int(share * len(points)), points.shape[1]))])


@pytest.mark.parametrize("outliers", [0, 1])
@pytest.mark.parametrize(("angle", "low", "seed"), [(90, -1, 0), (65, -1, 1), (90, 0, 2)])
def test_lines_of_the_plane_meet_in_a_junction(angle: float, low: float, outliers: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    centre = np.array([3, -2])
    points = centre + _among_outliers(_crossing(rng, np.radians(angle), low), rng, outliers)
    found = extract_junctions(points, sigma=0.15)
    assert len(found.points) == 1 and np.linalg.norm(found.points[0] - centre) < 0.2 * 0.15
    assert found.saliency[0] > 2 and found.contrast[0] > 3


def test_a_corner_of_the_plane() -> None:
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform(0, 1, (100, 1)) * axis for axis in np.eye(2)])
    found = extract_junctions(_among_outliers(points, rng), sigma=0.15)
    assert len(found.points) == 1 and np.linalg.norm(found.points) < 0.1 * 0.15


def test_circles_cross_twice() -> None:
    rng = np.random.default_rng(0)
    turn = rng.uniform(0, 2 * np.pi, 400)
    rings = np.stack([np.cos(turn) + (np.arange(400) % 2), np.sin(turn)], 1)
    found = extract_junctions(rings, sigma=0.2)
    places = found.points[np.argsort(found.points[:, 1])]
    assert places.shape == (2, 2)
    assert np.abs(places - [[0.5, -np.sqrt(0.75)], [0.5, np.sqrt(0.75)]]).max() < 0.2 * 0.2
    assert len(extract_junctions(rings[::2], sigma=0.2).points) == 0


@pytest.mark.parametrize(("outliers", "seed"), [(0, 0), (1, 1), (1, 2)])
def test_lines_in_space_meet_in_a_junction(outliers: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.concatenate([rng.uniform(-1, 1, (100, 1)) * axis for axis in np.eye(3)[:2]])
    points = np.concatenate([points, rng.uniform(-1, 1, (200 * outliers, 3))])
    found = extract_junctions(points, sigma=0.15)
    assert len(found.points) == 1 and np.linalg.norm(found.points) < 0.2 * 0.15


def test_circles_in_space_cross_twice() -> None:
    rng = np.random.default_rng(0)
    turn = rng.uniform(0, 2 * np.pi, (600, 1))
    rings = np.cos(turn) * [1, 0, 0] + np.sin(turn) * np.where(np.arange(600)[:, None] % 2, [0, 1, 0], [0, 0, 1])
    found = extract_junctions(_among_outliers(rings, rng, 0.5), sigma=0.2)
    places = found.points[np.argsort(found.points[:, 0])]
    assert places.shape == (2, 3) and np.abs(places - [[-1, 0, 0], [1, 0, 0]]).max() < 0.2 * 0.2


@pytest.mark.slow
@pytest.mark.parametrize(("low", "error"), [(-1, 0.15), (0, 0.35)])
def test_three_planes_meet_in_a_junction(low: float, error: float) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(low, 1, (900, 3)) * (1 - np.repeat(np.eye(3), 300, axis=0))
    found = extract_junctions(points, sigma=0.2)
    assert len(found.points) == 1 and np.linalg.norm(found.points) < error * 0.2


def test_curves_surfaces_and_noise_have_no_junctions() -> None:
    rng = np.random.default_rng(3)
    sphere = rng.normal(size=(600, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    ring = sphere[:200, :2] / np.linalg.norm(sphere[:200, :2], axis=1, keepdims=True)
    line = rng.uniform(-1, 1, (100, 1)) * [1, 0.5, 0.2]
    noise = rng.uniform(-1, 1, (250, 2))
    for points in (sphere, _among_outliers(sphere, rng, 0.5), ring, _among_outliers(ring, rng), line, noise):
        assert len(extract_junctions(points, sigma=0.2).points) == 0


@all_cases("points", [np.zeros((0, 3)), np.zeros((0, 2)), [[1.0, 2]], np.zeros((5, 3)), np.full((4, 2), np.inf)])
def test_degenerate_tokens_give_nothing(points: Any) -> None:
    found = extract_junctions(points, sigma=1.0)
    assert found.points.shape == (0, np.shape(points)[1]) and len(found.saliency) == len(found.contrast) == 0


@all_cases(
    "arguments, message",
    [
        (dict(points=np.zeros((3, 4)), sigma=1.0), "points: shape"),
        (dict(points=np.zeros((3, 3)), sigma=-1.0), "sigma: -1.0"),
        (dict(points=np.zeros((3, 3)), sigma=1.0, least=0.0), "least: 0.0"),
        (dict(points=np.zeros((3, 3)), sigma=1.0, support=np.nan), "support: nan"),
    ],
)
def test_errors_name_the_argument(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        extract_junctions(**arguments)
