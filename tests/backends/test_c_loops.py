"""Kernels with loops in C: single elements equal the interpreted procedure, batches equal them bit for bit."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from loop_examples import (
    EXAMPLES,
    arguments,
    chain,
    element,
    forward,
    interpreted,
    loop_module,
    loop_source,
    newton,
    shares,
    tree,
)
from loop_libraries import (
    Array,
    build_loops,
    call_one,
    call_rows,
)
from selection import some_slow

from gacompiler.backends import c_header, find_compiler, standalone_c_source
from gacompiler.backends.transcendental import is_transcendental
from gacompiler.frontend.kernel import Kernel
from gacompiler.ir.procedure import Procedure
from tests.support.all_cases import all_cases
from tests.support.unoptimised import without_optimisation

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")

MODULE = "loops"
LENGTHS = [{"n": 1, "m": 1, "k": 1}, {"n": 5, "m": 3, "k": 7}, {"n": 2, "m": 9, "k": 1}, {"n": 33, "m": 4, "k": 20}]
BATCHES = [0, 1, 3, 7, 17, 30]
"""Fewer than fill lanes, and after full lanes: one element, and as many as are computed in lanes that are not full."""


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The examples, built without optimisation; the modules that other tests call are built with it."""
    folder = tmp_path_factory.mktemp("loops")
    with without_optimisation():
        return build_loops(loop_module(MODULE, *EXAMPLES), folder)


def _procedure(definition: Kernel) -> Procedure:
    return loop_source(definition).procedure


def _of(procedure: Procedure, lengths: Mapping[str, int]) -> dict[str, int]:
    return {name: lengths[name] for name in procedure.lengths}


def _same(a: list[Array], b: list[Array]) -> bool:
    return all(np.array_equal(x, y, equal_nan=True) for x, y in zip(a, b, strict=True))


@pytest.mark.parametrize("number", [float, np.float32])
@pytest.mark.parametrize("definition", EXAMPLES, ids=lambda kernel: kernel.name)
def test_one_element_equals_the_interpreted_procedure(
    library: ctypes.CDLL, definition: Kernel, number: type[float] | type[np.float32]
) -> None:
    procedure = _procedure(definition)
    for seed, sizes in enumerate(LENGTHS if number is float else LENGTHS[:3]):
        lengths = _of(procedure, sizes)
        given = arguments(procedure, lengths, seed, dtype=np.dtype(number))
        found = call_one(library, MODULE, procedure, lengths, given)
        expected = interpreted(procedure, lengths, given, number)
        if any(map(is_transcendental, procedure.programs)):
            for a, b in zip(found, expected, strict=True):
                assert np.abs(a - b).max() <= 100 * np.finfo(np.dtype(number)).eps * np.abs(b).max()
        else:
            assert _same(found, expected), (sizes, found, expected)


@all_cases("definition", EXAMPLES)
def test_no_rows(library: ctypes.CDLL, definition: Kernel) -> None:
    procedure = _procedure(definition)
    lengths = dict.fromkeys(procedure.lengths, 0)
    given = arguments(procedure, lengths, 1)
    found = call_one(library, MODULE, procedure, lengths, given)
    assert _same(found, interpreted(procedure, lengths, given))
    many = call_rows(library, MODULE, procedure, lengths, given, 20)
    for k in range(20):
        assert _same([result[k] for result in many], found)


@all_cases("dtype", [np.float64, np.float32])
@all_cases("definition", EXAMPLES)
def test_batches_equal_single_elements(library: ctypes.CDLL, definition: Kernel, dtype: type) -> None:
    procedure = _procedure(definition)
    lengths = _of(procedure, LENGTHS[1])
    for count in BATCHES:
        given = arguments(procedure, lengths, count, (count,), dtype)
        found = call_rows(library, MODULE, procedure, lengths, given, count)
        for k in range(count):
            one = call_one(library, MODULE, procedure, lengths, element(procedure, lengths, given, k))
            assert _same([result[k] for result in found], one), (count, k)


