"""Generated modules on arrays of any memory order, at every length that blocks and vectors distinguish."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import pytest
from backend_programs import (
    INTERPOLATE,
    MATRIX_PRODUCT,
    MOVE_POINT,
    NORMALIZE,
    SWAP,
    expected,
    inputs,
    load,
    module_source,
    traced,
    write,
)

from gacompiler.backends import build_library
from gacompiler.ir.program import Program
from tests.support.unoptimised import without_optimisation


def placed(array: np.ndarray[Any, Any], layout: str) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Place `array` with this layout in a buffer filled with NaN; return it and the buffer."""
    n, *shape = array.shape
    order = [*range(1, array.ndim), 0]
    match layout:
        case "components":
            memory = np.full((*shape, n), np.nan, array.dtype)
            view = np.moveaxis(memory, -1, 0)
        case "padded components":
            memory = np.full((*shape, n + 5), np.nan, array.dtype)
            view = np.moveaxis(memory, -1, 0)[2 : 2 + n]
        case "elements":
            memory = np.full(array.shape, np.nan, array.dtype)
            view = memory
        case "padded elements":
            memory = np.full((n + 2, *shape[:-1], (shape or [1])[-1] + 2), np.nan, array.dtype)
            view = memory[1:-1, ..., 1:-1] if shape else memory[1:-1, 1]
        case "backwards":
            memory = np.full((n, *shape), np.nan, array.dtype)
            view = memory[::-1, ..., ::-1] if shape else memory[::-1]
        case _:
            memory = np.full([2 * length for length in (n, *reversed(shape))], np.nan, array.dtype)
            view = memory[tuple(slice(1, None, 2) for _ in array.shape)].transpose(0, *range(array.ndim - 1, 0, -1))
    assert len(order) == view.ndim and view.shape == array.shape
    view[...] = array
    return view, memory


LAYOUTS = ("components", "padded components", "elements", "padded elements", "backwards", "strided")


@pytest.mark.parametrize("program", [MOVE_POINT, MATRIX_PRODUCT, INTERPOLATE, NORMALIZE, SWAP], ids=lambda p: p.name)
def test_layouts_at_every_length(module: ModuleType, program: Program) -> None:
    choose = np.random.default_rng(3)
    kernel = getattr(module, program.name)
    for n in (1, 2, 15, 16, 17, 63, 64, 65, 200, 1003) if module.backend == "c" else (1, 16, 65, 200):
        for dtype, tolerance in ((np.float64, 1e-13), (np.float32, 1e-4)):
            for turn in range(8):
                layouts = [
                    LAYOUTS[turn] if turn < len(LAYOUTS) else str(choose.choice(LAYOUTS))
                    for _ in (*program.arguments, *program.results)
                ]
                same = choose.random(len(program.arguments)) < 0.3
                arrays = [
                    placed(array, layout)[0] if not fixed else array[0]
                    for array, layout, fixed in zip(inputs(program, (n,), dtype), layouts, same, strict=False)
                ]
                right = expected(program, arrays)
                if all(same):
                    right = [np.broadcast_to(part, (n, *part.shape)) for part in right]
                    arrays = [np.broadcast_to(array, (n, *array.shape)) for array in arrays]
                places = [
                    placed(np.zeros(part.shape, dtype), layout)
                    for part, layout in zip(right, layouts[len(arrays) :], strict=True)
                ]
                untouched = [int(np.isnan(memory).sum()) for _, memory in places]
                outs = tuple(view for view, _ in places)
                kernel(*arrays, out=outs if len(outs) > 1 else outs[0])
                for found, part in zip(outs, right, strict=True):
                    np.testing.assert_allclose(found, part, tolerance, tolerance)
                assert untouched == [int(np.isnan(memory).sum()) for _, memory in places]


@pytest.fixture(scope="module")
def of_many(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Sums of many numbers with weights."""
    programs = [
        traced(f"of_{size}", {f"x{k}": () for k in range(size)}, lambda *x: sum(k * each for k, each in enumerate(x)))
        for size in MANY
    ]
    path = write(module_source("many", *programs), tmp_path_factory.mktemp("many"))
    with without_optimisation():
        build_library(path)
    return load(path.with_suffix(".py"), "many")


MANY = (31, 33, 70)


@pytest.mark.parametrize("n_arguments", MANY)
def test_more_arguments_than_bits_in_a_word(n_arguments: int, of_many: ModuleType) -> None:
    """Unit strides and uniform arguments are distinguished for each of many arguments."""
    weighted = getattr(of_many, f"of_{n_arguments}")
    for n in (2, 3, 20, 100):
        x = np.random.default_rng(n).integers(-9, 9, (n, n_arguments)).astype(float)
        right = (x @ np.arange(n_arguments))[:, None]
        columns = list(np.ascontiguousarray(x.T))
        np.testing.assert_array_equal(weighted(*x.T), right)
        np.testing.assert_array_equal(weighted(*columns), right)
        np.testing.assert_array_equal(weighted(*x.T, out=np.zeros((2 * n, 1))[::2]), right)
        np.testing.assert_array_equal(weighted(*columns[:2], *x.T[2:]), right)
        for same in (0, 1, n_arguments - 1):
            x[:, same] = x[0, same]
            mixed = [x[0, k] if k == same else column for k, column in enumerate(x.T)]
            np.testing.assert_array_equal(weighted(*mixed)[:, 0], x @ np.arange(n_arguments))


def test_a_repeated_call(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (6, 4))
    right = expected(MOVE_POINT, [m, p])[0]
    calls = [
        (m, p, right),
        (m[0], p[0], right[0]),
        (m[0, 0], p, expected(MOVE_POINT, [m[0, 0], p])[0]),
        (m[::2], p[::2], right[::2]),
        (np.asfortranarray(m), np.asfortranarray(p), right),
        (m[:, ::-1], p[:, ::-1], right[:, ::-1]),
        (m[:, :1], p[0], expected(MOVE_POINT, [m[:, :1], p[0]])[0]),
        (list(m[0, 0]), tuple(p[0, 0]), right[0, 0]),
        (m[:0], p[:0], right[:0]),
    ]
    for _ in range(3):
        for a, b, wanted in calls:
            np.testing.assert_allclose(module.move_point(a, b), wanted, 1e-14)
            found = module.move_point(np.asarray(a, np.float32), np.asarray(b, np.float32))
            np.testing.assert_allclose(found, wanted, 1e-5, 1e-5)
            out = np.empty(wanted.shape)
            assert module.move_point(a, b, out=out) is out
            np.testing.assert_allclose(out, wanted, 1e-14)
    for n in range(1, 400):
        assert module.swap(np.zeros((n, 2))).shape == (n, 2)
    unaligned = np.frombuffer(bytes(1) + p.tobytes(), np.uint8)[1:].view(float).reshape(p.shape)
    assert not unaligned.flags.aligned
    np.testing.assert_allclose(module.move_point(m, unaligned), right, 1e-14)
    np.testing.assert_allclose(module.move_point(m[0, 0], unaligned[0, 0]), right[0, 0], 1e-14)
