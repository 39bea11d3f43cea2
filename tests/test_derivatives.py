"""Derivative kernels equal derivatives that share no code with them: polynomials in a step, or numeric limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from random import Random
from typing import Any

import mpmath
import pytest

from gacompiler import (
    SCALAR,
    absolute,
    acos,
    atan2,
    cos,
    dual,
    exp,
    inverse,
    jacobian,
    jvp,
    kernel,
    log,
    matrix_of,
    maximum,
    minimum,
    norm,
    norm_squared,
    normalize,
    sandwich,
    scalar_product,
    select,
    sin,
    sqrt,
    vjp,
)
from gacompiler.algebra.catalog import CGA3, PGA3, STA, VGA3, null_pairs, orthogonal
from gacompiler.algebra.layout import Layout
from gacompiler.errors import KernelError
from gacompiler.frontend.expression import evaluate
from gacompiler.frontend.kernel import Kernel, trace
from gacompiler.ir.interpret import interpret
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.samples import sample, to_mpmath
from gacompiler.rings.polynomial import PolynomialRing

NULL2 = null_pairs(2)


def declare(function: Callable[..., Any], parameters: Mapping[str, Layout]) -> Kernel:
    names = list(parameters)
    namespace: dict[str, Any] = {"function": function}
    exec(f"def wrapped({', '.join(names)}):\n    return function({', '.join(names)})", namespace)
    return kernel(**parameters)(namespace["wrapped"])


def numbers(definition: Kernel, layout: Layout, inputs: Mapping[str, Any]) -> list[Any]:
    """Stored coefficients of the author's definition, over the ring of the inputs."""
    (value,) = evaluate(trace(definition).expressions, inputs)
    return [slot.sign * value.terms.get(slot.blade, 0) for slot in layout.stored]


def exact_slope(definition: Kernel, layout: Layout, at: Mapping[str, Any], step: Mapping[str, Any]) -> list[Any]:
    """The derivative of a polynomial definition along `step`: the linear coefficient of a polynomial in ``t``."""
    ring = PolynomialRing()
    t = ring.variable("t")
    moved = {name: ring.constant(value) + ring.constant(step.get(name, 0)) * t for name, value in at.items()}
    return [ring.lift(value).terms.get((0,), 0) for value in numbers(definition, layout, moved)]


def run(definition: Kernel, inputs: Mapping[str, Any]) -> list[tuple[Any, ...]]:
    program = compile_kernel(definition).program
    return list(interpret(program, {a.name: [inputs[c] for c in a.components] for a in program.arguments}).values())


POLYNOMIAL: dict[str, tuple[Callable[..., Any], dict[str, Layout], str]] = {
    "move": (sandwich, {"m": PGA3.MOTOR, "p": PGA3.POINT}, "m"),
    "move by point": (sandwich, {"m": PGA3.MOTOR, "p": PGA3.POINT}, "p"),
    "boost": (sandwich, {"m": STA.ROTOR, "x": STA.VECTOR}, "m"),
    "reflect": (sandwich, {"n": VGA3.VECTOR, "x": VGA3.BIVECTOR}, "n"),
    "join": (lambda a, b: a & b, {"a": PGA3.POINT, "b": PGA3.POINT}, "b"),
    "null": (lambda a, b: a * b * a, {"a": NULL2.even, "b": NULL2.VECTOR}, "a"),
    "sphere": (lambda a, b: (a ^ b) * dual(a), {"a": CGA3.VECTOR, "b": CGA3.VECTOR}, "a"),
    "norm": (lambda a, b: norm_squared(a * b), {"a": STA.even, "b": STA.VECTOR}, "a"),
    "degenerate": (lambda a, b: a * b - b.grade(1) * ~a, {"a": PGA3.even, "b": PGA3.full}, "a"),
    "six": (lambda a, b: scalar_product(a * b, ~b), {"a": orthogonal(3, 3).even, "b": orthogonal(3, 3).even}, "a"),
}


@pytest.mark.parametrize("name", list(POLYNOMIAL))
def test_jacobian_is_exact(name: str) -> None:
    function, parameters, wrt = POLYNOMIAL[name]
    definition = declare(function, parameters)
    record, random = compile_kernel(definition), Random(8)
    assert record.decision is not None
    layout, by = record.decision.layouts[0], parameters[wrt]
    derived = jacobian(definition, wrt)
    for _ in range(2):
        at = sample(definition, random)
        value, matrix = run(derived, at)
        assert list(value) == numbers(definition, layout, at)
        parameter = next(p for p in definition.parameters if p.name == wrt)
        for column, component in enumerate(parameter.components):
            expected = exact_slope(definition, layout, at, {component: 1})
            assert list(matrix[column :: by.size]) == expected


@pytest.mark.parametrize("side", ["left", "right"])
def test_jacobian_on_the_manifold_of_motors(side: str) -> None:
    definition = declare(sandwich, {"m": PGA3.MOTOR, "p": PGA3.POINT})
    derived, at = jacobian(definition, "m", side), sample(definition, Random(3))
    motor = PGA3.MOTOR.element([at[name] for name in definition.parameters[0].components])
    _, matrix = run(derived, at)
    for column, blade in enumerate(PGA3.blades(2)):
        generator = PGA3.multivector({PGA3.spelling(blade)[1]: PGA3.spelling(blade)[0]})
        tangent = PGA3.MOTOR.coefficients(generator * motor if side == "left" else motor * generator)
        step = dict(zip(definition.parameters[0].components, tangent, strict=True))
        assert list(matrix[column::6]) == exact_slope(definition, PGA3.POINT, at, step)


