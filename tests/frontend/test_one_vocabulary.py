"""Twenty functions, written with methods and with functions, on exact, symbolic, numeric and compiled multivectors."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy

import gacompiler as ga
from gacompiler.algebra.catalog import PGA3, VGA3
from gacompiler.algebra.layout import Layout
from gacompiler.frontend.kernel import Kernel, Parameter
from gacompiler.gac_runtime.layout import coefficients
from gacompiler.objects import Space
from gacompiler.symbolic import multivector

ROTORS = (("3/5", "4/5", "0", "0"), ("12/13", "0", "-5/13", "0"))
"""Unit rotors with a positive scalar part, in the order of VGA3.ROTOR, and vectors, both with exact coefficients."""
VECTORS = (("1", "-2", "2"), ("2", "3", "6"))
PLANES = (("1", "2", "2", "3"), ("2", "-1", "2", "5"))
MOTORS = (("3/5", "4/5", "0", "0", "1/2", "1", "3/5", "4/5"), ("1", "0", "0", "0", "1/2", "1/3", "2", "0"))

Function = Callable[..., Any]
TABLE: dict[str, tuple[tuple[tuple[Layout, Any], ...], Function, Function]] = {}
V, R, M, P = (VGA3.VECTOR, VECTORS), (VGA3.ROTOR, ROTORS), (PGA3.MOTOR, MOTORS), (PGA3.PLANE, PLANES)


def case(name: str, operands: tuple[Any, ...], methods: Function, functions: Function) -> None:
    TABLE[name] = operands, methods, functions


case("turned", (R, V), lambda r, v: r.sandwich(v), lambda r, v: ga.sandwich(r, v))
case("moved", (M, P), lambda m, p: (m >> p).normalize(), lambda m, p: ga.normalize(ga.sandwich(m, p)))
case("meet", (P, P), lambda p, q: p.meet(q).norm(), lambda p, q: ga.norm(ga.meet(p, q)))
case("join", (M, P), lambda m, p: m.grade(2).join(p.dual()), lambda m, p: ga.join(ga.grade(m, 2), ga.dual(p)))
case("duals", (P,), lambda p: p.dual().undual() + 2 * p, lambda p: ga.undual(ga.dual(p)) + 2 * p)
case("projected", (V, V), lambda v, w: (v | w) / w, lambda v, w: ga.inner_product(v, w) * ga.inverse(w))
case("rejected", (V, V), lambda v, w: (v ^ w) / w, lambda v, w: ga.outer_product(v, w) * ga.inverse(w))
case(
    "reflected",
    (V, V),
    lambda v, w: v.sandwich(w) / v.norm_squared(),
    lambda v, w: ga.sandwich(v, w) / ga.norm_squared(v),
)
case("quotient", (V,), lambda v: 2 / v, lambda v: 2 * ga.inverse(v))
case("powers", (R,), lambda r: r**3 + r**-1, lambda r: r * r * r + ga.inverse(r))
case("half", (R,), lambda r: r**0.5, lambda r: ga.sqrt(r))
case("root", (R,), lambda r: r.sqrt().even_part(), lambda r: ga.even_part(ga.power(r, 0.5)))
case("log", (R,), lambda r: r.log() / 2, lambda r: ga.log(r) / 2)
case("exp", (V,), lambda v: v.dual().exp(), lambda v: ga.exp(ga.dual(v)))
case("waves", (V,), lambda v: (v / 9).dual().sin() + (v / 9).cos() * (v / 9).tanh(),
     lambda v: ga.sin(ga.dual(v / 9)) + ga.cos(v / 9) * ga.sinh(v / 9) / ga.cosh(v / 9))  # fmt: skip
case("between", (R, R), lambda r, s: r * (r.reverse() * s).power(0.5), lambda r, s: ga.interpolate(r, s, 0.5))
case("parts", (R, V), lambda r, v: (r + v).odd_part() - (r + v).even_part(),
     lambda r, v: ga.odd_part(r + v) - ga.even_part(r + v))  # fmt: skip
case(
    "outer",
    (M,),
    lambda m: m.grade(2).outer_exp(),
    lambda m: ga.outer_sin(ga.grade(m, 2)) + ga.outer_cos(ga.grade(m, 2)),
)
case("coefficients", (R, V), lambda r, v: r.e12 * v.e3 + v["e1"] + r.scalar,
     lambda r, v: ga.coefficient(r, "e12") * ga.coefficient(v, "e3") + v["e1"] + ga.coefficient(r, "1"))  # fmt: skip
case("contractions", (R, V), lambda r, v: r.right_contraction(v) + v.left_contraction(r) + v.commutator(r),
     lambda r, v: ga.right_contraction(r, v) + ga.left_contraction(v, r) + ga.commutator(v, r))  # fmt: skip
case("involutions", (M,), lambda m: ~m + m.grade_involution() + 3 * m.clifford_conjugate(),
     lambda m: ga.reverse(m) + ga.grade_involution(m) + 3 * ga.clifford_conjugate(m))  # fmt: skip
case("sum", (V, V), lambda v, w: sum([v, w, v]) / 3, lambda v, w: (v + v + w) / 3)


def numbers(value: Any, names: tuple[str, ...]) -> np.ndarray[Any, Any]:
    """The coefficients of a result of any type as doubles, the first of them in the last axis."""
    if isinstance(value, (int, float, Fraction, np.ndarray, sympy.Basic)):
        return np.stack([np.asarray(value, float) * (name == "1") for name in names], -1)
    return np.stack(np.broadcast_arrays(*(np.asarray(value[name], float) for name in names)), -1)


IRRATIONAL = ("meet", "half", "root", "log", "exp", "waves", "between")
"""Functions whose values are not rational, or whose rational root is found in another form."""

BACKENDS = {"turned": "c", "quotient": "numba"}
"""Backends other than the one that needs no compiler."""


@pytest.mark.parametrize("name", TABLE)
def test_one_text_runs_on_every_type_of_multivector(name: str) -> None:
    operands, *texts = TABLE[name]
    algebra = operands[0][0].algebra
    names = algebra.full.blades
    rows = [[rows[(k + i) % 2] for i, (_, rows) in enumerate(operands)] for k in range(2)]
    exact = [
        [layout.element(list(map(Fraction, row))) for (layout, _), row in zip(operands, each, strict=True)]
        for each in rows
    ]
    floats = [[x.map(float) for x in each] for each in exact]
    formulas = [
        [multivector(algebra, {n: sympy.Rational(x[n]) for n in names if x[n]}) for x in each] for each in exact
    ]
    arrays = [np.array([[float(Fraction(x)) for x in each[i]] for each in rows]) for i in range(len(operands))]
    objects = [Space(algebra).of(layout, array) for (layout, _), array in zip(operands, arrays, strict=True)]
    wanted = np.array([numbers(texts[1](*each), names) for each in floats])
    assert np.isfinite(wanted).all() and wanted.any()
    for text in texts:
        for given in (floats, formulas) if name in IRRATIONAL else (floats, exact, formulas):
            np.testing.assert_allclose([numbers(text(*each), names) for each in given], wanted, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(numbers(text(*objects), names), wanted, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(numbers(text(*(x[1] for x in objects)), names), wanted[1], rtol=1e-12, atol=1e-12)
        text.__name__ = f"{name}_of"
        kernel = Kernel(
            text.__name__, text, tuple(Parameter(f"x{k}", layout) for k, (layout, _) in enumerate(operands)), None, ""
        )
        run = ga.compile(kernel, backend=BACKENDS.get(name, "arrays"), effort=0)
        value = run(*arrays)
        found = coefficients(value, run.layouts["out"]) if value.ndim > 1 else {"1": value}
        np.testing.assert_allclose(numbers(defaultdict(float, found), names), wanted, rtol=1e-12, atol=1e-12)
