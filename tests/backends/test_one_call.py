"""Calls on one element through the extension: the same results and errors as without it, no leaks and no crashes."""

from __future__ import annotations

import gc
import inspect
import itertools
import pickle
import subprocess
import sys
import sysconfig
import threading
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from alone import alone
from backend_programs import (
    DISTANCE,
    INTERPOLATE,
    MATRIX_PRODUCT,
    MOVE_POINT,
    NORMALIZE,
    PROGRAMS,
    SWAP,
    extension_of,
    inputs,
    load_beside,
    module_source,
    write,
)
from one_element import outcome
from selection import some_slow

from gacompiler.backends import build_library, find_compiler
from gacompiler.errors import BackendError
from gacompiler.gac_runtime import build
from gacompiler.gac_runtime.names import EXTENSION_FILE, extension_name, extension_path
from gacompiler.ir.program import Program
from tests.support.all_cases import all_cases

pytestmark = pytest.mark.skipif(
    find_compiler() is None or not (Path(sysconfig.get_path("include")) / "Python.h").is_file(),
    reason="no C compiler, or no headers of Python",
)

SOURCE = Path(build.__file__).with_name(EXTENSION_FILE)


class Subclass(np.ndarray):
    """A subclass of ndarray."""


@pytest.fixture
def fast(implementations: dict[str, ModuleType]) -> ModuleType:
    return implementations["extension"]


@pytest.fixture
def plain(implementations: dict[str, ModuleType]) -> ModuleType:
    return implementations["c"]


def variants(array: np.ndarray[Any, Any]) -> Iterator[Any]:
    """An argument in every valid form and in some that are almost valid."""
    yield array
    yield array.astype(np.float32)
    yield array.astype(">f8")
    yield array.astype(complex)
    yield array.astype(int)
    yield array > 0.5
    yield array.astype(object)
    yield array.astype(np.float16)
    yield array.view(Subclass)
    yield array.tolist()
    yield np.where(array > 0.5, np.nan, -np.inf)
    frozen = array.copy()
    frozen.flags.writeable = False
    yield frozen
    yield array[np.newaxis]
    yield array[np.newaxis, ..., np.newaxis]
    yield np.stack([array, array])
    yield np.array([array, array])[:0]
    if array.ndim:
        yield np.repeat(array, 2, -1)[..., ::2]
        yield array[::-1]
        yield np.asfortranarray(array)
        yield array[..., :-1]
        yield np.append(array.ravel(), 1.0)
        packed = np.zeros(array.size * 8 + 1, np.uint8)
        packed[1:].view(np.uint8)[:] = np.frombuffer(array.tobytes(), np.uint8)
        yield packed[1:].view(float).reshape(array.shape)
    else:
        yield from (float(array), 2, True, 10**30, 2**63, -(2**63), array[()], np.float32(array), np.int64(3), 1j)
    yield from (None, "abc", [], {}, object)


def outs(shape: tuple[int, ...]) -> Iterator[Any]:
    """Valid and invalid values of `out`."""
    yield np.zeros(shape)
    yield None
    yield np.zeros(shape, np.float32)
    yield np.zeros(shape, ">f8")
    yield np.zeros((*shape, 1))
    yield np.zeros((1, *shape))
    yield np.zeros(shape).view(Subclass)
    yield np.zeros((*shape, 2))[..., 0]
    frozen = np.zeros(shape)
    frozen.flags.writeable = False
    yield frozen
    yield (np.zeros(shape),)
    yield [np.zeros(shape)]
    yield (np.zeros(shape), np.zeros(shape))
    yield from (3.0, "out", (), True)


