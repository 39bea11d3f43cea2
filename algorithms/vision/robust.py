"""Robust estimates from pairs of image points: the result of a consensus, and its status."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arguments import Reals
from ..evidence import Problem, consensus
from ..evidence.consensus import Indices
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
    problem: Problem, threshold: float, seed: int, confidence: float, max_samples: int
) -> RobustEstimate:
    """Return the consensus of a problem.

    The status is NO_CONSENSUS for a model with no more inliers than expected by chance, and NOT_CONVERGED if
    `max_samples` is too small for the confidence.
    """
    found, n = consensus(problem, threshold, seed, confidence, max_samples), len(problem.first)
    if not found.hypotheses:
        return no_estimate(VisionStatus.NO_CONSENSUS, n, n_samples=found.n_samples)
    _, model, inliers = found.hypotheses[0]
    if found.by_chance or not found.reached:
        status = VisionStatus.NO_CONSENSUS if found.by_chance else VisionStatus.NOT_CONVERGED
        return no_estimate(status, n, model.shape, found.n_samples)
    return estimate(problem, model, inliers, found.n_samples)


def estimate(problem: Problem, model: Reals, inliers: Indices, n_samples: int) -> RobustEstimate:
    """Return the result for an accepted model."""
    rest = problem.distances(model[None], problem.first[inliers], problem.second[inliers])[0]
    return RobustEstimate(model, VisionStatus.OK, inliers, float(np.sqrt(np.mean(rest**2))), n_samples)
