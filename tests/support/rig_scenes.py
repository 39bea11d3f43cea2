"""Stereo boards and rigs of cameras in known places."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from algorithms.vision import Camera, Distortion
from generated import pga3

Array = np.ndarray[Any, Any]
BOARD = np.stack(np.meshgrid(np.arange(9.0) - 4, np.arange(6.0) - 2.5), -1).reshape(-1, 2) * 0.03
PAIR = (
    Camera.from_intrinsics(800.0, (640, 400), distortion=Distortion("brown", (-0.2, 0.05))),
    Camera.from_intrinsics(500.0, (320, 240)),
)


def motor(turn: Array, shift: Array) -> Array:
    """A motor that rotates by a rotation vector, then translates."""
    return np.asarray(pga3.motor_from_rotation_vector_translation(np.asarray(turn, float), np.asarray(shift, float)))


def stereo_views(
    rng: np.random.Generator, n: int, noise: float = 0.3, size: float = 1.0, depth: tuple[float, float] = (0.4, 0.8)
) -> tuple[list[Array], list[Array], Array]:
    """Pixels of n boards in both cameras of `PAIR`, twice as noisy in the second, and the motor between them."""
    motion = motor(rng.normal(0, 0.1, 3), np.array([-0.1, 0.01, 0.02]) + rng.normal(0, 0.02, 3))
    first, second = [], []
    for _ in range(n):
        pose = motor(rng.uniform(-0.5, 0.5, 3), [*rng.uniform(-0.1, 0.1, 2), rng.uniform(*depth)])
        points = pga3.move_point(pose, np.insert(size * BOARD, 2, 0, axis=1))
        first.append(PAIR[0].project(points) + noise * rng.normal(size=BOARD.shape))
        second.append(PAIR[1].project(pga3.move_point(motion, points)) + 2 * noise * rng.normal(size=BOARD.shape))
    return first, second, motion


def offsets(found: Array, truth: Array) -> Array:
    """The rotation vector that follows a motor, and the difference of translations (6,)."""
    own, true = pga3.motor_to_matrix(found), pga3.motor_to_matrix(truth)
    turn = Rotation.from_matrix(own[:3, :3] @ true[:3, :3].T).as_rotvec()
    return np.concatenate([turn, own[:3, 3] - true[:3, 3]])


def rig(rng: np.random.Generator, apart: float = 0.4, focal: float = 700.0) -> list[Camera]:
    """Three cameras that look in different directions."""
    return [
        Camera.from_intrinsics(
            focal, (320, 240), motor(np.array([0, 0.9 * k, 0]) + rng.normal(0, 0.1, 3), rng.normal(0, 1, 3) * apart)
        )
        for k in (-1, 0, 1)
    ]


def seen_by(
    rng: np.random.Generator, cameras: list[Camera], pose: Array, n: int, noise: float = 0.5, wrong: float = 0.0
) -> tuple[Array, Array, Array, Array]:
    """World points, their pixels in one camera each, the numbers of the cameras, and which pixels are wrong."""
    which = np.arange(n) % len(cameras)
    pixels, depths = rng.uniform(0, [640, 480], (n, 2)), rng.uniform(3, 8, n)
    points = np.array(
        [
            pga3.move_point(pose, pga3.move_point(cameras[k].pose, cameras[k].directions(pixel) * depth))
            for k, pixel, depth in zip(which, pixels, depths, strict=True)
        ]
    )
    pixels = pixels + noise * rng.normal(size=pixels.shape)
    bad = rng.random(n) < wrong
    pixels[bad] = rng.uniform(0, [640, 480], (int(bad.sum()), 2))
    return points, pixels, which, bad
