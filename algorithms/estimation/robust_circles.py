"""Rejection of wrongly tracked points: the axis with which most points of most tracks agree.

The axes of three points of single tracks are candidates, as in random sample consensus. The distances of all points
from their circles about each candidate are compared with a threshold; the best candidates are refined on the points
within it until these no longer change, and the one with the least truncated squared distances is taken (MSAC).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generated import body_eye as kernels
from generated import pga3

from ..arguments import Reals
from ..evidence import WRONG, Noise, largest_ratio
from ..evidence.noise import ENOUGH
from ..precision import ROUNDING, TINY
from .circles_of_points import BodyEyeStatus, Tracks, first_axis, refined

_CANDIDATES, _REFINED = 400, 8
"""The number of candidates, and of those that are refined."""
_STEPS = 10
"""Maximum number of refinements of a candidate."""
_REWEIGHTED = 5
"""How often the circle of a track is computed with weights."""
_ROUNDING = 1e-20
"""From floating point: squared distances below this, in units of length, are rounding."""
_AT_ONCE = 200_000
"""The number of distances that are computed at once."""
LEAST_SHARE = 0.5
"""A track is left out if a smaller share of its points agrees with the axis, and tracks are not circles if a smaller
share of all points does."""
_ENTRIES = [[0, 1, 3], [1, 2, 4], [3, 4, 5]]
"""The places of the entries of a symmetric matrix in its lower triangle."""

Mask = NDArray[np.bool_]


def without_wrong_points(tracks: Tracks, threshold: float, seed: int) -> Tracks:
    """Return the points that agree on an axis: those within a distance of their circles about it.

    The distance is in the unit of length, or in standard deviations if the points have covariances. If there is no
    candidate, all points are returned.
    """
    lines = _candidates(tracks, np.random.default_rng(seed))
    if not len(lines):
        return tracks
    bound = threshold * threshold
    costs = np.minimum(_squares(lines, tracks), bound).sum(1)
    best, cost = np.zeros(len(tracks.points), bool), np.inf
    for line in lines[np.argsort(costs)[:_REFINED]]:
        within, own = _improved(line, tracks, bound)
        if own < cost:
            best, cost = within, own
    return tracks.subset(best)


def noise_threshold(line: Reals, tracks: Tracks, seed: int) -> float | None:
    """Return the distance from which points contradict the noise of most others, or None if no point does.

    The noise follows from the median of the distances from the circles about an axis: the given one if no point
    contradicts it, or else that of a candidate with the least median, after refinement.
    """
    if len(tracks.points) < ENOUGH:
        return None
    if line.any() and _beyond(_squares(line[None], tracks)[0], tracks)[0] is None:
        return None
    lines = _candidates(tracks, np.random.default_rng(seed))
    if not len(lines):
        return None
    best = lines[int(np.argmin(np.median(_squares(lines, tracks), axis=1)))]
    squares = _squares(best[None], tracks)[0]
    least = np.inf
    for _ in range(_STEPS):
        bound = _beyond(squares, tracks)[1]
        if not 0 < bound < least:
            break
        least = bound
        part = tracks.subset(_agreeing(squares, tracks, bound))
        status, start = first_axis(part)
        if status != BodyEyeStatus.OK:
            break
        fit = refined([part], start[None], np.eye(8)[0])
        if not np.isfinite(fit.motor).all():
            break
        squares = _squares_of_means(np.asarray(pga3.move_line(fit.motor, start)), tracks, bound)
    return float(np.sqrt(least)) if 0 < least < np.inf else None


def _beyond(squares: Reals, tracks: Tracks) -> tuple[float | None, float]:
    """Return the largest square if it contradicts the noise, or None, and the largest square that does not."""
    n = len(squares)
    median = float(np.median(squares)) / largest_ratio(2, probability=0.5) / 2
    variance = float(Noise(tracks.noise.variance).raised(np.asarray(median * n), n))
    bound = 2 * largest_ratio(2, n, WRONG / n) * variance
    largest = float(squares.max())
    return (largest if largest > bound + _ROUNDING * tracks.scale else None), bound


def _candidates(tracks: Tracks, rng: np.random.Generator) -> Reals:
    """Return the axes of three points of random tracks, from the first, second and last third of each."""
    counts = tracks.counts.astype(int)
    if not len(counts):
        return np.zeros((0, 6))
    chosen = rng.integers(0, len(counts), _CANDIDATES)
    starts = np.cumsum(counts) - counts
    places = (np.arange(3) + rng.random((_CANDIDATES, 3))) / 3
    rows = starts[chosen][:, None] + np.floor(places * counts[chosen][:, None]).astype(int)
    axes = kernels.axis_of_three_points(*tracks.points[rows.T])
    with np.errstate(divide="ignore", invalid="ignore"):
        lines = np.asarray(pga3.normalize_line(axes))
    return np.asarray(lines[np.isfinite(lines).all(1)])


def _improved(line: Reals, tracks: Tracks, bound: float) -> tuple[Mask, float]:
    """Refine an axis on the points that agree with it, first within twice the threshold.

    Return these points, and the sum of truncated squared distances.
    """
    squares = _squares(line[None], tracks)[0]
    within, cost = _agreeing(squares, tracks, bound), float(np.minimum(squares, bound).sum())
    used = _agreeing(squares, tracks, 4 * bound)
    for _ in range(_STEPS):
        part = tracks.subset(used)
        status, start = first_axis(part)
        if status != BodyEyeStatus.OK:
            break
        fit = refined([part], start[None], np.eye(8)[0])
        if not np.isfinite(fit.motor).all():
            break
        squares = _squares_of_means(np.asarray(pga3.move_line(fit.motor, start)), tracks, bound)
        after, own = _agreeing(squares, tracks, bound), float(np.minimum(squares, bound).sum())
        is_better = own < cost
        if is_better:
            within, cost = after, own
        if np.array_equal(after, used) or not is_better:
            break
        used = after
    return within, cost


def _agreeing(squares: Reals, tracks: Tracks, bound: float) -> Mask:
    """Return which points are within the bound, without the tracks of which most points are not."""
    within = squares <= bound
    shares = np.bincount(tracks.circle, within, len(tracks.counts)) / tracks.counts
    return np.asarray(within & (shares >= LEAST_SHARE)[tracks.circle])


def _squares(lines: Reals, tracks: Tracks) -> Reals:
    """Return the squared distances (m, n) of points from the median circles of their tracks about lines (m, 6)."""
    step = max(_AT_ONCE // max(len(tracks.points), 1), 1)
    found = []
    for k in range(0, len(lines), step):
        values, stiffness = _cylindric(lines[k : k + step], tracks)
        found.append(_distances(values - _medians(values, tracks), stiffness))
    return np.concatenate(found)


def _squares_of_means(line: Reals, tracks: Tracks, bound: float) -> Reals:
    """Return the squared distances (n,) of points from the robust mean circles of their tracks.

    Medians do not use that some directions are measured much better than others; from them, the weights of Geman and
    McClure lead to means in which points outside the bound have little influence.
    """
    values, stiffness = (each[0] for each in _cylindric(line[None], tracks))
    own = _medians(values[None], tracks)[0]
    for _ in range(_REWEIGHTED):
        weights = stiffness * ((bound / (bound + _distances(values - own, stiffness))) ** 2)[:, None, None]
        matrices, sums = np.zeros((len(tracks.counts), 2, 2)), np.zeros((len(tracks.counts), 2))
        np.add.at(matrices, tracks.circle, weights)
        np.add.at(sums, tracks.circle, (weights @ values[..., None])[..., 0])
        matrices += np.maximum(np.trace(matrices, axis1=1, axis2=2), TINY)[:, None, None] * ROUNDING * np.eye(2)
        own = np.linalg.solve(matrices, sums[..., None])[tracks.circle, :, 0]
    return _distances(values - own, stiffness)


def _cylindric(lines: Reals, tracks: Tracks) -> tuple[Reals, Reals]:
    """Return radii and heights (m, n, 2) of points about lines, and their inverse covariances (m, n, 2, 2).

    The directions along the circles are marginalised: a point is free to move along its circle.
    """
    axis = pga3.line_to_direction_moment(lines)[0][:, None]
    arms = tracks.points - np.asarray(pga3.line_support(lines))[:, None]
    height = (arms * axis).sum(-1)
    across = arms - height[..., None] * axis
    radius = np.sqrt((across * across).sum(-1))
    outward = across / np.maximum(radius, TINY)[..., None]
    wide = np.broadcast_to(axis, outward.shape)
    frame = np.stack([outward, wide, np.cross(wide, outward)], -1)
    matrices = tracks.scale * tracks.information[:, _ENTRIES]
    turned = np.swapaxes(frame, -1, -2) @ (matrices @ frame)
    side, own = turned[..., :2, 2], np.maximum(turned[..., 2, 2], TINY)
    stiffness = turned[..., :2, :2] - side[..., :, None] * side[..., None, :] / own[..., None, None]
    return np.stack([radius, height], -1), stiffness


def _distances(off: Reals, stiffness: Reals) -> Reals:
    found = np.einsum("...i,...ij,...j->...", off, stiffness, off)
    return np.asarray(np.maximum(found, 0))


def _medians(values: Reals, tracks: Tracks) -> Reals:
    """Return the medians of the values (m, n, 2) of each track, for each of its points."""
    counts = tracks.counts.astype(int)
    table = np.full((len(values), len(counts), counts.max(), 2), np.inf)
    order = np.arange(len(tracks.circle)) - (np.cumsum(counts) - counts)[tracks.circle]
    table[:, tracks.circle, order] = values
    table.sort(axis=2)
    each = np.arange(len(counts))
    return np.asarray((table[:, each, (counts - 1) // 2] + table[:, each, counts // 2])[:, tracks.circle] / 2)
