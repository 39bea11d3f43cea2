"""Declaring and tracing kernels: expressions, inferred results and errors."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from exact_elements import named

import gacompiler
from gacompiler import (
    SCALAR,
    Multivector,
    absolute,
    acos,
    array,
    assemble,
    atan2,
    coefficient,
    cos,
    dual,
    equal,
    exp,
    grade,
    inverse,
    join,
    kernel,
    log,
    maximum,
    meet,
    minimum,
    norm,
    norm_squared,
    sandwich,
    select,
    sin,
    sqrt,
)
from gacompiler.algebra.catalog import CGA3, PGA3, STA, VGA3
from gacompiler.algebra.meanings import MEANINGS
from gacompiler.algebra.operations import Operation
from gacompiler.errors import AlgebraError, GacError, KernelError
from gacompiler.frontend.expression import Expression, evaluate, lift, node, topological
from gacompiler.frontend.facts import is_unit, is_unit_even_versor, parity
from gacompiler.frontend.kernel import ArrayOf, Kernel, Parameter, trace
from gacompiler.passes.pipeline import compile_kernel
from tests.support.all_cases import all_cases


@kernel(m=PGA3.MOTOR, p=PGA3.POINT)
def move_point(m: Any, p: Any) -> Any:
    """Move the point `p` by the unit motor `m`: ``m p ~m``."""
    return sandwich(m, p)


def only(definition: Kernel) -> Expression:
    (expression,) = trace(definition).expressions
    return expression


# Declaring


def test_a_declaration_holds_what_was_written() -> None:
    assert move_point.name == "move_point"
    assert [parameter.name for parameter in move_point.parameters] == ["m", "p"]
    assert move_point.parameters[0].layout is PGA3.MOTOR and move_point.parameters[1].shape == (3,)
    assert move_point.parameters[1].components == ("p_e032", "p_e013", "p_e021")
    assert move_point.returns is None
    assert move_point.summary == "Move the point `p` by the unit motor `m`: ``m p ~m``."
    assert re.search(r"test_frontend\.py:\d+: kernel move_point$", move_point.where)


def test_declaring_does_no_work() -> None:
    def body(a: Any) -> Any:
        raise AssertionError("called")

    assert kernel(a=VGA3.VECTOR)(body).name == "body"


def test_shapes_and_components() -> None:
    definition = kernel(s=SCALAR, m=array(SCALAR, 2, 2), p=array(PGA3.POINT, 2), t=(VGA3.VECTOR, VGA3.VECTOR))(
        named(lambda s, m, p, t: s)
    )
    assert [parameter.shape for parameter in definition.parameters] == [(), (2, 2), (2, 3), (2, 3)]
    assert definition.parameters[0].components == ("s",)
    assert definition.parameters[1].components == ("m_0_0", "m_0_1", "m_1_0", "m_1_1")
    assert definition.parameters[2].components[:3] == ("p_0_e032", "p_0_e013", "p_0_e021")
    assert definition.parameters[3].type == ArrayOf(VGA3.VECTOR, (2,))


@all_cases(
    "declare, message",
    [
        (lambda: kernel(a=VGA3.VECTOR)(lambda b: b), "parameters (b) but types for (a); expected the same names"),
        (lambda: kernel(a=SCALAR, b=SCALAR)(lambda b, a: b), "parameters (b, a) but types for (a, b)"),
        (lambda: kernel(a=SCALAR)(lambda a, b: a), "parameters (a, b) but types for (a)"),
        (lambda: kernel()(lambda a: a), "parameters (a) but types for ()"),
        (lambda: kernel(a=3)(lambda a: a), "a is declared as 3; expected a layout such as PGA3.MOTOR"),
        (lambda: kernel(a="VECTOR")(lambda a: a), "a is declared as 'VECTOR'"),
        (lambda: kernel(a=(VGA3.VECTOR, VGA3.ROTOR))(lambda a: a), "a is a tuple of different layouts"),
        (lambda: kernel(a=())(lambda a: a), "a is declared as ()"),
        (lambda: kernel(returns=7, a=SCALAR)(lambda a: a), "returns is declared as 7"),
        (lambda: kernel(returns=(SCALAR, 7), a=SCALAR)(lambda a: a), "returns is declared as 7"),
        (lambda: kernel(a=array(SCALAR, 2), a_0=SCALAR)(lambda a, a_0: a_0), "a_0 and a both have an entry a_0"),
        (lambda: array(SCALAR), "array(): shape (); expected names of lengths followed by positive sizes"),
        (lambda: array(SCALAR, 0), "array(): shape (0,)"),
        (lambda: array(SCALAR, 2, -1), "array(): shape (2, -1)"),
    ],
)
def test_errors_of_wrong_declarations(declare: Callable[[], Any], message: str) -> None:
    with pytest.raises(KernelError) as caught:
        declare()
    assert message in str(caught.value)


# Tracing


def test_the_expression_is_what_was_written() -> None:
    expression = only(move_point)
    assert expression.operation is Operation.SANDWICH and str(expression) == "sandwich(m, p)"
    assert [argument.operation for argument in expression.arguments] == [Operation.INPUT, Operation.INPUT]
    written = kernel(m=PGA3.MOTOR, p=PGA3.POINT)(named(lambda m, p: (m * p * ~m).grade(3) + 2 * dual(p)))
    text = str(only(written))
    assert text == "(((m * p) * ~m).grade(3) + (2 * dual(p)))"


def test_operators_and_functions_are_equal() -> None:
    a, b = (move_point.parameters[k].symbols() for k in (0, 1))
    pairs = [
        (a * b, gacompiler.geometric_product(a, b)),
        (a ^ b, gacompiler.outer_product(a, b)),
        (a & b, gacompiler.regressive_product(a, b)),
        (~a, gacompiler.reverse(a)),
        (a.grade(2), grade(a, 2)),
        (a["e12"], coefficient(a, "e12")),
        (a & b, join(a, b)),
        (a ^ b, meet(a, b)),
        (2 * a, gacompiler.geometric_product(2, a)),
    ]
    for left, right in pairs:
        assert left == right and hash(left) == hash(right)
    assert a * b != b * a and a + b != a - b and a["e12"] != a["e21"]


@all_cases("name", sorted(set(MEANINGS) - {"abs", "less", "less_equal", "select"}))
def test_every_operation_has_a_function_with_its_name(name: str) -> None:
    operators = {"add", "subtract", "negate", "divide"}
    assert name in operators or hasattr(gacompiler, name)


def test_blades_are_inferred_by_form() -> None:
    a, b = kernel(a=VGA3.VECTOR, b=VGA3.VECTOR)(named(lambda a, b: a)).parameters
    x, y = a.symbols(), b.symbols()
    assert (x * y).blades == {0, 3, 5, 6} and (x ^ y).blades == {3, 5, 6}
    assert (x ^ y ^ x).blades == {7} and dual(x).blades == {3, 5, 6}
    assert norm_squared(x).is_scalar and x["e1"].is_scalar and not (x * y).is_scalar
    assert (x - x).blades == {1, 2, 4}, "cancellation is decided on polynomials"
    assert inverse(x).blades >= {1, 2, 4}
    assert (1 + x).blades == {0, 1, 2, 4} and x.grade(2).blades == frozenset()


@all_cases("layout", [VGA3.full, PGA3.EVEN, CGA3.POINT, STA.BIVECTOR, VGA3.VECTOR])
def test_inferred_blades_hold_every_value(layout: Any) -> None:
    symbol = kernel(a=layout)(named(lambda a: a)).parameters[0].symbols()
    values = [Fraction(k + 2, 3) for k in range(layout.size)]
    inputs = dict(zip(symbol.data.components, values, strict=True))
    for build in (
        lambda a: a * a, lambda a: a ^ a, lambda a: a & a, lambda a: a * a * ~a, dual, lambda a: a * a - a,
        lambda a: a.grade(1, 2) * a, norm_squared, lambda a: gacompiler.commutator(a, a * a), inverse,
    ):  # fmt: skip
        expression = build(symbol)
        try:
            (value,) = evaluate([expression], inputs)
        except (AlgebraError, ZeroDivisionError):
            continue
        assert set(value.terms) <= expression.blades


def test_facts() -> None:
    m, p = (parameter.symbols() for parameter in move_point.parameters)
    assert (
        is_unit(m)
        and is_unit(~m)
        and is_unit(-m)
        and is_unit(m * m)
        and is_unit(inverse(m))
        and is_unit(sandwich(m, m))
    )
    assert (
        not is_unit(p) and not is_unit(m * p) and not is_unit(m + m) and not is_unit(m.grade(0)) and not is_unit(2 * m)
    )
    assert parity(m) == 0 and parity(p) == 1 and parity(m + p) is None
    assert is_unit_even_versor(m) and not is_unit_even_versor(p)


def test_the_same_function_computes_on_multivectors() -> None:
    m, p = PGA3.scalar(1), PGA3.multivector({"e123": 1, "e032": 2})
    assert move_point(m, p) == p
    assert isinstance(select(1, p, m), Multivector) and select(0, p, m) == 1
    assert sqrt(4) == 2 and minimum(1, 2) == 1 and maximum(1, 2) == 2 and absolute(-1) == 1 and equal(1, 1) == 1
    assert cos(0.0) == 1 and sin(0) == 0 and exp(0) == 1 and log(1) == 0 and acos(1) == 0 and atan2(0, 1) == 0
    assert assemble(VGA3, {"e1": 1, "e21": 2}) == VGA3.multivector({"e1": 1, "e12": -2})
    assert np.array_equal(sqrt(np.array([4.0, 9.0])), [2, 3])


def test_kernels_call_kernels() -> None:
    twice = kernel(m=PGA3.MOTOR, p=PGA3.POINT)(named(lambda m, p: move_point(m, move_point(m, p))))
    assert str(only(twice)) == "sandwich(m, sandwich(m, p))"


def test_constants_come_from_either_side() -> None:
    e1 = VGA3.basis()[0]
    for build in (
        lambda a: e1 * a, lambda a: a * e1, lambda a: e1 + a, lambda a: a + e1, lambda a: e1 - a, lambda a: a - e1,
        lambda a: e1 ^ a, lambda a: a ^ e1, lambda a: e1 & a, lambda a: a & e1, lambda a: 2 * a, lambda a: a / 2,
        lambda a: 1 - a, lambda a: Fraction(1, 2) + a, lambda a: 2 ^ a, lambda a: 2.0 * a, lambda a: e1 / a["e1"],
    ):  # fmt: skip
        expression = only(kernel(a=VGA3.VECTOR)(named(build)))
        assert isinstance(expression, Expression)
        assert Operation.CONSTANT in {argument.operation for argument in topological([expression])}
        values = {"a_e1": Fraction(2), "a_e2": Fraction(3), "a_e3": Fraction(5)}
        element = VGA3.VECTOR.element(list(values.values()))
        assert evaluate([expression], values) == [build(element)]


def test_tuples_and_arrays_of_results() -> None:
    pair = trace(kernel(a=VGA3.VECTOR, b=VGA3.VECTOR)(named(lambda a, b: (a * b, norm(a)))))
    assert [(output.name, output.outer_shape) for output in pair.outputs] == [("out_0", ()), ("out_1", ())]
    several = trace(kernel(returns=array(VGA3.VECTOR, 2), a=VGA3.VECTOR)(named(lambda a: [a, -a])))
    assert several.outputs[0].outer_shape == (2,) and len(several.expressions) == 2
    matrix = trace(kernel(returns=array(SCALAR, 2, 2), a=VGA3.VECTOR)(named(lambda a: ((a["e1"], a["e2"]), (0, 1)))))
    assert matrix.outputs[0].outer_shape == (2, 2) and len(matrix.expressions) == 4
    pinned = trace(kernel(returns=(VGA3.EVEN, SCALAR), a=VGA3.VECTOR)(named(lambda a: (a * a, norm(a)))))
    assert [output.layout for output in pinned.outputs] == [VGA3.EVEN, SCALAR]
    mixed = trace(
        kernel(returns=(array(SCALAR, 2), VGA3.VECTOR), a=VGA3.VECTOR)(named(lambda a: ((a["e1"], a["e2"]), a)))
    )
    assert [output.outer_shape for output in mixed.outputs] == [(2,), ()]


def test_programs_of_arrays() -> None:
    record = compile_kernel(kernel(p=array(PGA3.POINT, 2))(named(lambda p: p[0] & p[1])))
    assert record.program.signature == "(2,3)->(6)"
    record = compile_kernel(
        kernel(returns=array(SCALAR, 2, 2), r=gacompiler.algebra.catalog.VGA2.ROTOR)(
            named(lambda r: ((r["1"], -r["e12"]), (r["e12"], r["1"])))
        )
    )
    assert record.program.signature == "(2)->(2,2)"
    assert str(record.program.results[0].operands[0]) == "r_1"


# Errors


def other_input() -> Any:
    return kernel(z=VGA3.VECTOR)(named(lambda z: z)).parameters[0].symbols()


STRANGER = other_input()


@all_cases(
    "parameters, function, returns, message",
    [
        ({"a": SCALAR}, lambda a: 1 if a else 2, None, "is known only when the kernel runs; use select("),
        ({"a": SCALAR}, lambda a: a if a > 0 else -a, None, "use select(condition, a, b)"),
        ({"a": SCALAR}, lambda a: max(a, 1), None, "has no truth value"),
        ({"a": SCALAR, "b": SCALAR}, lambda a, b: 0 < a < b, None, "has no truth value"),
        ({"a": VGA3.VECTOR}, lambda a: [*a], None, 'an expression cannot be iterated; use a coefficient, x["e12"]'),
        ({"a": VGA3.VECTOR, "b": STA.VECTOR}, lambda a, b: a * b, None,
         "arguments of VGA3 and STA; expected one algebra"),
        ({"a": VGA3.VECTOR}, lambda a: a + STA.basis()[0], None, "arguments of VGA3 and STA"),
        ({"a": VGA3.VECTOR}, lambda a: gacompiler.acos(a), None,
         "which can have blades e1 e2 e3; expected a scalar; use norm() or a coefficient, as in x.e12"),
        ({"a": VGA3.VECTOR}, lambda a: a.normalise(), None,
         "no method and no blade 'normalise'; expected a method, or the name of a blade; did you mean normalize?"),
        ({"a": VGA3.VECTOR}, lambda a: sqrt(a), None, "expected a scalar"),
        ({"a": VGA3.VECTOR}, lambda a: a < 1, None, "expected a scalar"),
        ({"a": VGA3.VECTOR}, lambda a: select(a, 1, 2), None, "expected a scalar"),
        ({"a": VGA3.VECTOR}, lambda a: a["e4"], None, "not a blade of VGA3"),
        ({"a": VGA3.VECTOR}, lambda a: a * float("nan"), None, "nan; expected a finite number"),
        ({"a": VGA3.VECTOR}, lambda a: a * "e1", None, "expected an exact number"),
        ({"a": VGA3.VECTOR}, lambda a: None, None, "the function returns nothing; expected an expression"),
        ({"a": VGA3.VECTOR}, lambda a: (), None, "the function returns an empty tuple; expected at least one result"),
        ({"a": VGA3.VECTOR}, lambda a: ((a, a), a), None, "out_0 is a nested tuple; declare returns=array("),
        ({"a": VGA3.VECTOR}, lambda a: [a, a], None, "out is a nested tuple; declare returns=array("),
        ({"a": VGA3.VECTOR}, lambda a: a + STRANGER, None, "uses z, an input of another kernel; expected its own"),
        ({"a": VGA3.VECTOR}, lambda a: a, (VGA3.VECTOR, SCALAR), "one result; expected a tuple of 2 as specified"),
        ({"a": VGA3.VECTOR}, lambda a: (a, a, a), (VGA3.VECTOR, VGA3.ROTOR), "3 results; expected 2 as specified by"),
        ({"a": VGA3.VECTOR}, lambda a: (a, a, a), array(VGA3.VECTOR, 2), "a sequence of 3; expected 2 entries"),
        ({"a": VGA3.VECTOR}, lambda a: a, array(VGA3.VECTOR, 2), "out is Expression; expected 2 entries"),
        ({"a": VGA3.VECTOR}, lambda a: ((a,), (a, a)), array(VGA3.VECTOR, 2, 2),
         "a sequence of 1; expected 2 entries"),
        ({"a": VGA3.full, "b": VGA3.VECTOR}, sandwich, None,
         "a versor of grades (0, 1, 2, 3); expected all grades even"),
        ({"a": PGA3.POINT}, gacompiler.polarity, None, "the metric is degenerate and I has no inverse; use dual()"),
    ],
)  # fmt: skip
def test_errors_of_wrong_kernels_name_place_and_reason(
    parameters: dict[str, Any], function: Callable[..., Any], returns: Any, message: str
) -> None:
    declared = tuple(Parameter(name, given) for name, given in parameters.items())
    definition = Kernel("wrong", function, declared, returns, "")
    with pytest.raises(GacError) as caught:
        compile_kernel(definition)
    assert message in str(caught.value)
    assert "kernel wrong" in str(caught.value), "the message names the kernel"
    assert "\n" not in str(caught.value)


@all_cases(
    "parameters, function",
    [
        ({"a": SCALAR}, lambda a: 1 / (a - a)),
        ({"m": PGA3.MOTOR}, lambda m: 1 / (norm_squared(m) - 1)),
        ({"p": CGA3.POINT}, lambda p: p / norm_squared(p)),
        ({"p": CGA3.POINT}, inverse),
        ({"a": SCALAR}, lambda a: a / 0),
        ({"a": SCALAR}, lambda a: 1 / (sin(a) * sin(a) + cos(a) * cos(a) - 1)),
    ],
)
def test_an_identically_zero_divisor_is_named(parameters: dict[str, Any], function: Callable[..., Any]) -> None:
    """The divisor may be zero only because of the relations of the inputs."""
    declared = tuple(Parameter(name, given) for name, given in parameters.items())
    definition = Kernel("divides", function, declared, None, "")
    with pytest.raises(KernelError, match="identically zero") as caught:
        compile_kernel(definition)
    assert "kernel divides" in str(caught.value)


def test_comparing_expressions_with_equality_signs_is_not_a_condition() -> None:
    """``==`` compares expressions, not values; its result must not be accepted as a condition."""
    with pytest.raises(KernelError, match="equal"):
        compile_kernel(kernel(a=SCALAR, b=SCALAR)(named(lambda a, b: select(a == b, 1, a))))


def test_numbers_are_no_names_of_coefficients_in_kernels() -> None:
    symbol = move_point.parameters[1].symbols()
    with pytest.raises(KernelError, match=r'the name of a blade; write x\["e12"\]'):
        symbol[0]  # the scalar part, or the first coefficient?


def test_functions_of_constants_are_rounded_once() -> None:
    @kernel(t=SCALAR)
    def powers(t: Any) -> Any:
        return 2**t, sqrt(2) * t, t * norm(VGA3.multivector({"e1": 1, "e2": 2}))

    found = gacompiler.compile(powers)(3.0)
    assert np.allclose(found, [8, 3 * math.sqrt(2), 3 * math.sqrt(5)], rtol=1e-15, atol=0)


# Expressions


def test_expressions_are_values_with_stable_hashes() -> None:
    first, again = only(move_point), only(move_point)
    assert first is again and hash(first) == hash(again)
    assert len({first, again}) == 1
    assert lift(3) == lift(3) and lift(3) != lift(4) and lift(VGA3.basis()[0]) == lift(VGA3.basis()[0])
    assert lift(VGA3.basis()[0]) != lift(STA.basis()[0])


def test_nodes_come_after_their_arguments_once() -> None:
    m, p = (parameter.symbols() for parameter in move_point.parameters)
    shared = m * p
    order = topological([shared * ~m + shared, shared])
    assert len(order) == len(set(order))
    for position, expression in enumerate(order):
        assert all(order.index(argument) < position for argument in expression.arguments)


def test_deep_expressions_do_not_recurse() -> None:
    x = kernel(x=SCALAR)(named(lambda x: x)).parameters[0].symbols()
    total = x
    for _ in range(3000):
        total = total + x
    assert len(topological([total])) == 3001
    assert evaluate([total], {"x": 2})[0].scalar == 6002


def test_repr_of_nodes() -> None:
    expression = node(Operation.OUTER_PRODUCT, VGA3.basis()[0], 2)
    assert repr(kernel(m=PGA3.MOTOR, p=array(PGA3.POINT, 2), x=array(SCALAR, "n"))(named(lambda m, p, x: m))) == (
        "<kernel example(m: PGA3.MOTOR, p: array(PGA3.POINT, 2), x: array(scalars.SCALAR, 'n'))>"
    )
    assert repr(expression) == "Expression((e1 ^ 2))"
    assert str(only(kernel(a=VGA3.VECTOR)(named(lambda a: -a["e1"] / 2)))) == "(-a[e1] / 2)"
