"""Kernels for Triton, run by its interpreter on the processor, give the numbers of the C library."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from backend_programs import PROGRAMS, bits, module_source, write
from click.testing import CliRunner

from gacompiler.backends import build_module
from gacompiler.backends.readers import python_programs
from gacompiler.cli import main
from gacompiler.generation.checked_in import generated_folder
from gacompiler.generation.rendering import render_targets
from gacompiler.runtime import load_module

pytestmark = pytest.mark.peers
SPECIAL = (np.nan, np.inf, -np.inf, 0.0, -0.0, 1.0, -1.0, 1e-30, 1e30, 2.0)
TRANSCENDENTAL = ("interpolate", "all_operations")


def test_text_compiles_for_a_device(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Into the text of its processor, in both precisions; no sum of a product is rounded once."""
    pytest.importorskip("torch")
    pytest.importorskip("triton", reason="no Triton; pip install 'gacompiler[peers]' installs it on Linux")
    monkeypatch.delenv("TRITON_INTERPRET", raising=False)
    monkeypatch.setenv("TRITON_CACHE_DIR", str(tmp_path / "cache"))
    import triton
    from triton.backends.compiler import GPUTarget
    from triton.compiler import ASTSource

    found = in_triton(module_source("kernels", *PROGRAMS), tmp_path)
    for program in PROGRAMS:
        function = getattr(found, f"{program.name}_kernel")
        for real in ("fp64", "fp32"):
            kinds = {
                name: "i64" if name == "n" or name.endswith(("_element", "_component")) else f"*{real}"
                for name in function.arg_names
            } | {"BLOCK": "constexpr"}
            source = ASTSource(function, kinds, constexprs={"BLOCK": 256})
            target, options = GPUTarget("cuda", 80, 32), {"enable_fp_fusion": False}
            text = triton.compile(source, target=target, options=options).asm["ptx"]
            assert f"mul.f{real[2:]}" in text or f"mul.rn.f{real[2:]}" in text or program.name == "swap"
            assert "fma" not in text or program.name == "all_operations"  # functions of the library of the device


