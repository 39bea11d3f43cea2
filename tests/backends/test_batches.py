"""An element has the same result in a batch as alone, to the last bit, for any memory layout of the batch."""

from __future__ import annotations

import ctypes
import importlib
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from selection import some_slow

from gacompiler.backends import runtime_files
from gacompiler.backends.build import compiler_flags, find_compiler
from gacompiler.generation.checked_in import own_specs
from gacompiler.generation.files import write
from generated.gac_runtime.arrays import steps_of
from tests.support.all_cases import all_cases

ROOT = Path(__file__).parents[2]

N_ELEMENTS = 83
"""Some blocks of a loop, and what is left of one."""


MODULES = [path.stem for path in own_specs()]


@all_cases("name, dtype", [*((name, np.float64) for name in MODULES), ("pga3", np.float32)])
def test_an_element_alone_and_in_a_batch(name: str, dtype: Any) -> None:
    compare_batches(name, dtype)


@pytest.mark.slow
@all_cases("name", MODULES)
def test_a_float_element_alone_and_in_a_batch(name: str) -> None:
    """Slow, since the libraries of floats of all modules are compiled."""
    compare_batches(name, np.float32)


def compare_batches(name: str, dtype: Any) -> None:
    module = importlib.import_module(f"generated.{name}")
    rng = np.random.default_rng(3)
    for each in module.kernels:
        kernel = getattr(module, each)
        if not isinstance(kernel, module.Kernel):
            continue  # those with loops have no fixed shapes; `gac verify` runs them in batches
        arrays = [rng.normal(size=(N_ELEMENTS, *shape)).astype(dtype) for shape in kernel.definition.shapes]
        # With the same element twice, each product that must vanish is a difference of equal products.
        arrays = [arrays[0] if a.shape == arrays[0].shape and rng.random() < 0.5 else a for a in arrays]
        with np.errstate(all="ignore"):
            alone = [_results(kernel(*(array[i] for array in arrays))) for i in range(N_ELEMENTS)]
            for order in "CF":
                batch = _results(kernel(*(np.asarray(array, order=order) for array in arrays)))
                for k, result in enumerate(batch):
                    one = np.array([results[k] for results in alone])
                    assert one.dtype == result.dtype == dtype
                    np.testing.assert_array_equal(result, one, f"{name}.{each}, {order} order")


def _results(found: Any) -> tuple[Any, ...]:
    return found if isinstance(found, tuple) else (found,)


def test_a_bivector_of_a_vector_with_itself_is_zero_in_a_batch() -> None:
    from generated import vga2

    a = np.random.default_rng(0).normal(size=(1000, 2))
    assert not vga2.vector_product(a, a)[:, 1:].any()


