"""Competing minima: which of them the data cannot reject, and which of them are the same."""

from __future__ import annotations

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
    found = np.where(np.isfinite(costs), costs, np.inf)
    least = found.min(-1, keepdims=True)
    return np.asarray(found < largest_likely(least, n_residuals, freedom, noise)) & np.isfinite(found)


def largest_likely(least: Reals, n_residuals: int, freedom: int, noise: Noise) -> Reals:
    """Return the sums of squares from which minima have a likelihood of less than `WRONG` in relation to the best one.

    Parameters
    ----------
    least : array, (...)
        The sums of squares at the best minima, or bounds above them, which give bounds above the result.
    n_residuals, freedom, noise
        As in `likely`.

    Returns
    -------
    array, (...)
    """
    if np.isinf(noise.weight):
        return np.asarray(least - 2 * noise.raised(least, freedom) * np.log(WRONG))
    known = noise.weight * noise.variance
    return np.asarray(least + (known + least) * np.expm1(-2 / (noise.weight + n_residuals) * np.log(WRONG)))


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
