"""Kernels of nodes in space against numpy, scipy and closed forms."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from generated import pga3, shapes


def test_sums_of_cells() -> None:
    rng = np.random.default_rng(1)
    samples, nodes, weights = rng.normal(size=(50, 3)), rng.normal(size=(7, 3)), rng.uniform(1, 2, 50)
    winner = rng.integers(0, 7, 50)
    shifts, sums, squares = shapes.sums_of_cells(samples, weights, winner, nodes)
    for k in range(7):
        rest, w = samples[winner == k] - nodes[k], weights[winner == k]
        assert np.allclose(shifts[k], w @ rest) and np.isclose(sums[k], w.sum())
        assert np.isclose(squares[k], w @ (rest**2).sum(1))


def test_nodes_go_to_places_and_turn_to_normals() -> None:
    rng = np.random.default_rng(2)
    places, normals = rng.normal(size=(9, 3)), rng.normal(size=(9, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    start = pga3.motor_from_rotation_vector_translation(rng.normal(size=(9, 3)), rng.normal(size=(9, 3)))
    motors = shapes.moved_surface_nodes(start, places, normals)
    assert np.allclose(pga3.move_point(motors, np.zeros(3)), places)
    planes = pga3.plane_to_normal(pga3.move_plane(motors, pga3.plane_from_normal(np.array([0, 0, 1.0]), 0.0)))
    assert np.allclose(planes[0], normals) and np.allclose(planes[1], (places * normals).sum(1))


def test_normals_and_curvatures_of_a_sphere() -> None:
    points = np.random.default_rng(3).normal(size=(200, 3))
    points *= 2 / np.linalg.norm(points, axis=1, keepdims=True)
    hull = ConvexHull(points)
    a, b, c = hull.simplices.T
    turned = ((np.cross(points[b] - points[a], points[c] - points[a])) * hull.equations[:, :3]).sum(1) < 0
    b, c = np.where(turned, c, b), np.where(turned, b, c)
    normals = shapes.normals_of_triangles(points, a, b, c)
    area = np.linalg.norm(np.cross(points[b] - points[a], points[c] - points[a]), axis=1)
    assert np.isclose(area.sum(), 2 * hull.area)
    expected = np.zeros((200, 3))
    for corner in (a, b, c):
        np.add.at(expected, corner, np.cross(points[b] - points[a], points[c] - points[a]))
    assert np.allclose(normals, expected)
    sums, counts = shapes.curvatures_of_edges(points, points / 2, np.r_[a, b, c], np.r_[b, c, a])
    assert np.allclose(sums / counts, 0.5)
