"""Symbolic multivectors: arithmetic, printing, solving, relations, and conversion to kernels and back."""

from __future__ import annotations

import re
from copy import deepcopy
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
import sympy
from exact_elements import named

import gacompiler
from gacompiler import SCALAR, kernel, robots
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import CGA2, CGA3, PGA2, PGA3, STA, VGA2, VGA3, orthogonal
from gacompiler.algebra.multivector import Multivector
from gacompiler.errors import AlgebraError, KernelError, LayoutError, ZeroDivisorError
from gacompiler.ir.interpret import interpret
from gacompiler.objects import VGA3 as VGA3_OBJECTS
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.rings.symbolic import Expanded
from gacompiler.symbolic import (
    SymbolicMultivector,
    commutator,
    determinant,
    dual,
    equal,
    exp,
    from_kernel,
    grade,
    inverse,
    left_contraction,
    multivector,
    norm,
    norm_squared,
    normalize,
    outer_product,
    polarity,
    program_of,
    reduce,
    relations,
    sandwich,
    scalar_product,
    solve,
    symbols,
    to_kernel,
    undual,
    unknowns,
)
from tests.support.all_cases import all_cases

x, y, z, t = sympy.symbols("x y z t", real=True)
p, q = sympy.symbols("p q", positive=True)

# The ring


EXPRESSIONS = [
    sympy.Integer(0),
    sympy.Rational(2, 3),
    x + y,
    (x + y) ** 3 - x * (x - 2 * y),
    x / y + y / x,
    1 / (2 * x + 2 * y) + 3 / (x + y) ** 2,
    sympy.sqrt(2) * x + sympy.sqrt(2) ** 3,
    sympy.sqrt(x**2 + 1) * x,
    sympy.sqrt(p) * (sympy.sqrt(p) + q ** sympy.Rational(3, 2)),
    (x + 1) ** sympy.Rational(-3, 2),
    sympy.I * x + (1 + 2 * sympy.I) * y,
    sympy.exp(2 * x - y) + sympy.exp(-x),
    sympy.sin(x + y) * sympy.cos(x) ** 2,
    sympy.pi * x**2 + sympy.E,
    p**x * q ** (2 * y),
    sympy.log(p) / p,
    sympy.Function("f")(x).diff(x) * x,
    sympy.Piecewise((x, x > 0), (0, True)),
    -sympy.cbrt(5) / (x * y * sympy.sqrt(3)),
]


@all_cases("expression", EXPRESSIONS)
def test_the_ring_round_trips_expressions_of_sympy(expression: Any) -> None:
    back = Expanded.of(expression).expression
    assert sympy.simplify(back - expression) == 0
    assert (Expanded.of(expression) - expression).is_zero


@all_cases("expression", EXPRESSIONS)
def test_derivatives_of_the_ring_are_those_of_sympy(expression: Any) -> None:
    for variable in (x, p):
        found = Expanded.of(expression).derivative(variable)
        assert sympy.simplify(found.expression - sympy.diff(expression, variable)) == 0


def value(expression: Any) -> complex:
    f = sympy.Function("f")
    numbers = {x: 0.7, y: -1.3, z: 2.1, t: 0.4, p: 1.9, q: 0.6}
    return complex(sympy.N(expression.replace(f, sympy.cosh).doit().subs(numbers)))


def test_the_ring_computes_like_sympy() -> None:
    random = Random(3)
    for a in EXPRESSIONS:
        for b in random.sample(EXPRESSIONS, 2):
            mine = Expanded.of(a) * b
            assert value(mine.expression) == pytest.approx(value(a * b), rel=1e-12, abs=1e-12)
            assert value((Expanded.of(a) + b).expression) == pytest.approx(value(a + b), rel=1e-12, abs=1e-12)
            assert (mine - b * Expanded.of(a)).is_zero
            if b != 0:
                assert value((Expanded.of(a) / b).expression) == pytest.approx(value(a / b), rel=1e-12, abs=1e-12)


X = sympy.Symbol("x", positive=True)


