"""Whether views of planes agree with a camera, and whether they determine it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generated import pga3, projective2

from ..arguments import Reals
from ..evidence import WRONG, largest_ratio, rank
from ..evidence.misfit import contradicts, exceeds_noise, explained_by, misfit, root_of
from ..evidence.noise import USUAL_WEIGHT
from ..precision import NEGLIGIBLE
from .distortion import Distortion
from .plane_adjustment import N_INTRINSICS, N_POSE, Adjustment, Lens, Views, adjusted, equations
from .pose_refinement import EXPLAINED
from .status import VisionStatus

_CANDIDATES = 12
"""A limit on work: the number of views that are left out for a trial."""


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
    return np.asarray(costs <= _largest(costs, freedoms, views))


def _largest(costs: Reals, freedoms: Reals, views: Views) -> Reals:
    """Return the largest sums of squares (v,) that the noise of other views explains."""
    known = (freedoms > 0) & np.isfinite(costs)
    if not known.any():
        return np.full(len(costs), np.inf)
    exact = (NEGLIGIBLE * np.abs(views.pixels).max()) ** 2
    usual = max(float(np.median(costs[known] / freedoms[known])), exact)
    ratios = np.array([largest_ratio(max(int(n), 1), USUAL_WEIGHT) for n in freedoms])
    return np.asarray(usual * np.maximum(freedoms, 1) * ratios)


def judged(starts: list[Lens], views: Views, used: Reals, inliers: Reals) -> Judged:
    """Return the least minimum from several starts, over the views that agree, with its status.

    While views do not agree, and more than half of them remain, the one without which the others agree best is left
    out. Views that only the starts exclude are taken back once, if their sums of squares agree.
    """
    n = len(views.places)
    least, excluded = n // 2 + 1, not inliers.all()
    while True:
        if inliers.sum() < least:
            return _nothing(VisionStatus.NO_CONSENSUS, inliers, len(used))
        fits = [adjusted(_with(each, each.poses[inliers]), views.part(inliers), used) for each in starts]
        fits = [each for each in fits if np.isfinite(each.cost)]
        if not fits:
            return _nothing(VisionStatus.DEGENERATE, inliers, len(used))
        fit = min(fits, key=lambda each: each.cost)
        poses, costs = np.array(starts[0].poses), np.empty(n)
        poses[inliers], costs[inliers] = fit.lens.poses, fit.costs
        if not inliers.all():
            rest = adjusted(_with(fit.lens, poses[~inliers]), views.part(~inliers), np.empty(0, int))
            poses[~inliers], costs[~inliers] = rest.lens.poses, rest.costs
        starts = [_with(fit.lens, poses)]
        excess = _excess(starts[0], costs, views, not inliers.all())
        worst = np.where(inliers, excess, 0)
        if not (worst > 1).any() or inliers.sum() <= least:
            alike = agreeing(costs, 2 * views.weights.sum(1) - N_POSE, views)
            if excluded and alike[~inliers].any():
                inliers, excluded = inliers | alike, False
                continue
            break
        inliers = _without_one(starts[0], views, used, inliers, worst)
    whole = Adjustment(starts[0], costs, fit.information, fit.converged)
    counts = views.weights.sum(1)
    residual = float(np.sqrt(fit.cost / counts[inliers].sum()))
    status, covariance = _status(fit, views.part(inliers), used)
    if not inliers.all():
        excess = _excess(starts[0], costs, views, False)
    if status == VisionStatus.OK and (excess[inliers] > 1).any():
        status = VisionStatus.NOT_CONVERGED if inliers.all() else VisionStatus.NO_CONSENSUS
    return Judged(status, whole, inliers, residual, np.sqrt(costs / counts), covariance)


def _without_one(lens: Lens, views: Views, used: Reals, inliers: Reals, worst: Reals) -> Reals:
    """Return the inliers without the one that leaves the least mean square of the others.

    A wrong view bends the camera, so that others may look worse than itself.
    """
    best, least = inliers, np.inf
    for k in np.argsort(-worst)[:_CANDIDATES]:
        rest = inliers & (np.arange(len(inliers)) != k)
        if not inliers[k] or rest.sum() < 2:
            continue
        fit = adjusted(_with(lens, lens.poses[rest]), views.part(rest), used)
        mean = fit.cost / max(2 * float(views.weights[rest].sum()) - N_POSE * float(rest.sum()), 1.0)
        if mean < least:
            best, least = rest, mean
    return best


def _excess(lens: Lens, costs: Reals, views: Views, is_strict: bool) -> Reals:
    """Return how far views (v,) disagree with the others: more than 1 if they do.

    A view disagrees if its sum of squares is larger than the noise of the others explains. It also does if a homography
    explains more of it than noise would, and than it leaves: two terms more than the pose of the plane, its shear and
    the ratio of its sides. Boards are not exactly flat, which explains a little. If other views are known to be wrong
    (`is_strict`), it is more likely that this one is, too.
    """
    counts = 2 * views.weights.sum(1)
    ratios = costs / np.maximum(_largest(costs, counts - N_POSE, views), np.finfo(float).tiny)
    off, rows, _ = equations(lens, views)
    rows = rows[..., N_INTRINSICS + len(lens.k) :]
    x, y = views.places[..., None, 0], views.places[..., None, 1]
    right, up, _ = np.moveaxis(_by_places(lens, views, rows), -1, 0)
    terms = np.stack([right * x - up * y, up * x + right * y], -1).reshape(*off.shape, 2)
    columns = np.concatenate([rows, terms, off[..., None]], -1)
    normal = np.swapaxes(columns, 1, 2) @ columns
    size = np.sqrt(np.diagonal(normal, axis1=1, axis2=2))
    scale = np.where(size > 0, size, 1)
    freedoms = counts - N_POSE - 2
    known = (freedoms > 0) & np.isfinite(normal).all((1, 2))
    root = root_of((normal / (scale[:, None] * scale[..., None]))[known])
    explained = explained_by(root[:, N_POSE:, N_POSE:]).squares[:, -1] * size[known, -1] ** 2
    left, exact = np.maximum(costs[known] - explained, 0.0), (NEGLIGIBLE * np.abs(views.pixels).max()) ** 2
    quantiles = np.array([largest_ratio(2, int(n), WRONG / len(costs)) for n in freedoms[known]])
    by_noise = 2 * quantiles * left / freedoms[known]
    least = by_noise if is_strict else np.maximum(by_noise, left)
    ratios[known] = np.maximum(ratios[known], explained / np.maximum(least, exact * counts[known]))
    return np.asarray(ratios)


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
        # The equations are linear in 1 / f^2; if that may be 0, the views may be parallel projections.
        spread = np.array([2, 2, 1, 1]) * np.sqrt(np.diag(covariance)[:4] * largest_ratio(1, freedom))
        if not (spread < np.abs(fit.lens.intrinsics[[0, 1, 0, 1]])).all():
            return VisionStatus.DEGENERATE, covariance
    middle = (views.weights[..., None] * views.pixels).sum(1) / views.weights.sum(1)[:, None]
    squares = (views.weights[..., None] * (views.pixels - middle[:, None]) ** 2).sum()
    contradicted, more = _contradicted(fit, views, used, freedom)
    valid = fit.converged and fit.cost <= EXPLAINED * squares and not contradicted
    return (VisionStatus.OK if valid else VisionStatus.NOT_CONVERGED), covariance + more


def _contradicted(fit: Adjustment, views: Views, used: Reals, freedom: int) -> tuple[bool, Reals]:
    """Return whether points are beyond the range of a lens, or what the model lacks explains the residuals.

    That are further terms of distortion and of the shape of the planes, and motions of the camera while rows of a view
    are read one after the other (rolling shutter). Residuals and their derivatives by these are compared across the
    derivatives by all parameters. If they explain more than noise would, the second result (p, p) is what they add to
    the covariance of the parameters: by how much they would move these, and how uncertain that is.
    """
    off, rows, sights = equations(fit.lens, views)
    seen, size = views.weights > 0, len(used)
    lens = Distortion(fit.lens.model, tuple(map(float, fit.lens.k)))
    if not np.isfinite(lens.distort(sights[seen])).all():
        return True, np.zeros((size, size))
    by_pose, n_views = rows[..., N_INTRINSICS + len(fit.lens.k) :], len(off)
    terms = [*_terms(fit.lens, sights), *_of_boards(views, _by_places(fit.lens, views, by_pose))]
    # Rows of the images are free of the noise, with which that of pixels is correlated.
    images = views.pixels[..., 1] + off.reshape(views.pixels.shape)[..., 1]
    later = np.repeat(images - images.mean(1, keepdims=True), 2, axis=1)
    own, n_terms, n_motions = 2 * N_POSE, len(terms), N_POSE * n_views
    columns = np.empty((n_views, own + size + n_terms + 1, off.shape[1]))
    columns[:, :N_POSE] = np.swapaxes(by_pose, 1, 2)
    columns[:, N_POSE:own] = columns[:, :N_POSE] * later[:, None]
    columns[:, own : own + size] = np.swapaxes(rows[..., used], 1, 2)
    for i, (x, y) in enumerate(terms, own + size):
        columns[:, i, ::2], columns[:, i, 1::2] = np.where(seen, x, 0), np.where(seen, y, 0)
    columns[:, -1] = off
    products = columns @ np.swapaxes(columns, 1, 2)
    norms = np.sqrt(np.einsum("vii->i", products))
    norms = np.where(norms > 0, norms, 1)
    rounding = float((NEGLIGIBLE**2 * views.pixels[seen] ** 2).sum())
    # Motions come after poses: the columns of the root that belong to these are left out, with those of motions or not.
    root, norms = root_of(products / np.outer(norms, norms))[:, own:], norms[own:]
    still, moving = (_products(root[..., n:]) * np.outer(norms, norms) for n in (N_POSE, own))
    found = misfit(still, size, freedom, rounding=rounding, norms=norms)
    more = np.zeros((size, size)) if found.more is None else found.more
    by_terms, by_both = (_left(each, norms) for each in (still, moving))
    by_motions = by_terms - by_both, by_terms, n_motions, freedom - n_motions - n_terms, rounding
    kept = np.array([*range(size), -1])
    moving, norms = moving[np.ix_(kept, kept)], norms[kept]
    variance = _left(moving, norms) / max(freedom - n_motions, 1)
    if variance < by_terms / max(freedom - n_terms, 1) and exceeds_noise(*by_motions):
        spread = np.linalg.pinv(moving[:-1, :-1], hermitian=True)
        shift = spread @ moving[:-1, -1]
        more = more + np.outer(shift, shift) + variance * spread
    return found.contradicts or contradicts(*by_motions), more


def _products(rows: Reals) -> Reals:
    """Return the sums (q, q) over views of products of rows (v, q, n)."""
    flat = np.swapaxes(rows, 0, 1).reshape(rows.shape[1], -1)
    return np.asarray(flat @ flat.T)


def _left(normal: Reals, norms: Reals) -> float:
    """Return the sum of squares that columns with sums of products (q, q) leave of the last one."""
    return float(root_of(normal / np.outer(norms, norms))[-1, -1] * norms[-1]) ** 2


def _by_places(lens: Lens, views: Views, by_pose: Reals) -> Reals:
    """Return the derivatives (v, n, 2, 3) of pixels by coordinates of the points of planes, up to a factor."""
    # The last three columns are the derivatives by translations, up to a factor.
    slopes = by_pose[..., 3:].reshape(*views.weights.shape, 2, 3)
    return np.asarray(slopes @ pga3.motor_to_matrix(lens.poses)[:, None, :3, :3])


def _of_boards(views: Views, by_places: Reals) -> list[tuple[Reals, Reals]]:
    """Return displacements in pixels, x and y (v, n), of points of a plane whose sides, squares or flatness are wrong.

    There are 11 of them.
    """
    x, y = views.places[..., 0], views.places[..., 1]
    factors = [(x, 0), (y, 0), *((xy, i) for i in range(3) for xy in (x * x, x * y, y * y))]
    return [(by_places[..., 0, i] * factor, by_places[..., 1, i] * factor) for factor, i in factors]


def _terms(lens: Lens, sights: Reals) -> list[tuple[Reals, Reals]]:
    """Return displacements in pixels, x and y (v, n), by seven radial and tangential terms of distortion."""
    with np.errstate(all="ignore"):
        if lens.model == "brown":
            places = sights[..., :2] / sights[..., 2:]
        else:
            far = np.linalg.norm(sights[..., :2], axis=-1)
            places = sights[..., :2] * (np.arctan2(far, sights[..., 2]) / np.where(far > 0, far, 1))[..., None]
    x, y = places[..., 0], places[..., 1]
    s = x * x + y * y
    fx, fy, _, _, skew = lens.intrinsics
    along, down = fx * x + skew * y, fy * y
    pairs = [(2 * x * y, s + 2 * y * y), (s + 2 * x * x, 2 * x * y)]
    powers = [s]
    for _ in range(4):
        powers.append(powers[-1] * s)
    return [(along * s, down * s) for s in powers] + [(fx * a + skew * b, fy * b) for a, b in pairs]
