"""Every row of the table of operations is available in all interfaces, and nothing else is."""

from __future__ import annotations

import inspect
import os
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest

import gacompiler
from gacompiler import symbolic
from gacompiler.algebra.catalog import VGA3
from gacompiler.algebra.layout import SCALAR
from gacompiler.algebra.meanings import MEANINGS
from gacompiler.algebra.methods import Methods
from gacompiler.algebra.operations import BY_NAME, PRODUCTS, Derivative, Kind, Operation
from gacompiler.derivatives import derivative
from gacompiler.frontend import operations as frontend
from gacompiler.frontend.expression import Expression, evaluate, node
from gacompiler.frontend.kernel import Parameter
from gacompiler.frontend.latex import latex_of
from gacompiler.objects import VGA3 as OBJECTS
from gacompiler.objects.arrays import MultivectorArray, Scalar
from gacompiler.objects.calls import SYMBOLS
from gacompiler.objects.definitions import BINARY, UNARY
from gacompiler.passes import lower, rewrite
from gacompiler.symbolic import functions as symbolic_functions
from tests.support.all_cases import all_cases

ROOT = Path(__file__).parent.parent.parent
MULTIVECTOR = [each for each in Operation if each.row.kind is Kind.MULTIVECTOR]
WITH_OPERANDS = [each for each in Operation if each.row.kind is not Kind.DATA]
FUNCTIONS = [
    each for each in WITH_OPERANDS
    if each.row.kind is Kind.MULTIVECTOR or (each.row.kind is Kind.SCALAR and not each.row.operator)
]  # fmt: skip
ELEMENTS = [VGA3.EVEN.element(list(map(Fraction, values))) for values in ((4, 2, 2, 1), (1, -2, 4, 3))]
"""The norm of the first is 5."""


def function_name(operation: Operation) -> str:
    """The name of its function; that of ``abs`` would hide Python's."""
    return "absolute" if operation is Operation.ABS else operation.value


def symbols(operation: Operation) -> list[Expression]:
    layout = SCALAR if operation.row.kind is Kind.SCALAR else VGA3.ROTOR
    layouts = [layout, SCALAR if operation is Operation.DIVIDE else layout, layout]
    return [Parameter(f"x{k}", each).symbols() for k, each in enumerate(layouts[: operation.row.operands])]


@all_cases("operation", Operation)
def test_a_row_has_one_name_and_a_summary(operation: Operation) -> None:
    assert operation == operation.row.name == operation.name.lower() and BY_NAME[operation.row.name] is operation
    assert operation.row.summary.endswith(".") and "\n" not in operation.row.summary
    assert (operation in MEANINGS) == (operation.row.kind is not Kind.DATA)


@all_cases("operation", FUNCTIONS)
def test_every_function_can_be_called_in_kernels(operation: Operation) -> None:
    name = function_name(operation)
    function = getattr(gacompiler, name)
    assert name in gacompiler.__all__ and function.__name__ == name and inspect.getdoc(function)
    required = [each for each in inspect.signature(function).parameters.values() if each.default is each.empty]
    assert len(required) == operation.row.operands
    expression = function(*symbols(operation))
    assert expression.operation is operation or operation is Operation.DETERMINANT, "which becomes products"


@all_cases("operation", MULTIVECTOR)
def test_every_function_of_multivectors_is_one_of_symbolic_multivectors(operation: Operation) -> None:
    function = getattr(symbolic, operation)
    assert operation in symbolic.__all__ and function.__name__ == operation and inspect.getdoc(function)
    operands = ELEMENTS[: operation.row.operands]
    found = function(*operands)
    assert isinstance(found, symbolic.SymbolicMultivector) and found.history[0] is operation
    assert found == MEANINGS[operation](*operands)


@all_cases("operation", MULTIVECTOR)
def test_every_function_of_multivectors_is_a_method_of_objects(operation: Operation) -> None:
    for kind in (MultivectorArray, Scalar):
        method = getattr(kind, operation)
        assert method.__name__ == operation and inspect.getdoc(method)
    operands = ELEMENTS[: operation.row.operands]
    first, *others = [OBJECTS.of(VGA3.EVEN, [float(x) for x in VGA3.EVEN.coefficients(each)]) for each in operands]
    found = getattr(first, operation)(*others)
    exact = found.exactly() if isinstance(found, MultivectorArray) else VGA3.scalar(Fraction(found))
    difference = (exact - MEANINGS[operation](*operands)).terms.values()
    assert all(abs(x) < 1e-13 for x in difference)


@all_cases("operation", WITH_OPERANDS)
def test_every_operation_has_text_latex_and_a_derivative(operation: Operation) -> None:
    operands = symbols(operation)
    expression = node(operation, *operands)
    assert (operation.row.operator or operation.value) in str(expression)
    latex = latex_of(expression)
    assert ("operatorname" in latex) == (not operation.row.latex)
    assert all(latex_of(operand) in latex for operand in operands)
    tangents = dict(zip(operands, reversed(symbols(operation)), strict=True))
    (slope,) = derivative([expression], tangents)
    assert isinstance(slope, Expression)


