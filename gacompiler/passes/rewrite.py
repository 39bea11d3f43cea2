"""Other ways to write the same multivector expression. Each rule holds exactly; cost decides later which one is used.

The rules look at the whole expression, where one product's code could not: ``m * p * ~m`` is a sandwich, a sandwich
by a product is two sandwiches, and a unit even versor ``m`` commutes with every product, so that
``(m >> a) & (m >> b)`` is ``m >> (a & b)`` and drops out of scalars.
"""

from __future__ import annotations

from collections.abc import Callable

from ..algebra.operations import PRODUCTS, Operation
from ..algebra.versors import SMALL_DIMENSION, conjugate_factors, n_vectors
from ..frontend.expression import Expression, node, topological
from ..frontend.facts import is_unit, is_unit_even_versor, is_vector, parity
from .associate import associate
from .expand import expand_contraction, expand_meet, expand_square

Rule = Callable[[Expression], Expression | None]

_EQUIVARIANT = (*PRODUCTS, Operation.ADD, Operation.SUBTRACT, Operation.SANDWICH)
_EQUIVARIANT_ALONE = (
    Operation.REVERSE,
    Operation.GRADE_INVOLUTION,
    Operation.CLIFFORD_CONJUGATE,
    Operation.NEGATE,
    Operation.INVERSE,
    Operation.NORM_SQUARED,
    Operation.GRADE,
)


def recognise_sandwich(expression: Expression) -> Expression | None:
    """``m * x * ~m`` is ``sandwich(m, x)`` for even `m`."""
    if expression.operation is not Operation.GEOMETRIC_PRODUCT:
        return None
    left, right = expression.arguments
    if left.operation is Operation.GEOMETRIC_PRODUCT:
        (versor, x), last = left.arguments, right
        if last == ~versor and parity(versor) == 0:
            return node(Operation.SANDWICH, versor, x)
    if right.operation is Operation.GEOMETRIC_PRODUCT:
        versor, (x, last) = left, right.arguments
        if last == ~versor and parity(versor) == 0:
            return node(Operation.SANDWICH, versor, x)
    return None


def divide_by_reversing(expression: Expression) -> Expression | None:
    """The inverse of a unit element is its reverse."""
    if expression.operation is Operation.INVERSE and is_unit(expression.arguments[0]):
        return ~expression.arguments[0]
    return None


def spell_out_inverse(expression: Expression) -> Expression | None:
    """An inverse as a product of conjugates, so that what they share can be named."""
    if expression.operation is not Operation.INVERSE:
        return None
    x = expression.arguments[0]
    if n_vectors(x.blades) > SMALL_DIMENSION:
        return None
    (first, *others), norm = conjugate_factors(x, lambda value: node(Operation.CLIFFORD_CONJUGATE, value))
    if not others:
        return None
    rest = others[0] if len(others) == 1 else others[0] * others[1]
    return first * (rest * (1 / norm[0]))


def split_sandwich(expression: Expression) -> Expression | None:
    """``sandwich(a b, x)`` is ``sandwich(a, sandwich(b, x))``, where `a` and `b` are even or odd."""
    if expression.operation is not Operation.SANDWICH:
        return None
    versor, x = expression.arguments
    if versor.operation is not Operation.GEOMETRIC_PRODUCT or any(
        parity(factor) is None for factor in versor.arguments
    ):
        return None
    a, b = versor.arguments
    return node(Operation.SANDWICH, a, node(Operation.SANDWICH, b, x))


def split_conjugation(expression: Expression) -> Expression | None:
    """``(a b) x f(a b)`` is ``a (b x f(b)) f(a)`` where `f` reverses the order of products: quaternions one by one."""
    if (
        expression.operation is not Operation.GEOMETRIC_PRODUCT
        or expression.arguments[0].operation is not Operation.GEOMETRIC_PRODUCT
    ):
        return None
    (versor, x), last = expression.arguments[0].arguments, expression.arguments[1]
    if versor.operation is not Operation.GEOMETRIC_PRODUCT or last.operation not in (
        Operation.REVERSE,
        Operation.CLIFFORD_CONJUGATE,
    ):
        return None
    if last.arguments[0] != versor:
        return None
    a, b = versor.arguments
    return a * (b * x * node(last.operation, b)) * node(last.operation, a)


