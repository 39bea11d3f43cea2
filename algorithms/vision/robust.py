"""Robust estimation by random samples, with the best models refined on the points that agree (LO-RANSAC)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals, finite_number
from .chance import Freedom, by_chance
from .status import VisionStatus

_BATCHES = (32, 64, 128, 256)
"""Numbers of samples that are solved and scored at once; the last one is used for all further batches."""
_SUBSET = 64
"""If there are many points, models are first scored on this number of them,"""
_KEPT = 32
"""and this number of models is scored on all points."""
_STEPS = 10
"""Maximum number of refinement steps of a model."""
N_WRONG = 20000
"""Number of wrong pairs that are used to estimate the distances of unrelated points."""

Indices = NDArray[Any]
"""Indices of points: integers, or bool."""


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


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Definition of a model for sampling."""

    first: Reals
    """(n, ...) One side of the pairs,"""
    second: Reals
    """(n, ...) and the other."""
    freedom: Freedom
    solve: Callable[[Indices], Reals]
    """Function from index sets (b, sample_size) to models (m, ...); missing ones are NaN."""
    distances: Callable[[Reals, Reals, Reals], Reals]
    """Function from models (m, ...) and both sides (k, ...) of pairs to nonnegative distances (m, k), in pixels."""
    improve: Callable[[Reals, Indices], Reals | None]
    """Function from a model and its inliers to a better model, or None."""


def check_sampling(threshold: float, confidence: float, max_samples: int) -> None:
    """Raise ValueError or TypeError if one of these options is invalid."""
    if finite_number(threshold, "threshold") <= 0:
        raise ValueError(f"threshold: {threshold}; expected more than 0 pixels")
    if not 0 < finite_number(confidence, "confidence") < 1:
        raise ValueError(f"confidence: {confidence}; expected a probability between 0 and 1, both excluded")
    if isinstance(max_samples, bool) or not isinstance(max_samples, (int, np.integer)):
        raise TypeError(f"max_samples: {max_samples!r}; expected a whole number")
    if max_samples < 1:
        raise ValueError(f"max_samples: {max_samples}; expected at least 1")


def no_estimate(
    status: VisionStatus, n_points: int, shape: tuple[int, ...] = (3, 3), n_samples: int = 0
) -> RobustEstimate:
    """Return an estimate without a model."""
    return RobustEstimate(np.full(shape, np.nan), status, np.zeros(n_points, bool), np.nan, n_samples)


def consensus(problem: Problem, threshold: float, seed: int, confidence: float, max_samples: int) -> RobustEstimate:
    """Return the model with the least truncated squared distances (MSAC); every new best model is refined.

    Samples are drawn until one of them is free of wrong points with the given confidence; if `max_samples` is too small
    for that, the status is NOT_CONVERGED. The status is NO_CONSENSUS for a model with no more inliers than expected by
    chance. Chum, Matas and Kittler, *Locally optimized RANSAC*, DAGM 2003.
    """
    rng = np.random.default_rng(seed)
    n, size = len(problem.first), problem.freedom.sample_size
    best: tuple[float, Reals, Indices] | None = None
    drawn, wanted, round_, least = 0, np.inf, 0, np.inf
    while drawn < min(wanted, max_samples):
        batch = min(_BATCHES[min(round_, len(_BATCHES) - 1)], max_samples - drawn)
        drawn, round_ = drawn + batch, round_ + 1
        models = problem.solve(_samples(rng, n, size, batch))
        models = models[np.isfinite(models).reshape(len(models), -1).all(-1)] if len(models) else models
        models = _promising(problem, models, threshold, rng)
        if not len(models):
            continue
        costs, within = _scores(problem, models, threshold, slice(None))
        k = int(np.argmin(costs))
        if costs[k] >= least:
            continue
        # Refine each new best sample. If compared with refined models, few would be, and maybe not the right one.
        least = costs[k]
        better = _improved(problem, (float(costs[k]), models[k], within[k]), threshold)
        if best is not None and better[0] >= best[0]:
            continue
        best = better
        share = float(best[2].mean())
        wanted = np.log(1 - confidence) / min(np.log1p(-min(share**size, 1 - 1e-12)), -1e-300)
    if best is None:
        return no_estimate(VisionStatus.NO_CONSENSUS, n, n_samples=drawn)
    _, model, inliers = best
    status = VisionStatus.OK if drawn >= wanted else VisionStatus.NOT_CONVERGED
    if explained_by_chance(problem, model, threshold, rng):
        status = VisionStatus.NO_CONSENSUS
    if status != VisionStatus.OK:
        return no_estimate(status, n, model.shape, drawn)
    return estimate(problem, model, inliers, drawn)


