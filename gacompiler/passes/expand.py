"""Products of three vectors expanded: scalars times vectors instead of bivectors that are contracted again.

``v . (a ^ b) = (v . a) b - (v . b) a``, its dual, and the identity of Lagrange. Each holds exactly; where vectors that
nearly coincide lose digits in the differences, and the author's structure keeps them, the result is not taken.
"""

from __future__ import annotations

from ..frontend.expression import Expression, node
from ..frontend.facts import has_grade, is_vector


def expand_meet(expression: Expression) -> Expression | None:
    """``(a & b) ^ n = (a & n) b - (b & n) a`` for pseudovectors `a`, `b` and a vector `n`.

    And the same with both products and both grades swapped: ``(a ^ b) & n``, where ``&`` still makes the scalars.
    """
    dimension = expression.algebra.dimension
    if expression.operation == "outer_product":
        inner, grade = "regressive_product", dimension - 1
    elif expression.operation == "regressive_product":
        inner, grade = "outer_product", 1
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
    """``v . (a ^ b) = (v . a) b - (v . b) a`` for three vectors, and from the other side its negative."""
    if expression.operation not in ("left_contraction", "right_contraction", "inner_product", "hestenes_product"):
        return None
    first, second = expression.arguments
    from_left = second.operation == "outer_product" and expression.operation != "right_contraction"
    pair, v = (second, first) if from_left else (first, second)
    if pair.operation != "outer_product" or not all(map(is_vector, (v, *pair.arguments))):
        return None
    if not from_left and expression.operation == "left_contraction":
        return None
    a, b = pair.arguments
    found = node("scalar_product", v, a) * b - node("scalar_product", v, b) * a
    return found if from_left else -found


def expand_square(expression: Expression) -> Expression | None:
    """The identity of Lagrange: the squared norm of ``a ^ b`` is ``(a . a) (b . b) - (a . b)**2`` for two vectors."""
    if expression.operation != "norm_squared" or expression.arguments[0].operation != "outer_product":
        return None
    a, b = expression.arguments[0].arguments
    if not (is_vector(a) and is_vector(b)):
        return None
    inner = node("scalar_product", a, b)
    return node("scalar_product", a, a) * node("scalar_product", b, b) - inner * inner
