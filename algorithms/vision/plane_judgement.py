"""Whether views of planes agree with a camera, and whether they determine it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generated import projective2

from ..arguments import Reals
from ..evidence import Noise, largest_ratio, rank
from .distortion import Distortion
from .plane_adjustment import N_INTRINSICS, N_POSE, Adjustment, Lens, Views, adjusted, equations
from .plane_equations import contradicts, explained_by
from .status import VisionStatus

_WEIGHT = 4.0
"""From a probability: the noise of a photograph is known from that of others as well as by this number of residuals; a
seventh to five times as much is not a contradiction."""
_EXPLAINED = 0.03
"""The largest part of the squares of pixels about their centroid that the images of points leave; random pixels leave
more, as in `localize`."""
_ROUNDING = 1e-9
"""From floating point: distances below this fraction of pixels are rounding errors."""
_ROUNDS = 10
"""A limit on work: the number of selections of views."""


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A minimum, and what it is worth."""

    status: VisionStatus
    fit: Adjustment | None
    """With the poses of all views."""
    inliers: Reals
    """(v,) bool"""
    residual: float
    view_residuals: Reals
    """(v,)"""
    covariance: Reals
    """(p, p)"""


def likely_views(views: Views, matrices: Reals) -> Reals:
    """Return which views (v,) are images of a plane by a homography (v, 3, 3), as well as the others are."""
    with np.errstate(all="ignore"):
        off = projective2.transform_point(matrices[:, None], views.places) - views.pixels
    squares = np.where(views.weights > 0, (off**2).sum(-1), 0).sum(1)
    return agreeing(squares, 2 * views.weights.sum(1) - 8, views)


def agreeing(costs: Reals, freedoms: Reals, views: Views) -> Reals:
    """Return which sums of squares (v,) with degrees of freedom (v,) are not larger than those of others explain."""
    known = freedoms > 0
    if not known.any():
        return np.isfinite(costs)
    exact = (_ROUNDING * np.abs(views.pixels).max()) ** 2
    usual = Noise(max(float(np.median(costs[known] / freedoms[known])), exact), _WEIGHT)
    pairs = zip(costs, freedoms, strict=True)
    return np.array([np.isfinite(c) and not usual.contradicted(c, int(f)) for c, f in pairs], bool)


