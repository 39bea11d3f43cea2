"""The tests that ``make test`` runs, those not marked as slow, reach every package, backend and command."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest

from gacompiler.cli import COMMANDS
from gacompiler.generation.rendering import TARGETS
from gacompiler.runtime import BACKENDS

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
LEFT_OUT = ("slow", "peers")
ELSEWHERE = {"demo": "project"}
"""Packages whose tests are in a folder of another name."""

OF_BACKENDS = {
    "c": "backends/test_backend_calls.py::test_every_operation_on_every_backend",
    "numba": "backends/test_backend_calls.py::test_every_operation_on_every_backend",
    "arrays": "backends/test_backend_calls.py::test_every_operation_on_every_backend",
    "rust": "backends/test_targets.py::test_rust",
    "javascript": "backends/test_targets.py::test_javascript",
    "cuda": "backends/test_targets.py::test_cuda_on_a_processor",
    "opencl": "backends/test_targets.py::test_opencl_on_a_processor",
}
"""A test that runs what the backend prints."""

OF_COMMANDS = {
    "generate": "cli/test_cli.py::test_generate_then_verify",
    "cache": "cli/test_cache_command.py::test_cache_is_shown_and_cleared",
    "build": "cli/test_cli.py::test_build_compiles_what_was_generated",
    "check": "cli/test_cli.py::test_check_compares_and_proves",
    "show": "cli/test_cli.py::test_every_stage_is_shown",
    "cost": "cli/test_cli.py::test_cost_json",
    "verify": "cli/test_cli.py::test_generate_then_verify",
    "list": "cli/test_cli.py::test_list",
    "package": "wheels/test_packages.py::test_wrong_arguments",
    "robot": "robots/test_robot_command.py::test_a_tree_from_a_file",
    "new": "cli/test_cli.py::test_new_writes_a_spec_that_compiles",
    "record": "objects/test_record.py::test_the_spec_has_exactly_the_kernels_that_were_used",
    "classify": "structure/test_structure_classification.py::test_command",
}
"""A test that runs the command."""


@cache
def functions(path: Path) -> dict[str, ast.FunctionDef]:
    """The functions of a file."""
    return {node.name: node for node in ast.parse(path.read_text()).body if isinstance(node, ast.FunctionDef)}


def is_quick(node: ast.FunctionDef) -> bool:
    """Whether all cases of a test are; a decorator that marks only some cases counts as one that marks them all."""
    text = " ".join(map(ast.unparse, node.decorator_list))
    return not any(word in text for word in (*(f"mark.{mark}" for mark in LEFT_OUT), "some_slow"))


def quick(place: str) -> ast.FunctionDef:
    """The test at this place, which must be there and be quick."""
    file, _, name = place.partition("::")
    assert name in functions(TESTS / file), f"{place} is not there"
    node = functions(TESTS / file)[name]
    assert is_quick(node), f"{place} is marked as slow; name a quick one"
    return node


def folders() -> set[str]:
    return {path.parent.name for path in TESTS.glob("*/test_*.py")}


def test_every_package_has_a_folder() -> None:
    packages = [path.parent.name for top in ("gacompiler", "algorithms") for path in (ROOT / top).glob("*/__init__.py")]
    assert len(packages) > 15
    assert {ELSEWHERE.get(name, name) for name in packages} <= folders()


@pytest.mark.parametrize("folder", sorted(folders() - {"peers"}))
def test_most_tests_of_every_folder_are_quick(folder: str) -> None:
    found = [node for path in (TESTS / folder).glob("test_*.py") for node in functions(path).values()]
    tests = [node for node in found if node.name.startswith("test_")]
    assert sum(map(is_quick, tests)) > 0.7 * len(tests)


@pytest.mark.parametrize("backend", [*BACKENDS, *TARGETS])
def test_every_backend_has_a_quick_test(backend: str) -> None:
    quick(OF_BACKENDS[backend])


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_a_quick_test(command: str) -> None:
    node = quick(OF_COMMANDS[command])
    known = functions(TESTS / OF_COMMANDS[command].partition("::")[0])
    called = [known[each.id] for each in ast.walk(node) if isinstance(each, ast.Name) and each.id in known]
    words = {each.value for one in (node, *called) for each in ast.walk(one) if isinstance(each, ast.Constant)}
    assert command in words, f"{OF_COMMANDS[command]} does not run gac {command}"


def test_names_of_files_are_unique() -> None:
    """Files of tests import others by their names, and documents name tests without folders."""
    names = [path.name for path in TESTS.rglob("*.py") if path.name not in ("conftest.py", "__init__.py")]
    assert sorted({name for name in names if names.count(name) > 1}) == []
