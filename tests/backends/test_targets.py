"""Kernels in Rust, JavaScript, CUDA C++ and OpenCL C compile and give the numbers of the interpreter.

CUDA and OpenCL run here on the processor, as C with empty definitions of device keywords; nvcc, if present, compiles
them for both sides. Without functions such as the sine, every number is the same to the bit, NaN and signed zeros
included, in double and in float; the C backend must give the same numbers.
"""

from __future__ import annotations

import ctypes
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import target_drivers as drivers
from backend_programs import ALL_OPERATIONS, MOVE_POINT, PROGRAMS, module_source, write
from click.testing import CliRunner
from hash_seeds import is_the_same_for_every_hash_seed
from programs import needs, runs
from target_drivers import Array, Call, Dialect, Found, size

from gacompiler.backends import body_is_intact, build_module
from gacompiler.backends.module import ModuleSource
from gacompiler.backends.readers import python_programs
from gacompiler.cli import main
from gacompiler.generation.checked_in import generated_folder
from gacompiler.generation.compiling import compile_spec
from gacompiler.generation.rendering import TARGETS, render, render_targets
from gacompiler.generation.spec_files import load_spec
from gacompiler.ir.program import Argument, Line, Program, Result
from gacompiler.ir.scalar import Op

N = 24
SPECS = ("vga2",)
SPECIAL = (np.nan, np.inf, -np.inf, 0.0, -0.0, 1.0, -1.0, 5e-324, 1e300, 2.0)


@cache
def modules() -> dict[str, ModuleSource]:
    """The example programs with every operation and shape, and all kernels of a spec, from their checked-in text."""
    texts = {name: (generated_folder() / f"{name}.py").read_text() for name in SPECS}
    return {"kernels": module_source("kernels", *PROGRAMS)} | {
        name: module_source(name, *(read.program for read in python_programs(text).values()))
        for name, text in texts.items()
    }


@cache
def calls() -> tuple[Call, ...]:
    """Each kernel on a batch, on one with a uniform first argument, and on one with elements last."""
    found = []
    random_numbers = np.random.default_rng(1)
    for name, module in modules().items():
        for kernel in module.kernels:
            program = kernel.program
            arrays = [random_numbers.uniform(-0.9, 0.9, (N, size(each))) for each in program.arguments]
            found.append(Call(name, program, tuple(arrays)))
            if len(arrays) > 1:
                found.append(Call(name, program, (arrays[0][:1], *arrays[1:])))
            if name == "kernels":
                special = tuple(random_numbers.choice(SPECIAL, (10 * N, size(each))) for each in program.arguments)
                found += [Call(name, program, special), Call(name, program, special, by_component=True)]
    return tuple(found)


@cache
def by_element() -> tuple[Call, ...]:
    """The calls whose arrays store elements contiguously."""
    return tuple(call for call in calls() if not call.by_component)


def units(found: Array, right: Array, real: type) -> Array:
    """The error of `found` in units in the last place; infinite where only one of the values is a number."""
    with np.errstate(all="ignore"):
        off = np.abs(found - right) / np.spacing(np.abs(right).astype(real)).astype(float)
    return np.where((found == right) | (np.isnan(found) & np.isnan(right)), 0, np.where(np.isfinite(off), off, np.inf))


def bits(array: Array) -> Array:
    """The bits of numbers; all NaN are equal."""
    return np.where(np.isnan(array), np.nan, array).view(np.int64)


def agree(call: Call, found: list[Array], right: list[Array], real: type) -> None:
    """Assert equal bits where every operation is rounded, and an error of a few units in the last place elsewhere."""
    for result, is_exact, x, y in zip(
        call.program.results, drivers.exact_entries(call.program), found, right, strict=True
    ):
        where = f"{call.module}.{call.program.name}: {result.name} as {real.__name__}"
        y = y.astype(float)
        np.testing.assert_array_equal(bits(x[:, is_exact]), bits(y[:, is_exact]), where)
        x, y = x[:, ~is_exact], y[:, ~is_exact]
        if call.module == "kernels":
            assert units(x, y, real).max(initial=0) <= 4, where
        else:
            eps = float(np.finfo(real).eps)
            np.testing.assert_allclose(x, y, 1e4 * eps, 1e4 * eps, err_msg=where)


