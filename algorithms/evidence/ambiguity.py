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
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        if np.isinf(noise.weight):
            variance = noise.raised(least, freedom)
            logarithm = (least - found) / (2 * variance)
        else:
            known = noise.weight * noise.variance
            logarithm = (noise.weight + n_residuals) / 2 * (np.log(known + least) - np.log(known + found))
    return np.asarray(logarithm > np.log(WRONG)) & np.isfinite(found)


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
