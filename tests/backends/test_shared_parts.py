"""Parts of kernels with loops that are equal up to names are one function of a module, in C and in Python."""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from backend_programs import write

import generated
from gacompiler import SCALAR, array, fold, kernel, total
from gacompiler.backends import c_procedures, c_source, python_procedures, python_source
from gacompiler.backends.build import build_library, find_compiler
from gacompiler.backends.c import c_body
from gacompiler.backends.module import ModuleSource
from gacompiler.backends.python_loops import moves_numbers
from gacompiler.backends.shared_parts import with_applies, with_shared_parts
from gacompiler.errors import BackendError
from gacompiler.generation.sources import loop_source
from gacompiler.passes.loops import compile_loops
from gacompiler.runtime import load_module

BACKENDS = ["arrays", pytest.param("numba", marks=pytest.mark.slow), *(["c"] if find_compiler() else [])]
LINES = 56
"""The most lines for each kernel of the modules in ``generated``; copies of equal parts made them 96.

They were 60 before the solutions of nine and twelve linear equations, which are written without loops over unknowns,
and before floating bases of robots; 68 before the arms of `closed_arms`, whose eight branches are written one by one;
54 before `object_misfits`, whose products of fifteen derivatives are written one by one, and 55 before distances of
branches of `closed_arms`, and derivatives of lines of `bundles`.
"""


@kernel(x=array(SCALAR, "n"), scale=SCALAR)
def sums(x, scale):  # type: ignore[no-untyped-def]
    """Return the sum of the products with a number."""
    return total(lambda value: value * scale * scale, x)


@kernel(weights=array(SCALAR, "m"), factor=SCALAR)
def weighed(weights, factor):  # type: ignore[no-untyped-def]
    """Return the same sum, by other names, and the sum of squares."""
    both = total(lambda weight: (weight * factor * factor, weight * weight), weights)
    return both[1], total(lambda weight: weight * factor * factor, weights)


@kernel(x=array(SCALAR, "n", shared=True), scale=SCALAR)
def shared_sums(x, scale):  # type: ignore[no-untyped-def]
    """Return the sum of an array that all elements share."""
    return total(lambda value: value * scale * scale, x)


@kernel(start=SCALAR, x=array(SCALAR, "n"))
def sums_result(start, x):  # type: ignore[no-untyped-def]
    """Return a fold; its name is that of a part of `sums`."""
    return fold(lambda carry, value: carry / value, start, x)


def module(*definitions: Any) -> ModuleSource:
    """A module of kernels with loops."""
    loops = tuple(loop_source(compile_loops(definition)) for definition in definitions)
    return ModuleSource("shared", "Sums.", "gac generate shared.py", "0" * 64, (), loops)


@pytest.fixture(scope="module")
def source() -> ModuleSource:
    return module(sums, weighed, shared_sums, sums_result)


def called(text: str, name: str) -> list[str]:
    """The parts that a kernel calls in the Python text."""
    body = next(node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef) and node.name == name)
    calls = [node.func for node in ast.walk(body) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)]
    return sorted(each.id for each in calls if each.id.startswith("_") and each.id != "_sum")


def without_names(function: ast.FunctionDef) -> str:
    """The text of a function with variables named in the order of their occurrence."""
    names: dict[str, str] = {}
    text = ast.unparse(ast.Module([*function.body], []))
    parameters = ", ".join(argument.arg for argument in function.args.args)
    return re.sub(
        r"\b[a-zA-Z_]\w*\b(?!\()", lambda found: names.setdefault(found[0], f"v{len(names)}"), parameters + text
    )


def test_equal_parts_are_printed_once_and_named_after_what_they_compute(source: ModuleSource) -> None:
    python, c = python_source(source), c_source(source)
    first, second = called(python, "sums"), called(python, "weighed")
    assert set(first) & set(second) and not set(second) <= set(first)
    for name in first:
        assert python.count(f"def {name}(") == 1
        assert c.count(f"static INLINE void NAME({name[1:]})(") == c.count(f"GAC_IN_LANES({name[1:]}, PLAIN)") == 1
    assert not re.search(r"def _(sums|weighed|shared_sums)_\d+\(", python)
    # The kernel `sums_result` keeps its name, which the part of `sums` does not take.
    assert "\ndef sums_result(" in python and "_sums_result_2" in first and "_sums_result" not in first