def test_kernels_take_the_fast_path(fast: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """The extension handles calls with supported arguments without the Python implementation."""

    def fails(*arguments: Any, **named: Any) -> Any:
        raise AssertionError("not the fast path")

    monkeypatch.setattr(fast.Kernel, "_in_python", fails)
    for program in PROGRAMS:
        if len(program.arguments) <= 4 and len(program.results) <= 2:
            getattr(fast, program.name)(*inputs(program))
    m, p = inputs(MOVE_POINT)
    out = np.empty(3)
    assert fast.move_point(m, p, out=out) is out
    fast.interpolate(p, p, 1)
    fast.interpolate(p, p, np.float64(0.5))
    assert fast.interpolate(p, p, np.float32(0.5)).dtype == float
    small = p.astype(np.float32)
    assert fast.interpolate(small, small, np.float32(0.5)).dtype == np.float32
    assert fast.distance(np.float32(3), np.float32(4)) == 25 and type(fast.distance(np.float32(3), 4)) is np.float32
    p.flags.writeable = False
    fast.move_point(m, p, out=None)


@pytest.mark.parametrize("implementation", ["extension", "c"])
def test_results_have_the_precision_of_typed_arguments(
    implementations: dict[str, ModuleType], implementation: str
) -> None:
    """As in numpy, Python numbers take the precision of the other arguments; alone they are doubles."""
    own: list[tuple[Any, str]] = [(np.float32(2), "f4"), (np.float64(2), "f8")]
    numbers = [(2, None), (2.0, None), *own, *((np.array(x), kind) for x, kind in own)]
    for (x, first), (y, second) in itertools.product(numbers, repeat=2):
        found = implementations[implementation].distance(x, y)
        given = [kind for kind in (first, second) if kind is not None]
        assert found == 8 and found.dtype == (np.result_type(*given) if given else float), (x, y)


@all_cases("program", PROGRAMS)
def test_results_equal_those_without_the_extension(fast: ModuleType, plain: ModuleType, program: Program) -> None:
    random = np.random.default_rng(3)
    for _ in range(20):
        arrays = [random.normal(size=argument.shape) for argument in program.arguments]
        found = outcome(getattr(fast, program.name), *arrays)
        assert found == outcome(getattr(plain, program.name), *arrays)
        assert found == outcome(getattr(fast, program.name)._in_python, *arrays)


@all_cases("program", [MOVE_POINT, NORMALIZE, MATRIX_PRODUCT, INTERPOLATE, DISTANCE, SWAP])
def test_any_argument(fast: ModuleType, plain: ModuleType, program: Program) -> None:
    arrays = inputs(program)
    for k, array in enumerate(arrays):
        for variant in variants(array):
            arguments = [*arrays[:k], variant, *arrays[k + 1 :]]
            wanted = outcome(getattr(plain, program.name), *arguments)
            assert outcome(getattr(fast, program.name), *arguments) == wanted, (k, variant)


def test_attempts_return_the_result_of_a_call_or_none(fast: ModuleType, plain: ModuleType) -> None:
    """An attempt raises no error and does not run the Python implementation: without the extension it returns None."""
    for program in (MOVE_POINT, NORMALIZE, MATRIX_PRODUCT, INTERPOLATE, DISTANCE, SWAP):
        arrays = inputs(program)
        kernel = getattr(fast, program.name)
        assert outcome(kernel.attempt, *arrays) == outcome(kernel, *arrays)
        assert getattr(plain, program.name).attempt(*arrays) is None
        for k, array in enumerate(arrays):
            for variant in variants(array):
                arguments = [*arrays[:k], variant, *arrays[k + 1 :]]
                found = kernel.attempt(*arguments)
                if found is not None:
                    assert outcome(lambda found=found: found) == outcome(kernel, *arguments), (k, variant)
        assert kernel.attempt() is None and kernel.attempt(*arrays, *arrays) is None
    m, p = inputs(MOVE_POINT)
    assert fast.move_point.attempt(np.stack([m, m]), p).shape == (2, 3)
    assert fast.move_point.attempt(m.tolist(), p) is None


@all_cases("program", [MOVE_POINT, NORMALIZE, MATRIX_PRODUCT, DISTANCE])
def test_any_out(fast: ModuleType, plain: ModuleType, program: Program) -> None:
    arrays = inputs(program)
    places = zip(outs(program.results[0].shape), outs(program.results[0].shape), strict=True)
    for one, other in places:
        found = outcome(getattr(fast, program.name), *arrays, out=one)
        assert found == outcome(getattr(plain, program.name), *arrays, out=other)
        assert outcome(lambda x: x, one) == outcome(lambda x: x, other)


def test_wrong_calls(fast: ModuleType, plain: ModuleType) -> None:
    m, p = inputs(MOVE_POINT)
    for arguments, named in (
        ((), {}),
        ((m,), {}),
        ((m, p, p), {}),
        ((m,) * 40, {}),
        ((m,), {"p": p}),
        ((m, p), {"into": p}),
        ((m, p), {"out": p.copy(), "into": p}),
        ((), {"out": p}),
    ):
        assert outcome(fast.move_point, *arguments, **named) == outcome(plain.move_point, *arguments, **named)


def test_out_may_be_an_input(fast: ModuleType) -> None:
    m, p = inputs(MOVE_POINT)
    right = fast.move_point(m, p)
    assert fast.move_point(m, p, **{"".join(["o", "ut"]): p}) is p
    np.testing.assert_array_equal(p, right)
    both = np.random.default_rng(0).uniform(size=9)
    right = fast.move_point(both[:8].copy(), both[6:].copy())
    fast.move_point(both[:8], both[6:], out=both[4:7])
    np.testing.assert_array_equal(both[4:7], right)


def test_results_are_new(fast: ModuleType) -> None:
    m, p = inputs(MOVE_POINT)
    a, b = fast.move_point(m, p), fast.move_point(m, p)
    assert type(a) is np.ndarray and a.base is None and a.flags.carray and a.flags.owndata
    a[:] = 0
    assert b.any()
    unit, length = fast.normalize(p)
    assert type(unit) is np.ndarray and type(length) is np.float64
    assert length + 1 > length and f"{length:.3f}" and pickle.loads(pickle.dumps(length)) == length


def test_attributes_and_help_of_a_kernel(fast: ModuleType, plain: ModuleType) -> None:
    for name in fast.kernels:
        one, other = getattr(fast, name), getattr(plain, name)
        assert isinstance(one, fast.Kernel) and callable(one)
        assert pickle.loads(pickle.dumps(one)) is one
        assert one.__name__ == one.__qualname__ == one.name == name and one.__doc__ == other.__doc__
        assert one.signature == other.signature and one.cost == other.cost and dict(one.layouts) == dict(other.layouts)
        assert inspect.signature(one) == inspect.signature(other)
        assert repr(one).replace(one.__module__, "") == repr(other).replace(other.__module__, "")
    assert str(inspect.signature(fast.move_point)) == "(m, p, *, out=None, num_threads=None)"
    inspect.signature(fast.Kernel)


def test_a_user_defined_class(fast: ModuleType) -> None:
    class Counting(fast.Kernel):  # type: ignore[misc, name-defined]
        calls = 0

        def __call__(self, *arrays: Any, out: Any = None) -> Any:
            self.calls += 1
            return super().__call__(*arrays, out=out)

    kernel = fast.move_point
    own = Counting(kernel.definition)
    m, p = inputs(MOVE_POINT)
    np.testing.assert_allclose(own._in_python(m.astype(complex), p).real, kernel(m, p), 1e-14)
    np.testing.assert_allclose(own(m.astype(complex), p).real, kernel(m, p), 1e-14)
    assert own.calls == 1


def test_random_calls_never_crash(fast: ModuleType, plain: ModuleType) -> None:
    random = np.random.default_rng(1)
    names = [program.name for program in PROGRAMS]
    pool: list[Any] = [random.normal(size=shape) for shape in [(), (2,), (3,), (3,), (8,), (8,), (4, 4), (4, 4), (0,)]]
    pool += [x for array in (np.ones(8), np.ones(3), np.ones(()), np.ones((4, 4))) for x in variants(array)]
    pool += [
        np.ones((2, 2, 2, 2, 2, 2)),
        np.ones((5, 8)),
        np.broadcast_to(1.0, (8,)),
        np.ma.ones(3),
    ]
    numbers = random.integers(0, 2**31, size=(20_000, 7))
    for turn, (which, count, *picks, out) in enumerate(numbers):
        name = names[which % len(names)]
        arguments = [pool[pick % len(pool)] for pick in picks[: count % 4 + 1]]
        named = {"out": pool[out % len(pool)]} if out % 5 == 0 else {}
        # Copy the arrays that are written to, so that the pool does not change.
        named = {key: value.copy() if isinstance(value, np.ndarray) else value for key, value in named.items()}
        found = outcome(getattr(fast, name), *arguments, **named)
        if turn % 20 == 0:
            assert found == outcome(getattr(plain, name), *arguments, **named), (name, arguments, named)


@pytest.mark.slow
@alone
def test_nothing_leaks(fast: ModuleType) -> None:
    m, p = inputs(MOVE_POINT)
    (v,) = inputs(NORMALIZE)
    a, b = inputs(DISTANCE)
    out, single = np.empty(3), m.astype("f4")
    held = [m, p, v, a, b, out, single, np.dtype(float), np.float64, np.ndarray, fast.move_point, None, "out"]

    def calls() -> None:
        fast.move_point(m, p, out=out)
        fast.move_point(m, p)
        fast.normalize(v)
        fast.distance(a, b)
        fast.distance(0.25, 3)

    def slow_calls() -> None:
        outcome(fast.move_point, single, p)
        outcome(fast.move_point, m, p, out=single)
        outcome(fast.move_point, m, p, into=out)
        outcome(fast.move_point, "m", p)

    for function, turns in ((calls, 20_000), (slow_calls, 2_000)):
        function()
        gc.collect()
        counts = [sys.getrefcount(each) for each in held]
        tracemalloc.start()
        function()
        before = tracemalloc.get_traced_memory()[0]
        for _ in range(turns):
            function()
        gc.collect()
        grown = tracemalloc.get_traced_memory()[0] - before
        tracemalloc.stop()
        assert grown < 10_000, grown
        for each, count in zip(held, counts, strict=True):
            assert abs(sys.getrefcount(each) - count) < 20, each


def test_threads(fast: ModuleType) -> None:
    errors: list[BaseException] = []

    def run(seed: int) -> None:
        random = np.random.default_rng(seed)
        m, p, out = random.normal(size=8), random.normal(size=3), np.empty(3)
        right = fast.move_point._in_python(m, p)
        try:
            for _ in range(5_000):
                assert (fast.move_point(m, p, out=out) == right).all() and (fast.move_point(m, p) == right).all()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=run, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors


# Build.


def test_one_extension_serves_all_modules(tmp_path: Path, fast: ModuleType) -> None:
    c_path = write(module_source("another", NORMALIZE), tmp_path)
    build_library(c_path)
    assert extension_of(load_beside(c_path.with_suffix(".py"), "another_one")) is extension_of(fast)
    assert [path.name for path in tmp_path.glob("_build/calls*")] == [extension_path(tmp_path).name]


def test_it_is_built_once_and_stale_ones_are_removed(tmp_path: Path) -> None:
    c_path = write(module_source("another", NORMALIZE), tmp_path)
    stale = extension_path(tmp_path)
    stale = stale.with_name(stale.name.replace(extension_name(), f"calls_{'0' * 16}"))
    stale.parent.mkdir()
    stale.touch()
    build_library(c_path)
    built = extension_path(tmp_path).stat()
    build_library(c_path)
    assert extension_path(tmp_path).stat().st_mtime_ns == built.st_mtime_ns and not stale.exists()
    assert not list(tmp_path.glob("_build/.*"))


def test_without_headers_of_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build.sysconfig, "get_path", lambda name: str(tmp_path / "absent"))
    c_path = write(module_source("another", NORMALIZE), tmp_path)
    assert build_library(c_path) is not None and not extension_path(tmp_path).exists()


