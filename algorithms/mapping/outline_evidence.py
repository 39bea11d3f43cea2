"""Whether points of an outline are on a line, and whether their distances from an object follow a shape."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals
from ..evidence import Noise, likely
from ..evidence.misfit import has_shape, in_sequence

_WAVES = 6, 12
"""Limits on work: the half waves along an outline that distances may not have. Squares around a circle have eight."""


def follows_shape(points: Reals, rests: Reals, used: Reals, sigma: float) -> bool:
    """Return whether distances of points in sequence follow a shape, with those that continue the ones that are used.

    What is left out continues the shape beside it; other things are apart from it.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    apart = steps > max(6 * sigma, float(steps[used[1:] & used[:-1]].max(initial=0.0)))
    part = np.concatenate([[0], np.cumsum(apart)])
    near = np.bincount(part, used)[part] > 0
    return has_shape(np.clip(rests[near], -3, 3), in_sequence(int(near.sum())), _WAVES)


def scatter(points: Reals) -> Reals:
    """Return the least and the largest sum of squared distances of points from lines through their centroid."""
    x, y = (points - points.mean(0)).T
    middle, half = (x @ x + y @ y) / 2, np.hypot((x @ x - y @ y) / 2, x @ y)
    return np.array([max(middle - half, 0.0), middle + half])


def is_straight(points: Reals, off: Reals, sigma: float) -> bool:
    """Return whether a line is likely in relation to a circle with the distances `off` from points."""
    least = scatter(points)[0]
    return bool(likely(np.array([off @ off, least]), len(off), len(off) - 3, Noise(sigma**2))[1])


def is_bent(points: Reals, sigma: float) -> bool:
    """Return whether points are farther from every line than their noise explains."""
    least = scatter(points)[0]
    return bool(Noise(sigma**2).contradicted(least, len(points) - 2))