def test_parts_differ_if_other_arguments_are_shared(source: ModuleSource) -> None:
    """Vectorised loops over parts read a shared table once for all lanes."""
    python = python_source(source)
    own = [name for name in called(python, "shared_sums") if name.startswith("_shared_sums")]
    assert own and not set(own) & set(called(python, "sums"))


def test_both_texts_are_read_back(source: ModuleSource) -> None:
    python, c = python_procedures(python_source(source)), c_procedures(c_source(source))
    for loop in with_shared_parts(source).loops:
        name = loop.procedure.name
        names = [program.name for program in loop.procedure.programs]
        parts = [program.name for program in python[name].programs if not moves_numbers(program)]
        assert parts == [program.name for program in loop.procedure.programs if not moves_numbers(program)]
        assert [program.name for program in c[name].programs] == names


def test_names_of_shared_parts_do_not_change_if_they_are_shared_again(source: ModuleSource) -> None:
    once = with_shared_parts(source)
    assert python_source(once) == python_source(source) and c_source(once) == c_source(source)


def test_a_changed_part_changes_every_kernel_that_calls_it(source: ModuleSource) -> None:
    """A name in the shared part: all procedures that call it are read with the changed program."""
    text = python_source(source)
    (name,) = [each for each in called(text, "sums") if each in called(text, "weighed") and "start" not in each]
    start = text.index(f"def {name}(")
    end = text.index("\n\n", start)
    part = text[start:end]
    assert "* value" in part
    read = python_procedures(text)
    changed = python_procedures(text[:start] + part.replace("* value", "* sum", 1) + text[end:])
    for kernel_name in ("sums", "weighed"):
        programs = [
            next(program for program in procedures[kernel_name].programs if f"_{program.name}" == name)
            for procedures in (read, changed)
        ]
        assert programs[0].lines != programs[1].lines
    assert read["sums_result"] == changed["sums_result"]


def test_parts_of_equal_names_must_be_equal(source: ModuleSource) -> None:
    """Two kernels that call different parts of the same name cannot be printed in one C file."""
    first, second = (loop.procedure for loop in with_shared_parts(module(sums, sums_result)).loops)
    name = first.programs[-1].name
    body = with_applies(second.body, lambda call: replace(call, program=replace(call.program, name=name)))
    with pytest.raises(BackendError, match="another part"):
        c_body("shared", (), [first, replace(second, body=body)])


@pytest.mark.parametrize("backend", BACKENDS)
def test_kernels_with_shared_parts_compute_their_sums(source: ModuleSource, backend: str, tmp_path: Path) -> None:
    file = write(source, tmp_path)
    if backend == "c":
        build_library(file)
    run = load_module(file.with_suffix(".py"), f"_shared_{backend}", backend)
    random = np.random.default_rng(3)
    x, scale = random.integers(-9, 9, (11, 4)).astype(float), random.integers(1, 5, 11).astype(float)
    expected = (x * scale[:, None] ** 2).sum(-1)
    assert np.array_equal(run.sums(x, scale), expected)
    squares, again = run.weighed(x, scale)
    assert np.array_equal(again, expected) and np.array_equal(squares, (x * x).sum(-1))
    assert np.array_equal(run.shared_sums(x[0], scale), x[0].sum() * scale**2)


@pytest.mark.parametrize("name", ["robots", "matrices"])
def test_no_two_parts_of_a_generated_module_are_equal(name: str) -> None:
    """In these modules two thirds of the parts were copies."""
    text = Path(str(generated.__path__[0]), f"{name}.py").read_text()
    parts = [node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef) and node.returns is not None]
    # Parts with equal texts differ in the arguments that all elements share, which the Python text does not show.
    texts = [without_names(part) for part in parts]
    assert len(set(texts)) >= 0.95 * len(texts) > 10


def test_generated_modules_are_short() -> None:
    texts = [file.read_text() for file in Path(str(generated.__path__[0])).glob("*.py")]
    n_kernels = sum(len(re.findall(r"^@_module\.(?:kernel|loops)\b", text, re.MULTILINE)) for text in texts)
    assert sum(len(text.splitlines()) for text in texts) <= LINES * n_kernels
