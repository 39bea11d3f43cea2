"""Vector formulas, matrices and random figures without geometric algebra, for tests of the toolkit."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

N = 1000
TINY = np.array([0, 1e-15, 1e-12, 1e-9, 1e-8, 1e-6, 1e-4, 1e-2])
"""Distances from the angles at which formulas change."""


def close(found: Any, expected: Any, tolerance: float = 1e-12) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def unit(vectors: Any) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def dot(a: Any, b: Any) -> Any:
    return np.sum(np.asarray(a) * b, -1)


def length(a: Any) -> Any:
    return np.linalg.norm(a, axis=-1)


def along(factor: Any, vectors: Any) -> np.ndarray:
    """Scale each vector by its factor."""
    return np.asarray(np.asarray(factor)[..., None] * vectors)


def directions(rng: np.random.Generator, n: int = N, dimension: int = 3) -> np.ndarray:
    """Random unit vectors; the first ones are along the axes."""
    found = unit(rng.normal(size=(n, dimension)))
    found[: 2 * dimension] = np.vstack([np.eye(dimension), -np.eye(dimension)])
    return found


def line_of(p: Any, d: Any) -> np.ndarray:
    """Coefficients e12 e13 e23 e01 e02 e03 of the line through p in direction d."""
    p, d = np.broadcast_arrays(p, d)
    return np.concatenate([d[..., 2:], -d[..., 1:2], d[..., :1], np.cross(p, d)], -1)


def plane_of(n: Any, p: Any) -> np.ndarray:
    """Coefficients e1 e2 e3 e0 (or e1 e2 e0) of the plane (line) through p with normal n."""
    return np.concatenate([n, -dot(n, p)[..., None]], -1)


def perpendicular(d: np.ndarray) -> np.ndarray:
    """A unit vector perpendicular to each vector."""
    return unit(np.cross(d, np.eye(3)[np.argmin(np.abs(d), -1)]))


def angles() -> np.ndarray:
    """Angles in [0, 2 pi]: near the ends, near pi on both sides, and in between."""
    ends = np.concatenate([TINY, np.pi - TINY, np.pi + TINY, 2 * np.pi - TINY])
    return np.concatenate([ends, np.linspace(0.01, 6.27, N - len(ends))])


def pose(rotation: Rotation, t: np.ndarray) -> np.ndarray:
    """Homogeneous matrices."""
    matrices = np.tile(np.eye(4), (len(t), 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = rotation.as_matrix(), t
    return matrices


def poses(rng: np.random.Generator, n: int = N, size: float = 1.0) -> np.ndarray:
    """Random poses, including the identity, pure translations, pure rotations, and tiny and half turns."""
    angle = rng.uniform(-np.pi, np.pi, n)
    special = np.concatenate([TINY, np.pi - TINY])
    angle[: len(special)] = special
    t = rng.normal(size=(n, 3)) * size
    t[: 2 * len(special) : 2] = 0
    return pose(Rotation.from_rotvec(along(angle, directions(rng, n))), t)


def apply(matrices: np.ndarray, points: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("...ij,...j->...i", matrices[..., :-1, :-1], points) + matrices[..., :-1, -1])


def turn(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("...ij,...j->...i", matrices[..., :3, :3], vectors))


def up_to_sign(found: np.ndarray, expected: np.ndarray, tolerance: float = 1e-12) -> None:
    close(np.sign(dot(found, expected))[..., None] * found, expected, tolerance)


def hat(w: np.ndarray) -> np.ndarray:
    """Matrices of the vector product with w."""
    o = np.zeros(w.shape[:-1])
    x, y, z = np.moveaxis(w, -1, 0)
    return np.moveaxis(np.array([[o, -z, y], [z, o, -x], [-y, x, o]]), (0, 1), (-2, -1))
