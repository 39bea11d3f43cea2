"""Batches through the extension: the same results and errors as without it, for any order, type and overlap."""

from __future__ import annotations

import itertools
import pickle
import sys
import sysconfig
import threading
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from alone import alone
from backend_programs import (
    ALL_OPERATIONS,
    DISTANCE,
    INTERPOLATE,
    MANY,
    MATRIX_PRODUCT,
    MOVE_POINT,
    NORMALIZE,
    PROGRAMS,
    extension_of,
    module_source,
)
from one_element import load_implementations, outcome
from selection import some_slow

from gacompiler.backends import find_compiler
from gacompiler.ir.program import Program
from tests.support.all_cases import all_cases

pytestmark = pytest.mark.skipif(
    find_compiler() is None or not (Path(sysconfig.get_path("include")) / "Python.h").is_file(),
    reason="no C compiler, or no headers of Python",
)

Array = np.ndarray[Any, Any]


@pytest.fixture
def fast(implementations: dict[str, ModuleType]) -> ModuleType:
    return implementations["extension"]


@pytest.fixture(params=some_slow(["extension", "numba"], "numba"))
def either(request: pytest.FixtureRequest, implementations: dict[str, ModuleType]) -> ModuleType:
    return implementations[request.param]


@pytest.fixture
def plain(implementations: dict[str, ModuleType]) -> ModuleType:
    return implementations["c"]