def test_a_file_that_is_no_extension_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    c_path = write(module_source("another", NORMALIZE), tmp_path)
    build_library(c_path)
    extension_path(tmp_path).write_text("nothing")
    monkeypatch.delitem(sys.modules, extension_name(), raising=False)
    monkeypatch.setenv("GAC_CACHE", str(tmp_path / "nothing"))
    module = load_beside(c_path.with_suffix(".py"), "another_two")
    assert extension_of(module) is None and module.normalize([3.0, 0.0, 4.0])[1] == 5


def test_a_compiler_that_fails_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "EXTENSION_FLAGS", ("-no-such-option",))
    monkeypatch.setattr(build, "_extensions", {})
    with pytest.raises(BackendError, match="no-such-option"):
        build_library(write(module_source("another", NORMALIZE), tmp_path))


@pytest.mark.parametrize("level", some_slow(["-fsyntax-only", "-O2"], "-O2"))
def test_the_text_compiles_without_a_warning(level: str, tmp_path: Path) -> None:
    options = ["-std=c17", level, "-Wall", "-Wextra", "-Werror", "-DINIT=PyInit_x", "-c", "-o", str(tmp_path / "x.o")]
    command = [*(find_compiler() or ()), *options, f"-I{sysconfig.get_path('include')}", str(SOURCE)]
    assert subprocess.run(command, capture_output=True, text=True).stderr == ""
    assert max(map(len, SOURCE.read_text().splitlines())) <= 120
