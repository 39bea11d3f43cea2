"""Shared by tests of passes: inputs of expressions, and the values of expressions and systems at exact points."""

from __future__ import annotations

from fractions import Fraction
from random import Random
from typing import Any

from gacompiler import Algebra
from gacompiler.algebra.layout import Layout
from gacompiler.algebra.operations import Operation
from gacompiler.frontend.expression import Expression, Input, evaluate, topological
from gacompiler.passes.system import System
from gacompiler.rings.polynomial import Polynomial


def value(polynomial: Polynomial, at: dict[int, Any]) -> Any:
    """A polynomial at a point."""
    total = Fraction(0)
    for monomial, factor in polynomial.terms.items():
        term = Fraction(factor)
        for variable in monomial:
            term *= at[variable]
        total += term
    return total


def outputs_at(system: System, inputs: list[Fraction]) -> list[Fraction]:
    """The results of a system without atoms at a point; definitions may come in any order."""
    at: dict[int, Any] = dict(enumerate(inputs))
    todo = list(system.definitions)
    while todo:
        ready = [d for d in todo if all(v in at for v in d.polynomial.variables)]
        assert ready
        for definition in ready:
            at[definition.variable] = value(definition.polynomial, at)
            todo.remove(definition)
    return [value(polynomial, at) for polynomial in system.outputs]


def symbol(name: str, layout: Layout) -> Expression:
    """An input of a layout."""
    return Expression(
        Operation.INPUT, (), Input(name, layout, tuple(f"{name}_{b}" for b in layout.blades)), layout.algebra
    )


def element(name: str, algebra: Algebra, *grades: int) -> Expression:
    """An input with all blades of some grades, or of all."""
    names = " ".join(algebra.spelling(blade)[1] for blade in algebra.blades(*grades))
    return symbol(name, algebra.layout(f"of_grades_{'_'.join(map(str, grades))}", names))


def same_value(a: Expression, b: Expression, random: Random) -> bool:
    """Whether two expressions have the same value at a random point."""
    inputs = [each.data.components for each in topological([a, b]) if each.operation is Operation.INPUT]
    at = {name: Fraction(random.randint(-9, 9), random.randint(1, 4)) for names in inputs for name in names}
    first, second = evaluate([a, b], at)
    return bool(first.terms == second.terms)