@all_cases(
    "a, b, product",
    [
        (2 * sympy.sqrt(X), 3 * sympy.sqrt(X), 6 * X),
        (sympy.sqrt(2) * 2, sympy.sqrt(2) * 5, sympy.Integer(20)),
        (2 * sympy.I, 3 * sympy.I, sympy.Integer(-6)),
        (sympy.exp(X / 2), sympy.exp(X / 2), sympy.exp(X)),
        (2**X, 2**X, 2 ** (2 * X)),
        (3 * sympy.exp(X), sympy.exp(-X) / 2, sympy.Rational(3, 2)),
        (sympy.sqrt(1 + X) * 4, sympy.sqrt(1 + X) / 3, sympy.Rational(4, 3) * (1 + X)),
    ],
)
def test_powers_that_become_ordinary_keep_their_numbers(a: Any, b: Any, product: Any) -> None:
    assert (Expanded.of(a) * b - Expanded.of(product)).is_zero
    assert sympy.simplify((Expanded.of(a) * b).expression - product) == 0


def test_floats_are_short_fractions_or_kept() -> None:
    """2.5 is 5/2; 0.1 is not a fraction of a small power of two; quotients of floats divide."""
    assert Expanded.of(2.5).expression == sympy.Rational(5, 2)
    assert Expanded.of(-100.25).expression == sympy.Rational(-401, 4)
    assert isinstance(Expanded.of(0.1).expression, sympy.Float)
    x, y = sympy.symbols("x y")
    assert (Expanded.of(0.1 * x + 0.1 * y) / Expanded.of(3 * x + 3 * y)).terms == {(): 0.1 / 3}
    assert float((Expanded.of(0.3 * X) / Expanded.of(0.1 * X)).expression) == pytest.approx(3.0, rel=1e-15)
    assert float((Expanded.of(0.3) / 0.1).expression) == pytest.approx(3.0, rel=1e-15)


@all_cases("value", [sympy.oo, -sympy.oo, sympy.zoo, sympy.nan])
def test_infinite_numbers_are_rejected(value: Any) -> None:
    for each in (value, X + value):
        with pytest.raises(AlgebraError, match="expected a number or a sympy expression"):
            Expanded.of(each)


@all_cases(
    "zero",
    [
        (x + y) * (x - y) - x**2 + y**2,
        sympy.sqrt(2) * sympy.sqrt(2) - 2,
        sympy.sqrt(x**2 + 1) ** 2 - x**2 - 1,
        sympy.I**2 + 1,
        sympy.exp(x) * sympy.exp(-x) - 1,
        sympy.exp(x / 2) * sympy.exp(x / 3) * sympy.exp(x / 6) - sympy.exp(x),
        x / x - 1,
        sympy.sqrt(6) / sympy.sqrt(2) / sympy.sqrt(3) - 1,
    ],
)
def test_sums_that_cancel_are_zero_by_form(zero: Any) -> None:
    assert Expanded.of(zero).is_zero
    parts = sympy.Add.make_args(zero)
    total = Expanded({})
    for part in parts:
        product = Expanded({(): 1})
        for factor in sympy.Mul.make_args(part):
            product = product * factor
        total = total + product
    assert total.is_zero


def test_factors_that_meet_in_the_ring_cancel() -> None:
    root, base = Expanded.of(sympy.sqrt(x**2 + 1)), Expanded.of(x**2 + 1)
    assert (root * root - base).is_zero
    assert (root / base * root - 1).is_zero
    assert (Expanded.of(sympy.I) * sympy.I + 1).is_zero
    assert (Expanded.of(sympy.sqrt(2)) * sympy.sqrt(2) - 2).is_zero
    assert (Expanded.of(sympy.exp(x)) * sympy.exp(-x) - 1).is_zero
    assert (base / base - 1).is_zero
    with pytest.raises(ZeroDivisorError):
        base / (x - Expanded.of(x))


# Making


def test_symbols_by_layout() -> None:
    m = symbols("m", layout=PGA3.MOTOR)
    assert m.coefficients["e12"] == sympy.Symbol("m_e12", real=True)
    point = symbols("p", layout=PGA3.POINT)
    assert point["e123"] == 1
    conformal = symbols("c", layout=CGA3.POINT)
    assert (conformal * conformal) == 0
    assert conformal["einf"] == sum(conformal[e] ** 2 for e in ("e1", "e2", "e3")) / 2
    a, b = symbols("a, b", layout=VGA3.VECTOR)
    assert left_contraction(a, b) == scalar_product(b, a)
    assert symbols("s", positive=True).is_positive
    assert symbols("s", complex=True).is_real is None
    assert len(unknowns("u", STA, 2).terms) == 6


