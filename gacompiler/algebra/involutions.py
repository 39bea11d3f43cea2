"""The three involutions: a sign for each grade ``k`` (Dorst, Fontijne & Mann 2007, §2.9)."""

from __future__ import annotations

from .blades import reverse_sign
from .multivector import Multivector


def reverse(a: Multivector) -> Multivector:
    """Reverse the order of vectors in every product: sign ``(-1)**(k (k-1) / 2)``."""
    return a.with_signs(reverse_sign)


def grade_involution(a: Multivector) -> Multivector:
    """Negate every vector: sign ``(-1)**k``."""
    return a.with_signs(lambda k: -1 if k & 1 else 1)


def clifford_conjugate(a: Multivector) -> Multivector:
    """Reverse and grade involution together: sign ``(-1)**(k (k+1) / 2)``."""
    return a.with_signs(lambda k: -1 if (k + 1) & 2 else 1)
