"""Kernels under numba, and functions composed of them, equal the C loops bit for bit in any memory order."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from backend_programs import (
    INTERPOLATE,
    MATRIX_PRODUCT,
    MOVE_POINT,
    NORMALIZE,
    PROGRAMS,
    bits,
    load,
    module_source,
    traced,
    write,
)
from selection import some_slow

from gacompiler.backends import find_compiler
from gacompiler.gac_runtime.jit.compiled import Loops
from gacompiler.generation.spec_files import load_spec
from gacompiler.runtime import load_module

Array = np.ndarray[Any, Any]
ROOT = Path(__file__).parents[2]
TYPES = ("float64", "float32")
needs_compiler = pytest.mark.skipif(not find_compiler(), reason="no C compiler")
numba = pytest.importorskip("numba")


@pytest.fixture(name="pair", scope="module")
def pair_fixture(built: Path) -> tuple[ModuleType, ModuleType]:
    """The same module on C and on numba."""
    return on(built, "c"), on(built, "numba")


def on(path: Path, backend: str) -> ModuleType:
    """Load a module on one backend only."""
    module = load_module(path, f"_{path.stem}_on_{backend}", backend)
    assert module.backend == backend
    return module


def in_order(array: Array) -> Array:
    return np.ascontiguousarray(array)


def by_component(array: Array) -> Array:
    return np.asfortranarray(array)


def backwards(array: Array) -> Array:
    return np.ascontiguousarray(array[::-1])[::-1]


def with_gaps(array: Array) -> Array:
    wide = np.zeros([2 * n + 1 for n in array.shape], array.dtype)
    view = wide[tuple(slice(1, None, 2) for _ in array.shape)]
    view[...] = array
    return view


def read_only(array: Array) -> Array:
    array = array.copy()
    array.flags.writeable = False
    return array


ORDERS: tuple[Callable[[Array], Array], ...] = (in_order, by_component, backwards, with_gaps, read_only)


def arguments(kernel: Any, size: int, dtype: str, same: int | None = None) -> list[Array]:
    rng = np.random.default_rng(size)
    return [
        rng.normal(size=shape if k == same else (size, *shape)).astype(dtype)
        for k, shape in enumerate(kernel.definition.shapes)
    ]


@needs_compiler
@pytest.mark.parametrize("order", ORDERS, ids=lambda order: order.__name__)
@pytest.mark.parametrize(
    ("name", "dtype"),
    some_slow([(program.name, dtype) for program in PROGRAMS for dtype in TYPES], ("all_operations", "float32")),
)
def test_batches_equal_those_of_c_bit_for_bit(
    pair: tuple[ModuleType, ModuleType], name: str, dtype: str, order: Callable[[Array], Array]
) -> None:
    c, ours = (getattr(module, name) for module in pair)
    for size in (1, 2, 7, 16, 63, 64, 65, 200, 603):
        given = [order(array) for array in arguments(c, size, dtype)]
        found = ours(*given)
        assert bits(found) == bits(c(*given)), size
        assert all(one.dtype == dtype for one in (found if isinstance(found, tuple) else (found,)))
        # The second call with such arrays takes a different path.
        assert bits(ours(*given)) == bits(found)
    # The compared kernels ran on numba, not in the library.
    assert isinstance(ours._loops[np.dtype(dtype)], Loops)
    assert not any(isinstance(loop, Loops) for loop in c._loops.values())


@needs_compiler
@pytest.mark.parametrize("dtype", TYPES)
def test_mixed_orders_and_a_uniform_argument(pair: tuple[ModuleType, ModuleType], dtype: str) -> None:
    for name in ("move_point", "matrix_product", "interpolate"):
        c, ours = (getattr(module, name) for module in pair)
        for same in (None, 0, 1):
            for first in ORDERS:
                given = arguments(c, 70, dtype, same)
                given[0] = first(given[0])
                given[1] = by_component(given[1])
                assert bits(ours(*given)) == bits(c(*given)), (name, same, first.__name__)


@needs_compiler
@pytest.mark.parametrize("dtype", TYPES)
def test_nan_and_infinity_propagate(pair: tuple[ModuleType, ModuleType], dtype: str) -> None:
    values = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 1.0, 3e38, 1e-45], dtype)
    grid = np.stack(np.meshgrid(values, values, values), -1).reshape(-1, 3)
    for order in (in_order, by_component):
        for c, ours in zip(*([getattr(module, name) for name in ("normalize",)] for module in pair), strict=True):
            for right, found in zip(c(order(grid)), ours(order(grid)), strict=True):
                np.testing.assert_array_equal(found, right)
                finite = ~np.isnan(right)
                np.testing.assert_array_equal(np.signbit(found[finite]), np.signbit(right[finite]))


@pytest.mark.parametrize("dtype", TYPES)
def test_out_may_overlap_an_argument(pair: tuple[ModuleType, ModuleType], dtype: str) -> None:
    product = pair[1].matrix_product
    a, b = arguments(product, 90, dtype)
    right = product(a, b)
    for order in (in_order, by_component, with_gaps):
        for shift in (0, 1, -1):
            room = order(np.concatenate([a, a[:2]]) if shift >= 0 else np.concatenate([a[:2], a]))
            first = 0 if shift >= 0 else 2
            source, out = room[first : first + 90], room[first + shift : first + shift + 90]
            product(source, b, out=out)
            np.testing.assert_array_equal(out, right)


def test_empty_batches_and_more_axes(pair: tuple[ModuleType, ModuleType]) -> None:
    move = pair[1].move_point
    m, p = arguments(move, 12, "float64")
    assert move(m[:0], p[:0]).shape == (0, 3)
    right = move(m[:, None], p[None])
    assert right.shape == (12, 12, 3)
    for k in range(12):
        np.testing.assert_array_equal(right[k], move(m[k], p))
    np.testing.assert_array_equal(move(m.reshape(3, 4, 8)[:, ::2], p.reshape(3, 4, 3)[:, ::2])[1, 1], move(m[6], p[6]))


@pytest.mark.parametrize("dtype", some_slow(TYPES, "float32"))
@pytest.mark.slow
def test_jit_accepts_and_returns_tuples_and_arrays(pair: tuple[ModuleType, ModuleType], dtype: str) -> None:
    module = pair[1]
    move, normalize, product, between, distance = (
        getattr(module, name).jit for name in ("move_point", "normalize", "matrix_product", "interpolate", "distance")
    )

    @numba.njit
    def run(m: Any, p: Any, a: Any, t: Any, out: Any, lengths: Any, squares: Any) -> None:
        for k in range(len(p)):
            moved = move(m[k], p[k])
            unit, length = normalize(moved)
            rows = product(product(a[k], a[k]), a[k])
            between(unit, p[k], t[k], out[k])
            lengths[k] = length + distance(rows[1][2], unit[0])
            product(a[k], rows, squares[k])

    # Other tests call it with contiguous elements of the quick type.
    for order in (backwards, with_gaps, *([in_order] if dtype == "float32" else [])):
        m, p = map(order, arguments(module.move_point, 9, dtype))
        a, t = order(np.random.default_rng(1).normal(size=(9, 4, 4)).astype(dtype)), p[:, 1].copy()
        out, lengths, squares = np.empty((9, 3), dtype), np.empty(9, dtype), order(np.empty((9, 4, 4), dtype))
        run(m, p, a, t, out, lengths, squares)
        unit, length = module.normalize(module.move_point(m, p))
        rows = module.matrix_product(module.matrix_product(a, a), a)
        np.testing.assert_array_equal(out, module.interpolate(unit, p, t))
        np.testing.assert_array_equal(lengths, length + module.distance(rows[:, 1, 2], unit[:, 0]))
        np.testing.assert_array_equal(squares, module.matrix_product(a, rows))


def test_jit_error_messages(pair: tuple[ModuleType, ModuleType]) -> None:
    move = pair[1].move_point.jit
    m, p = np.zeros(8), np.zeros(3)
    for given, words in [
        ((m,), "1 arguments; expected 2"),
        ((m, 1.0), "argument p is float64"),
        ((m, (1.0, 2.0)), "expected 3 entries"),
        ((m, np.zeros((3, 1))), "an array with 1 axes"),
        ((m, p, 2.0), "argument out is float64"),
    ]:
        with pytest.raises(numba.TypingError, match="move_point") as caught:
            move(*given)
        assert words in str(caught.value)


@pytest.mark.parametrize(
    ("order", "backends"),
    [
        pytest.param(in_order, ("numba",), id="in_order"),
        pytest.param(with_gaps, ("c",), id="with_gaps"),
        pytest.param(by_component, ("c", "numba"), id="by_component", marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("dtype", some_slow(TYPES, "float32"))
def test_a_composed_kernel_equals_its_kernels_in_sequence(
    pair: tuple[ModuleType, ModuleType], dtype: str, order: Callable[[Array], Array], backends: tuple[str, ...]
) -> None:
    for module in (each for each in pair if each.backend in backends):
        product, move, normalize = (getattr(module, name).jit for name in ("matrix_product", "move_point", "normalize"))

        def chain(m: Any, p: Any, a: Any, t: Any) -> Any:
            """A chain."""
            unit, length = normalize(move(m, p))  # noqa: B023
            return product(a, a), unit, length * t  # noqa: B023

        kernel = module.Kernel.of(chain, "(8),(3),(4,4),()->(4,4),(3),()")
        assert (kernel.name, kernel.__doc__) == ("chain", "A chain.")
        for size in (1, 5, 64, 130):
            m, p = map(order, arguments(module.move_point, size, dtype))
            a, t = (order(x) for x in (arguments(module.matrix_product, size, dtype)[0], p[:, 0].copy()))
            squares, unit, scaled = kernel(m, p, a, t)
            right, length = module.normalize(module.move_point(m, p))
            np.testing.assert_array_equal(unit, right)
            np.testing.assert_array_equal(squares, module.matrix_product(a, a))
            np.testing.assert_array_equal(scaled, length * t)
            assert scaled.dtype == dtype
        one = kernel(m[3], p, a[0], 2.0 if dtype == "float64" else np.float32(2))
        np.testing.assert_array_equal(one[1], module.normalize(module.move_point(m[3], p))[0])


def test_kernels_of_the_same_name_are_distinct(pair: tuple[ModuleType, ModuleType]) -> None:
    kernels = []
    for factor in (2.0, 3.0):
        first: Any = {}
        exec(f"def scaled(p):\n    return p[0] * {factor}, p[1] * {factor}", first)
        kernels.append(pair[1].Kernel.of(first["scaled"], "(2)->(2)"))
    p = np.random.default_rng(0).normal(size=(40, 2))
    np.testing.assert_array_equal(kernels[0](p), 2 * p)
    np.testing.assert_array_equal(kernels[1](p), 3 * p)
    p_before = p.copy()
    kernels[1](p, out=p)
    np.testing.assert_array_equal(p, 3 * p_before)


def test_signatures_and_results_are_checked(pair: tuple[ModuleType, ModuleType]) -> None:
    of = pair[1].Kernel.of
    for signature in ("", "(3)", "(3)->", "3->3", "(3),(3)->(3)", "(0)->(3)"):
        with pytest.raises(ValueError, match="expected the shapes of its 1 arguments"):
            of(lambda p: p, signature)
    wrong = of(lambda p: (p[0], p[1]), "(3)->(3)")
    with pytest.raises(numba.TypingError, match=r"expected numbers in shape \(3\)"):
        wrong(np.zeros((5, 3)))
    with pytest.raises(TypeError, match="complex"):
        wrong(np.zeros((5, 3), complex))


def test_numbers_in_the_text_do_not_widen_float32(tmp_path: Path) -> None:
    """A float32 result that differs from double arithmetic rounded at the end."""
    program = traced("twice", {"x": (3,)}, lambda x: [(x[0] + 2 * x[1]) * x[2]])
    write(module_source("narrow", program), tmp_path)
    twice = on(tmp_path / "narrow.py", "numba").twice
    x = np.random.default_rng(2).normal(size=(500, 3)).astype(np.float32)
    right = (x[:, 0] + np.float32(2) * x[:, 1]) * x[:, 2]
    wide = x.astype(float)
    assert np.any(right != ((wide[:, 0] + 2 * wide[:, 1]) * wide[:, 2]).astype(np.float32))
    np.testing.assert_array_equal(twice(x)[:, 0], right)

    @numba.njit
    def one(x: Any, out: Any, jit: Any) -> None:
        for k in range(len(x)):
            out[k] = jit(x[k])[0]

    out = np.empty(500, np.float32)
    one(x, out, twice.jit)
    np.testing.assert_array_equal(out, right)


@pytest.mark.slow
def test_a_file_imported_under_several_names(tmp_path: Path) -> None:
    """The files that numba caches contain the name of the module, which another program may be unable to import."""
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "__init__.py").touch()
    write(module_source("known", NORMALIZE), folder)
    code = """
