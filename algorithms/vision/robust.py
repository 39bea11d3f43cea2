"""Estimates in spite of wrong points: random samples, the best improved on the points that agree (LO-RANSAC)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arguments import Reals, finite_number
from .status import VisionStatus

_BATCH = 32
"""Samples that are solved and scored at once."""


@dataclass(frozen=True, slots=True, eq=False)
class RobustEstimate:
    """What most points agree on."""

    model: Reals
    """The matrix, or NaN where the status is not OK."""
    status: VisionStatus
    inliers: Reals
    """(n,) bool: the points within the threshold."""
    distance: float
    """The root of the mean square of the distances of inliers, in pixels."""
    n_samples: int


@dataclass(frozen=True, slots=True)
class Problem:
    """What sampling needs to know of a model."""

    n_points: int
    sample_size: int
    solve: Callable[[Reals], Reals]
    """Index sets (b, sample_size) to models (m, ...), NaN where there is none."""
    distances: Callable[[Reals], Reals]
    """Models (m, ...) to distances (m, n_points), in pixels, not negative."""
    improve: Callable[[Reals, Reals], Reals | None]
    """A model and its inliers to a better model, or None."""


def check_sampling(threshold: float, confidence: float, max_samples: int) -> None:
    """ValueError or TypeError where one of these is no such number."""
    if finite_number(threshold, "threshold") <= 0:
        raise ValueError(f"threshold: {threshold}; expected more than 0 pixels")
    if not 0 < finite_number(confidence, "confidence") < 1:
        raise ValueError(f"confidence: {confidence}; expected a probability between 0 and 1, both excluded")
    if isinstance(max_samples, bool) or not isinstance(max_samples, (int, np.integer)):
        raise TypeError(f"max_samples: {max_samples!r}; expected a whole number")
    if max_samples < 1:
        raise ValueError(f"max_samples: {max_samples}; expected at least 1")


def consensus(problem: Problem, threshold: float, seed: int, confidence: float, max_samples: int) -> RobustEstimate:
    """The model with the least truncated squares of distances (MSAC), improved whenever a better one is found.

    Samples are drawn until one without wrong points has been among them with the given confidence. Chum, Matas and
    Kittler, *Locally optimized RANSAC*, DAGM 2003.
    """
    rng = np.random.default_rng(seed)
    n, size, limit = problem.n_points, problem.sample_size, threshold * threshold

    def score(models: Reals) -> tuple[Reals, Reals]:
        squares = np.nan_to_num(problem.distances(models) ** 2, nan=np.inf)
        return np.minimum(squares, limit).sum(-1), squares <= limit

    best: tuple[float, Reals, Reals] | None = None
    drawn, wanted = 0, float(max_samples)
    while drawn < wanted:
        sets = np.argpartition(rng.random((_BATCH, n)), size - 1, axis=1)[:, :size]
        drawn += _BATCH
        models = problem.solve(sets)
        if not len(models):
            continue
        models = models[np.isfinite(models).reshape(len(models), -1).all(-1)]
        if not len(models):
            continue
        costs, within = score(models)
        k = int(np.argmin(costs))
        if best is not None and costs[k] >= best[0]:
            continue
        best = _improved((float(costs[k]), models[k], within[k]), problem, score)
        share = max(float(best[2].mean()), 1e-3)
        wanted = min(max_samples, np.log(1 - confidence) / min(np.log1p(-min(share**size, 1 - 1e-12)), -1e-12))
    if best is None or best[2].sum() <= size:
        nothing = np.full(() if best is None else best[1].shape, np.nan)
        return RobustEstimate(nothing, VisionStatus.NO_CONSENSUS, np.zeros(n, bool), np.nan, drawn)
    _, model, inliers = best
    rest = problem.distances(model[None])[0][inliers]
    return RobustEstimate(model, VisionStatus.OK, inliers, float(np.sqrt(np.mean(rest**2))), drawn)


def _improved(
    best: tuple[float, Reals, Reals], problem: Problem, score: Callable[[Reals], tuple[Reals, Reals]]
) -> tuple[float, Reals, Reals]:
    for _ in range(10):
        model = problem.improve(best[1], best[2])
        if model is None or not np.isfinite(model).all():
            return best
        costs, within = score(model[None])
        if not costs[0] < best[0] * (1 - 1e-9):
            return best
        best = float(costs[0]), model, within[0]
    return best
