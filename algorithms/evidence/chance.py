"""Test whether a model has no more inliers than expected by chance: a bound on the number of false alarms.

Desolneux, Moisan and Morel, *From Gestalt Theory to Image Analysis*, 2008; Moisan and Stival, IJCV 57, 2004.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import lgamma, log

import numpy as np
import scipy

from generated.gac_runtime.annotations import Real

from ..arguments import Reals
from ..precision import TINY

_LEVELS = 24
"""A limit on work: number of distance levels, the threshold, half of it, a quarter, ...; exact points need more."""
_NEAREST = 16
"""From a probability, whose relative error is then a quarter: fractions of wrong pairs at small distances are
extrapolated from this number of nearest ones."""
_MISSED = 1e-6
"""From a probability: that a few wrong pairs agree less often than their share would let expect."""


@dataclass(frozen=True, slots=True)
class Freedom:
    """Degrees of freedom of a model."""

    sample_size: int
    """Number of points that determine the model."""
    parameters: int
    """Number of parameters of the model."""
    codimension: int
    """Number of residuals of one point."""
    solutions: int
    """Maximum number of models that fit a sample."""
    false_alarms: float
    """Accepted bound on the number of false alarms. It is conservative, the more so the more parameters there are."""


def by_chance(distances: Reals, wrong: Reals, threshold: float, freedom: Freedom) -> bool:
    """Return whether the `distances` of n points to a model can be explained by chance.

    `wrong` are the distances of wrong pairs, in which points have the partners of other points. Without any wrong pair,
    nothing is known about chance, and the result is True.

    Models are counted by the sets of points that they make inliers. Two methods bound the number of these sets. First,
    a model can be moved until as many points as it has parameters are exactly at the threshold, on either side, which
    gives ``solutions 2^parameters binomial(n, parameters)`` models. Second, it can be replaced by the model of a sample
    of its inliers, chosen so that the other distances grow by at most a factor of ``1 + sample_size``. The remaining
    points are inliers independently, with the same probability as wrong pairs. The smaller bound over all distance
    levels is used.
    """
    if not len(wrong):
        return True
    return _is_by_chance(distances, share_of(wrong, freedom.codimension), threshold, freedom)


def surely_not_by_chance(n: int, count: int, wrong: Reals, threshold: float, freedom: Freedom) -> bool:
    """Return whether a few `wrong` pairs suffice to show that chance does not explain `count` of n points.

    It bounds the share of wrong pairs within the threshold by an upper confidence limit (Clopper and Pearson).
    """
    share = float(scipy.special.bdtri(np.count_nonzero(wrong <= threshold), len(wrong), _MISSED))
    return _are_far_from_chance(n, count, share, freedom)


def share_of(wrong: Reals, codimension: int) -> Callable[[float], float]:
    """Return the function from a limit to the share of the distances of some wrong pairs within it.

    Below the nearest ones, it is extrapolated, for distances with a `codimension`.
    """
    n, base = len(wrong), None

    def share(limit: float) -> float:
        nonlocal base
        within = np.count_nonzero(wrong <= limit)
        if within >= _NEAREST:
            return within / n
        if base is None:
            base = _nearest_limit(wrong)
        return _expected(wrong, base, limit, codimension) / n

    return share


def _nearest_limit(wrong: Reals) -> float:
    """Return the largest distance of the nearest wrong pairs, by which fractions are extrapolated."""
    finite = wrong[np.isfinite(wrong)]
    rank = _nearest(len(finite)) - 1
    return float(np.partition(finite, rank)[rank]) if len(finite) else np.inf


def tail_by_chance(distances: Reals, threshold: float, freedom: Freedom) -> bool:
    """Return whether the `distances` of points within a threshold can be the nearest ones of those beyond it.

    Near a model, these then have the density of the nearer half of the points beyond: the nearest ones may be of the
    noise. It is the least density that so many points do not exceed with the probability of no false alarm, since one
    or two points that disagree prove little.
    """
    beyond = np.sort(distances[(distances > threshold) & np.isfinite(distances)])
    if not len(beyond):
        return False
    k, codimension = _nearest(len(beyond)), freedom.codimension
    density = float(scipy.special.gammaincinv(k, freedom.false_alarms) / beyond[k - 1] ** codimension) / len(distances)
    return _is_by_chance(distances, lambda limit: min(density * limit**codimension, 1.0), threshold, freedom)


def _nearest(n: int) -> int:
    """Return by how many of n wrong pairs, the nearest ones, fractions at small distances are extrapolated."""
    return min(_NEAREST, max(n // 2, 1))


def _is_by_chance(distances: Reals, share: Callable[[float], float], threshold: float, freedom: Freedom) -> bool:
    """Return whether chance explains distances, from the probability that a wrong point is within a limit."""
    n, count = len(distances), int(np.count_nonzero(distances <= threshold))
    if _are_far_from_chance(n, count, share(threshold), freedom):
        return False
    levels = np.arange(_LEVELS)
    limits = threshold / 2.0**levels
    counts = np.searchsorted(np.sort(distances), limits, side="right")
    shares = np.array([share(limit) for limit in limits])
    bounds = (levels + 1) * np.log(2) + log_false_alarms(n, counts, shares, freedom)
    return bool(bounds.min() > np.log(freedom.false_alarms))


def _expected(wrong: Reals, base: float, limit: float, codimension: int) -> float:
    """Return how many wrong pairs are expected within a limit, extrapolated if it is below the distance `base`."""
    if limit >= base:
        return float(np.count_nonzero(wrong <= limit))
    return float(np.count_nonzero(wrong <= base)) * (limit / max(base, TINY)) ** codimension


def _are_far_from_chance(n: int, count: int, share: float, freedom: Freedom) -> bool:
    """Return whether Chernoff's bound on the tail, which is larger, suffices at the first level: the usual case."""
    others, agreeing = n - freedom.parameters, count - freedom.parameters
    if not 0 < share * others < agreeing:
        return False
    rest = others - agreeing
    tail = agreeing * log(share * others / agreeing) + (rest * log((1 - share) * others / rest) if rest else 0.0)
    chosen = lgamma(n + 1) - lgamma(freedom.parameters + 1) - lgamma(others + 1)
    moved = log(freedom.solutions) + freedom.parameters * log(2) + chosen + tail
    return moved + log(2) <= log(freedom.false_alarms)


