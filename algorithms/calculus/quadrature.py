"""Quadrature on simplices of any dimension, exact for polynomials up to a degree."""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy
from numpy.typing import NDArray

Floats = NDArray[np.float64]
MOST_POINTS = 1 << 16
"""Maximum number of points of a rule."""


@cache
def simplex_rule(dimension: int, degree: int) -> tuple[Floats, Floats]:
    """Return points and positive weights on a simplex: Stroud's conical product of Gauss-Jacobi rules.

    Parameters
    ----------
    dimension : int
        0 for a point, 1 for a segment, and so on.
    degree : int
        Degree of the polynomials that are integrated exactly.

    Returns
    -------
    points : array, (Q, dimension + 1)
        Barycentric coordinates; Q is ``(degree // 2 + 1)**dimension``.
    weights : array, (Q,)
        Weights of sum 1.

    Raises
    ------
    ValueError
        If a number is negative, or if the rule would have more than 65 536 points.
    """
    for name, number in (("dimension", dimension), ("degree", degree)):
        if isinstance(number, bool) or not isinstance(number, (int, np.integer)) or number < 0:
            raise ValueError(f"{name}: {number!r}; expected a whole number, 0 or more")
    count = degree // 2 + 1
    if count**dimension > MOST_POINTS:
        raise ValueError(
            f"degree: {degree} in {dimension} dimensions takes {count**dimension} points; at most {MOST_POINTS}"
        )
    points, weights, left = np.zeros((1, 0)), np.ones(1), np.ones(1)
    for k in range(dimension):
        nodes, part = scipy.special.roots_jacobi(count, dimension - 1 - k, 0)
        t = (1 + nodes) / 2
        points = np.concatenate([np.repeat(points, count, 0), np.outer(left, t).reshape(-1, 1)], 1)
        weights = np.outer(weights, part / part.sum()).ravel()
        left = np.outer(left, 1 - t).ravel()
    points = np.concatenate([left[:, None], points], 1)
    for array in (points, weights):
        array.setflags(write=False)
    return points, weights
