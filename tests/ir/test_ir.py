"""The scalar language: folding keeps values, programs are verified, the interpreter is the meaning, costs count."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from random import Random
from typing import Any

import mpmath
import numpy as np
import pytest

from gacompiler.algebra.coefficients import EXACT
from gacompiler.errors import GacError, InexactError, KernelError, ProofError, ZeroDivisorError
from gacompiler.ir.cost import WEIGHTS, cost
from gacompiler.ir.interpret import evaluate, interpret
from gacompiler.ir.program import Argument, Line, Program, Result
from gacompiler.ir.scalar import ARITY, COMMUTATIVE, LEAVES, Graph, Op, Scalar
from gacompiler.ir.verify import verify
from gacompiler.passes.schedule import schedule
from tests.support.all_cases import all_cases

NAMES = ("x", "y", "z")
EXACT_OPS = (Op.ADD, Op.SUBTRACT, Op.MULTIPLY, Op.NEGATE, Op.DIVIDE, Op.ABS, Op.FLOOR, Op.MINIMUM, Op.MAXIMUM,
             Op.LESS, Op.LESS_EQUAL, Op.EQUAL, Op.SELECT)  # fmt: skip

REFERENCE: dict[Op, Callable[..., Any]] = {
    Op.ADD: lambda a, b: a + b,
    Op.SUBTRACT: lambda a, b: a - b,
    Op.MULTIPLY: lambda a, b: a * b,
    Op.NEGATE: lambda a: -a,
    Op.DIVIDE: lambda a, b: Fraction(a) / Fraction(b),
    Op.ABS: lambda a: a if a >= 0 else -a,
    Op.FLOOR: lambda a: a // 1,
    Op.MINIMUM: lambda a, b: min(a, b),
    Op.MAXIMUM: lambda a, b: max(a, b),
    Op.LESS: lambda a, b: 1 if a < b else 0,
    Op.LESS_EQUAL: lambda a, b: 1 if a <= b else 0,
    Op.EQUAL: lambda a, b: 1 if a == b else 0,
    Op.SELECT: lambda c, a, b: a if c != 0 else b,
}
"""A second, independent definition of the operations."""


def program_of(roots: list[Scalar], names: tuple[str, ...] = NAMES) -> Program:
    arguments = tuple(Argument(name, (), (name,)) for name in names)
    return schedule("f", arguments, (("out", (len(roots),), tuple(roots)),))


# Folding


@all_cases("seed", range(40))
def test_folding_keeps_the_value(seed: int) -> None:
    """Random expressions with many zeros, ones, repeated terms and negations, at points with zeros and ties too."""
    random = Random(seed)
    graph = Graph()
    at = {name: Fraction(random.randint(-3, 3), random.randint(1, 2)) for name in NAMES}
    nodes: list[tuple[Any, Fraction]] = [(graph.variable(name), value) for name, value in at.items()]
    nodes += [(graph.constant(k), Fraction(k)) for k in (0, 1, -1, 2, Fraction(-1, 2))]
    for _ in range(60):
        op = random.choice(EXACT_OPS)
        chosen = [random.choice(nodes) for _ in range(ARITY[op])]
        if op is Op.DIVIDE and chosen[1][1] == 0:
            continue
        node = graph.apply(op, *(node for node, _ in chosen))
        nodes.append((node, Fraction(REFERENCE[op](*(value for _, value in chosen)))))
    roots = [node for node, _ in nodes]
    program = program_of(roots)
    found = interpret(program, {name: [value] for name, value in at.items()})["out"]
    assert list(found) == [value for _, value in nodes]


def test_folding_rules() -> None:
    """Test each rule once by the resulting node."""
    g = Graph()
    x, y, z = map(g.variable, NAMES)
    assert x + 0 is x and 0 + x is x and x - 0 is x and (0 - x) is -x
    assert x * 1 is x and 1 * x is x and x * -1 is -x and (x * 0).is_zero and x / 1 is x
    negated = -x
    assert -negated is x and -(x - y) is y - x and (x - x).is_zero
    assert x + -y is x - y and -x + y is y - x and x - -y is x + y and -x - y is -(x + y)
    assert -x * y is -(x * y) and x * -y is -(x * y) and -x * -y is x * y and x * -2 is -(x * 2)
    assert (x * 2) * Fraction(1, 2) is x and 3 * (2 * x) is x * 6 and (x * 3) * 0 is 0 * x
    assert x / 2 is x * Fraction(1, 2) and -x / y is -(x / y) and (0 / x).is_zero
    assert g.apply(Op.SELECT, 1, x, y) is x and g.apply(Op.SELECT, 0, x, y) is y and g.apply(Op.SELECT, z, x, x) is x
    assert x + y is y + x and x * y is y * x and x - y is not y - x
    assert g.constant(2) + 3 is g.constant(5) and g.constant(2) / 3 is g.constant(Fraction(2, 3))
    assert x / x is not g.constant(1), "x may be zero"


def test_nodes_are_shared_by_construction() -> None:
    g = Graph()
    x, y = g.variable("x"), g.variable("y")
    assert (x + y) * (y + x) is (y + x) * (x + y)
    for op in COMMUTATIVE:
        assert g.apply(op, x, y) is g.apply(op, y, x)
    for op in set(Op) - set(COMMUTATIVE) - set(LEAVES):
        if ARITY[op] == 2:
            assert g.apply(op, x, y) is not g.apply(op, y, x)


def test_nodes_are_immutable() -> None:
    x = Graph().variable("x")
    with pytest.raises(AttributeError, match="immutable"):
        x.op = Op.ADD  # type: ignore[misc]


@all_cases("op", [op for op in Op if op.value in EXACT])
def test_functions_of_numbers_fold_only_when_rational(op: Op) -> None:
    g = Graph()
    for values in ((0,), (1,), (4,), (Fraction(9, 4),), (-1,), (0, 1), (2, 1), (1, 2, 3), (0, 2, 3)):
        if len(values) != ARITY[op]:
            continue
        node = g.apply(op, *values)
        try:
            expected = EXACT[op.value](*map(Fraction, values))
        except InexactError:
            assert node.op is op
        else:
            assert node.op is Op.CONSTANT and node.value == expected


@pytest.mark.parametrize("divisor", [0, Fraction(0), 0.0])
def test_division_by_zero_is_rejected(divisor: Any) -> None:
    with pytest.raises(
        ZeroDivisorError, match="the divisor is identically zero; expected a divisor that can differ from zero"
    ):
        _ = Graph().variable("x") / divisor


def test_constants_that_are_not_numbers_are_rejected() -> None:
    for nothing in (float("nan"), float("inf"), -np.inf, np.float32("nan")):
        with pytest.raises(InexactError, match="expected a finite number"):
            _ = Graph().lift(nothing)
    for value in ("1", None, 1j):
        with pytest.raises((KernelError, TypeError)):
            _ = Graph().variable("x") + value
    assert Graph().lift(2.0).value == 2


def test_floats_are_their_shortest_decimals() -> None:
    for value, exact in (
        (0.1, Fraction(1, 10)), (-2.5e-3, Fraction(-1, 400)), (1e22, 10**22), (np.float64(0.3), Fraction(3, 10)),
        (np.float32(0.1), Fraction(1, 10)), (np.int32(7), 7), (1 / 3, Fraction(repr(1 / 3))),
        (5e-324, Fraction(5, 10**324)),
    ):  # fmt: skip
        assert Graph().lift(value).value == exact
        assert float(Graph().lift(float(value)).value) == float(value), "and rounds back to itself"


def test_nodes_of_two_graphs_do_not_mix() -> None:
    """Node numbers of different graphs are unrelated: mixing them would share nodes that are not equal."""
    a, b = Graph(), Graph()
    x = a.variable("x")
    _, y = b.variable("u"), b.variable("y")
    with pytest.raises(GacError):
        _ = x + y


# Verify


def line(target: str, op: Op, *operands: Any) -> Line:
    return Line(target, op, operands)


X, Y = Argument("x", (), ("x",)), Argument("y", (2,), ("y_0", "y_1"))


def made(lines: tuple[Line, ...], results: tuple[Any, ...], arguments: tuple[Argument, ...] = (X, Y)) -> Program:
    return Program("f", arguments, lines, (Result("out", (len(results),), results),))


def test_a_valid_program_passes() -> None:
    program = made(
        (line("t0", Op.ADD, "x", "y_1"), line("t1", Op.MULTIPLY, "t0", Fraction(2))), ("t1", "x", Fraction(3))
    )
    assert verify(program) is program


@all_cases(
    "program, message",
    [
        (made((line("t0", Op.ADD, "x", "w"),), ("t0",)), "t0 uses w before it is defined"),
        (made((line("t0", Op.ADD, "t1", "x"), line("t1", Op.NEGATE, "x")), ("t0", "t1")), "t0 uses t1 before"),
        (made((line("t0", Op.ADD, "t0", "x"),), ("t0",)), "t0 uses t0 before it is defined"),
        (made((line("t0", Op.NEGATE, "x"), line("t0", Op.NEGATE, "x")), ("t0",)), "t0 is defined twice"),
        (made((line("x", Op.NEGATE, "y_0"),), ("x",)), "x is defined twice"),
        (made((), ("x",), (X, Argument("q", (), ("x",)))), "x is defined twice"),
        (made((line("t0", Op.NEGATE, "x"),), ("x",)), "t0 is never used"),
        (made((line("t0", Op.ADD, "x"),), ("t0",)), "t0 = add of 1 operands"),
        (made((line("t0", Op.SELECT, "x", "x"),), ("t0",)), "t0 = select of 2 operands"),
        (made((line("t0", Op.CONSTANT),), ("t0",)), "t0 = constant of 0 operands"),
        (made((line("t0", Op.VARIABLE),), ("t0",)), "t0 = variable of 0 operands"),
        (made((), ("t9",)), "out uses t9 before it is defined"),
    ],
)
def test_an_invalid_program_is_rejected(program: Program, message: str) -> None:
    with pytest.raises(ProofError) as caught:
        verify(program)
    assert str(caught.value).startswith("program f: ") and message in str(caught.value)


def test_shapes_are_checked() -> None:
    with pytest.raises(ValueError, match="x: 1 components for shape"):
        Argument("x", (2,), ("x",))
    with pytest.raises(ValueError, match="out: 2 entries for shape"):
        Result("out", (3,), ("x", "y"))


def test_programs_print_their_signature() -> None:
    lines = (line("t0", Op.MULTIPLY, "x", "y_0"), line("t1", Op.SQRT, "t0"), line("t2", Op.LESS, "t1", Fraction(1, 2)),
             line("t3", Op.NEGATE, "t2"))  # fmt: skip
    program = verify(made(lines, ("t3", Fraction(0))))
    assert str(program).splitlines() == [
        "f(x(), y(2)) -> out(2)",
        "  t0 = x * y_0",
        "  t1 = sqrt(t0)",
        "  t2 = t1 < 1/2",
        "  t3 = -t2",
        "  out[0] = t3",
        "  out[1] = 0",
    ]
    assert program.signature == "(),(2)->(2)" and not program.is_polynomial
    assert made((line("t0", Op.MULTIPLY, "x", "x"),), ("t0",)).is_polynomial


# Interpreter


INPUTS: dict[Op, tuple[Any, ...]] = {
    Op.ADD: (3, Fraction(-1, 2)), Op.SUBTRACT: (3, Fraction(1, 2)), Op.MULTIPLY: (3, Fraction(1, 2)), Op.NEGATE: (3,),
    Op.DIVIDE: (3, Fraction(1, 2)), Op.SQRT: (Fraction(9, 4),), Op.SIN: (0,), Op.COS: (0,), Op.ATAN2: (0, 2),
    Op.ACOS: (1,), Op.EXP: (0,), Op.LOG: (1,), Op.ABS: (Fraction(-3, 2),), Op.FLOOR: (Fraction(-3, 2),),
    Op.MINIMUM: (2, Fraction(3, 2)),
    Op.MAXIMUM: (2, Fraction(3, 2)), Op.LESS: (1, 2), Op.LESS_EQUAL: (2, 2), Op.EQUAL: (2, 2), Op.SELECT: (1, 5, 7),
}  # fmt: skip
VALUES = {
    Op.ADD: Fraction(5, 2), Op.SUBTRACT: Fraction(5, 2), Op.MULTIPLY: Fraction(3, 2), Op.NEGATE: -3, Op.DIVIDE: 6,
    Op.SQRT: Fraction(3, 2), Op.SIN: 0, Op.COS: 1, Op.ATAN2: 0, Op.ACOS: 0, Op.EXP: 1, Op.LOG: 0,
    Op.ABS: Fraction(3, 2), Op.FLOOR: -2, Op.MINIMUM: Fraction(3, 2), Op.MAXIMUM: 2,
    Op.LESS: 1, Op.LESS_EQUAL: 1, Op.EQUAL: 1, Op.SELECT: 5,
}  # fmt: skip


def one(op: Op) -> Program:
    names = NAMES[: ARITY[op]]
    arguments = tuple(Argument(name, (), (name,)) for name in names)
    return verify(Program("one", arguments, (Line("t0", op, names),), (Result("out", (), ("t0",)),)))


def test_every_operation_is_covered_here() -> None:
    assert set(INPUTS) == set(VALUES) == set(Op) - set(LEAVES)


def as_float(value: Any) -> float:
    return float(Fraction(value))


LIFTS: dict[str, Callable[[Any], Any]] = {
    "Fraction": Fraction,
    "float": as_float,
    "array": lambda value: np.full(3, as_float(value)),
    "mpmath": lambda value: mpmath.mpf(Fraction(value).numerator) / Fraction(value).denominator,
}


@all_cases("ring", LIFTS)
@all_cases("op", INPUTS)
def test_every_operation_in_every_ring(op: Op, ring: str) -> None:
    lift = LIFTS[ring]
    program = one(op)
    inputs = {name: [lift(value)] for name, value in zip(NAMES, INPUTS[op], strict=False)}
    (found,) = interpret(program, inputs)["out"]
    assert np.all(found == lift(VALUES[op]))
    if ring == "array":
        assert found.shape == (3,) and found.dtype == np.float64
    if ring == "Fraction":
        assert isinstance(found, (int, Fraction))


@all_cases("op", [Op.SQRT, Op.SIN, Op.COS, Op.ACOS, Op.EXP, Op.LOG, Op.ATAN2])
def test_functions_at_irrational_values(op: Op) -> None:
    """Floats, arrays and 50 digits agree; exact numbers raise an error."""
    values = [Fraction(7, 10), Fraction(-3, 10)][: ARITY[op]]
    expected = getattr(math, op.value)(*map(float, values))
    assert evaluate(op, list(map(float, values))) == expected
    assert np.allclose(evaluate(op, [np.array([float(v)]) for v in values]), expected, rtol=1e-15)
    with mpmath.workdps(50):
        precise = evaluate(op, [mpmath.mpf(v.numerator) / v.denominator for v in values])
        assert abs(precise - expected) < 1e-15
    with pytest.raises(InexactError):
        evaluate(op, values)


def test_select_in_arrays_is_elementwise() -> None:
    condition = np.array([1.0, 0.0, 1.0])
    found = evaluate(Op.SELECT, [condition, np.array([1.0, 2.0, 3.0]), np.zeros(3)])
    assert np.array_equal(found, [1, 0, 3])
    assert np.array_equal(evaluate(Op.LESS, [np.array([1.0, 2.0]), np.array([2.0, 1.0])]), [1, 0])


@all_cases("place", [0, 1])
@all_cases("op", [Op.ADD, Op.SUBTRACT, Op.MULTIPLY, Op.DIVIDE, Op.MINIMUM, Op.SELECT])
@all_cases("ring", ["Fraction", "float", "array", "mpmath"])
def test_constants_are_lifted_into_the_ring(op: Op, ring: str, place: int) -> None:
    """A constant operand on either side, with ``constant=`` of the ring."""
    operands: list[Any] = ["x"] * ARITY[op]
    operands[place] = Fraction(3, 4)
    program = Program(
        "f", (Argument("x", (), ("x",)),), (Line("t0", op, tuple(operands)),), (Result("out", (), ("t0",)),)
    )
    lift = LIFTS[ring]
    constant = as_float if ring in ("float", "array") else lift
    (found,) = interpret(program, {"x": [lift(Fraction(1, 2))]}, constant)["out"]
    values = [Fraction(1, 2)] * ARITY[op]
    values[place] = Fraction(3, 4)
    assert np.allclose(np.asarray(found, dtype=float), as_float(REFERENCE[op](*values)), rtol=1e-15)
    if ring == "array":
        assert found.dtype == np.float64


def test_results_by_name_and_in_order() -> None:
    arguments = (Argument("x", (2,), ("x_0", "x_1")),)
    results = (Result("a", (2,), ("x_1", Fraction(1, 3))), Result("b", (), ("t0",)))
    program = Program("f", arguments, (Line("t0", Op.ADD, ("x_0", "x_1")),), results)
    assert interpret(program, {"x": [1, 2]}) == {"a": (2, Fraction(1, 3)), "b": (3,)}
    with pytest.raises(ValueError, match="zip"):
        interpret(program, {"x": [1]})


# Cost


def test_counts() -> None:
    g = Graph()
    x, y, z = map(g.variable, NAMES)
    roots = [
        x * y + z,
        -(x * x - y),
        (x + y) / z,
        g.apply(Op.SQRT, x) * g.apply(Op.SIN, y),
        g.apply(Op.SELECT, g.apply(Op.LESS, x, y), x, z),
        x * 2,
    ]
    found = cost(program_of(roots))
    assert (found.mul, found.add, found.div, found.sqrt, found.call, found.choice) == (4, 3, 1, 1, 1, 2)
    assert found.fma == 4 + 3 - 2
    expected = 4 * WEIGHTS["mul"] + 3 * WEIGHTS["add"] + WEIGHTS["div"] + WEIGHTS["sqrt"] + WEIGHTS["call"] + 2
    assert found.total == expected
    assert found.as_dict()["div"] == 1
    assert str(found) == "4 mul, 3 add, 1 div, 1 sqrt, 1 call, 2 choice"


def test_a_product_used_twice_does_not_fuse() -> None:
    g = Graph()
    x, y, z = map(g.variable, NAMES)
    product = x * y
    assert cost(program_of([product + z, product - z])).fma == 3
    assert cost(program_of([x * y + y * z])).fma == 2
    assert cost(program_of([x * y + z, product])).fma == 2


def test_every_operation_is_counted_once() -> None:
    for op in INPUTS:
        found = cost(one(op)).as_dict()
        del found["fma"]
        assert sum(found.values()) == (0 if op is Op.NEGATE else 1), op
