"""The table of rules for saturation (`gacompiler.passes.saturate`).

Every rule is exact. A rule that needs a relation such as ``m ~m = 1`` takes it from what is known about an expression
(`gacompiler.frontend.facts`): the declared layouts of inputs, and operations that preserve the relation.
"""

from __future__ import annotations

from collections.abc import Callable

from ..algebra.operations import Operation
from ..frontend.expression import Expression, lift, node
from ..frontend.facts import is_unit, is_unit_even_versor, is_unit_vector, parity
from .expand import (
    expand_commutator,
    expand_contraction,
    expand_duals,
    expand_meet,
    expand_mixed_meet,
    expand_norm,
    expand_product_of_vectors,
    expand_scalar_part,
    expand_square,
    expand_square_of_product,
    expand_square_of_sum,
)
from .parts_of_products import expand_reflections, name_determinant, nest_contractions, split_product_of_vectors
from .rewrite import (
    divide_by_reversing,
    drop_versor,
    join_sandwich,
    pull_out_versor,
    recognise_sandwich,
    split_conjugation,
    split_sandwich,
)

Rule = Callable[[Expression], Expression | None]

_ASSOCIATIVE = (Operation.GEOMETRIC_PRODUCT, Operation.OUTER_PRODUCT, Operation.REGRESSIVE_PRODUCT)
LONGEST_SUM = 16
"""Sums of more terms are not treated as blends."""


def associate_left(expression: Expression) -> Expression | None:
    """Replace ``a (b c)`` by ``(a b) c``."""
    operation = expression.operation
    if operation not in _ASSOCIATIVE or expression.arguments[1].operation != operation:
        return None
    a, (b, c) = expression.arguments[0], expression.arguments[1].arguments
    return node(operation, node(operation, a, b), c)


def associate_right(expression: Expression) -> Expression | None:
    """Replace ``(a b) c`` by ``a (b c)``."""
    operation = expression.operation
    if operation not in _ASSOCIATIVE or expression.arguments[0].operation != operation:
        return None
    (a, b), c = expression.arguments[0].arguments, expression.arguments[1]
    return node(operation, a, node(operation, b, c))


def reverse_factors(expression: Expression) -> Expression | None:
    """Replace ``~(a b)`` by ``~b ~a``, and ``~~a`` by `a`."""
    if expression.operation is not Operation.REVERSE:
        return None
    (inner,) = expression.arguments
    if inner.operation is Operation.REVERSE:
        return inner.arguments[0]
    if inner.operation is Operation.GEOMETRIC_PRODUCT:
        a, b = inner.arguments
        return ~b * ~a
    return None


def cancel_unit(expression: Expression) -> Expression | None:
    """Replace ``~m m`` and ``m ~m`` by 1, and ``1 x``, ``x 1`` and ``sandwich(1, x)`` by `x`."""
    if expression.operation not in (Operation.GEOMETRIC_PRODUCT, Operation.SANDWICH):
        return None
    a, b = expression.arguments
    if a == _ONE:
        return b
    if expression.operation is Operation.SANDWICH:
        return None
    if b == _ONE:
        return a
    return _ONE if is_unit(a) and (a == ~b or b == ~a) else None


def move_back(expression: Expression) -> Expression | None:
    """Replace ``sandwich(~m, sandwich(m, x))`` and ``sandwich(m, sandwich(~m, x))`` by `x` for a unit even `m`."""
    if expression.operation is not Operation.SANDWICH or expression.arguments[1].operation is not Operation.SANDWICH:
        return None
    a, (b, x) = expression.arguments[0], expression.arguments[1].arguments
    return x if is_unit(a) and parity(a) == 0 and (a == ~b or b == ~a) else None


def pull_out_scalar(expression: Expression) -> Expression | None:
    """Replace ``sandwich(m, s x)`` by ``s sandwich(m, x)`` and `s` ``sandwich(m, x)`` by ``sandwich(m, s x)``."""
    if expression.operation is Operation.SANDWICH:
        versor, x = expression.arguments
        split = _scaled(x)
        return None if split is None else split[0] * node(Operation.SANDWICH, versor, split[1])
    split = _scaled(expression)
    if split is None or split[1].operation is not Operation.SANDWICH:
        return None
    versor, x = split[1].arguments
    return node(Operation.SANDWICH, versor, split[0] * x)


def dual_of_sandwich(expression: Expression) -> Expression | None:
    """Move a versor out of a dual, in an algebra where the dual is a product with the pseudoscalar.

    Even elements commute with the pseudoscalar. The polarity is such a product in every metric in which it is defined;
    the dual, up to a sign that depends on the grade only, in Euclidean metrics.
    """
    if expression.operation not in _DUALS or expression.arguments[0].operation is not Operation.SANDWICH:
        return None
    versor, x = expression.arguments[0].arguments
    gram = expression.algebra.gram
    euclidean = all(value == (i == j) for i, row in enumerate(gram) for j, value in enumerate(row))
    if not is_unit_even_versor(versor) or not (euclidean or expression.operation is Operation.POLARITY):
        return None
    return node(Operation.SANDWICH, versor, Expression(expression.operation, (x,), expression.data, x.algebra))