def judged(starts: list[Lens], views: Views, used: Reals, inliers: Reals) -> Judged:
    """Return the least minimum from several starts, over the views that agree, with its status."""
    n = len(views.places)
    least = max(2, -(-n // 2))
    for _ in range(_ROUNDS):
        if inliers.sum() < least:
            return _nothing(VisionStatus.NO_CONSENSUS, inliers, len(used))
        fits = [adjusted(_with(each, each.poses[inliers]), views.part(inliers), used) for each in starts]
        fits = [each for each in fits if np.isfinite(each.cost)]
        if not fits:
            return _nothing(VisionStatus.DEGENERATE, inliers, len(used))
        fit = min(fits, key=lambda each: each.cost)
        poses = np.array(starts[0].poses)
        poses[inliers] = fit.lens.poses
        costs = np.empty(n)
        costs[inliers] = fit.costs
        if not inliers.all():
            rest = adjusted(_with(fit.lens, poses[~inliers]), views.part(~inliers), np.empty(0, int))
            poses[~inliers], costs[~inliers] = rest.lens.poses, rest.costs
        before, starts = inliers, [_with(fit.lens, poses)]
        inliers = agreeing(costs, 2 * views.weights.sum(1) - N_POSE, views)
        if np.array_equal(before, inliers):
            break
    whole = Adjustment(starts[0], costs, fit.information, fit.converged)
    counts = views.weights.sum(1)
    residual = float(np.sqrt(fit.cost / counts[before].sum()))
    status, covariance = _status(fit, views.part(before), used)
    return Judged(status, whole, before, residual, np.sqrt(costs / counts), covariance)


def _nothing(status: VisionStatus, inliers: Reals, size: int) -> Judged:
    return Judged(status, None, inliers, np.nan, np.full(len(inliers), np.nan), np.full((size, size), np.inf))


def _with(lens: Lens, poses: Reals) -> Lens:
    return Lens(lens.model, lens.intrinsics, lens.k, poses)


def _status(fit: Adjustment, views: Views, used: Reals) -> tuple[VisionStatus, Reals]:
    """Return the status of a minimum, and the covariance of its parameters."""
    size = len(used)
    unknown = np.full((size, size), np.inf)
    freedom = int(2 * views.weights.sum()) - size - N_POSE * len(views.places)
    if not np.isfinite(fit.information).all() or rank(fit.information) < size:
        return VisionStatus.DEGENERATE, unknown
    covariance = unknown
    if freedom > 0:
        variance = fit.cost / freedom
        covariance = variance * np.linalg.inv(fit.information)
        spread = np.sqrt(np.diag(covariance)[:4] * largest_ratio(1, freedom))
        if not (spread < np.abs(fit.lens.intrinsics[[0, 1, 0, 1]])).all():
            return VisionStatus.DEGENERATE, covariance
    middle = (views.weights[..., None] * views.pixels).sum(1) / views.weights.sum(1)[:, None]
    squares = (views.weights[..., None] * (views.pixels - middle[:, None]) ** 2).sum()
    valid = fit.converged and fit.cost <= _EXPLAINED * squares and not _contradicted(fit, views, used, freedom)
    return (VisionStatus.OK if valid else VisionStatus.NOT_CONVERGED), covariance


def _contradicted(fit: Adjustment, views: Views, used: Reals, freedom: int) -> bool:
    """Return whether points are beyond the range of a lens, or further terms of distortion explain the residuals.

    Residuals and their derivatives by the terms are compared across the derivatives by all parameters.
    """
    off, rows, sights = equations(fit.lens, views)
    seen = views.weights > 0
    lens = Distortion(fit.lens.model, tuple(map(float, fit.lens.k)))
    if not np.isfinite(lens.distort(sights[seen])).all():
        return True
    terms = np.where(seen[..., None, None], _terms(fit.lens, sights), 0)
    terms = terms.reshape(*off.shape, terms.shape[-1])
    size = len(used)
    columns = np.concatenate([rows[..., N_INTRINSICS + len(fit.lens.k) :], rows[..., used], terms, off[..., None]], -1)
    scale = np.sqrt((columns**2).sum((0, 1)))
    columns = columns / np.where(scale > 0, scale, 1)
    normal = _eliminated(np.swapaxes(columns, 1, 2) @ columns, N_POSE).sum(0)
    normal = _eliminated(normal[None], size)[0]
    found = explained_by(normal)
    rounding = float((_ROUNDING**2 * views.pixels[seen] ** 2).sum()) / max(float(scale[-1]) ** 2, 1e-300)
    return contradicts(found.explained, float(normal[-1, -1]), found.n_terms, freedom - found.n_terms, rounding)


def _eliminated(normal: Reals, size: int) -> Reals:
    """Return sums of products (v, q - size, q - size) across the first columns."""
    own, across = normal[:, :size, :size], normal[:, :size, size:]
    return np.asarray(normal[:, size:, size:] - np.swapaxes(across, 1, 2) @ np.linalg.solve(own, across))


def _terms(lens: Lens, sights: Reals) -> Reals:
    """Return displacements in pixels (v, n, 2, 11) by radial, tangential and prism terms of distortion."""
    with np.errstate(all="ignore"):
        if lens.model == "brown":
            places = sights[..., :2] / sights[..., 2:]
        else:
            far = np.linalg.norm(sights[..., :2], axis=-1)
            places = sights[..., :2] * (np.arctan2(far, sights[..., 2]) / np.where(far > 0, far, 1))[..., None]
    x, y = places[..., 0], places[..., 1]
    s, zero = x * x + y * y, np.zeros_like(x)
    pairs = [(x * s**k, y * s**k) for k in range(1, 6)]
    pairs += [(2 * x * y, s + 2 * y * y), (s + 2 * x * x, 2 * x * y)]
    pairs += [(s, zero), (zero, s), (s * s, zero), (zero, s * s)]
    fx, fy, _, _, skew = lens.intrinsics
    return np.stack([np.stack([fx * a + skew * b, fy * b], -1) for a, b in pairs], -1)
