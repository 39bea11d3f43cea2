"""Lines, circles, planes and spheres of conformal space with the least sum of squared distances from points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..arguments import Reals
from ..precision import CONVERGED, NEGLIGIBLE

_STEPS = 40
"""A limit on work: the number of steps of a fit."""


def fit_round(
    step: Callable[..., Any], points: Reals, spreads: Reals, start: Reals, curved: bool
) -> tuple[Reals, bool]:
    """Return the unit vector after Gauss-Newton steps, and whether they converged.

    Parameters
    ----------
    step : callable
        `circle_step` or `sphere_step` of `generated.navigation`.
    points, spreads : array
        Points and upper triangles of their covariances.
    start : array
        The first unit vector.
    curved : bool
        False for lines and planes.
    """
    vector = start
    for _ in range(_STEPS):
        vector, cost, less = step(points, spreads, vector, float(curved), NEGLIGIBLE)
        if abs(float(less)) <= CONVERGED * (float(cost) + 1):
            return vector, True
    return vector, False
