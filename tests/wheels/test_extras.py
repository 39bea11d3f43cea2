"""Imports that need missing packages fail with a message that names the extra to install."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from algorithms.extras import extra
from gacompiler.extras import COMMAND, COMPILER

ROOT = Path(__file__).parents[2]
HIDDEN = ("cffi", "_cffi_backend", "elftools", "numba", "packaging", "wheel")
CACHE = {name: os.environ[name] for name in ("GAC_CACHE",) if name in os.environ}


@pytest.fixture
def hidden(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Names of packages that are not found."""
    names: set[str] = set()
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name in names else found(name))
    return names


def run(path: str) -> dict[str, Any]:
    """The names in a file once it has run."""
    names: dict[str, Any] = {"__package__": "gacompiler"}
    exec(compile((ROOT / path).read_text(), path, "exec"), names)
    return names


def test_no_package_is_missing(hidden: set[str]) -> None:
    assert run("gacompiler/extras.py")["missing"] == []
    hidden |= {"numba"}  # which only runs kernels where there is no C compiler
    run("algorithms/__init__.py")


def test_the_compiler_names_missing_packages(hidden: set[str]) -> None:
    hidden |= {"click", "jinja2", "mpmath"}
    message = "gacompiler needs jinja2, mpmath; run: pip install jinja2 mpmath;"
    with pytest.raises(ImportError, match=message):
        run("gacompiler/extras.py")


def test_the_command_says_it_in_one_line(hidden: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    hidden |= {"click", "jinja2"}
    for program in ("/somewhere/bin/gac", "-m"):
        monkeypatch.setattr(sys, "argv", [program, "new", "kernels"])
        with pytest.raises(SystemExit, match=r"^gac: error: gacompiler needs click, jinja2; .*$"):
            run("gacompiler/extras.py")


def test_algorithms_name_a_missing_package(hidden: set[str]) -> None:
    hidden |= {"scipy"}
    with pytest.raises(ImportError, match="algorithms needs scipy; run: pip install scipy"):
        run("algorithms/__init__.py")


def test_pictures_name_their_extra() -> None:
    """In one process, which imports what the packages share only once."""
    packages = ("calculus", "kinematics", "vision", "wavelets")
    program = f"""
import importlib, sys, traceback
sys.modules["matplotlib"] = None
for package in {packages}:
    try:
        importlib.import_module(f"algorithms.{{package}}.pictures")
    except ImportError:
        traceback.print_exc()
    print("end of", package, file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    for package, text in zip(packages, done.stderr.split("end of")[:-1], strict=True):
        expected = f"ImportError: algorithms.{package}.pictures needs matplotlib; "
        assert text.splitlines()[-1].startswith(expected), text
        assert text.endswith("run: pip install 'gacompiler[pictures]'\n")
        assert "ModuleNotFoundError" not in text


def test_other_errors_of_an_import_are_raised_unchanged() -> None:
    with pytest.raises(ImportError, match=r"^some message$"), extra("pictures", "some_module"):
        raise ImportError("some message")


def test_extras_have_the_required_packages() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    dependencies, extras = project["dependencies"], project["optional-dependencies"]
    assert {*COMPILER, *COMMAND, "numpy", "scipy", "sympy"} == {line.partition(">")[0] for line in dependencies}
    named = {extra: {line.partition(">")[0] for line in lines} for extra, lines in extras.items()}
    assert {"cffi", "numba", "packaging", "pyelftools", "wheel"} == named["compiler"]
    assert {"matplotlib", "plotly"} == named["pictures"]


def test_a_compiled_kernel_needs_neither_numba_nor_a_c_compiler() -> None:
    """The packages of the extra ``compiler`` are hidden: kernels run on arrays, and `gac package` names the extra."""
    program = f"""
import importlib.util, runpy, sys
hidden = {HIDDEN}
for name in hidden:
    sys.modules[name] = None
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: None if name in hidden else found(name, package)
import gacompiler
from gacompiler.algebra.catalog import PGA3
from gacompiler.errors import BackendError

@gacompiler.kernel(v=PGA3.UNIT_EVEN, x=PGA3.POINT)
def move(v, x):
    return gacompiler.sandwich(v, x)

print(gacompiler.compile(move)([1, 0, 0, 0, 0, 0, -0.5, 0], [1.0, 2.0, 3.0]))
try:
    gacompiler.compile(move, "numba")
except BackendError as error:
    print(error)
sys.argv = ["gac", "package", "my_kernels.py"]
runpy.run_module("gacompiler", run_name="__main__")
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, env={"PATH": "", "HOME": "/"} | CACHE
    )
    moved, numba = done.stdout.splitlines()
    assert moved == "[1. 2. 4.]"
    assert numba == "compile(): numba is not installed; run: pip install 'gacompiler[compiler]'"
    assert done.returncode == 1, done.stderr
    wanted = "gac: error: gac package: packaging is not installed; run: pip install 'gacompiler[compiler]'"
    assert done.stderr.splitlines()[-1] == wanted
