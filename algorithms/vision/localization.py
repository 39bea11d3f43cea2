"""Where a camera stands: its pose from points of space that are known, and their pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3, projective2, projective3

from ..arguments import Reals, real_array
from .normalization import flatness, homogeneous, normalized, null_vectors, undone
from .planes import linear_homography
from .robust import Problem, consensus
from .status import VisionStatus, check_points, distinct

_FLAT = 1e-3
"""Points whose extent across a plane is below this part of that along it are taken as points of the plane."""
_OPEN = 1e-7
_STEPS = 50


@dataclass(frozen=True, slots=True, eq=False)
class Localization:
    """The pose of a camera, and how well points determine it."""

    pose: Reals
    """(8,) The unit motor from the camera frame to the world frame; NaN where the status is not OK."""
    status: VisionStatus
    residual: float
    """The root of the mean square of the distances of pixels, in pixels, over inliers."""
    inliers: Reals
    """(n,) bool"""


def localize(
    points: ArrayLike,
    pixels: ArrayLike,
    intrinsics: ArrayLike,
    threshold: float | None = None,
    seed: int = 0,
    confidence: float = 0.999,
    max_samples: int = 2000,
) -> Localization:
    """The pose from which a camera sees points in given pixels, with the least squares of distances in the image.

    Linear equations give a start, for points of a plane those of its homography; Levenberg and Marquardt's steps on the
    manifold of motors do the rest.

    Parameters
    ----------
    points : array_like, (n, 3)
        World coordinates: six and more, or four and more of one plane.
    pixels : array_like, (n, 2)
    intrinsics : array_like, (3, 3)
        As in `Camera`.
    threshold : float, optional
        Where given, in pixels: the distance from which a pixel counts as wrong. Then random samples find the points
        that agree.
    seed : int
        Of the random samples.
    confidence : float
        With which a sample without wrong points is among those drawn.
    max_samples : int

    Returns
    -------
    Localization
        DEGENERATE for points on a line, and others that leave the pose open.

    Raises
    ------
    TypeError, ValueError
        Where these are not as many points as pixels, or `intrinsics` is not upper triangular and regular.
    """
    places, image = real_array(points, "points", (3,), "x y z"), real_array(pixels, "pixels", (2,), "x y")
    k = checked_intrinsics(intrinsics)
    status = check_points({"points": places, "pixels": image}, 4, "points")
    everything, nobody = np.ones(len(places), bool), np.zeros(len(places), bool)
    nothing = np.full(8, np.nan)
    if status != VisionStatus.OK:
        return Localization(nothing, status, np.nan, nobody)
    centred = places - places.mean(0)
    extent = np.linalg.svd(centred, compute_uv=False)
    if extent[0] == 0 or extent[1] <= _OPEN * extent[0]:
        return Localization(nothing, VisionStatus.DEGENERATE, np.nan, nobody)
    planar = bool(flatness(places) <= _FLAT)
    size = 4 if planar else 6
    if distinct(places, size) < size:
        return Localization(nothing, VisionStatus.TOO_FEW, np.nan, nobody)
    seen = np.asarray(projective2.transform_point(np.linalg.inv(k), image))

    if threshold is None:
        starts = linear_poses(places[None], seen[None], planar)
        matrix, cost, open_ = _refined(starts[0], places, image, k)
        if not np.isfinite(cost) or open_:
            return Localization(nothing, VisionStatus.DEGENERATE, np.nan, nobody)
        return Localization(_motor(matrix), VisionStatus.OK, float(np.sqrt(cost / len(places))), everything)

    def solve(sets: Reals) -> Reals:
        return linear_poses(places[sets], seen[sets], planar)

    def distances(models: Reals) -> Reals:
        in_camera = np.einsum("mij,nj->mni", models, homogeneous(places))
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.linalg.norm(in_camera[..., :2] / in_camera[..., 2:] @ k[:2, :2].T + k[:2, 2] - image, axis=-1)
        return np.where(in_camera[..., 2] > 0, off, np.inf)

    def improve(model: Reals, inliers: Reals) -> Reals | None:
        return _refined(model, places[inliers], image[inliers], k)[0] if inliers.sum() >= size else None

    found = consensus(Problem(len(places), size, solve, distances, improve), threshold, seed, confidence, max_samples)
    if found.status != VisionStatus.OK:
        return Localization(nothing, found.status, np.nan, nobody)
    if _refined(found.model, places[found.inliers], image[found.inliers], k)[2]:
        return Localization(nothing, VisionStatus.DEGENERATE, np.nan, nobody)
    return Localization(_motor(found.model), VisionStatus.OK, found.distance, found.inliers)


def checked_intrinsics(intrinsics: ArrayLike) -> Reals:
    """The matrix K; ValueError where it is not one."""
    k = real_array(intrinsics, "intrinsics", (3, 3), "the matrix K")
    if k.ndim != 2 or not np.isfinite(k).all() or np.tril(k, -1).any() or not np.diag(k).all():
        raise ValueError("intrinsics: not an upper triangular matrix with inverse; expected that of a camera")
    return k


def linear_poses(places: Reals, seen: Reals, planar: bool) -> Reals:
    """Matrices [R | t] (..., 3, 4) from points (..., n, 3) and images (x/z, y/z) by linear equations."""
    return (_from_plane if planar else _from_space)(places, seen)


def _from_space(places: Reals, seen: Reals) -> Reals:
    """Matrices [R | t] (..., 3, 4) from points (..., n, 3) in general position and images (x/z, y/z)."""
    matrix = linear_cameras(places, seen)
    u, s, v = np.linalg.svd(np.where(np.isfinite(matrix), matrix, 0)[..., :3])
    turn = np.sign(np.linalg.det(u @ v))[..., None]
    shift = turn * matrix[..., 3] / np.maximum(s.mean(-1), 1e-300)[..., None]
    return np.concatenate([turn[..., None] * (u @ v), shift[..., None]], -1)


def linear_cameras(places: Reals, pixels: Reals) -> Reals:
    """Camera matrices (..., 3, 4), of norm 1, from points (..., n, 3) and pixels, n at least 6, by linear equations."""
    rows, maps = _camera_equations(places, pixels)
    return _camera_of(null_vectors(rows, 1)[..., 0, :], maps)


def linear_camera_and_gap(places: Reals, pixels: Reals) -> tuple[Reals, float]:
    """The camera matrix of one set of points, and the eleventh singular value of its equations by the first."""
    rows, maps = _camera_equations(places, pixels)
    _, values, right = np.linalg.svd(rows)
    return _camera_of(right[-1], maps), float(values[10] / values[0])


def _camera_of(vector: Reals, maps: tuple[Reals, Reals]) -> Reals:
    matrix = undone(maps[1]) @ vector.reshape(*vector.shape[:-1], 3, 4) @ maps[0]
    return np.asarray(matrix / np.linalg.norm(matrix, axis=(-1, -2), keepdims=True))


def _camera_equations(places: Reals, pixels: Reals) -> tuple[Reals, tuple[Reals, Reals]]:
    """Rows for the twelve entries of cameras of points and pixels of size 1, and the similarities to these."""
    one, scale = normalized(places)
    two, other = normalized(pixels)
    x = homogeneous(one)
    nothing = np.zeros_like(x)
    rows = np.concatenate(
        [
            np.concatenate([x, nothing, -two[..., :1] * x], -1),
            np.concatenate([nothing, x, -two[..., 1:] * x], -1),
        ],
        -2,
    )
    return rows, (scale, other)


def _from_plane(places: Reals, seen: Reals) -> Reals:
    """Matrices [R | t] (..., 3, 4) from points of a plane, by its homography."""
    mean = places.mean(-2)
    axes = np.linalg.svd(places - mean[..., None, :], full_matrices=False)[2]
    flat = (places - mean[..., None, :]) @ np.swapaxes(axes[..., :2, :], -1, -2)
    matrix, _ = linear_homography(flat, seen)
    size = np.sqrt(np.linalg.norm(matrix[..., 0], axis=-1) * np.linalg.norm(matrix[..., 1], axis=-1))
    # The plane is before the camera.
    matrix = matrix * (np.sign(matrix[..., 2, 2]) / np.maximum(size, 1e-300))[..., None, None]
    u, _, v = np.linalg.svd(np.concatenate([matrix[..., :2], np.cross(matrix[..., 0], matrix[..., 1])[..., None]], -1))
    turn = u @ v @ np.concatenate([axes[..., :2, :], np.cross(axes[..., 0, :], axes[..., 1, :])[..., None, :]], -2)
    shift = matrix[..., 2] - (turn @ mean[..., None])[..., 0]
    return np.concatenate([turn, shift[..., None]], -1)


def _refined(start: Reals, places: Reals, image: Reals, k: Reals) -> tuple[Reals, float, bool]:
    """[R | t] with the least squares in the image near `start`, their sum, and whether they leave a motion open."""
    matrix, damping = start, 1e-4
    residual, in_camera = _residual(matrix, places, image, k)
    cost = float(residual @ residual)
    if not np.isfinite(cost):
        return matrix, np.nan, True
    size = np.array([1.0, 1, 1, *([max(float(np.abs(in_camera).max()), 1e-300)] * 3)])
    normal, small = np.eye(6), 1e-26 * float((image**2).sum())
    for _ in range(_STEPS):
        jacobian = (k[:2, :2] @ projective3.image_derivative(in_camera)).reshape(-1, 6) * size
        normal, right = jacobian.T @ jacobian, jacobian.T @ residual
        damped = normal.copy()
        damped.flat[::7] += damping * (damped.flat[::7] + 1e-300)
        step = -np.linalg.solve(damped, right) * size
        moved = _moved(step, matrix)
        new, there = _residual(moved, places, image, k)
        change = cost - float(new @ new)
        if change > 0:
            matrix, residual, in_camera, cost, damping = moved, new, there, cost - change, max(damping / 10, 1e-12)
            if change <= 1e-10 * cost or cost <= small:
                break
        else:
            damping *= 10
            if damping > 1e8:
                break
    values = np.linalg.eigvalsh(normal)
    return matrix, cost, bool(values[0] <= _OPEN**2 * values[-1])


def _residual(matrix: Reals, places: Reals, image: Reals, k: Reals) -> tuple[Reals, Reals]:
    in_camera = places @ matrix[:, :3].T + matrix[:, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.asarray(projective3.project_point(k @ matrix, places) - image)
    return off.ravel(), in_camera


def _moved(step: Reals, matrix: Reals) -> Reals:
    """A small motion after the motion of a matrix."""
    motion = pga3.motor_to_matrix(pga3.motor_from_rotation_vector_translation(step[:3], step[3:]))
    moved = motion[:3, :3] @ matrix
    moved[:, 3] += motion[:3, 3]
    return np.asarray(moved)


def _motor(matrix: Reals) -> Reals:
    """The motor from the camera frame to the world frame."""
    u, _, v = np.linalg.svd(matrix[:, :3])
    whole = np.vstack([np.column_stack([u @ v, matrix[:, 3]]), [0, 0, 0, 1]])
    motor = pga3.motor_inverse(pga3.motor_from_matrix(whole))
    return np.asarray(motor * (-1 if motor[0] < 0 else 1))
