"""Tests whether noisy pixels of two views determine F, or also fit a plane, a line, too few points, or chance."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import scipy

from generated import robust_views

from ..arguments import Reals
from ..evidence import Freedom, Noise, Problem, Seed, by_chance, explained_by_chance, surely_not_by_chance
from ..evidence.consensus import N_WRONG, Indices, without_nan
from ..evidence.noise import USUAL_WEIGHT

_RATIO = 1.1
"""If noise is unknown, equations have several solutions if their eighth singular value is below this multiple of the
ninth: scenes seen from nearby places have ratios of 1.5."""
_CONFIDENCE = 0.995
"""Probability of detecting planes by the residuals of F, if all F had the freedom of those of points in space."""
_SURELY = 0.999
"""Probability of detecting planes if the noise of pixels is known."""
_USUAL_NOISE = 1.2e-3
"""Prior standard deviation of pixels, as a fraction of the extent of the image that they cover."""
WIDE = 2.5
"""Pairs within this multiple of the threshold of a plane or line give no information about points off it."""
_LINE = 3.0
"""On a line F leaves less than a homography on a plane does: the variance across it may be larger by this factor."""
_LINES = 50
"""A limit on work: the number of lines through two points of an image."""
_SUSPECTS = 16
"""Number of points with the largest distances from a plane among which the only one off it is sought."""


def usual_noise(pixels: Reals) -> Noise:
    """Return what is known of the noise of pixels (n, 2) if nothing is known of the camera."""
    return Noise(float(np.square(_USUAL_NOISE * np.ptp(pixels, axis=0).max())), USUAL_WEIGHT)


def degenerate(matrix: Reals, first: Reals, second: Reals, known: float | None = None, margin: float = 1.0) -> Reals:
    """Return whether noisy point sets (..., n, 2) cannot be distinguished from points of a plane or a line.

    A homography has one parameter more than F and two residuals for each point instead of one. It fits points of a
    plane as well as F does: the ratio of the two variances has Fisher's distribution. F leaves only n - 7 residuals,
    so few for eight points that by chance one in ten planes would look exact; `USUAL_WEIGHT` residuals of the usual
    size are therefore added. If the noise is `known`, the variance of the homography alone decides, and points are also
    rejected if all but one are on a plane or if fewer than eight distinct points are seen. Variances up to `margin`
    times as large count as equal.
    """
    n = first.shape[-2]
    variance = (margin * known**2, 0.0, 0.0) if known is not None else _parts_of_variance(n, margin)
    limits = _limits(n, known is None)
    off = robust_views.least_plane_squares(first, second)
    result = np.asarray(robust_views.are_degenerate(matrix, first, second, off, *variance, *limits) > 0)
    if known is not None:
        result |= _plane_but_one(first, second, np.asarray(off), known) | few_places(first, second, known)
    return result


def _freedom(n: int) -> float:
    """Return the number of residuals by which n pairs and the prior determine the noise."""
    return max(n - 9, 1) + USUAL_WEIGHT


def _parts_of_variance(n: int, margin: float) -> tuple[float, float, float]:
    """Return the known variance, and the parts of squared extents and of squares that F leaves."""
    freedom = _freedom(n)
    return 0.0, margin * USUAL_WEIGHT * _USUAL_NOISE**2 / freedom, margin / freedom


@lru_cache(maxsize=4096)
def _limits(n: int, is_estimated: bool) -> tuple[float, float, float]:
    """Return the limits of sums of squares on a line and on a plane, relative to the variance, and `_RATIO`."""
    freedom = _freedom(n) if is_estimated else np.inf
    line = (n - 2) * (_LINE if is_estimated else 1) * _quantile(n - 2, freedom)
    return line, (2 * n - 8) * _quantile(2 * n - 8, freedom), _RATIO if is_estimated and n > 8 else 0.0


def _quantile(n: int, freedom: float) -> float:
    """Return the quantile of the mean square of n residuals relative to that of `freedom` others."""
    if np.isinf(freedom):
        return float(scipy.special.chdtri(n, 1 - _SURELY)) / n
    return float(scipy.special.fdtri(n, freedom, _CONFIDENCE))


def _plane_but_one(first: Reals, second: Reals, off: Reals, noise: float) -> Reals:
    """Return whether all points but one fit a plane, which leaves one parameter of F undetermined."""
    n = first.shape[-2]
    if n <= 8:
        return np.zeros(first.shape[:-2], np.bool_)
    worst = np.argsort(off, axis=-1)[..., -_SUSPECTS:]
    others = np.arange(n - 1) + (np.arange(n - 1) >= worst[..., None])
    one, two = (np.take_along_axis(x[..., None, :, :], others[..., None], -2) for x in (first, second))
    left = np.asarray(robust_views.least_plane_squares(one, two)).sum(-1).min(-1)
    return np.asarray(left <= (2 * n - 10) * _quantile(2 * n - 10, np.inf) * noise**2)


def few_places(first: Reals, second: Reals, noise: float, least: int = 8) -> Reals:
    """Return whether fewer than `least` pairs of pixels differ by more than noise."""
    pairs = np.concatenate([first, second], -1)
    left = np.ones(pairs.shape[:-1], np.bool_)
    for _ in range(least - 1):
        chosen = np.take_along_axis(pairs, left.argmax(-1)[..., None, None], -2)
        left &= ((pairs - chosen) ** 2).sum(-1) > 2 * noise**2 * scipy.special.chdtri(4, 1 - _SURELY)
    return np.asarray(~left.any(-1))


def displaced_by_chance(problem: Problem, model: Reals, expected: Reals, threshold: float, freedom: Freedom) -> bool:
    """Return whether partners displaced as far, but in other directions, agree with a model as well.

    Pairs that were searched only near each other agree more often than shuffled pairs. Partners are displaced from
    their `expected` places, and from the places of the points in the first image.
    """
    distances = without_nan(problem.distances(model[None], problem.first, problem.second)[0])
    n, count = len(distances), int(np.count_nonzero(distances <= threshold))

    def wrong(place: Reals, length: Reals, repeats: int) -> Reals:
        partners = place + length[:, None] * _directions(repeats * n).reshape(repeats, n, 2)
        firsts = np.concatenate([problem.first] * repeats)
        return np.asarray(problem.distances(model[None], firsts, partners.reshape(-1, 2))[0])

    for place in (expected, problem.first):
        off = problem.second - place
        length = np.sqrt(np.einsum("ni,ni->n", off, off))
        if surely_not_by_chance(n, count, wrong(place, length, 1), threshold, freedom):
            continue
        if by_chance(distances, wrong(place, length, -(-N_WRONG // (2 * n))), threshold, freedom):
            return True
    return False


@lru_cache(maxsize=16)
def _directions(n: int) -> Reals:
    """Return unit vectors (n, 2), of which any that follow each other are evenly distributed (golden angle)."""
    angles = np.pi * (3 - np.sqrt(5)) * np.arange(n)
    return np.stack([np.cos(angles), np.sin(angles)], -1)


def hidden_by_a_line(
    problem: Problem, model: Reals, inliers: Indices, threshold: float, seed: Seed, freedom: Freedom
) -> bool:
    """Return whether pairs off the line with the most points, in either image, could agree with a model by chance."""
    rng = np.random.default_rng(seed)

    def agree_by_chance(some: Indices) -> bool:
        one, two = (side.compress(some, axis=0) for side in (problem.first, problem.second))
        rest = replace(problem, first=one, second=two, freedom=freedom)
        return len(one) <= freedom.sample_size or explained_by_chance(rest, model, threshold, rng)

    off = off_lines(problem, inliers, threshold, rng)
    # In most scenes the pairs off both lines suffice.
    return agree_by_chance(off[0] & off[1]) and any(agree_by_chance(each) for each in off if not each.all())


def off_lines(problem: Problem, inliers: Indices, threshold: float, rng: np.random.Generator) -> list[Indices]:
    """Return which pairs are off the line with the most inliers, in either image."""
    return [_off_a_line(points, inliers, WIDE * threshold, rng) for points in (problem.first, problem.second)]


def _off_a_line(points: Reals, inliers: Indices, distance: float, rng: np.random.Generator) -> Indices:
    """Return which points are off the line through two inliers near which most inliers are."""
    good = points.compress(inliers, axis=0)
    ends = good.take(rng.integers(0, len(good), (_LINES, 2)), axis=0)
    most = np.asarray(robust_views.count_near_line(ends, good, distance)).argmax()
    return np.asarray(robust_views.off_line(ends[most], points, distance)) > 0
