"""Errors of invalid kernels: one line with file, line and kernel, as early as possible."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import gacompiler
from gacompiler import SCALAR, kernel
from gacompiler.algebra.catalog import CGA3, PGA3
from gacompiler.backends.build import build_library, find_compiler, no_compiler
from gacompiler.backends.module import ModuleSource
from gacompiler.cli import main
from gacompiler.errors import AlgebraError, GacError, KernelError
from gacompiler.generation.files import write
from gacompiler.generation.rendering import render
from gacompiler.generation.sources import kernel_source
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.runtime import load_module
from tests.support.unoptimised import without_optimisation

HEAD = """import math
from gacompiler import inverse, kernel
from gacompiler.algebra.catalog import PGA3, VGA3

def helper(x):
    return math.sqrt(x)

"""


def run(*words: str) -> Result:
    return CliRunner().invoke(main, list(words))


CASES = {
    "an exception in the body": (
        "@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return math.sqrt(a['1'])\n",
        10,
        ["kernel f", "instead of those of math"],
    ),
    "an exception in a helper": (
        "@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return helper(a['1'])\n",
        6,
        ["kernel f", "instead of those of math"],
    ),
    "no types": ("@kernel\ndef f(a):\n    return a\n", 8, ["kernel f", "@kernel(m=PGA3.MOTOR, p=PGA3.POINT)"]),
    "recursion": ("@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return f(a)\n", 8, ["kernel f", "use fold, scan or iterate"]),
    "an async body": (
        "@kernel(a=PGA3.MOTOR)\nasync def f(a):\n    return a\n",
        8,
        ["an async function", "def and return"],
    ),
    "a yield": ("@kernel(a=PGA3.MOTOR)\ndef f(a):\n    yield a\n", 8, ["a function with yield", "def and return"]),
    "several": ("@kernel(a=PGA3.MOTOR)\ndef f(*a):\n    return a[0]\n", 8, ["the parameter *a", "array(layout, n)"]),
    "a class": ("@kernel(a=PGA3.MOTOR)\nclass f:\n    pass\n", 8, ["a class", "an ordinary function"]),
    "an equation": (
        "@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return 1 if a.e12 == 0 else a\n",
        10,
        ["a[e12] == 0", "equal(a, b)"],
    ),
    "two coefficients": (
        "@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return 1 if a.e12 == a.e13 else a\n",
        10,
        ["use equal(a, b)"],
    ),
    "a condition": (
        "@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return 1 if a.e12 > 0 else a\n",
        10,
        ["select(condition, a, b)"],
    ),
    "an assignment": ("@kernel(a=PGA3.MOTOR)\ndef f(a):\n    a['e12'] = 1\n", 10, ["cannot be changed", "assemble"]),
    "a slice": ("@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return a[1:3]\n", 10, ["the name of a blade", 'x["e12"]']),
    "a misspelt method": ("@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return a.revers()\n", 10, ["did you mean reverse?"]),
    "a fraction of no versor": (
        "@kernel(a=PGA3.PLANE)\ndef f(a):\n    return a**2.5\n",
        10,
        ["log, sqrt or power", "a unit versor"],
    ),
    "an exponent": ("@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return a**'2'\n", 10, ["exponent", "of type str"]),
    "a function of numpy": ("@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return math.floor(a.e12)\n", 10, ["gacompiler"]),
    "a dictionary": ("@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return {'a': a}\n", 8, ["kernel f", "of type dict"]),
    "arguments": (
        "@kernel(a=PGA3.MOTOR)\ndef g(a):\n    return a\n@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return g(a, 1)\n",
        13,
        ["called with 2 arguments", "expected 1: a"],
    ),
    "an assertion": (
        "@kernel(a=PGA3.MOTOR)\ndef f(a):\n    assert 1 == 2, 'never'\n",
        10,
        ["kernel f", "AssertionError: never"],
    ),
    "a truth value": ("@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return 1 if a else 2\n", 10, ["kernel f", "select"]),
    "an unknown blade": ("@kernel(a=PGA3.MOTOR)\ndef f(a):\n    return a['e7']\n", 10, ["kernel f", "e7"]),
    "an unknown layout": ("\n@kernel(a=PGA3.MOTR)\ndef f(a):\n    return a\n", 9, ["PGA3", "no layout MOTR"]),
    "wrong names": ("@kernel(m=PGA3.MOTOR)\ndef f(m, x):\n    return m\n", 8, ["kernel f", "(m, x)", "(m)"]),
    "no layout": ("@kernel(m=3)\ndef f(m):\n    return m\n", 8, ["kernel f", "m is declared as 3"]),
    "an algebra without it": ("X = VGA3.layout('X', 'e7')\n", 8, ["e7"]),
    "a lambda": ("f = kernel(m=PGA3.MOTOR)(lambda m: m)\n", 8, ["<lambda>", "def"]),
    "a name of the module": ("@kernel(m=PGA3.MOTOR)\ndef len(m):\n    return m\n", 8, ["kernel len", "rename"]),
}


@pytest.mark.parametrize("case", CASES)
def test_one_line_with_its_place(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    body, line, words = CASES[case]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wrong.py").write_text(HEAD + body)
    for command in (("cost", "wrong.py"), ("show", "wrong.py:f")):
        result = run(*command)
        assert result.exit_code == 1 and result.exception.__class__ is SystemExit
        lines = result.output.strip().splitlines()
        assert len(lines) == 1 and lines[0].startswith(f"gac: error: wrong.py:{line}: "), result.output
        assert all(word in lines[0] for word in words) and lines[0].count("wrong.py") == 1
    for words_ in (("cost", "wrong.py", "--debug"), ("--debug", "cost", "wrong.py")):
        text = run(*words_).output
        assert "Traceback (most recent call last)" in text and text.strip().splitlines()[-1] == lines[0]


def test_errors_keep_their_type_and_cause() -> None:
    @kernel(a=PGA3.MOTOR)
    def wrong(a: Any) -> Any:
        """Wrong."""
        return a["e9"]

    with pytest.raises(AlgebraError, match=r"test_declarations\.py:\d+: kernel wrong: ") as caught:
        compile_kernel(wrong)
    assert str(caught.value).count("kernel wrong") == 1

    @kernel(a=PGA3.MOTOR)
    def raising(a: Any) -> Any:
        """Raising."""
        return {}[a]

    @kernel(a=PGA3.MOTOR)
    def outer(a: Any) -> Any:
        """A kernel that calls one."""
        return raising(a)

    with pytest.raises(KernelError, match="kernel outer: KeyError") as other:
        compile_kernel(outer)
    assert isinstance(other.value.__cause__, KeyError)


def test_names_that_functions_cannot_have() -> None:
    """The declaration of the kernel raises an error, before the C compiler does."""
    with pytest.raises(
        KernelError, match=r"test_declarations\.py:\d+: kernel <lambda>: not a valid function name.*define it with def"
    ):
        kernel(x=SCALAR)(lambda x: x)
    for name in ("my kernel", "2x", "class", "lambda", "", "a-b", "x.y"):

        def function(x: Any) -> Any:
            return x

        function.__name__ = name
        with pytest.raises(KernelError, match="not a valid function name"):
            kernel(x=SCALAR)(function)
    with pytest.raises(KernelError, match="parameters"):
        kernel(**{"a b": SCALAR})(lambda x: x)


def test_names_with_a_meaning_in_c(tmp_path: Path) -> None:
    """Keywords and macros of C may be names of parameters and kernels; macros of the runtime may only be names of
    parameters.
    """
    names = ["double", "ONLY_F64", "FLT_MAX", "M_LOG2E", "NULL", "REAL", "memcpy", "out", "switch", "_x"]
    made: dict[str, Any] = {}
    for name in names:
        exec(f"def {name}(x):\n    return x * x + 1", made)
    exec(
        f"def named({', '.join(names)}):\n    return {' + '.join(f'{k} * {name}' for k, name in enumerate(names))}",
        made,
    )
    sources = {name: kernel_source(compile_kernel(kernel(x=SCALAR)(made[name]), effort=0)) for name in names}
    backend = "c" if find_compiler() else "arrays"
    for name in ("NULL", "REAL"):
        with pytest.raises(GacError, match=f"{name} is already used by the C headers"):
            render(ModuleSource("refused", "", "", "", (sources.pop(name),)))
    write(render(ModuleSource("names", "", "", "", tuple(sources.values()))), tmp_path)
    if backend == "c":
        with without_optimisation():
            assert build_library(tmp_path / "names.c")
    module = load_module(tmp_path / "names.py", "_names", backend)
    assert {name: getattr(module, name)(3.0) for name in sources} == dict.fromkeys(sources, 10)
    # In a module of its own, because a module hides the macros that have the names of its kernels.
    of_all = gacompiler.compile(kernel(**dict.fromkeys(names, SCALAR))(made["named"]), backend)
    assert of_all(*range(10)) == sum(k * k for k in range(10))


def test_floats_in_kernels_are_decimals() -> None:
    @kernel(a=PGA3.PLANE)
    def scaled(a: Any) -> Any:
        """Numbers of several kinds."""
        return 0.1 * a + np.float64(0.25) * PGA3.multivector({"e1": 0.3}) + a / np.int64(4)

    record = compile_kernel(scaled)
    assert record.cost.div == 0
    found = gacompiler.compile(scaled, "arrays")([1.0, 0, 0, 2.0])
    assert np.allclose(found, [0.1 + 0.075 + 0.25, 0, 0, 0.7], rtol=1e-15)

    @kernel(a=PGA3.PLANE)
    def nothing(a: Any) -> Any:
        """Not a number."""
        return float("inf") * a

    with pytest.raises(GacError, match=r"kernel nothing: .*inf; expected a finite number"):
        compile_kernel(nothing)


def test_a_layout_of_the_blade_1_has_an_axis() -> None:
    one = PGA3.layout("ONE", "1")
    assert not one.is_scalar and SCALAR.is_scalar

    @kernel(s=one, t=SCALAR, returns=one)
    def product(s: Any, t: Any) -> Any:
        """A product."""
        return s * t

    function = gacompiler.compile(product, "arrays")
    assert function.signature == "(1),()->(1)" and function.layouts["s"].blades == ("1",)
    assert function(np.ones((5, 1)), 2.0).shape == (5, 1)
    with pytest.raises(ValueError, match=r"s has shape \(5,\)"):
        function(np.ones(5), 2.0)


def test_a_missing_compiler_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "nocc -O2")
    assert "$CC is 'nocc -O2'" in no_compiler() and "not set" not in no_compiler()
    monkeypatch.delenv("CC")
    assert "$CC is not set" in no_compiler()


def test_list_of_nothing() -> None:
    result = run("list", "Nope")
    assert result.exit_code == 1 and len(result.output.strip().splitlines()) == 1
    assert "Nope" in result.output and "CGA3" in result.output and "pga3" in result.output


@pytest.mark.slow
def test_the_steps_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The steps are in the order in which they must be executed: `gac new` comes before the file that it writes."""
    text = (Path(__file__).parents[2] / "README.md").read_text()
    section = text.partition("## Generate your own")[2].partition("## Derive")[0]
    assert section.index("gac new my_kernels") < section.index("# my_kernels.py")
    monkeypatch.chdir(tmp_path)
    assert run("new", "my_kernels").exit_code == 0
    code = section.partition("```python\n")[2].partition("```")[0]
    (tmp_path / "my_kernels.py").write_text(code)
    commands = [line.partition("#")[0].split() for line in section.splitlines() if line.startswith("gac ")]
    assert len(commands) >= 4
    for command in commands:
        words = command[1:] + (["--no-build"] if command[1] == "generate" else [])
        assert run(*words).exit_code == 0, words
    assert (tmp_path / "out" / "my_kernels.py").is_file() and CGA3.POINT.size == 3
