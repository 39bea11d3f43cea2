"""Batches of small problems: F, homographies and poses over leading axes, by linear equations and few iterations.

For one problem with many points or with outliers, use `fundamental_matrix`, `homography`, `localize` and their robust
variants, which also iterate longer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, check_pixels, leading_axes, real_array
from ..precision import NEGLIGIBLE, ROOT
from .camera import Camera, pinhole_pixels
from .degeneracy import degenerate
from .fundamental import eight_points
from .localization import checked_intrinsics
from .normalization import three_on_a_line
from .planes import homography_of_four, linear_homography
from .pose_refinement import all_poses, camera_motors, pixel_noise, pose_status
from .status import VisionStatus

_BLOCK = 256
"""Number of problems solved at once, so that their equations remain in a cache."""


@dataclass(frozen=True, slots=True, eq=False)
class BatchEstimate:
    """Independent estimates for many sets of points."""

    models: Reals
    """(..., 3, 3), or (..., 8) for poses; NaN if the status is not OK."""
    status: Reals
    """(...) int, a `VisionStatus` for each set."""


def fundamental_matrices(first: ArrayLike, second: ArrayLike, noise: float | None = None) -> BatchEstimate:
    """Estimate fundamental matrices of many sets of points by the normalised eight-point algorithm.

    Parameters
    ----------
    first, second : array_like, (..., n, 2)
        Pixels of n points in each set, with n at least 8.
    noise : float, optional
        The standard deviation of pixels, if known; see `fundamental_matrix` for the sets that are rejected.

    Returns
    -------
    BatchEstimate
        F of rank 2 and norm 1.

    Raises
    ------
    TypeError, ValueError
        If the shapes differ, or if `noise` is not positive.
    """
    one, two, leading = _sets(first, second, "first", "second", (2, 2))
    check_pixels(noise, "noise")

    def solve(a: Reals, b: Reals) -> tuple[Reals, Reals]:
        matrix = eight_points(a, b)
        return matrix, np.where(degenerate(matrix, a, b, noise), VisionStatus.DEGENERATE, VisionStatus.OK)

    return _all(solve, one, two, leading, 8, (3, 3))


def homographies(first: ArrayLike, second: ArrayLike) -> BatchEstimate:
    """Estimate homographies of many sets of points of planes, by linear least squares.

    Parameters
    ----------
    first, second : array_like, (..., n, 2)
        n points in each set, with n at least 4.

    Returns
    -------
    BatchEstimate
        Matrices of norm 1.

    Raises
    ------
    TypeError, ValueError
        If the shapes differ.
    """
    one, two, leading = _sets(first, second, "first", "second", (2, 2))

    def solve(a: Reals, b: Reals) -> tuple[Reals, Reals]:
        if a.shape[1] == 4:
            matrix, open_ = homography_of_four(a, b), three_on_a_line(a, NEGLIGIBLE) | three_on_a_line(b, NEGLIGIBLE)
        else:
            matrix, gap = linear_homography(a, b)
            open_ = gap <= ROOT
        return matrix, np.where(open_, VisionStatus.DEGENERATE, VisionStatus.OK)

    return _all(solve, one, two, leading, 4, (3, 3))


def localizations(
    points: ArrayLike, pixels: ArrayLike, intrinsics: ArrayLike | Camera, n_steps: int = 200
) -> BatchEstimate:
    """Estimate the poses of many cameras, or of one camera at many times, from known points and their pixels.

    It corresponds to `localize` without `threshold`, for many sets of points at once.

    Parameters
    ----------
    points : array_like, (..., n, 3)
        World coordinates of n points in each set, with n at least 4, in space or on a plane.
    pixels : array_like, (..., n, 2)
    intrinsics : array_like, (3, 3), or Camera
        As in `Camera`. The pose of a camera is not used; the distortion of its lens is removed from the pixels first,
        and distances are those in the image of its pinhole. Pixels that the lens shows for no point are not finite.
    n_steps : int
        Maximum number of Levenberg-Marquardt iterations; if they do not suffice, the status is NOT_CONVERGED.

    Returns
    -------
    BatchEstimate
        Unit motors from the camera frame to the world frame, and the statuses of `localize`.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points and pixels differ, or if `intrinsics` is not upper triangular and regular.
    """
    matrix, plain = pinhole_pixels(intrinsics, pixels, "pixels", (-1, 2))
    places, image, leading = _sets(points, plain, "points", "pixels", (3, 2))
    k = checked_intrinsics(matrix)

    def solve(a: Reals, b: Reals) -> tuple[Reals, Reals]:
        centroid = a.mean(1)
        about = a - centroid[:, None]
        found = all_poses(about, b, k, n_steps, pixel_noise(k))
        return camera_motors(found.matrix[:, 0], centroid), pose_status(found, about, b, k, pixel_noise(k))[0]

    return _all(solve, places, image, leading, 4, (8,))


def _sets(
    first: ArrayLike, second: ArrayLike, name: str, other: str, sizes: tuple[int, int]
) -> tuple[Reals, Reals, tuple[int, ...]]:
    """Return both as (sets, n, d) in double precision, and their broadcast leading axes."""
    one = real_array(first, name, (-1, sizes[0]), "points")
    two = real_array(second, other, (-1, sizes[1]), "points")
    if one.shape[-2] != two.shape[-2]:
        raise ValueError(f"{other}: {two.shape[-2]} points; expected {one.shape[-2]}, as many as {name} has")
    leading = leading_axes((name, one.shape[:-2]), (other, two.shape[:-2]))
    one, two = (np.broadcast_to(x, (*leading, *x.shape[-2:])).reshape(prod(leading), *x.shape[-2:]) for x in (one, two))
    return one.astype(np.float64), two.astype(np.float64), leading


def _all(
    solve: Callable[[Reals, Reals], tuple[Reals, Reals]],
    one: Reals,
    two: Reals,
    leading: tuple[int, ...],
    least: int,
    shape: tuple[int, ...],
) -> BatchEstimate:
    """Solve all sets in blocks; sets with numbers that are not finite are skipped."""
    models, status = np.full((len(one), *shape), np.nan), np.zeros(len(one), int)
    finite = np.asarray(np.isfinite(one).all((1, 2)) & np.isfinite(two).all((1, 2)))
    status[~finite] = VisionStatus.NOT_FINITE
    if one.shape[1] < least:
        status[finite] = VisionStatus.TOO_FEW
        finite[:] = False
    where = np.nonzero(finite)[0]
    for start in range(0, len(where), _BLOCK):
        part = where[start : start + _BLOCK]
        found, states = solve(one[part], two[part])
        states = np.where(np.isfinite(found).reshape(len(part), -1).all(1), states, VisionStatus.DEGENERATE)
        good = (states == VisionStatus.OK).reshape(-1, *(1 for _ in shape))
        models[part], status[part] = np.where(good, found, np.nan), states
    return BatchEstimate(models.reshape(*leading, *shape), status.reshape(leading))