@all_cases("operation", [e for e in Operation if e.row.derivative is not Derivative.OWN])
def test_linear_and_bilinear_operations_are_differentiated_as_such(operation: Operation) -> None:
    """Their derivatives are differences: ``f(a + da, b) - f(a, b)``, exactly."""
    operands = symbols(operation)
    layout = operands[0].data.layout
    tangent = Parameter("t", layout).symbols()
    values: dict[str, Fraction] = {}
    for k, symbol in enumerate([*operands, tangent]):
        values |= zip(symbol.data.components, map(Fraction, (2 + k, 3 * k, 5, 7 - k)), strict=False)
    for place, operand in enumerate(operands):
        (slope,) = derivative([node(operation, *operands)], {operand: tangent})
        moved = [*operands[:place], operand + tangent, *operands[place + 1 :]]
        difference = node(operation, *moved) - node(operation, *operands)
        if operation.row.derivative is Derivative.ZERO:
            assert str(slope) == "0"
        else:
            found, wanted = evaluate([slope, difference], values)
            assert found == wanted and wanted.terms


def test_nothing_has_no_row() -> None:
    names = {function_name(each) for each in FUNCTIONS}
    assert set(frontend.__all__) - names == {"assemble", "coefficient", "grade", "join", "meet"}
    assert names - set(frontend.__all__) == {"cos", "exp", "log", "sin", "sqrt"}, "of multivectors too"
    assert set(symbolic_functions.__all__) - set(MULTIVECTOR) == {"exp", "grade", "log", "power", "sqrt"}
    outer = {"outer_cos", "outer_exp", "outer_sin", "outer_tan"}
    waves = {"cos", "cosh", "sin", "sinh", "tan", "tanh"}
    others = {"even_part", "exp", "join", "log", "meet", "odd_part", "power"} | outer | waves
    assert {name for name in vars(Methods) if not name.startswith("_")} == {*MULTIVECTOR, *others, "sqrt"}
    further = {"exp", "log", "sqrt", "power"} | waves
    assert {*UNARY, *BINARY} - further == {
        each for each in WITH_OPERANDS if each.row.kind is not Kind.SCALAR
    } - {Operation.NORMALIZE}  # fmt: skip
    assert {symbol for symbol, _ in SYMBOLS} == set("+-*/^&|~") | {">>", "()", "**2", "**3", "**-1"}


def test_passes_handle_every_product() -> None:
    assert set(PRODUCTS) <= set(lower._HEAVY) and set(PRODUCTS) <= set(rewrite._EQUIVARIANT)


LINES = {
    "algebra/operations.py": (
        "    COMMUTATOR = _product(",
        '    EVEN_PRODUCT = _product("even_product", r"{0} \\circ {1}", "Even grades.", lambda p, q, r: r % 2 == 0)\n',
    ),
    "frontend/operations.py": ("\ncommutator = binary(", "\neven_product = binary(apply, Operation.EVEN_PRODUCT)"),
    "symbolic/functions.py": ("\ncommutator = binary(", "\neven_product = binary(_apply, Operation.EVEN_PRODUCT)"),
    "algebra/methods.py": ("    commutator = binary(", "    even_product = binary(Operation.EVEN_PRODUCT)\n"),
}
"""Changes that a new product needs: a file, the text before which a line is inserted, and the line."""

PROGRAM = """
import gacompiler as ga
from gacompiler import symbolic
from gacompiler.algebra.catalog import VGA3
from gacompiler.frontend.kernel import Parameter
from gacompiler.frontend.latex import latex_of
from gacompiler.objects import VGA3 as space

assert "even_product" in ga.__all__ and "even_product" in symbolic.__all__

x, y = VGA3.multivector({"e1": 1, "e2": 2, "e12": 3}), VGA3.multivector({"1": 5, "e1": 7, "e3": 2})
wanted = (x * y).grade(0, 2)
assert ga.even_product(x, y) == wanted
assert symbolic.even_product(x, y) == wanted

a, b = (Parameter(name, VGA3.full).symbols() for name in "ab")
expression = ga.even_product(a, b)
assert str(expression) == "even_product(a, b)" and "circ" in latex_of(expression)
(slope,) = ga.derivatives.derivative([expression], {a: b})
assert str(slope) == "even_product(b, b)"

p, q = space.vector(1, 2, 3), space.vector(3, 5, 7)
assert p.even_product(q).exactly() == (p * q).exactly()
assert (p | p).even_product(q) == 0
"""


@pytest.mark.slow
def test_a_product_is_one_row_and_a_line_for_each_kind_of_user(tmp_path: Path) -> None:
    """In a copy of the compiler only four files have to be changed."""
    shutil.copytree(ROOT / "gacompiler", tmp_path / "gacompiler", ignore=shutil.ignore_patterns("__pycache__", "specs"))
    for name, (before, line) in LINES.items():
        path = tmp_path / "gacompiler" / name
        text = path.read_text()
        assert text.count(before) == 1
        exported = text.replace('"dual", ', '"dual", "even_product", ', 1) if "__all__ = [" in text else text
        path.write_text(exported.replace(before, line + before))
    (tmp_path / "program.py").write_text(PROGRAM)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    run = subprocess.run([sys.executable, "program.py"], cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert run.returncode == 0, run.stderr
