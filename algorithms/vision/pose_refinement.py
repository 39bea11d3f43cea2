"""Poses with the least squares of distances in the image, over leading axes, and tests of their reliability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generated import pga3, projective3

from ..arguments import Reals
from .pose_starts import pose_starts
from .status import VisionStatus

_OPEN = 1e-7
"""A motion is undetermined if it moves pixels by less than this fraction of what other motions do."""
_CHANCE = 1e-3
"""Fraction of sets of points without any relation to their pixels that pass."""
_EXPLAINED = 0.03
"""Maximum fraction of the squares of pixels about their centroid that a valid pose leaves."""


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Poses [R | t] of b sets of points, and their properties."""

    matrix: Reals
    """(b, 3, 4)"""
    cost: Reals
    """(b) The sum of squared distances in the image, in pixels."""
    normal: Reals
    """(b, 6, 6) The normal equations at the pose, with translations in units of the depth."""
    converged: Reals
    """(b) bool: whether no step decreases the cost any further."""
    in_front: Reals
    """(b) bool: whether all points are in front of the camera."""


def best_poses(places: Reals, image: Reals, seen: Reals, k: Reals, n_steps: int) -> Poses:
    """Return the least minimum over all starts with all points in front of the camera, or else the least one.

    `places` (b, n, 3) are relative to their centroids, `image` (b, n, 2) are pixels, `seen` their directions x/z, y/z.
    """
    starts = pose_starts(places, seen)
    b, s = starts.shape[:2]
    found = refined_poses(starts.reshape(-1, 3, 4), np.repeat(places, s, 0), np.repeat(image, s, 0), k, n_steps)
    cost = np.where(np.isfinite(found.cost), found.cost, np.inf).reshape(b, s)
    before = np.where(found.in_front.reshape(b, s), cost, np.inf)
    best = np.where(np.isfinite(before).any(1), before.argmin(1), cost.argmin(1)) + s * np.arange(b)
    return Poses(found.matrix[best], found.cost[best], found.normal[best], found.converged[best], found.in_front[best])


def pose_status(found: Poses, places: Reals, image: Reals) -> Reals:
    """Return a `VisionStatus` for each pose of `best_poses`.

    The status is TOO_FEW for fewer than four distinct points and DEGENERATE if they are on a line or if a motion is
    undetermined. It is NOT_CONVERGED if iterations ended early, if points are behind the camera, or if the residual is
    larger than for an image of the points: for random pixels the residual is below a fraction x of their squares with
    a probability of about x^(n - 3).
    """
    n = places.shape[1]
    extent = np.linalg.svd(places, compute_uv=False)
    values = np.linalg.eigvalsh(np.where(np.isfinite(found.normal), found.normal, 0))
    left_open = (extent[:, 1] <= _OPEN * extent[:, 0]) | ~(values[:, 0] > _OPEN**2 * values[:, -1])
    spread = ((image - image.mean(1, keepdims=True)) ** 2).sum((1, 2))
    explained = found.cost <= min(_CHANCE ** (1 / (n - 3)), _EXPLAINED) * spread
    status = np.where(found.converged & found.in_front & explained, VisionStatus.OK, VisionStatus.NOT_CONVERGED)
    status = np.where(left_open, VisionStatus.DEGENERATE, status)
    return np.where(_n_distinct(places) < 4, VisionStatus.TOO_FEW, status)


