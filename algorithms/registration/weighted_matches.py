"""The quadratic form of the rotor of weighted matches about their means."""

from __future__ import annotations

from generated import registration as kernels

from ..arguments import Reals


def form_about_means(points: Reals, targets: Reals, weights: Reals) -> tuple[Reals, Reals, Reals]:
    """Return the forms (..., 4, 4) of `kernels.form_of_matches`, and the means (..., 3) of points and of matches.

    The eigenvector of the smallest eigenvalue of a form is the rotor of least squares.
    """
    x, y = kernels.means_of_matches(points, targets, weights)
    return kernels.form_of_matches(points, targets, weights, x, y), x, y
