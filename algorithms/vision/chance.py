"""Whether as many points agree with a model as chance alone would make agree: a bound on the number of false alarms.

Desolneux, Moisan and Morel, *From Gestalt Theory to Image Analysis*, 2008; Moisan and Stival, IJCV 57, 2004.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import bdtrc, gammaln

from ..arguments import Reals

_LEVELS = 24
"""Points are counted within the threshold, half of it, a fourth, and so on: exact points need fewer of them."""
_NEAREST = 16
"""The share of wrong pairs within a small distance is that of so many nearest ones, scaled."""


@dataclass(frozen=True, slots=True)
class Freedom:
    """What a model can be fitted to."""

    sample_size: int
    """Points that determine it."""
    parameters: int
    """Its degrees of freedom."""
    codimension: int
    """Numbers that it leaves of one point."""
    solutions: int
    """That a sample has at most."""
    false_alarms: float
    """The bound that is accepted. It is too large, the more so the more parameters there are."""


def by_chance(distances: Reals, wrong: Reals, threshold: float, freedom: Freedom) -> bool:
    """Return whether a model whose n points have these `distances` may be what chance leaves.

    `wrong` are the distances of points that were given the partners of others.

    Models fitted to any of the points are counted by those that decide which points are near. A model may be moved
    until as many points as it has parameters are at the threshold exactly, on either side: that leaves
    ``solutions 2^parameters binomial(n, parameters)`` of them. Or it is replaced by that of a sample of its points,
    chosen so that others are at most ``1 + sample_size`` times as far away. The other points agree with each of them
    independently, with the share of wrong ones that do. The smaller bound counts, over all levels of distance.
    """
    nearest = np.sort(wrong[np.isfinite(wrong)])
    if not len(nearest):
        return False
    base = nearest[min(_NEAREST, max(len(nearest) // 2, 1)) - 1]
    bounds = []
    for level in range(_LEVELS):
        limit = threshold / 2**level
        if limit >= base:
            share = np.searchsorted(nearest, limit, side="right") / len(wrong)
        else:
            within = np.searchsorted(nearest, base, side="right") / len(wrong)
            share = within * (limit / base) ** freedom.codimension
        count = int((distances <= limit).sum())
        bounds.append((level + 1) * np.log(2) + _log_false_alarms(len(distances), count, share, freedom))
    return bool(min(bounds) > np.log(freedom.false_alarms))


def _log_false_alarms(n: int, count: int, share: float, freedom: Freedom) -> float:
    """Return the logarithm of the expected number of models with so many points near, of n that have no model."""
    wider = min(share * (1 + freedom.sample_size) ** freedom.codimension, 1.0)
    moved = freedom.parameters * np.log(2) + _log_chosen(n, count, share, freedom.parameters)
    sampled = _log_chosen(n, count, wider, freedom.sample_size)
    return float(np.log(freedom.solutions) + min(moved, sampled))


def _log_chosen(n: int, count: int, share: float, chosen: int) -> float:
    """Of choices of points to fit, times the probability that as many others are near."""
    if count <= chosen:
        return np.inf
    choices = gammaln(n + 1) - gammaln(chosen + 1) - gammaln(n - chosen + 1)
    with np.errstate(divide="ignore"):
        return float(choices + np.log(bdtrc(count - chosen - 1, n - chosen, share)))
