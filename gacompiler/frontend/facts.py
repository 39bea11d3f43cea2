"""What is known of an expression beyond its blades. Each fact follows from facts of the arguments."""

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
    """Whether ``x ~x = 1`` holds, every coefficient of it.

    ``(a b) ~(a b) = a (b ~b) ~a = 1``, so products of unit elements are unit, and so are the involutions, inverses and
    sandwiches of them.
    """
    match expression.operation:
        case Operation.INPUT:
            return bool(expression.data.layout.unit)
        case Operation.GEOMETRIC_PRODUCT | Operation.SANDWICH:
            return all(map(is_unit, expression.arguments))
        case operation:
            return operation in _KEEPS_UNIT and is_unit(expression.arguments[0])


def parity(expression: Expression) -> int | None:
    """0 for even blades only, 1 for odd ones only, None where both can occur."""
    parities = {blade.bit_count() & 1 for blade in expression.blades}
    return parities.pop() if len(parities) == 1 else None


def has_grade(expression: Expression, grade: int) -> bool:
    """Whether only blades of this grade can occur, and some can."""
    return {blade.bit_count() for blade in expression.blades} == {grade}


def is_vector(expression: Expression) -> bool:
    """Whether only blades of grade 1 can occur, and some can."""
    return has_grade(expression, 1)


def is_unit_even_versor(expression: Expression) -> bool:
    """Whether sandwiching with this is a linear map that keeps every product.

    That needs only ``m ~m = 1`` and evenness: ``m a ~m m b ~m = m a b ~m``. That it keeps *grades* as well is a matter
    of `m` being a versor; in up to five dimensions every even element with ``m ~m = 1`` is one (Lounesto 2001, §17).
    """
    return is_unit(expression) and parity(expression) == 0 and expression.algebra.dimension <= 5
