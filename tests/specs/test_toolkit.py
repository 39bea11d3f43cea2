"""``docs/toolkit.md`` is the table of the toolkit, and every function and test that it names exists."""

from __future__ import annotations

import ast
import re
from functools import cache
from importlib import import_module

import pytest
from toolkit_page import PAGE, ROOT, entries, module, page

from gacompiler.generation.spec_files import load_spec
from tests.support.all_cases import all_cases

PRODUCTS = {
    "geometric_product", "outer_product", "regressive_product", "inner_product", "commutator", "reverse",
    "grade_involution", "clifford_conjugate", "dual", "undual", "norm", "ideal_norm",
}  # fmt: skip
"""Operations on any elements, which the README and the modules' own pages list."""


def test_the_page_is_current() -> None:
    assert PAGE.read_text() == page(), "run `python tests/support/toolkit_page.py`"


@all_cases("algebra", sorted({entry.algebra for entry in entries()}))
def test_every_function_exists(algebra: str) -> None:
    functions = [entry.function for entry in entries() if entry.algebra == algebra]
    missing = [name for name in functions if not callable(getattr(import_module(module(algebra)), name, None))]
    assert not missing


@cache
def texts(name: str) -> dict[str, str]:
    """The text of every function of a file of tests."""
    [path] = (ROOT / "tests").glob(f"*/{name}")
    text = path.read_text()
    functions = [node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)]
    return {node.name: "\n".join(text.splitlines()[node.lineno : node.end_lineno]) for node in functions}


def test_every_test_exists_and_uses_the_function() -> None:
    for entry in entries():
        name, _, test = entry.test.partition("::")
        assert test in texts(name), entry.test
        assert re.search(rf"\b{entry.function}\b", texts(name)[test]), f"{entry.test} has no {entry.function}"


def test_nothing_is_listed_twice() -> None:
    named = [(entry.algebra, entry.function) for entry in entries()]
    assert len(named) == len(set(named))


@pytest.mark.parametrize("algebra", ["pga3", "pga2", "cga3", "cga2"])
def test_every_kernel_is_listed(algebra: str) -> None:
    kernels = {kernel.name for kernel in load_spec(ROOT / "gacompiler" / "specs" / f"{algebra}.py").kernels}
    listed = {entry.function for entry in entries() if entry.algebra == algebra}
    assert kernels - listed <= PRODUCTS, sorted(kernels - listed - PRODUCTS)
