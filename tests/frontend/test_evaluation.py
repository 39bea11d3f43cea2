"""Repeated evaluation of expressions, beside `evaluate`, in which every value is a multivector."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import Any

import pytest

from gacompiler.algebra.layout import SCALAR
from gacompiler.errors import InexactError
from gacompiler.frontend.evaluation import Evaluation, convert
from gacompiler.frontend.expression import Expression, evaluate
from gacompiler.frontend.kernel import Parameter
from gacompiler.frontend.operations import select, sqrt
from gacompiler.rings.decimals import to_decimal
from gacompiler.rings.residues import residue
from gacompiler.specs.pga2 import PGA2


def expressions() -> tuple[Expression, ...]:
    """Sums, differences, negatives and products, also of exact zeros, functions, and coefficients of multivectors."""
    a, b = (Parameter(name, SCALAR).symbols() for name in "ab")
    point = Parameter("p", PGA2.POINT).symbols()
    zero = a - a
    found = (
        a + b,
        a - b,
        zero - b,
        b - zero,
        zero + b,
        b + zero,
        -zero,
        zero * b,
        a * b - b * a,
        b / (a + 1),
        point * b,
    )
    return (*found, point["e02"] * a + (point * ~point)["1"], (point * ~point)["1"] * zero)


FOUND = expressions()
RINGS: tuple[Any, ...] = (lambda x: x, to_decimal, residue)


@pytest.mark.parametrize("lift", RINGS, ids=["rational", "decimal", "residue"])
def test_values_are_those_of_evaluate(lift: Any) -> None:
    names = {name for each in FOUND for name in _inputs(each)}
    for given in ({}, {"a": 0}, {"a": 0, "b": 0}):
        inputs = {name: lift(Fraction(given.get(name, 3 + 2 * k), 7)) for k, name in enumerate(sorted(names))}
        wanted = evaluate(FOUND, inputs, lift=lift)
        assert [each.terms for each in Evaluation(FOUND).run(inputs, lift)] == [each.terms for each in wanted]


def test_evaluation_goes_on_in_another_ring() -> None:
    a = Parameter("a", SCALAR).symbols()
    chosen = (select(a < 1, sqrt(a) - a, a), a - a)
    evaluation, values = Evaluation(chosen), list[Any]()
    with pytest.raises(InexactError):
        evaluation.run({"a": Fraction(1, 2)}, values=values)
    found = evaluation.run({"a": Decimal(1) / 2}, to_decimal, convert(values, to_decimal))
    assert found[0].scalar == (Decimal(1) / 2).sqrt() - Decimal(1) / 2 and not found[1].scalar


def _inputs(expression: Expression) -> set[str]:
    own = (
        set(expression.data.components)
        if not expression.arguments and hasattr(expression.data, "components")
        else set()
    )
    return own.union(*map(_inputs, expression.arguments))