@all_cases("definition", EXAMPLES)
def test_each_argument_may_be_uniform(library: ctypes.CDLL, definition: Kernel) -> None:
    procedure, count = _procedure(definition), 37
    lengths = _of(procedure, LENGTHS[1])
    varying = arguments(procedure, lengths, 5, (count,))
    for name, array in varying.items():
        uniform = varying | {name: array[3] if array.ndim and len(array) == count else array}
        found = call_rows(library, MODULE, procedure, lengths, uniform, count)
        for k in range(count):
            one = call_one(library, MODULE, procedure, lengths, element(procedure, lengths, uniform, k))
            assert _same([result[k] for result in found], one), (name, k)


@pytest.mark.parametrize("definition", [forward, shares], ids=lambda kernel: kernel.name)
def test_shared_tables_may_vary_after_all(library: ctypes.CDLL, definition: Kernel) -> None:
    procedure, count = _procedure(definition), 37
    lengths = _of(procedure, LENGTHS[1])
    unshared = replace(procedure, tables=tuple(replace(table, shared=False) for table in procedure.tables))
    given = arguments(unshared, lengths, 5, (count,))
    found = call_rows(library, MODULE, procedure, lengths, given, count)
    for k in range(count):
        one = call_one(library, MODULE, procedure, lengths, element(procedure, lengths, given, k))
        assert _same([result[k] for result in found], one)


def test_angles_too_large_for_the_loops(library: ctypes.CDLL) -> None:
    procedure, count, lengths = _procedure(forward), 50, {"n": 6}
    given = arguments(procedure, lengths, 5, (count,))
    given["q"][17, 2], given["q"][49, 5] = 1e9, np.inf
    found = call_rows(library, MODULE, procedure, lengths, given, count)
    for k in range(count):
        one = call_one(library, MODULE, procedure, lengths, element(procedure, lengths, given, k))
        assert _same([result[k] for result in found], one)
    angles = given["q"][17]
    moved = call_one(library, MODULE, procedure, lengths, element(procedure, lengths, given, 17))
    rest = given["q"][17].copy()
    rest[2] = 2 * np.arctan2(np.sin(angles[2] / 2), np.cos(angles[2] / 2))
    near = call_one(
        library, MODULE, procedure, lengths, element(procedure, lengths, given, 17) | {"q": rest}
    )  # half an angle and its remainder have the same sine
    assert np.allclose(moved[0], near[0], rtol=1e-12)
    assert np.isnan(found[0][49]).any() and np.isfinite(found[0][48]).all()


def test_steps_may_be_negative(library: ctypes.CDLL) -> None:
    procedure, lengths = _procedure(chain), {"n": 4}
    given = arguments(procedure, lengths, 5, (40,))
    found = call_rows(library, MODULE, procedure, lengths, given, 40)
    results = [np.zeros((40, 4, 8)), np.zeros((40, 4, 3))]
    arrays = [given["moves"], given["points"], *results]
    steps = (ctypes.c_ssize_t * 4)(*(-array.strides[0] for array in arrays))
    pointers = (ctypes.c_void_p * 4)(*(array[-1].ctypes.data for array in arrays))
    assert library.loops_chain_rows_f64((ctypes.c_ssize_t * 1)(4), pointers, steps, ctypes.c_ssize_t(40)) == 0
    assert _same(results, found)


def test_out_of_memory_is_reported(library: ctypes.CDLL) -> None:
    """Nothing is read or written if the work space is larger than any memory."""
    procedure = _procedure(tree)
    pointers = (ctypes.c_void_p * 5)()
    steps, lengths = (ctypes.c_ssize_t * 5)(), (ctypes.c_ssize_t * 1)(1 << 55)
    assert len(procedure.parameters) + len(procedure.results) == 5
    assert library.loops_tree_rows_f64(lengths, pointers, steps, ctypes.c_ssize_t(1)) == 1


