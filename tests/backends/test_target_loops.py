"""Kernels with loops in Rust, JavaScript, CUDA C++ and OpenCL C compile and equal the interpreted procedures.

CUDA and OpenCL run here on the processor, as in `test_targets`, under the sanitizers: each element by itself, and a
batch by a grid of threads with one slice of the work space each. Without functions such as the sine, every number is
that of the interpreter, bit for bit.
"""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import loop_drivers as drivers
import numpy as np
import pytest
from backend_programs import MOVE_POINT, module_source
from hash_seeds import is_the_same_for_every_hash_seed
from loop_drivers import Array, LoopCall, LoopDialect
from loop_examples import (
    EXAMPLES,
    HARD,
    arguments,
    backwards,
    forward,
    kept,
    loop_module,
    newton,
    picked,
    sources,
    squares,
    tree,
)
from programs import SANITIZED, needs, runs
from selection import some_slow

from gacompiler.backends import body_is_intact
from gacompiler.backends.module import LoopSource, ModuleSource
from gacompiler.backends.python_loop_reader import python_procedures
from gacompiler.backends.python_loops import index_rules
from gacompiler.backends.transcendental import is_transcendental
from gacompiler.errors import BackendError
from gacompiler.generation.checked_in import generated_folder
from gacompiler.generation.rendering import TARGETS as ALL_TARGETS
from gacompiler.generation.rendering import render_targets
from gacompiler.ir.procedure import Apply, Copy, Loop, Place, Procedure, Statement
from gacompiler.ir.procedure_cost import procedure_costs
from gacompiler.ir.program import Argument, Program, Result
from gacompiler.ir.rows import Counter, Previous
from tests.support.all_cases import all_cases

TARGETS = tuple(target for target in ALL_TARGETS if target != "triton")
"""Languages that have kernels with loops."""

LENGTHS = ({"n": 0, "m": 0, "k": 0}, {"n": 5, "m": 3, "k": 7})
JOINTS, VARIABLES = 6, 5


FEW = (forward, squares, tree, backwards, picked, kept, newton)


@cache
def robots() -> ModuleSource:
    """The kernels of the robots from their checked-in text; compiling them takes half a minute."""
    found = python_procedures((generated_folder() / "robots.py").read_text())
    loops = tuple(LoopSource(each, "A kernel.", (), procedure_costs(each)) for each in found.values())
    return ModuleSource("robots", "Robots.", "gac generate robots.py", "0" * 64, (), loops)


@cache
def modules(which: str) -> dict[str, ModuleSource]:
    """A few examples, or those of all tests of loops and the robots."""
    if which == "few":
        return {"loops": loop_module("loops", *FEW)}
    return {"loops": loop_module("loops", *EXAMPLES, *HARD), "robots": robots()}


def of_robot(procedure: Procedure, rng: np.random.Generator, count: int, floats: bool) -> LoopCall:
    """A kernel of the robots on a random tree of joints; some joints share a variable, and the base may float."""
    lengths = {"n": JOINTS, "m": VARIABLES, "k": VARIABLES, "j": VARIABLES, "p": 2 * JOINTS, "r": 3 * JOINTS}
    lengths["u"] = lengths["p"]
    lengths |= dict.fromkeys("cefgs", 0)
    if floats:
        lengths |= {"c": 1, "e": 6, "f": JOINTS - 1, "g": 4, "s": 5, "k": VARIABLES + 8}
    given = arguments(procedure, lengths, rng, (count,))
    # Tables of the same name may list different pairs for different lengths.
    known = tables_of_robot(rng, "mirrored" in index_rules(procedure))
    given |= {name: array for name, array in known.items() if name in given and len(given[name]) == len(array)}
    return LoopCall("robots", procedure, {name: lengths[name] for name in procedure.lengths}, given, count)