def refined_poses(start: Reals, places: Reals, image: Reals, k: Reals, n_steps: int) -> Poses:
    """Run Levenberg-Marquardt iterations on the manifold of motions from (b, 3, 4), each with its own damping."""
    matrix = np.array(start)
    damping, normal = np.full(len(matrix), 1e-4), np.tile(np.eye(6), (len(matrix), 1, 1))
    residual, in_camera = _residual(matrix, places, image, k)
    cost = (residual**2).sum(1)
    converged = np.zeros(len(matrix), bool)
    exact = 1e-26 * (image**2).sum((1, 2))
    live = np.nonzero(np.isfinite(cost))[0]
    for _ in range(n_steps):
        if not len(live):
            break
        normal[live], step = _step(residual[live], in_camera[live], k, damping[live])
        moved = _moved(step, matrix[live])
        new, there = _residual(moved, places[live], image[live], k)
        new_cost = (new**2).sum(1)
        change = cost[live] - new_cost
        better = change > 0
        kept = live[better]
        matrix[kept], residual[kept], in_camera[kept], cost[kept] = (
            part[better] for part in (moved, new, there, new_cost)
        )
        damping[live] = np.where(better, np.maximum(damping[live] / 10, 1e-12), damping[live] * 10)
        done = (np.abs(change) <= 1e-10 * cost[live]) | (cost[live] <= exact[live]) | (damping[live] > 1e8)
        converged[live[done]] = True
        live = live[~done]
    return Poses(matrix, cost, normal, converged, np.asarray((in_camera[..., 2] > 0).all(1)))


def _step(residual: Reals, in_camera: Reals, k: Reals, damping: Reals) -> tuple[Reals, Reals]:
    """Return the normal equations, with lengths relative to the depth, and their damped solution."""
    size = np.ones((len(residual), 6))
    size[:, 3:] = np.maximum(np.abs(in_camera).max((1, 2)), 1e-300)[:, None]
    rows = (k[:2, :2] @ projective3.image_derivative(in_camera)).reshape(len(residual), -1, 6) * size[:, None]
    transposed = np.swapaxes(rows, 1, 2)
    normal = transposed @ rows
    diagonal = np.einsum("bii->bi", normal)
    damped = normal + (damping[:, None] * (diagonal + 1e-300))[..., None] * np.eye(6)
    usable = np.isfinite(damped).all((1, 2)) & (diagonal > 0).all(1)
    damped = np.where(usable[:, None, None], damped, np.eye(6))
    step = -np.linalg.solve(damped, transposed @ residual[..., None])[..., 0] * size
    return normal, np.where(usable[:, None], step, 0)


def _residual(matrix: Reals, places: Reals, image: Reals, k: Reals) -> tuple[Reals, Reals]:
    in_camera = places @ np.swapaxes(matrix[..., :3], 1, 2) + matrix[:, None, :, 3]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        off = np.asarray(projective3.project_point((k @ matrix)[:, None], places) - image)
    return off.reshape(len(matrix), -1), in_camera


def _moved(step: Reals, matrix: Reals) -> Reals:
    """Return the matrices composed with small motions."""
    rotations, shifts = np.ascontiguousarray(step[:, :3]), np.ascontiguousarray(step[:, 3:])
    motion = pga3.motor_to_matrix(pga3.motor_from_rotation_vector_translation(rotations, shifts))
    moved = np.asarray(motion[:, :3, :3] @ matrix)
    moved[..., 3] += motion[:, :3, 3]
    return moved


def _n_distinct(places: Reals) -> Reals:
    """Return the number of distinct points (b, n, 3), by their order along a generic direction."""
    along = np.sort(places[..., 0] + np.sqrt(2) * places[..., 1] + np.sqrt(3) * places[..., 2], axis=1)
    return np.asarray(1 + (np.diff(along, axis=1) > 0).sum(1))


def camera_motors(matrix: Reals, centroid: Reals) -> Reals:
    """Return unit motors (b, 8) from camera to world frame, for poses (b, 3, 4) of points about centroids (b, 3).

    The centre of the camera is computed relative to the centroid, which preserves accuracy far from the origin.
    """
    u, _, v = np.linalg.svd(np.where(np.isfinite(matrix[..., :3]), matrix[..., :3], 0))
    back = np.swapaxes(u @ v, 1, 2)
    whole = np.tile(np.eye(4), (len(matrix), 1, 1))
    whole[:, :3, :3] = back
    whole[:, :3, 3] = centroid - (back @ matrix[..., 3:])[..., 0]
    motor = pga3.motor_from_matrix(whole)
    return np.asarray(motor * np.where(motor[:, :1] < 0, -1, 1))
