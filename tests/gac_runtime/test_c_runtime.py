"""The C runtime of generated modules: its constants and tiles, other compilers and machines, and standalone files."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from backend_programs import ALL_OPERATIONS, INTERPOLATE, MOVE_POINT, NORMALIZE, inputs, module_source, write

from gacompiler.backends import c_header, c_source, library_path, runtime_files, standalone_c_source
from gacompiler.backends.approximations import APPROXIMATIONS, FARTHEST, coefficients, numbers
from gacompiler.backends.build import build_library, compiler_flags, find_compiler
from gacompiler.backends.c import RUNTIME_INTERFACE
from gacompiler.backends.c_batch import FEW, FLAGS, MOST_AXES, TILES
from gacompiler.errors import BackendError
from gacompiler.gac_runtime.build import build
from gacompiler.gac_runtime.names import LEVEL_FLAGS
from gacompiler.gac_runtime.processor import PORTABLE, machine_level
from gacompiler.generation.files import write as write_files
from tests.support.all_cases import all_cases

HEADER = runtime_files()["gac_runtime/gac_runtime.h"]
PRECISIONS = {"f64": np.float64, "f32": np.float32}
needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")


# Constants in the header.


def defined(name: str) -> str:
    """The definition of a macro of the header."""
    found = re.search(rf"^#define {name} (.*)$", HEADER, re.M)
    assert found is not None
    return found[1]


@all_cases("precision", PRECISIONS)
@all_cases("name", APPROXIMATIONS)
def test_polynomials_equal_computed_ones(name: str, precision: str) -> None:
    function = HEADER.partition(f"gac_{name}_polynomial_{precision}(")[2].partition("}")[0]
    halves = [re.findall(r"-?\d+\.\d+(?:e[+-]?\d+)?|-?\d+e-?\d+", part) for part in function.split("odd = ")]
    # In Horner's scheme the coefficient of the highest power is innermost and written first.
    found = [list(map(float, reversed(half))) for half in halves]
    wanted = coefficients(name, double=precision == "f64")
    assert found == [list(wanted[0::2]), list(wanted[1::2])]


def test_constants_equal_computed_ones() -> None:
    doubles, floats = numbers(double=True), numbers(double=False)
    for name, value in doubles.items():
        double, single = re.fullmatch(r"PRECISION\((.*), (.*)f\)", defined(name.upper())).groups()  # type: ignore[union-attr]
        assert (float(double), float(single)) == (value, floats[name])
    assert int(defined("GAC_FARTHEST")) == FARTHEST


def test_limits_equal_those_of_the_emitter() -> None:
    limits = {"FLAGS": FLAGS, "MOST_AXES": MOST_AXES, "TILE_NUMBERS": TILES, "RUNTIME_INTERFACE": RUNTIME_INTERFACE}
    assert {name: int(defined(f"GAC_{name}")) for name in limits} == limits
    driver = runtime_files()["gac_runtime/gac_runtime.c"]
    parts = driver.split("#define MANY_SPANS(M)")[:2]
    sizes = [[int(size) for size in re.findall(r"\bM\((\d+)\)", part)] for part in parts]
    assert sizes[0] == list(range(1, FEW + 1)) and sizes[1] == list(range(FEW + 1, TILES + 1))


# Tiles.

_TILES = """
#ifndef REAL
#include "gac_runtime/gac_runtime.h"
#define SIZES(M) {sizes}
#define REAL double
#define PRECISION(of_double, of_float) of_double
#include "tiles.c"
#undef REAL
#undef PRECISION
#define REAL float
#define PRECISION(of_double, of_float) of_float
#include "tiles.c"
#else
#define FUNCTIONS(n)                                                                             \\
    GAC_TILE(n)                                                                                  \\
    void GAC(shown_load_##n)(REAL *x, intptr_t row, REAL *a) {{ GAC(load_tile_##n)(x, row, a); }}  \\
    void GAC(shown_store_##n)(REAL *a, REAL *x, intptr_t row) {{ GAC(store_tile_##n)(a, x, row); }}
SIZES(FUNCTIONS)
#endif
"""


FEW_SIZES = (*range(1, 10), TILES - 1, TILES)
"""The sizes with separate code, each remainder of the size of a vector, and the largest."""


@needs_compiler
@pytest.mark.parametrize(
    ("options", "sizes"),
    [
        (("-O0",), FEW_SIZES),
        (("-O0", "-DGAC_ONE_WIDTH"), range(1, TILES + 1)),
        pytest.param(("-O1",), range(1, TILES + 1), marks=pytest.mark.slow),
    ],
    ids=["vectors of a few sizes", "loops", "vectors"],
)
def test_tiles_hold_components(options: tuple[str, ...], sizes: Sequence[int], tmp_path: Path) -> None:
    """Functions load and store a tile of every size, with and without vector instructions."""
    write_files(runtime_files(), tmp_path)
    (tmp_path / "tiles.c").write_text(_TILES.format(sizes=" ".join(f"M({size})" for size in sizes)))
    command = [*(find_compiler() or ()), *options, "-fPIC", "-shared", "tiles.c", "-o", "tiles.so", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    tiles = ctypes.CDLL(str(tmp_path / "tiles.so"))
    for size in sizes:
        for precision in PRECISIONS:
            try:
                check_tile(size, precision, tiles)
            except AssertionError as error:
                raise AssertionError(f"a tile of size {size} in {precision}") from error


def check_tile(size: int, precision: str, tiles: ctypes.CDLL) -> None:
    dtype: Any = PRECISIONS[precision]
    width, row = 32 // np.dtype(dtype).itemsize, 40
    elements = np.arange(1, width * size + 1, dtype=dtype).reshape(width, size)
    rows = np.full((size, row), -1, dtype)

    def address(array: Any) -> ctypes.c_void_p:
        return ctypes.c_void_p(array.ctypes.data)

    load, store = (getattr(tiles, f"gac_shown_{what}_{size}_{precision}") for what in ("load", "store"))
    load(address(rows), ctypes.c_ssize_t(row), address(elements))
    np.testing.assert_array_equal(rows[:, :width], elements.T)
    assert (rows[:, width:] == -1).all()
    # Nothing is written before or after the elements.
    memory = np.full(width * size + 2, -1, dtype)
    store(address(memory[1:]), address(rows), ctypes.c_ssize_t(row))
    np.testing.assert_array_equal(memory[1:-1], elements.ravel())
    assert memory[0] == memory[-1] == -1


# Other machines and compilers.

VARIOUS = (MOVE_POINT, NORMALIZE, INTERPOLATE, ALL_OPERATIONS)
"""Programs with every operation, numbers and elements as arguments, and one or two results."""


def loop_results(library: Path, module: str, n: int) -> list[bytes]:
    """The results of all programs on a batch in C order and one in Fortran order."""
    loaded = ctypes.CDLL(str(library))
    found = []
    for program in VARIOUS:
        for precision, dtype in PRECISIONS.items():
            for order in "CF":
                arrays = inputs(program, (n,), dtype, order)
                parts = [*arrays, *(np.full((n, *result.shape), np.nan, dtype, order) for result in program.results)]
                steps = [part.strides[0] for part in parts] + [step for part in parts for step in part.strides[1:]]
                addresses = (ctypes.c_void_p * len(parts))(*(part.ctypes.data for part in parts))
                loop = getattr(loaded, f"{module}_{program.name}_loop_{precision}")
                loop(addresses, (ctypes.c_ssize_t * 1)(n), (ctypes.c_ssize_t * len(steps))(*steps))
                for part in parts[len(arrays) :]:
                    found.append(np.where(np.isnan(part), abs(part), part).tobytes())
    return found


@pytest.mark.slow
@needs_compiler
def test_a_machine_without_supported_vector_instructions(tmp_path: Path) -> None:
    """Code compiled without the macros for x86-64 gives the same numbers."""
    c_path = write(module_source("kernels", *VARIOUS), tmp_path)
    write_files(runtime_files(), tmp_path)
    compiler = find_compiler()
    library = build_library(c_path)
    assert compiler is not None and library is not None
    options = [*compiler_flags(compiler), "-Wall", "-Wextra", "-Werror", "-DGAC_ONE_WIDTH", "-shared", "-o", "plain.so"]
    command = [*compiler, *options, "kernels.c", "gac_runtime/gac_runtime.c", "-lm"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[:2000]
    for n in (1, 2, 3, 40, 101):
        assert loop_results(tmp_path / "plain.so", "kernels", n) == loop_results(library, "kernels", n)


@pytest.mark.slow
@needs_compiler
@pytest.mark.skipif(machine_level() < 3, reason="needs x86-64 with AVX2 on Linux")
def test_libraries_for_each_kind_of_machine_compute_the_same(tmp_path: Path) -> None:
    """Test the libraries for every level that this machine can run, and the combined library."""
    c_path = write(module_source("kernels", *VARIOUS), tmp_path)
    levels = [level for level in LEVEL_FLAGS if level <= machine_level()]
    libraries = {level: tmp_path / f"level{level}.so" for level in levels}
    for level, library in libraries.items():
        build({c_path: library}, level=level)
        runs_here = getattr(ctypes.CDLL(str(library)), "gac_runs_here", None)
        assert runs_here is None if level == PORTABLE else runs_here() == 1
    for n in (1, 2, 3, 40, 101):
        portable, *others = (loop_results(library, "kernels", n) for library in libraries.values())
        assert len(others) >= 2 and all(other == portable for other in others)


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("clang"), reason="no clang on the PATH")
def test_clang_compiles_it(tmp_path: Path) -> None:
    write(module_source("kernels", MOVE_POINT, NORMALIZE, ALL_OPERATIONS), tmp_path)
    write_files(runtime_files(), tmp_path)
    options = ["-std=c17", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O3", "-ffp-contract=off", "-fPIC", "-shared"]
    # Kernels are inline and call functions that are static, of which every file has its own; some loops are not
    # worth vectorising.
    options += ["-Wno-static-in-inline", "-Wno-pass-failed", "-o", "clang.so"]
    command = ["clang", *options, "kernels.c", "gac_runtime/gac_runtime.c", "-lm"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[:2000]


@needs_compiler
def test_another_version_of_the_runtime_is_rejected(tmp_path: Path) -> None:
    c_path = write(module_source("kernels", MOVE_POINT), tmp_path)
    c_path.write_text(c_source(module_source("kernels", MOVE_POINT)).replace("_INTERFACE != 1", "_INTERFACE != 2"))
    with pytest.raises(BackendError, match="gac_runtime: generate it again"):
        build_library(c_path)
    assert not library_path(c_path).exists()


# Standalone files.

_MAIN = """
#include <stdio.h>
#include "alone.h"
#include "other.h"

int main(void)
{
    const double m[8] = {1, 0, 0, 0, 0.5, 1, 1.5, 0};
    double p[20][3], q[3] = {1, 2, 3};
    float u[3] = {3, 0, 4}, length[1];
    for (int k = 0; k < 20; ++k)
        for (int i = 0; i < 3; ++i)
            p[k][i] = 3 * k + i;
    const intptr_t w = sizeof(double), n = 20, steps[] = {0, 3 * w, 3 * w, w, w, w};
    char *args[] = {(char *)m, (char *)p, (char *)p};
    alone_move_point_loop_f64(args, &n, steps);
    other_interpolate_f64(q, p[19], 0.5, q);
    alone_normalize_f32(u, u, length);
    for (int k = 0; k < 20; ++k)
        printf("%g %g %g ", p[k][0], p[k][1], p[k][2]);
    printf("%g %g %g %g %g\\n", q[0], q[1], q[2], (double)u[0], (double)length[0]);
    return 0;
}
"""


@pytest.mark.slow
@needs_compiler
def test_a_c_program_with_standalone_modules(tmp_path: Path) -> None:
    """Two standalone modules can be linked together, since each has a private copy of the runtime."""
    for name, programs in (("alone", (MOVE_POINT, NORMALIZE)), ("other", (INTERPOLATE, MOVE_POINT))):
        (tmp_path / f"{name}.c").write_text(standalone_c_source(module_source(name, *programs)))
        (tmp_path / f"{name}.h").write_text(c_header(module_source(name, *programs)))
    (tmp_path / "main.c").write_text(_MAIN)
    compiler = find_compiler()
    assert compiler is not None
    options = ["-std=c17", "-Wall", "-Wextra", "-Werror", "-O1", "-ffp-contract=off"]
    command = [*compiler, *options, "main.c", "alone.c", "other.c", "-o", "main", "-lm"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[:2000]
    printed = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout
    found = np.array(printed.split(), float)
    moved = np.arange(60.0).reshape(20, 3) + np.array([1, 2, 3])
    np.testing.assert_array_equal(found[:60].reshape(20, 3), moved)
    np.testing.assert_array_equal(found[60:63], (moved[19] + [1, 2, 3]) / 2)
    assert found[63:] == pytest.approx([0.6, 5])


def test_standalone_text_equals_the_shared_text() -> None:
    """It contains the complete runtime and module, except for include directives and guards."""
    module = module_source("kernels", *VARIOUS)
    alone = set(standalone_c_source(module).splitlines())
    driver = runtime_files()["gac_runtime/gac_runtime.c"]
    held = re.compile(r'#(include "|define (REAL|PRECISION|NAME|GAC_TILE)|if|endif|else|undef|error)|//|GAC_TILE')
    for text in (HEADER.partition("#define GAC_RUNTIME_H")[2], driver, c_source(module)):
        missing = [line for line in text.splitlines() if line not in alone and not held.match(line)]
        assert missing in ([], ["/* Both precisions. */", "/* For each precision. */"])
