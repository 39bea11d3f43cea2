"""Consensus: models with which many items agree, from random samples whose best models are refined (LO-RANSAC)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals, finite_number
from .chance import Freedom, by_chance
from .sampling import random_subsets

_BATCHES = (32, 64, 128, 256)
"""A limit on work: numbers of samples that are solved and scored at once; the last one is used for further batches."""
_SUBSET = 64
"""A limit on work: if there are many items, models are first scored on this number of them,"""
_KEPT = 32
"""and this number of models is scored on all items."""
_REFINED = 4
"""A limit on work: models of samples that are refined together; truncated squares have several minima."""
N_WRONG = 5000
"""A limit on work: number of wrong pairs by which the distances of unrelated items are estimated."""
_ROUNDING = 1e-9
"""From floating point: a relative change of a cost below this is rounding."""

Indices = NDArray[Any]
"""Indices of items: integers, or bool."""


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
    """Function from models (m, ...) and both sides (k, ...) of pairs to nonnegative distances (m, k)."""
    costs: Callable[[Reals, Reals, Reals, float], Reals]
    """Function from models (m, ...), both sides (k, ...) of pairs and a threshold to sums (m,) of truncated squared
    distances."""
    descend: Callable[[Reals, float], Reals]
    """Function from a model and a threshold to the model near it with the least truncated squares."""


class Hypothesis(NamedTuple):
    """A model and the items that agree with it."""

    cost: float
    """The sum of truncated squared distances."""
    model: Reals
    inliers: Indices
    """(n,) bool"""


@dataclass(frozen=True, slots=True, eq=False)
class Consensus:
    """Result of `consensus`."""

    hypotheses: list[Hypothesis]
    """The best model first; the others are those whose inliers it does not share for the most part."""
    n_samples: int
    reached: bool
    """Whether a sample without wrong items was drawn with the given confidence."""
    by_chance: bool
    """Whether chance explains the inliers of the best model."""


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


def consensus(problem: Problem, threshold: float, seed: int, confidence: float, max_samples: int) -> Consensus:
    """Return the model with the least truncated squared distances (MSAC); new best models are refined.

    Samples are drawn until one of them is free of wrong items with the given confidence. Chum, Matas and Kittler,
    *Locally optimized RANSAC*, DAGM 2003.
    """
    rng = np.random.default_rng(seed)
    n, size = len(problem.first), problem.freedom.sample_size
    found = list[Hypothesis]()
    drawn, wanted, round_, least = 0, np.inf, 0, np.inf
    while drawn < min(wanted, max_samples):
        batch = min(_BATCHES[min(round_, len(_BATCHES) - 1)], max_samples - drawn)
        drawn, round_ = drawn + batch, round_ + 1
        models = problem.solve(random_subsets(rng, n, size, batch))
        models = models[np.isfinite(models).reshape(len(models), -1).all(-1)] if len(models) else models
        models = _promising(problem, models, threshold, rng)
        if not len(models):
            continue
        costs = _costs(problem, models, threshold, slice(None))
        order = np.argsort(costs, kind="stable")[:_REFINED]
        if costs[order[0]] >= least:
            continue
        # Refine each new best sample. If compared with refined models, few would be, and maybe not the right one.
        least = costs[order[0]]
        for k in order:
            found = _merged(found, polished(problem, models[k], threshold))
        share = float(found[0].inliers.mean())
        wanted = np.log(1 - confidence) / min(np.log1p(-min(share**size, 1 - 1e-12)), -1e-300)
    explained = not found or explained_by_chance(problem, found[0].model, threshold, rng)
    return Consensus(found, drawn, bool(drawn >= wanted), explained)


def _merged(found: list[Hypothesis], new: Hypothesis) -> list[Hypothesis]:
    """Return hypotheses by cost, of which no two share most of their inliers."""
    kept = list[Hypothesis]()
    for each in sorted([*found, new], key=lambda one: one.cost):
        if all(2 * (each.inliers & one.inliers).sum() <= each.inliers.sum() for one in kept):
            kept.append(each)
    return kept


def polished(problem: Problem, model: Reals, threshold: float) -> Hypothesis:
    """Return a model that is refined until its cost stops decreasing."""
    return _improved(problem, _hypothesis(problem, model, threshold), threshold)


def explained_by_chance(problem: Problem, model: Reals, threshold: float, rng: np.random.Generator) -> bool:
    """Return whether shuffled partners could agree with a model as well. Repeated items count once."""
    once = _without_repeats(problem)
    first, second = problem.first[once], problem.second[once]
    distances = problem.distances(model[None], first, second)[0]
    order = rng.permutation(len(once))
    repeats, partner = partners_of_others(len(once))
    wrong = problem.distances(
        model[None], np.tile(first[order], (repeats, *(1,) * (first.ndim - 1))), second[order[partner]]
    )
    return len(once) <= problem.freedom.sample_size or by_chance(
        without_nan(distances), wrong[0], threshold, problem.freedom
    )


def _without_repeats(problem: Problem) -> Indices:
    """Return the indices of different pairs."""
    n = len(problem.first)
    one, two = problem.first.reshape(n, -1), problem.second.reshape(n, -1)
    column = np.sort(one[:, 0])
    if (column[1:] != column[:-1]).all():  # the usual case, in a fraction of the time of sorting rows
        return np.arange(n)
    return np.unique(np.concatenate([one, two], -1), axis=0, return_index=True)[1]


def partners_of_others(n: int) -> tuple[int, Indices]:
    """Return how often n pairs are repeated for about `N_WRONG` wrong ones, and which other pair each partner is of."""
    shifts = np.arange(1, min(n - 1, -(-N_WRONG // n)) + 1)
    return len(shifts), ((np.arange(n) - shifts[:, None]) % n).ravel()


def _costs(problem: Problem, models: Reals, threshold: float, where: slice | Indices) -> Reals:
    """Return the sums (m,) of truncated squared distances of some items."""
    first, second = problem.first[where], problem.second[where]
    return without_nan(problem.costs(models, first, second, threshold))


def _hypothesis(problem: Problem, model: Reals, threshold: float) -> Hypothesis:
    """Return a model with its cost and its inliers."""
    distances = without_nan(problem.distances(model[None], problem.first, problem.second)[0])
    truncated = np.minimum(distances, threshold)
    return Hypothesis(float(truncated @ truncated), model, distances <= threshold)


def without_nan(numbers: Reals) -> Reals:
    """Return numbers with infinity in the place of NaN."""
    return np.where(np.isnan(numbers), np.inf, numbers)


def _promising(problem: Problem, models: Reals, threshold: float, rng: np.random.Generator) -> Reals:
    """Return the models that are best for some of the items, if there are many models and items."""
    n = len(problem.first)
    if n <= 2 * _SUBSET or len(models) <= 2 * _KEPT:
        return models
    costs = _costs(problem, models, threshold, rng.integers(0, n, _SUBSET))
    return np.asarray(models[np.argpartition(costs, _KEPT)[:_KEPT]])


def _improved(problem: Problem, best: Hypothesis, threshold: float) -> Hypothesis:
    """Refine a model with twice the threshold, which helps from farther away, and then with the threshold."""
    for limit in (2 * threshold, threshold):
        best = _better(problem, best, problem.descend(best.model, limit), threshold) or best
    return best


def _better(problem: Problem, best: Hypothesis, model: Reals, threshold: float) -> Hypothesis | None:
    """Return the hypothesis of a model if its cost is less than that of the best one."""
    if not np.isfinite(model).all():
        return None
    found = _hypothesis(problem, model, threshold)
    return found if found.cost < best.cost * (1 - _ROUNDING) else None
