"""Modules of derivatives of kernels with loops: generated, run by every backend, and proved from their text."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from selection import some_slow

from gacompiler.backends import build_module, c_source, python_source, runtime_files
from gacompiler.backends.c_loop_names import named_in_c
from gacompiler.backends.c_loops import plain_lines
from gacompiler.backends.module import LoopSource, ModuleSource
from gacompiler.backends.python_loop_reader import outline, python_procedures
from gacompiler.backends.python_loops import index_rules
from gacompiler.backends.readers import c_procedures
from gacompiler.errors import BackendError
from gacompiler.generation.cache import Cache
from gacompiler.generation.compiled import CompiledLoops
from gacompiler.generation.compiling import compile_kernels, source_of
from gacompiler.generation.files import write
from gacompiler.generation.rendering import render
from gacompiler.generation.spec_files import Spec, load_spec
from gacompiler.ir.procedure import Add, Loop, Place, Procedure, Storage, Table
from gacompiler.ir.procedure_cost import procedure_costs
from gacompiler.ir.rows import Counter, Through, row_at
from gacompiler.runtime import load_module
from gacompiler.verify import verify_module
from tests.support.all_cases import all_cases

FEW = '''
"""Derivatives of kernels with loops."""
from gacompiler import SCALAR, array, cos, index, jacobian, kernel, norm_squared, sin, vjp
from gacompiler.algebra.catalog import PGA3, VGA3
from gacompiler.frontend.loops import accumulate, each, fold, gather, scan, scatter, total

@kernel(z=array(VGA3.VECTOR, "k"), some=index("k", "m"), y=array(SCALAR, "m"))
def gaps(z, some, y):
    """Sums of rows of which some are left out."""
    return each(lambda a, b: norm_squared(a) * b, scatter(each(lambda v: v * norm_squared(v), z), some, y), y)

@kernel(x=array(SCALAR, "n"), others=index("n"))
def pairs(x, others):
    """Rows with others."""
    return each(lambda a, b: a * a * b, x, gather(x, others))

gaps_vjp_z = vjp(gaps, "z")
pairs_vjp_x = vjp(pairs, "x")
'''
"""Index tables, which take little time to compile."""

ALL = f'''{FEW}
@kernel(q=array(SCALAR, "n"), axes=array(PGA3.LINE, "n", shared=True), tool=PGA3.MOTOR)
def forward(q, axes, tool):
    """Pose."""
    return fold(lambda m, angle, axis: m * (cos(angle / 2) - sin(angle / 2) * axis), 1, q, axes) * tool

@kernel(x=array(SCALAR, "n"), y=array(SCALAR, "m"), b=SCALAR)
def within(x, y, b):
    """Loops in loops."""
    def body(c, v):
        sums = scan(lambda d, w: d * w + v, v, y)
        back = accumulate(lambda d, w: d * w + c, 0, sums)
        return c * b + total(lambda p, q: p * q, sums, back)
    return fold(body, b, x)

forward_vjp_q = vjp(forward, "q")
forward_jacobian_q = jacobian(forward, "q")
within_vjp_x = vjp(within, "x")
'''


@pytest.fixture(scope="module")
def slopes(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[Spec, list[Any], Path]]:
    """A function that compiles one of the specs, once, without a search for cheaper forms."""

    @cache
    def made(which: str) -> tuple[Spec, list[Any], Path]:
        folder = tmp_path_factory.mktemp("slopes")
        (folder / "slopes.py").write_text(FEW if which == "few" else ALL)
        spec = load_spec(folder / "slopes.py")
        compiled = list(compile_kernels(spec, cache=Cache(folder / "cache"), effort=0))
        write(runtime_files() | render(source_of(spec, compiled)), folder)
        return spec, compiled, folder

    return made


SLOW = [("all", "c"), ("all", "arrays")]


@pytest.mark.parametrize(("which", "backend"), some_slow([("few", "c"), ("few", "arrays"), *SLOW], *SLOW))
def test_derivatives_run_and_are_proved(
    slopes: Callable[[str], tuple[Spec, list[Any], Path]], which: str, backend: str
) -> None:
    spec, compiled, folder = slopes(which)
    if backend == "c" and build_module(folder / "slopes.c") is None:
        pytest.skip("no C compiler")
    module = load_module(folder / "slopes.py", f"_slopes_{backend}", backend)
    verdicts = verify_module(folder, spec.name, compiled, module)
    assert len(verdicts) == len(spec.kernels) >= 4 and all(verdict.is_proved for verdict in verdicts)
    z = np.arange(12.0).reshape(4, 3)
    some, y = np.array([1, -1, 0, 1]), np.array([2.0, 3.0])
    _, gradient = module.gaps_vjp_z(z, some, y, np.array([1.0, 5.0]))
    h = 1e-6
    for row, column in ((0, 1), (1, 1), (3, 2)):
        step = np.zeros_like(z)
        step[row, column] = h
        change = (module.gaps(z + step, some, y) - module.gaps(z - step, some, y)) / (2 * h)
        assert gradient[row, column] == pytest.approx(change @ [1.0, 5.0], rel=1e-6)
    assert not gradient[1].any()


def test_rows_with_others_need_no_order(slopes: Callable[[str], tuple[Spec, list[Any], Path]]) -> None:
    """A gradient adds to rows through an index table, and reads none of the sums in the same loop."""
    _, compiled, _ = slopes("few")
    (pairs,) = (each for each in compiled if isinstance(each, CompiledLoops) and each.kernel.name == "pairs_vjp_x")
    assert index_rules(pairs.source.procedure) == {"others": "a row of n"}


# Sums of rows that may not exist.


def procedure(*indices: str) -> Procedure:
    tables = (
        Table("x", ("m",) * len(indices), (2,), Storage.ARGUMENT),
        *(Table(name, ("n",), (), Storage.INDEX, True, "m") for name in indices),
        Table("out", ("n",), (2,), Storage.RESULT),
        Table("sum", (), (2,), Storage.WORK),
    )
    source = Place("x", row_at(tuple(Through(name, "i") for name in indices)))
    body = (Add(source, Place("out", Counter("i"))), Add(source, Place("sum")), Add(Place("sum"), Place("sum")))
    return Procedure("gathered", tables, (Loop("i", "n", False, body),))


def module_of(found: Procedure) -> ModuleSource:
    return ModuleSource("sums", "", "", "", (), (LoopSource(found, "", (), procedure_costs(found)),))


@pytest.mark.parametrize("indices", [("which",), ("which", "other")])
def test_texts_guard_rows_that_are_added(indices: tuple[str, ...]) -> None:
    found = procedure(*indices)
    text = c_source(module_of(found))
    read = c_procedures(text)["gathered"]
    assert read.body == named_in_c(found)[0].body
    condition = " && ".join(f"{name}[i] >= 0" for name in indices)
    assert sum(f"if ({condition})" in line for line in plain_lines(found)) == 2
    text = python_source(module_of(found))
    assert outline(python_procedures(text)["gathered"]) == outline(found)
    assert text.count(f"if {' and '.join(f'{name}[i] >= 0' for name in indices)}:") == 2
    assert set(index_rules(found).values()) == {"a row or -1 of m"}
    assert found.read_through == frozenset()


@all_cases(
    "old, new",
    [
        ("if which[i] >= 0:", "if which[i] >= 1:"),
        ("if which[i] >= 0 and other[i] >= 0:", "if which[i] >= 0 or other[i] >= 0:"),
        ("if which[i] >= 0 and other[i] >= 0:", "if other[i] >= 0 and which[i] >= 0:"),
        ("if which[i] >= 0 and other[i] >= 0:", "if which[i] >= 0:"),
        ("_sum(sum, x", "_sum(out, x"),
    ],
)
def test_python_text_without_the_guard_is_rejected(old: str, new: str) -> None:
    text = python_source(module_of(procedure(*(("which", "other") if "and" in old else ("which",)))))
    assert old in text
    with pytest.raises(BackendError):
        python_procedures(text.replace(old, new, 1))


def test_c_text_without_the_guard_is_rejected() -> None:
    text = c_source(module_of(procedure("which")))
    with pytest.raises(BackendError):
        c_procedures(text.replace("if (which[i] >= 0)", "if (which[i] >= 1)"))
    with pytest.raises(BackendError):
        c_procedures(text.replace("        if (which[i] >= 0)\n    ", "    "))
