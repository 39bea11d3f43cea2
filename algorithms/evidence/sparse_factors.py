"""Factors of symmetric positive matrices, dense and sparse, and the directions that a matrix nearly leaves free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from ..arguments import Reals

_VECTORS, _ROUNDS = 8, 4
"""Limits on work: the directions, and the iterations, with which the least eigenvalues of sparse systems are found."""


@dataclass(frozen=True, slots=True, eq=False)
class Factor:
    """A factorized matrix."""

    solve: Any
    """Function from right sides (n,) or (n, r) to solutions."""


def factorized(matrix: Any, *, ordered: bool = False) -> Factor | None:
    """Return the factors of a symmetric positive matrix, or None if it is not positive or not finite.

    Parameters
    ----------
    matrix : array or sparse array in the format csc, (n, n)
        Dense matrices are factorized by LAPACK's Cholesky, sparse ones by SuperLU with diagonal pivots, whose upper
        factor is then the lower one times the squared diagonal of Cholesky's.
    ordered : bool
        Whether rows of sparse matrices are in the order of elimination, and pivots, which need memory, are not tested:
        the matrix is a sum of squares.
    """
    if isinstance(matrix, np.ndarray):
        if not np.isfinite(matrix).all():
            return None
        try:
            factor = scipy.linalg.cho_factor(matrix, lower=False, check_finite=False)
        except scipy.linalg.LinAlgError:
            return None
        return Factor(lambda b: scipy.linalg.cho_solve(factor, b, check_finite=False))
    if not np.isfinite(matrix.data).all():
        return None
    order = "NATURAL" if ordered else "MMD_AT_PLUS_A"
    try:
        lu = scipy.sparse.linalg.splu(matrix, permc_spec=order, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:
        return None
    return Factor(lu.solve) if ordered or (lu.U.diagonal() > 0).all() else None


def factorized_band(band: Reals) -> Factor | None:
    """Return Cholesky's factors of a symmetric matrix, or None if it is not positive or not finite.

    Parameters
    ----------
    band : array, (w + 1, n), in Fortran order
        The diagonal and the w diagonals below it. The array is used for the factors.
    """
    if not np.isfinite(band).all():
        return None
    try:
        factor = scipy.linalg.cholesky_banded(band, overwrite_ab=True, lower=True, check_finite=False)
    except scipy.linalg.LinAlgError:
        return None
    return Factor(lambda b: scipy.linalg.cho_solve_banded((factor, True), b, check_finite=False))


def least_directions(matrix: Any, scale: Reals, rounding: float) -> tuple[Reals, Reals]:
    """Return the least eigenvalues (r,) and eigenvectors (n, r) of a scaled sparse matrix, by iteration of subspaces.

    Parameters
    ----------
    matrix : sparse array, (n, n)
    scale : array, (n,)
        Factors of rows and columns, after which the diagonal is 1.
    rounding : float
        How precise eigenvalues of the scaled matrix are, which is added to the diagonal.
    """
    n = len(scale)
    scaled = (scipy.sparse.diags_array(scale) @ matrix @ scipy.sparse.diags_array(scale)).tocsc()
    unit = scipy.sparse.eye_array(n, format="csc")
    # Where rounding errors are larger than that, more is added.
    factor = factorized((scaled + rounding * unit).tocsc()) or factorized((scaled + 100 * rounding * unit).tocsc())
    if factor is None:
        return np.zeros(1), np.full((n, 1), n**-0.5)
    basis = np.linalg.qr(np.random.default_rng(0).normal(size=(n, min(_VECTORS, n))))[0]
    for _ in range(_ROUNDS):
        basis = np.linalg.qr(factor.solve(basis))[0]
    values, vectors = np.linalg.eigh(basis.T @ (scaled @ basis))
    return values, np.asarray(basis @ vectors)
