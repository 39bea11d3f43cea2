"""Sandwich products and reflections as an element and its change, so that what does not change is not computed."""

from __future__ import annotations

from ..algebra.operations import Operation
from ..frontend.expression import Expression, node
from ..frontend.facts import is_unit, is_unit_even_versor, is_vector, parity


def sandwich_as_difference(expression: Expression) -> Expression | None:
    """Apply ``m x ~m = x m ~m + (m x - x m) ~m`` for even `m`, so that parts that commute with `x` are not expanded."""
    if expression.operation is not Operation.SANDWICH:
        return None
    versor, x = expression.arguments
    if parity(versor) != 0 or x in (versor, ~versor):  # For these the first term would be a sandwich again.
        return None
    rest = 2 * (node(Operation.COMMUTATOR, versor, x) * ~versor)
    if is_unit_even_versor(versor):  # It preserves grades, so other grades of the product vanish.
        rest = rest.grade(*sorted({blade.bit_count() for blade in x.blades}))
    return (x if is_unit(versor) else x * (versor * ~versor)) + rest


def sandwich_of_difference(expression: Expression) -> Expression | None:
    """Return the sandwich that `sandwich_as_difference` rewrites to `expression`, or None."""
    part = expression
    if part.operation is Operation.ADD and part.arguments[1].operation is Operation.GRADE:
        part = node(Operation.ADD, part.arguments[0], part.arguments[1].arguments[0])
    for operation, place in (
        (Operation.ADD, 1),
        (Operation.GEOMETRIC_PRODUCT, 1),
        (Operation.GEOMETRIC_PRODUCT, 0),
        (Operation.COMMUTATOR, 0),
    ):
        if part.operation != operation:
            return None
        bracket, part = part, part.arguments[place]
    sandwich = node(Operation.SANDWICH, *bracket.arguments)
    return sandwich if sandwich_as_difference(sandwich) == expression else None


def reflection_as_difference(expression: Expression) -> Expression | None:
    """Apply ``v x^ v = v**2 x - 2 v ^ (v . x) = 2 v . (v ^ x) - v**2 x`` for a vector `v` and the involution ``x^``.

    The geometric product with a vector is the sum of a contraction and an outer product, and each of these vanishes if
    it is applied twice. The form with fewer blades is used. The identity holds in every metric, for all `v` and `x`.
    """
    reflection = _reflection(expression)
    if reflection is None:
        return None
    v, x = reflection
    scaled = x if is_unit(v) else node(Operation.SCALAR_PRODUCT, v, v) * x
    lower, higher = node(Operation.LEFT_CONTRACTION, v, x), v ^ x
    if len(lower.blades) <= len(higher.blades):
        return scaled - 2 * (v ^ lower)
    return 2 * node(Operation.LEFT_CONTRACTION, v, higher) - scaled


def _reflection(expression: Expression) -> tuple[Expression, Expression] | None:
    """Return `v` and `x` for ``sandwich(v, x)`` or ``v y v``, where `x` is the grade involution of `y`, or None."""
    if expression.operation is Operation.SANDWICH and is_vector(expression.arguments[0]):
        return expression.arguments[0], expression.arguments[1]
    if expression.operation is not Operation.GEOMETRIC_PRODUCT:
        return None
    left, right = expression.arguments
    if left.operation is Operation.GEOMETRIC_PRODUCT:
        first, y, last = *left.arguments, right
    elif right.operation is Operation.GEOMETRIC_PRODUCT:
        first, y, last = left, *right.arguments
    else:
        return None
    if not is_vector(first) or last not in (first, ~first):
        return None
    return first, y if parity(y) == 0 else -y if parity(y) == 1 else node(Operation.GRADE_INVOLUTION, y)
