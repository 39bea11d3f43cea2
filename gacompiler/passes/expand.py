"""Expansion of products of outer products of vectors into inner products, instead of contracting coefficients.

The rules are ``v . (a ^ b) = (v . a) b - (v . b) a``, its generalisations by Gram matrices (`gacompiler.passes.gram`),
its dual, and the product rule of commutators. They hold exactly. If the differences lose accuracy for nearly equal
vectors, compared with the author's structure, the candidate is rejected.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction

from ..algebra.blades import Rational, exact
from ..algebra.operations import Operation
from ..algebra.signs import norm_signs
from ..frontend.expression import Expression, lift, node
from ..frontend.facts import has_grade
from .gram import (
    SIGNS,
    added,
    blade_of,
    chain_of,
    contracted,
    determinant,
    in_differences,
    inner,
    meet_of,
    outer,
    scale_of_meets,
    squared,
)

Factors = tuple[Expression, ...]

_FROM_LEFT = (Operation.LEFT_CONTRACTION, Operation.INNER_PRODUCT, Operation.HESTENES_PRODUCT)
_FROM_RIGHT = (Operation.RIGHT_CONTRACTION, Operation.INNER_PRODUCT, Operation.HESTENES_PRODUCT)
_OF_SCALARS = (Operation.NORM_SQUARED, Operation.SCALAR_PRODUCT, Operation.RIGHT_CONTRACTION, *_FROM_LEFT)


def expand_meet(expression: Expression) -> Expression | None:
    """Apply ``(a & b) ^ n = (a & n) b - (b & n) a`` for pseudovectors `a`, `b` and a vector `n`.

    The same identity is applied with both products and both grades exchanged: ``(a ^ b) & n = (a & n) b - (b & n) a``.
    """
    return _expand_meet(expression, lambda factors: factors)


def expand_meet_in_differences(expression: Expression) -> Expression | None:
    """Expand a meet as `expand_meet`, with the difference of the factors."""
    return _expand_meet(expression, in_differences)


def expand_contraction(expression: Expression) -> Expression | None:
    """Expand a contraction of outer products of vectors: ``v . (a ^ b) = (v . a) b - (v . b) a``.

    At least one of the operands is the outer product of two or more vectors, and the other one of one or more. Products
    of regressive products of pseudovectors are expanded if they are scalars.
    """
    return _expand_contraction(expression, lambda factors: factors)


def expand_contraction_in_differences(expression: Expression) -> Expression | None:
    """Expand a contraction as `expand_contraction`, with differences of the factors of the larger operand."""
    return _expand_contraction(expression, in_differences)


def expand_square(expression: Expression) -> Expression | None:
    """Expand the squared norm of an outer product: that of ``a ^ b`` is ``(a . a) (b . b) - (a . b)**2`` (Lagrange).

    That of a regressive product of pseudovectors is such a determinant times a number.
    """
    return _expand_square(expression, lambda factors: factors)


def expand_square_in_differences(expression: Expression) -> Expression | None:
    """Expand the squared norm of an outer product as `expand_square`, with differences of the factors."""
    return _expand_square(expression, in_differences)


def expand_scalar_part(expression: Expression) -> Expression | None:
    """Write the scalar part of the product of two outer products as a scalar product, which is expanded then."""
    if expression.operation is not Operation.GRADE or expression.data != (0,):
        return None
    (product,) = expression.arguments
    if product.operation is not Operation.GEOMETRIC_PRODUCT:
        return None
    found = node(Operation.SCALAR_PRODUCT, *product.arguments)
    return None if expand_contraction(found) is None else found


def expand_product_of_vectors(expression: Expression) -> Expression | None:
    """Apply ``<a b c d> = (a . b)(c . d) - (a . c)(b . d) + (a . d)(b . c)`` and its form for the vector of ``a b c``.

    The vector part of ``a b c`` is ``(a . b) c - (a . c) b + (b . c) a``.
    """
    if expression.operation is Operation.SCALAR_PRODUCT:
        product, grade = node(Operation.GEOMETRIC_PRODUCT, *expression.arguments), 0
    elif expression.operation is Operation.GRADE and expression.data in ((0,), (1,)):
        ((product,), (grade,)) = expression.arguments, expression.data
    else:
        return None
    vectors = chain_of(product)
    if vectors is None or len(vectors) != 4 - grade:
        return None
    a, b, c, *rest = vectors
    total: Expression | None = None
    for x, y, z, sign in ((a, b, c, 1), (a, c, b, -1), (b, c, a, 1)):
        first, last = inner(x, y), inner(z, rest[0]) if rest else z
        if first is not None and last is not None:
            total = added(total, first * last, sign)
    return _or_zero(total)


def expand_polarities(expression: Expression) -> Expression | None:
    """Apply ``<(a I**-1) (b I**-1)> = (-1)**(k (n - 1)) <a b> I**-2`` for `a`, `b` of grade `k` in `n` dimensions."""
    arguments = expression.arguments
    if expression.operation not in _OF_SCALARS or any(each.operation is not Operation.POLARITY for each in arguments):
        return None
    n, grades = expression.algebra.dimension, {x.bit_count() for each in arguments for x in each.arguments[0].blades}
    ends = expression.operation is Operation.HESTENES_PRODUCT and not grades.isdisjoint({0, n})
    if len(grades) != 1 or ends or expression.algebra.conjugates:
        return None
    (k,) = grades
    sign = (-1) ** (k * (n - 1))
    if expression.operation is Operation.NORM_SQUARED:
        sign *= SIGNS[Operation.REVERSE](k) * SIGNS[Operation.REVERSE](n - k)
    square = expression.algebra.blade_product(expression.algebra.everything, expression.algebra.everything)[0]
    return exact(Fraction(sign) / square) * node(expression.operation, *(each.arguments[0] for each in arguments))


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
        left, right = blade_of(bivector), blade_of(x)
        if left and right and len(left.factors) == 2:
            terms = []
            for k, v in enumerate(right.factors):
                moved = contracted((v,), left.factors)
                if moved is not None:
                    terms.append(outer([*right.factors[:k], moved, *right.factors[k + 1 :]]))
            found = left.scaled(right.scaled(sum(terms[1:], terms[0]))) if terms else lift(0)
            return -found if sign > 0 else found
    return None


Change = Callable[[Factors], Sequence[Expression] | None]


def _expand_meet(expression: Expression, change: Change) -> Expression | None:
    dimension = expression.algebra.dimension
    if expression.operation is Operation.OUTER_PRODUCT:
        inner, grade = Operation.REGRESSIVE_PRODUCT, dimension - 1
    elif expression.operation is Operation.REGRESSIVE_PRODUCT:
        inner, grade = Operation.OUTER_PRODUCT, 1
    else:
        return None
    for (pair, n), sign in ((expression.arguments, 1), (expression.arguments[::-1], (-1) ** dimension)):
        of_vectors = pair.operation == inner and all(has_grade(x, grade) for x in pair.arguments)
        if of_vectors and has_grade(n, dimension - grade) and (changed := change(pair.arguments)) is not None:
            a, b = changed
            found = (a & n) * b - (b & n) * a
            return found if sign > 0 else -found
    return None


def _expand_contraction(expression: Expression, change: Change) -> Expression | None:
    if expression.operation not in (*_FROM_LEFT, *_FROM_RIGHT, Operation.SCALAR_PRODUCT):
        return None
    first, second = map(blade_of, expression.arguments)
    if not first or not second:
        return _expand_product_of_meets(expression, change)
    j, k = len(first.factors), len(second.factors)
    if j + k < 3 or (expression.operation is Operation.SCALAR_PRODUCT and j != k):
        return None
    if j <= k and expression.operation in (*_FROM_LEFT, Operation.SCALAR_PRODUCT):
        changed = change(second.factors)
        found = None if changed is None else _or_zero(contracted(first.factors, changed))
    elif j >= k and expression.operation in _FROM_RIGHT:
        changed = change(first.factors)
        found = None if changed is None else _or_zero(contracted(second.factors, changed))
        if found is not None and k * (j - 1) % 2:
            found = -found
    else:
        return None
    return None if found is None else first.scaled(second.scaled(found))


def _expand_product_of_meets(expression: Expression, change: Change) -> Expression | None:
    """Expand a product of regressive products of equally many pseudovectors, which is a scalar."""
    first, second = map(meet_of, expression.arguments)
    if not first or not second or not 1 < len(first.factors) == len(second.factors) < expression.algebra.dimension:
        return None
    scale, changed = scale_of_meets(expression.algebra, len(first.factors)), change(second.factors)
    if scale is None or changed is None:
        return None
    return first.scaled(second.scaled(scale * _or_zero(determinant(first.factors, changed))))


def _expand_square(expression: Expression, change: Change) -> Expression | None:
    if expression.operation is not Operation.NORM_SQUARED or expression.algebra.conjugates:
        return None
    (argument,) = expression.arguments
    scale: Rational | None = 1
    blade = blade_of(argument)
    if blade is None and (blade := meet_of(argument)) is not None:
        k = len(blade.factors)
        scale = scale_of_meets(expression.algebra, k)
        if scale is not None:
            scale *= SIGNS[Operation.REVERSE](expression.algebra.dimension - k)
    if blade is None or len(blade.factors) < 2 or scale is None or (changed := change(blade.factors)) is None:
        return None
    found = _or_zero(squared(changed))
    return blade.scaled(blade.scaled(found if scale == 1 else scale * found))


def _or_zero(value: Expression | None) -> Expression:
    return lift(0) if value is None else value
