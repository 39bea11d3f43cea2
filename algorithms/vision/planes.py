"""Homographies between two views of a plane."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from generated import linear_views, matrices, projective2

from ..arguments import Reals, real_array
from ..evidence import Freedom, Problem, check_sampling
from .normalization import three_on_a_line
from .robust import RobustEstimate, no_estimate, robust_estimate
from .status import VisionStatus, check_points, refuse

_RANK = 1e-9
"""A singular value below this fraction of the first is rounding,"""
_NOISE = 1.5
"""and one below this multiple of the last is noise."""
_FREEDOM = Freedom(sample_size=4, parameters=8, codimension=2, solutions=1, false_alarms=1e-2)


def homography(first: ArrayLike, second: ArrayLike) -> Reals:
    """Estimate the matrix H that maps points of a plane to their partners, by linear least squares.

    Parameters
    ----------
    first, second : array_like, (n, 2)
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
    one, two = real_array(first, "first", (2,), "x y"), real_array(second, "second", (2,), "x y")
    status = check_points({"first": one, "second": two}, 4, "points")
    refuse(status, "homography", "at least 4 finite points")
    matrix, gap = linear_homography(one[None], two[None])
    if gap[0] <= _RANK or not np.isfinite(matrix).all():
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


def homography_distance(matrix: Reals, first: Reals, second: Reals) -> Reals:
    """Return the Sampson distances (..., n) of pairs (..., n, 2) from those that fit H (..., 3, 3) exactly.

    Noise in both images is taken into account: the mean square is twice the variance of a pixel's coordinate.
    """
    with np.errstate(all="ignore"):
        moved = projective2.transform_point(matrix[..., None, :, :], first)
        weight = (matrix[..., None, 2, :2] * first).sum(-1) + matrix[..., None, 2, 2]
        off = moved - second
        change = matrix[..., None, :2, :2] - moved[..., :, None] * matrix[..., None, 2:, :2]
        change = change / weight[..., None, None]
        a, b = 1 + (change[..., 0, :] ** 2).sum(-1), (change[..., 0, :] * change[..., 1, :]).sum(-1)
        c = 1 + (change[..., 1, :] ** 2).sum(-1)
        x, y = off[..., 0], off[..., 1]
        square = (c * x * x - 2 * b * x * y + a * y * y) / (a * c - b * b)
        return np.asarray(np.sqrt(np.maximum(square, 0)))


def robust_homography(
    first: ArrayLike,
    second: ArrayLike,
    threshold: float = 2.0,
    seed: int = 0,
    confidence: float = 0.999,
    max_samples: int = 5000,
) -> RobustEstimate:
    """Estimate the homography with which most pairs of points agree.

    Parameters
    ----------
    first, second : array_like, (n, 2)
    threshold : float
        Distance in pixels of the second image from which a partner counts as wrong.
    seed : int
        Seed of the random samples; the same seed gives the same result.
    confidence : float
        Probability, between 0 and 1, that a sample without wrong points is drawn.
    max_samples : int
        Maximum number of samples, at least 1.

    Returns
    -------
    RobustEstimate
        The status is NO_CONSENSUS if no more pairs agree than expected by chance (always so for four), NOT_CONVERGED if
        `max_samples` is too small for the confidence, and DEGENERATE if the inliers are nearly all on a line.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points differ, if `threshold` is not positive, if `confidence` is not between 0 and 1, or if
        `max_samples` is less than 1.
    """
    check_sampling(threshold, confidence, max_samples)
    one, two = real_array(first, "first", (2,), "x y"), real_array(second, "second", (2,), "x y")
    status = check_points({"first": one, "second": two}, 4, "points")
    if status != VisionStatus.OK:
        return no_estimate(status, len(one))
    problem = homography_problem(one, two, _transfer_distance)
    found = robust_estimate(problem, threshold, seed, confidence, max_samples)
    if found.status == VisionStatus.OK and linear_homography(one[found.inliers], two[found.inliers])[1] <= _RANK:
        return no_estimate(VisionStatus.DEGENERATE, len(one), n_samples=found.n_samples)
    return found


def homography_problem(first: Reals, second: Reals, distances: Callable[[Reals, Reals, Reals], Reals]) -> Problem:
    """Return the problem of homographies from samples of four pairs."""

    def solve(sets: Reals) -> Reals:
        good = ~(three_on_a_line(first[sets]) | three_on_a_line(second[sets]))
        return linear_homography(first[sets[good]], second[sets[good]])[0] if good.any() else np.empty((0, 3, 3))

    def improve(_: Reals, inliers: Reals) -> Reals | None:
        return linear_homography(first[inliers], second[inliers])[0] if inliers.sum() > 4 else None

    return Problem(first, second, _FREEDOM, solve, distances, improve)


def _transfer_distance(models: Reals, first: Reals, second: Reals) -> Reals:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.linalg.norm(projective2.transform_point(models[:, None], first) - second, axis=-1))