def test_multivectors_from_coefficients() -> None:
    assert multivector(VGA3, {"e1": x, "e21": y})["e12"] == -y
    assert multivector(PGA3.POINT, [x, y, z]) == multivector(PGA3, {"e032": x, "e013": y, "e021": z, "e123": 1})
    assert multivector(VGA3, VGA3.basis()[0]) == VGA3.basis()[0]
    assert multivector(VGA3, x)["1"] == x
    with pytest.raises(LayoutError, match="3 coefficients"):
        multivector(VGA3.VECTOR, 7)
    with pytest.raises(LayoutError, match="2 coefficients"):
        multivector(VGA3.VECTOR, [1, 2])
    with pytest.raises(LayoutError, match=r"MOTOR"):
        symbols("m", layout=PGA3)  # type: ignore[arg-type]
    for name in (" ", "x:3", "2a"):
        with pytest.raises(LayoutError, match="names"):
            symbols(name)


# Arithmetic

PRODUCTS = (
    "geometric_product", "outer_product", "left_contraction", "right_contraction", "inner_product", "hestenes_product",
    "scalar_product", "commutator", "anticommutator", "regressive_product",
)  # fmt: skip


@pytest.mark.parametrize("algebra", [VGA3, PGA3, CGA2, STA, orthogonal(2, 2)], ids=lambda algebra: algebra.name)
def test_operations_are_those_of_numbers(algebra: Algebra) -> None:
    """Every operation on symbols, then numbers put in, is the operation on numbers."""
    a, b = unknowns("a", algebra), unknowns("b", algebra)
    random = Random(5)
    numbers = {s: random.randint(-9, 9) for s in sorted(a.free_symbols | b.free_symbols, key=str)}
    u, v = (Multivector(algebra, {k: int(c) for k, c in each.subs(numbers).expressions.items()}) for each in (a, b))
    for name in PRODUCTS:
        derived = getattr(gacompiler.symbolic, name)(a, b)
        assert derived.subs(numbers) == getattr(gacompiler, name)(u, v)
    for name in ("reverse", "grade_involution", "clifford_conjugate", "dual", "undual", "norm_squared"):
        assert getattr(gacompiler.symbolic, name)(a).subs(numbers) == getattr(gacompiler, name)(u)
    assert (a + 2 * b - 3 * a / 4 + x).subs(numbers).subs(x, 5) == u + 2 * v - 3 * u / 4 + 5
    assert grade(a, 1, 2).subs(numbers) == u.grade(1, 2)
    assert (a**2).subs(numbers) == u * u
    assert (a & b).subs(numbers) == u & v


def test_operands_mix() -> None:
    a = symbols("a", layout=VGA3.VECTOR)
    e1 = VGA3.basis()[0]
    for mixed in (x * a, a * x):
        assert mixed["e2"] == x * a["e2"]
    assert (e1 * a)["1"] == a["e1"]
    assert (a * e1)["1"] == a["e1"]
    assert isinstance(e1 + a, SymbolicMultivector)
    assert isinstance(3 - a, SymbolicMultivector)
    assert (sympy.sqrt(2) - a)["1"] == sympy.sqrt(2)
    assert (np.float64(0.5) * a)["e1"] == a["e1"] / 2
    assert (0.3 * a)["e1"] == 0.3 * a["e1"]
    assert (a ^ 3) == 3 * a
    assert (2 ^ a) == 2 * a
    assert (x / norm(a))["1"] == x / sympy.sqrt(sum(a[e] ** 2 for e in ("e1", "e2", "e3")))
    assert a != "a"
    assert a != symbols("a", layout=VGA2.VECTOR)
    assert a == +a


