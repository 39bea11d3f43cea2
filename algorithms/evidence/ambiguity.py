"""Competing minima: which of them the data cannot reject, and which of them are the same."""

from __future__ import annotations

from functools import lru_cache
from math import isinf

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals
from .noise import Noise, largest_ratio
from .status import WRONG


def likely(costs: Reals, n_residuals: int, freedom: int, noise: Noise) -> NDArray[np.bool_]:
    """Return which minima have a likelihood of more than `WRONG` in relation to the best one.

    Parameters
    ----------
    costs : array, (..., m)
        Sums of squares at the minima; infinite for missing ones.
    n_residuals, freedom : int
        Number of residuals, and that minus the number of parameters.
    noise : Noise
        With a variance that is only estimated, its distribution is integrated over, which gives that of Student.

    Returns
    -------
    array of bool, (..., m)
    """
    least = np.fmin(costs, np.inf).min(-1, keepdims=True)
    return np.asarray(costs < largest_likely(least, n_residuals, freedom, noise))


def largest_likely(least: Reals, n_residuals: int, freedom: int, noise: Noise, unlike: float = 0.0) -> Reals:
    """Return the sums of squares from which minima have a likelihood of less than `WRONG` in relation to the best one.

    Parameters
    ----------
    least : array, (...)
        The sums of squares at the best minima, or bounds above them, which give bounds above the result.
    n_residuals, freedom, noise
        As in `likely`.
    unlike : float
        Number of residuals of which both minima do not see the same noise: the sum of ``1 - r**2`` for correlations r.
        A motion with the wrong epipolar lines, for example, fits a plane as well as the true one, but another component
        of the noise of each pair.

    Returns
    -------
    array, (...)
    """
    (a, b), (c, d) = likely_bounds(n_residuals, freedom, noise, unlike)
    return np.asarray(np.maximum(a + b * least, c + d * least))


def likely_bounds(
    n_residuals: int, freedom: int, noise: Noise, unlike: float = 0.0
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return rows (a, b) of which the larger ``a + b x`` is `largest_likely` for the least sum of squares x."""
    bound = _largest_difference(float(np.ceil(unlike)))
    if isinf(noise.weight):
        return (bound * noise.variance, 1.0), (0.0, 1.0 + bound / max(freedom, 1))
    raised = float(np.expm1(bound / (noise.weight + n_residuals)))
    row = raised * noise.weight * noise.variance, 1.0 + raised
    return row, row


@lru_cache(maxsize=1000)
def _largest_difference(unlike: float) -> float:
    """Return the bound that a difference of sums of squares, in variances, exceeds with less than `WRONG`.

    Chernoff's bound for the difference of the squares of pairs of normal numbers with correlations r, whose moment
    generating function is ``(1 - 4 s**2 (1 - r**2))**(-1/2)``. For 0 it is the logarithm of the likelihood.
    """
    s = np.linspace(0.01, 0.5, 50)
    with np.errstate(divide="ignore"):
        growth = -unlike / 2 * np.log(1 - 4 * s * s) if unlike > 0 else np.zeros(len(s))
    return float(((growth - np.log(WRONG)) / s).min())


def differ(offsets: Reals, information: Reals, variance: Reals) -> NDArray[np.bool_]:
    """Return whether parameters differ by more than the bound of the first ones, which is met with `WRONG`.

    Parameters
    ----------
    offsets : array, (..., p)
        Differences of parameters.
    information : array, (..., p, p)
        Sum of products of the derivatives of the residuals at the first ones.
    variance : array, (...)
        Of the residuals.

    Returns
    -------
    array of bool, (...)
    """
    size = offsets.shape[-1]
    square = np.einsum("...i,...ij,...j->...", offsets, information, offsets)
    return np.asarray(~(square <= size * largest_ratio(size) * variance))
