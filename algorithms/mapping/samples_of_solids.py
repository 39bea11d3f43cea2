"""Planes and spheres through few points, and rectangles about points of a plane."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals
from ..evidence.consensus import Indices


def planes_through(points: Reals, sets: Indices) -> Reals:
    """Return unit vectors (m, 5) of the planes through three points each."""
    first, second, third = np.moveaxis(points[sets], 1, 0)
    normals = np.cross(second - first, third - first)
    sizes = np.linalg.norm(normals, axis=1)
    kept = sizes > 0
    normals = normals[kept] / sizes[kept, None]
    offsets = np.einsum("ki,ki->k", normals, first[kept])
    return np.column_stack([normals, np.zeros(len(normals)), offsets])


def spheres_through(points: Reals, sets: Indices) -> Reals:
    """Return unit vectors (m, 5) of the spheres through four points each."""
    chosen = points[sets]
    table = np.concatenate([chosen, -np.ones((*chosen.shape[:2], 1))], 2)
    kept = np.abs(np.linalg.det(table)) > 0
    found = np.linalg.solve(table[kept], (chosen[kept] ** 2).sum(2)[..., None] / 2)[..., 0]
    vectors = np.column_stack([found[:, :3], np.ones(len(found)), found[:, 3]])
    radii = np.sqrt(np.maximum((found[:, :3] ** 2).sum(1) - 2 * found[:, 3], 0))
    return np.asarray(vectors[radii > 0] / radii[radii > 0, None])


def corners_about(points: Reals, vector: Reals) -> Reals:
    """Return the rectangle, in a plane, about points; one side is horizontal."""
    normal = vector[:3]
    up = np.array([0.0, 0, 1]) if abs(normal[2]) < 0.9 else np.array([0.0, 1, 0])
    along = np.cross(up, normal)
    along /= np.linalg.norm(along)
    other = np.cross(normal, along)
    u, v = points @ along, points @ other
    foot = vector[4] * normal
    sides = [(u.min(), v.min()), (u.max(), v.min()), (u.max(), v.max()), (u.min(), v.max())]
    return np.array([foot + a * along + b * other for a, b in sides])
