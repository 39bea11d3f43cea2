"""Classification of an element as zero, a blade, a versor, or neither."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ..errors import AlgebraError
from .coefficients import Coefficient
from .factorization import TOLERANCE, factorize_versor, significant, spanning_vectors
from .involutions import reverse
from .multivector import Multivector


class Kind(Enum):
    """The kinds of elements. Each is a special case of the following ones, except that a null blade is not a versor."""

    ZERO = "zero"
    BLADE = "blade"
    VERSOR = "versor"
    GENERAL = "general"


@dataclass(frozen=True, slots=True)
class Classification:
    """The result of `classify`.

    Attributes
    ----------
    kind : Kind
        The first kind that applies: `BLADE` for a number, a vector, a null blade and every other outer product of
        vectors; `VERSOR` for a product of invertible vectors that is not a blade.
    grades : tuple of int
        The grades that occur, ascending.
    grade : int or None
        The grade of a blade; None for other elements.
    is_even, is_odd : bool
        Whether all grades are even, or odd; zero is both.
    is_versor : bool
        Whether the element is a product of invertible vectors. Also true for blades that are not null.
    is_null : bool
        Whether the scalar part of ``a ~a`` is zero.
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
    """Determine whether `a` is zero, a blade, a versor or neither, by factorizing it.

    Parameters
    ----------
    a : Multivector
        An element over the rationals, the reals or the complex numbers, in any metric.
    tolerance : float
        Coefficients below this fraction of the largest coefficient count as zero, if coefficients are not exact.

    Returns
    -------
    Classification
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
