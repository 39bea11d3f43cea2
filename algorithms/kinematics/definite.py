"""Equations with mass matrices, which are positive definite unless something moves that has no inertia."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from .constants import Floats

_NO_INERTIA = 2.0**-44
"""The part of an inertia's terms that may be left by rounding, as in the kernel `forward_dynamics`."""


def solved(matrices: Floats, right: Floats, largest: Floats) -> Floats:
    """``matrix⁻¹ right``; NaN for matrices that are not positive definite.

    Parameters
    ----------
    matrices : array, (..., n, n)
    right : array, (..., n, k)
    largest : array, (n,)
        The most inertia that each variable can feel: where no more than the rounding of this is left, nothing is felt.

    Returns
    -------
    array, (..., n, k)
    """
    least = _NO_INERTIA * largest
    if matrices.ndim == 2:
        return _solution(matrices, right, least)
    if _are_definite(matrices, least):
        return np.asarray(np.linalg.solve(matrices, right), float)
    wrong = np.array([not _are_definite(matrix, least) for matrix in matrices.reshape(-1, *matrices.shape[-2:])])
    wrong = wrong.reshape(*matrices.shape[:-2], 1, 1)
    found = np.linalg.solve(np.where(wrong, np.eye(matrices.shape[-1]), matrices), right)
    return np.where(wrong, np.nan, found)


def _solution(matrix: Floats, right: Floats, least: Floats) -> Floats:
    """As `solved`, of one matrix, in a third of the time."""
    root, failed = dpotrf(matrix, lower=1)
    if failed or not (np.square(root.diagonal()) > least).all():
        return np.full(right.shape, np.nan)
    found: Floats = dpotrs(root, right, lower=1)[0]
    return found


def _are_definite(matrices: Floats, least: Floats) -> bool:
    try:
        roots = np.linalg.cholesky(matrices)
    except np.linalg.LinAlgError:
        return False
    return bool((np.square(np.diagonal(roots, axis1=-2, axis2=-1)) > least).all())
