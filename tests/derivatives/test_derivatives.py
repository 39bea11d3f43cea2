"""Derivative kernels against independent derivatives: polynomials in a step, or numerical limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from random import Random
from typing import Any

import mpmath
import numpy as np
import pytest
from selection import some_slow

import gacompiler
from gacompiler import (
    SCALAR,
    absolute,
    acos,
    atan2,
    cos,
    determinant,
    dual,
    exp,
    floor,
    hessian_vector,
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
from gacompiler.passes.record import Compilation
from gacompiler.passes.samples import sample, to_mpmath
from gacompiler.rings.polynomial import PolynomialRing
from tests.support.all_cases import all_cases

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


def compiled(definition: Kernel) -> Compilation:
    """The kernel, compiled and proved without a search for cheaper forms, which other tests compare."""
    return compile_kernel(definition, forms=False, effort=0)


def run(definition: Kernel, inputs: Mapping[str, Any]) -> list[tuple[Any, ...]]:
    program = compiled(definition).program
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


@pytest.mark.parametrize("name", some_slow(POLYNOMIAL, "six", "boost", "null", "move by point"))
def test_jacobian_is_exact(name: str) -> None:
    function, parameters, wrt = POLYNOMIAL[name]
    definition = declare(function, parameters)
    record, random = compiled(definition), Random(8)
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


@pytest.mark.parametrize("name", some_slow(["move", "boost", "join", "null"], "boost", "null"))
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
    "floor": lambda x, y: (x + 5 * y - floor(x + 5 * y)) * y + floor(x * 9),
    "select": lambda x, y: select(x < y, x * y, x - y),
    "chain": lambda x, y: sqrt(1 + sin(x) * sin(x)) / exp(y),
}


@all_cases("name", list(FUNCTIONS))
@all_cases("wrt", ["x", "y"])
def test_functions_against_numeric_derivatives(name: str, wrt: str) -> None:
    definition = declare(FUNCTIONS[name], {"x": SCALAR, "y": SCALAR})
    derived = compiled(jacobian(definition, wrt)).program
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
    record = compiled(jacobian(definition, "a"))
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


def test_errors_of_kernels_without_a_derivative() -> None:
    definition = declare(sandwich, {"m": PGA3.MOTOR, "p": PGA3.POINT})
    with pytest.raises(KernelError, match="no parameter q; expected one of m p"):
        jacobian(definition, "q")
    with pytest.raises(KernelError, match="not linear in m"):
        compiled(matrix_of(definition, "m"))
    with pytest.raises(KernelError, match="tangent 'up'"):
        jacobian(definition, "m", "up")
    with pytest.raises(KernelError, match="implied"):
        jacobian(declare(lambda a, b: a ^ b, {"a": CGA3.POINT, "b": CGA3.POINT}), "a")
    with pytest.raises(KernelError, match="several results"):
        jacobian(declare(lambda a: (a, a), {"a": VGA3.VECTOR}), "a")


def test_a_derivative_that_is_a_number_remains_a_multivector() -> None:
    """The derivative of ``s s + e12`` with respect to s is the number 2 s, which remains a multivector."""
    e12 = VGA3.multivector({"e12": 1})
    for taken, expected in (
        (lambda s: (s * s + e12)["1"], 6),
        (lambda s: (s * s + e12).grade(0), 6),
        (lambda s: dual(s * s + e12)["e123"], 6),
        (lambda s: ((s * s + e12) & (s * 0 + 1))["1"], 0),
    ):
        definition = declare(taken, {"s": SCALAR})
        *_, slope = run(jvp(definition, "s"), {"s": 3, "s_tangent": 1})
        assert [abs(x) for x in slope] == [expected]


SECOND: dict[str, tuple[Callable[..., Any], dict[str, Layout], str]] = {
    "join": (lambda m, p, q: norm_squared(sandwich(m, p) & q), {"m": PGA3.MOTOR, "p": PGA3.POINT, "q": PGA3.LINE}, "m"),
    "interval": (
        lambda m, x, y: norm_squared(sandwich(m, x) - y),
        {"m": STA.ROTOR, "x": STA.VECTOR, "y": STA.VECTOR},
        "m",
    ),
    "sphere": (lambda a, b: scalar_product(a ^ b, b ^ a) * a["e0"], {"a": CGA3.VECTOR, "b": CGA3.VECTOR}, "a"),
    "null": (lambda a, b: scalar_product(a * b * a, ~b), {"a": NULL2.even, "b": NULL2.VECTOR}, "a"),
    "determinant": (lambda a: determinant(a), {"a": STA.even}, "a"),
    "degenerate determinant": (lambda a: determinant(a), {"a": PGA3.EVEN}, "a"),
    "scalar": (lambda x, a: x * x * x * norm_squared(a) + x, {"x": SCALAR, "a": VGA3.VECTOR}, "x"),
    "linear": (lambda a, b: scalar_product(a, b), {"a": VGA3.VECTOR, "b": VGA3.VECTOR}, "a"),
    "motor": (sandwich, {"m": PGA3.MOTOR, "p": PGA3.POINT}, "m"),
    "boost": (sandwich, {"m": STA.ROTOR, "x": STA.VECTOR}, "m"),
    "vectors": (lambda a, b: a * b * a, {"a": CGA3.DUAL_PLANE, "b": CGA3.VECTOR}, "a"),
}


def exact_second(
    definition: Kernel, layout: Layout, at: Mapping[str, Any], one: Mapping[str, Any], other: Mapping[str, Any]
) -> list[Any]:
    """The second derivative of a polynomial definition along two steps: the coefficient of ``s t``."""
    ring = PolynomialRing()
    s, t = ring.variable("s"), ring.variable("t")
    moved = {
        name: ring.constant(value) + ring.constant(one.get(name, 0)) * s + ring.constant(other.get(name, 0)) * t
        for name, value in at.items()
    }
    return [ring.lift(value).terms.get((0, 1), 0) for value in numbers(definition, layout, moved)]


def weighted(weights: Sequence[Any], values: Sequence[Any]) -> Any:
    return sum(weight * value for weight, value in zip(weights, values, strict=True))


@pytest.mark.parametrize("name", some_slow(SECOND, "interval", "boost", "join", "sphere", "null", "motor"))
def test_hessian_times_vector_is_exact_and_symmetric(name: str) -> None:
    function, parameters, wrt = SECOND[name]
    definition, random = declare(function, parameters), Random(11)
    record = compiled(definition)
    assert record.decision is not None
    layout = record.decision.layouts[0]
    derived = hessian_vector(definition, wrt)
    further = derived.parameters[len(definition.parameters) :]
    assert [p.name for p in further] == [*([] if layout.is_scalar else ["cotangent"]), f"{wrt}_tangent"]
    own = next(p for p in definition.parameters if p.name == wrt).components
    at = sample(definition, random)
    cotangent = {} if layout.is_scalar else {c: Fraction(random.randint(-9, 9), 5) for c in further[0].components}
    weights = list(cotangent.values()) or [Fraction(1)]
    steps = [{c: Fraction(random.randint(-9, 9), 7) for c in own} for _ in range(2)]
    products = []
    program = compiled(derived).program
    for step in steps:
        inputs = at | cotangent | dict(zip(further[-1].components, step.values(), strict=True))
        arrays = {a.name: [inputs[c] for c in a.components] for a in program.arguments}
        value, gradient, product = interpret(program, arrays).values()
        assert list(value) == numbers(definition, layout, at)
        assert list(gradient) == [weighted(weights, exact_slope(definition, layout, at, {c: 1})) for c in own]
        expected = [weighted(weights, exact_second(definition, layout, at, {c: 1}, step)) for c in own]
        assert list(product) == expected
        products.append(product)
    u, v = (list(step.values()) for step in steps)
    assert weighted(u, products[1]) == weighted(v, products[0])


@pytest.mark.slow
def test_hessian_of_an_inverse_is_exact() -> None:
    """The second derivative of ``1/a`` along u and v is ``1/a u 1/a v 1/a`` and the same with u and v exchanged."""
    definition, random = declare(inverse, {"a": STA.EVEN}), Random(4)
    derived = hessian_vector(definition, "a")
    at = {c: Fraction(random.randint(-9, 9), 4) for p in derived.parameters for c in p.components}
    a, cotangent, tangent = (STA.EVEN.element([at[c] for c in p.components]) for p in derived.parameters)
    value, gradient, product = run(derived, at)
    b = inverse(a)
    assert list(value) == list(STA.EVEN.coefficients(b))
    weights = list(STA.EVEN.coefficients(cotangent))
    for k, blade in enumerate(STA.EVEN.stored):
        u = STA.multivector({blade.name: 1})
        assert gradient[k] == weighted(weights, list(STA.EVEN.coefficients(-(b * u * b))))
        second = b * u * b * tangent * b + b * tangent * b * u * b
        assert product[k] == weighted(weights, list(STA.EVEN.coefficients(second)))


@pytest.mark.parametrize("name", ["norm", "chain", "angle"])
def test_hessian_of_functions_against_numeric_derivatives(name: str) -> None:
    functions: dict[str, Callable[..., Any]] = {
        "norm": lambda a: norm(a),
        "chain": lambda a: exp(a["e1"] * a["e2"]) / sqrt(1 + sin(a["e3"]) * sin(a["e3"])),
        "angle": lambda a: atan2(a["e1"], a["e2"]) * log(norm_squared(a)),
    }
    definition = declare(functions[name], {"a": VGA3.VECTOR})
    program = compiled(hessian_vector(definition, "a")).program
    with mpmath.workdps(60):
        at, step = [mpmath.mpf(7) / 10, mpmath.mpf(4) / 3, mpmath.mpf(-1) / 5], [mpmath.mpf(k) for k in (2, -3, 5)]

        def value(*x: Any) -> Any:
            inputs = dict(zip(definition.parameters[0].components, x, strict=True))
            return evaluate(trace(definition).expressions, inputs, lift=to_mpmath)[0].scalar

        product = list(interpret(program, {"a": at, "a_tangent": step}, to_mpmath).values())[2]
        for k in range(3):
            orders = [tuple((j == k) + (j == other) for j in range(3)) for other in range(3)]
            expected = sum(t * mpmath.diff(value, at, n) for t, n in zip(step, orders, strict=True))
            assert mpmath.almosteq(product[k], expected, rel_eps=mpmath.mpf(10) ** -15)


SIX = orthogonal(4, 2)
SINGULAR: dict[str, tuple[Layout, str]] = {
    "spacetime": (STA.even, "1 1 0 0 0 0 0 0"),
    "plane-based": (PGA3.EVEN, "0 0 0 0 1 2 3 5"),
    "null vector": (SIX.layout("VECTOR", " ".join(SIX.vectors)), "3 4 0 0 5 0"),
    "six dimensions": (SIX.layout("SPARSE", "1 e12 e3456"), "0 0 2"),
    "even vectors": (SIX.layout("PAIRS", "1 e12 e34 e56"), "1 0 0 1"),
}


@pytest.mark.parametrize("name", list(SINGULAR))
def test_derivative_of_a_determinant_at_any_element(name: str) -> None:
    """A determinant is a polynomial, so it has a derivative where the element has no inverse, too."""
    layout, singular = SINGULAR[name]
    definition = declare(lambda a: determinant(a), {"a": layout})
    components, program = definition.parameters[0].components, compiled(jacobian(definition, "a")).program
    for values in (list(map(Fraction, singular.split())), [Fraction(k + 2, 3) for k in range(layout.size)]):
        at = dict(zip(components, values, strict=True))
        value, gradient = interpret(program, {"a": values}).values()
        assert list(value) == numbers(definition, SCALAR, at)
        assert list(gradient) == [exact_slope(definition, SCALAR, at, {c: 1})[0] for c in components]


def test_derivative_of_an_inverse() -> None:
    definition = declare(inverse, {"a": PGA3.EVEN})
    at = {c: Fraction(k * k + 1, 3) for k, c in enumerate(definition.parameters[0].components)}
    b = inverse(PGA3.EVEN.element(list(at.values())))
    _, matrix = run(jacobian(definition, "a"), at)
    for column, slot in enumerate(PGA3.EVEN.stored):
        expected = PGA3.EVEN.coefficients(-(b * PGA3.multivector({slot.name: 1}) * b))
        assert tuple(matrix[column::8]) == expected


AT_THE_SWITCH: dict[str, tuple[Callable[..., Any], Fraction | int]] = {
    "abs, that of the negative side": (lambda x: absolute(x - 2) * 3, -3),
    "minimum, that of the second": (lambda x: minimum(5 * x, x * x + 6), 4),
    "floor, zero": (lambda x: floor(x) * 9 + 4 * x, 4),
    "maximum, that of the second": (lambda x: maximum(5 * x, x * x + 6), 4),
    "select, the side taken where it is not less": (lambda x: select(x < 2, 7 * x, x * x * x), 12),
    "select, the side taken where it is less or equal": (lambda x: select(x <= 2, 7 * x, x * x * x), 7),
}


@all_cases("name", list(AT_THE_SWITCH))
def test_derivative_at_the_switch(name: str) -> None:
    """Test the documented results at points where a function has no derivative, or two."""
    function, expected = AT_THE_SWITCH[name]
    definition = declare(function, {"x": SCALAR})
    assert run(jacobian(definition, "x"), {"x": Fraction(2)})[1] == (expected,)
    assert run(jvp(definition, "x"), {"x": Fraction(2), "x_tangent": Fraction(10)})[1] == (10 * expected,)
    assert run(vjp(definition, "x"), {"x": Fraction(2), "cotangent": Fraction(10)})[1] == (10 * expected,)


def test_second_derivative_at_the_switch() -> None:
    definition = declare(lambda x: absolute(x) * x, {"x": SCALAR})
    for x, second in ((Fraction(-1), -2), (Fraction(0), -2), (Fraction(1), 2)):
        assert run(hessian_vector(definition, "x"), {"x": x, "x_tangent": Fraction(1)})[2] == (second,)


def test_derivatives_of_roots_at_zero_are_not_finite() -> None:
    """Those of a root, of the root of a square, and of a norm."""
    definition = declare(lambda x: (sqrt(x), sqrt(x * x), norm(x * VGA3.basis()[0])), {"x": SCALAR})
    slopes = gacompiler.compile(jvp(definition, "x"))(0.0, 1.0)[3:]
    assert np.array_equal(slopes, [np.inf, np.nan, np.nan], equal_nan=True)