@all_cases(
    "operation, message",
    [
        (lambda a: a * np.ones(3), "array of shape"),
        (lambda a: np.ones(3) * a, "array of shape"),
        (lambda a: a * [1, 2], "compile the formula"),
        (lambda a: a + "x", "make a symbol"),
        (lambda a: a * float("inf"), "a number or"),
        (lambda a: a * sympy.zoo, "a number or"),
        (lambda a: a * True, "0 or 1"),
        (lambda a: a + (x > 0), "a number or"),
        (lambda a: a * sympy.Matrix([1, 2]), "a number or"),
        (lambda a: a * sympy.Symbol("n", commutative=False), "a number or"),
        (lambda a: a < 1, "no order"),
        (lambda a: a + symbols("b", layout=PGA3.POINT), "algebras"),
        (lambda a: a ** "x", "exponent: 'x'"),
        (lambda a: dual(3), "at least one multivector"),
        (lambda a: gacompiler.symbolic.is_versor(3), "a multivector"),
        (lambda a: reduce(x), "a multivector"),
        (lambda a: a * VGA3_OBJECTS.vector(1, 2, 3), "to_kernel"),
        (lambda a: VGA3_OBJECTS.vector(1, 2, 3) * a, "to_kernel"),
        (lambda a: gacompiler.log(symbols("b", layout=VGA3.full)), "a scalar as its square"),
        (lambda a: a.subs("e1", 2), "a symbol"),
    ],
)
def test_invalid_operations_are_rejected(operation: Any, message: str) -> None:
    with pytest.raises(AlgebraError, match=message):
        operation(symbols("a", layout=VGA3.VECTOR))


def test_a_multivector_is_no_sequence_and_no_expression() -> None:
    a = symbols("a", layout=VGA3.VECTOR)
    with pytest.raises(TypeError, match="iter"):
        list(a)
    with pytest.raises(sympy.SympifyError, match=r"x\.map"):
        sympy.simplify(a)
    assert {a: 1, a * a: 2}[symbols("a", layout=VGA3.VECTOR)] == 1
    assert deepcopy(a) == a


def test_division_by_zero_is_refused() -> None:
    a = symbols("a", layout=VGA3.VECTOR)
    with pytest.raises(ZeroDivisorError):
        a / 0
    with pytest.raises(ZeroDivisorError):
        inverse(a - a)
    with pytest.raises(AlgebraError, match="degenerate"):
        polarity(symbols("m", layout=PGA3.MOTOR))


@pytest.mark.parametrize("algebra", [VGA2, VGA3, orthogonal(1, 1)], ids=lambda algebra: algebra.name)
def test_inverse_of_a_general_element(algebra: Algebra) -> None:
    a = unknowns("a", algebra)
    assert equal(a * inverse(a), 1) is True
    assert equal(inverse(a) * a, 1) is True
    assert set(determinant(a).terms) == {0}


def test_duals_are_inverse() -> None:
    a = unknowns("a", PGA3)
    assert undual(dual(a)) == a


# Exponentials, checked by their differential equation and by series


@pytest.mark.parametrize(
    "generator",
    [
        multivector(VGA3, {"e12": x, "e23": y}),
        multivector(PGA3, {"e01": x, "e02": 3}),
        multivector(PGA3, {"e12": x, "e03": y}),
        multivector(STA, {"g10": x}),
        multivector(CGA2, {"e1": 1}) ^ multivector(CGA2, {"einf": x}),
        multivector(VGA2, {"1": y, "e12": x}),
        multivector(VGA2, {"e1": 1}),
    ],
    ids=str,
)
def test_exponential(generator: SymbolicMultivector) -> None:
    path = exp(t * generator)
    assert reduce(path.diff(t) - generator * path).simplify() == 0
    assert path.map(lambda c: sympy.limit(c, t, 0)) == 1
    series = path.series(t, 0, 4)
    power, total = multivector(generator.algebra, 1), multivector(generator.algebra, 0)
    for k in range(4):
        total, power = total + power / sympy.factorial(k), power * generator * t
    assert (series - total).simplify() == 0


def test_exponential_of_a_general_screw() -> None:
    b = unknowns("B", PGA3, 2)
    path = exp(t * b)
    assert equal(path * ~path, 1) is True
    assert reduce(path.diff(t) - b * path) == 0
    with pytest.raises(AlgebraError, match="commuting blades"):
        exp(unknowns("B", orthogonal(4), 2))


