"""Thousands of small problems at once: F, homographies and poses over leading axes, by linear equations and few steps.

For one problem with many points, or with wrong ones, there are `fundamental_matrix`, `homography`, `localize` and their
robust forms, which also iterate longer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3, projective2, projective3

from ..arguments import Reals, finite_number, real_array
from .fundamental import degenerate, eight_points
from .localization import checked_intrinsics, linear_poses
from .normalization import flatness, three_on_a_line
from .planes import homographies_of_four, linear_homography
from .status import VisionStatus

_BLOCK = 256
"""So many problems are solved at once: their equations stay in the cache."""
_RANK = 1e-7
_THIN = 1e-9
_FLAT = 1e-3
_OPEN = 1e-7


@dataclass(frozen=True, slots=True, eq=False)
class BatchEstimate:
    """What many sets of points say, each for itself."""

    models: Reals
    """(..., 3, 3), or (..., 8) for poses; NaN where the status is not OK."""
    status: Reals
    """(...) int, a `VisionStatus` each."""


def fundamental_matrices(first: ArrayLike, second: ArrayLike, noise: float | None = None) -> BatchEstimate:
    """The normalised eight-point algorithm for many sets of points.

    Parameters
    ----------
    first, second : array_like, (..., n, 2)
        Pixels of n points each, n at least 8.
    noise : float, optional
        The standard deviation of pixels, where known, by which planes are told; see `fundamental_matrix`.

    Returns
    -------
    BatchEstimate
        F of rank 2 and norm 1.

    Raises
    ------
    TypeError, ValueError
        Where these are not as many points each, or `noise` is not positive.
    """
    one, two, leading = _sets(first, second, "first", "second", (2, 2))
    if noise is not None and finite_number(noise, "noise") <= 0:
        raise ValueError(f"noise: {noise}; expected more than 0 pixels, or None")

    def solve(a: Reals, b: Reals) -> tuple[Reals, Reals]:
        matrix = eight_points(a, b)
        return matrix, degenerate(matrix, a, b, noise)

    return _all(solve, one, two, leading, 8, (3, 3))


def homographies(first: ArrayLike, second: ArrayLike) -> BatchEstimate:
    """The homographies of many sets of points of planes, in the least squares of their linear equations.

    Parameters
    ----------
    first, second : array_like, (..., n, 2)
        n points each, n at least 4.

    Returns
    -------
    BatchEstimate
        With norm 1.

    Raises
    ------
    TypeError, ValueError
        Where these are not as many points each.
    """
    one, two, leading = _sets(first, second, "first", "second", (2, 2))

    def solve(a: Reals, b: Reals) -> tuple[Reals, Reals]:
        if a.shape[1] == 4:
            return homographies_of_four(a, b), three_on_a_line(a, _THIN) | three_on_a_line(b, _THIN)
        matrix, gap = linear_homography(a, b)
        return matrix, gap <= _RANK

    return _all(solve, one, two, leading, 4, (3, 3))


def localizations(points: ArrayLike, pixels: ArrayLike, intrinsics: ArrayLike, n_steps: int = 5) -> BatchEstimate:
    """The poses of many cameras, or of one at many times, from points that are known and their pixels.

    Linear equations, and then steps of Gauss and Newton for distances in the image.

    Parameters
    ----------
    points : array_like, (..., n, 3)
        World coordinates of n points each, at least six: in general position in all sets, or on a plane in all.
    pixels : array_like, (..., n, 2)
    intrinsics : array_like, (3, 3)
        As in `Camera`.
    n_steps : int
        Of Gauss and Newton.

    Returns
    -------
    BatchEstimate
        Unit motors from the camera frame to the world frame, as `localize` gives them. DEGENERATE for points on a line
        and for a set of a plane among others.

    Raises
    ------
    TypeError, ValueError
        Where these are not as many points as pixels, or `intrinsics` is not upper triangular and regular.
    """
    places, image, leading = _sets(points, pixels, "points", "pixels", (3, 2))
    k = checked_intrinsics(intrinsics)
    inverse = np.linalg.inv(k)
    usable = np.isfinite(places).all((1, 2))
    planar = bool(usable.any() and places.shape[1] >= 4 and (flatness(places[usable]) <= _FLAT).all())

    def solve(a: Reals, b: Reals) -> tuple[Reals, Reals]:
        matrix = linear_poses(a, np.asarray(projective2.transform_point(inverse, b)), planar)
        normal = np.tile(np.eye(6), (len(a), 1, 1))
        for _ in range(n_steps):
            matrix, normal = _step(matrix, a, b, k)
        values = np.linalg.eigvalsh(np.where(np.isfinite(normal), normal, 0))
        size = np.linalg.svd(a - a.mean(1, keepdims=True), compute_uv=False)
        bad = (values[:, 0] <= _OPEN**2 * values[:, -1]) | (size[:, 1] <= _OPEN * size[:, 0])
        if not planar:
            bad |= size[:, 2] <= _FLAT * size[:, 0]
        return _motors(matrix), bad

    return _all(solve, places, image, leading, 4 if planar else 6, (8,))


def _step(matrix: Reals, places: Reals, image: Reals, k: Reals) -> tuple[Reals, Reals]:
    """Poses [R | t] after one step where that lessens distances, and the normal equations before, lengths by depth."""
    residual, in_camera = _residual(matrix, places, image, k)
    size = np.ones((len(matrix), 6))
    size[:, 3:] = np.maximum(np.abs(in_camera).max((1, 2)), 1e-300)[:, None]
    rows = (k[:2, :2] @ projective3.image_derivative(in_camera)).reshape(len(matrix), -1, 6) * size[:, None]
    turned = np.swapaxes(rows, 1, 2)
    normal = turned @ rows
    damped = normal + (1e-14 * np.trace(normal, axis1=1, axis2=2)[:, None, None] + 1e-300) * np.eye(6)
    safe = np.where(np.isfinite(damped), damped, np.eye(6))
    step = -np.linalg.solve(safe, turned @ residual[..., None])[..., 0] * size
    motion = pga3.motor_to_matrix(pga3.motor_from_rotation_vector_translation(step[:, :3].copy(), step[:, 3:].copy()))
    moved = motion[:, :3, :3] @ matrix
    moved[..., 3] += motion[:, :3, 3]
    better = (_residual(moved, places, image, k)[0] ** 2).sum(1) < (residual**2).sum(1)
    return np.where(better[:, None, None], moved, matrix), normal


def _residual(matrix: Reals, places: Reals, image: Reals, k: Reals) -> tuple[Reals, Reals]:
    in_camera = places @ np.swapaxes(matrix[..., :3], 1, 2) + matrix[:, None, :, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.asarray(projective3.project_point((k @ matrix)[:, None], places) - image)
    return off.reshape(len(matrix), -1), in_camera


def _motors(matrix: Reals) -> Reals:
    u, _, v = np.linalg.svd(np.where(np.isfinite(matrix[..., :3]), matrix[..., :3], 0))
    whole = np.tile(np.eye(4), (len(matrix), 1, 1))
    whole[:, :3, :3], whole[:, :3, 3] = u @ v, matrix[..., 3]
    motor = pga3.motor_inverse(pga3.motor_from_matrix(whole))
    return np.asarray(motor * np.where(motor[:, :1] < 0, -1, 1))


def _sets(
    first: ArrayLike, second: ArrayLike, name: str, other: str, sizes: tuple[int, int]
) -> tuple[Reals, Reals, tuple[int, ...]]:
    """Both as (sets, n, d) in double precision, and the leading axes that they have in common."""
    one = real_array(first, name, (-1, sizes[0]), "points")
    two = real_array(second, other, (-1, sizes[1]), "points")
    if one.shape[-2] != two.shape[-2]:
        raise ValueError(f"{other}: {two.shape[-2]} points; expected {one.shape[-2]}, as many as {name} has")
    leading = np.broadcast_shapes(one.shape[:-2], two.shape[:-2])
    one, two = (np.broadcast_to(x, (*leading, *x.shape[-2:])).reshape(-1, *x.shape[-2:]) for x in (one, two))
    return one.astype(np.float64), two.astype(np.float64), leading


def _all(
    solve: Callable[[Reals, Reals], tuple[Reals, Reals]],
    one: Reals,
    two: Reals,
    leading: tuple[int, ...],
    least: int,
    shape: tuple[int, ...],
) -> BatchEstimate:
    """Block after block; sets with numbers that are not finite are left out."""
    models, status = np.full((len(one), *shape), np.nan), np.zeros(len(one), int)
    finite = np.asarray(np.isfinite(one).all((1, 2)) & np.isfinite(two).all((1, 2)))
    status[~finite] = VisionStatus.NOT_FINITE
    if one.shape[1] < least:
        status[finite] = VisionStatus.TOO_FEW
        finite[:] = False
    where = np.nonzero(finite)[0]
    for start in range(0, len(where), _BLOCK):
        part = where[start : start + _BLOCK]
        found, bad = solve(one[part], two[part])
        bad = bad | ~np.isfinite(found).reshape(len(part), -1).all(1)
        models[part] = np.where(bad.reshape(-1, *(1 for _ in shape)), np.nan, found)
        status[part[bad]] = VisionStatus.DEGENERATE
    return BatchEstimate(models.reshape(*leading, *shape), status.reshape(leading))
