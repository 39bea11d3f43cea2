"""Expansion of products of outer products of vectors into inner products, instead of contracting coefficients.

The rules are ``v . (a ^ b) = (v . a) b - (v . b) a``, its generalisations by Gram matrices (`gacompiler.passes.gram`),
its dual, and the product rule of commutators. They hold exactly. If the differences lose accuracy for nearly equal
vectors, compared with the author's structure, the candidate is rejected.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..algebra.operations import Operation
from ..algebra.signs import norm_signs
from ..frontend.expression import Expression, lift, node
from ..frontend.facts import has_grade
from .gram import contracted, factors_of, in_differences, outer, squared

Factors = tuple[Expression, ...]

_FROM_LEFT = (Operation.LEFT_CONTRACTION, Operation.INNER_PRODUCT, Operation.HESTENES_PRODUCT)
_FROM_RIGHT = (Operation.RIGHT_CONTRACTION, Operation.INNER_PRODUCT, Operation.HESTENES_PRODUCT)


def expand_meet(expression: Expression) -> Expression | None:
    """Apply ``(a & b) ^ n = (a & n) b - (b & n) a`` for pseudovectors `a`, `b` and a vector `n`.

    The same identity is applied with both products and both grades exchanged: ``(a ^ b) & n = (a & n) b - (b & n) a``.
    """
    dimension = expression.algebra.dimension
    if expression.operation is Operation.OUTER_PRODUCT:
        inner, grade = Operation.REGRESSIVE_PRODUCT, dimension - 1
    elif expression.operation is Operation.REGRESSIVE_PRODUCT:
        inner, grade = Operation.OUTER_PRODUCT, 1
    else:
        return None
    for (pair, n), sign in ((expression.arguments, 1), (expression.arguments[::-1], (-1) ** dimension)):
        of_vectors = pair.operation == inner and all(has_grade(x, grade) for x in pair.arguments)
        if of_vectors and has_grade(n, dimension - grade):
            a, b = pair.arguments
            found = (a & n) * b - (b & n) * a
            return found if sign > 0 else -found
    return None


def expand_contraction(expression: Expression) -> Expression | None:
    """Expand a contraction of outer products of vectors: ``v . (a ^ b) = (v . a) b - (v . b) a``.

    At least one of the operands is the outer product of two or more vectors, and the other one of one or more.
    """
    return _expand_contraction(expression, lambda factors: factors)


def expand_contraction_in_differences(expression: Expression) -> Expression | None:
    """Expand a contraction as `expand_contraction`, with differences of the factors of the larger operand."""
    return _expand_contraction(expression, in_differences)


def expand_square(expression: Expression) -> Expression | None:
    """Expand the squared norm of an outer product: that of ``a ^ b`` is ``(a . a) (b . b) - (a . b)**2`` (Lagrange)."""
    return _expand_square(expression, lambda factors: factors)


def expand_square_in_differences(expression: Expression) -> Expression | None:
    """Expand the squared norm of an outer product as `expand_square`, with differences of the factors."""
    return _expand_square(expression, in_differences)


def expand_norm(expression: Expression) -> Expression | None:
    """Write the norm of an outer product of vectors as the root of its squared norm, which is expanded then."""
    if expression.operation is not Operation.NORM:
        return None
    square = node(Operation.NORM_SQUARED, *expression.arguments)
    if expand_square(square) is None:
        return None
    signs = norm_signs(expression.algebra, expression.arguments[0].blades)
    if signs.both:
        square = node(Operation.ABS, square)
    return node(Operation.SQRT, -square if signs.negative and not signs.positive else square)


def expand_commutator(expression: Expression) -> Expression | None:
    """Apply ``b x v = -(v . b)`` and ``b x (v ^ w) = (b x v) ^ w + v ^ (b x w)`` for vectors and a bivector `b`."""
    if expression.operation is not Operation.COMMUTATOR:
        return None
    for (bivector, x), sign in ((expression.arguments, 1), (expression.arguments[::-1], -1)):
        left, right = factors_of(bivector), factors_of(x)
        if left and right and len(left) == 2:
            terms = []
            for k, v in enumerate(right):
                moved = contracted((v,), left)
                if moved is not None:
                    terms.append(outer([*right[:k], moved, *right[k + 1 :]]))
            found = sum(terms[1:], terms[0]) if terms else lift(0)
            return -found if sign > 0 else found
    return None


Change = Callable[[Factors], Sequence[Expression] | None]


def _expand_contraction(expression: Expression, change: Change) -> Expression | None:
    if expression.operation not in (*_FROM_LEFT, *_FROM_RIGHT, Operation.SCALAR_PRODUCT):
        return None
    first, second = map(factors_of, expression.arguments)
    if not first or not second or len(first) + len(second) < 3:
        return None
    j, k = len(first), len(second)
    if expression.operation is Operation.SCALAR_PRODUCT and j != k:
        return None
    if j <= k and expression.operation in (*_FROM_LEFT, Operation.SCALAR_PRODUCT):
        changed = change(second)
        return None if changed is None else _or_zero(contracted(first, changed))
    if j < k or expression.operation not in _FROM_RIGHT:
        return None
    changed = change(first)
    if changed is None:
        return None
    found = _or_zero(contracted(second, changed))
    return -found if k * (j - 1) % 2 else found


def _expand_square(expression: Expression, change: Change) -> Expression | None:
    if expression.operation is not Operation.NORM_SQUARED or expression.algebra.conjugates:
        return None
    factors = factors_of(expression.arguments[0])
    changed = change(factors) if factors and len(factors) > 1 else None
    return None if changed is None else _or_zero(squared(changed))


def _or_zero(value: Expression | None) -> Expression:
    return lift(0) if value is None else value
