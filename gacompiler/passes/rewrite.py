"""Rewriting of multivector expressions to equivalent forms. Every rule is exact; the cheapest form is selected later.

The rules apply to whole expressions rather than to single products. For example, ``m * p * ~m`` is a sandwich, and a
sandwich with a product is two nested sandwiches. Products are equivariant under a unit even versor ``m``, so that
``(m >> a) & (m >> b)`` is ``m >> (a & b)``, and scalars are invariant. The same holds for a reflection in a unit
vector, but each regressive product and each pseudoscalar changes its sign.
"""

from __future__ import annotations

from collections.abc import Callable

from ..algebra.operations import PRODUCTS, Operation
from ..algebra.versors import SMALL_DIMENSION, conjugate_factors, n_vectors
from ..errors import GacError
from ..frontend.expression import Expression, node, topological
from ..frontend.facts import is_unit, is_unit_even_versor, is_unit_vector, parity
from .associate import associate
from .expand import (
    expand_commutator,
    expand_commutator_of_differences,
    expand_contraction,
    expand_contraction_in_differences,
    expand_contraction_of_differences,
    expand_duals,
    expand_meet,
    expand_meet_in_differences,
    expand_mixed_meet,
    expand_mixed_meet_in_differences,
    expand_norm,
    expand_product_of_vectors,
    expand_scalar_part,
    expand_square,
    expand_square_in_differences,
    expand_square_of_product,
    expand_square_of_sum,
)
from .parts_of_products import (
    expand_reflections,
    factor_sum,
    name_commutator,
    name_part,
    name_symmetric_part,
    nest_contractions,
)
from .sandwich_differences import reflection_as_difference, sandwich_as_difference

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
    """Replace ``m * x * ~m`` by ``sandwich(m, x)`` for even `m`."""
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
    """Replace the inverse of a unit element by its reverse."""
    if expression.operation is Operation.INVERSE and is_unit(expression.arguments[0]):
        return ~expression.arguments[0]
    return None


def spell_out_inverse(expression: Expression) -> Expression | None:
    """Express an inverse by a product of conjugates, so that common parts can be named."""
    if expression.operation is not Operation.INVERSE:
        return None
    x = expression.arguments[0]
    if n_vectors(x.blades) > SMALL_DIMENSION:
        return None
    (first, *others), norm = conjugate_factors(x, lambda value: node(Operation.CLIFFORD_CONJUGATE, value))
    if not others:
        return None
    rest = others[0] if len(others) == 1 else others[0] * others[1]
    return first * (rest * (1 / norm["1"]))


def split_sandwich(expression: Expression) -> Expression | None:
    """Replace ``sandwich(a b, x)`` by ``sandwich(a, sandwich(b, x))`` if each of `a` and `b` is even or odd."""
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
    """Replace ``(a b) x f(a b)`` by ``a (b x f(b)) f(a)`` for an antiautomorphism `f`, for example for quaternions."""
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
    """Replace ``sandwich(a, sandwich(b, x))`` by ``sandwich(a b, x)`` for even `a` and `b`."""
    if expression.operation is not Operation.SANDWICH or expression.arguments[1].operation is not Operation.SANDWICH:
        return None
    a, (b, x) = expression.arguments[0], expression.arguments[1].arguments
    return node(Operation.SANDWICH, a * b, x) if parity(a) == 0 and parity(b) == 0 else None


def pull_out_versor(expression: Expression) -> Expression | None:
    """Apply an equivariant operation before the common unit even versor or unit vector that transforms its operands."""
    if not expression.arguments or any(a.operation is not Operation.SANDWICH for a in expression.arguments):
        return None
    versors = [argument.arguments[0] for argument in expression.arguments]
    alone = expression.operation in _EQUIVARIANT_ALONE
    if not (alone or expression.operation in _EQUIVARIANT) or any(versor != versors[0] for versor in versors):
        return None
    if not is_unit_even_versor(versors[0]) and not is_unit_vector(versors[0]):
        return None
    moved = tuple(argument.arguments[1] for argument in expression.arguments)
    if alone:
        inner = Expression(expression.operation, moved, expression.data, moved[0].algebra)
    else:
        inner = node(expression.operation, *moved)
    found = node(Operation.SANDWICH, versors[0], inner)
    is_reflected = expression.operation is Operation.REGRESSIVE_PRODUCT and parity(versors[0]) == 1
    return -found if is_reflected else found


def drop_versor(expression: Expression) -> Expression | None:
    """Remove a unit even versor that is applied to scalars and pseudoscalars, which are invariant.

    A unit vector preserves scalars, and changes the sign of pseudoscalars.
    """
    if expression.operation is not Operation.SANDWICH:
        return None
    versor, x = expression.arguments
    scalar, pseudoscalar = 0, expression.algebra.everything
    if is_unit_even_versor(versor):
        return x if x.blades <= {scalar, pseudoscalar} else None
    if not is_unit_vector(versor):
        return None
    return x if x.blades <= {scalar} else -x if x.blades <= {pseudoscalar} else None


