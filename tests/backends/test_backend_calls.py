"""Correct and wrong calls of generated modules on every backend."""

from __future__ import annotations

import pickle
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from backend_programs import (
    ALL_OPERATIONS,
    BACKENDS,
    CONSTANTS,
    INNER,
    INTERPOLATE,
    MANY,
    MATRIX_PRODUCT,
    MOVE_POINT,
    NORMALIZE,
    PROGRAMS,
    SWAP,
    expected,
    inputs,
)

from gacompiler.ir.program import Program
from gacompiler.ir.scalar import Op
from tests.support.all_cases import all_cases

SLOW = ("numba", np.float32)
"""Compiling every operation takes numba seconds."""


def check(module: ModuleType, program: Program, arrays: list[Any], tolerance: float = 1e-15) -> None:
    found = getattr(module, program.name)(*arrays)
    found = found if isinstance(found, tuple) else (found,)
    for a, b in zip(found, expected(program, arrays), strict=True):
        assert a.shape == b.shape
        np.testing.assert_allclose(a, b, tolerance, tolerance)


@pytest.mark.parametrize(
    ("module", "dtype", "tolerance"),
    [
        pytest.param(backend, dtype, tolerance, marks=pytest.mark.slow if (backend, dtype) == SLOW else ())
        for backend in BACKENDS
        for dtype, tolerance in ((np.float64, 2e-16), (np.float32, 2e-7))
    ],
    indirect=["module"],
)
def test_every_operation_on_every_backend(module: ModuleType, dtype: Any, tolerance: float) -> None:
    for arrays in ([0.4, 0.7, 0.2], [0.7, 0.4, 0.2], [0.5, 0.5, 0.1], [0.0, 0.3, 0.4]):
        arguments = [dtype(x) for x in arrays]
        with np.errstate(divide="ignore"):
            (right,) = expected(ALL_OPERATIONS, arguments)
        found = module.all_operations(*arguments)
        assert found.dtype == dtype
        for k, line in enumerate(ALL_OPERATIONS.lines):
            assert found[k] == pytest.approx(right[k], rel=4 * tolerance, abs=0), line.op
        batch = module.all_operations(*(np.full(9, x) for x in arguments))
        np.testing.assert_allclose(batch, np.tile(found, (9, 1)), 4 * tolerance)


def test_nan_propagates(module: ModuleType) -> None:
    names = [line.op for line in ALL_OPERATIONS.lines]
    for arguments in ((np.nan, 0.5, 0.5), (0.5, np.nan, 0.5)):
        found = dict(zip(names, module.all_operations(*arguments), strict=True))
        for op in (Op.ADD, Op.MULTIPLY, Op.DIVIDE, Op.ATAN2, Op.MINIMUM, Op.MAXIMUM):
            assert np.isnan(found[op]), op
    assert np.isnan(module.normalize(np.zeros(3))[0]).all()


def test_extremes_of_numbers_that_may_be_infinite_or_nan(module: ModuleType) -> None:
    values = [np.nan, -np.inf, -1, 0, 1, np.inf]
    a, b = map(np.ravel, np.meshgrid(values, values))
    columns = [line.op for line in ALL_OPERATIONS.lines]
    with np.errstate(all="ignore"):
        batch = module.all_operations(a, b, np.full(a.shape, 0.5))
        single = [module.all_operations(x, y, 0.5) for x, y in zip(a, b, strict=True)]
    for op, extreme in ((Op.MINIMUM, np.minimum), (Op.MAXIMUM, np.maximum)):
        for found in (batch, np.array(single)):
            np.testing.assert_array_equal(found[:, columns.index(op)], extreme(a, b))


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda program: program.name)
def test_one_element_and_batches(module: ModuleType, program: Program) -> None:
    for leading in ((), (1,), (67,), (3, 5), (0,), (2, 0, 3)):
        for order in ("C", "F"):
            check(module, program, inputs(program, leading, order=order))


def test_single_precision(module: ModuleType) -> None:
    for program in (NORMALIZE, INTERPOLATE):  # with two results, and with a number
        arrays = inputs(program, (67,), np.float32)
        check(module, program, arrays, 2e-6)
        results = getattr(module, program.name)(*arrays)
        assert all(result.dtype == np.float32 for result in (results if isinstance(results, tuple) else (results,)))
        mixed = getattr(module, program.name)(arrays[0].astype(float), *arrays[1:])
        assert all(result.dtype == np.float64 for result in (mixed if isinstance(mixed, tuple) else (mixed,)))


