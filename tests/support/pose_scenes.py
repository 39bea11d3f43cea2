"""Points and their pixels under known poses, for tests of pose estimation."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from generated import pga3

Array = np.ndarray[Any, Any]
INTRINSICS = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])


def bent_board(bend: float) -> Array:
    """9 x 6 points, 30 mm apart, on a board whose centre is raised by `bend` millimetres."""
    flat = np.stack(np.meshgrid(np.arange(9.0) - 4, np.arange(6.0) - 2.5), -1).reshape(-1, 2) * 30
    return np.c_[flat, bend * np.cos(flat[:, 0] / 120 * np.pi)]


def thick_points(rng: np.random.Generator, n_points: int, thickness: float) -> Array:
    return rng.uniform(-1, 1, (n_points, 3)) * [1, 1, thickness]


def seen_from_somewhere(
    rng: np.random.Generator, points: Array, distance: float, offset: float = 0.0, noise: float = 0.0
) -> tuple[Array, Array, Array, Array]:
    """Points in the world, their pixels, and the rotation from the world and the centre of the camera.

    The origin of the world is `offset` away from that of the points.
    """
    while True:
        turn = Rotation.from_rotvec(0.6 * rng.normal(size=3)).as_matrix()
        shift = distance * np.array([*rng.uniform(-0.1, 0.1, 2), 1])
        there = points @ turn.T + shift
        if there[:, 2].min() > 0.2 * distance:
            break
    pixels = there[:, :2] / there[:, 2:] * 800 + [320, 240] + noise * rng.normal(size=(len(points), 2))
    away = rng.normal(size=3)
    away *= offset / np.linalg.norm(away)
    return points + away, pixels, turn, away - turn.T @ shift


def camera_error(pose: Array, turn: Array, centre: Array) -> tuple[float, float]:
    """The error of a pose: the angle in radians and the distance of the centres."""
    matrix = pga3.motor_to_matrix(pose)
    angle = Rotation.from_matrix(matrix[:3, :3] @ turn).magnitude()
    return float(angle), float(np.linalg.norm(matrix[:3, 3] - centre))
