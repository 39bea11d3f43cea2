"""Exponentials in any algebra, and products of exponentials: the Baker-Campbell-Hausdorff series."""

from __future__ import annotations

from fractions import Fraction
from math import ceil, log2

import numpy as np
from numpy.typing import NDArray

from ..algebra.coefficients import divide, is_exact
from ..algebra.multivector import Multivector
from ..algebra.versors import commutator
from ..errors import AlgebraError
from .representation import representation

_TERMS = 18
"""Number of terms of the series, for matrices of norm 1/2: the next term is below 1e-22."""


def exponential(x: Multivector) -> Multivector:
    """Compute ``1 + x + x x / 2 + ...``.

    Parameters
    ----------
    x : Multivector
        Numbers as coefficients; in an algebra that has a `Representation`.

    Returns
    -------
    Multivector
        Exact if `x` is exact and some power of it vanishes (translators, transvections); floats otherwise, by
        scaling and squaring of matrices, with a relative error of about 1e-15 times the norm of `x`.
    """
    if all(is_exact(value) for value in x.terms.values()):
        total = term = x.lift(1)
        for k in range(1, x.algebra.dimension + 2):
            term = (term * x).map(lambda value, k=k: divide(value, k))  # type: ignore[misc]
            if not term.terms:
                return total
            total = total + term
    matrices = representation(x.algebra)
    matrix = matrices.real(matrices.matrix(x.map(float)).astype(float))
    return matrices.element(matrices.from_real(matrix_exponential(matrix)))


def matrix_exponential(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compute the exponential of a square matrix by its Taylor series, with scaling and squaring."""
    norm = float(np.abs(matrix).sum(axis=0).max(initial=0.0))
    if not np.isfinite(norm):
        raise AlgebraError("exponential", "coefficients that are not finite", "finite numbers")
    halvings = max(0, ceil(log2(norm)) + 1) if norm > 0 else 0
    scaled = matrix / 2.0**halvings
    total = np.eye(len(matrix))
    for k in range(_TERMS, 0, -1):
        total = np.eye(len(matrix)) + scaled @ total / k
    for _ in range(halvings):
        total = total @ total
    return total


def product_of_exponentials(a: Multivector, b: Multivector, order: int = 4) -> Multivector:
    """Compute ``log(exp(a) exp(b))`` up to brackets of `order` factors: a bivector if `a` and `b` are.

    Parameters
    ----------
    a, b : Multivector
        Small; omitted terms have `order` + 1 factors.
    order : {1, 2, 3, 4}

    Raises
    ------
    AlgebraError
        For another order.
    """
    if order not in (1, 2, 3, 4):
        raise AlgebraError("product_of_exponentials", f"order {order}", "1, 2, 3 or 4")
    c = 2 * commutator(a, b)
    parts = [
        a + b,
        c * Fraction(1, 2),
        (commutator(a, c) - commutator(b, c)) * Fraction(1, 6),
        -commutator(b, commutator(a, c)) * Fraction(1, 6),
    ]
    total = parts[0]
    for part in parts[1:order]:
        total = total + part
    return total
