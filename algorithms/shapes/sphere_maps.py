"""Smooth maps fitted to weighted pairs of points: similarities, affine maps and thin-plate splines."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from generated import cga3

from ..arguments import Reals
from ..motors.recovery import similarity_from_points
from ..precision import SINGLE, TINY

Map = Callable[[Reals], Reals]
_LEAST_WEIGHT = 1e-3
"""Pairs of less weight are left out."""
FEWEST = {"similarity": 3, "affine": 4, "nonrigid": 5}
"""Kinds of maps, and the fewest pairs for each."""


def fitted_map(kind: str, points: Reals, targets: Reals, weights: Reals, stiffness: float) -> Map | None:
    """Fit a map of a kind, or return None if too few pairs have a weight, or if they do not determine it.

    Parameters
    ----------
    kind : str
        ``similarity``, ``affine`` or ``nonrigid``.
    points, targets : array, (n, 3)
    weights : array, (n,)
    stiffness : float
        The smoothing of thin-plate splines, for a pair of weight 1.
    """
    used = weights > _LEAST_WEIGHT
    points, targets, weights = points[used], targets[used], weights[used]
    if len(points) < FEWEST[kind] or dimensions(points) < (2 if kind == "similarity" else 3):
        return None
    if kind == "similarity":
        versor = similarity_from_points(points, targets, weights).versor
        return lambda x: np.asarray(cga3.transform_point(versor, x))
    if kind == "affine":
        return _affine(points, targets, weights)
    # The thin-plate spline of space has the kernel -r and an affine part.
    spline = scipy.interpolate.RBFInterpolator(
        points, targets, kernel="linear", degree=1, smoothing=stiffness / weights
    )
    return lambda x: np.asarray(spline(x))


def dimensions(points: Reals) -> int:
    """Return of how many dimensions points (n, 3) are: 3 in space, 2 in a plane, 1 on a line."""
    extents = np.linalg.svd(points - points.mean(0), compute_uv=False)
    return int((extents > SINGLE * max(extents[0], TINY)).sum())


def _affine(points: Reals, targets: Reals, weights: Reals) -> Map:
    middle, end = weights @ points / weights.sum(), weights @ targets / weights.sum()
    root = np.sqrt(weights)[:, None]
    matrix = np.linalg.lstsq(root * (points - middle), root * (targets - end), rcond=None)[0]
    return lambda x: (x - middle) @ matrix + end


def stretch(function: Map, balls: Reals) -> Reals:
    """Return the factor by which a map changes the radius of each ball: the cube root of that of its volume."""
    return np.asarray(np.cbrt(np.abs(_volumes(function, balls))))


def reverses(function: Map, balls: Reals) -> bool:
    """Return whether a map turns most balls inside out, as reflections do, which no deformation of a body does."""
    return bool(np.median(_volumes(function, balls)) < 0)


def _volumes(function: Map, balls: Reals) -> Reals:
    """Return the factor by which a map changes the volume of each ball, negative where it reflects."""
    arms = np.maximum(balls[:, 3], 1e-6)[:, None, None] * np.eye(3)
    ends = [function((balls[:, None, :3] + sign * arms).reshape(-1, 3)).reshape(-1, 3, 3) for sign in (1, -1)]
    across = (ends[0] - ends[1]) / (2 * np.maximum(balls[:, 3], 1e-6))[:, None, None]
    return np.asarray(np.linalg.det(across))