def tables_of_robot(rng: np.random.Generator, mirrored: bool) -> dict[str, Any]:
    """Tables whose numbers are not any numbers: the tree, unit screws and rotors, and inertias of bodies."""
    parents = np.array([rng.integers(-1, k) for k in range(JOINTS)])
    # One tree of a different shape: branches at the base and at a joint.
    parents[:4] = -1, 0, 0, -1
    pairs = [(k, k) for k in range(JOINTS)] + [(k, parents[k]) for k in range(JOINTS) if parents[k] >= 0]
    lower, upper = np.array((pairs * 2)[: 2 * JOINTS]).T
    variables = np.append(np.arange(VARIABLES), 2)
    directions = rng.normal(size=(JOINTS, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    turns = np.array([1, 1, 0, 1, 0, 1.0])
    moments = rng.normal(size=(JOINTS, 3))
    tensors = [np.eye(3) + 0.1 * np.outer(x, x) for x in rng.normal(size=(JOINTS, 3))]
    rotors = rng.normal(size=(JOINTS, 4))
    known: dict[str, Any] = {
        "parents": parents,
        "variables": variables,
        "coordinates": variables,
        "lower": lower,
        "upper": upper,
        "lower_coordinates": variables[lower],
        "upper_coordinates": variables[upper],
        "base": VARIABLES + np.arange(8)[None],
        "turns": turns,
        "screws": np.hstack([directions * turns[:, None], np.where(turns[:, None], 0, moments)]),
        "inertias": np.array(
            [[2, *(0.1 * x), *tensor[np.triu_indices(3)]] for x, tensor in zip(moments, tensors, strict=True)]
        ),
        "home_rotors": rotors / np.linalg.norm(rotors, axis=1)[:, None],
    }
    if mirrored:
        known |= {"rows": variables[lower], "columns": variables[upper]}
        known["mirrored"] = np.where(lower == upper, -1, variables[lower])
    return known


@cache
def calls(which: str) -> tuple[LoopCall, ...]:
    """Calls of every example with several lengths, and of every kernel of the robots."""
    rng, found = np.random.default_rng(3), []
    for loop in modules(which)["loops"].loops:
        for k, sizes in enumerate(LENGTHS):
            lengths = {name: sizes[name] for name in loop.procedure.lengths}
            count = 8 if k == 1 else 1
            given = arguments(loop.procedure, lengths, rng, (count,))
            found.append(LoopCall("loops", loop.procedure, lengths, given, count))
    if "robots" in modules(which):
        kernels = [loop.procedure for loop in modules(which)["robots"].loops]
        found += [of_robot(kernel, rng, 2, floats) for kernel in kernels for floats in (False, True)]
    return tuple(found)


@cache
def right(which: str, number: int, real: type) -> list[Array]:
    """The results of the interpreter for a call."""
    return calls(which)[number].interpreted(real)


def agree(call: LoopCall, found: list[Array], known: list[Array], real: type) -> None:
    """Assert equal bits where every operation is rounded once, and close results elsewhere."""
    eps = float(np.finfo(real).eps)
    for table, x, y in zip(call.procedure.results, found, known, strict=True):
        where = f"{call.module}.{call.name}: {table.name} as {real.__name__}, {dict(call.lengths)}"
        if any(map(is_transcendental, call.procedure.programs)):
            np.testing.assert_allclose(x, y, 0, 1e4 * eps * np.abs(y).max(initial=1), err_msg=where)
        else:
            np.testing.assert_array_equal(x, y, where)


def check(which: str, found: list[list[Array]], *precisions: type) -> None:
    """Compare the results of a driver: all calls for each precision in order, each repeated `times`."""
    count = len(calls(which))
    times = len(found) // count // len(precisions)
    assert times >= 1 and len(found) == times * count * len(precisions)
    for place, results in enumerate(found):
        number = place % count
        real = precisions[place // (times * count)]
        agree(calls(which)[number], results, right(which, number, real), real)


@pytest.fixture(scope="module", params=some_slow(["few", "all"], "all"))
def which(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(name="folder", scope="module")
def folder_fixture(which: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All modules in all languages."""
    folder = tmp_path_factory.mktemp("loops_in_targets")
    for module in modules(which).values():
        for name, text in render_targets(module, TARGETS).items():
            (folder / name).write_text(text)
    return folder


def compiled(*command: object) -> None:
    done = subprocess.run([*map(str, command)], capture_output=True, text=True)
    assert done.returncode == 0, (done.stdout + done.stderr)[:3000]


@needs("rustc")
def test_rust(which: str, folder: Path) -> None:
    (folder / "main.rs").write_text(drivers.rust_driver(calls(which), list(modules(which))))
    compiled("rustc", "--edition", "2021", "-D", "warnings", "-o", folder / "in_rust", folder / "main.rs")
    check(which, drivers.run(calls(which), [str(folder / "in_rust")], folder), np.float64, np.float32)


@needs("node")
def test_javascript(which: str, folder: Path) -> None:
    (folder / "main.mjs").write_text(drivers.javascript_driver(calls(which), list(modules(which))))
    check(which, drivers.run(calls(which), ["node", str(folder / "main.mjs")], folder), np.float64)


@needs("node")
def test_one_element_in_javascript(folder: Path) -> None:
    (folder / "one.mjs").write_text("""
import { squares, tree, tree_work, backwards, backwards_work } from "./loops.mjs";
const is = (found, right) => {
  if (JSON.stringify(found) !== JSON.stringify(right)) throw new Error(`${JSON.stringify(found)} != ${right}`);
};
const fails = (call, message) => {
  try { call(); } catch (error) {
    return is([error instanceof RangeError, error.message.includes(message)], [true, true]);
  }
  throw new Error("no error");
};
is(squares(3, [1, 2, 3]), 14);
const up = [0, 0, 0];
const [same, down] = tree(3, [1, 2, 3], [-1, 0, 0], 1, up);
is([same === up, up, Array.from(down)], [true, [2, 6, 8], [16, 6, 8]]);
is(Array.from(backwards(2, [3, 5], undefined, new Float64Array(9))), [18, 5]);
is(Array.from(backwards(2, Float32Array.of(3, 5))), [18, 5]);
fails(() => squares(2, [1, 2, 3]), "x of length 3; expected 2");
fails(() => tree(3, [1, 2, 3], [-1, 0], 1), "parents of length 2; expected 3");
fails(() => tree(2, [1, 2], [-1, 0], 1, [1]), "a result of length 1; expected 2");
fails(() => backwards(2, [3, 5], undefined, new Float64Array(backwards_work(2) - 1)), "a work space of length 1");
""")
    compiled("node", folder / "one.mjs")


@needs("rustc")
def test_lengths_that_differ_in_rust(folder: Path) -> None:
    (folder / "lengths.rs").write_text("""mod loops;
fn main() { loops::squares(2, &[1.0, 2.0, 3.0], &mut 0.0, &mut []); }
""")
    compiled("rustc", "--edition", "2021", "-o", folder / "lengths", folder / "lengths.rs")
    done = subprocess.run([str(folder / "lengths")], capture_output=True, text=True)
    assert done.returncode != 0 and "x of 3 rows; expected 2" in done.stderr


FLAGS = ("-O0", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wno-unknown-pragmas", "-Wno-unused-function")
ON_A_PROCESSOR = """
#define __host__
#define __device__
#define __global__
static struct { unsigned x; } threadIdx, blockIdx, blockDim = {3}, gridDim = {2};
#define RUN_THREADS for (blockIdx.x = 0; blockIdx.x < 2; ++blockIdx.x) \\
    for (threadIdx.x = 0; threadIdx.x < 3; ++threadIdx.x)
"""
WORK_ITEMS = """
#define __kernel static
#define __global
static size_t work_item;
#define get_global_id(axis) work_item
#define get_global_size(axis) 6
#define RUN_THREADS for (work_item = 0; work_item < 6; ++work_item)
"""


@cache
def sanitizers(compiler: str) -> tuple[str, ...]:
    """Options that detect accesses outside of arrays, if the compiler supports them."""
    language = "c++" if compiler == "g++" else "c"
    command = [compiler, *SANITIZED, "-x", language, "-", "-o", os.devnull]
    done = subprocess.run(command, input="int main() { return 0; }", capture_output=True, text=True)
    return SANITIZED if done.returncode == 0 else ()


def run_on_processor(
    which: str, compiler: str, path: Path, standard: str, text: str, monkeypatch: pytest.MonkeyPatch
) -> list[list[Array]]:
    """Compile a driver and run it."""
    path.write_text(text)
    program = path.with_suffix(".run")
    compiled(compiler, standard, *FLAGS, *sanitizers(compiler), path, "-o", program, "-lm")
    monkeypatch.setenv("ASAN_OPTIONS", "detect_leaks=0")
    return drivers.run(calls(which), [str(program)], path.parent)


@pytest.mark.slow
@needs("g++")
@pytest.mark.parametrize("which", ["few"], indirect=True)
def test_cuda_on_a_processor(which: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The loops are printed by the lines of the compiler that print those of OpenCL, of which all run there."""
    dialect = LoopDialect(
        ON_A_PROCESSOR, "{module}::{kernel}", "{module}_{kernel}_{suffix}", ("double", "float"), "long long"
    )
    text = drivers.c_driver(calls(which), [f"{name}.cu" for name in modules(which)], dialect)
    check(
        which,
        run_on_processor(which, "g++", folder / "main.cpp", "-std=c++17", text, monkeypatch),
        np.float64,
        np.float32,
    )


@pytest.mark.slow
@needs("gcc")
@pytest.mark.parametrize(("which", "real"), [("few", "double"), ("all", "float")], indirect=["which"])
def test_opencl_on_a_processor(which: str, folder: Path, real: str, monkeypatch: pytest.MonkeyPatch) -> None:
    prelude = f"{WORK_ITEMS}#include <tgmath.h>\n#undef I\n#define REAL {real}"
    dialect = LoopDialect(prelude, "{module}_{kernel}", "{module}_{kernel}_batch", (real,), "long")
    text = drivers.c_driver(calls(which), [f"{name}.cl" for name in modules(which)], dialect)
    found = run_on_processor(which, "gcc", folder / f"main_{real}.c", "-std=c99", text, monkeypatch)
    check(which, found, np.float64 if real == "double" else np.float32)


UNOPTIMISED = ("-O0", "-Xcicc", "-O0", "-Xptxas", "-O0")
"""nvcc then takes a fifth of the time."""


@pytest.mark.slow
@needs("nvcc")
@pytest.mark.parametrize("which", ["few"], indirect=True)
def test_cuda_on_the_host(which: str, folder: Path) -> None:
    """Other tests compile all kernels with nvcc for a device, and run them on a processor."""
    dialect = LoopDialect("", "{module}::{kernel}", "", ("double", "float"), "long long")
    (folder / "main.cu").write_text(drivers.c_driver(calls(which), [f"{name}.cu" for name in modules(which)], dialect))
    flags = (*UNOPTIMISED, "-Werror", "all-warnings", "-Xcompiler", "-ffp-contract=off")
    compiled("nvcc", *flags, folder / "main.cu", "-o", folder / "in_cuda")
    check(which, drivers.run(calls(which), [str(folder / "in_cuda")], folder), np.float64, np.float32)


@pytest.mark.slow
@needs("nvcc")
def test_cuda_on_a_device_compiles(which: str, folder: Path) -> None:
    for name, module in modules(which).items():
        path = folder / f"{name}.ptx"
        compiled(
            "nvcc", *UNOPTIMISED, "-ptx", "-fmad=false", "-Werror", "all-warnings", folder / f"{name}.cu", "-o", path
        )
        for loop in module.loops:
            for suffix in ("f64", "f32"):
                assert f".entry {name}_{loop.procedure.name}_{suffix}(" in path.read_text()


@needs("gcc")
def test_opencl_distinguishes_address_spaces(which: str, folder: Path) -> None:
    """Parts accept private memory only: nothing else compiles with a different address space for __global."""
    if "x86" not in os.uname().machine:
        pytest.skip("no memories with names in C on this processor")
    prelude = "#include <tgmath.h>\n#undef I\n#define __kernel\n#define __global __seg_gs\n#define get_global_id(k) 0\n"
    prelude += "#define get_global_size(k) 1\n"
    path = folder / "memories.c"
    for name in modules(which):
        path.write_text(f'{prelude}#include "{name}.cl"\n')
        compiled("gcc", "-std=gnu99", "-fsyntax-only", *FLAGS, path)
    text = (folder / "loops.cl").read_text()
    start = "REAL tool_row[8]"
    assert start in text
    path.write_text(f"{prelude}{text.replace(start, f'loops_forward_1(out); {start}')}")
    done = subprocess.run(["gcc", "-std=gnu99", "-fsyntax-only", str(path)], capture_output=True, text=True)
    assert done.returncode != 0 and "address space" in done.stderr


def alone(name: str, change: Callable[[Procedure], Procedure]) -> ModuleSource:
    """A module of one example after a change."""
    source = sources()[name]
    return ModuleSource("odd", "", "gac", "00", (), (replace(source, procedure=change(source.procedure)),))


@all_cases("target", TARGETS)
def test_rows_that_may_not_exist_are_rejected(target: str) -> None:
    def written(procedure: Procedure) -> Procedure:
        loop = next(each for each in procedure.body if isinstance(each, Loop))
        copy = Copy(Place("x", Counter("i")), Place("out_0", Previous("i", "s_start")))
        return replace(procedure, body=(replace(loop, body=(copy,)),))

    with pytest.raises(BackendError, match=f"(?i){target} text of tree: a row of out_0 is written at"):
        render_targets(alone("tree", written), [target])


def test_rust_rejects_two_rows_of_one_table() -> None:
    def doubled(procedure: Procedure) -> Procedure:
        def inside(statement: Statement) -> Statement:
            if isinstance(statement, Loop):
                return replace(statement, body=tuple(map(inside, statement.body)))
            if isinstance(statement, Apply):
                return replace(statement, outputs=statement.outputs[:1] * len(statement.outputs))
            return statement

        return replace(procedure, body=tuple(map(inside, procedure.body)))

    with pytest.raises(BackendError, match="Rust text of kept: a part that writes two rows of one of"):
        render_targets(alone("kept", doubled), ["rust"])


def test_functions_have_unique_names(tmp_path: Path) -> None:
    """Kernels may have names that would collide with parts, work spaces and functions over batches."""
    taken = ("squares_1", "squares_work", "squares_strided", "squares_batch", "squares_work_", "forward_1_batch")
    programs = [
        Program(name, (Argument("x", (), ("x",)),), (), (Result("out", (), ("x",)),)) for name in (*taken, "k", "work")
    ]
    own = module_source("odd", *programs)
    module = replace(own, loops=loop_module("odd", squares, forward, backwards).loops)
    for name, text in render_targets(module, TARGETS).items():
        (tmp_path / name).write_text(text)
        declared = re.findall(r"^(?:\S.*\b)?(?:void|fn|function|long) (\w+\$?)[<(]", text, re.MULTILINE)
        assert len(declared) == len(set(declared)) > 20, name
    if runs("node"):
        compiled("node", "--check", tmp_path / "odd.mjs")
    if runs("rustc"):
        compiled("rustc", "--edition", "2021", "--crate-type", "lib", "-o", tmp_path / "odd.rlib", tmp_path / "odd.rs")


@pytest.mark.slow
def test_text_is_the_same_for_every_seed() -> None:
    statements = (
        "from loop_examples import *; from gacompiler.generation.rendering import *; "
        "m = loop_module('one', forward, tree, picked, kept, matrix_sums)"
    )
    assert is_the_same_for_every_hash_seed(statements, f"''.join(render_targets(m, {TARGETS}).values())")


@pytest.mark.parametrize("module", some_slow(["loops", "robots"], "robots"))
def test_files_document_their_arguments(module: str) -> None:
    source = robots() if module == "robots" else modules("few")["loops"]
    for name, text in render_targets(source, TARGETS).items():
        assert body_is_intact(text), name
        head = text[: text.index(source.loops[0].procedure.name)]
        assert "Kernels with loops" in head and "lengths of their tables" in " ".join(head.split()), name
        assert re.search(r"work\[\d+ \* n\]  for intermediate rows\.$", text, re.MULTILINE), name
        assert re.search(r"work\[0\]  not used\.$", text, re.MULTILINE), name
        assert max(map(len, text[len(head) :].splitlines())) <= 120, name
        plain = render_targets(module_source("plain", MOVE_POINT), TARGETS)[name.replace(module, "plain")]
        assert "loops" not in plain
