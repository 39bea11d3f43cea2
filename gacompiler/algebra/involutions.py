"""The three involutions, defined by the signs of grades in the table of operations."""

from __future__ import annotations

from .multivector import Multivector
from .operations import Operation


def reverse(a: Multivector) -> Multivector:
    """Reverse the order of vectors in every product: sign ``(-1)**(k (k - 1) / 2)`` of grade `k`.

    In an algebra of numbers, whose vectors are imaginary units, this is the conjugate.
    """
    return a.with_signs(a.algebra.reverse_sign)


def grade_involution(a: Multivector) -> Multivector:
    """Negate every vector: sign ``(-1)**k`` of grade `k`."""
    return _signed(Operation.GRADE_INVOLUTION, a)


def clifford_conjugate(a: Multivector) -> Multivector:
    """Apply reverse and grade involution: sign ``(-1)**(k (k + 1) / 2)`` of grade `k`."""
    return _signed(Operation.CLIFFORD_CONJUGATE, a)


def _signed(operation: Operation, a: Multivector) -> Multivector:
    assert operation.row.signs is not None
    return a.with_signs(operation.row.signs)
