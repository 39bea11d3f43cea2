"""Complements (metric-free duals), the metric polarity, and the regressive product."""

from __future__ import annotations

from ..errors import AlgebraError
from .blades import reordering_sign
from .coefficients import divide
from .multivector import Multivector


def dual(a: Multivector) -> Multivector:
    """Return the right complement: ``b ^ dual(b) = I`` for every basis blade. It does not depend on the metric."""
    return a.complement(reordering_sign)


def undual(a: Multivector) -> Multivector:
    """Return the left complement, the inverse of `dual`: ``undual(b) ^ b = I`` for every basis blade."""
    return a.complement(lambda blade, other: reordering_sign(other, blade))


def polarity(a: Multivector) -> Multivector:
    """Return the metric dual ``a I**-1``.

    Raises
    ------
    AlgebraError
        If the metric is degenerate, so that the pseudoscalar has no inverse.
    """
    pseudoscalar = a.algebra.pseudoscalar
    square = (pseudoscalar * pseudoscalar).scalar
    if square == 0:
        raise AlgebraError(
            f"polarity in {a.algebra.name}",
            "the metric is degenerate and I has no inverse",
            remedy="use dual(), which needs no metric",
        )
    return a * pseudoscalar.map(lambda value: divide(value, square))


def regressive_product(a: Multivector, b: Multivector) -> Multivector:
    """Return the regressive product ``undual(dual(a) ^ dual(b))``, which does not depend on the metric.

    It is the meet in algebras where points are vectors, and the join in algebras where points are pseudovectors.
    """
    return Multivector.__and__(a, b)
