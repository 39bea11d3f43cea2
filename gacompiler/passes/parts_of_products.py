"""Outer products, contractions and commutators that were written as parts of other products.

An expression such as ``(a b - b a) / 2`` has the value of ``a ^ b``, but its structure does not show it. The rules give
such expressions the form that the rules for products of blades expect (`gacompiler.passes.expand`).
"""

from __future__ import annotations

from ..algebra.operations import Operation
from ..frontend.expression import Expression, node
from ..frontend.facts import has_grade
from .gram import FROM_LEFT, OF_SCALARS, SIGNS, blade_of, chain_of, outer


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
