"""Smooth maps fitted to weighted pairs of points: similarities, affine maps and thin-plate splines."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from generated import cga3

from ..arguments import Reals
from ..motors.recovery import similarity_from_points

Map = Callable[[Reals], Reals]
_LEAST_WEIGHT = 1e-3
"""Pairs of less weight are left out."""


def fitted_map(kind: str, points: Reals, targets: Reals, weights: Reals, stiffness: float) -> Map:
    """Fit a map of a kind, which must have enough pairs of weight.

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


def _affine(points: Reals, targets: Reals, weights: Reals) -> Map:
    middle, end = weights @ points / weights.sum(), weights @ targets / weights.sum()
    root = np.sqrt(weights)[:, None]
    matrix = np.linalg.lstsq(root * (points - middle), root * (targets - end), rcond=None)[0]
    return lambda x: (x - middle) @ matrix + end


def stretch(function: Map, balls: Reals) -> Reals:
    """Return the factor by which a map changes the radius of each ball: the cube root of that of its volume."""
    arms = np.maximum(balls[:, 3], 1e-6)[:, None, None] * np.eye(3)
    ends = [function((balls[:, None, :3] + sign * arms).reshape(-1, 3)).reshape(-1, 3, 3) for sign in (1, -1)]
    across = (ends[0] - ends[1]) / (2 * np.maximum(balls[:, 3], 1e-6))[:, None, None]
    return np.asarray(np.cbrt(np.abs(np.linalg.det(across))))
