"""Limits on work, and a tolerance from the noise, that all searches for poses of cameras share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generated import matrices

from ..arguments import Reals

STEPS = 200
"""A limit on work: the number of iterations from each start."""
SETS = 60
"""A limit on work: the number of smallest sets of items whose poses are starts, if no threshold is given."""
BEST = 12
"""A limit on work: the number of starts that are refined: the poses of a smallest set, and some more."""
ROUNDS = 10
"""A limit on work: the number of selections of inliers."""
REAL = 1e-3
"""From the noise: roots with a smaller relative imaginary part are taken to be double roots that noise has moved."""


def real_roots(coefficients: Reals, tolerance: float = REAL) -> tuple[NDArray[np.intp], Reals]:
    """Return the numbers (m,) of polynomials (b, k), without their first coefficient 1, and their real roots (m,).

    Imaginary parts are at most `tolerance` times the real ones; those of complex roots are left out.
    """
    usable: Reals = np.asarray(np.isfinite(coefficients).all(-1))
    real, imaginary, _, converged = matrices.polynomial_roots(np.where(usable[:, None], coefficients, 0))
    is_real = np.abs(imaginary) <= tolerance * np.maximum(np.abs(real), np.finfo(float).tiny)
    which, root = np.nonzero(is_real & (usable & (converged > 0))[:, None])
    return which, np.asarray(real[which, root])
