"""The variance of residuals: what is known before they are seen, what they say, and whether both agree.

The variance has an inverse gamma distribution: it is as well known as by `weight` residuals seen before. An infinite
weight is a variance that the caller states. Mean squares then have Fisher's distribution, or that of chi-square.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from math import isinf

import numpy as np
import scipy

from ..arguments import Reals
from ..precision import TINY
from .status import WRONG

NORMAL = 1.4826
"""From a probability: half of normal numbers are smaller than 1 / 1.4826 standard deviations."""
ENOUGH = 12
"""From a probability: fewer offsets have no reliable median."""
USUAL_WEIGHT = 4.0
"""From a probability: the usual noise of photographs is as certain as by this number of residuals, so that a seventh to
five times as much is not a contradiction."""

_TAILS = 4.0 ** np.arange(4)[:, None]
"""A limit on work: tails that are tried, in relation to the median of squares."""
_EXPONENTS = np.geomspace(0.51, 200.0, 200)
"""A limit on work: half of one more than the degrees of freedom of Student's distribution that are tried."""


def deviation_of_most(offsets: Reals) -> float:
    """Return the standard deviation of the normal distribution whose median of absolute values is that of the offsets.

    Up to half of the offsets may be wrong.
    """
    return NORMAL * float(np.median(np.abs(offsets)))


def tail_of(squares: Reals) -> float:
    """Return the square of an error whose weight is half of that of small ones, or infinity if errors look normal.

    Errors whose variances differ have Student's distribution: their densities are powers of ``1 + square / tail``. The
    likeliest tail and power are sought, and compared with the normal distribution.

    Parameters
    ----------
    squares : array, (n,)
        Squared errors.
    """
    middle, mean = float(np.median(squares)), float(np.mean(squares))
    if middle <= TINY:
        return np.inf
    tails = _TAILS * middle
    logarithms = np.log1p(squares / tails).mean(1, keepdims=True)
    likelihoods = (_factors() - _EXPONENTS * logarithms).max(1, keepdims=True) - np.log(tails) / 2
    k = int(likelihoods.argmax())
    return float(tails[k, 0]) if likelihoods[k, 0] > -np.log(2 * np.pi * np.e * mean) / 2 else np.inf


@cache
def _factors() -> Reals:
    """Return the logarithms of the factors that normalise Student's distributions with these exponents."""
    return np.asarray(scipy.special.gammaln(_EXPONENTS) - scipy.special.gammaln(_EXPONENTS - 0.5) - np.log(np.pi) / 2)


@lru_cache(maxsize=1000)
def largest_ratio(n: int, freedom: float = np.inf, probability: float = WRONG) -> float:
    """Return the ratio that the mean square of `n` residuals exceeds with a probability.

    Parameters
    ----------
    n : int
        Number of residuals.
    freedom : float
        Number of other residuals by which the variance is known.
    probability : float
    """
    if isinf(freedom):
        return float(scipy.special.chdtri(n, probability)) / n
    # The lower quantile of the reciprocal is precise, also for small probabilities.
    return 1 / float(scipy.special.fdtri(freedom, n, probability))


def growth_by_threshold(n_within: int, n_beyond: int, codimension: int = 1) -> float:
    """Return the factor by which a threshold near the noise makes the variance of least squares larger.

    Items within a threshold c are used. A change of the parameters also moves items across it, which leaves the
    fraction ``F(c**2; k + 2) / F(c**2; k)`` of the information of those within, with the chi-square distributions F of
    k residuals (Huber, *Robust Statistics*, 1981). The threshold, in deviations of normal noise, follows from how many
    items are within it and within twice of it. For one residual, the factor is 1.06 for three deviations, 1.7 for two
    and 12 for one. It is infinite below: there, items look as if their distances were uniform.

    Parameters
    ----------
    n_within, n_beyond : int
        Numbers of items up to the threshold, and from there to twice of it.
    codimension : int, optional
        Number of residuals of an item.
    """
    ratios, factors = _growths(codimension)
    return float(np.interp(n_beyond / max(n_within, 1), ratios, factors, right=np.inf))


@lru_cache(maxsize=10)
def _growths(codimension: int) -> tuple[Reals, Reals]:
    """Return ratios of items beyond a threshold, ascending, and the factors of the variance."""
    c = np.linspace(6.0, 1.0, 200)
    within, twice, left = (
        scipy.special.chdtr(k, each * each)
        for k, each in ((codimension, c), (codimension, 2 * c), (codimension + 2, c))
    )
    return twice / within - 1, (left / within) ** -2.0


@dataclass(frozen=True, slots=True)
class Noise:
    """The variance of residuals before they are seen."""

    variance: float
    weight: float = np.inf
    """The number of residuals that this knowledge is worth; infinite if the caller states the variance."""

    def raised(self, cost: Reals | float, freedom: int) -> Reals:
        """Return the variance after residuals are seen, which these can only raise if it was stated.

        Parameters
        ----------
        cost : array, (...)
            Sums of squares.
        freedom : int
            Number of residuals minus number of parameters.

        Returns
        -------
        array, (...)
        """
        if isinf(self.weight):
            return np.maximum(self.variance, np.asarray(cost) / max(freedom, 1))
        return np.asarray((self.weight * self.variance + cost) / (self.weight + max(freedom, 0)))

    def contradicted(self, cost: Reals, freedom: int) -> Reals:
        """Return whether sums of squares (...) are larger than noise would leave with the probability `WRONG`."""
        if freedom <= 0:
            return np.zeros(np.shape(cost), np.bool_)
        return np.asarray(~(np.asarray(cost) <= freedom * largest_ratio(freedom, self.weight) * self.variance))

    def outlying(self, squares: Reals, codimension: int, cost: Reals, freedom: int) -> Reals:
        """Return which of n items are farther off than noise would place the farthest of them.

        Parameters
        ----------
        squares : array, (..., n)
            Squared distances of items that were not used, or whose influence is small.
        codimension : int
            Number of residuals of an item.
        cost : array, (..., n) or (..., 1)
            Sum of squares of the items that give the variance.
        freedom : int
            Its number of degrees of freedom.

        Returns
        -------
        array of bool, (..., n)
        """
        ratio = largest_ratio(codimension, self.weight + max(freedom, 0), WRONG / max(np.shape(squares)[-1], 1))
        return np.asarray(~(squares <= codimension * ratio * self.raised(cost, freedom)))


def explains(found: Reals, truth: Reals) -> bool:
    """Return whether numbers (n,) explain more of the variance of others (n,) than they leave, up to a linear map.

    Unrelated images that are moved to resemble each other have correlations of up to a half; those of one scene exceed
    the limit unless their noise is as large as their contrast. Constant numbers explain nothing.
    """
    one, two = found - found.mean(dtype=float), truth - truth.mean(dtype=float)
    common, squares = float((one * two).sum(dtype=float)), (one**2).sum(dtype=float) * (two**2).sum(dtype=float)
    return bool(common > 0 and 2 * common**2 > squares)