def check(found: Found, chosen: tuple[Call, ...], precisions: tuple[type, ...], times: int = 1) -> None:
    for real in precisions:
        for call in chosen:
            right = drivers.interpreted(call, real)
            for _ in range(1 if call.by_component else times):
                agree(call, found.results(call), right, real)
    assert found.is_read


@pytest.fixture(name="folder", scope="module")
def folder_fixture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All modules in all languages."""
    folder = tmp_path_factory.mktemp("targets")
    for module in modules().values():
        for name, text in render_targets(module, TARGETS).items():
            (folder / name).write_text(text)
    return folder


def compiled(*command: object) -> None:
    done = subprocess.run([*map(str, command)], capture_output=True, text=True)
    assert done.returncode == 0, (done.stdout + done.stderr)[:3000]


def element_by_element(library: ctypes.CDLL, call: Call, real: type) -> list[Array]:
    """The results of the plain functions of the C backend, which compilers do not vectorise."""
    run = library[f"{call.module}_{call.program.name}_{'f64' if real is np.float64 else 'f32'}"]
    by_value = ctypes.c_double if real is np.float64 else ctypes.c_float
    with np.errstate(over="ignore"):
        arrays: list[Array] = [np.ascontiguousarray(array, real) for array in call.arrays]
    found: list[Array] = [np.zeros((call.n, size(result)), real) for result in call.program.results]
    for i in range(call.n):
        rows = [array[i if len(array) > 1 else 0] for array in arrays]
        run(
            *(
                row.ctypes if argument.shape else by_value(row[0])
                for argument, row in zip(call.program.arguments, rows, strict=True)
            ),
            *(array[i].ctypes for array in found),
        )
    return [array.astype(float) for array in found]


@pytest.mark.slow
@needs("gcc")
def test_the_c_backend_gives_these_numbers(tmp_path: Path) -> None:
    files = {name: generated_folder() / f"{name}.c" for name in SPECS}
    files["kernels"] = write(modules()["kernels"], tmp_path)
    for real, only in ((np.float64, "f64"), (np.float32, "f32")):
        in_c = {name: ctypes.CDLL(str(build_module(file, only))) for name, file in files.items()}
        for call in by_element():
            if call.module in in_c:
                agree(call, element_by_element(in_c[call.module], call, real), drivers.interpreted(call, real), real)


def check_rust(folder: Path, level: int) -> None:
    """Compile at this level of optimisation, run, and compare."""
    (folder / "main.rs").write_text(drivers.rust_driver(by_element(), list(modules())))
    compiled(
        "rustc",
        "--edition",
        "2021",
        "-D",
        "warnings",
        "-C",
        f"opt-level={level}",
        "-o",
        folder / "in_rust",
        folder / "main.rs",
    )
    found = Found(drivers.run(by_element(), [str(folder / "in_rust")], folder))
    check(found, by_element(), (np.float64, np.float32))


@needs("rustc")
@pytest.mark.slow
def test_rust(folder: Path) -> None:
    """Compile without optimisation, which takes a sixth of the time, and with overflow checks."""
    check_rust(folder, 0)


@pytest.mark.slow
@needs("rustc")
def test_optimised_rust(folder: Path) -> None:
    check_rust(folder, 1)


@needs("node")
def test_javascript(folder: Path) -> None:
    (folder / "main.mjs").write_text(drivers.javascript_driver(by_element(), list(modules())))
    found = Found(drivers.run(by_element(), ["node", str(folder / "main.mjs")], folder))
    for call in by_element():
        agree(call, found.results(call), drivers.interpreted(call, np.float64), np.float64)
    for call in by_element():  # float arguments and results, double arithmetic
        with np.errstate(all="ignore"):
            rounded = Call(call.module, call.program, tuple(array.astype(np.float32) for array in call.arrays))
            right = [array.astype(np.float32) for array in drivers.interpreted(rounded, np.float64)]
        agree(call, found.results(call), right, np.float32)
    assert found.is_read


@needs("node")
def test_one_element_in_javascript(folder: Path) -> None:
    (folder / "one.mjs").write_text("""