import sys, importlib, numpy as np
known = importlib.import_module(sys.argv[1])
p = np.arange(1.0, 31.0).reshape(10, 3)
assert np.allclose(known.normalize(p)[1], np.linalg.norm(p, axis=-1))
assert known.backend == "numba"
"""
    environment = {**os.environ, "GAC_BACKEND": "numba"}
    for name, place in (("package.known", tmp_path), ("known", folder), ("package.known", tmp_path)):
        done = subprocess.run(
            [sys.executable, "-c", code, name], cwd=place, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("with_cffi", [True, False])
def test_numba_runs_without_the_extension(with_cffi: bool, tmp_path: Path) -> None:
    write(module_source("bare", MOVE_POINT, NORMALIZE, INTERPOLATE, MATRIX_PRODUCT), tmp_path)
    hide = """
import sys
sys.modules["_cffi_backend"] = None
import importlib.util
find = importlib.util.find_spec
importlib.util.find_spec = lambda name, *more: None if name == "_cffi_backend" else find(name, *more)
"""
    code = """
import sys
import numpy as np, bare
assert bare.backend == "numba" and sys.modules[bare.Kernel.__module__.replace("kernel", "extension")].extension is None
p = np.arange(60.0).reshape(20, 3)
m = np.zeros((20, 8))
m[:, 0] = 1
for kind in sys.argv[1:]:
    q, n = p.astype(kind), m.astype(kind)
    for x in (q, np.asfortranarray(q), q[::-2], q[None, ::2].repeat(3, 0)[:, ::-1]):
        for _ in range(2):
            unit, length = bare.normalize(x)
            assert np.allclose(length, np.linalg.norm(x, axis=-1)), x
    for x in (q, np.asfortranarray(q), q[:2], q[:1], q[0]):
        for y in (n[: len(x)], np.asfortranarray(n[: len(x)]), n[0]):
            moved = bare.move_point(y if x.ndim == 2 else n[0], x)
            assert np.array_equal(moved, x) and moved.dtype == kind, (x, y)
