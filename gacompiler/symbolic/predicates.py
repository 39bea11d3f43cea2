"""Predicates of symbolic multivectors that are proved by normal forms."""

from __future__ import annotations

from typing import Any

from ..algebra.blades import reordering_sign
from .functions import norm_squared
from .multivector import SymbolicMultivector, required
from .relations import reduce


def is_blade(a: SymbolicMultivector, *given: Any) -> bool:
    """Return whether `a` is proved to be an outer product of vectors; zero is one.

    Parameters
    ----------
    a : SymbolicMultivector
    *given
        Relations, as for `reduce`: multivectors made by `symbols`, or expressions that vanish.
    """
    lifted = reduce(required("is_blade()", a), *given)
    if len(lifted.grades) != 1 or lifted.grades == (0,):
        return not any(lifted.grades)
    # The contractions of a blade onto itself by all blades of one grade less are vectors within it.
    vectors = [without(blade, lifted) for blade in lifted.algebra.blades(lifted.grades[0] - 1)]
    return all(not reduce(vector ^ lifted, *given).terms for vector in vectors)


def without(blade: int, x: SymbolicMultivector) -> SymbolicMultivector:
    """Return the vector that remains of each basis blade of `x` without those of `blade`, which needs no metric."""
    terms = {
        other ^ blade: value if reordering_sign(blade, other ^ blade) > 0 else -value
        for other, value in x.terms.items()
        if other & blade == blade
    }
    return SymbolicMultivector(x.algebra, terms)


def is_versor(a: SymbolicMultivector, *given: Any) -> bool:
    """Return whether `a` is proved to be a versor: ``a ~a`` is a scalar other than 0, and it moves vectors to vectors.

    Parameters
    ----------
    a : SymbolicMultivector
    *given
        Relations, as for `reduce`.
    """
    lifted = reduce(required("is_versor()", a), *given)
    size = reduce(lifted * ~lifted, *given)
    if len({k & 1 for k in lifted.grades}) != 1 or set(size.terms) != {0}:
        return False
    moved = (reduce(lifted * each * ~lifted, *given) for each in lifted.algebra.basis())
    return all(set(each.grades) <= {1} for each in moved)


def is_null(a: SymbolicMultivector, *given: Any) -> bool:
    """Return whether the squared norm, the scalar part of ``a ~a``, is proved to be 0; relations as for `reduce`."""
    return not reduce(norm_squared(required("is_null()", a)), *given).terms
