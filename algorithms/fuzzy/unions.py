"""Unions of fuzzy sets as sorted places and points, between which they are linear."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals


def sorted_unions(
    cuts: Reals, points: Reals, coordinates: Reals, heights: Reals, flanks: Reals, scaled: bool
) -> tuple[Reals, Reals]:
    """Evaluate unions at the places of a grid, and at the points where sets cross their strengths.

    Parameters
    ----------
    cuts : array, (n, sets)
    points : array, (n, 2 sets)
    coordinates : array, (m,)
        The places.
    heights : array, (m, sets)
    flanks : array, (2 sets, 4)
        As in `Ramps`.
    scaled : bool
        Whether sets are multiplied by their strengths, and not clipped.

    Returns
    -------
    x, top : array, (n, m + 2 sets)
        Ascending, and the memberships.
    """
    n, size = len(cuts), len(coordinates)
    x, top = np.empty((2, n, size + points.shape[1]))
    x[:, :size] = coordinates
    x[:, size:] = points
    cell = (np.searchsorted(coordinates, points, "right") - 1).clip(0, size - 2)
    share = (points - coordinates[cell]) / np.diff(coordinates)[cell]
    top[:] = 0
    for cut, height in zip(cuts.T[:, :, None], heights.T, strict=True):
        between = height[cell] + (height[cell + 1] - height[cell]) * share
        for members, part in ((height, top[:, :size]), (between, top[:, size:])):
            np.maximum(part, cut * members if scaled else np.minimum(cut, members), out=part)
    if not scaled:
        # Near the foot of a flank, the membership at the point has larger rounding errors than the strength.
        low, high, base, _ = flanks.T
        both = np.tile(cuts, 2)
        exists = (points != base) & (both > low) & (both <= high)
        np.maximum(top[:, size:], both, out=top[:, size:], where=exists)
    order = x.argsort(1, kind="stable")
    return np.take_along_axis(x, order, 1), np.take_along_axis(top, order, 1)


def centroids(x: Reals, top: Reals) -> tuple[Reals, Reals]:
    """Return the areas (n,) and the first moments (n,) of sorted unions."""
    width, a, b, low, high = np.diff(x), x[:, :-1], x[:, 1:], top[:, :-1], top[:, 1:]
    moments = width * (a * (2 * low + high) + b * (low + 2 * high)) / 6
    return np.asarray((width * (low + high) / 2).sum(1)), np.asarray(moments.sum(1))


def bisectors(x: Reals, top: Reals) -> Reals:
    """Return the points (n,) that divide the areas of sorted unions into halves."""
    pieces = np.diff(x) * (top[:, :-1] + top[:, 1:]) / 2
    sums = pieces.cumsum(1)
    row = np.arange(len(x))
    at = (sums >= sums[:, -1:] / 2).argmax(1)
    a, b, low, high, whole = x[row, at], x[row, at + 1], top[row, at], top[row, at + 1], pieces[row, at]
    rest = (sums[:, -1] / 2 - sums[row, at] + whole).clip(0, whole)
    slope = (high - low) / np.where(b > a, b - a, 1)
    divisor = low + np.sqrt(np.maximum(low * low + 2 * slope * rest, 0))
    return np.asarray(a + 2 * rest / np.where(divisor > 0, divisor, 1))