def least_by_chance(distances: Reals, share: Callable[[Reals], Reals], freedom: Freedom) -> tuple[Real, Real]:
    """Return the threshold with which the inliers of a model are least likely by chance.

    Parameters
    ----------
    distances : array, (..., n)
        Of all points from the model, or from each model.
    share : callable
        Function from distances (..., n) to the probability that a wrong point is as near.
    freedom : Freedom

    Returns
    -------
    logarithm, threshold : float, or array (...)
        The natural logarithm of the expected number of models by chance with as many inliers, and the largest distance
        of an inlier. They are infinity and 0 without points.
    """
    limits = np.sort(distances, axis=-1)
    n = limits.shape[-1]
    if not n:
        return np.full(limits.shape[:-1], np.inf)[()], np.zeros(limits.shape[:-1])[()]  # type: ignore[return-value]
    logs = log_false_alarms(n, np.arange(1, n + 1), share(limits), freedom) + np.log(n)
    k = np.argmin(logs, axis=-1)[..., None]
    return tuple(np.take_along_axis(row, k, -1)[..., 0][()] for row in (logs, limits))  # type: ignore[return-value]


def log_false_alarms(n: int, count: Reals, share: Reals, freedom: Freedom) -> Reals:
    """Return logarithms of the expected numbers of models with `count` inliers or more among n unrelated points."""
    wider = np.minimum(np.asarray(share) * (1 + freedom.sample_size) ** freedom.codimension, 1.0)
    moved = freedom.parameters * np.log(2) + _log_chosen(n, count, share, freedom.parameters)
    sampled = _log_chosen(n, count, wider, freedom.sample_size)
    return np.asarray(np.log(freedom.solutions) + np.minimum(moved, sampled))


def _log_chosen(n: int, count: Reals, share: Reals, chosen: int) -> Reals:
    """Return logarithms of the number of choices of points to fit, times the probability of the other inliers."""
    if n <= chosen:
        return np.full(np.broadcast(count, share).shape, np.inf)
    others = np.asarray(count) - chosen
    logs = log_choices(n, chosen) + _log_tail(np.maximum(others, 1), n - chosen, np.asarray(share, float))
    return np.where(others <= 0, np.inf, logs)


def log_choices(n: int, k: Reals | int) -> Reals:
    """Return the logarithm of the number of combinations of n things taken k at a time."""
    gamma = scipy.special.gammaln
    return np.asarray(gamma(n + 1) - gamma(np.asarray(k) + 1) - gamma(n - np.asarray(k) + 1))


def _log_tail(count: Reals, n: int, share: Reals) -> Reals:
    """Return the logarithm of the probability of `count` or more successes in n trials, also where it underflows.

    There, the terms of the sum fall at least as fast as a geometric series from the first one on, whose sum is a bound.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        tail = scipy.special.bdtrc(count - 1, n, share)
        first = log_choices(n, count) + count * np.log(share) + (n - count) * np.log1p(-share)
        ratio = (n - count) * share / ((count + 1) * (1 - share))
        return np.asarray(np.where(tail > TINY, np.log(tail), first - np.log1p(-ratio)))