import { distance, normalize, normalize_batch, swap } from "./kernels.mjs";
const is = (found, right) => {
  if (JSON.stringify(found) !== JSON.stringify(right)) throw new Error(`${JSON.stringify(found)} != ${right}`);
};
const fails = (call) => {
  try { call(); } catch (error) { return is(error instanceof RangeError, true); }
  throw new Error("no error");
};
is(distance(3, 4), 25);
const [unit, length] = normalize([3, 0, 4]);
is([Array.from(unit), length], [[0.6, 0, 0.8], 5]);
const a = [1, 2];
is(swap(a, a) === a && a, [2, 1]);
is(Array.from(normalize_batch([3, 0, 4, 0, 2, 0])[1]), [5, 2]);
is(normalize_batch([])[1].length, 0);
fails(() => swap(a, [1, 2, 3]));
fails(() => swap([1, 2, 3]));
fails(() => normalize([3, 0]));
fails(() => normalize(3));
fails(() => swap());
fails(() => normalize_batch([1, 2, 3, 4]));
""")
    compiled("node", folder / "one.mjs")


ON_A_PROCESSOR = """
#define __host__
#define __device__
#define __global__
static struct { unsigned x; } threadIdx, blockIdx, blockDim = {3}, gridDim = {2};
#define THREADS for (blockIdx.x = 0; blockIdx.x < 2; ++blockIdx.x) \\
    for (threadIdx.x = 0; threadIdx.x < 3; ++threadIdx.x)
