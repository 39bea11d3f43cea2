"""Homographies between two views of a plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from generated import linear_views, matrices, robust_views

from ..arguments import Reals, real_array
from ..evidence import Freedom, Problem, check_sampling, checked_scores
from ..evidence.consensus import Indices
from ..precision import CONVERGED, LIKELY, NEGLIGIBLE, rounding_of
from .robust import RobustEstimate, estimate, no_estimate, robust_estimate
from .status import VisionStatus, check_points, one_set, refuse

_NOISE = 1.5
"""A singular value below this multiple of the last one is noise."""
_SQUARE = 1e-14
"""From floating point: a squared singular value below this fraction of the first is rounding."""
_FREEDOM = Freedom(sample_size=4, parameters=8, codimension=2, solutions=1, false_alarms=1e-2)
_STEPS = 20.0
"""A limit on work: the number of steps from a minimum that is not precise."""


def homography(first: ArrayLike, second: ArrayLike) -> Reals:
    """Estimate the matrix H that maps points of a plane to their partners, by linear least squares.

    Parameters
    ----------
    first, second : array_like, (n, 2) or (n, 1, 2)
        At least four points, with no three of four on a line.

    Returns
    -------
    array, (3, 3)
        Homography of norm 1.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points differ.
    DegenerateError
        If there are too few points, or if they are not finite or nearly all on a line.
    """
    one, two = (one_set(real_array(x, name, (2,), "x y")) for x, name in ((first, "first"), (second, "second")))
    status = check_points({"first": one, "second": two}, 4, "points")
    refuse(status, "homography", "at least 4 finite points")
    least = rounding_of(one, two, part=NEGLIGIBLE)
    matrix, gap = linear_homography(one[None].astype(np.float64), two[None].astype(np.float64))
    if gap[0] <= least or not np.isfinite(matrix).all():
        refuse(VisionStatus.DEGENERATE, "homography", "four points, no three of them on a line")
    return np.asarray(matrix[0])


def linear_homography(first: Reals, second: Reals) -> tuple[Reals, Reals]:
    """Return homographies of point sets (..., n, 2), and the ratio of the eighth to the first singular value.

    The ratio is 0 if the eighth singular value is due to noise, as for noisy points on a line, or few repeated points.
    """
    equations, left, right = linear_views.plane_equations(first, second)
    entries, gap, noise = matrices.null_vector(equations.reshape(*equations.shape[:-3], -1, 9))
    matrix = linear_views.homography_of_entries(entries, left, right)
    return np.asarray(matrix), np.where(gap <= _NOISE * noise, 0.0, gap)


def homography_of_four(first: Reals, second: Reals) -> Reals:
    """Return homographies of sets (..., 4, 2), in closed form, relative to the centroids of both."""
    offs, entries = [], []
    for points in (first, second):
        mean = points.mean(-2)
        off = np.zeros((*mean.shape[:-1], 3, 3))
        off[..., [0, 1, 2], [0, 1, 2]] = 1.0
        off[..., :2, 2] = -mean
        offs.append(off)
        entries.append(points - mean[..., None, :])
    matrix, _ = robust_views.homography_of_four(*entries)
    return np.asarray(linear_views.homography_of_entries(matrix.reshape(*matrix.shape[:-2], 9), *offs))


def robust_homography(
    first: ArrayLike,
    second: ArrayLike,
    threshold: float = 2.0,
    seed: int = 0,
    confidence: float = 0.999,
    max_samples: int = 5000,
    *,
    scores: ArrayLike | None = None,
) -> RobustEstimate:
    """Estimate the homography with which most pairs of points agree.

    Parameters
    ----------
    first, second : array_like, (n, 2) or (n, 1, 2)
    threshold : float
        Distance in pixels of the second image from which a partner counts as wrong.
    seed : int
        Seed of the random samples; the same seed gives the same result.
    confidence : float
        Probability, between 0 and 1, that a sample without wrong points is drawn.
    max_samples : int
        Maximum number of samples, at least 1.
    scores : array_like, (n,), optional
        How likely pairs are right, in relation to each other, such as 1 minus the ratio of distances of descriptors:
        half of the samples are drawn by them, so that misleading ones at most double the work.

    Returns
    -------
    RobustEstimate
        The status is NO_CONSENSUS if no more pairs agree than expected by chance (always so for four), or than of
        partners as near their places as those that disagree, as for a threshold below the noise, NOT_CONVERGED if
        `max_samples` is too small for the confidence, and DEGENERATE if the inliers are nearly all on a line.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points differ, if `threshold` is not positive, if `confidence` is not between 0 and 1, or if
        `max_samples` is less than 1.
    """
    check_sampling(threshold, confidence, max_samples)
    one, two = (one_set(real_array(x, name, (2,), "x y")) for x, name in ((first, "first"), (second, "second")))
    status = check_points({"first": one, "second": two}, 4, "points")
    if status != VisionStatus.OK:
        return no_estimate(status, len(one))
    one, two = one.astype(np.float64), two.astype(np.float64)
    problem = replace(homography_problem(one, two), scores=checked_scores(scores, len(one)))
    found = robust_estimate(problem, threshold, np.random.default_rng(seed), confidence, max_samples)
    if found.status != VisionStatus.OK:
        return found
    if _is_open(one.compress(found.inliers, axis=0), two.compress(found.inliers, axis=0)):
        return no_estimate(VisionStatus.DEGENERATE, len(one), n_samples=found.n_samples)
    limit = threshold * threshold
    model, _ = robust_views.descend_homography(found.model, one, two, limit, _STEPS, CONVERGED)
    return estimate(problem, model, threshold, found.n_samples)


def _is_open(first: Reals, second: Reals) -> bool:
    """Return whether noise or rounding hides a second homography of many pairs: whether they are nearly on a line.

    Squared singular values, of which rounding leaves those above `_SQUARE`, take a tenth of the time of others.
    """
    least, second_least, largest = np.asarray(robust_views.squares_of_plane(first, second))
    return bool(second_least <= max(_NOISE**2 * least, _SQUARE * largest))


def homography_problem(first: Reals, second: Reals, in_both: bool = False) -> Problem:
    """Return the problem of homographies from samples of four pairs.

    Distances are those in the second image, or Sampson distances if there is noise in both.
    """
    squares = robust_views.plane_squares if in_both else robust_views.transfer_squares
    truncated = robust_views.truncated_plane_squares if in_both else robust_views.truncated_transfer_squares
    # Sampson's squares of two images are about half of those in the second one.
    ratio = 2.0 if in_both else 1.0

    def solve(sets: Indices) -> Reals:
        models, is_determined = robust_views.homography_of_four(first.take(sets, axis=0), second.take(sets, axis=0))
        return np.asarray(models.compress(is_determined > 0, axis=0))

    def distances(models: Reals, one: Reals, two: Reals) -> Reals:
        return np.sqrt(squares(models, one, two))

    def costs(models: Reals, one: Reals, two: Reals, threshold: float) -> Reals:
        return np.asarray(truncated(models, one, two, threshold * threshold))

    def descend(models: Reals, threshold: float, at_most: float) -> Reals:
        limit = ratio * threshold * threshold
        return np.asarray(robust_views.descend_homography(models, first, second, limit, at_most, LIKELY)[0])

    return Problem(first, second, _FREEDOM, solve, distances, costs, descend)