def estimate(problem: Problem, model: Reals, inliers: Indices, n_samples: int) -> RobustEstimate:
    """Return the result for an accepted model."""
    rest = problem.distances(model[None], problem.first[inliers], problem.second[inliers])[0]
    return RobustEstimate(model, VisionStatus.OK, inliers, float(np.sqrt(np.mean(rest**2))), n_samples)


def polished(problem: Problem, model: Reals, threshold: float) -> tuple[float, Reals, Indices]:
    """Return the cost of a model that is refined until the cost stops decreasing, the model, and its inliers."""
    costs, within = _scores(problem, model[None], threshold, slice(None))
    return _improved(problem, (float(costs[0]), model, within[0]), threshold)


def explained_by_chance(problem: Problem, model: Reals, threshold: float, rng: np.random.Generator) -> bool:
    """Return whether wrong points alone could agree with a model as well. Repeated points count once."""
    n = len(problem.first)
    pairs = np.concatenate([problem.first.reshape(n, -1), problem.second.reshape(n, -1)], -1)
    once = np.unique(pairs, axis=0, return_index=True)[1]
    first, second = problem.first[once], problem.second[once]
    distances = problem.distances(model[None], first, second)[0]
    order = rng.permutation(len(once))
    wrong = [
        problem.distances(model[None], first[order], second[np.roll(order, shift)])[0]
        for shift in range(1, min(len(once) - 1, -(-N_WRONG // len(once))) + 1)
    ]
    return len(once) <= problem.freedom.sample_size or by_chance(
        np.nan_to_num(distances, nan=np.inf), np.concatenate(wrong), threshold, problem.freedom
    )


def _samples(rng: np.random.Generator, n: int, size: int, count: int) -> Indices:
    """Return subsets (count, size) of n indices, all equally likely (Floyd's algorithm)."""
    sets = np.empty((count, size), np.intp)
    for k in range(size):
        last = n - size + k
        drawn = rng.integers(0, last + 1, count)
        sets[:, k] = np.where((sets[:, :k] == drawn[:, None]).any(1), last, drawn)
    return sets


def _scores(problem: Problem, models: Reals, threshold: float, where: slice | Indices) -> tuple[Reals, Indices]:
    squares = np.nan_to_num(problem.distances(models, problem.first[where], problem.second[where]) ** 2, nan=np.inf)
    return np.minimum(squares, threshold * threshold).sum(-1), squares <= threshold * threshold


def _promising(problem: Problem, models: Reals, threshold: float, rng: np.random.Generator) -> Reals:
    """Return the models that are best for some of the points, if there are many models and points."""
    n = len(problem.first)
    if n <= 2 * _SUBSET or len(models) <= 2 * _KEPT:
        return models
    costs, _ = _scores(problem, models, threshold, rng.integers(0, n, _SUBSET))
    return np.asarray(models[np.argpartition(costs, _KEPT)[:_KEPT]])


def _improved(problem: Problem, best: tuple[float, Reals, Indices], threshold: float) -> tuple[float, Reals, Indices]:
    """Refine a model on the points within twice the threshold, which helps from farther away, then on the inliers."""
    wide = _scores(problem, best[1][None], 2 * threshold, slice(None))[1][0]
    best = _step(problem, best, wide, threshold) or best
    for _ in range(_STEPS):
        better = _step(problem, best, best[2], threshold)
        if better is None:
            break
        best = better
    return best


def _step(
    problem: Problem, best: tuple[float, Reals, Indices], used: Indices, threshold: float
) -> tuple[float, Reals, Indices] | None:
    model = problem.improve(best[1], used)
    if model is None or not np.isfinite(model).all():
        return None
    costs, within = _scores(problem, model[None], threshold, slice(None))
    return (float(costs[0]), model, within[0]) if costs[0] < best[0] * (1 - 1e-9) else None
