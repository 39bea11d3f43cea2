"""Association of chains of products, in the order that requires the fewest products of pairs of blades."""

from __future__ import annotations

from collections.abc import Sequence

from ..algebra.operations import Operation
from ..frontend.expression import Expression, node

_ASSOCIATIVE = (Operation.GEOMETRIC_PRODUCT, Operation.OUTER_PRODUCT, Operation.REGRESSIVE_PRODUCT)
LONGEST = 12
"""Chains with more factors are not changed."""


def associate(expression: Expression) -> Expression | None:
    """Return the cheapest association of a chain of three or more factors, or None if the given one is as cheap."""
    if expression.operation not in _ASSOCIATIVE:
        return None
    factors, given = _chain(expression)
    if not 3 <= len(factors) <= LONGEST or all(factor.is_scalar for factor in factors):
        return None
    best, cost = _cheapest(expression.operation, factors)
    return best if cost < given else None


def _chain(expression: Expression) -> tuple[list[Expression], int]:
    """Return the factors of a chain in order, up to the maximum number, and the cost of its given association."""
    operation, cost = expression.operation, 0
    factors: list[Expression] = []
    stack = [expression]
    while stack and len(factors) <= LONGEST and len(stack) <= LONGEST:
        each = stack.pop()
        if each.operation == operation:
            left, right = each.arguments
            cost += _pairs(operation, left, right)
            stack += [right, left]
        else:
            factors.append(each)
    return factors + stack, cost


def _cheapest(operation: Operation, factors: Sequence[Expression]) -> tuple[Expression, int]:
    """Find the cheapest association by dynamic programming over subchains; the last split wins in case of a tie."""
    best = {(k, k + 1): (factor, 0) for k, factor in enumerate(factors)}
    for length in range(2, len(factors) + 1):
        for first in range(len(factors) - length + 1):
            last = first + length
            choices = []
            for middle in range(last - 1, first, -1):
                (a, x), (b, y) = best[first, middle], best[middle, last]
                choices.append((node(operation, a, b), x + y + _pairs(operation, a, b)))
            best[first, last] = min(choices, key=lambda choice: choice[1])
    return best[0, len(factors)]


def _pairs(operation: Operation, a: Expression, b: Expression) -> int:
    """Return the number of pairs of blades with a nonzero product.

    The regressive product is treated as the outer product of complements.
    """
    algebra = a.algebra if a.algebra.dimension >= b.algebra.dimension else b.algebra
    if operation is Operation.GEOMETRIC_PRODUCT:
        return sum(bool(algebra.blade_product(x, y)) for x in a.blades for y in b.blades)
    full = algebra.everything
    if operation is Operation.OUTER_PRODUCT:
        return sum(not x & y for x in a.blades for y in b.blades)
    return sum(x | y == full for x in a.blades for y in b.blades)