@pytest.mark.parametrize("name", ["move", "boost", "join", "null"])
def test_products_with_the_jacobian(name: str) -> None:
    """``jvp`` is the Jacobian times the tangent and ``vjp`` the cotangent times the Jacobian, in every metric."""
    function, parameters, wrt = POLYNOMIAL[name]
    definition = declare(function, parameters)
    random = Random(5)
    at = sample(definition, random)
    value, matrix = run(jacobian(definition, wrt), at)
    n = len(value)
    rows = [matrix[k * len(matrix) // n : (k + 1) * len(matrix) // n] for k in range(n)]
    forward, backward = jvp(definition, wrt), vjp(definition, wrt)
    tangent = {name: Fraction(random.randint(1, 9), 7) for name in forward.parameters[-1].components}
    assert list(run(forward, at | tangent)[1]) == [
        sum(x * t for x, t in zip(row, tangent.values(), strict=True)) for row in rows
    ]
    cotangent = {name: Fraction(random.randint(1, 9), 5) for name in backward.parameters[-1].components}
    assert list(run(backward, at | cotangent)[1]) == [
        sum(w * row[k] for w, row in zip(cotangent.values(), rows, strict=True)) for k in range(len(rows[0]))
    ]


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sqrt": lambda x, y: sqrt(2 + x * y),
    "sin": lambda x, y: sin(x * y),
    "cos": lambda x, y: cos(x - y * y),
    "exp": lambda x, y: exp(x * y),
    "log": lambda x, y: log(1 + x * x + y),
    "acos": lambda x, y: acos(x * y / 8),
    "atan2": lambda x, y: atan2(x + 1, x * y),
    "quotient": lambda x, y: (x + y) / (x * x + y),
    "abs": lambda x, y: absolute(x - 3 * y) * y,
    "minimum": lambda x, y: minimum(x * x, y),
    "maximum": lambda x, y: maximum(x * x, y),
    "select": lambda x, y: select(x < y, x * y, x - y),
    "chain": lambda x, y: sqrt(1 + sin(x) * sin(x)) / exp(y),
}


@pytest.mark.parametrize("name", list(FUNCTIONS))
@pytest.mark.parametrize("wrt", ["x", "y"])
def test_functions_against_numeric_derivatives(name: str, wrt: str) -> None:
    definition = declare(FUNCTIONS[name], {"x": SCALAR, "y": SCALAR})
    derived = compile_kernel(jacobian(definition, wrt)).program
    with mpmath.workdps(50):
        for x, y in ((Fraction(3, 4), Fraction(1, 2)), (Fraction(1, 3), Fraction(7, 5))):
            at = {"x": to_mpmath(x), "y": to_mpmath(y)}

            def along(t: Any, at: dict[str, Any] = at) -> Any:
                return evaluate(trace(definition).expressions, {**at, wrt: t}, lift=to_mpmath)[0].scalar

            found = interpret(derived, {name: [value] for name, value in at.items()}, to_mpmath)
            assert mpmath.almosteq(
                list(found.values())[1][0], mpmath.diff(along, at[wrt]), rel_eps=mpmath.mpf(10) ** -25
            )


@pytest.mark.parametrize(
    "function", [norm, normalize, inverse, lambda a: norm(a * a + 1)], ids=["norm", "normalize", "inverse", "sum"]
)
def test_multivector_functions_against_numeric_derivatives(function: Callable[..., Any]) -> None:
    definition = declare(function, {"a": VGA3.EVEN})
    record = compile_kernel(jacobian(definition, "a"))
    assert record.decision is not None
    layout, names = record.decision.layouts[0], definition.parameters[0].components
    with mpmath.workdps(50):
        at = dict(zip(names, map(mpmath.mpf, ("0.7", "-0.2", "0.4", "1.1")), strict=True))
        matrix = list(interpret(record.program, {"a": list(at.values())}, to_mpmath).values())[1]
        for column, name in enumerate(names):
            for row, slot in enumerate(layout.stored):

                def along(t: Any, name: str = name, slot: Any = slot) -> Any:
                    (value,) = evaluate(trace(definition).expressions, {**at, name: t}, lift=to_mpmath)
                    return slot.sign * value.terms[slot.blade]

                assert mpmath.almosteq(
                    matrix[row * 4 + column], mpmath.diff(along, at[name]), rel_eps=mpmath.mpf(10) ** -20
                )


def test_matrix_of_a_linear_kernel() -> None:
    definition = declare(sandwich, {"r": VGA3.ROTOR, "v": VGA3.VECTOR})
    random = Random(2)
    at = sample(definition, random)
    (matrix,) = run(matrix_of(definition, "v"), {k: v for k, v in at.items() if k.startswith("r_")})
    vector = [at[name] for name in definition.parameters[1].components]
    expected = numbers(definition, VGA3.VECTOR, at)
    assert [sum(matrix[3 * k + j] * vector[j] for j in range(3)) for k in range(3)] == expected


def test_what_cannot_be_differentiated_says_so() -> None:
    definition = declare(sandwich, {"m": PGA3.MOTOR, "p": PGA3.POINT})
    with pytest.raises(KernelError, match="no parameter q; expected one of m p"):
        jacobian(definition, "q")
    with pytest.raises(KernelError, match="not linear in m"):
        compile_kernel(matrix_of(definition, "m"))
    with pytest.raises(KernelError, match="tangent 'up'"):
        jacobian(definition, "m", "up")
    with pytest.raises(KernelError, match="implied"):
        jacobian(declare(lambda a, b: a ^ b, {"a": CGA3.POINT, "b": CGA3.POINT}), "a")
    with pytest.raises(KernelError, match="several results"):
        jacobian(declare(lambda a: (a, a), {"a": VGA3.VECTOR}), "a")