def test_rotor_in_its_usual_form() -> None:
    theta = symbols("theta")
    rotor = exp(-theta / 2 * multivector(VGA3, {"e12": 1}))
    assert rotor == multivector(VGA3, {"1": sympy.cos(theta / 2), "e12": -sympy.sin(theta / 2)})
    turned = sandwich(rotor, VGA3.basis()[0]).simplify()
    assert turned == multivector(VGA3, {"e1": sympy.cos(theta), "e2": sympy.sin(theta)})


# Forms of coefficients


def test_changes_of_form_keep_the_value() -> None:
    a = multivector(VGA2, {"1": x**2 - y**2, "e1": x**2 + 2 * x * y + y**2})
    assert a.factor()["e1"] == (x + y) ** 2
    assert a.factor() == a
    assert a.factor().expand()["e1"] == x**2 + 2 * x * y + y**2
    assert multivector(VGA2, {"e1": x * y + x}).collect(x)["e1"] == x * (y + 1)
    assert multivector(VGA2, {"e1": sympy.sin(x) ** 2 + sympy.cos(x) ** 2}).simplify()["e1"] == 1
    angles = multivector(
        VGA2, {"e1": sympy.sin(x) * sympy.cos(y) + sympy.cos(x) * sympy.sin(y), "e2": sympy.sin(x) ** 2}
    )
    assert angles.combine_angles()["e1"] == sympy.sin(x + y)
    assert angles.combine_angles()["e2"] == sympy.Rational(1, 2) - sympy.cos(2 * x) / 2
    assert multivector(VGA2, {"e1": sympy.pi}).numeric(5)["e1"] == pytest.approx(3.1416, abs=1e-4)
    assert multivector(VGA2, {"e1": sympy.sin(x)}).series(x, 0, 4)["e1"] == x - x**3 / 6
    assert multivector(VGA2, {"e1": x * y}).diff(x, y)["e1"] == 1
    assert multivector(VGA2, {"e1": x}).integrate((x, 0, 2))["e1"] == 2
    assert multivector(VGA2, {"e1": sympy.sin(x) ** 2 + sympy.cos(x) ** 2 - 1}).simplify() == 0


def test_substitution() -> None:
    a, b = symbols("a b", layout=VGA3.VECTOR)
    product = a * b
    assert product.subs({a: b, b: a}) == b * a
    assert product.subs(b, a) == norm_squared(a)
    assert product.subs(a, VGA3.basis()[0])["1"] == b["e1"]
    assert product.subs({a["e1"]: 0, a["e2"]: x})["1"] == x * b["e2"] + a["e3"] * b["e3"]
    with pytest.raises(LayoutError, match="e12"):
        product.subs(a, multivector(VGA3, {"e12": 1}))
    with pytest.raises(ZeroDivisorError):
        inverse(a).subs(a, 0 * a)
    with pytest.raises(AlgebraError, match="e1"):
        a.subs({"e1": 2})


# Printing


def test_text() -> None:
    a, b = symbols("a b", layout=VGA2.VECTOR)
    assert repr(a * b) == "VGA2: a_e1*b_e1 + a_e2*b_e2 + (a_e1*b_e2 - a_e2*b_e1)*e12"
    assert str(a * 0) == "0"
    assert str(multivector(VGA2, {"e1": 1, "e2": -1})) == "e1 - e2"
    assert str((a * b).by_grade()).splitlines() == ["a_e1*b_e1 + a_e2*b_e2", "(a_e1*b_e2 - a_e2*b_e1)*e12"]
    assert str(a.by_blade()).splitlines() == ["a_e1*e1", "a_e2*e2"]
    assert str(multivector(VGA2, {"e1": x**2 - x * y, "e2": x * y - y**2}).factored()) == "(x - y)*(x*e1 + y*e2)"
    assert str(multivector(PGA3, {"e032": x})) == "x*e032"
    assert repr(multivector(VGA2, {"e1": 6 * x, "e2": 4}).factored()) == "VGA2: 2*(3*x*e1 + 2*e2)"


def test_latex() -> None:
    m = symbols("m", layout=PGA3.MOTOR)
    theta = symbols("theta")
    assert (theta * m).grade(0)._repr_latex_() == r"$m_{1} \theta$"
    assert m.grade(4)._repr_latex_() == r"$m_{e_{0123}}\,e_{0123}$"
    assert (m - m)._repr_latex_() == "$0$"
    lines = (multivector(VGA2, {"1": x, "e1": -1, "e12": x + 1})).by_grade()._repr_latex_().splitlines()
    assert lines[1:-1] == [r"& x \\", r"& -e_{1} \\", r"& +\left(x + 1\right)e_{12}"]
    assert (x * multivector(VGA2, {"e1": 1, "e2": y})).factored()._repr_latex_() == (
        r"$x\,\left(e_{1} + y\,e_{2}\right)$"
    )


