"""Robust estimates from pairs of image points: the result of a consensus, and its status."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arguments import Reals
from ..evidence import Consensus, Problem, Seed, consensus, explained_by_chance, near_by_chance
from .status import VisionStatus

ALL = 1e20
"""A squared distance, or a sum of these, that no pixels reach: as a limit, it leaves out none."""


@dataclass(frozen=True, slots=True, eq=False)
class RobustEstimate:
    """Robust estimate of a model."""

    model: Reals
    """The matrix, or NaN if the status is not OK."""
    status: VisionStatus
    inliers: Reals
    """(n,) bool: the points within the threshold."""
    distance: float
    """The root mean square distance of the inliers, in pixels."""
    n_samples: int


def no_estimate(
    status: VisionStatus, n_points: int, shape: tuple[int, ...] = (3, 3), n_samples: int = 0
) -> RobustEstimate:
    """Return an estimate without a model."""
    return RobustEstimate(np.full(shape, np.nan), status, np.zeros(n_points, bool), np.nan, n_samples)


def robust_estimate(
    problem: Problem, threshold: float, seed: Seed, confidence: float, max_samples: int
) -> RobustEstimate:
    """Return the consensus of a problem.

    The status is NO_CONSENSUS for a model with no more inliers than expected by chance, also if wrong partners are near
    their places, and NOT_CONVERGED if `max_samples` is too small for the confidence.
    """
    found = consensus(problem, threshold, seed, confidence, max_samples)
    result = consensus_estimate(problem, found, threshold, seed)
    is_of_points = problem.freedom.codimension > 1
    if result.status == VisionStatus.OK and is_of_points and near_by_chance(problem, result.model, threshold):
        return no_estimate(VisionStatus.NO_CONSENSUS, len(problem.first), result.model.shape, found.n_samples)
    return result


def consensus_estimate(problem: Problem, found: Consensus, threshold: float, seed: Seed) -> RobustEstimate:
    """Return the best model of a consensus, unless its status is not OK."""
    status = consensus_status(problem, found, threshold, seed)
    if status != VisionStatus.OK or found.best is None:
        shape = (3, 3) if found.best is None else found.best.model.shape
        return no_estimate(status, len(problem.first), shape, found.n_samples)
    return estimate(problem, found.best.model, threshold, found.n_samples)


def consensus_status(problem: Problem, found: Consensus, threshold: float, seed: Seed) -> VisionStatus:
    """Return NO_CONSENSUS if chance explains the best model, NOT_CONVERGED if too few samples were drawn, or OK.

    The random numbers of a seed are independent of those by which `consensus` draws samples.
    """
    rng = seed if isinstance(seed, np.random.Generator) else np.random.default_rng(seed).spawn(1)[0]
    if found.best is None or explained_by_chance(problem, found.best.model, threshold, rng):
        return VisionStatus.NO_CONSENSUS
    return VisionStatus.OK if found.reached else VisionStatus.NOT_CONVERGED


def estimate(problem: Problem, model: Reals, threshold: float, n_samples: int) -> RobustEstimate:
    """Return the result for an accepted model."""
    distances = problem.distances(model[None], problem.first, problem.second)[0]
    inliers = distances <= threshold
    rest = distances.compress(inliers)
    return RobustEstimate(model, VisionStatus.OK, inliers, float(np.sqrt(rest @ rest / len(rest))), n_samples)