def test_steps_of_an_iteration(library: ctypes.CDLL) -> None:
    """An iteration ends when its condition holds, at a different step for each element."""
    procedure, lengths = _procedure(newton), {"n": 2}
    a = np.array([1.0, 1.1, 4.0, 1e12] * 5)
    found = call_rows(library, MODULE, procedure, lengths, {"x": np.ones(2), "a": a}, 20)
    assert np.allclose(found[0][:3], 2 * np.sqrt(a[:3])) and list(found[1][:4]) == [1, 1, 1, 0]
    assert found[2][0] == 1 < found[2][1] < found[2][2] <= 6 == found[2][3]


PROGRAM = r"""
#include <stdio.h>
#include "loops.h"

int main(void)
{
    const double q[] = {0.25, -1, 0.5}, axes[18] = {0, 1, 0, 0, 0, 2, 1, 0, 0, 3, 0, 0, 0, 0, 1, 0, -1, 0};
    const double tool[] = {1, 0, 0, 0, 0.5, 0, 0, 0}, x[] = {1, 2, 4, 8}, scale = 3;
    const int64_t parents[] = {-1, 0, 0, 2};
    double out[8], up[4], down[4], work[4];
    loops_forward_f64(3, q, axes, tool, out, NULL);
    for (int k = 0; k < 8; ++k)
        printf("%.17g\n", out[k]);
    if (loops_tree_work(4) != 4)
        return 1;
    loops_tree_f64(4, x, parents, scale, up, down, work);
    for (int k = 0; k < 4; ++k)
        printf("%.17g\n", down[k]);
    const intptr_t lengths[] = {4}, steps[5] = {0};
    char *args[] = {(char *)x, (char *)parents, (char *)&scale, (char *)up, (char *)down};
    return loops_tree_rows_f64(lengths, args, steps, 1);
}
"""


@pytest.mark.parametrize("kind", some_slow(["with the runtime", "standalone"], "with the runtime"))
def test_plain_c_program(library: ctypes.CDLL, tmp_path: Path, kind: str) -> None:
    """A program in C that includes the header and is compiled with all warnings prints the same numbers.

    A standalone file is compiled for one width of vectors, which takes a tenth of the time.
    """
    module = loop_module(MODULE, forward, tree)
    folder = Path(__file__).parents[2] / "gacompiler" / "gac_runtime"
    files = ["loops.c"]
    if kind == "standalone":
        (tmp_path / "loops.c").write_text(standalone_c_source(module))
        (tmp_path / "loops.h").write_text(c_header(module))
    else:
        build_loops(module, tmp_path)
        shutil.copytree(folder, tmp_path / "gac_runtime", dirs_exist_ok=True)
        files.append("gac_runtime/gac_runtime.c")
    (tmp_path / "program.c").write_text(PROGRAM)
    options = ["-std=c17", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O0", "-ffp-contract=off"]
    options += ["-DGAC_ONE_WIDTH"] * (kind == "standalone")
    compiler = find_compiler()
    assert compiler is not None
    command = [*compiler, *options, "program.c", *files, "-lm", "-o", "program"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True)
    printed = subprocess.run([tmp_path / "program"], check=True, capture_output=True, text=True).stdout
    axes = [0, 1, 0, 0, 0, 2, 1, 0, 0, 3, 0, 0, 0, 0, 1, 0, -1, 0]
    given: dict[str, Array] = {
        "q": np.array([0.25, -1, 0.5]),
        "axes": np.reshape(np.array(axes, dtype=float), (3, 6)),
        "tool": np.array([1, 0, 0, 0, 0.5, 0, 0, 0]),
    }
    expected = call_one(library, MODULE, _procedure(forward), {"n": 3}, given)[0]
    # 10 is scale squared plus 1; each branch is summed from its leaves.
    assert [float(line) for line in printed.split()] == [*expected, 220, 30, 180, 130]
