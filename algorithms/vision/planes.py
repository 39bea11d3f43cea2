"""Homographies: what two views of a plane have to do with each other."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from generated import projective2

from ..arguments import Reals, real_array
from .chance import Freedom
from .normalization import normalized, null_vectors, null_vectors_and_values, three_on_a_line, undone
from .robust import Problem, RobustEstimate, check_sampling, consensus, no_estimate
from .status import VisionStatus, check_points, refuse

_RANK = 1e-9
"""A singular value below this part of the first is rounding,"""
_NOISE = 1.5
"""and one below this many times the last is noise."""
_FREEDOM = Freedom(sample_size=4, parameters=8, codimension=2, solutions=1, false_alarms=1e-2)


def homography(first: ArrayLike, second: ArrayLike) -> Reals:
    """Return the matrix H that takes points of a plane to their partners, in the least squares of its linear equations.

    Parameters
    ----------
    first, second : array_like, (n, 2)
        At least four, no three of four on a line.

    Returns
    -------
    array, (3, 3)
        With norm 1.

    Raises
    ------
    TypeError, ValueError
        If these are not n points each.
    DegenerateError
        If they are too few, not finite, or nearly all on a line.
    """
    one, two = real_array(first, "first", (2,), "x y"), real_array(second, "second", (2,), "x y")
    status = check_points({"first": one, "second": two}, 4, "points")
    refuse(status, "homography", "at least 4 finite points")
    matrix, gap = linear_homography(one[None], two[None])
    if gap[0] <= _RANK or not np.isfinite(matrix).all():
        refuse(VisionStatus.DEGENERATE, "homography", "four points, no three of them on a line")
    return np.asarray(matrix[0])


def linear_homography(first: Reals, second: Reals) -> tuple[Reals, Reals]:
    """Homographies of point sets (..., n, 2), and the eighth singular value of the equations by the first.

    That is 0 where it is what noise leaves, as for points with noise that are on a line, or few that are repeated.
    """
    one, scale = normalized(first)
    two, other = normalized(second)
    rows = projective2.homography_equations(one, two)
    rows = rows.reshape(*rows.shape[:-3], -1, 9)
    null, values = null_vectors_and_values(rows, 1)
    matrix = undone(other) @ null[..., 0, :].reshape(*rows.shape[:-2], 3, 3) @ scale
    gap = values[..., 7] / values[..., 0]
    if values.shape[-1] > 8:
        gap = np.where(values[..., 7] <= _NOISE * values[..., 8], 0.0, gap)
    return matrix / np.linalg.norm(matrix, axis=(-1, -2), keepdims=True), gap


def homographies_of_four(first: Reals, second: Reals) -> Reals:
    """Homographies of sets of four points (..., 4, 2), of norm 1."""
    one, scale = normalized(first)
    two, other = normalized(second)
    rows = projective2.homography_equations(one, two)
    null = null_vectors(rows.reshape(*rows.shape[:-3], 8, 9), 1)
    matrix = undone(other) @ null.reshape(*rows.shape[:-3], 3, 3) @ scale
    return np.asarray(matrix / np.linalg.norm(matrix, axis=(-1, -2), keepdims=True))


def homography_distance(matrix: Reals, first: Reals, second: Reals) -> Reals:
    """Return the distances (..., n) of pairs (..., n, 2) to the nearest that fit H (..., 3, 3), to first order (Sampson's).

    Noise of both images counts: its mean square is twice the variance of a pixel's coordinate.
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
    """Return the homography that most pairs of points agree on.

    Parameters
    ----------
    first, second : array_like, (n, 2)
    threshold : float
        In pixels of the second image: the distance from which a partner counts as wrong.
    seed : int
        Of the random samples; the same seed gives the same result.
    confidence : float
        With which a sample without wrong points is among those drawn, between 0 and 1.
    max_samples : int
        At least 1.

    Returns
    -------
    RobustEstimate
        NO_CONSENSUS where no more pairs agree than chance gives (always so for four), NOT_CONVERGED where `max_samples`
        are too few for the confidence, DEGENERATE where those that agree are nearly all on a line.

    Raises
    ------
    TypeError, ValueError
        If these are not n points each, `threshold` is not positive, `confidence` not between 0 and 1, or
        `max_samples` less than 1.
    """
    check_sampling(threshold, confidence, max_samples)
    one, two = real_array(first, "first", (2,), "x y"), real_array(second, "second", (2,), "x y")
    status = check_points({"first": one, "second": two}, 4, "points")
    if status != VisionStatus.OK:
        return no_estimate(status, len(one))
    problem = homography_problem(one, two, _transfer_distance)
    found = consensus(problem, threshold, seed, confidence, max_samples)
    if found.status == VisionStatus.OK and linear_homography(one[found.inliers], two[found.inliers])[1] <= _RANK:
        return no_estimate(VisionStatus.DEGENERATE, len(one), n_samples=found.n_samples)
    return found


def homography_problem(first: Reals, second: Reals, distances: Callable[[Reals, Reals, Reals], Reals]) -> Problem:
    """Homographies from samples of four pairs."""

    def solve(sets: Reals) -> Reals:
        good = ~(three_on_a_line(first[sets]) | three_on_a_line(second[sets]))
        return homographies_of_four(first[sets[good]], second[sets[good]]) if good.any() else np.empty((0, 3, 3))

    def improve(_: Reals, inliers: Reals) -> Reals | None:
        return linear_homography(first[inliers], second[inliers])[0] if inliers.sum() > 4 else None

    return Problem(first, second, _FREEDOM, solve, distances, improve)


def _transfer_distance(models: Reals, first: Reals, second: Reals) -> Reals:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.linalg.norm(projective2.transform_point(models[:, None], first) - second, axis=-1))