@pytest.fixture
def torch(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return torch, with Triton's interpreter, which has no arc cosine and arc tangent: those of numpy."""
    found = pytest.importorskip("torch")
    pytest.importorskip("triton", reason="no Triton; pip install 'gacompiler[peers]' installs it on Linux")
    monkeypatch.setenv("TRITON_INTERPRET", "1")
    core, interpreter, libdevice = map(
        import_module, ("triton.language.core", "triton.runtime.interpreter", "triton.language.extra.libdevice")
    )

    def by_numpy(function: Any) -> Any:
        def call(*arguments: Any) -> Any:
            data = function(*(each.handle.data for each in arguments))
            return core.tensor(interpreter.TensorHandle(data, arguments[0].type.scalar), arguments[0].type)

        return call

    monkeypatch.setattr(libdevice, "acos", by_numpy(np.arccos))
    monkeypatch.setattr(libdevice, "atan2", by_numpy(np.arctan2))
    return found


def in_triton(module: Any, folder: Path) -> ModuleType:
    ((name, text),) = render_targets(module, ["triton"]).items()
    (folder / name).write_text(text)
    return load_module(folder / name, name.removesuffix(".py"))


@pytest.mark.parametrize("real", ["float64", "float32"])
def test_every_operation(real: str, torch: Any, tmp_path: Path) -> None:
    """The same bits, NaN and signed zeros included, but for transcendental functions, which are those of numpy."""
    module = module_source("kernels", *PROGRAMS)
    source = write(module, tmp_path)
    for only in ("f64", "f32"):
        build_module(source, only)
    in_c, found = load_module(tmp_path / "kernels.py", "kernels"), in_triton(module, tmp_path)
    random = np.random.default_rng(0)
    for program in PROGRAMS:
        for choose in (lambda *size: random.uniform(-0.9, 0.9, size), lambda *size: random.choice(SPECIAL, size)):
            arrays = [np.asarray(choose(300, *each.shape), real) for each in program.arguments]
            with np.errstate(all="ignore"):
                ours = getattr(found, program.name)(*map(torch.from_numpy, arrays), block=64)
                right = getattr(in_c, program.name)(*arrays)
            ours = tuple(each.numpy() for each in (ours if isinstance(ours, tuple) else (ours,)))
            right = right if isinstance(right, tuple) else (right,)
            assert all(each.dtype == real for each in ours)
            if program.name in TRANSCENDENTAL:
                limit = 1e-14 if real == "float64" else 1e-5
                assert all(
                    np.allclose(a, b, rtol=limit, atol=limit, equal_nan=True) for a, b in zip(ours, right, strict=True)
                ), program.name
            else:
                assert bits(ours) == bits(right), program.name


def test_modules(torch: Any, tmp_path: Path) -> None:
    """All kernels of the checked-in module of the plane, on arguments that broadcast, and on none."""
    text = (generated_folder() / "pga2.py").read_text()
    programs = [read.program for read in python_programs(text).values()]
    found, in_c = in_triton(module_source("pga2", *programs), tmp_path), import_module("generated.pga2")
    random = np.random.default_rng(1)
    for program in programs:
        arrays = [random.uniform(0.1, 0.9, (7, 5, *each.shape)) for each in program.arguments]
        arrays[0] = np.asarray(arrays[0][0, 0])  # the same for all
        with np.errstate(all="ignore"):
            ours = getattr(found, program.name)(*map(torch.from_numpy, arrays))
            right = getattr(in_c, program.name)(*arrays)
        ours, right = (each if isinstance(each, tuple) else (each,) for each in (ours, right))
        for one, two in zip(ours, right, strict=True):
            assert np.allclose(one.numpy(), np.asarray(two), rtol=1e-13, atol=1e-13, equal_nan=True), program.name
    empty = [torch.zeros((0, *each.shape)) for each in programs[0].arguments]
    found_empty = getattr(found, programs[0].name)(*empty)
    assert (found_empty[0] if isinstance(found_empty, tuple) else found_empty).shape[0] == 0


def test_arguments_are_checked(torch: Any, tmp_path: Path) -> None:
    found = in_triton(module_source("kernels", PROGRAMS[0]), tmp_path)
    with pytest.raises(ValueError, match=r"shape \(4, 7\)"):
        found.move_point(torch.zeros(4, 7), torch.zeros(4, 3))
    with pytest.raises(ValueError, match=r"argument 1: torch.float64 on cpu; expected .* the same type"):
        found.move_point(torch.zeros(4, 8), torch.zeros(4, 3).double())
    for kind in (torch.float16, torch.int64):
        with pytest.raises(ValueError, match=f"argument 0: {kind} on cpu; expected float32 or float64"):
            found.move_point(torch.zeros(4, 8, dtype=kind), torch.zeros(4, 3, dtype=kind))
    motor = torch.zeros(8, requires_grad=True)
    with pytest.raises(ValueError, match="argument 0: requires a gradient"):
        found.move_point(motor, torch.zeros(4, 3))
    with torch.no_grad():
        assert found.move_point(motor, torch.zeros(4, 3)).shape == (4, 3)


SPEC = '''"""Three kernels."""

from gacompiler import SCALAR, array, kernel, total
from gacompiler.algebra.catalog import VGA2


@kernel(r=VGA2.ROTOR, v=VGA2.VECTOR)
def turn(r, v):
    """Turn a vector."""
    return r * v


@kernel(x=array(SCALAR, "n"))
def squares(x):
    """Sum squares."""
    return total(lambda a: a * a, x)


@kernel(x=array(SCALAR, "n"))
def cubes(x):
    return total(lambda a: a * a * a, x)
'''


def test_command_line(torch: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(SPEC)
    run = CliRunner().invoke(main, ["generate", "mine.py", "--target", "triton"])
    assert run.exit_code == 0, run.output
    text = Path("out/mine_triton.py").read_text()
    assert "# Kernels with loops are left out:\n# squares: Sum squares.\n# cubes\n" in text
    assert "mine_triton.py: 1 kernels, 2 with loops left out" in run.output
    found = load_module(Path("out/mine_triton.py"), "mine_triton")
    ours = found.turn(torch.tensor([0.6, 0.8]), torch.tensor([1.0, 2.0]))
    assert torch.allclose(ours, torch.tensor([0.6 + 1.6, 1.2 - 0.8]))  # (0.6 + 0.8 e12) (e1 + 2 e2)


def test_modules_of_loops_only_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(SPEC)
    run = CliRunner().invoke(main, ["generate", "mine.py", "--target", "triton", "--only", "squares", "-o", "out"])
    assert run.exit_code == 1 and "squares: kernels with loops, which are not printed for Triton" in run.output
    assert "expected a kernel without loops; --target cuda" in run.output and not Path("out/mine_triton.py").exists()
