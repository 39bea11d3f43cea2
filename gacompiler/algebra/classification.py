"""What an element is: zero, a blade, a versor, or neither."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ..errors import AlgebraError
from .coefficients import Coefficient
from .factorization import TOLERANCE, factorize_versor, significant, spanning_vectors
from .involutions import reverse
from .multivector import Multivector


class Kind(Enum):
    """The kinds of elements, each a special case of those after it, except that a null blade is no versor."""

    ZERO = "zero"
    BLADE = "blade"
    VERSOR = "versor"
    GENERAL = "general"


@dataclass(frozen=True, slots=True)
class Classification:
    """What `classify` finds.

    Attributes
    ----------
    kind : Kind
        The first that fits: `BLADE` for a number, a vector, a null blade and every other outer product of vectors;
        `VERSOR` for a product of vectors that have inverses, when it is no blade.
    grades : tuple of int
        That occur, ascending.
    grade : int or None
        Of a blade.
    is_even, is_odd : bool
        Whether all grades are; zero is both.
    is_versor : bool
        Whether it is a product of vectors that have inverses: also true of blades that are not null.
    is_null : bool
        Whether ``a ~a`` has no scalar part.
    norm_squared : coefficient
        The scalar part of ``a ~a``.
    """

    kind: Kind
    grades: tuple[int, ...]
    grade: int | None
    is_even: bool
    is_odd: bool
    is_versor: bool
    is_null: bool
    norm_squared: Coefficient


def classify(a: Multivector, tolerance: float = TOLERANCE) -> Classification:
    """Whether `a` is zero, a blade, a versor or neither, proved by its factors.

    Parameters
    ----------
    a : Multivector
        Over the rationals, the reals or the complex numbers, in any metric.
    tolerance : float
        What counts as zero, of the largest coefficient, where coefficients are not exact.
    """
    a = significant(a, tolerance)
    size = sum(abs(value) ** 2 for value in a.terms.values())
    square = significant((a * reverse(a)).grade(0), tolerance, like=a.lift(size))
    is_blade, is_versor = _succeeds(spanning_vectors, a, tolerance), _succeeds(factorize_versor, a, tolerance)
    kind = Kind.ZERO if not a.terms else Kind.BLADE if is_blade else Kind.VERSOR if is_versor else Kind.GENERAL
    return Classification(
        kind=kind,
        grades=a.grades,
        grade=a.grades[0] if is_blade else None,
        is_even=all(not k & 1 for k in a.grades),
        is_odd=all(k & 1 for k in a.grades),
        is_versor=is_versor,
        is_null=not square.terms,
        norm_squared=square.scalar,
    )


def _succeeds(function, a: Multivector, tolerance: float) -> bool:  # type: ignore[no-untyped-def]
    try:
        function(a, tolerance)
    except AlgebraError:
        return False
    return True
