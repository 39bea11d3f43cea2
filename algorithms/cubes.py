"""Points in the cubes of a grid."""

from __future__ import annotations

import numpy as np

from .arguments import Reals

_BITS, _MIDDLE = 21, 1 << 20
"""Bits of the number of a cube along an axis, and that of the cube at the origin."""


def cube_keys(points: Reals, size: float) -> Reals:
    """Return numbers (n,) that are the same for points in the same cube of a size."""
    x, y, z = (np.floor(points / size).astype(np.int64) + _MIDDLE).T
    return np.asarray((x << 2 * _BITS) | (y << _BITS) | z)


def thinned(points: Reals, size: float) -> Reals:
    """Return the first point in each cube of a size."""
    return np.asarray(points[np.sort(np.unique(cube_keys(points, size), return_index=True)[1])])
