"""Graphs of nodes on surfaces against closed forms, Euler numbers and trimesh."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.shapes import SurfaceStatus, surface
from algorithms.shapes.surface_distances import distances_to_triangles
from algorithms.shapes.triangulation import components_and_genus, faults
from generated import pga3
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]


def torus(count: int, seed: int = 0) -> Array:
    """Random points on a torus with radii 3 and 1, uniform by area."""
    rng = np.random.default_rng(seed)
    u, v, accept = rng.uniform(0, 2 * np.pi, (3, 3 * count))
    keep = 3 + np.cos(v) > 4 * accept / (2 * np.pi)
    u, v = u[keep][:count], v[keep][:count]
    return np.column_stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)])


def off_torus(points: Array) -> Array:
    return np.asarray(np.abs(np.hypot(np.hypot(points[:, 0], points[:, 1]) - 3, points[:, 2]) - 1))


def test_torus_has_genus_one_and_motors() -> None:
    found = surface(torus(4000))
    assert found.status is SurfaceStatus.OK and (found.components, found.genus) == (1, 1)
    middles = found.nodes[found.triangles].mean(1)
    assert off_torus(middles).mean() < 0.003 * found.diagonal and off_torus(middles).max() < 0.02 * found.diagonal
    ring = found.nodes * [1, 1, 0]
    expected = found.nodes - 3 * ring / np.linalg.norm(ring, axis=1, keepdims=True)
    assert ((expected * found.normals).sum(1) > 0.9).all()
    assert np.allclose(found.transport(np.zeros(3), pga3.move_point), found.nodes)
    planes = found.transport(pga3.plane_from_normal(np.array([0.0, 0, 1]), 0.0))
    assert np.allclose(pga3.plane_to_normal(planes)[0], found.normals)
    assert (np.diff(found.curve[:, 0]) > 0).all() and found.curve[-1, 1] < 0.2 * found.curve[0, 1]


@pytest.mark.slow
def test_mesh_is_closed_by_trimesh() -> None:
    trimesh = pytest.importorskip("trimesh")
    found = surface(torus(4000, 3))
    mesh = trimesh.Trimesh(found.nodes, found.triangles, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 0
    # The volume of a mesh with nodes on the surface is a little too small.
    assert 0.95 * 6 * np.pi**2 < mesh.volume < 6.05 * np.pi**2
    points = np.random.default_rng(0).normal(size=(60, 3)) + found.nodes[:60]
    known = trimesh.proximity.closest_point_naive(mesh, points)[1]
    bounds = distances_to_triangles(points, found.nodes, found.triangles)
    assert (bounds >= known - 1e-12).all() and (bounds - known).mean() < 0.02


@pytest.mark.slow
def test_outliers_at_most_double_the_error() -> None:
    rng = np.random.default_rng(1)
    points = torus(4000)
    clean = surface(points, nodes=1000)
    found = surface(np.vstack([points, rng.uniform([-4, -4, -1.5], [4, 4, 1.5], (1000, 3))]), nodes=1000)
    # Outliers near the torus remain; their distances may exceed the limit.
    assert found.status in (SurfaceStatus.OK, SurfaceStatus.TOO_FAR) and found.genus == 1 and found.n_outliers > 667
    errors = [off_torus(f.nodes[f.triangles].mean(1)).mean() for f in (found, clean)]
    assert errors[0] < 2 * errors[1]


def test_two_balls_of_a_mask_with_spacing() -> None:
    x, y, z = np.indices((30, 60, 16))
    mask = np.zeros(x.shape, bool)
    for centre in (15, 44):
        mask |= (x - 15) ** 2 + (y - centre) ** 2 + 4 * (z - 8) ** 2 < 144
    found = surface(mask, (1, 1, 2))
    assert found.status is SurfaceStatus.OK and (found.components, found.genus) == (2, 0)
    centres = np.where(found.nodes[:, 1:2] < 29.5, [15, 15, 16], [15, 44, 16])
    radii = np.linalg.norm(found.nodes - centres, axis=1)
    assert abs(radii - 12).mean() < 0.5
    assert 1 / 14 < np.median(found.curvatures) < 1 / 10


def test_gap_is_reported() -> None:
    points = torus(3000)
    found = surface(points[np.linalg.norm(points - [3, 0, 1], axis=1) > 0.7])
    assert found.status is not SurfaceStatus.OK


def test_too_few_nodes_are_reported() -> None:
    assert surface(torus(4000), nodes=64).status is not SurfaceStatus.OK


def test_faults_of_triangulations() -> None:
    ball = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    assert not len(faults(ball)) and components_and_genus(ball) == (1, 0)
    assert set(faults(ball[1:])) == {0, 1, 2}
    turned = ball.copy()
    turned[0] = turned[0, ::-1]
    assert {0, 1, 2} <= set(faults(turned))
    # Two tetrahedra with a common corner, and with a common edge.
    corner = np.array([0, 4, 5, 6])[ball]
    assert list(faults(np.vstack([ball, corner]))) == [0]
    assert {0, 1} <= set(faults(np.vstack([ball, np.array([0, 1, 5, 6])[ball]])))


@all_cases(
    "points, message",
    [
        (np.zeros((50, 3)), "expected at least 100"),
        (np.zeros((200, 2)), "expected"),
        (np.full((200, 3), np.nan), "nan at"),
        (np.zeros((9, 9, 9), bool), "no voxel"),
        (np.ones((200, 3)), "all are in one plane"),
        (np.random.default_rng(1).normal(size=(200, 3)) @ np.diag([1.0, 2.0, 0.0]), "all are in one plane"),
        (1e200 * np.random.default_rng(1).normal(size=(200, 3)), "coordinates up to"),
    ],
)
def test_errors_name_what_is_wrong(points: Array, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        surface(points)