# Equations


def test_linear_equations_for_multivectors() -> None:
    a, b = symbols("a b", layout=VGA3.VECTOR)
    u = unknowns("x", VGA3)
    (found,) = solve(a * u - b, u)
    assert equal(found, inverse(a) * b) is True
    rotor = unknowns("R", VGA2, 0, 2)
    e1, e2 = VGA2.basis()
    (turn,) = solve([rotor * e1 - e2 * rotor, rotor["1"] - 1], rotor)
    assert turn * e1 == e2 * turn


def test_equations_for_scalars() -> None:
    a, b = symbols("a b", layout=VGA3.VECTOR)
    s = symbols("s")
    (found,) = solve(scalar_product(a, b - s * a), s)
    assert sympy.simplify(found[s] - (scalar_product(a, b) / norm_squared(a))["1"]) == 0
    assert solve(multivector(VGA3, {"e1": 1}), s) == []
    meeting = solve([multivector(VGA2, {"e1": x + y - 3, "e2": x - y - 1})], [x, y])
    assert meeting == [{x: 2, y: 1}]
    with pytest.raises(AlgebraError, match="unknown"):
        solve(a * b, a * b)


def test_roots_of_equations_with_relations() -> None:
    r = symbols("R", layout=VGA2.ROTOR)
    e1, e2 = VGA2.basis()
    found = solve([r * e1 * ~r - e2, *relations(r)], r)
    assert len(found) == 2  # a rotor and its negative
    assert found[0] == -found[1]


# Relations


@pytest.mark.parametrize("layout", [VGA3.ROTOR, PGA2.MOTOR, PGA3.MOTOR, CGA2.UNIT_EVEN], ids=str)
def test_unit_versors_keep_products(layout: Any) -> None:
    m = symbols("m", layout=layout)
    a, b = unknowns("a", layout.algebra, 1), unknowns("b", layout.algebra, 1)
    moved = sandwich(m, a) * sandwich(m, b)
    assert moved != sandwich(m, a * b)
    assert equal(sandwich(m, scalar_product(a, b)), scalar_product(a, b), m) is True
    assert equal(m * ~m, 1, m) is True
    assert equal(m * ~m, 1) is not True
    assert equal(m * m, 1, m) is False


def test_normal_form_drops_what_vanishes() -> None:
    m, point = symbols("m", layout=PGA3.MOTOR), symbols("p", layout=PGA3.POINT)
    moved = reduce(m * point * ~m, m)
    assert moved["e123"] == 1
    assert set(moved.grades) == {3}
    assert equal(m * point * ~m, moved, m) is True
    assert reduce(multivector(VGA2, {"e1": sympy.cosh(x) ** 2 - sympy.sinh(x) ** 2}))["e1"] == 1
    assert reduce(multivector(VGA2, {"e1": x / sympy.sqrt(x**2 + 1) * sympy.sqrt(x**2 + 1) ** 3 - x**3}))["e1"] == x
    assert reduce(multivector(VGA2, {"e1": (x**2 + y**2) / (x**2 + y**2) ** 2 * x}))["e1"] == x / (x**2 + y**2)


def test_normal_form_keeps_the_value() -> None:
    random = Random(8)
    parts = [
        sympy.sqrt(sympy.sin(p)), sympy.sin(p), sympy.cos(p) ** 2, sympy.cos(p), 1 / (p + q), p + q, sympy.sqrt(p * q),
        sympy.sqrt(p**2 + q), (p**2 + q) ** -2, sympy.exp(-p / 2), sympy.exp(p), sympy.cosh(q), sympy.sinh(q) ** 2,
        sympy.sqrt(3), 1 / p, sympy.sin(-p) ** 3, sympy.sqrt(sympy.cos(p)), sympy.tan(p),
    ]  # fmt: skip
    for _ in range(25):
        chosen = [sympy.Mul(*random.sample(parts, random.randint(1, 4))) for _ in range(3)]
        formula = chosen[0] + 2 * chosen[1] - chosen[2] / 3
        mine = reduce(multivector(VGA2, {"e1": formula}))["e1"]
        numbers = {p: 0.71, q: 1.37}
        assert float(mine.subs(numbers)) == pytest.approx(float(formula.subs(numbers)), rel=1e-11)