def join_sandwich(expression: Expression) -> Expression | None:
    """``sandwich(a, sandwich(b, x))`` is ``sandwich(a b, x)`` for even `a` and `b`."""
    if expression.operation is not Operation.SANDWICH or expression.arguments[1].operation is not Operation.SANDWICH:
        return None
    a, (b, x) = expression.arguments[0], expression.arguments[1].arguments
    return node(Operation.SANDWICH, a * b, x) if parity(a) == 0 and parity(b) == 0 else None


def pull_out_versor(expression: Expression) -> Expression | None:
    """An equivariant operation on things moved by the same unit even versor is the moved operation on the things."""
    if expression.operation in _EQUIVARIANT_ALONE and expression.arguments[0].operation is Operation.SANDWICH:
        versor, x = expression.arguments[0].arguments
        if is_unit_even_versor(versor):
            inner = Expression(expression.operation, (x,), expression.data, x.algebra)
            return node(Operation.SANDWICH, versor, inner)
    if expression.operation in _EQUIVARIANT and all(a.operation is Operation.SANDWICH for a in expression.arguments):
        versors = [argument.arguments[0] for argument in expression.arguments]
        if all(versor == versors[0] for versor in versors) and is_unit_even_versor(versors[0]):
            moved = [argument.arguments[1] for argument in expression.arguments]
            return node(Operation.SANDWICH, versors[0], node(expression.operation, *moved))
    return None


def drop_versor(expression: Expression) -> Expression | None:
    """A unit even versor leaves scalars and pseudoscalars as they are."""
    if expression.operation is not Operation.SANDWICH:
        return None
    versor, x = expression.arguments
    invariant = {0, expression.algebra.everything}
    return x if x.blades <= invariant and is_unit_even_versor(versor) else None


def leave_out_what_commutes(expression: Expression) -> Expression | None:
    """Scalars and pseudoscalars commute with even elements: a unit one moves the rest of an input alone."""
    if expression.operation is not Operation.SANDWICH or expression.arguments[1].operation is not Operation.INPUT:
        return None
    versor, x = expression.arguments
    ends = (0, expression.algebra.dimension)
    others = tuple(sorted({blade.bit_count() for blade in x.blades} - {*ends}))
    still = tuple(sorted({blade.bit_count() for blade in x.blades} & {*ends}))
    if not still or not others or not is_unit(versor) or parity(versor) != 0:
        return None
    return x.grade(*still) + node(Operation.SANDWICH, versor, x.grade(*others))


def sandwich_as_difference(expression: Expression) -> Expression | None:
    """``m x ~m = x m ~m + (m x - x m) ~m`` for even `m`: what commutes with `x` is not multiplied out."""
    if expression.operation is not Operation.SANDWICH:
        return None
    versor, x = expression.arguments
    if parity(versor) != 0 or x in (versor, ~versor):  # of which the first term is a sandwich again
        return None
    rest = 2 * (node(Operation.COMMUTATOR, versor, x) * ~versor)
    if is_unit_even_versor(versor):  # which keeps grades: what the product has of others vanishes
        rest = rest.grade(*sorted({blade.bit_count() for blade in x.blades}))
    return (x if is_unit(versor) else x * (versor * ~versor)) + rest


def sandwich_of_difference(expression: Expression) -> Expression | None:
    """The sandwich that `sandwich_as_difference` turns into `expression`, if there is one."""
    part = expression
    if part.operation is Operation.ADD and part.arguments[1].operation is Operation.GRADE:
        part = node(Operation.ADD, part.arguments[0], part.arguments[1].arguments[0])
    for operation, place in (
        (Operation.ADD, 1),
        (Operation.GEOMETRIC_PRODUCT, 1),
        (Operation.GEOMETRIC_PRODUCT, 0),
        (Operation.COMMUTATOR, 0),
    ):
        if part.operation != operation:
            return None
        bracket, part = part, part.arguments[place]
    sandwich = node(Operation.SANDWICH, *bracket.arguments)
    return sandwich if sandwich_as_difference(sandwich) == expression else None


