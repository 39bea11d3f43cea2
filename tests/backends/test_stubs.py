"""The stubs of generated modules beside the modules."""

from __future__ import annotations

import ast
import importlib
import inspect
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

import pytest
from backend_programs import load

from gacompiler.backends.stubs import fits
from gacompiler.gac_runtime.layout import Layout
from gacompiler.generation.compiling import render_spec
from gacompiler.generation.spec_files import load_spec
from tests.support.all_cases import all_cases

GENERATED = Path(__file__).parents[2] / "generated"
MODULES = ("pga3", "cga2", "sta", "filters", "kalman", "arms")


SPEC = '''
"""Points and directions."""

from gacompiler import kernel
from gacompiler.algebra.catalog import PGA3

@kernel(a=PGA3.POINT, b=PGA3.POINT)
def between(a, b):
    """Twice the direction from one point to another."""
    return 2 * (b - a)

@kernel()
def origin():
    """The origin."""
    return PGA3.basis()[0] ^ PGA3.basis()[1] ^ PGA3.basis()[2]
'''


def declared(folder: Path, name: str) -> tuple[dict[str, ast.ClassDef], dict[str, str]]:
    """Return the classes of a stub, and the types of its variables."""
    body = ast.parse((folder / f"{name}.pyi").read_text()).body
    variables = {
        each.target.id: ast.unparse(each.annotation)
        for each in body
        if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name)
    }
    return {each.name: each for each in body if isinstance(each, ast.ClassDef)}, variables


@all_cases("name", MODULES)
def test_a_stub_declares_what_its_module_has(name: str) -> None:
    module = importlib.import_module(f"generated.{name}")
    classes, variables = declared(GENERATED, name)
    imported = {"Kernel", "Layout", "Value"}
    assert set(module.__all__) <= {*classes, *variables} | imported
    for kernel in module.kernels:
        calls = [each for each in classes[variables[kernel]].body if isinstance(each, ast.FunctionDef)]
        names = list(inspect.signature(getattr(module, kernel)).parameters)
        for call in calls:
            given = [each.arg for each in (*call.args.args[1:], *call.args.kwonlyargs)]
            assert [each for each in given if each != "out"] == [each for each in names if each != "out"], kernel


@pytest.mark.parametrize("name", MODULES)
def test_operators_in_a_stub_are_those_of_the_types(name: str) -> None:
    """Of each declared operator, the result has the declared type, and others raise TypeError."""
    check_operators(importlib.import_module(f"generated.{name}"), declared(GENERATED, name)[0])


def test_a_new_stub(tmp_path: Path) -> None:
    """Fixed coefficients cancel in differences; a result is not of the type of arguments if there are none."""
    (tmp_path / "spec").mkdir()
    (tmp_path / "spec" / "points.py").write_text(SPEC)
    for file, text in render_spec(load_spec(tmp_path / "spec" / "points.py")).items():
        (tmp_path / file).write_text(text)
    classes, _ = declared(tmp_path, "points")
    check_operators(load(tmp_path / "points.py", "points"), classes)
    for name, count in {"_Between": 4, "_Origin": 1}.items():
        calls = [each for each in classes[name].body if isinstance(each, ast.FunctionDef)]
        assert len(calls) == count
        for each in calls:
            result = ast.unparse(each.returns or ast.Constant(0))
            assert result not in {"T", "E"} or result in ast.unparse(each.args)


def check_operators(module: ModuleType, classes: Mapping[str, ast.ClassDef]) -> None:
    types = {each: getattr(module, each) for each in classes if inspect.isclass(getattr(module, each, None))}
    values = {each: kind(*(0.5 + k for k in range(len(kind.layout.blades)))) for each, kind in types.items()
              if hasattr(kind, "layout")}  # fmt: skip
    symbols = {"mul": "*", "xor": "^", "and": "&", "add": "+", "sub": "-"}
    for own, value in values.items():
        table: dict[tuple[str, str], str] = {}
        for method in classes[own].body:
            word = method.name.strip("_") if isinstance(method, ast.FunctionDef) else ""
            if word in symbols and isinstance(method, ast.FunctionDef):
                for other in ast.unparse(method.args.posonlyargs[1].annotation or ast.Constant(0)).split(" | "):
                    table[symbols[word], other] = ast.unparse(method.returns or ast.Constant(0))
        for symbol in symbols.values():
            for other, operand in {**values, "float": 2.5}.items():
                try:
                    found = type(eval(f"a {symbol} b", {"a": value, "b": operand})).__name__
                except TypeError:
                    found = None
                assert table.get((symbol, other)) == found, (own, symbol, other)


def test_layouts_whose_coefficients_can_be_those_of_another() -> None:
    point = Layout("A.POINT", ("e1", "e2"), (("e0", "1"),))
    vector, direction = Layout("A.VECTOR", ("e1", "e2", "e0")), Layout("A.DIRECTION", ("e1", "e2"))
    assert fits(point, vector) and fits(vector, point) and fits(direction, vector)
    assert not fits(direction, point) and not fits(point, direction) and not fits(vector, direction)
    assert not fits(Layout("B.VECTOR", ("e1", "e2", "e0")), vector)