WIDTHS = {"no vectors": -1, "AVX2": 0, "AVX-512": 1}
"""The loops of a C file that machines choose from, by their number there."""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The library of vga2; an environment variable selects the loops that run."""
    compiler = find_compiler()
    if compiler is None or "avx512dq" not in _features() or not re.search("gcc|Free Software", _version(compiler)):
        pytest.skip("needs gcc, and a machine that has all of the widths")
    folder = tmp_path_factory.mktemp("widths")
    for ending in ("c", "h"):
        shutil.copy(ROOT / "generated" / f"vga2.{ending}", folder)
    write(runtime_files(), folder)
    header = folder / "gac_runtime" / "gac_runtime.h"
    text = header.read_text()
    for name, value in (("CHOSEN", "chosen_width\nextern int chosen_width;"), ("HAS_v3", "(chosen_width >= 0)")):
        text, count = re.subn(rf"(#define {name}) .*", rf"\1 {value}", text, count=1)
        assert count == 1
    header.write_text(text)
    (folder / "width.c").write_text("int chosen_width;\n")
    built = folder / "vga2.so"
    flags = [*compiler_flags(compiler), "-shared", "-o", str(built)]
    sources = ["vga2.c", "width.c", "gac_runtime/gac_runtime.c"]
    subprocess.run([*compiler, *flags, *sources, "-lm"], cwd=folder, check=True)
    return ctypes.CDLL(str(built))


@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
def test_all_machines_compute_the_same(width: str, library: ctypes.CDLL) -> None:
    """Select every kind of loop that this machine can run, independently of its own choice."""
    ctypes.c_int.in_dll(library, "chosen_width").value = WIDTHS[width]
    module = importlib.import_module("generated.vga2")
    rng = np.random.default_rng(4)
    for name in module.kernels:
        kernel = getattr(module, name)
        for dtype, ending in ((np.float64, "f64"), (np.float32, "f32")):
            arrays = [rng.normal(size=(N_ELEMENTS, *shape)).astype(dtype) for shape in kernel.definition.shapes]
            right = _results(kernel(*arrays))
            results = [np.empty_like(each) for each in right]
            parts = [*arrays, *results]
            steps = [part.strides[0] for part in parts] + [step for part in parts for step in part.strides[1:]]
            addresses = (ctypes.c_void_p * len(parts))(*(part.ctypes.data for part in parts))
            size, strides = (ctypes.c_ssize_t * 1)(N_ELEMENTS), (ctypes.c_ssize_t * len(steps))(*steps)
            getattr(library, f"vga2_{name}_loop_{ending}")(addresses, size, strides)
            for one, other in zip(results, right, strict=True):
                np.testing.assert_array_equal(one, other, f"{name}, {ending}")


def _features() -> str:
    facts = Path("/proc/cpuinfo")
    return facts.read_text() if facts.exists() else ""


def _version(compiler: tuple[str, ...]) -> str:
    return subprocess.run([*compiler, "--version"], capture_output=True, text=True).stdout


BEYOND = 1 << 25
"""Bytes of a batch in structure-of-arrays order beyond which results of few rows are written past the caches."""


@pytest.mark.parametrize(("dtype", "shift", "odd"), [(np.float64, 5, 5), (np.float32, 1, 0)])
def test_results_larger_than_any_cache(dtype: Any, shift: int, odd: int) -> None:
    """Rows begin `shift` numbers after a line of a cache, and with an odd number of elements lie differently in it."""
    from generated import pga3, vga3

    # The same amount in each of two threads, and with elements of seven numbers.
    n = BEYOND // (5 * np.dtype(dtype).itemsize) // 16 * 16 + 1600 + odd
    assert n // 2 * 10 * np.dtype(dtype).itemsize > BEYOND
    rng = np.random.default_rng(shift)
    rotor, vector = (_rows(rng.random((n, size), dtype), shift) for size in (4, 3))
    found = vga3.rotate_vector(rotor, vector, out=_rows(np.full((n, 3), np.nan, dtype), shift))
    few = [slice(0, 2000), slice(n // 2, n // 2 + 2000), slice(n - 2000, n)]
    for part in few:
        np.testing.assert_array_equal(found[part], vga3.rotate_vector(rotor[part].copy(), vector[part].copy()))
    # In threads, in place, and by a form for one uniform argument.
    again = vga3.rotate_vector(rotor, vector, num_threads=2)
    np.testing.assert_array_equal(again, found)
    one = vga3.rotate_vector(rotor[0], _rows(np.tile(vector, (3, 1)), shift))
    for part in few:
        np.testing.assert_array_equal(one[part], vga3.rotate_vector(rotor[0], vector[part].copy()))
    vga3.rotate_vector(rotor, vector, out=vector)
    np.testing.assert_array_equal(vector, found)
    # One number for each element.
    assert n * 7 * np.dtype(dtype).itemsize > BEYOND
    length = pga3.distance_points(_rows(found, shift), _rows(again, shift))
    assert not length.any()


@pytest.mark.parametrize("dtype", some_slow([np.float64, np.float32], np.float32))
@all_cases("shift", [0, 1, 5])
@all_cases("n", [600, 1003, 12000, 12001])
def test_many_rows_of_results(dtype: Any, shift: int, n: int) -> None:
    """From sizes at which whole lines are stored to those that bypass the caches; also in place."""
    from generated import cga3

    a, b = (_rows(np.random.default_rng(k).random((n, 32), dtype), 3 * k) for k in (1, 2))
    right = np.empty((n, 32), dtype)
    for first in range(0, n, 100):
        some = slice(first, first + 100)
        right[some] = cga3.geometric_product(a[some].copy(), b[some].copy())
    found = cga3.geometric_product(a, b, out=_rows(np.full((n, 32), np.nan, dtype), shift))
    np.testing.assert_array_equal(found, right)
    np.testing.assert_array_equal(cga3.geometric_product(a, b, out=a), right)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_elements_in_order_larger_than_any_cache(dtype: Any) -> None:
    from generated import pga3

    n = (1 << 24) // (14 * np.dtype(dtype).itemsize) + 2007
    lines = np.random.default_rng(4).random((n, 6), dtype)
    found = pga3.motor_exponential(lines)
    for part in (slice(0, 2000), slice(n // 2, n // 2 + 2000), slice(n - 2000, n)):
        np.testing.assert_array_equal(found[part], pga3.motor_exponential(lines[part]))


def _rows(array: np.ndarray, shift: int) -> np.ndarray:
    """A copy whose components are contiguous, and start `shift` numbers after a line of a cache."""
    room = np.empty(array.size + 64 + shift, array.dtype)
    first = -(room.ctypes.data // array.itemsize) % (64 // array.itemsize) + shift
    rows = room[first : first + array.size].reshape(array.shape[::-1]).T
    rows[...] = array
    return rows


@all_cases("given", [(2, 3), (1, 3), (2, 1), (1, 1), (3,), (1,), ()])
@all_cases("shape", [(), (4,), (4, 5)])
def test_steps_of_arrays_are_those_of_numpy(given: tuple[int, ...], shape: tuple[int, ...]) -> None:
    """Along axes of a batch that an argument lacks, or has only one element of, it does not move."""
    array = np.ones((*given, *shape, 2))[..., 0]
    assert steps_of(array, (2, 3), shape) == np.broadcast_to(array, (2, 3, *shape)).strides