def test_given_expressions_are_zero() -> None:
    a = multivector(VGA2, {"e1": x * y, "e2": x})
    assert equal(a, multivector(VGA2, {"e1": 1, "e2": x}), x * y - 1) is True
    assert equal(a, 0, x) is True
    assert equal(a, a + 1, x - y) is not True
    assert equal(normalize(symbols("a", layout=VGA3.VECTOR)) ** 2, 1) is True
    with pytest.raises(AlgebraError, match="at least one multivector"):
        equal(1, 1)


# Kernels


def test_a_derived_formula_is_a_kernel_with_the_structure_of_its_derivation() -> None:
    m, point = symbols("m", layout=PGA3.MOTOR), symbols("p", layout=PGA3.POINT)
    move = to_kernel(m * point * ~m, m, point, name="move")
    program = program_of(move)
    assert program.cost == "21 mul, 18 add"
    assert equal(program.substituted()[0], m * point * ~m, m) is True
    assert len(program.temporaries) == 39
    assert "\\begin{align*}" in program._repr_latex_()
    assert str(program.temporaries[0][0]) == "t0"
    assert str(program).endswith("18 add")


def test_compiled_in_one_line() -> None:
    m, point = symbols("m", layout=PGA3.MOTOR), symbols("p", layout=PGA3.POINT)
    move = gacompiler.compile(to_kernel(sandwich(m, point), m, point, name="move"), backend="arrays")
    half = np.sqrt(0.5)
    motor = np.array([half, -half, 0, 0, 0, 0, 0, 0])  # a quarter turn about e12 takes x to y
    assert np.allclose(move(motor, np.array([[1.0, 0, 0], [0, 0, 2]])), [[0, 1, 0], [0, 0, 2]], atol=1e-15)


@pytest.mark.slow
def test_functions_of_formulas_reach_the_kernel() -> None:
    """Every function that is translated, against numpy."""
    s, u = symbols("s u")
    cases = {
        sympy.sin(s) / sympy.cos(u): np.sin(0.3) / np.cos(0.8),
        sympy.tan(s) + sympy.tanh(u): np.tan(0.3) + np.tanh(0.8),
        sympy.exp(-(s**2)) * sympy.log(u): np.exp(-0.09) * np.log(0.8),
        sympy.asin(s) + sympy.acos(u) * sympy.atan(s): np.arcsin(0.3) + np.arccos(0.8) * np.arctan(0.3),
        sympy.atan2(s, u) + sympy.pi: np.arctan2(0.3, 0.8) + np.pi,
        sympy.sinh(s) - sympy.cosh(u): np.sinh(0.3) - np.cosh(0.8),
        sympy.Abs(s - u) + sympy.Max(s, u, 2) * sympy.Min(s, u): 0.5 + 2 * 0.3,
        (s + u) ** sympy.Rational(3, 2) / sympy.sqrt(s): 1.1**1.5 / np.sqrt(0.3),
        (s**2 + 1) ** -2 * u**s: 0.8**0.3 / 1.09**2,
        sympy.Piecewise((s, s > u), (u**2, s <= 0), (sympy.E, True)): np.e,
    }
    for case, expected in cases.items():
        program = compile_kernel(to_kernel(case, s, u, name="function")).program
        ((found,),) = interpret(program, {"s": [0.3], "u": [0.8]}, float).values()
        assert found == pytest.approx(expected, rel=1e-14), case


def test_several_results_and_changed_coefficients() -> None:
    a, b = symbols("a b", layout=VGA3.VECTOR)
    s = symbols("s")
    both = to_kernel([a * b, (s * a).simplify(), s**2, a - a, VGA3.basis()[1]], a, b, s, name="both")
    f = gacompiler.compile(both, backend="arrays")
    product, scaled, square, nothing, constant = f(np.array([1.0, 2, 3]), np.array([0.0, 1, 0]), 2.0)
    assert np.allclose(product, [2, 1, 0, -3])
    assert np.allclose(scaled, [2, 4, 6])
    assert square == 4
    assert np.all(nothing == 0)
    assert constant.tolist() == [1]


