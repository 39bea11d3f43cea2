"""Expansion of products of outer products of vectors into inner products, instead of contracting coefficients.

The rules are ``v . (a ^ b) = (v . a) b - (v . b) a``, its generalisations by Gram matrices (`gacompiler.passes.gram`),
its dual, and the product rule of commutators. They hold exactly. If the differences lose accuracy for nearly equal
vectors, compared with the author's structure, the candidate is rejected.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from fractions import Fraction

from ..algebra.algebra import Algebra
from ..algebra.blades import Rational, exact
from ..algebra.operations import Operation
from ..algebra.signs import norm_signs
from ..frontend.expression import Expression, lift, node
from ..frontend.facts import has_grade
from .gram import (
    FROM_LEFT,
    FROM_RIGHT,
    LARGEST,
    OF_SCALARS,
    SIGNS,
    Blade,
    added,
    blade_of,
    chain_of,
    contracted,
    determinant,
    in_all_differences,
    in_differences,
    inner,
    meet_of,
    outer,
    scale_of_meets,
    split_scale,
    squared,
)
from .squares import square_of

Factors = tuple[Expression, ...]
Change = Callable[[Factors], Sequence[Expression] | None]


def expand_meet(expression: Expression) -> Expression | None:
    """Apply ``(a & b) ^ n = (a & n) b - (b & n) a`` for pseudovectors `a`, `b` and a vector `n`.

    The same identity is applied with both products and both grades exchanged: ``(a ^ b) & n = (a & n) b - (b & n) a``.
    """
    return _expand_meet(expression, lambda factors: factors)


def expand_meet_in_differences(expression: Expression) -> Expression | None:
    """Expand a meet as `expand_meet`, with the difference of the factors."""
    return _expand_meet(expression, in_all_differences)


def expand_mixed_meet(expression: Expression) -> Expression | None:
    """Expand the regressive product of an outer product of vectors and a regressive product of pseudovectors.

    It is the sum of determinants of ``a & p`` for vectors `a` and pseudovectors `p`, multiplied by the other vectors.
    The same identity is applied with both products exchanged, if there are more pseudovectors than vectors.
    """
    return _expand_mixed_meet(expression, lambda factors: factors)


def expand_mixed_meet_in_differences(expression: Expression) -> Expression | None:
    """Expand a meet as `expand_mixed_meet`, with differences of the factors that have fewer coefficients."""
    return _expand_mixed_meet(expression, in_all_differences)


def expand_contraction(expression: Expression) -> Expression | None:
    """Expand a contraction of outer products of vectors: ``v . (a ^ b) = (v . a) b - (v . b) a``.

    At least one of the operands is the outer product of two or more vectors, and the other one of one or more. Products
    of regressive products of pseudovectors are expanded if they are scalars.
    """
    return _expand_contraction(expression, lambda factors: factors)


def expand_contraction_in_differences(expression: Expression) -> Expression | None:
    """Expand a contraction as `expand_contraction`, with differences of the factors of the larger operand."""
    return _expand_contraction(expression, in_differences)


def expand_contraction_of_differences(expression: Expression) -> Expression | None:
    """Expand a contraction as `expand_contraction`, with differences of the factors of both operands."""
    return _expand_contraction(expression, in_differences, in_differences)


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


def expand_duals(expression: Expression) -> Expression | None:
    """Write the scalar product of two polarities, or of two duals, as a multiple of that of their arguments.

    It is ``<(a I**-1) (b I**-1)> = (-1)**(k (n - 1)) <a b> I**-2`` for `a` and `b` of grade `k` in `n` dimensions. For
    duals it is the product of the inverse metric (Jacobi's complementary minors), which is the metric divided by `s` to
    the power of `k` if its matrix has the square `s`, as in orthonormal bases and null pairs.
    """
    arguments = expression.arguments
    if expression.operation not in OF_SCALARS or len({each.operation for each in arguments}) != 1:
        return None
    operation, algebra = arguments[0].operation, expression.algebra
    if operation not in (Operation.POLARITY, Operation.DUAL, Operation.UNDUAL):
        return None
    if algebra.conjugates or algebra.has_symbolic_metric:
        return None
    n, grades = algebra.dimension, {x.bit_count() for each in arguments for x in each.arguments[0].blades}
    ends = expression.operation is Operation.HESTENES_PRODUCT and not grades.isdisjoint({0, n})
    if len(grades) != 1 or ends:
        return None
    (k,) = grades
    square = Fraction(algebra.blade_product(algebra.everything, algebra.everything).get(0, 0))
    reverse = SIGNS[Operation.REVERSE]
    signs = reverse(k) * reverse(n - k)
    if operation is Operation.POLARITY:
        scale = (-1) ** (k * (n - 1)) / square
    elif metric := _square_of_metric(algebra):
        scale = signs * reverse(n) * square / Fraction(metric) ** k
    else:
        return None
    if expression.operation is Operation.NORM_SQUARED:
        scale *= signs
    return exact(scale) * node(expression.operation, *(each.arguments[0] for each in arguments))


def _square_of_metric(algebra: Algebra) -> Rational | None:
    """Return the number `s` if the square of the matrix of the metric is `s` times the unit matrix, else None."""
    gram, n = algebra.gram, range(algebra.dimension)
    square = [[sum(gram[i][k] * gram[k][j] for k in n) for j in n] for i in n]
    return square[0][0] if all(square[i][j] == (square[0][0] if i == j else 0) for i in n for j in n) else None


def expand_square_of_product(expression: Expression) -> Expression | None:
    """Apply ``<(v x) ~(v x)> = (v . v) <x ~x>`` and the same for ``x v``, for a vector `v` and any `x`."""
    if expression.operation is not Operation.NORM_SQUARED or expression.algebra.conjugates:
        return None
    (product,) = expression.arguments
    if product.operation is not Operation.GEOMETRIC_PRODUCT:
        return None
    for v, x in (product.arguments, product.arguments[::-1]):
        if has_grade(v, 1) and not x.is_scalar:
            square = inner(v, v)
            return lift(0) if square is None else square * node(Operation.NORM_SQUARED, x)
    return None


def expand_square_of_sum(expression: Expression) -> Expression | None:
    """Expand the squared norm of the sum of two outer products of vectors of known squares.

    Most terms vanish for null vectors. That of ``r a + s b`` is ``2 r s a . b``.
    """
    if expression.operation is not Operation.NORM_SQUARED or expression.algebra.conjugates:
        return None
    (total,) = expression.arguments
    if total.operation not in (Operation.ADD, Operation.SUBTRACT):
        return None
    first, second = map(_of_known_squares, total.arguments)
    if not first or not second or len(first.factors) != len(second.factors):
        return None
    found: Expression | None = None
    sign = 1 if total.operation is Operation.ADD else -1
    for a, b, times in ((first, first, 1), (first, second, 2 * sign), (second, second, 1)):
        product = determinant(a.factors, b.factors) if a is not b else squared(a.factors)
        if product is not None:
            found = added(found, a.scaled(b.scaled(times * product)), 1)
    return _or_zero(found)


def _of_known_squares(expression: Expression) -> Blade | None:
    """Return the outer product of vectors of known squares that an expression is, or None."""
    blade = blade_of(expression)
    if blade is None:
        return None
    factors = []
    for each in blade.factors:
        vector, split = each, split_scale(each)
        if split is not None:
            blade, vector = Blade(blade.factors, blade.scaled(split[0])), split[1]
        if square_of(vector) is None:
            return None
        factors.append(vector)
    return Blade(tuple(factors), blade.scale)


def expand_norm(expression: Expression) -> Expression | None:
    """Write the norm of an outer product of vectors as the root of its squared norm, which is expanded then."""
    if expression.operation is not Operation.NORM:
        return None
    square = node(Operation.NORM_SQUARED, *expression.arguments)
    of_arguments = expand_duals(square)
    if expand_square(square if of_arguments is None else of_arguments.arguments[-1]) is None:
        return None
    signs = norm_signs(expression.algebra, expression.arguments[0].blades)
    if signs.both:
        square = node(Operation.ABS, square)
    return node(Operation.SQRT, -square if signs.negative and not signs.positive else square)


def expand_commutator(expression: Expression) -> Expression | None:
    """Apply ``b x v = -(v . b)`` and ``b x (v ^ w) = (b x v) ^ w + v ^ (b x w)`` for vectors and a bivector `b`."""
    return _expand_commutator(expression, lambda factors: factors)


def expand_commutator_of_differences(expression: Expression) -> Expression | None:
    """Expand the commutator of two blades as `expand_commutator`, with differences of the factors of both."""
    return _expand_commutator(expression, in_differences)


def _expand_commutator(expression: Expression, change: Change) -> Expression | None:
    if expression.operation is not Operation.COMMUTATOR:
        return None
    for (bivector, x), sign in ((expression.arguments, 1), (expression.arguments[::-1], -1)):
        left, right = blade_of(bivector), blade_of(x)
        if left and right and len(left.factors) == 2:
            first, factors = change(left.factors), change(right.factors)
            if first is None or factors is None:
                return None
            terms = []
            for k, v in enumerate(factors):
                moved = contracted((v,), first)
                if moved is not None:
                    terms.append(outer([*factors[:k], moved, *factors[k + 1 :]]))
            found = left.scaled(right.scaled(sum(terms[1:], terms[0]))) if terms else lift(0)
            return -found if sign > 0 else found
    return None


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


def _expand_mixed_meet(expression: Expression, change: Change) -> Expression | None:
    n = expression.algebra.dimension
    if expression.operation not in (Operation.OUTER_PRODUCT, Operation.REGRESSIVE_PRODUCT):
        return None
    is_meet = expression.operation is Operation.REGRESSIVE_PRODUCT
    for (x, y), is_swapped in ((expression.arguments, False), (expression.arguments[::-1], True)):
        larger, smaller = (blade_of(x), meet_of(y, LARGEST)) if is_meet else (meet_of(x, LARGEST), blade_of(y))
        if not larger or not smaller:
            continue
        k, m = len(larger.factors), len(smaller.factors)
        if m < 2 or k < m or (k == m and not is_meet):
            continue
        few, many = sorted((smaller.factors, larger.factors), key=_coefficients)
        changed = change(few)
        if changed is None:
            continue
        first, second = (changed, many) if few is smaller.factors else (many, changed)
        product = operator.xor if is_meet else operator.and_
        found = contracted(first[::-1], second, lambda a, b: b & a, product)
        if found is not None:
            found = larger.scaled(smaller.scaled(found))
            return -found if is_swapped and m * (n - k) % 2 else found
    return None


def _coefficients(factors: Factors) -> int:
    """Return the number of stored coefficients of some factors."""
    return sum(each.data.layout.size if each.operation is Operation.INPUT else len(each.blades) for each in factors)


def _expand_contraction(
    expression: Expression, change: Change, change_other: Change = lambda x: x
) -> Expression | None:
    if expression.operation not in (*FROM_LEFT, *FROM_RIGHT, Operation.SCALAR_PRODUCT):
        return None
    first, second = map(blade_of, expression.arguments)
    if not first or not second:
        return _expand_product_of_meets(expression, change)
    j, k = len(first.factors), len(second.factors)
    if j + k < 3 or (expression.operation is Operation.SCALAR_PRODUCT and j != k):
        return None
    from_left = j <= k and expression.operation in (*FROM_LEFT, Operation.SCALAR_PRODUCT)
    if not from_left and (j < k or expression.operation not in FROM_RIGHT):
        return None
    smaller, larger = (first.factors, second.factors) if from_left else (second.factors, first.factors)
    left, right = change_other(smaller), change(larger)
    if left is None or right is None:
        return None
    found = _or_zero(contracted(left, right))
    if not from_left and k * (j - 1) % 2:
        found = -found
    return first.scaled(second.scaled(found))


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
