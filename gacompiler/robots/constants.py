"""Constant folding in expressions: many terms of the equations for a general robot are constant or 0 for one robot."""

from __future__ import annotations

from collections.abc import Sequence

from ..algebra.operations import Operation
from ..frontend.expression import Expression, evaluate, lift, topological

_EXACT = frozenset(
    {
        *(Operation.ADD, Operation.SUBTRACT, Operation.NEGATE, Operation.DIVIDE, Operation.REVERSE, Operation.GRADE),
        *(Operation.GEOMETRIC_PRODUCT, Operation.REGRESSIVE_PRODUCT, Operation.COMMUTATOR, Operation.SANDWICH),
        *(Operation.COEFFICIENT, Operation.ASSEMBLE),
    }
)
"""Operations that map rational numbers to rational numbers."""
_VANISHING = frozenset(
    {Operation.GEOMETRIC_PRODUCT, Operation.REGRESSIVE_PRODUCT, Operation.COMMUTATOR, Operation.SANDWICH}
)
"""Operations that return 0 if one of their arguments is 0."""


def with_constants_folded(expressions: Sequence[Expression]) -> list[Expression]:
    """Evaluate operations on constants, and remove operations that do not change the values."""
    known: dict[Expression, Expression] = {}
    for each in topological(expressions):
        arguments = tuple(known[argument] for argument in each.arguments)
        same = all(a is b for a, b in zip(arguments, each.arguments, strict=True))
        known[each] = _folded(each if same else Expression(each.operation, arguments, each.data, each.algebra))
    return [known[expression] for expression in expressions]


def _folded(x: Expression) -> Expression:
    operation, arguments = x.operation, x.arguments
    values = [argument.data if argument.operation is Operation.CONSTANT else None for argument in arguments]
    zero = [value is not None and not value.terms for value in values]
    if operation in _EXACT and arguments and all(value is not None for value in values):
        return lift(evaluate([x], {})[0])
    if (operation in _VANISHING and any(zero)) or (operation is Operation.DIVIDE and zero[0]):
        return lift(0)
    if operation is Operation.COEFFICIENT:
        return _coefficient(x)
    if operation is Operation.COS and zero[0]:
        return lift(1)
    if operation is Operation.SIN and zero[0]:
        return lift(0)
    if operation is Operation.ADD and any(zero):
        return arguments[1] if zero[0] else arguments[0]
    if operation is Operation.SUBTRACT and any(zero):
        return -arguments[1] if zero[0] else arguments[0]
    if operation is Operation.GEOMETRIC_PRODUCT:
        for value, other in ((values[0], arguments[1]), (values[1], arguments[0])):
            if value is not None and dict(value.terms) == {0: 1}:
                return other
    return x


def _coefficient(x: Expression) -> Expression:
    """Replace a coefficient of an assembled multivector by the scalar from which it was assembled."""
    (sign, blade), (multivector,) = x.data, x.arguments
    if blade not in multivector.blades:
        return lift(0)
    if multivector.operation is Operation.ASSEMBLE:
        for (own, place), value in zip(multivector.data, multivector.arguments, strict=True):
            if place == blade:
                return value if own == sign else -value
    return x
