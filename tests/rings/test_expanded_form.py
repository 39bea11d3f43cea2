"""The sympy expressions of expanded elements have the form that sympy itself gives them, argument by argument."""

from __future__ import annotations

from fractions import Fraction
from random import Random
from typing import Any

import pytest
import sympy

from gacompiler.rings.symbolic import Expanded
from tests.support.all_cases import all_cases

X, Y, P = sympy.Symbol("x", real=True), sympy.Symbol("y"), sympy.Symbol("p", positive=True)
BASES = [X, Y, P, sympy.Symbol("_z9", integer=True), sympy.Function("f")(X, Y), sympy.sin(X), sympy.cosh(Y - P)]
OTHERS = [sympy.sqrt(2), sympy.I, sympy.pi, sympy.exp(X), sympy.Abs(Y), sympy.sqrt(P)]


def monomial(random: Random, bases: list[Any]) -> Any:
    powers = [base ** random.choice([1, 1, 2, 3, -1, -2]) for base in random.sample(bases, random.randint(0, 3))]
    return sympy.Mul(sympy.Rational(random.randint(-4, 4), random.randint(1, 3)), *powers)


def polynomial(random: Random, bases: list[Any]) -> Any:
    return sympy.Add(*(monomial(random, bases) for _ in range(random.randint(1, 5))))


@all_cases("seed", range(60))
def test_expressions_are_those_of_sympy(seed: int) -> None:
    random = Random(seed)
    bases = BASES if seed % 2 else BASES + OTHERS
    a, b = polynomial(random, bases), polynomial(random, bases)
    product = (Expanded.of(a) * Expanded.of(b) - Expanded.of(a)).expression
    assert sympy.srepr(product) == sympy.srepr(sympy.expand(a * b - a))


@all_cases("seed", range(40))
def test_reciprocals_have_the_sign_and_the_content_of_sympy(seed: int) -> None:
    """Multiples of a sum have the same denominator, which is primitive and has no minus sign to extract."""
    random = Random(100 + seed)
    symbols = [each for each in BASES if each.is_Symbol]
    weights = [random.choice([-6, -4, -1, 2, 3, Fraction(5, 2)]) for _ in symbols]
    total = sympy.Add(*(sympy.Rational(w.numerator, w.denominator) * s for w, s in zip(weights, symbols, strict=True)))
    content, primitive = total.as_content_primitive()
    if primitive.could_extract_minus_sign():
        content, primitive = -content, -primitive
    for factor in (1, -1, sympy.Rational(-2, 3)):
        assert (1 / Expanded.of(factor * total)).expression == 1 / (factor * content) / primitive


@all_cases("text", ["-sqrt(x) - 1", "-2*sqrt(2)*x - sqrt(2)", "-x - exp(y)", "-2*log(x) - 4*y", "1 - pi*x"])
def test_reciprocals_of_sums_with_roots_and_functions_keep_their_sign(text: str) -> None:
    value = sympy.sympify(text)
    product = Expanded.of(value).power(-1).expression * value
    at = {"x": 0.7, "y": 1.3}
    assert float(product.subs(at)) == pytest.approx(1, abs=1e-14)


@all_cases("seed", range(60))
def test_repeated_derivatives_of_unknown_functions_are_those_of_sympy(seed: int) -> None:
    """The order of the variables too: by name, then by assumptions, whatever order they were taken in."""
    random = Random(seed)
    symbols = [X, Y, P, *sympy.symbols("x1 x10 x2 T"), sympy.Symbol("x"), sympy.Symbol("y", real=True)]
    value = sympy.Function("f")(*random.sample(symbols, random.randint(1, 5)))
    found = Expanded.of(value)
    for _ in range(4):
        variable = random.choice([*value.args[:1][0].args, *symbols] if value.args else symbols)
        value, found = sympy.diff(value, variable), found.derivative(variable)
        assert sympy.srepr(found.expression) == sympy.srepr(value)


@all_cases("function", [sympy.sin, sympy.cos, sympy.sinh, sympy.cosh, sympy.tan, sympy.log, sympy.Function("f")])
def test_derivatives_of_functions_are_those_of_sympy(function: Any) -> None:
    """Of the variable, of other arguments, and of arguments that contain it twice."""
    for argument in ((X,), (2 * X,), (Y,), (X**2 + Y,)):
        expected = sympy.expand(sympy.diff(function(*argument), X))
        assert sympy.simplify(Expanded.of(function(*argument)).derivative(X).expression - expected) == 0
    twice = sympy.Function("g")(X, function(X))
    assert (Expanded.of(twice).derivative(X) - sympy.diff(twice, X)).is_zero
