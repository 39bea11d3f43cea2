"""Outer products, contractions and commutators that were written as parts of other products.

An expression such as ``(a b - b a) / 2`` has the value of ``a ^ b``, but its structure does not show it. The rules give
such expressions the form that the rules for products of blades expect (`gacompiler.passes.expand`).
"""

from __future__ import annotations

from ..algebra.operations import Operation
from ..frontend.expression import Expression, lift, node
from ..frontend.facts import has_grade
from .gram import FROM_LEFT, OF_SCALARS, SIGNS, added, blade_of, chain_of, inner, outer

Pair = tuple[Expression, Expression]

LONGEST = 15
"""Products of more vectors are not expanded as reflections."""


def nest_contractions(expression: Expression) -> Expression | None:
    """Apply ``u . (v . x) = (u ^ v) . x`` if the result is a scalar, for blades `u` and `v`.

    The scalar product of ``v . x`` and `u` is this one in reverse order.
    """
    if expression.operation not in OF_SCALARS or len(expression.arguments) != 2:
        return None
    for u, product in (expression.arguments, expression.arguments[::-1]):
        if product.operation not in FROM_LEFT:
            continue
        v, x = product.arguments
        grades = [{blade.bit_count() for blade in each.blades} for each in (u, v, x)]
        if all(len(each) == 1 for each in grades):
            j, k, m = (each.pop() for each in grades)
            if j and k and j + k == m:
                return node(Operation.SCALAR_PRODUCT, u ^ v, x)
    return None


def name_part(expression: Expression) -> Expression | None:
    """Write one grade of the geometric product of two blades as their outer product, contraction or commutator.

    The grade `k` of the product of `k` vectors is their outer product.
    """
    if expression.operation is not Operation.GRADE or len(expression.data) != 1:
        return None
    (product,), (grade,) = expression.arguments, expression.data
    vectors = chain_of(product)
    if vectors is not None and len(vectors) == grade > 1:
        return outer(vectors)
    if product.operation is not Operation.GEOMETRIC_PRODUCT or grade == 0:
        return None
    blades = list(map(blade_of, product.arguments))
    if None in blades:
        return None
    j, k = (len(each.factors) for each in blades if each)
    operations = {
        j + k: Operation.OUTER_PRODUCT,
        k - j: Operation.LEFT_CONTRACTION,
        j - k: Operation.RIGHT_CONTRACTION,
    }
    if j == k == 2:
        operations[2] = Operation.COMMUTATOR
    return node(operations[grade], *product.arguments) if grade in operations else None


def name_commutator(expression: Expression) -> Expression | None:
    """Write the commutator of two vectors as their outer product, and the anticommutator as their scalar product."""
    of_vectors = all(has_grade(each, 1) for each in expression.arguments)
    if expression.operation is Operation.COMMUTATOR and of_vectors:
        return node(Operation.OUTER_PRODUCT, *expression.arguments)
    if expression.operation is Operation.ANTICOMMUTATOR and of_vectors:
        return node(Operation.SCALAR_PRODUCT, *expression.arguments)
    return None


def name_symmetric_part(expression: Expression) -> Expression | None:
    """Write the sum or difference of a product of vectors and its reverse as twice the grades that remain."""
    if expression.operation not in (Operation.ADD, Operation.SUBTRACT):
        return None
    first, second = map(chain_of, expression.arguments)
    if first is None or second is None or len(first) < 2 or first != second[::-1]:
        return None
    sign = 1 if expression.operation is Operation.ADD else -1
    grades = range(len(first) % 2, len(first) + 1, 2)
    kept = [grade for grade in grades if SIGNS[Operation.REVERSE](grade) == sign]
    return 2 * expression.arguments[0].grade(*kept)


def factor_sum(expression: Expression) -> Expression | None:
    """Write ``a ^ b + a ^ c`` as ``a ^ (b + c)`` for vectors, and the same with other orders and differences."""
    if expression.operation not in (Operation.ADD, Operation.SUBTRACT):
        return None
    if any(each.operation is not Operation.OUTER_PRODUCT for each in expression.arguments):
        return None
    (a, b), (c, d) = (each.arguments for each in expression.arguments)
    if not all(has_grade(each, 1) for each in (a, b, c, d)):
        return None
    sign = 1 if expression.operation is Operation.ADD else -1
    for x, y, first in ((a, b, 1), (b, a, -1)):
        for z, w, second in ((c, d, 1), (d, c, -1)):
            if x == z:
                rest = y + w if sign * first == second else y - w
                return x ^ rest if first > 0 else rest ^ x
    return None


def expand_reflections(expression: Expression) -> Expression | None:
    """Apply ``v x v = 2 (v . x) v - (v . v) x`` to products such as ``a b x b a`` of five and more vectors."""
    if expression.operation is not Operation.GEOMETRIC_PRODUCT or expression.algebra.conjugates:
        return None
    vectors = chain_of(expression, LONGEST)
    if vectors is None or len(vectors) < 5 or len(vectors) % 2 == 0 or vectors != vectors[::-1]:
        return None
    middle = len(vectors) // 2
    found: Expression | None = vectors[middle]
    for v in reversed(vectors[:middle]):
        along, square = (None if found is None else inner(v, found)), inner(v, v)
        moved = None if along is None else 2 * along * v
        found = moved if square is None or found is None else added(moved, square * found, -1)
    return lift(0) if found is None else found


def split_product_of_vectors(expression: Expression) -> Expression | None:
    """Write a product of three vectors as ``(a . b) c - (a . c) b + (b . c) a + a ^ b ^ c``."""
    if expression.operation is not Operation.GEOMETRIC_PRODUCT or expression.algebra.conjugates:
        return None
    vectors = chain_of(expression)
    if vectors is None or len(vectors) != 3 or len(set(vectors)) < 3:
        return None
    return expression.grade(1) + outer(vectors)


def name_determinant(expression: Expression) -> Expression | None:
    """Write ``(a . c)(b . d) - (a . d)(b . c)`` as ``<(a ^ b)(d ^ c)>``, in few dimensions a sum of fewer products."""
    if expression.operation is not Operation.SUBTRACT or expression.algebra.conjugates:
        return None
    pairs = list(map(_inner_products, expression.arguments))
    if None in pairs:
        return None
    (first, second), (third, fourth) = (each for each in pairs if each)
    for a, c in (first, first[::-1]):
        for b, d in (second, second[::-1]):
            if _crosses(third, fourth, (a, d), (b, c)):
                same = a == c and b == d
                return node(Operation.NORM_SQUARED, a ^ b) if same else node(Operation.SCALAR_PRODUCT, a ^ b, d ^ c)
    return None


def _crosses(x: Pair, y: Pair, first: Pair, second: Pair) -> bool:
    """Return whether two pairs are two others in any order."""
    found = [frozenset(x), frozenset(y)]
    return found in ([frozenset(first), frozenset(second)], [frozenset(second), frozenset(first)])


def _inner_products(expression: Expression) -> tuple[Pair, Pair] | None:
    """Return the vectors of a product of two inner products, or None."""
    if expression.operation is not Operation.GEOMETRIC_PRODUCT:
        return None
    found = []
    for each in expression.arguments:
        if each.operation not in OF_SCALARS or not all(has_grade(x, 1) for x in each.arguments):
            return None
        found.append((each.arguments[0], each.arguments[-1]))
    return found[0], found[1]