"""
    environment = {**os.environ, "GAC_CACHE": str(tmp_path / "nothing"), "CC": "no-such-compiler"}
    # Without cffi, calls take the same path for both types.
    types = ["float64", "float32"] if with_cffi else ["float64"]
    arguments = [sys.executable, "-c", code if with_cffi else hide + code, *types]
    done = subprocess.run(arguments, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@needs_compiler
@pytest.mark.parametrize("name", some_slow(["pga3", "vga2"], "pga3"))
@pytest.mark.slow
def test_generated_kernels_on_numba_equal_those_of_c(name: str, tmp_path: Path) -> None:
    """Test all kernels of a module that are polynomial or take roots; another test has those with sines."""
    path = ROOT / "generated" / f"{name}.py"
    if not any((path.parent / "_build").glob(f"{name}-*")):
        pytest.skip("not built")
    # Use a copy, so that numba's cache next to a file contains the name by which users import it.
    c, ours = on(path, "c"), on(Path(shutil.copy(path, tmp_path)), "numba")
    chosen = [kernel for kernel in c.kernels if getattr(c, kernel).cost["call"] == 0][:: 16 if name == "pga3" else 4]
    assert len(chosen) > 5
    assert len(load_spec(ROOT / "gacompiler" / "specs" / f"{name}.py").kernels) >= len(chosen)
    for kernel in chosen:
        given = arguments(getattr(c, kernel), 37, "float32")
        for order in (in_order, by_component):
            arrays = [order(array) for array in given]
            assert bits(getattr(ours, kernel)(*arrays)) == bits(getattr(c, kernel)(*arrays)), kernel


def test_numba_is_imported_only_when_it_is_needed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    write(module_source("lazy", MOVE_POINT), tmp_path)
    code = "import sys, lazy; assert 'numba' not in sys.modules and 'llvmlite' not in sys.modules"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert load(tmp_path / "lazy.py", "lazy").backend == "numba"