def test_leading_axes_broadcast(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (7, 5))
    check(module, MOVE_POINT, [m[0, 0], p])
    check(module, MOVE_POINT, [m, p[0, 0]])
    check(module, MOVE_POINT, [m[:, :1], p[:1]])
    check(module, MOVE_POINT, [m[0], p])
    check(module, MOVE_POINT, [np.broadcast_to(m[0, 0], (7, 5, 8)), p])
    check(module, MOVE_POINT, [np.asfortranarray(m.reshape(35, 8))[3], np.asfortranarray(p.reshape(35, 3))])


def test_any_strides(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (8, 6))
    check(module, MOVE_POINT, [m[::-1], p[:, ::-1]])
    check(module, MOVE_POINT, [m[::2, ::3], p[1::2, 1::3]])
    check(module, MOVE_POINT, [m[..., ::-1], p[..., ::-1]])
    check(module, MOVE_POINT, [m.swapaxes(0, 1), p.swapaxes(0, 1)])
    wide = np.random.default_rng(0).uniform(size=(8, 6, 11))
    check(module, MOVE_POINT, [wide[..., :8], wide[..., 8:]])
    a, b = inputs(MATRIX_PRODUCT, (9,))
    check(module, MATRIX_PRODUCT, [a.swapaxes(1, 2), b[:, ::-1]])
    check(module, MATRIX_PRODUCT, [np.asfortranarray(a), np.moveaxis(np.moveaxis(b, 0, -1).copy(), -1, 0)])
    packed = np.zeros(4, np.dtype([("pad", "u1"), ("m", float, 8), ("p", float, 3)]))
    packed["m"], packed["p"] = m[0, :4], p[0, :4]
    check(module, MOVE_POINT, [packed["m"], packed["p"]])
    m.flags.writeable = p.flags.writeable = False
    check(module, MOVE_POINT, [m, p])
    check(module, MOVE_POINT, [m[0, 0], p[0, 0]])
    check(module, MOVE_POINT, [m.astype(">f8"), p])


def test_scalars_and_lists(module: ModuleType) -> None:
    p, q, _ = inputs(INTERPOLATE)
    check(module, INTERPOLATE, [p, q, 0.25])
    check(module, INTERPOLATE, [list(p), tuple(q), 1])
    check(module, INTERPOLATE, [[1, 2, 3], [3, 2, 2], np.float64(0.5)])
    check(module, INTERPOLATE, [p, q, np.array([0.25, 0.5])])
    assert module.interpolate(p.astype("f4"), q.astype("f4"), 0.5).dtype == np.float32
    result = module.distance(3.0, 4)
    assert isinstance(result, np.float64) and result == 25.0
    unit, length = module.normalize([3, 0, 4])
    assert isinstance(length, np.float64) and length == 5.0 and unit.shape == (3,)


def test_out_is_written_and_returned(module: ModuleType) -> None:
    for leading in ((), (11,), (3, 4)):
        m, p = inputs(MOVE_POINT, leading)
        for out in (np.empty_like(p), np.empty((*leading, 6))[..., ::2], np.empty(p.shape, order="F")):
            assert module.move_point(m, p, out=out) is out
            np.testing.assert_allclose(out, expected(MOVE_POINT, [m, p])[0], 1e-14)
        (v,) = inputs(NORMALIZE, leading)
        outs = np.empty_like(v), np.empty(leading)
        assert module.normalize(v, out=outs) is outs
        for found, right in zip(outs, expected(NORMALIZE, [v]), strict=True):
            np.testing.assert_allclose(found, right, 1e-14)


def test_out_may_overlap_an_input(module: ModuleType) -> None:
    for leading in ((), (40,)):
        m, p = inputs(MOVE_POINT, leading)
        right = expected(MOVE_POINT, [m, p])[0]
        np.testing.assert_allclose(module.move_point(m, p, out=p), right, 1e-14)
        (a,) = inputs(SWAP, leading)
        right = expected(SWAP, [a])[0]
        np.testing.assert_array_equal(module.swap(a, out=a), right)
    line = np.random.default_rng(0).uniform(size=(41, 2))
    right = expected(SWAP, [line[:-1]])[0]
    np.testing.assert_array_equal(module.swap(line[:-1], out=line[1:]), right)
    right = expected(SWAP, [line[::-1]])[0]
    np.testing.assert_array_equal(module.swap(line[::-1], out=line), right)
    m, p = inputs(MOVE_POINT, (40,))
    right = expected(MOVE_POINT, [m, p[3]])[0]
    np.testing.assert_allclose(module.move_point(m, p[3], out=p), right, 1e-14)


