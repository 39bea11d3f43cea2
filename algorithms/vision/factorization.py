"""Structure and motion: cameras and points of many views from the join-image of rank 4, also with occlusion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import projective3

from ..arguments import Reals, as_given, real_array
from ..precision import EIGENVALUE, ROOT, ROUNDING, SINGLE
from .degeneracy import degenerate
from .fundamental import eight_points, refined
from .linear_cameras import linear_cameras_of
from .normalization import homogeneous, normalized
from .status import VisionStatus
from .tracks import agreeing, distances, majority_of_pair, noise_of, points_of_most, seen_by_camera
from .two_views import epipoles

_PAIRS = 6
"""Number of pairs of views, those with the most common points, that are tried as the first pair."""
_ROUNDS = 100
"""A limit on work: how often cameras, points and depths are computed in turn."""
_PATIENCE = (4.0, 2.0, 1.0, 1.0, 1.0)
"""Factors of the tolerance of observations, for each round in which outliers are determined: the first cameras are less
accurate than the last."""


@dataclass(frozen=True, slots=True, eq=False)
class Factorization:
    """Cameras and points that reproduce the given images, up to one projective map of space."""

    cameras: Reals
    """(v, 3, 4) of norm 1; NaN for views whose status is not OK."""
    points: Reals
    """(n, 4) homogeneous, of norm 1; NaN for points whose status is not OK."""
    pixels: Reals
    """(v, n, 2) pixels of all points in all views: occluded ones are completed, wrong ones corrected."""
    status: VisionStatus
    """DEGENERATE if no two views determine each other; TOO_FEW if a view is left out; NO_CONSENSUS if fewer than half
    of the points that two views see agree with the cameras. OK does not imply that single points are valid: see
    `point_status`."""
    residual: float
    """The root mean square distance of the inliers, in pixels."""
    singular_values: Reals
    """Singular values of the join-image relative to the first, descending: four, followed by those due to noise."""
    inliers: Reals
    """(v, n) bool: the observations that were used. The others were not given, or contradict these."""
    view_status: Reals
    """(v,) int, a `VisionStatus` for each view: TOO_FEW if it sees fewer than six points that other views see."""
    point_status: Reals
    """(n,) int, a `VisionStatus` for each point: TOO_FEW if fewer than two views see it, NO_CONSENSUS if some
    observations are wrong and no more than two, or no more than half of them, agree."""


def factorize(pixels: ArrayLike, mask: ArrayLike | None = None) -> Factorization:
    """Compute cameras and points from the pixels of the same points in several views, some of them occluded.

    Two views with many common points give a first frame by F and projective depths. Cameras of views that see six known
    points, and points that two known views see, are added alternately. Projected points replace occluded ones in the
    join-image, the matrix of all ``depth (x, y, 1)``, whose first four singular vectors are cameras and points (Sturm
    and Triggs 1996). Weighted linear equations, solved alternately for all cameras and all points, then reduce the
    error in pixels.

    Wrong observations, such as tracks that jumped, are left out: the first pair and every camera come from samples with
    the least median distance, the noise is estimated from the median of all distances, and observations that are off
    by more than five times the noise are not used. If there are no such observations, all are used.

    Parameters
    ----------
    pixels : array_like, (v, n, 2)
        Values excluded by `mask` are arbitrary.
    mask : array_like of bool, (v, n), optional
        Where points are seen; the default is where both numbers of a pixel are not NaN.

    Returns
    -------
    Factorization
        The status is TOO_FEW for fewer than two views or eight points, NOT_FINITE for infinite pixels.

    Raises
    ------
    TypeError, ValueError
        If `pixels` is not one set of views, or if `mask` has a different shape.
    """
    image = real_array(pixels, "pixels", (-1, -1, 2), "views, points, x y").astype(np.float64)
    if image.ndim != 3:
        raise ValueError(f"pixels: shape {image.shape}; expected (views, points, 2)")
    n_views, n_points = image.shape[:2]
    seen = ~np.isnan(image).any(-1) if mask is None else as_given(mask, "mask")
    if seen.dtype != bool or seen.shape != (n_views, n_points):
        raise ValueError(f"mask: {seen.dtype} of shape {seen.shape}; expected bool of shape {(n_views, n_points)}")
    if n_views < 2 or n_points < 8:
        return _nothing(image, VisionStatus.TOO_FEW)
    if not np.isfinite(image[seen]).all():
        return _nothing(image, VisionStatus.NOT_FINITE)
    common = seen.astype(int) @ seen.astype(int).T
    if np.triu(common, 1).max() < 8:
        return _nothing(image, VisionStatus.TOO_FEW)

    # One scale and centre for each view; occluded points have no effect.
    scaled, maps = np.zeros_like(image), np.tile(np.eye(3), (n_views, 1, 1))
    for v in range(n_views):
        if seen[v].any():
            scaled[v, seen[v]], maps[v] = normalized(image[v, seen[v]])
    start = _first_pair(scaled, seen, common)
    if start is None:
        return _nothing(image, VisionStatus.DEGENERATE)
    cameras, points, used = _settled_on_most(scaled, seen, *_extended(scaled, seen, *start))
    views, known = np.asarray(np.isfinite(cameras).all((1, 2))), np.asarray(np.isfinite(points).all(1))
    view_status = np.where(views, VisionStatus.OK, VisionStatus.TOO_FEW)
    point_status = np.where(known, VisionStatus.OK, VisionStatus.NO_CONSENSUS)
    point_status[seen[views].sum(0) < 2] = VisionStatus.TOO_FEW
    if 2 * known.sum() < (point_status != VisionStatus.TOO_FEW).sum() or known.sum() < 8:
        return _nothing(image, VisionStatus.NO_CONSENSUS)
    found, shape, values = _settled(scaled[views][:, known], used[views][:, known], cameras[views], points[known])
    cameras[views] = np.linalg.inv(maps[views]) @ found
    cameras /= np.linalg.norm(cameras, axis=(1, 2), keepdims=True)
    points[known] = shape / np.linalg.norm(shape, axis=1, keepdims=True)
    everywhere = np.einsum("vij,nj->vni", cameras, points)
    with np.errstate(divide="ignore", invalid="ignore"):
        completed = everywhere[..., :2] / everywhere[..., 2:]
    off = (completed - image)[used]
    status = VisionStatus.OK if views.all() else VisionStatus.TOO_FEW
    residual = float(np.sqrt(np.mean((off**2).sum(-1))))
    return Factorization(cameras, points, completed, status, residual, values, used, view_status, point_status)


def _nothing(image: Reals, status: VisionStatus) -> Factorization:
    v, n = image.shape[:2]
    nan = np.nan
    cameras, points, pixels = np.full((v, 3, 4), nan), np.full((n, 4), nan), np.full((v, n, 2), nan)
    inliers, of_views, of_points = np.zeros((v, n), np.bool_), np.full(v, int(status)), np.full(n, int(status))
    return Factorization(cameras, points, pixels, status, nan, np.empty(0), inliers, of_views, of_points)


def _first_pair(image: Reals, seen: Reals, common: Reals) -> tuple[Reals, Reals] | None:
    """Return cameras and points, NaN except for the pair of views that determine each other best."""
    candidates = [(-common[i, j], i - j, i, j) for i in range(len(image)) for j in range(i + 1, len(image))]
    best: tuple[float, Reals, Reals] | None = None
    for _, _, i, j in sorted(candidates)[:_PAIRS]:
        both = seen[i] & seen[j]
        if both.sum() < 8:
            break
        if min(np.ptp(image[v, both], axis=0).max() for v in (i, j)) <= SINGLE:
            continue
        both[both] = majority_of_pair(image[i, both], image[j, both])
        if both.sum() < 8:
            continue
        one, two = image[i, both], image[j, both]
        matrix = refined(eight_points(one, two), one, two)
        if degenerate(matrix, one, two):
            continue
        _, epipole = epipoles(matrix)
        # With these depths the join-image of two views has rank 4.
        ratio = projective3.depth_ratio(matrix, epipole, one, two)
        join = np.concatenate([homogeneous(one), ratio[:, None] * homogeneous(two)], 1).T
        u, s, v = np.linalg.svd(join, full_matrices=False)
        quality = s[3] / s[0]
        if best is None or quality > best[0]:
            cameras, points = np.full((len(image), 3, 4), np.nan), np.full((image.shape[1], 4), np.nan)
            cameras[[i, j]] = (u[:, :4] * np.sqrt(s[:4])).reshape(2, 3, 4)
            points[both] = (np.sqrt(s[:4, None]) * v[:4]).T
            best = quality, cameras, points
    return None if best is None else (best[1], best[2])


def _extended(image: Reals, seen: Reals, cameras: Reals, points: Reals) -> tuple[Reals, Reals]:
    """Add cameras of views with six or more known points, and points that two known views see, alternately."""
    while True:
        views, known = np.asarray(np.isfinite(cameras).all((1, 2))), np.asarray(np.isfinite(points).all(1))
        open_views = [v for v in np.nonzero(~views)[0] if (seen[v] & known).sum() >= 6]
        if open_views:
            v = max(open_views, key=lambda v: int((seen[v] & known).sum()))
            visible = np.flatnonzero(seen[v] & known)
            if len(visible) >= 8:
                right = seen_by_camera(image[v, visible], points[visible])
                visible = visible[right] if right.sum() >= 6 else visible
            cameras[v] = linear_cameras_of(image[v : v + 1, visible], np.ones((1, len(visible))), points[visible])[0]
            views[v] = True
        open_points = ~known & (seen[views].sum(0) >= 2)
        if open_points.any():
            points[open_points] = _points(
                image[views][:, open_points], seen[views][:, open_points].astype(float), cameras[views]
            )
        if not open_views and not open_points.any():
            return cameras, points


def _settled_on_most(image: Reals, seen: Reals, cameras: Reals, points: Reals) -> tuple[Reals, Reals, Reals]:
    """Return cameras and points, NaN where too few observations agree, and the observations (v, n) that agree."""
    views = np.asarray(np.isfinite(cameras).all((1, 2)))
    considered = seen & views[:, None] & (seen[views].sum(0) >= 2)
    used = considered & np.isfinite(points).all(1)
    for patience in _PATIENCE:
        off = distances(image, cameras, points)
        noise = patience * noise_of(off, used)
        right = agreeing(off, considered, noise)
        doubtful = np.flatnonzero((considered & ~right).any(0))
        if len(doubtful):
            right[:, doubtful], points[doubtful] = _reconsidered(
                image[:, doubtful], considered[:, doubtful], cameras, noise, views
            )
        # Two observations agree on a point if they satisfy the epipolar constraint, which may happen by chance.
        agreed, whole = right.sum(0), considered.sum(0)
        right &= (agreed == whole) | ((agreed >= 3) & (2 * agreed > whole))
        known = right.sum(0) >= 2
        points[~known] = np.nan
        if known.sum() < 8 or (patience == 1 and np.array_equal(right, used)):
            used = right
            break
        used = right
        cameras[views], points[known], _ = _settled(
            image[views][:, known], used[views][:, known], cameras[views], points[known]
        )
    return cameras, points, used


def _reconsidered(image: Reals, considered: Reals, cameras: Reals, noise: float, views: Reals) -> tuple[Reals, Reals]:
    """Return which observations (v, n) of points with outliers agree, and the points (n, 4) from these."""
    points = points_of_most(image[views], considered[views], cameras[views])
    right = agreeing(distances(image, cameras, points), considered, noise)
    enough = right.sum(0) >= 2
    if enough.any():
        weights = right[views][:, enough] / _depths(cameras[views], points[enough])
        points[enough] = _points(image[views][:, enough], weights, cameras[views])
    return agreeing(distances(image, cameras, points), considered, noise), points


def _settled(image: Reals, seen: Reals, cameras: Reals, points: Reals) -> tuple[Reals, Reals, Reals]:
    """Return refined cameras and points, and the singular values of the completed join-image."""
    n_views, n_points = seen.shape
    values = np.empty(0)
    for sweep in range(2):
        projected = np.einsum("vij,nj->vni", cameras, points)
        join = np.where(seen[..., None], projected[..., 2:] * homogeneous(image), projected)
        # Rows and columns of norm 1: the scales of homogeneous coordinates have no influence.
        join = join / np.linalg.norm(join, axis=(0, 2))[None, :, None]
        join = join / np.linalg.norm(join, axis=(1, 2))[:, None, None]
        u, s, v = np.linalg.svd(np.swapaxes(join, 1, 2).reshape(3 * n_views, n_points), full_matrices=False)
        values = s / s[0]
        if sweep == 0 or np.allclose(values[4:], 0, atol=1e-12):
            cameras, points = (u[:, :4] * s[:4]).reshape(n_views, 3, 4), v[:4].T
    error = _error(image, seen, cameras, points)
    for _ in range(_ROUNDS):
        if error <= EIGENVALUE:
            break
        new_cameras = linear_cameras_of(image, seen / _depths(cameras, points), points)
        moved = _points(image, seen / _depths(new_cameras, points), new_cameras)
        new = _error(image, seen, new_cameras, moved)
        if not new < error:
            break
        change, cameras, points, error = error - new, new_cameras, moved, new
        if change <= ROOT * error:
            break
    return cameras, points, values


def _depths(cameras: Reals, points: Reals) -> Reals:
    depth = np.abs(np.einsum("vj,nj->vn", cameras[:, 2], points))
    return np.asarray(np.maximum(depth, ROUNDING * depth.max()))


def _error(image: Reals, seen: Reals, cameras: Reals, points: Reals) -> float:
    x = np.einsum("vij,nj->vni", cameras, points)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.sqrt(np.mean((x[..., :2] / x[..., 2:] - image)[seen] ** 2)))


def _points(image: Reals, weights: Reals, cameras: Reals) -> Reals:
    """Return points (n, 4) from cameras (v, 3, 4)."""
    rows = [weights[..., None] * (image[..., k, None] * cameras[:, None, 2] - cameras[:, None, k]) for k in (0, 1)]
    whole = np.concatenate(rows).transpose(1, 0, 2)
    # There are fewer than four rows only for points seen by one view, which are not requested.
    return np.asarray(np.linalg.svd(whole, full_matrices=False)[2][:, -1])
