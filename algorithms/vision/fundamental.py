"""The fundamental matrix from seven, or from eight or more correspondences."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from generated import linear_views, matrices, robust_views

from ..arguments import Reals
from .normalization import normalized, undone
from .robust import ALL

_STEPS = 30
"""A limit on work: the number of steps of a descent."""


def eight_points(first: Reals, second: Reals) -> Reals:
    """Return F of point sets (..., n, 2) by the normalised eight-point algorithm, with rank 2 and norm 1 (Hartley)."""
    equations, left, right = linear_views.epipolar_equations(first, second)
    entries, _, _ = matrices.null_vector(equations)
    return np.asarray(linear_views.fundamental_of_entries(entries, left, right))


def seven_points(first: Reals, second: Reals) -> Reals:
    """Return the one or three F (..., 3, 3, 3) of seven points (..., 7, 2); missing ones are NaN."""
    (one, left), (two, right) = normalized(first), normalized(second)
    return of_seven(one, two, left, right)


def of_seven(one: Reals, two: Reals, left: Reals, right: Reals) -> Reals:
    """Return the F (..., 3, 3, 3) of seven normalised points (..., 7, 2), for pixels before the similarities."""
    models, number = robust_views.fundamentals_of_seven(one, two)
    models = np.where((np.arange(3) < np.asarray(number)[..., None])[..., None, None], models, np.nan)
    return _unit(np.swapaxes(right, -1, -2)[..., None, :, :] @ models @ left[..., None, :, :])


def refined(matrix: Reals, first: Reals, second: Reals) -> Reals:
    """Return the F of rank 2 with the least sum of squared Sampson distances near a given one."""
    return Pixels.of(first, second).descended(matrix, np.inf, _STEPS)


class Pixels(NamedTuple):
    """Pixels of two images and their similarities, with one scale, so that distances keep their meaning."""

    one: Reals
    two: Reals
    left: Reals
    right: Reals
    size: float

    @classmethod
    def of(cls, first: Reals, second: Reals) -> Pixels:
        """Return the normalised pixels (n, 2) of both images."""
        size = float(np.sqrt((np.var(first, 0).sum() + np.var(second, 0).sum()) / 4)) or 1.0
        scale = np.asarray(1 / size)
        (one, left), (two, right) = normalized(first, scale), normalized(second, scale)
        return cls(one, two, left, right, size)

    def descended(self, matrix: Reals, threshold: float, at_most: int) -> Reals:
        """Return the F near another with the least squares of distances, each at most that of a threshold in pixels."""
        limit = min((threshold / self.size) ** 2, ALL)
        start = undone(self.right).T @ matrix @ undone(self.left)
        found, _ = robust_views.descend_fundamental(start, self.one, self.two, limit, float(at_most))
        return _unit(self.right.T @ found @ self.left)


def _unit(matrix: Reals) -> Reals:
    return np.asarray(matrix / np.linalg.norm(matrix, axis=(-1, -2), keepdims=True))
