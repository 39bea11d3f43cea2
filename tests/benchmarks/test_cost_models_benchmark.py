"""The page of the cost models, and the C functions that are measured for it."""

from __future__ import annotations

import ctypes
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchmarks import cost_models
from benchmarks.cost_models import Difference, Row, main, measure, page
from benchmarks.program_c import c_text
from gacompiler import kernel, normalize, sandwich
from gacompiler.algebra.catalog import VGA2
from gacompiler.backends import find_compiler
from gacompiler.generation.checked_in import own_specs
from gacompiler.generation.spec_files import load_spec
from gacompiler.ir.interpret import Tape
from gacompiler.ir.scalar import Op
from gacompiler.passes.pipeline import compile_kernel

COMPILER = find_compiler()
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler")


@kernel(r=VGA2.ROTOR, v=VGA2.VECTOR)
def turned(r: Any, v: Any) -> Any:
    return sandwich(r, v) / 2


@kernel(v=VGA2.VECTOR)
def direction(v: Any) -> Any:
    return normalize(v)


def difference(model: str, of: Any = turned) -> Difference:
    programs = [compile_kernel(of, forms=False, cost=name).program for name in ("counts", model)]
    return Difference(f"example.{of.name}", model, (programs[0], programs[1]))


@needs_compiler
def test_functions_in_c_compute_the_programs(tmp_path: Path) -> None:
    programs = [compile_kernel(each, forms=False).program for each in (turned, direction)]
    (tmp_path / "programs.c").write_text(c_text(programs))
    assert COMPILER is not None
    library = tmp_path / "programs.so"
    subprocess.run([*COMPILER, "-O1", "-shared", "-fPIC", "-o", library, tmp_path / "programs.c", "-lm"], check=True)
    functions = ctypes.CDLL(str(library))
    for k, (program, numbers) in enumerate(zip(programs, ([0.6, 0.8, 2.0, -1.0], [3.0, 4.0]), strict=True)):
        found = (ctypes.c_double * 2)()
        getattr(functions, f"program_{k}")((ctypes.c_double * len(numbers))(*numbers), found)
        expected = Tape(program).run_in_double(numbers, lambda op, x: x[0] / x[1] if op is Op.DIVIDE else x[0] ** 0.5)
        assert list(found) == pytest.approx(expected, rel=1e-15)


@needs_compiler
def test_differences_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cost_models, "ROUNDS", 1)
    assert COMPILER is not None
    found = [difference("latency"), difference("fma"), difference("size", direction)]
    rows = measure(found, COMPILER)
    assert [row.difference for row in rows] == found
    assert all(0 < value < 1e6 for row in rows for value in row.measured)


def test_a_page_with_invented_figures() -> None:
    each = difference("latency")
    vga2 = load_spec(next(path for path in own_specs() if path.stem == "vga2"))
    text = " ".join(page([Row(each, (20.0, 10.0)), Row(each, (10.0, 20.0)), Row(each, (9.0, 3.0))], [vga2]).split())
    before, after = each.predicted
    assert after <= before and f"| {before} → {after} | 20.0 → 10.0 | 2.0 |" in text
    assert "kernels without loops in the modules `vga2`, the" in text and "## fma" not in text
    assert f"less for 2 of them, and the geometric mean of the ratios is {3 ** (1 / 3):.2f}." in text


@pytest.mark.slow
@needs_compiler
def test_the_command_writes_a_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    vga2 = load_spec(next(path for path in own_specs() if path.stem == "vga2"))
    some = tuple(each for each in vga2.kernels if each.name.startswith("in"))
    monkeypatch.setattr(cost_models, "load_spec", lambda _: replace(vga2, kernels=some))
    monkeypatch.setattr(cost_models, "ROUNDS", 1)
    assert main(["--quick", "--out", str(tmp_path / "times.md")]) == 0
    assert "differences measured" in capsys.readouterr().out
    assert "`vga2.inverse`" in (tmp_path / "times.md").read_text()