"""
WORK_ITEMS = """
#define __kernel static
#define __global
static size_t work_item;
#define get_global_id(axis) work_item
#define get_global_size(axis) 5
#define THREADS for (work_item = 0; work_item < 5; ++work_item)
"""
FLAGS = ("-O0", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wno-unknown-pragmas", "-Wno-unused-function")


@needs("g++")
@pytest.mark.slow
def test_cuda_on_a_processor(folder: Path) -> None:
    dialect = Dialect(ON_A_PROCESSOR, "{module}::{kernel}", "{module}_{kernel}_{suffix}", drivers.PRECISIONS)
    (folder / "main.cpp").write_text(drivers.c_driver(calls(), [f"{name}.cu" for name in modules()], dialect))
    compiled("g++", "-std=c++17", *FLAGS, folder / "main.cpp", "-o", folder / "in_cpp", "-lm")
    found = Found(drivers.run(calls(), [str(folder / "in_cpp")], folder))
    check(found, calls(), (np.float64, np.float32), times=2)


@pytest.mark.slow
@needs("nvcc")
def test_cuda_on_the_host(folder: Path) -> None:
    dialect = Dialect("", "{module}::{kernel}", "", drivers.PRECISIONS)
    (folder / "main.cu").write_text(drivers.c_driver(by_element(), [f"{name}.cu" for name in modules()], dialect))
    flags = ("-O0", "-Xcicc", "-O0", "-Xptxas", "-O0", "-Werror", "all-warnings", "-Xcompiler", "-ffp-contract=off")
    compiled("nvcc", *flags, folder / "main.cu", "-o", folder / "in_cuda")
    found = Found(drivers.run(by_element(), [str(folder / "in_cuda")], folder))
    check(found, by_element(), (np.float64, np.float32))


@pytest.mark.slow
@needs("nvcc")
def test_cuda_on_a_device_compiles_and_contracts_only_where_it_may(folder: Path) -> None:
    (folder / "all.cu").write_text("".join(f'#include "{name}.cu"\n' for name in modules()))
    compiled("nvcc", "-ptx", "-fmad=false", folder / "all.cu", "-o", folder / "all.ptx")
    text = (folder / "all.ptx").read_text()
    bodies = dict(re.findall(r"\.entry (\w+)\((.*?)\n}", text, re.DOTALL))
    programs = [(name, kernel.program) for name, module in modules().items() for kernel in module.kernels]
    assert set(bodies) == {f"{name}_{each.name}_{real}" for name, each in programs for real in ("f64", "f32")}
    ring = [f"{name}_{each.name}" for name, each in programs if each.is_polynomial]
    assert len(ring) > 20
    assert not [name for name in ring if "fma" in bodies[f"{name}_f64"] + bodies[f"{name}_f32"]]
    for name, text in render_targets(module_source("one", MOVE_POINT), ["cuda"]).items():
        (folder / name).write_text(text)
    compiled("nvcc", "-ptx", folder / "one.cu", "-o", folder / "one.ptx")
    assert "fma" in (folder / "one.ptx").read_text(), "the flag makes no difference"


@needs("gcc")
@pytest.mark.parametrize("real", drivers.PRECISIONS)
def test_opencl_on_a_processor(folder: Path, real: str) -> None:
    prelude = f"{WORK_ITEMS}#include <tgmath.h>\n#undef I\n#define REAL {real}"
    dialect = Dialect(prelude, "{module}_{kernel}", "{module}_{kernel}_batch", (real,))
    path = folder / f"main_{real}.c"
    path.write_text(drivers.c_driver(calls(), [f"{name}.cl" for name in modules()], dialect))
    compiled("gcc", "-std=c99", *FLAGS, path, "-o", path.with_suffix(""), "-lm")
    found = Found(drivers.run(calls(), [str(path.with_suffix(""))], folder))
    check(found, calls(), (np.float64 if real == "double" else np.float32,), times=2)


@pytest.mark.peers
def test_opencl_on_a_platform(folder: Path) -> None:
    cl = pytest.importorskip("pyopencl")
    platforms = cl.get_platforms()
    if not platforms:
        pytest.skip("no OpenCL platform")
    context = cl.Context(platforms[0].get_devices()[:1])
    try:
        cl.Program(context, "__kernel void nothing(__global float *x) { x[0] = 0; }").build()
    except cl.RuntimeError as error:
        pytest.skip(f"the OpenCL platform compiles nothing: {error}")
    queue = cl.CommandQueue(context)
    texts = {name: (folder / f"{name}.cl").read_text() for name in modules()}
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    for real, options in (
        (np.float64, []),
        (np.float32, ["-D", "REAL=float", "-cl-fp32-correctly-rounded-divide-sqrt"]),
    ):
        programs = {name: cl.Program(context, text).build(options) for name, text in texts.items()}
        for call in calls():
            if call.module != "kernels":
                continue
            with np.errstate(over="ignore"):
                arrays = [np.ascontiguousarray(array, real) for array in call.stored()]
            shapes = [(call.n, size(result)) for result in call.program.results]
            arrays += [np.zeros(shape[::-1] if call.by_component else shape, real) for shape in shapes]
            buffers = [cl.Buffer(context, flags, hostbuf=array) for array in arrays]
            passed: list[Any] = [np.int64(call.n)]
            for array, buffer in zip(arrays, buffers, strict=True):
                strides = (1, call.n) if call.by_component else (array.shape[1] if len(array) > 1 else 0, 1)
                passed += [buffer, *map(np.int64, strides)]
            kernel = cl.Kernel(programs[call.module], f"kernels_{call.program.name}_batch")
            kernel(queue, (8,), None, *passed)
            for array, buffer in zip(arrays, buffers, strict=True):
                cl.enqueue_copy(queue, array, buffer)
            found = [np.asarray(array.T if call.by_component else array, float) for array in arrays[len(call.arrays) :]]
            agree(call, found, drivers.interpreted(call, real), real)


# Names


KEYWORDS = {
    "rust": "as break const crate dyn else enum extern fn for if impl in let loop match mod move mut pub ref return "
    "Self self static struct super trait type unsafe use where while async await abstract become box do final gen "
    "macro override priv try typeof unsized virtual yield true false T Real",
    "javascript": "break case catch class const continue debugger default delete do else enum export extends false "
    "finally for function if implements import in instanceof interface let new null package private protected public "
    "return static super switch this throw true try typeof var void while with yield await eval arguments undefined "
    "Math Float64Array RangeError Number",
    "cuda": "alignas asm auto bool break case catch char class const constexpr continue decltype default delete do "
    "double else enum explicit export extern false float for friend goto if inline int long mutable namespace new "
    "noexcept nullptr operator private protected public register return short signed sizeof static struct switch "
    "template this throw true try typedef typeid typename union unsigned using virtual void volatile while xor "
    "NULL INFINITY M_PI blockIdx threadIdx real std",
    "opencl": "auto break case char const continue default do double else enum extern float for goto if inline int "
    "long register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while "
    "kernel global local constant private half double4 float16 uchar size_t sqrt cos get_global_id REAL NULL M_PI",
    "triton": "and as assert async await class def del elif else except finally for from global if import in is lambda "
    "nonlocal not or pass raise return try while with yield True False None tl torch triton math libdevice REAL BLOCK",
}
KEPT = "lambda sin_x is_zero args i n k x0 m_i elements result check_ at_ out_component n_ double_"


def named(word: str) -> Program:
    """Twice a vector times a scalar, with `word` wherever a name is possible."""
    return Program(
        word,
        (Argument(word, (2,), (word, f"{word}_")), Argument(f"{word}_element", (), (f"{word}_1",))),
        (Line("n", Op.MULTIPLY, (word, f"{word}_1")), Line("i", Op.ADD, ("n", "n"))),
        (Result(f"{word}_i", (), ("i",)), Result(f"{word}_component", (2,), (f"{word}_", "n"))),
    )


COMPILERS: dict[str, tuple[str, ...]] = {
    "rust": ("rustc", "--edition", "2024", "--crate-type", "lib", "--emit", "metadata", "-o", "{folder}/found"),
    "javascript": ("node", "--check"),
    "cuda": ("g++", "-fsyntax-only", "-x", "c++", "-include", "{folder}/before.h"),
    "opencl": ("gcc", "-std=c99", "-fsyntax-only", "-x", "c", "-include", "{folder}/before.h"),
    "triton": (sys.executable, "-m", "py_compile"),
}


def without_comments(text: str, target: str) -> str:
    return re.sub(r"#[^\n]*" if target == "triton" else r"/\*.*?\*/|//[^\n]*", "", text, flags=re.DOTALL)


@pytest.mark.parametrize("target", TARGETS)
def test_reserved_words_are_not_used_as_names(target: str, tmp_path: Path) -> None:
    words = KEYWORDS[target].split()
    module = module_source("words", *map(named, [*words, *KEPT.split()]))
    ((name, text),) = render_targets(module, [target]).items()
    code = without_comments(text, target)
    prefix = "words_" if target == "opencl" else ""
    for word in words:
        head = re.search(
            rf"(?:fn|function|void|def) {prefix}{word}{'' if prefix else '_+'}(?:<[^>]*>)?\(([^)]*)\)", code
        )
        assert head, word
        names = re.findall(r"\w+(?=:)" if target == "rust" else r"\w+(?=,|=|$)", head[1])
        assert word not in names and f"{word}_" in names
    for word in set(KEPT.split()) - set(words):
        assert re.search(rf"(?:fn|function|void|def) {prefix}{word}(?:<[^>]*>)?\([^)]*\b{word}\b", code), word
    (tmp_path / name).write_text(text)
    prelude = ON_A_PROCESSOR if target == "cuda" else f"#include <stddef.h>\n{WORK_ITEMS}"
    (tmp_path / "before.h").write_text(f"#include <math.h>\n{prelude}")
    if not runs(COMPILERS[target][0]):
        pytest.skip(f"the text is checked; no {COMPILERS[target][0]} that runs to compile it")
    compiled(*(word.format(folder=tmp_path) for word in COMPILERS[target]), tmp_path / name)


# Text


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", ["kernels", *SPECS])
def test_text(target: str, name: str) -> None:
    module = modules()[name]
    texts = render_targets(module, [target])
    assert texts == render_targets(module, [target])
    ((file, text),) = texts.items()
    assert file == f"{name}{TARGETS[target][0]}"
    assert f"--target {target}" in text.splitlines()[1] and body_is_intact(text)
    assert all(line == line.rstrip() for line in text.splitlines())
    code = without_comments(text, target)
    assert max(map(len, code.splitlines())) <= 120
    for kernel in module.kernels:
        assert re.search(rf"\b\w*{kernel.program.name}(?:_batch)?(?:<[^>]*>)?\(", code), kernel.program.name


@pytest.mark.slow
def test_text_does_not_depend_on_the_hash_seed() -> None:
    statements = (
        "from backend_programs import *; from gacompiler.backends import *; "
        "from gacompiler.generation.rendering import *; m = module_source('one', *PROGRAMS); "
        "texts = [c_source(m), c_header(m), python_source(m), standalone_c_source(m), standalone_python_source(m)]; "
        "texts += render_targets(m, TARGETS).values()"
    )
    assert is_the_same_for_every_hash_seed(statements, "''.join(texts)")


def test_every_operation_is_among_the_kernels() -> None:
    assert {line.op for line in ALL_OPERATIONS.lines} == set(Op) - {Op.CONSTANT, Op.VARIABLE}


def test_comments_cannot_be_closed_by_a_summary() -> None:
    module = module_source("one", MOVE_POINT)
    odd = ModuleSource("one", "Ends */ here.", module.command, module.spec_hash, module.kernels)
    for text in render_targets(odd, ["javascript", "cuda", "opencl"]).values():
        assert "Ends * / here." in text


# Command line

SPEC = '''"""One kernel."""

from gacompiler import kernel
from gacompiler.algebra.catalog import VGA2


@kernel(r=VGA2.ROTOR, v=VGA2.VECTOR)
def turn(r, v):
    """Turn a vector."""
    return r * v
'''


def test_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(SPEC)
    run = CliRunner().invoke(main, ["generate", "mine.py", "--target", "opencl", "--target", "rust"])
    assert run.exit_code == 0, run.output
    assert sorted(path.name for path in Path("out").iterdir()) == ["mine.cl", "mine.rs"]
    assert "mine.cl: 1 kernels" in run.output and "unchanged" not in run.output
    run = CliRunner().invoke(main, ["generate", "mine.py", "--target", "rust", "--target", "c", "--no-build"])
    names = ["gac_runtime", "mine.c", "mine.cl", "mine.h", "mine.py", "mine.pyi", "mine.rs"]
    assert sorted(path.name for path in Path("out").iterdir()) == names
    assert "mine.rs: 1 kernels, unchanged" in run.output
    module = compile_spec(load_spec(Path("mine.py")))
    texts = render(module) | render_targets(module, ["rust", "opencl"])
    assert texts == {path.name: path.read_text() for path in Path("out").glob("mine.*")}
    run = CliRunner().invoke(main, ["generate", "mine.py", "--target", "fortran"])
    assert run.exit_code == 2 and "opencl" in run.output


@pytest.mark.slow
def test_own_modules_in_other_languages_do_not_change_generated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke(main, ["generate", "--all", "vga2", "--target", "javascript"])
    assert run.exit_code == 0, run.output
    text = Path("out/vga2.mjs").read_text()
    assert text.splitlines()[1] == "// command: gac generate --all vga2 --target javascript"