def norm_of_sandwich(expression: Expression) -> Expression | None:
    """Replace the norm of ``sandwich(m, x)`` by that of `x`."""
    if expression.operation is not Operation.NORM or expression.arguments[0].operation is not Operation.SANDWICH:
        return None
    versor, x = expression.arguments[0].arguments
    return node(Operation.NORM, x) if is_unit_even_versor(versor) or is_unit_vector(versor) else None


def halve_power(expression: Expression) -> Expression | None:
    """Write a product of four or more equal factors as the product of two powers of half the exponent.

    Powers of one element commute and share their factors.
    """
    if expression.operation is not Operation.GEOMETRIC_PRODUCT:
        return None
    factors = _factors(expression)
    if len(factors) < 4 or any(factor != factors[0] for factor in factors):
        return None
    return _power(factors[0], len(factors))


def blend(expression: Expression) -> Expression | None:
    """Replace ``sum w_k sandwich(m_k, x)`` by ``(sum w_k) x + 2 sum w_k h_k``, with ``h_k`` half of its change of `x`.

    The half form ``(sandwich(m_k, x) - x) / 2`` of a unit even `m_k` is ``((m_k x - x m_k) / 2) ~m_k``. It takes fewer
    operations than the sandwich, and `x` and the factor 2 are needed once.
    """
    if expression.operation not in (Operation.ADD, Operation.SUBTRACT):
        return None
    terms = _terms(expression)
    if not 2 <= len(terms) <= LONGEST_SUM:
        return None
    weights: Expression | None = None
    halves: Expression | None = None
    common: Expression | None = None
    for term, sign in terms:
        weight, moved = _scaled(term) or (lift(1), term)
        if moved.operation is not Operation.SANDWICH:
            return None
        versor, x = moved.arguments
        if (common is not None and x != common) or not is_unit_even_versor(versor):
            return None
        common = x
        half = (node(Operation.COMMUTATOR, versor, x) * ~versor).grade(*sorted({b.bit_count() for b in x.blades}))
        weights = _added(weights, weight, sign)
        halves = _added(halves, half if weight == lift(1) else weight * half, sign)
    assert weights is not None and halves is not None and common is not None
    return weights * common + 2 * halves


_ONE = lift(1)
_DUALS = (Operation.DUAL, Operation.UNDUAL, Operation.POLARITY)


def _added(total: Expression | None, term: Expression, sign: int) -> Expression:
    if total is None:
        return term if sign > 0 else -term
    return total + term if sign > 0 else total - term


def _scaled(expression: Expression) -> tuple[Expression, Expression] | None:
    """Return a scalar factor and the rest of a product, or None."""
    if expression.operation not in (Operation.GEOMETRIC_PRODUCT, Operation.OUTER_PRODUCT):
        return None
    a, b = expression.arguments
    if a.is_scalar and not b.is_scalar:
        return a, b
    return (b, a) if b.is_scalar and not a.is_scalar else None


def _terms(expression: Expression) -> list[tuple[Expression, int]]:
    """Return the terms of a sum with their signs, at most one more than `LONGEST_SUM`."""
    found: list[tuple[Expression, int]] = []
    stack = [(expression, 1)]
    while stack and len(found) <= LONGEST_SUM:
        each, sign = stack.pop()
        if each.operation in (Operation.ADD, Operation.SUBTRACT):
            a, b = each.arguments
            stack += [(b, sign if each.operation is Operation.ADD else -sign), (a, sign)]
        elif each.operation is Operation.NEGATE:
            stack.append((each.arguments[0], -sign))
        else:
            found.append((each, sign))
    return found


def _factors(expression: Expression) -> list[Expression]:
    """Return the factors of a chain of geometric products, at most `LONGEST_SUM`."""
    found: list[Expression] = []
    stack = [expression]
    while stack and len(found) + len(stack) <= LONGEST_SUM:
        each = stack.pop()
        if each.operation is Operation.GEOMETRIC_PRODUCT:
            stack += reversed(each.arguments)
        else:
            found.append(each)
    return found + stack


def _power(base: Expression, exponent: int) -> Expression:
    if exponent == 1:
        return base
    half = _power(base, exponent // 2)
    square = half * half
    return square * base if exponent % 2 else square


RULES: tuple[Rule, ...] = (
    recognise_sandwich, divide_by_reversing, reverse_factors, cancel_unit, move_back,
    associate_left, associate_right, halve_power,
    pull_out_versor, drop_versor, pull_out_scalar, dual_of_sandwich, norm_of_sandwich,
    split_sandwich, join_sandwich, split_conjugation, blend,
    expand_meet, expand_contraction, expand_square, expand_norm, expand_commutator,
    expand_duals, expand_scalar_part, expand_product_of_vectors,
    expand_mixed_meet, expand_square_of_product, expand_square_of_sum, nest_contractions,
    expand_reflections, split_product_of_vectors, name_determinant,
)  # fmt: skip
"""All rules. Their order has no influence on the result."""
