"""Robust estimation of the fundamental matrix, also if most pairs are on a plane or line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from generated import projective2, relative_poses, robust_views

from ..arguments import Reals, real_array
from ..evidence import Freedom, Problem, Seed, check_sampling, checked_scores, consensus, explained_by_chance, polished
from ..evidence.consensus import Indices, without_nan
from ..evidence.noise import tail_of
from ..precision import LIKELY
from .degeneracy import WIDE, degenerate, displaced_by_chance, hidden_by_a_line, off_lines
from .normalization import extents, homogeneous
from .planes import homography_problem
from .robust import ALL, RobustEstimate, consensus_status, estimate, no_estimate, robust_estimate
from .status import VisionStatus, check_points, one_set

_FREEDOM = Freedom(sample_size=7, parameters=7, codimension=1, solutions=3, false_alarms=1.0)
"""Of 400 sets of 20 random pairs the least bound was 80; for more pairs it was higher."""
_OFF_A_PLANE = Freedom(sample_size=2, parameters=2, codimension=1, solutions=1, false_alarms=1e-2)
"""A plane leaves the epipole undetermined."""
_OFF_A_LINE = Freedom(sample_size=4, parameters=4, codimension=1, solutions=3, false_alarms=1e-2)
_SIGMAS = 5.0
"""Pairs within this many standard deviations of the others of a plane give no information about points off it."""
_SAMPLES = 200
"""Number of samples of three pairs, which determine a homography compatible with F: enough to find a plane with a third
of the pairs."""
_STEPS = 20.0
"""A limit on work: the number of steps with weights by distances."""
_SHALLOW = 4.0
"""Points of a plane with more than this multiple of the variance that F leaves are points in space."""


def robust_fundamental_matrix(
    first: ArrayLike,
    second: ArrayLike,
    threshold: float = 1.0,
    seed: int = 0,
    confidence: float = 0.999,
    max_samples: int = 100000,
    *,
    scores: ArrayLike | None = None,
) -> RobustEstimate:
    """Estimate the fundamental matrix with which most correspondences agree.

    Samples of seven points are drawn, and the best of them are refined on all inliers. The result is the likeliest if
    the Sampson distances of the inliers have Student's distribution with the tails that they show. If most pairs are on
    a plane, most samples are from this plane, and all F compatible with the plane agree with them. In this case its
    homography is kept, and samples of two pairs off the plane give the epipole (plane and parallax, as in DEGENSAC:
    Chum, Werner and Matas, CVPR 2005).

    Parameters
    ----------
    first, second : array_like, (n, 2) or (n, 1, 2)
        Pixels of both images, n at least 8.
    threshold : float
        The Sampson distance, in pixels, from which a correspondence counts as wrong; twice the noise of pixels is a
        good value.
    seed : int
        Seed of the random samples; the same seed gives the same result.
    confidence : float
        Probability, between 0 and 1, that a sample without wrong points is drawn.
    max_samples : int
        Maximum number of samples, at least 1. The default suffices for 70 % of wrong pairs.
    scores : array_like, (n,), optional
        How likely pairs are right, in relation to each other, such as 1 minus the ratio of distances of descriptors:
        half of the samples are drawn by them, so that misleading ones at most double the work.

    Returns
    -------
    RobustEstimate
        The status OK guarantees three things. First, chance does not explain the inliers: shuffled partners, or
        partners displaced as far in random directions, would not agree as well, by a bound that is conservative by a
        factor of 50 and more (otherwise NO_CONSENSUS: for half of the sets of 12 good pairs with noise, for no set of
        20, and for most sets of 20 pairs of which six are wrong). Second, chance does not explain the inliers off the
        largest plane and line either, unless no plane fits its own inliers (otherwise DEGENERATE). Third, a sample
        without wrong pairs was drawn with the given confidence (otherwise NOT_CONVERGED). The model is NaN if the
        status is not OK.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points differ, if `threshold` is not positive, if `confidence` is not between 0 and 1, or if
        `max_samples` is less than 1.
    """
    check_sampling(threshold, confidence, max_samples)
    one, two = (one_set(real_array(x, name, (2,), "x y")) for x, name in ((first, "first"), (second, "second")))
    status = check_points({"first": one, "second": two}, 8, "points")
    if status != VisionStatus.OK:
        return no_estimate(status, len(one))
    one, two = one.astype(np.float64), two.astype(np.float64)

    problem = replace(_problem(one, two), scores=checked_scores(scores, len(one)))
    rng = np.random.default_rng(seed)
    if min(extents(one)[0], extents(two)[0]) <= threshold * np.sqrt(len(one)):
        return no_estimate(VisionStatus.DEGENERATE, len(one))  # all on one line
    found = robust_estimate(problem, threshold, rng, confidence, max_samples)
    if found.status != VisionStatus.OK:
        return found
    found = _beyond_a_plane(problem, found, threshold, rng, confidence)
    return _likeliest(problem, found, threshold) if found.status == VisionStatus.OK else found


def _likeliest(problem: Problem, found: RobustEstimate, threshold: float) -> RobustEstimate:
    """Return the estimate whose inliers are likeliest, as their distances have longer tails than a normal distribution.

    Pixels of features are not equally exact, so that least squares would depend on the least exact ones.
    """
    good = problem.first.compress(found.inliers, axis=0), problem.second.compress(found.inliers, axis=0)
    tail = min(tail_of(relative_poses.squared_distances(found.model, *good)), ALL)
    model, _ = robust_views.likeliest_fundamental(found.model, *good, ALL, tail, _STEPS)
    before, after = (
        np.log1p(relative_poses.squared_distances(each, *good) / tail).sum() for each in (found.model, model)
    )
    return estimate(problem, model, threshold, found.n_samples) if after < before else found


def _problem(first: Reals, second: Reals) -> Problem:
    """Return the problem of fundamental matrices from samples of seven pairs."""

    def solve(sets: Indices) -> Reals:
        models, number = robust_views.fundamentals_of_seven(first.take(sets, axis=0), second.take(sets, axis=0))
        return np.asarray(models[np.arange(3) < number[:, None]])

    def descend(models: Reals, threshold: float, at_most: float) -> Reals:
        limit = threshold * threshold
        return np.asarray(robust_views.descend_fundamental(models, first, second, limit, at_most, LIKELY)[0])

    return Problem(first, second, _FREEDOM, solve, _distances, _costs, descend)


def _distances(models: Reals, first: Reals, second: Reals) -> Reals:
    return np.sqrt(relative_poses.squared_distances(models, first, second))


def _costs(models: Reals, first: Reals, second: Reals, threshold: float) -> Reals:
    return np.asarray(relative_poses.truncated_squares(models, first, second, threshold * threshold))


def _in_space(problem: Problem, found: RobustEstimate, threshold: float) -> RobustEstimate:
    """Return the estimate, unless partners displaced in random directions from a linear map agree as well."""
    n, used = len(problem.first), found.inliers.astype(float)
    expected = np.asarray(robust_views.affine_places(problem.first, problem.second, used))
    if displaced_by_chance(problem, found.model, expected, threshold, problem.freedom):
        return no_estimate(VisionStatus.NO_CONSENSUS, n, n_samples=found.n_samples)
    return found


def _beyond_a_plane(
    problem: Problem, found: RobustEstimate, threshold: float, rng: np.random.Generator, confidence: float
) -> RobustEstimate:
    """Return the estimate, or a better one, if pairs off the plane and the lines with the most inliers determine it."""
    one, two = problem.first, problem.second
    good = one.compress(found.inliers, axis=0), two.compress(found.inliers, axis=0)
    planar = homography_problem(*good, in_both=True)

    def solve(sets: Indices) -> Reals:
        return np.asarray(robust_views.homography_of_three(found.model, *(side.take(sets, axis=0) for side in good)))

    by_three = replace(planar, solve=solve, freedom=replace(planar.freedom, sample_size=3))
    flat = consensus(by_three, WIDE * threshold, rng, confidence, _SAMPLES, at_once=True)
    if flat.best is not None:
        plane = estimate(planar, flat.best.model, WIDE * threshold, flat.n_samples)
        tolerance = max(WIDE * threshold, _SIGMAS * plane.distance / np.sqrt(2))
        on_plane = np.sqrt(robust_views.plane_squares(plane.model, one, two)) <= tolerance
        off = off_lines(problem, found.inliers, threshold, rng)
        if _decided(problem, found, plane.model, off[0] & off[1] & ~on_plane, threshold, rng):
            return found
    if flat.best is None or consensus_status(planar, flat, WIDE * threshold, rng) != VisionStatus.OK:
        better = _in_space(problem, found, threshold)
    else:
        better = _by_parallax(problem, found, plane.model, on_plane, threshold, rng, confidence)
    if better.status == VisionStatus.OK and (
        hidden_by_a_line(problem, better.model, better.inliers, threshold, rng, _OFF_A_LINE)
        or degenerate(better.model, one[better.inliers], two[better.inliers])
    ):
        return no_estimate(VisionStatus.DEGENERATE, len(one), n_samples=found.n_samples)
    return better


def _decided(
    problem: Problem, found: RobustEstimate, plane: Reals, off: Indices, threshold: float, rng: np.random.Generator
) -> bool:
    """Return whether pairs off a plane and lines suffice for an estimate, so that no other epipole has more of them.

    Most of them agree, and not by chance, even if all of F is free. Nor does a plane or a line fit all inliers then,
    since many are far from those with the most.
    """
    one, two = problem.first.compress(off, axis=0), problem.second.compress(off, axis=0)
    if len(one) <= problem.freedom.sample_size or 2 * np.count_nonzero(found.inliers & off) <= len(one):
        return False
    rest = replace(problem, first=one, second=two)
    if explained_by_chance(rest, found.model, threshold, rng):
        return False
    expected = np.asarray(projective2.transform_point(plane, one))
    return not displaced_by_chance(rest, found.model, expected, threshold, rest.freedom)


def _by_parallax(
    problem: Problem,
    found: RobustEstimate,
    plane: Reals,
    on_plane: Indices,
    threshold: float,
    seed: Seed,
    confidence: float,
) -> RobustEstimate:
    """Return the estimate, or one from pairs off a plane: the plane, and the epipole with which they agree."""
    one, two, off = problem.first, problem.second, np.flatnonzero(~on_plane)
    rest = replace(problem, first=one[off], second=two[off], freedom=_OFF_A_PLANE)
    expected = np.asarray(projective2.transform_point(plane, one[off]))
    parallax = _parallax(problem, plane, on_plane, threshold, seed, confidence)
    if parallax.status == VisionStatus.OK and not displaced_by_chance(
        rest, parallax.model, expected, threshold, rest.freedom
    ):
        cost = float(problem.costs(parallax.model[None], one, two, threshold)[0])
        models = np.array([found.model, parallax.model, polished(problem, parallax.model, cost, threshold)[0]])
        # Pairs off the plane decide: an F that is wrong there is freer to fit the noise of those on the plane.
        # Among those that explain as many of them, up to one, all pairs decide.
        left = without_nan(problem.costs(models, one[off], two[off], threshold))
        costs = np.where(left <= left.min() + threshold**2, problem.costs(models, one, two, threshold), np.inf)
        best = models[np.argmin(costs)]
        return estimate(problem, best, threshold, found.n_samples)
    if parallax.status == VisionStatus.NOT_CONVERGED:
        return no_estimate(parallax.status, len(one), n_samples=found.n_samples)
    if len(off) < len(one) and not degenerate(found.model, one[on_plane], two[on_plane], margin=_SHALLOW):
        return _in_space(problem, found, threshold)
    return no_estimate(VisionStatus.DEGENERATE, len(one), n_samples=found.n_samples)


def _parallax(
    problem: Problem, plane: Reals, on_plane: Indices, threshold: float, seed: Seed, confidence: float
) -> RobustEstimate:
    """Return F of the plane and the epipole with which pairs off the plane agree: the common point of their lines."""
    one, two = problem.first[~on_plane], problem.second[~on_plane]
    if len(one) <= _OFF_A_PLANE.sample_size:
        return no_estimate(VisionStatus.NO_CONSENSUS, len(one))
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = homogeneous(np.asarray(projective2.transform_point(plane, one)))
    lines = np.cross(moved, homogeneous(two))

    def solve(sets: Indices) -> Reals:
        epipole = np.cross(lines[sets[:, 0]], lines[sets[:, 1]])
        models = np.cross(epipole[:, None, :], plane.T).swapaxes(-1, -2)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(models / np.linalg.norm(models, axis=(-1, -2), keepdims=True))

    scores = None if problem.scores is None else problem.scores[~on_plane]
    off = replace(problem, first=one, second=two, freedom=_OFF_A_PLANE, solve=solve, scores=scores)
    return robust_estimate(off, threshold, seed, confidence, len(one) ** 2 + 5000)