def test_complex_where_the_kernel_is_polynomial(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (5,))
    real, imaginary = expected(MOVE_POINT, [m, p])[0], expected(MOVE_POINT, [m * 0, p])[0]
    found = module.move_point(m + 0j, p + 0j)
    assert found.dtype == complex and imaginary.shape == real.shape
    np.testing.assert_allclose(found, real, 1e-14)
    squares = module.distance(np.array([1j, 2.0]), 0.0)
    np.testing.assert_array_equal(squares, [-1, 4])
    with pytest.raises(TypeError, match=r"normalize.*complex"):
        module.normalize(np.zeros(3, complex))


@all_cases(
    "arguments, error, words",
    [
        ((np.zeros(7), np.zeros(3)), ValueError, ["move_point", "argument m", "(7,)", "(..., 8)", "e0 e1"]),
        ((np.zeros(8), np.float64(1)), ValueError, ["argument p", "()", "(..., 3)"]),
        ((np.zeros((4, 8)), np.zeros((5, 3))), ValueError, ["broadcast", "(4, 8)", "(5, 3)"]),
        ((np.zeros(8), np.zeros(3, object)), TypeError, ["argument p", "object", ".astype(float)"]),
        ((np.zeros(8), np.zeros(3, np.float16)), TypeError, ["float16"]),
        ((np.zeros(8), [[1], [1, 2]]), ValueError, ["argument p"]),
        ((np.zeros(8), "abc"), TypeError, ["argument p"]),
        ((np.zeros(8),), TypeError, ["move_point", "1", "2", "m, p"]),
    ],
)
def test_wrong_arguments(module: ModuleType, arguments: Any, error: Any, words: list[str]) -> None:
    with pytest.raises(error) as caught:
        module.move_point(*arguments)
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_wrong_out_writes_nothing(module: ModuleType) -> None:
    m, p = inputs(MOVE_POINT, (4,))
    module.move_point(m[0], p[0])
    frozen = np.zeros((4, 3))
    frozen.flags.writeable = False
    for out, error, word in (
        (np.zeros((5, 3)), ValueError, "(5, 3)"),
        (np.zeros((4, 2)), ValueError, "(4, 3)"),
        (np.zeros((4, 3), np.float32), TypeError, "float32"),
        (np.zeros((4, 3), int), TypeError, "int64"),
        (frozen, ValueError, "read-only"),
    ):
        with pytest.raises(error, match=re.escape(word)):
            module.move_point(m, p, out=out)
        assert not out.any()
    with pytest.raises(TypeError, match="list"):
        module.move_point(m, p, out=out.tolist())
    with pytest.raises(ValueError, match="read-only"):
        module.move_point(m[0], p[0], out=frozen[0])
    with pytest.raises(TypeError, match="unit, length"):
        module.normalize(p, out=np.zeros((4, 3)))


def test_attributes_and_help_of_a_module(module: ModuleType, modules: dict[str, ModuleType]) -> None:
    assert modules[module.backend] is module
    assert module.kernels == tuple(program.name for program in (*PROGRAMS, MANY, INNER))
    assert set(module.kernels) <= set(module.__all__)
    kernel = module.move_point
    assert kernel.name == "move_point" and kernel.signature == "(8),(3)->(3)" == MOVE_POINT.signature
    assert module.matrix_product.signature == "(4,4),(4,4)->(4,4)" and module.distance.signature == "(),()->()"
    assert kernel.cost["mul"] == 21 and kernel.cost["add"] == 18 and kernel.cost["sqrt"] == 0
    layout = kernel.layouts["m"]
    assert layout.name == "TEST.M" and layout.blades[0] == "e0" and layout.fixed == () and not layout.unit
    assert "(..., 8)" in kernel.__doc__ and "21 mul, 18 add" in kernel.__doc__ and "Parameters" in kernel.__doc__
    assert "move_point" in repr(kernel) and "(8),(3)->(3)" in repr(kernel)
    assert pickle.loads(pickle.dumps(kernel)) is kernel
    with pytest.raises((AttributeError, TypeError)):
        layout.name = "other"


def test_jit_in_a_numba_loop(modules: dict[str, ModuleType]) -> None:
    """The function is the same on every backend."""
    import numba

    module = next(iter(modules.values()))
    move, normalize = module.move_point.jit, module.normalize.jit
    m, p = inputs(MOVE_POINT, (6,))
    out, unit, length = np.empty((6, 3)), np.empty((6, 3)), np.empty(6)

    @numba.njit
    def run(m: Any, p: Any, out: Any, unit: Any, length: Any) -> None:
        for k in range(len(p)):
            move(m[k], p[k], out[k])
            normalize(p[k], unit[k], length[k : k + 1])

    run(m, p, out, unit, length)
    np.testing.assert_allclose(out, expected(MOVE_POINT, [m, p])[0], 1e-15)
    np.testing.assert_allclose(length, expected(NORMALIZE, [p])[1], 1e-15)
    one = np.empty(3)
    move(m[0], p[0], one)
    np.testing.assert_array_equal(one, out[0])


