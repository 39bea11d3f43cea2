"""Whether the surface of a region is an edge: where densities change more across it than on both sides of it."""

from __future__ import annotations

import numpy as np
import scipy

from ..arguments import Reals
from .images import Mask

_PLACES = np.array([-3.0, -1.0, 1.0, 3.0])
"""Distances in voxels from the surface, along its normal, of the densities that are compared: an edge is blurred over
about two voxels."""
_BY_CHANCE = 1 / 3
"""From a probability: of three changes in a row, the middle one is the largest."""
_DEEP = 2
"""Voxels from the surface of a region on that are inside of it, and no part of the surface."""


def limited_share(mask: Mask, smooth: Reals, within: Mask | None = None) -> float:
    """Return the share of a surface that is an edge beyond chance, from 0 to 1.

    Parameters
    ----------
    mask : array of bool
        The region.
    smooth : array
        The smoothed densities.
    within : array of bool, optional
        Another region, inside of which the surface is examined.

    Returns
    -------
    float
        NaN without a surface. The border of the volume is no part of it.
    """
    deep = None if within is None else scipy.ndimage.binary_erosion(within, iterations=_DEEP)
    edge = mask & ~scipy.ndimage.binary_erosion(mask, border_value=1)
    at = np.argwhere(edge if deep is None else edge & deep)
    if not len(at):
        return np.nan
    whole = mask.astype(np.float32)
    slope = [
        scipy.ndimage.gaussian_filter(whole, _DEEP, order=[int(k == axis) for k in range(mask.ndim)])[tuple(at.T)]
        for axis in range(mask.ndim)
    ]
    normal = -np.stack(slope, 1) / np.maximum(np.linalg.norm(slope, axis=0), 1e-9)[:, None]
    values = [
        scipy.ndimage.map_coordinates(smooth, (at + (0.5 + place) * normal).T, order=1, mode="nearest")
        for place in _PLACES
    ]
    inner, across, outer = np.abs(np.diff(values, axis=0))
    share = float(((across > inner) & (across > outer)).mean())
    return max(share - _BY_CHANCE, 0) / (1 - _BY_CHANCE)


def supported(other: Mask, mask: Mask, smooth: Reals) -> Mask:
    """Return what the data support of another region that competes with a region.

    Where the other one ends within the region without an edge, it was cut, and the region continues. Where the region
    has edges within the other one, this has leaked through them.
    """
    found = other
    if not limited_share(other, smooth, mask) > 0.5:
        found = found | mask
    if limited_share(mask, smooth, other) > 0.5:
        found = found & mask
    return found
