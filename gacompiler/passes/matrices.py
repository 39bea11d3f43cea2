"""Dense products by matrix multiplication. Geometric algebras are isomorphic to algebras of small matrices.

One level of 2 x 2 matrices (`gacompiler.structure.levels`) reduces the product of two elements to eight instead of
sixteen products of elements of a quarter of the size, at the cost of a few sums to convert the operands and the result.
A decomposition in two halves requires two instead of four products of half the size, and complex numbers require three.
Degenerate vectors are kept in the blocks, where vanishing products are omitted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.involutions import grade_involution, reverse
from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..frontend.expression import Expression, apply_operation, topological
from ..frontend.facts import is_unit_even_versor
from ..structure.blocks import matrix_product
from ..structure.frames import Frame, orthogonal_frame
from ..structure.levels import COMPLEX, HALVES, MATRIX, NILPOTENT, Level, plans

SMALLEST = 64
"""Products of fewer pairs of blades than this are not changed. For sandwiches the limit is half of this."""
HUGE = 10_000
"""Products of more pairs of blades than this are only computed by matrices. Expanding them takes seconds and is never
cheaper."""


def plan_choices(expressions: Sequence[Expression]) -> list[tuple[int, int]]:
    """Return the pairs of plan number and number of levels that are available for large products of `expressions`."""
    huge = has_huge_product(expressions)
    found: dict[tuple[int, int], None] = {}
    for expression in topological(expressions):
        for number, plan in enumerate(_plans(expression)[: 1 if huge else None]):
            least = max(1, len(plan) - 1) if huge else min(1, len(plan))
            found.update(((number, depth), None) for depth in range(least, len(plan) + 1))
    return sorted(found)


def _plans(expression: Expression) -> tuple[tuple[Level, ...], ...]:
    """Return the plans for a large product. In an orthogonal frame, a product without levels is a plan, too."""
    blades = _large(expression)
    if not blades:
        return ()
    frame = orthogonal_frame(expression.algebra)
    if frame is None:
        return plans(expression.algebra, *blades)
    return (*plans(frame.algebra, *(_of_same_grades(frame.algebra, each) for each in blades)), ())


def _of_same_grades(algebra: Algebra, blades: Iterable[int]) -> frozenset[int]:
    grades = {blade.bit_count() for blade in blades}
    return frozenset(blade for blade in algebra.blades() if blade.bit_count() in grades)


def evaluate_by_matrices(
    expressions: Sequence[Expression], inputs: Mapping[str, Any], lift: Callable[[Any], Any], choice: tuple[int, int]
) -> tuple[list[Multivector], str]:
    """Evaluate expressions as `gacompiler.frontend.expression.evaluate`, with large products computed by matrices.

    Return the values, and a description of the matrices. `choice` is a pair from `plan_choices`.
    """
    memory: dict[Expression, Multivector] = {}
    number, depth = choice
    texts: dict[str, None] = {}
    for expression in topological(expressions):
        values = [memory[argument] for argument in expression.arguments]
        known = _plans(expression)
        if known:
            plan = known[min(number, len(known) - 1)][:depth]
            frame = orthogonal_frame(expression.algebra)
            texts[_text(plan, frame)] = None
            factors = [factor.terms for factor in _factors(expression.operation, values)]
            terms = _product(expression, factors, plan, frame)
            memory[expression] = Multivector(expression.algebra, terms)
        else:
            memory[expression] = apply_operation(expression, values, inputs, lift)
    return [memory[expression] for expression in expressions], ", ".join(texts)


def _product(
    expression: Expression, factors: Sequence[Mapping[int, Any]], plan: Sequence[Level], frame: Frame | None
) -> dict[int, Any]:
    possible = frozenset(_possible(expression))
    if frame is None:
        return matrix_product(expression.algebra, factors, plan, possible)
    inside = _of_same_grades(frame.algebra, possible)
    terms = frame.from_frame(matrix_product(frame.algebra, list(map(frame.to_frame, factors)), plan, inside))
    return {blade: terms[blade] for blade in sorted(possible & terms.keys())}


def _possible(expression: Expression) -> Iterable[int]:
    """Return the blades that a product or a sandwich can have. A unit even versor preserves grades."""
    first, x = expression.arguments
    if expression.operation is not Operation.SANDWICH or not is_unit_even_versor(first):
        return expression.blades
    grades = {blade.bit_count() for blade in x.blades}
    return [blade for blade in expression.blades if blade.bit_count() in grades]


def _text(plan: Sequence[Level], frame: Frame | None) -> str:
    """Return a description of the levels of a plan."""
    kinds = [level.kind for level in plan]
    size = 2 ** sum(kind.products is MATRIX for kind in kinds)
    parts = ["in an orthogonal frame"] if frame else []
    parts += [f"{size} x {size} matrices"] if size > 1 else []
    further = ((HALVES, "in halves"), (COMPLEX, "of complex numbers"), (NILPOTENT, "with degenerate vectors apart"))
    return " ".join(parts + [text for kind, text in further if kind in kinds])


def _factors(operation: Operation, values: Sequence[Multivector]) -> list[Multivector]:
    if operation is Operation.GEOMETRIC_PRODUCT:
        return list(values)
    versor, x = values
    odd = any(blade.bit_count() & 1 for blade in versor.terms)
    return [versor, grade_involution(x) if odd else x, reverse(versor)]


def _large(expression: Expression) -> tuple[frozenset[int], ...]:
    """Return the blades of the factors of a large product or sandwich, or an empty tuple."""
    if expression.operation not in (Operation.GEOMETRIC_PRODUCT, Operation.SANDWICH):
        return ()
    a, b = expression.arguments
    is_sandwich = expression.operation is Operation.SANDWICH
    if a.algebra != b.algebra or len(a.blades) * len(b.blades) < SMALLEST // (1 + is_sandwich):
        return ()
    return (a.blades, b.blades, a.blades) if is_sandwich else (a.blades, b.blades)


def has_huge_product(expressions: Sequence[Expression]) -> bool:
    """Return whether some product is so large that it is only computed by matrices."""
    return any(
        expression.operation is Operation.GEOMETRIC_PRODUCT
        and len(expression.arguments[0].blades) * len(expression.arguments[1].blades) > HUGE
        and _plans(expression)
        for expression in topological(expressions)
    )