def test_numba_code_is_cached(modules: dict[str, ModuleType]) -> None:
    module = modules["numba"]
    (p,) = inputs(NORMALIZE, (3,))
    module.normalize(p)
    cache = Path(str(module.__file__)).parent / "__pycache__"
    assert any(path.name.startswith("kernels.normalize_dense") for path in cache.glob("*.nbi"))


def test_modules_loaded_by_an_import(modules: dict[str, ModuleType]) -> None:
    folder = Path(str(modules["numba"].__file__)).parent
    code = (
        "import sys, kernels, numpy as np; kernels.swap([1.0, 2.0]) if kernels.backend == 'c' else None; "
        "print(kernels.backend, *[m for m in ('numba', 'sympy', 'pycparser', 'gacompiler') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    assert run.stdout.split() == (["c"] if "c" in modules else ["numba"])


@pytest.mark.peers
@pytest.mark.parametrize("namespace", ["jax.numpy", "torch"])
def test_arrays_of_other_libraries(module: ModuleType, namespace: str) -> None:
    other = pytest.importorskip(namespace)
    for program in (MOVE_POINT, NORMALIZE, MATRIX_PRODUCT, CONSTANTS, ALL_OPERATIONS):
        arrays = inputs(program, (5,), np.float32)
        results = getattr(module, program.name)(*map(other.asarray, arrays))
        for found, right in zip(
            results if isinstance(results, tuple) else (results,), expected(program, arrays), strict=True
        ):
            assert type(found).__module__.split(".")[0] in ("torch", "jaxlib")
            np.testing.assert_allclose(np.asarray(found), right, 1e-5, 1e-6)


class _Foreign(np.lib.mixins.NDArrayOperatorsMixin):
    """An array of another library, which computes by numpy."""

    __module__ = "cupy"

    def __init__(self, values: Any) -> None:
        self.values = np.asarray(values)
        self.shape, self.ndim, self.dtype = self.values.shape, self.values.ndim, self.values.dtype

    def __getitem__(self, key: Any) -> Any:
        return _Foreign(self.values[key])

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *arrays: Any, **options: Any) -> Any:
        return _wrapped(getattr(ufunc, method))(*arrays, **options)


def _plain(given: Any) -> Any:
    if isinstance(given, (list, tuple)):
        return type(given)(map(_plain, given))
    return given.values if isinstance(given, _Foreign) else given


def _wrapped(function: Any) -> Any:
    def run(*arguments: Any, **options: Any) -> Any:
        found = function(*map(_plain, arguments), **options)
        return _Foreign(found) if isinstance(found, (np.ndarray, np.generic)) else found

    return run


def test_arrays_of_a_library_with_the_functions_of_numpy(module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stands for cupy, which needs a graphics processor."""
    cupy = ModuleType("cupy")
    for name, value in vars(np).items():
        if not name.startswith("_"):
            setattr(cupy, name, value if isinstance(value, type) or not callable(value) else _wrapped(value))
    monkeypatch.setitem(sys.modules, "cupy", cupy)
    m, p = inputs(MOVE_POINT, (5,))
    (right,) = expected(MOVE_POINT, [m, p])
    for first, second in ((_Foreign(m), _Foreign(p)), (m, _Foreign(p)), (_Foreign(m), p.tolist())):
        found = module.move_point(first, second)
        assert type(found) is _Foreign
        np.testing.assert_allclose(found.values, right, 1e-15, 1e-15)
    (single,) = inputs(NORMALIZE, (5,), np.float32)
    for found, right in zip(module.normalize(_Foreign(single)), expected(NORMALIZE, [single]), strict=True):
        assert type(found) is _Foreign and found.dtype == np.float32
        np.testing.assert_allclose(found.values, right, 1e-6, 1e-6)
    for wrong in (p[0, :2], p[:, :2], np.float64(1.0), np.ones((5, 4))):
        with pytest.raises(ValueError, match="argument p has shape"):
            module.move_point(_Foreign(m), _Foreign(wrong))
    with pytest.raises(TypeError, match="out is not supported for arrays of cupy"):
        module.move_point(_Foreign(m), p, out=np.empty((5, 3)))
