"""Scenes of many cameras, and the residuals of bundle adjustment written with Rodrigues' formula in numpy."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from algorithms.vision import Camera, Observations
from generated import pga3

Array = np.ndarray[Any, Any]


class BundleScene(NamedTuple):
    """Cameras around points near the origin, or an offset, and where they see them."""

    cameras: list[Camera]
    points: Array
    table: Observations
    rng: np.random.Generator


def rotation(vectors: Array) -> Array:
    """Return the matrices of rotation vectors (..., 3) by Rodrigues' formula."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(*x.shape, 3, 3)
    sine = np.sinc(angle / np.pi)
    return np.eye(3) + sine * cross + 0.5 * np.sinc(angle / 2 / np.pi) ** 2 * (cross @ cross)


def bundle_scene(
    c: int, m: int, seed: int, noise: float = 0.5, share: float = 0.6, offset: float = 0.0, unit: float = 1.0
) -> BundleScene:
    """Return c cameras at a distance of 6 from m points of a cube of side 2, in a unit of length."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (m, 3))
    cameras = []
    for _ in range(c):
        a = rng.uniform(-1, 1)
        centre = 6 * np.array([np.sin(a), rng.uniform(-0.3, 0.3), -np.cos(a)])
        z = -centre / np.linalg.norm(centre)
        x = np.cross([0, 1, 0], z) / np.linalg.norm(np.cross([0, 1, 0], z))
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = np.stack([x, np.cross(z, x), z], 1), unit * centre + offset
        cameras.append(Camera.from_intrinsics((600.0, 610.0), (320, 240), pga3.motor_from_matrix(pose)))
    camera, point = np.nonzero(rng.random((c, m)) < share)
    places = unit * points + offset
    pixels = np.concatenate([view.project(places[point[camera == i]]) for i, view in enumerate(cameras)])
    pixels = pixels + noise * rng.normal(size=pixels.shape)
    return BundleScene(cameras, places, Observations(camera, point, pixels), rng)


def disturbed(scene: BundleScene, size: float = 0.02, unit: float = 1.0) -> tuple[list[Camera], Array]:
    """Return cameras, except the first, and points that are moved at random."""
    cameras = scene.cameras[:1]
    for view in scene.cameras[1:]:
        motion = pga3.motor_from_rotation_vector_translation(
            size * scene.rng.normal(size=3), size * unit * scene.rng.normal(size=3)
        )
        cameras.append(Camera(view.intrinsics, pga3.motor_product(view.pose, motion)))
    return cameras, scene.points + size * unit * scene.rng.normal(size=scene.points.shape)


def world_to_camera(cameras: list[Camera]) -> tuple[Array, Array]:
    """Return the matrices and translations [R | t] of cameras."""
    rows = np.linalg.inv(pga3.motor_to_matrix(np.array([each.pose for each in cameras])))
    return rows[:, :3, :3], rows[:, :3, 3]


def distorted(x: Array, y: Array, k: Array, model: str) -> tuple[Array, Array]:
    """Return distorted coordinates as OpenCV's manual defines them."""
    s = x * x + y * y
    if model == "brown":
        k1, k2, p1, p2, k3, k4, k5, k6 = np.moveaxis(k, -1, 0)
        radial = (1 + k1 * s + k2 * s**2 + k3 * s**3) / (1 + k4 * s + k5 * s**2 + k6 * s**3)
        return x * radial + 2 * p1 * x * y + p2 * (s + 2 * x**2), y * radial + p1 * (s + 2 * y**2) + 2 * p2 * x * y
    if model == "fisheye":
        k1, k2, k3, k4 = np.moveaxis(k, -1, 0)
        r = np.sqrt(s)
        a = np.arctan(r)
        factor = a * (1 + k1 * a**2 + k2 * a**4 + k3 * a**6 + k4 * a**8) / r
        return x * factor, y * factor
    return x, y


class Oracle:
    """Residuals of pixels as functions of rotation vectors and translations that are added to a start."""

    def __init__(self, cameras: list[Camera], points: Array, table: Observations, model: str = "pinhole") -> None:
        self.turns, self.shifts = world_to_camera(cameras)
        self.points, self.table, self.model = points, table, model
        self.k = np.array([each.intrinsics for each in cameras])

    def residuals(self, motions: Array, moves: Array, lens: Array | None = None) -> Array:
        """Return residuals (k, 2) for motions (c, 6), moves (m, 3) and numbers of all lenses, fx fy cx cy and k."""
        i, j = self.table.camera, self.table.point
        turns = rotation(motions[:, :3]) @ self.turns
        there = (turns[i] @ (self.points + moves)[j][:, :, None])[:, :, 0] + (self.shifts + motions[:, 3:])[i]
        x, y = there[:, 0] / there[:, 2], there[:, 1] / there[:, 2]
        k = self.k[i]
        fx, fy, cx, cy = k[:, 0, 0], k[:, 1, 1], k[:, 0, 2], k[:, 1, 2]
        if lens is not None:
            x, y = distorted(x, y, lens[4:], self.model)
            fx, fy, cx, cy = lens[:4]
        return np.stack([fx * x + cx, fy * y + cy], 1) - self.table.pixels
