"""The fundamental matrix from seven, or from eight or more correspondences."""

from __future__ import annotations

import numpy as np

from generated import linear_views, robust_views

from ..arguments import Reals
from ..precision import CONVERGED

_STEPS = 30.0
"""A limit on work: the number of steps of a descent."""


def eight_points(first: Reals, second: Reals) -> Reals:
    """Return F of point sets (..., n, 2) by the normalised eight-point algorithm, with rank 2 and norm 1 (Hartley)."""
    return np.asarray(linear_views.fundamental_of_pixels(first, second))


def seven_points(first: Reals, second: Reals) -> Reals:
    """Return the one or three F (..., 3, 3, 3) of seven points (..., 7, 2); missing ones are NaN."""
    models, number = robust_views.fundamentals_of_seven(first, second)
    return np.where((np.arange(3) < np.asarray(number)[..., None])[..., None, None], models, np.nan)


def refined(matrix: Reals, first: Reals, second: Reals) -> Reals:
    """Return the F of rank 2 with the least sum of squared Sampson distances near a given one."""
    return np.asarray(robust_views.descend_fundamental(matrix, first, second, np.inf, _STEPS, CONVERGED)[0])
