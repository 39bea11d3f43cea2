"""Two views of points with a known motion between them, computed by numpy alone."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray[Any, Any]
K = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])
SIZE = np.array([640.0, 480.0])


class Views(NamedTuple):
    """Pixels of both views, the rotation and the translation to the second camera, the points, and wrong pairs."""

    first: Array
    second: Array
    turn: Array
    shift: Array
    points: Array
    wrong: Array


def rotation(vector: Array) -> Array:
    """Return the matrix of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def pixels(points: Array, k: Array = K) -> Array:
    """Return the pixels of points in front of a camera."""
    seen = points @ k.T
    return np.asarray(seen[:, :2] / seen[:, 2:])


def cloud(rng: np.random.Generator, n: int, near: float = 4, far: float = 9) -> Array:
    """Return points in the field of view, at distances in baselines."""
    z = rng.uniform(near, far, n)
    return np.stack([rng.uniform(-0.35, 0.35, n) * z, rng.uniform(-0.28, 0.28, n) * z, z], 1)


def plane(rng: np.random.Generator, n: int) -> Array:
    """Return points of a plane that is inclined to the line of sight."""
    x, y = rng.uniform(-0.35, 0.35, n), rng.uniform(-0.28, 0.28, n)
    a, b = 0.4 * rng.normal(size=2)
    return np.stack([x, y, np.ones(n)], 1) * (rng.uniform(4, 7) / (1 + a * x + b * y))[:, None]


def views(
    rng: np.random.Generator,
    points: Array,
    noise: float = 0.0,
    wrong: float = 0.0,
    shift: Array | None = None,
    angle: float = 0.2,
    k: Array = K,
    k_two: Array | None = None,
) -> Views:
    """Return two views of points; pairs whose point is behind the second camera are left out."""
    vector = rng.normal(size=3)
    turn = rotation(vector * (angle * rng.uniform(0.1, 1) / np.linalg.norm(vector)))
    if shift is None:
        shift = rng.normal(size=3)
        shift /= np.linalg.norm(shift)
    there = points @ turn.T + shift
    points, there = points[there[:, 2] > 0.1], there[there[:, 2] > 0.1]
    n = len(points)
    first = pixels(points, k) + noise * rng.normal(size=(n, 2))
    second = pixels(there, k if k_two is None else k_two) + noise * rng.normal(size=(n, 2))
    bad = rng.random(n) < wrong
    second[bad] = rng.uniform(0, 1, (int(bad.sum()), 2)) * SIZE
    return Views(first, second, turn, shift, points, bad)


def essential(turn: Array, shift: Array) -> Array:
    """Return the matrix of the cross product with the translation, times the rotation."""
    x, y, z = shift
    return np.asarray(np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ turn)


def degrees_off(matrix: Array, turn: Array, shift: Array) -> float:
    """Return the larger one of the errors of rotation and direction of a motion (4, 4), in degrees."""
    chord = float(np.linalg.norm(matrix[:3, :3] - turn)) / np.sqrt(8)
    along = float(np.linalg.norm(matrix[:3, 3] - shift)) / 2
    return float(np.degrees(2 * max(np.arcsin(min(chord, 1)), np.arcsin(min(along, 1)))))
