"""Expansion of products of three vectors into scalars times vectors, instead of contracting bivectors.

The rules are ``v . (a ^ b) = (v . a) b - (v . b) a``, its dual, and Lagrange's identity. They hold exactly. If the
differences lose accuracy for nearly equal vectors, compared with the author's structure, the candidate is rejected.
"""

from __future__ import annotations

from ..algebra.operations import Operation
from ..frontend.expression import Expression, node
from ..frontend.facts import has_grade, is_vector


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
    """Apply ``v . (a ^ b) = (v . a) b - (v . b) a`` for three vectors, and its negative for ``(a ^ b) . v``."""
    if expression.operation not in (
        Operation.LEFT_CONTRACTION,
        Operation.RIGHT_CONTRACTION,
        Operation.INNER_PRODUCT,
        Operation.HESTENES_PRODUCT,
    ):
        return None
    first, second = expression.arguments
    from_left = second.operation is Operation.OUTER_PRODUCT and expression.operation is not Operation.RIGHT_CONTRACTION
    pair, v = (second, first) if from_left else (first, second)
    if pair.operation is not Operation.OUTER_PRODUCT or not all(map(is_vector, (v, *pair.arguments))):
        return None
    if not from_left and expression.operation is Operation.LEFT_CONTRACTION:
        return None
    a, b = pair.arguments
    found = node(Operation.SCALAR_PRODUCT, v, a) * b - node(Operation.SCALAR_PRODUCT, v, b) * a
    return found if from_left else -found


def expand_square(expression: Expression) -> Expression | None:
    """Apply Lagrange's identity: the squared norm of ``a ^ b`` is ``(a . a) (b . b) - (a . b)**2`` for two vectors."""
    if (
        expression.operation is not Operation.NORM_SQUARED
        or expression.arguments[0].operation is not Operation.OUTER_PRODUCT
    ):
        return None
    a, b = expression.arguments[0].arguments
    if not (is_vector(a) and is_vector(b)):
        return None
    inner = node(Operation.SCALAR_PRODUCT, a, b)
    return node(Operation.SCALAR_PRODUCT, a, a) * node(Operation.SCALAR_PRODUCT, b, b) - inner * inner
