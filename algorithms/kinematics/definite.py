"""Linear systems with mass matrices, which are positive definite unless a joint moves no inertia."""

from __future__ import annotations

import numpy as np
import scipy

from .constants import Floats

NO_INERTIA = 2.0**-44
"""Relative rounding error of a sum of inertias, as in the kernel `forward_dynamics`. Smaller sums count as zero."""


def solved(matrices: Floats, right: Floats, largest: Floats) -> Floats:
    """Return ``matrix⁻¹ right``; NaN for matrices that are not positive definite.

    Parameters
    ----------
    matrices : array, (..., n, n)
    right : array, (..., n, k)
    largest : array, (n,)
        The largest possible inertia at each variable. A pivot below its rounding error counts as zero.

    Returns
    -------
    array, (..., n, k)
    """
    least = NO_INERTIA * largest
    if matrices.ndim == 2:
        return _solution(matrices, right, least)
    if _are_definite(matrices, least):
        return np.asarray(np.linalg.solve(matrices, right), float)
    wrong = np.array([not _are_definite(matrix, least) for matrix in matrices.reshape(-1, *matrices.shape[-2:])])
    wrong = wrong.reshape(*matrices.shape[:-2], 1, 1)
    found = np.linalg.solve(np.where(wrong, np.eye(matrices.shape[-1]), matrices), right)
    return np.where(wrong, np.nan, found)


def _solution(matrix: Floats, right: Floats, least: Floats) -> Floats:
    """Return the same as `solved` for a single matrix, in a third of the time."""
    root, failed = scipy.linalg.lapack.dpotrf(matrix, lower=1)
    if failed or not (np.square(root.diagonal()) > least).all():
        return np.full(right.shape, np.nan)
    found: Floats = scipy.linalg.lapack.dpotrs(root, right, lower=1)[0]
    return found


def _are_definite(matrices: Floats, least: Floats) -> bool:
    try:
        roots = np.linalg.cholesky(matrices)
    except np.linalg.LinAlgError:
        return False
    return bool((np.square(np.diagonal(roots, axis1=-2, axis2=-1)) > least).all())