def separate_invariant_grades(expression: Expression) -> Expression | None:
    """Apply a unit even element only to the grades of an input other than scalar and pseudoscalar, which commute."""
    if expression.operation is not Operation.SANDWICH or expression.arguments[1].operation is not Operation.INPUT:
        return None
    versor, x = expression.arguments
    ends = (0, expression.algebra.dimension)
    others = tuple(sorted({blade.bit_count() for blade in x.blades} - {*ends}))
    still = tuple(sorted({blade.bit_count() for blade in x.blades} & {*ends}))
    if not still or not others or not is_unit(versor) or parity(versor) != 0:
        return None
    return x.grade(*still) + node(Operation.SANDWICH, versor, x.grade(*others))


RECOGNISE: tuple[Rule, ...] = (recognise_sandwich, divide_by_reversing)
SPELL_OUT: tuple[Rule, ...] = (*RECOGNISE, spell_out_inverse)
PULL_OUT: tuple[Rule, ...] = (*RECOGNISE, pull_out_versor, drop_versor, separate_invariant_grades)
SPLIT: tuple[Rule, ...] = (*PULL_OUT, split_sandwich, split_conjugation)
COMBINE: tuple[Rule, ...] = (*PULL_OUT, join_sandwich)
DIFFERENCES: tuple[Rule, ...] = (sandwich_as_difference, reflection_as_difference)
NAME: tuple[Rule, ...] = (
    *RECOGNISE, nest_contractions, name_symmetric_part, name_part, name_commutator, factor_sum, expand_reflections,
)  # fmt: skip
_OF_BLADES: tuple[Rule, ...] = (*RECOGNISE, expand_duals, expand_scalar_part, expand_square_of_product)
EXPAND: tuple[Rule, ...] = (
    *_OF_BLADES, expand_product_of_vectors,
    expand_meet, expand_mixed_meet, expand_contraction, expand_square, expand_norm, expand_commutator,
    expand_square_of_sum,
)  # fmt: skip
SUBTRACT: tuple[Rule, ...] = (
    *_OF_BLADES, expand_meet_in_differences, expand_mixed_meet_in_differences,
    expand_contraction_in_differences, expand_square_in_differences,
)  # fmt: skip
SUBTRACT_BOTH: tuple[Rule, ...] = (
    *_OF_BLADES, expand_meet_in_differences, expand_mixed_meet_in_differences,
    expand_contraction_of_differences, expand_square_in_differences, expand_commutator_of_differences,
)  # fmt: skip

STRATEGIES: dict[str, tuple[tuple[Rule, ...], ...]] = {
    "as written": (),
    "sandwiches recognised": (RECOGNISE,),
    "inverses spelled out": (SPELL_OUT,),
    "versors pulled out": (PULL_OUT,),
    "products expanded": (NAME, EXPAND),
    "products of differences expanded": (PULL_OUT, NAME, SUBTRACT),
    "both operands in differences, expanded": (PULL_OUT, NAME, SUBTRACT_BOTH),
    "chains associated": (RECOGNISE, (associate,)),
    "sandwiches one by one": (SPLIT,),
    "sandwiches combined": (COMBINE,),
    "sandwiches as differences": ((*SPLIT, *DIFFERENCES),),
    "pulled out, as differences": (SPLIT, DIFFERENCES),
}
"""Phases of rules by name. Rules of a phase are applied together; a sandwich that has become a sum in one phase is no
longer recognised by the rules for sandwiches."""

EXPANDED = frozenset({"sandwiches as differences", "pulled out, as differences"})
"""The strategies that expand sandwiches."""


def rewrite(expressions: tuple[Expression, ...]) -> dict[str, tuple[Expression, ...]]:
    """Return the distinct results of all strategies by name, starting with the author's own form."""
    found: dict[str, tuple[Expression, ...]] = {}
    order = topological(expressions)
    all_rules = {rule for phases in STRATEGIES.values() for rules in phases for rule in rules}
    applicable = {rule for rule in all_rules if any(_may_apply(rule, each) for each in order)}
    for name, phases in STRATEGIES.items():
        result = expressions
        for rules in phases:
            if result == expressions and applicable.isdisjoint(rules):
                continue
            memory: dict[Expression, Expression] = {}
            result = tuple(_everywhere(expression, rules, memory) for expression in result)
        if result not in found.values():
            found[name] = result
    return found


def _may_apply(rule: Rule, expression: Expression) -> bool:
    try:
        return rule(expression) is not None
    except GacError:
        return True


def _everywhere(expression: Expression, rules: tuple[Rule, ...], memory: dict[Expression, Expression]) -> Expression:
    """Apply `rules` bottom-up until none applies."""
    for each in topological([expression], memory):
        arguments = tuple(memory[argument] for argument in each.arguments)
        current = each
        if arguments != each.arguments:
            current = Expression(each.operation, arguments, each.data, each.algebra)
        changed = next((new for rule in rules if (new := rule(current)) is not None), None)
        memory[each] = current if changed is None else _everywhere(changed, rules, memory)
    return memory[expression]
