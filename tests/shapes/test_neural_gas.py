"""Neural gases against the topology of known shapes, closed forms of homology, and k-means of scipy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.cluster.vq import kmeans2

from algorithms.shapes import GasStatus, neural_gas, neural_gas_of_image
from algorithms.shapes.gas_topology import betti_numbers, witnessed
from generated import pga2, pga3

Array = np.ndarray[Any, Any]


def _ring(rng: Any, n: int) -> Array:
    turn = rng.uniform(0, 2 * np.pi, n)
    return np.stack([np.cos(turn), np.sin(turn)], 1)


def _crossing(rng: Any, n: int) -> Array:
    """Two circles that cross twice: one part with three loops."""
    points = _ring(rng, n)
    points[n // 2 :] += [1.0, 0]
    return points


def _sphere(rng: Any, n: int) -> Array:
    x = rng.normal(size=(n, 3))
    return np.asarray(x / np.linalg.norm(x, axis=1, keepdims=True))


def _torus(rng: Any, n: int) -> Array:
    u, v = rng.uniform(0, 2 * np.pi, (2, 4 * n))
    kept = rng.random(4 * n) < (1 + 0.5 * np.cos(v)) / 1.5
    u, v = u[kept][:n], v[kept][:n]
    ring = 1 + 0.5 * np.cos(v)
    return np.stack([ring * np.cos(u), ring * np.sin(u), 0.5 * np.sin(v)], 1)


def _knot(rng: Any, n: int) -> Array:
    turn = rng.uniform(0, 2 * np.pi, n)
    return np.stack([np.sin(turn) + 2 * np.sin(2 * turn), np.cos(turn) - 2 * np.cos(2 * turn), -np.sin(3 * turn)], 1)


def _disc(rng: Any, n: int) -> Array:
    turn, radius = rng.uniform(0, 2 * np.pi, n), np.sqrt(rng.random(n))
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.3 * radius**2], 1)


@pytest.mark.parametrize(
    ("shape", "n", "dimension", "betti"),
    [
        (_ring, 700, 1, (1, 1, 0)),
        (_crossing, 1400, 1, (1, 3, 0)),
        (_knot, 1100, 1, (1, 1, 0)),
        (_sphere, 2500, 2, (1, 0, 1)),
        (_torus, 3000, 2, (1, 2, 1)),
        (_disc, 1500, 2, (1, 0, 0)),
    ],
)
def test_topology_and_error(shape: Any, n: int, dimension: int, betti: tuple[int, int, int]) -> None:
    rng = np.random.default_rng(n)
    points = shape(rng, n)
    points.setflags(write=False)
    found = neural_gas(points, dimension=dimension)
    assert found.betti == betti
    centres, label = kmeans2(points, len(found.nodes), minit="++", seed=1, iter=30)
    assert found.error < 1.02 * np.sqrt(((points - centres[label]) ** 2).sum(1).mean())
    module = pga2 if points.shape[1] == 2 else pga3
    np.testing.assert_allclose(module.move_point(found.motors, np.zeros(points.shape[1])), found.nodes, atol=1e-9)


@pytest.mark.parametrize(
    ("shape", "n", "dimension", "betti"),
    [(_crossing, 1400, 1, (1, 3, 0)), (_knot, 1100, 1, (1, 1, 0)), (_sphere, 1500, 2, (1, 0, 1))],
)
def test_topology_with_noise(shape: Any, n: int, dimension: int, betti: tuple[int, int, int]) -> None:
    rng = np.random.default_rng(n)
    points = shape(rng, n)
    found = neural_gas(points + 0.01 * rng.normal(size=points.shape), dimension=dimension)
    assert found.betti == betti or found.status != GasStatus.OK


def test_parts_are_counted_and_axes_are_normals() -> None:
    rng = np.random.default_rng(1)
    points = _sphere(rng, 3000)
    points[1500:] += [4.0, 0, 0]
    found = neural_gas(points)
    assert found.betti == (2, 0, 2)
    outwards = found.nodes - np.where(found.nodes[:, :1] > 2, [4.0, 0, 0], 0)
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    assert np.median(np.abs((outwards * found.axes).sum(1))) > np.cos(np.radians(4))


def test_samples_without_a_shape_are_not_ok() -> None:
    rng = np.random.default_rng(2)
    assert neural_gas(rng.uniform(size=(800, 3))).status == GasStatus.UNCERTAIN
    assert neural_gas(rng.uniform(size=(800, 2))).status == GasStatus.UNCERTAIN


def test_few_points_and_bad_input() -> None:
    for points in (np.zeros((0, 3)), np.ones((500, 3)), np.eye(3), np.full((9, 2), np.nan)):
        found = neural_gas(points)
        assert found.status == GasStatus.TOO_FEW_POINTS and not len(found.edges)
        assert np.isfinite(found.nodes).all() and found.betti[0] == len(found.nodes)
    line = np.repeat(np.linspace(0, 1, 300)[:, None], 2, 1)
    assert neural_gas(line.astype(np.float32)).betti == (1, 0, 0)
    with pytest.raises(ValueError, match="points: shape"):
        neural_gas(np.zeros((5, 4)))
    with pytest.raises(ValueError, match="dimension: 2"):
        neural_gas(np.zeros((5, 2)), dimension=2)
    with pytest.raises(ValueError, match="at least 3"):
        neural_gas(np.zeros((5, 2)), 2)


def test_units_and_broken_rows_do_not_matter() -> None:
    points = _ring(np.random.default_rng(3), 600)
    here = neural_gas(points, 40)
    there = neural_gas(np.concatenate([1e3 * points + [5e3, -2e3], [[np.nan, 0], [np.inf, 1]]]), 40)
    np.testing.assert_allclose(there.nodes, 1e3 * here.nodes + [5e3, -2e3], atol=1e-6)
    assert np.array_equal(here.edges, there.edges) and len(here.nodes) == 40


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_edges_of_an_image(noise: float) -> None:
    rows, columns = np.indices((90, 110))
    image = (np.hypot(rows - 45, columns - 52) < 28) & ~(np.hypot(rows - 45, columns - 58) < 9)
    found = neural_gas_of_image(image + noise * np.random.default_rng(4).normal(size=image.shape))
    assert found.status == GasStatus.OK and found.betti == (2, 2, 0)
    outer, inner = (np.abs(np.hypot(*(found.nodes - [45, c]).T) - r) for c, r in ((52, 28), (58, 9)))
    assert np.minimum(outer, inner).max() < 1.0
    assert neural_gas_of_image(np.ones((40, 40))).status == GasStatus.TOO_FEW_POINTS
    blank = np.random.default_rng(5).normal(size=(60, 60))
    assert neural_gas_of_image(blank).status == GasStatus.TOO_FEW_POINTS


def test_betti_numbers_of_known_complexes() -> None:
    octahedron = np.array([[a, b] for a in range(6) for b in range(a + 1, 6) if a + b != 5])
    assert betti_numbers(octahedron, 6) == (1, 0, 1)
    square = np.array([[0, 1], [1, 2], [2, 3], [0, 3]])
    assert betti_numbers(square, 5) == (2, 1, 0)
    assert betti_numbers(np.concatenate([square, [[0, 2]]]), 4) == (1, 0, 0)
    solid = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
    assert betti_numbers(solid, 4) == (1, 0, 0)
    edges, times = witnessed(np.array([[2, 0], [0, 2]]), 3)
    assert edges.tolist() == [[0, 2]] and times.tolist() == [2]
