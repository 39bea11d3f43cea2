"""Dense products through matrices: a geometric algebra is an algebra of small matrices, which multiply in fewer steps.

One level of 2 x 2 matrices (`gacompiler.structure.levels`) takes the product of two elements to eight products of
elements of a quarter of the size instead of sixteen, for a few sums on the way in and out. Two halves take two products
of half the size instead of four, complex numbers three. Zero squares are no obstacle: a degenerate vector stays in the
blocks, where products that vanish are not formed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ..algebra.involutions import grade_involution, reverse
from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..frontend.expression import Expression, apply_operation, topological
from ..frontend.facts import is_unit_even_versor
from ..structure.blocks import matrix_product
from ..structure.levels import COMPLEX, HALVES, MATRIX, Level, plans

SMALLEST = 64
"""Products of fewer pairs of blades than this are left as they are; of sandwiches half as many pairs."""
HUGE = 10_000
"""Products of more pairs of blades than this are only computed through matrices: writing them out takes seconds and
never wins."""


def ways(expressions: Sequence[Expression]) -> list[tuple[int, int]]:
    """Numbers of plans and of levels that some product has, the large products of `expressions` taken together."""
    huge = has_huge_product(expressions)
    found: dict[tuple[int, int], None] = {}
    for expression in topological(expressions):
        blades = _large(expression)
        for number, plan in enumerate(plans(expression.algebra, *blades)[: 1 if huge else None] if blades else ()):
            found.update(
                ((number, depth), None) for depth in range(max(1, len(plan) - 1) if huge else 1, len(plan) + 1)
            )
    return sorted(found)


def evaluate_by_matrices(
    expressions: Sequence[Expression], inputs: Mapping[str, Any], lift: Callable[[Any], Any], way: tuple[int, int]
) -> tuple[list[Multivector], str]:
    """As `gacompiler.frontend.expression.evaluate`, large products and sandwiches by matrices; and by which."""
    memory: dict[Expression, Multivector] = {}
    number, depth = way
    texts: dict[str, None] = {}
    for expression in topological(expressions):
        values = [memory[argument] for argument in expression.arguments]
        blades = _large(expression)
        known = plans(expression.algebra, *blades) if blades else ()
        if known:
            plan = known[min(number, len(known) - 1)][:depth]
            texts[_text(plan)] = None
            factors = [factor.terms for factor in _factors(expression.operation, values)]
            terms = matrix_product(expression.algebra, factors, plan, _possible(expression))
            memory[expression] = Multivector(expression.algebra, terms)
        else:
            memory[expression] = apply_operation(expression, values, inputs, lift)
    return [memory[expression] for expression in expressions], ", ".join(texts)


def _possible(expression: Expression) -> Iterable[int]:
    """The blades that a product or a sandwich can have; a unit even versor keeps the grades of what it moves."""
    first, x = expression.arguments
    if expression.operation is not Operation.SANDWICH or not is_unit_even_versor(first):
        return expression.blades
    grades = {blade.bit_count() for blade in x.blades}
    return [blade for blade in expression.blades if blade.bit_count() in grades]


def _text(plan: Sequence[Level]) -> str:
    """What the levels of a plan make of numbers, in words."""
    kinds = [level.kind for level in plan]
    size = 2 ** sum(kind.products is MATRIX for kind in kinds)
    parts = [f"{size} x {size} matrices"] if size > 1 else []
    return " ".join(parts + ["in halves"] * (HALVES in kinds) + ["of complex numbers"] * (COMPLEX in kinds))


def _factors(operation: Operation, values: Sequence[Multivector]) -> list[Multivector]:
    if operation is Operation.GEOMETRIC_PRODUCT:
        return list(values)
    versor, x = values
    odd = any(blade.bit_count() & 1 for blade in versor.terms)
    return [versor, grade_involution(x) if odd else x, reverse(versor)]


def _large(expression: Expression) -> tuple[frozenset[int], ...]:
    """The blades of the factors of a large product or sandwich; nothing for anything else."""
    if expression.operation not in (Operation.GEOMETRIC_PRODUCT, Operation.SANDWICH):
        return ()
    a, b = expression.arguments
    is_sandwich = expression.operation is Operation.SANDWICH
    if a.algebra != b.algebra or len(a.blades) * len(b.blades) < SMALLEST // (1 + is_sandwich):
        return ()
    return (a.blades, b.blades, a.blades) if is_sandwich else (a.blades, b.blades)


def has_huge_product(expressions: Sequence[Expression]) -> bool:
    """Whether some product is better not written out, because matrices will do."""
    return any(
        expression.operation is Operation.GEOMETRIC_PRODUCT
        and len(expression.arguments[0].blades) * len(expression.arguments[1].blades) > HUGE
        and plans(expression.algebra, *_large(expression))
        for expression in topological(expressions)
    )