def test_kernels_reject_formulas_that_do_not_fit() -> None:
    a, b = symbols("a b", layout=VGA3.VECTOR)
    s = symbols("s")
    with pytest.raises(KernelError, match="b_e1"):
        to_kernel(a * b, a)
    with pytest.raises(KernelError, match="made by symbols"):
        to_kernel(a * b, a * b)
    with pytest.raises(KernelError, match="two arguments"):
        to_kernel(a * a, a, a)
    with pytest.raises(KernelError, match="lambda"):
        to_kernel(sympy.Symbol("lambda"), sympy.Symbol("lambda"))
    with pytest.raises(KernelError, match="my kernel"):
        to_kernel(a * a, a, name="my kernel")
    with pytest.raises(KernelError, match="to_kernel"):
        from_kernel(a * a)
    with pytest.raises(KernelError, match="to_kernel"):
        program_of(a * a)
    with pytest.raises(KernelError, match="gamma"):
        program_of(to_kernel(sympy.gamma(s), s))
    with pytest.raises(KernelError, match="Rational"):
        program_of(to_kernel((sympy.Float(0.3) * a).simplify(), a))
    with pytest.raises(AlgebraError, match="to_kernel"):
        kernel(v=VGA3.VECTOR)(named(lambda v: a * v)).function(
            gacompiler.frontend.kernel.Parameter("v", VGA3.VECTOR).symbols()
        )


def test_a_kernel_is_converted_to_a_formula() -> None:
    @kernel(m=PGA3.MOTOR, p=PGA3.POINT)
    def move(m: Any, p: Any) -> Any:
        return gacompiler.sandwich(m, p)

    m, point = symbols("m", layout=PGA3.MOTOR), symbols("p", layout=PGA3.POINT)
    assert from_kernel(move) == m * point * ~m

    @kernel(a=VGA3.VECTOR, s=SCALAR)
    def two(a: Any, s: Any) -> Any:
        return gacompiler.norm(a) * 2, s * a

    length, scaled = from_kernel(two)
    a = symbols("a", layout=VGA3.VECTOR)
    assert length == 2 * norm(a)
    assert scaled == symbols("s") * a


def test_kernels_take_symbolic_multivectors() -> None:
    @kernel(a=VGA3.VECTOR, b=VGA3.VECTOR)
    def area(a: Any, b: Any) -> Any:
        return a ^ b

    a, b = symbols("a b", layout=VGA3.VECTOR)
    assert area(a, b) == outer_product(a, b)
    assert area(a, a) == 0
    assert commutator(a, b) == area(a, b)


@pytest.mark.slow
def test_blocks_of_the_page_on_derivation_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Execute the blocks in one namespace, from top to bottom, including their assertions; without a C compiler."""
    monkeypatch.setenv("GAC_BACKEND", "arrays")
    page = Path(__file__).parents[2] / "docs" / "derivation.md"
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)
    assert len(blocks) >= 6
    exec(compile("\n".join(blocks), str(page), "exec"), {"__name__": "derivation"})


def test_an_arm_of_two_links() -> None:
    """The textbook's formula, from motors; and as the compiler's own functions on symbols have it."""
    q1, q2, a1, a2 = symbols("q1 q2 a1 a2")
    axis = multivector(PGA3, {"e12": 1})
    motor = exp(-q1 / 2 * axis) * exp(-q2 / 2 * (axis - a1 * multivector(PGA3, {"e02": 1})))
    end = (motor * multivector(PGA3.POINT, [a1 + a2, 0, 0]) * ~motor).combine_angles()
    assert end["e032"] == a1 * sympy.cos(q1) + a2 * sympy.cos(q1 + q2)
    assert end["e013"] == a1 * sympy.sin(q1) + a2 * sympy.sin(q1 + q2)
    rows = multivector(PGA3, robots.row_motor(q1, a=a1) * robots.row_motor(q2, a=a2))
    again = rows * multivector(PGA3.POINT, [0, 0, 0]) * ~rows
    assert equal(again.combine_angles(), end) is True