def reflection_as_difference(expression: Expression) -> Expression | None:
    """``v x^ v = v**2 x - 2 v ^ (v . x) = 2 v . (v ^ x) - v**2 x`` for a vector `v`, where ``x^`` is `x` involuted.

    The geometric product of a vector is a contraction and an outer product, and either of the two annihilates itself;
    the one with fewer blades is computed. That holds in every metric, for a `v` of any square and any `x`.
    """
    reflection = _reflection(expression)
    if reflection is None:
        return None
    v, x = reflection
    scaled = x if is_unit(v) else node(Operation.SCALAR_PRODUCT, v, v) * x
    lower, higher = node(Operation.LEFT_CONTRACTION, v, x), v ^ x
    if len(lower.blades) <= len(higher.blades):
        return scaled - 2 * (v ^ lower)
    return 2 * node(Operation.LEFT_CONTRACTION, v, higher) - scaled


def _reflection(expression: Expression) -> tuple[Expression, Expression] | None:
    """The vector and what it reflects, of ``sandwich(v, x)`` and of ``v y v``, where `x` is `y` involuted."""
    if expression.operation is Operation.SANDWICH and is_vector(expression.arguments[0]):
        return expression.arguments[0], expression.arguments[1]
    if expression.operation is not Operation.GEOMETRIC_PRODUCT:
        return None
    left, right = expression.arguments
    if left.operation is Operation.GEOMETRIC_PRODUCT:
        first, y, last = *left.arguments, right
    elif right.operation is Operation.GEOMETRIC_PRODUCT:
        first, y, last = left, *right.arguments
    else:
        return None
    if not is_vector(first) or last not in (first, ~first):
        return None
    return first, y if parity(y) == 0 else -y if parity(y) == 1 else node(Operation.GRADE_INVOLUTION, y)


RECOGNISE: tuple[Rule, ...] = (recognise_sandwich, divide_by_reversing)
SPELL_OUT: tuple[Rule, ...] = (*RECOGNISE, spell_out_inverse)
PULL_OUT: tuple[Rule, ...] = (*RECOGNISE, pull_out_versor, drop_versor, leave_out_what_commutes)
SPLIT: tuple[Rule, ...] = (*PULL_OUT, split_sandwich, split_conjugation)
COMBINE: tuple[Rule, ...] = (*PULL_OUT, join_sandwich)

DIFFERENCES: tuple[Rule, ...] = (sandwich_as_difference, reflection_as_difference)

STRATEGIES: dict[str, tuple[tuple[Rule, ...], ...]] = {
    "as written": (),
    "sandwiches recognised": (RECOGNISE,),
    "inverses spelled out": (SPELL_OUT,),
    "versors pulled out": (PULL_OUT,),
    "products expanded": ((*RECOGNISE, expand_meet, expand_contraction, expand_square),),
    "chains associated": (RECOGNISE, (associate,)),
    "sandwiches one by one": (SPLIT,),
    "sandwiches combined": (COMBINE,),
    "sandwiches as differences": ((*SPLIT, *DIFFERENCES),),
    "pulled out, as differences": (SPLIT, DIFFERENCES),
}
"""Rules that are applied together, and after them others: a sandwich that has become a sum is not pulled out."""


def rewrite(expressions: tuple[Expression, ...]) -> dict[str, tuple[Expression, ...]]:
    """The different results of every strategy, by its name; the author's own form is the first."""
    found: dict[str, tuple[Expression, ...]] = {}
    for name, phases in STRATEGIES.items():
        result = expressions
        for rules in phases:
            memory: dict[Expression, Expression] = {}
            result = tuple(_everywhere(expression, rules, memory) for expression in result)
        if result not in found.values():
            found[name] = result
    return found


def _everywhere(expression: Expression, rules: tuple[Rule, ...], memory: dict[Expression, Expression]) -> Expression:
    """Apply `rules` from the leaves up until none applies."""
    for each in topological([expression], memory):
        arguments = tuple(memory[argument] for argument in each.arguments)
        current = each
        if arguments != each.arguments:
            current = Expression(each.operation, arguments, each.data, each.algebra)
        changed = next((new for rule in rules if (new := rule(current)) is not None), None)
        memory[each] = current if changed is None else _everywhere(changed, rules, memory)
    return memory[expression]
