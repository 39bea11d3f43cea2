"""Properties of an expression in addition to its blades. Each is derived from properties of the arguments."""

from __future__ import annotations

from ..algebra.operations import Operation
from .expression import Expression

_KEEPS_UNIT = (
    Operation.REVERSE,
    Operation.GRADE_INVOLUTION,
    Operation.CLIFFORD_CONJUGATE,
    Operation.NEGATE,
    Operation.INVERSE,
)


def is_unit(expression: Expression) -> bool:
    """Return whether ``x ~x = 1`` is known to hold for all coefficients.

    Because ``(a b) ~(a b) = a (b ~b) ~a = 1``, products of unit elements are unit, and so are their involutions,
    inverses and sandwich products.
    """
    match expression.operation:
        case Operation.INPUT:
            return bool(expression.data.layout.unit)
        case Operation.GEOMETRIC_PRODUCT | Operation.SANDWICH:
            return all(map(is_unit, expression.arguments))
        case operation:
            return operation in _KEEPS_UNIT and is_unit(expression.arguments[0])


def parity(expression: Expression) -> int | None:
    """Return 0 if only even blades can occur, 1 if only odd ones can, and None if both can."""
    parities = {blade.bit_count() & 1 for blade in expression.blades}
    return parities.pop() if len(parities) == 1 else None


def has_grade(expression: Expression, grade: int) -> bool:
    """Return whether only blades of this grade can occur, and at least one can."""
    return {blade.bit_count() for blade in expression.blades} == {grade}


def is_vector(expression: Expression) -> bool:
    """Return whether only blades of grade 1 can occur, and at least one can."""
    return has_grade(expression, 1)


def is_unit_even_versor(expression: Expression) -> bool:
    """Return whether the sandwich product with this expression is known to be a linear map that preserves products.

    This requires only that `m` is even with ``m ~m = 1``: ``m a ~m m b ~m = m a b ~m``. The map also preserves *grades*
    if `m` is a versor. In up to five dimensions every even element with ``m ~m = 1`` is one (Lounesto 2001, §17).
    """
    return is_unit(expression) and parity(expression) == 0 and expression.algebra.dimension <= 5


def is_unit_vector(expression: Expression) -> bool:
    """Return whether an expression is known to be a vector with square 1.

    The sandwich product ``v x^ v`` with the grade involution ``x^`` is a reflection. It preserves grades and geometric
    products, since ``(v a^ v) (v b^ v) = v (a b)^ v``, and has determinant -1.
    """
    return is_unit(expression) and is_vector(expression)