@pytest.fixture
def only_fast_path(fast: ModuleType, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The module, changed so that every call that reaches the Python implementation fails."""

    def fails(*arguments: Any, **named: Any) -> Any:
        raise AssertionError("not the fast path")

    monkeypatch.setattr(fast.Kernel, "_in_python", fails)
    return fast


def made(program: Program, lead: tuple[int, ...], dtype: str = "f8", order: Any = "C") -> list[Array]:
    random = np.random.default_rng(5)
    shapes = [lead + argument.shape for argument in program.arguments]
    return [np.asarray(random.uniform(0.1, 1, shape), dtype, order=order) for shape in shapes]


@all_cases("program", [*PROGRAMS, MANY])
@all_cases("dtype", ["f8", "f4"])
def test_batches_take_the_fast_path(
    only_fast_path: ModuleType, plain: ModuleType, program: Program, dtype: str
) -> None:
    if not program.arguments:
        pytest.skip("a kernel without arguments has no batch")
    for lead, order in itertools.product([(1,), (7,), (100,), (3, 5), (2, 1, 4)], "CF"):
        arrays = made(program, lead, dtype, order)
        assert outcome(getattr(only_fast_path, program.name), *arrays) == outcome(getattr(plain, program.name), *arrays)


@pytest.mark.parametrize("dtype", ["f8", "f4"])
def test_rows_with_gaps(only_fast_path: ModuleType, plain: ModuleType, dtype: str) -> None:
    """Slices, reversed and transposed axes, axes of length 1 and missing axes, for inputs and for the result."""
    random = np.random.default_rng(11)
    for turn in range(150):
        program = (MOVE_POINT, INTERPOLATE, MATRIX_PRODUCT)[turn % 3]
        lead = tuple(random.choice([1, 2, 3, 5, 17, 70], size=random.integers(1, 5)))
        while np.prod(lead) > 5000:
            lead = lead[1:]
        given = [lead, *(within(random, lead) for _ in program.arguments[1:])]
        shapes = [argument.shape for argument in program.arguments]
        arrays = [laid_out(random, axes, shape, dtype) for axes, shape in zip(given, shapes, strict=True)]
        wanted = getattr(plain, program.name)(*arrays)
        np.testing.assert_array_equal(getattr(only_fast_path, program.name)(*arrays), wanted, strict=True)
        out = laid_out(random, lead, program.results[0].shape, dtype)
        assert getattr(only_fast_path, program.name)(*arrays, out=out) is out
        np.testing.assert_array_equal(out, wanted)
    m, p = made(MOVE_POINT, (300, 500), dtype)  # more than one row may be, but not in one row
    wanted = plain.move_point(m[:, 1:], p[:, 1:])
    np.testing.assert_array_equal(only_fast_path.move_point(m[:, 1:], p[:, 1:]), wanted)


def within(random: np.random.Generator, lead: tuple[int, ...]) -> tuple[int, ...]:
    """Random axes that broadcast with `lead`: some have length 1, and the first ones may be missing."""
    axes = [1 if random.random() < 0.3 else length for length in lead]
    return tuple(axes[random.integers(0, len(axes) + 1) :])


def laid_out(random: np.random.Generator, lead: tuple[int, ...], shape: tuple[int, ...], dtype: str) -> Array:
    """An array with axes in random order, with gaps and random direction."""
    full = lead + shape
    order = random.permutation(len(full))
    gaps = random.integers(1, 3, size=len(full))
    wide = np.zeros([full[k] * gaps[k] for k in order], dtype)
    array = wide[(..., *(slice(None, None, int(gaps[k] * random.choice([-1, 1]))) for k in order))]
    array = array.transpose(np.argsort(order))
    array[...] = random.uniform(0.1, 1, full)
    return array


@pytest.mark.parametrize("dtype", ["f8", "f4"])
def test_uniform_arguments(only_fast_path: ModuleType, plain: ModuleType, dtype: str) -> None:
    for program in (MOVE_POINT, MATRIX_PRODUCT, INTERPOLATE):
        many, one = made(program, (20,), dtype), made(program, (), dtype)
        for choice in itertools.product((True, False), repeat=len(many)):
            arrays = [a if chosen else b for chosen, a, b in zip(choice, many, one, strict=True)]
            if any(choice):
                wanted = outcome(getattr(plain, program.name), *arrays)
                assert outcome(getattr(only_fast_path, program.name), *arrays) == wanted


def test_numbers_and_single_elements(only_fast_path: ModuleType, plain: ModuleType) -> None:
    a, b, _ = made(INTERPOLATE, (9,), "f4")
    for number in (0.25, 1, 10**17):
        assert outcome(only_fast_path.interpolate, a, b, number) == outcome(plain.interpolate, a, b, number)
        assert only_fast_path.interpolate(a, b, number).dtype == np.float32
    x, y, _ = made(INTERPOLATE, (9,))
    assert outcome(only_fast_path.interpolate, x, y, np.float64(0.3)) == outcome(
        plain.interpolate, x, y, np.float64(0.3)
    )
    m, p = made(MOVE_POINT, (), "f4")
    assert outcome(only_fast_path.move_point, m, p) == outcome(plain.move_point, m, p)


def test_out(only_fast_path: ModuleType, plain: ModuleType) -> None:
    for program, dtype, order in itertools.product((MOVE_POINT, MATRIX_PRODUCT), ("f8", "f4"), "CF"):
        arrays = made(program, (50,), dtype)
        right = getattr(plain, program.name)(*arrays)
        out = np.empty(right.shape, dtype, order=order)
        assert getattr(only_fast_path, program.name)(*arrays, out=out) is out
        np.testing.assert_array_equal(out, right)
    m, p = made(MOVE_POINT, (50,))
    right = plain.move_point(m, p)
    wide = np.zeros((100, 7))
    only_fast_path.move_point(m, p, out=wide[::-2, 6:0:-2])
    np.testing.assert_array_equal(wide[::-2, 6:0:-2], right)
    assert not wide[::2].any() and not wide[:, ::2][:, :1].any()
    assert only_fast_path.move_point(m, p, out=p) is p
    np.testing.assert_array_equal(p, right)


def places() -> Iterator[Any]:
    """Values of `out` for 20 points that overlap with ``both[:, 3:6]`` or are invalid."""
    both = np.random.default_rng(1).normal(size=(20, 9))
    for column in range(7):
        yield both, both[:, column : column + 3]
    yield both, both[::-1, 3:6]
    yield both, both[:, 5:2:-1]
    flat = np.random.default_rng(2).normal(size=(400,))
    for start in range(0, 130, 7):
        yield flat[:180].reshape(20, 9), flat[start : start + 60].reshape(20, 3)
    yield both, np.empty((20, 4))
    yield both, np.empty((19, 3))
    yield both, np.empty((20, 3), "f4")
    yield both, np.empty((1, 20, 3))
    yield both, np.zeros((20, 3)).view(np.recarray)
    frozen = np.zeros((20, 3))
    frozen.flags.writeable = False
    yield both, frozen
    yield both, np.zeros(61 * 8, np.uint8)[4:484].view("f8").reshape(20, 3)
    yield both, (np.zeros((20, 3)),)
    yield both, 3.0


@all_cases("case", range(len(list(places()))))
def test_overlaps_and_wrong_places(either: ModuleType, plain: ModuleType, case: int) -> None:
    m = made(MOVE_POINT, (20,))[0]
    one, other = list(places())[case], list(places())[case]
    found = outcome(either.move_point, m, one[0][:, 3:6], out=one[1])
    assert found == outcome(plain.move_point, m, other[0][:, 3:6], out=other[1])
    np.testing.assert_array_equal(one[0], other[0])


def forms(array: Array) -> Iterator[Any]:
    """A batch in every valid form and in some that are almost valid."""
    yield array
    yield np.asfortranarray(array)
    yield array[::-1]
    yield array[..., ::-1]
    yield np.repeat(array, 3, 0)[::3]
    yield np.broadcast_to(array[:1], array.shape)
    yield array[:1]
    yield array[0]
    yield array[:0]
    yield array[:-1]
    yield array[None]
    yield array.reshape(2, -1, *array.shape[1:])
    yield np.asfortranarray(array.reshape(2, -1, *array.shape[1:]))
    yield array.astype("f4")
    yield array.astype(">f8")
    yield array.astype(complex)
    yield array.astype(int)
    yield array.astype(object)
    yield array.view(np.recarray)
    yield array.tolist()
    yield np.where(array > 0.5, np.nan, np.inf)
    yield np.zeros(array.nbytes + 4, np.uint8)[4:].view("f8").reshape(array.shape)
    deep = array.reshape((1,) * 9 + array.shape)
    yield deep
    yield None
    yield "text"


def has_nan(form: Any) -> bool:
    return isinstance(form, np.ndarray) and form.dtype == float and bool(np.isnan(form).any())


@all_cases("program", [MOVE_POINT, NORMALIZE, MATRIX_PRODUCT, INTERPOLATE, DISTANCE, ALL_OPERATIONS])
def test_any_form(either: ModuleType, plain: ModuleType, program: Program) -> None:
    arrays = made(program, (6,))
    for k, array in enumerate(arrays):
        for form in forms(array):
            if either.backend == "numba" and has_nan(form):
                found = getattr(either, program.name)(*arrays[:k], form, *arrays[k + 1 :])
                wanted = getattr(plain, program.name)(*arrays[:k], form, *arrays[k + 1 :])
                np.testing.assert_equal(found, wanted)  # the sign of NaN is not specified
                continue
            arguments = [*arrays[:k], form, *arrays[k + 1 :]]
            wanted = outcome(getattr(plain, program.name), *arguments)
            assert outcome(getattr(either, program.name), *arguments) == wanted, (k, form)


def test_values_together_with_batches(only_fast_path: ModuleType) -> None:
    pga3 = pytest.importorskip("generated.pga3")
    if extension_of(pga3) is None:
        pytest.skip("the extension is not built")
    m = pga3.motor_exponential(np.random.default_rng(0).normal(size=6))
    p = np.random.default_rng(1).normal(size=(11, 3))
    np.testing.assert_array_equal(pga3.move_point(pga3.Motor(*m), p), pga3.move_point(m, p))
    np.testing.assert_array_equal(pga3.move_point(m.astype("f4"), p.astype("f4")).dtype, np.float32)


def test_large_batches_are_passed_to_the_module(fast: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """The module decides how a large batch is divided between threads."""
    seen = []
    monkeypatch.setattr(fast.Kernel, "_in_python", lambda *arguments, **named: seen.append(len(arguments[2])))
    m, p = made(MOVE_POINT, (200_000,))
    monkeypatch.setattr(fast, "num_threads", 2)
    fast.move_point(m, p)
    fast.move_point(m[:10], p[:10])
    fast.move_point(m[:10], p[:10], num_threads=2)
    assert seen == [200_000, 10]
    monkeypatch.setattr(fast, "num_threads", 1)
    assert fast.move_point(m, p) is not None and seen == [200_000, 10]


@pytest.mark.slow
def test_a_copied_dtype_is_treated_as_the_original(tmp_path: Path) -> None:
    """The first call of a kernel under numba may have unpickled arrays, whose dtype is a copy of numpy's."""
    module = load_implementations(module_source("copied", MOVE_POINT), tmp_path, ("numba",))["numba"]
    m, p = made(MOVE_POINT, (12,))
    a, b = pickle.loads(pickle.dumps((m, p)))
    for given in ((a[::2], b[::2]), (a, b), (np.asfortranarray(a), b), (a[0], b[0])):
        found = module.move_point(*given)
        assert found.dtype == "f8"
    found = module.move_point(m, p)
    each = np.array([module.move_point(*one) for one in zip(m, p, strict=True)])
    np.testing.assert_array_equal(found, each)
    np.testing.assert_array_equal(found, module.move_point._in_python(m, p))
    np.testing.assert_allclose(module.move_point(m.astype("f4"), p.astype("f4")), found, rtol=1e-4, atol=1e-4)


def test_out_overlaps_an_argument_that_lacks_axes(either: ModuleType, plain: ModuleType) -> None:
    """As an argument, the same array is a different batch if its elements have more axes than those of the result."""
    a, b = np.random.default_rng(3).normal(size=(3, 3)), np.random.default_rng(4).normal(size=(3, 1, 3))
    for module in (either, plain):
        wanted = module.inner(a, b)
        place = a.copy()
        assert module.inner(place, b, out=place) is place
        np.testing.assert_array_equal(place, wanted)


@pytest.mark.parametrize("leading", [(), (40,)])
def test_copies_of_types(fast: ModuleType, monkeypatch: pytest.MonkeyPatch, leading: tuple[int, ...]) -> None:
    """Unpickled arrays, and those of cached functions of numba, have a dtype that is equal but not identical."""
    monkeypatch.setattr(fast.Kernel, "_in_python", lambda *arguments, **named: None)
    for real in ("f8", "f4") if leading else ("f8",):
        m, p = made(MOVE_POINT, leading, real)
        copied = pickle.loads(pickle.dumps((m, p)))
        assert copied[0].dtype is not m.dtype
        expected = fast.move_point(m, p)
        for arguments in (copied, (copied[0], p), (m, copied[1])):
            np.testing.assert_array_equal(fast.move_point(*arguments), expected, strict=True)
        np.testing.assert_array_equal(fast.move_point(m, p, out=np.empty_like(copied[1])), expected)
        assert fast.move_point(m.astype(m.dtype.newbyteorder(">")), p) is None


@all_cases("dtype", ["f8", "f4"])
@all_cases("program", [MOVE_POINT, MATRIX_PRODUCT, INTERPOLATE])
def test_the_last_elements(either: ModuleType, plain: ModuleType, program: Program, dtype: str) -> None:
    """Loops process vectors of elements; the last vector overlaps the previous one unless that has been overwritten."""
    function, every, uniform = getattr(either, program.name), made(program, (65,), dtype), made(program, (), dtype)[0]
    alone = np.array([getattr(plain, program.name)(*each) for each in zip(*every, strict=True)])
    with_uniform = np.array([getattr(plain, program.name)(uniform, *each) for each in zip(*every[1:], strict=True)])
    for size, order in itertools.product([*range(1, 36), 47, 63, 65], "CF"):
        arrays, wanted = [array[:size].copy(order) for array in every], alone[:size]
        np.testing.assert_array_equal(function(*arrays), wanted, strict=True)
        for k, array in enumerate(arrays):
            if array.shape == wanted.shape:
                place = array.copy(order)
                function(*arrays[:k], place, *arrays[k + 1 :], out=place)
                np.testing.assert_array_equal(place, wanted, strict=True)
        np.testing.assert_array_equal(function(uniform, *arrays[1:]), with_uniform[:size], strict=True)


@pytest.mark.slow
def test_numba_takes_the_fast_path_once_it_is_compiled(
    implementations: dict[str, ModuleType], plain: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = implementations["numba"]
    m, p = made(MOVE_POINT, (40,))
    arguments = [(m, p), (np.asfortranarray(m), np.asfortranarray(p)), (m[0], p), (m[::2], p[::-2]), (m[0], p[0])]
    for each in arguments:
        module.move_point(*each)

    def fails(*arguments: Any, **named: Any) -> Any:
        raise AssertionError("not the fast path")

    monkeypatch.setattr(module.Kernel, "_in_python", fails)
    for each in arguments:
        np.testing.assert_array_equal(module.move_point(*each), plain.move_point(*each), strict=True)
    with pytest.raises(AssertionError, match="fast path"):
        module.swap(*made(next(one for one in PROGRAMS if one.name == "swap"), (3,), "f4"))


@pytest.mark.slow
@alone
def test_nothing_leaks(either: ModuleType) -> None:
    m, p = made(MOVE_POINT, (40,))
    (v,) = made(NORMALIZE, (40,))
    out = np.empty((40, 3))
    either.move_point(m, p), either.normalize(v)  # numba keeps references to compiled code
    held = [m, p, v, out, np.dtype(float), np.dtype("f4"), np.ndarray, either.move_point, None, "out"]
    counts = [sys.getrefcount(each) for each in held]
    for _ in range(100):
        either.move_point(m, p, out=out)
        either.move_point(m, p)
        either.normalize(v)
        outcome(either.move_point, m, p[:-1])
        outcome(either.move_point, m, p, out=m)
    for each, count in zip(held, counts, strict=True):
        assert abs(sys.getrefcount(each) - count) < 20, each


def test_threads_of_python(either: ModuleType) -> None:
    """Long loops release the GIL while their callers keep the arrays alive."""
    errors: list[BaseException] = []

    def run(seed: int) -> None:
        random = np.random.default_rng(seed)
        m, p = random.normal(size=(2_000, 8)), random.normal(size=(2_000, 3))
        right = either.move_point._in_python(m, p)
        try:
            for _ in range(300):
                assert (either.move_point(m, p) == right).all()
                assert (either.move_point(m.copy(), p.copy()) == right).all()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=run, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
