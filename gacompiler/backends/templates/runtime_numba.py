"""Kernels under numba: functions for loops of others, and batches as fast as a C compiler makes them.

A batch is run as in the C files: what lies at unit stride is used where it lies, everything else is moved through rows
of a block, and the loop over a block is vectorised. LLVM does not do that by itself, since it would have to compare the
place of every component of a result with every other. So that loop is not printed, but written as LLVM has it, with the
promise that no element reads what another one writes; who calls it has made copies where that would not hold.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any

import numpy as np

from .runtime_batches import _LEAST_ROW, _ROW, _SPACE, _numba_batch, _numba_move_part, _numba_move_rows
from .runtime_functions import _SCALAR, _bound
from .runtime_intrinsics import _numba_call_on_one, _numba_loop_over, _numba_movers
from .runtime_libraries import _LOCK, _foreign, _pointer
from .runtime_llvm import _Element, _tools
from .runtime_strides import _address, _offsets, _parsed
from .runtime_threads import _in_threads

_WIDEST = {8: 6, 4: 8}
"""By the bytes of a number, the most in an element that LLVM loads and turns well from C order by itself."""
_run_rows: Any = None
_apply: Any = None


def _numba_rows(size: int, starts: int, cores: int) -> None:
    """The loop of a kernel over a block, under the kernel's name."""
    _run_rows(size, starts, cores)


def _numba_jit(*values: Any) -> Any:
    """A kernel on one element."""
    return _apply(values)


_scalar_names: dict[str, Any] = {}


def _kept(decorate: Callable[..., Any], function: Any, **options: Any) -> Any:
    """`function` under numba, kept on disk beside this file or in the user's cache if either can be written."""
    try:
        decorated = decorate(cache=True, **options)(function)
    except (RuntimeError, ImportError, AttributeError):
        return decorate(**options)(function)
    # What is kept knows this module by its name, and cannot be read where a program knows the same file by another.
    kept = decorated._cache
    load = kept.load_overload

    def load_or_compile(*wanted: Any) -> Any:
        try:
            return load(*wanted)
        except (ImportError, AttributeError):
            return None

    kept.load_overload = load_or_compile
    return decorated


_INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""For functions that only others under numba call."""


def _parameters(function: Any) -> tuple[str, ...]:
    names: tuple[str, ...] = function.__code__.co_varnames
    return names[: function.__code__.co_argcount]


def _numba_element(function: Callable[..., None]) -> Any:
    """A kernel's text under numba: rounding as written, inf and nan instead of exceptions, inlined where it is used."""
    import numba

    options = {"error_model": "numpy", "forceinline": True, "pipeline_class": _tools().Compiler}
    with _LOCK:
        if not _scalar_names:
            for name, scalar in _SCALAR.items():
                plain = isinstance(scalar, FunctionType)
                _scalar_names[name] = _kept(numba.njit, scalar, **options) if plain else scalar
    names = {"__name__": __name__, **_scalar_names}
    return _kept(numba.njit, _bound(function, names), **_INNER, **options)


def _scalar_kernel(kernel: Any) -> Any:
    """What a kernel has for other functions under numba."""
    import numba

    apply = _numba_call_on_one(kernel, kernel._user or _element_of(kernel._functions[0]))
    bound = _bound(_numba_jit, {"__name__": __name__, "_apply": apply})
    bound.__name__ = bound.__qualname__ = kernel.name
    return numba.njit(bound, error_model="numpy", forceinline=True)


_elements: dict[Callable[..., None], _Element] = {}
_N_KNOWN = 256
"""How many shapes and strides a loop remembers how to run."""


def _element_of(function: Callable[..., None]) -> _Element:
    with _LOCK:
        if function not in _elements:
            _elements[function] = _Element(_numba_element(function))
        return _elements[function]


def _element_of_user(function: Any) -> _Element:
    """A function that was not generated, and is not kept on disk: another one may have its name."""
    import numba

    return _Element(numba.njit(getattr(function, "py_func", function), error_model="numpy", forceinline=True), True)


def _callback(
    function: Any, n_arguments: int, pointers: Sequence[int], name: str, names: dict[str, Any], kept: bool = True
) -> Any:
    """A function that C can call: of integers, and of pointers to integers at those places."""
    import numba

    kinds = [numba.types.CPointer(numba.types.intp) if k in pointers else numba.types.intp for k in range(n_arguments)]
    bound = _bound(function, {"__name__": __name__, "range": range, "min": min, "abs": abs, "np": np, **names})
    bound.__qualname__ = name
    decorate = functools.partial(numba.cfunc, numba.types.void(*kinds), error_model="numpy")
    return _kept(decorate, bound) if kept else decorate()(bound)


_drivers: dict[str, tuple[Any, Any]] = {}


def _numba_driver(dtype: np.dtype[Any]) -> Any:
    """What runs the loops of all kernels over batches of one type."""
    import numba

    real = numba.from_dtype(dtype)
    with _LOCK:
        if str(real) not in _drivers:
            tools = _tools()
            kind = tools.ll.DoubleType() if dtype.itemsize == 8 else tools.ll.FloatType()
            names = {"_w": dtype.itemsize, "_real": real, "_call": tools.call, "_place": tools.place}
            names |= {"_ROW": _ROW, "_LEAST_ROW": _LEAST_ROW, "_SPACE": _SPACE, **_numba_movers(kind)}
            plain = {"__name__": __name__, "range": range, "min": min, "abs": abs}
            integer, integers = numba.types.intp, numba.types.CPointer(numba.types.intp)
            for name, function in (("_move_rows", _numba_move_rows), ("_move_part", _numba_move_part)):
                bound = _bound(function, {**plain, **names})
                bound.__qualname__ = f"{name}_{real}"
                # Of that signature only: numba would make one more for each number that it sees.
                kinds = [integers if part in ("table", "strides") else integer for part in _parameters(function)]
                decorate = functools.partial(numba.njit, numba.types.void(*kinds))
                names[name] = _kept(decorate, bound, error_model="numpy", **_INNER)
            function = _callback(_numba_batch, 5, (1, 2, 3, 4), f"_batch_{real}", names)
            types = "intptr_t, void *, void *, void *, void *"
            _drivers[str(real)] = _foreign().cast(f"void(*)({types})", function.address), function
        return _drivers[str(real)][0]


_Run = Callable[[list[Any], int], None]


def _numba_forms(kernel: Any, dtype: np.dtype[Any]) -> Callable[[int, list[int]], _Run]:
    """For a number of elements and all strides, what runs a batch from the places of its arrays."""
    import numba

    real = numba.from_dtype(dtype)
    names = [name for name, _ in kernel._inputs]
    shapes, n_parts, width = kernel._all_shapes, len(kernel._all_shapes), dtype.itemsize
    firsts = list(itertools.accumulate(map(len, shapes), initial=n_parts))
    ffi = _foreign()
    new, integers, pointers = ffi.new, ffi.typeof("intptr_t[]"), ffi.typeof("void *[]")
    made: dict[tuple[int, bool], tuple[Any, Any]] = {}

    def loop(which: int, dense: bool) -> tuple[Any, Any]:
        """A loop, and what must not go away while it is used."""
        with _LOCK:
            if (which, dense) not in made:
                same, _, n_prepared, parts = kernel._forms[which] if which >= 0 else ((), 0, 0, kernel._functions)
                element, prepare = kernel._user or _element_of(parts[-1]), None
                if same:
                    prepare = _element_of(parts[0]), n_prepared
                still = [names.index(name) for name in same]
                rows = _numba_loop_over(kernel._shapes, kernel._out_shapes, real, element, still, prepare, dense)
                name = f"{parts[-1].__name__}_{'dense' if dense else 'rows'}_{real}"
                function = _callback(_numba_rows, 3, (), name, {"_run_rows": rows}, not kernel._user)
                made[which, dense] = ffi.cast("void(*)(intptr_t, void *, void *)", function.address), function
            return made[which, dense]

    def chosen(size: int, strides: list[int]) -> _Run:
        which, same, n_prepared = -1, (), 0
        for k, (kept, least, count, _) in enumerate(kernel._forms):
            if size >= least and not any(strides[names.index(name)] for name in kept):
                which, same, n_prepared = k, kept, count
                break
        changing = [k for k in range(n_parts) if k >= len(names) or names[k] not in same]
        in_place = size == 1 or all(strides[k] == width for k in changing)
        dense = (
            not in_place
            and max(math.prod(shapes[k]) for k in changing) <= _WIDEST[width]
            and all(
                [strides[k], *strides[firsts[k] : firsts[k + 1]]]
                == [width * math.prod(shapes[k][axis:]) for axis in range(len(shapes[k]) + 1)]
                for k in changing
            )
        )
        run, kept_alive = loop(which, dense)
        if in_place or dense:
            cores = new(integers, [*strides[n_parts:], 0])

            def direct(starts: list[Any], size: int) -> None:
                if same:
                    prepared = np.empty(n_prepared, dtype)
                    places = new(pointers, [*starts, ffi.from_buffer(prepared)])
                    run(-1, places, cores)
                else:
                    places = new(pointers, starts)
                run(size, places, cores)

            return direct
        table = [len(names), n_parts, firsts[-1] - n_parts, n_prepared]
        for k, shape in enumerate(shapes):
            table += [math.prod(shape), len(shape), int(k not in changing), *shape]
        tables = new(integers, table), new(integers, strides)
        driver, address = _numba_driver(dtype), kept_alive.address

        def in_rows(starts: list[Any], size: int) -> None:
            driver(address, tables[0], new(pointers, starts), new(integers, [size]), tables[1])

        return in_rows

    return chosen


_chosen: dict[Any, Callable[[int, list[int]], _Run]] = {}


def _numba_chosen(kernel: Any, dtype: np.dtype[Any]) -> Callable[[int, list[int]], _Run]:
    with _LOCK:
        if (kernel, dtype) not in _chosen:
            _chosen[kernel, dtype] = _numba_forms(kernel, dtype)
        return _chosen[kernel, dtype]


def _numba_loop(kernel: Any, dtype: np.dtype[Any]) -> Callable[..., None]:
    chosen = _numba_chosen(kernel, dtype)
    known: dict[tuple[int, ...], _Run] = {}

    def run(arrays: list[Any], sizes: list[int], steps: list[tuple[int, ...]], inner: int, n_threads: int) -> None:
        depth, size = len(sizes), sizes[inner]
        flat = [step[inner] for step in steps]
        for step in steps:
            flat += step[depth:]
        key = (size, *flat)
        loop = known.get(key)
        if loop is None:
            if len(known) >= _N_KNOWN:
                known.clear()
            loop = known[key] = chosen(size, flat)
        if depth == 1 and n_threads == 1:
            loop([_pointer(array) for array in arrays], size)
            return
        addresses = [_address(array) for array in arrays]

        def piece(first: int, count: int) -> None:
            starts = [address + first * step for address, step in zip(addresses, flat)]  # noqa: B905
            for offsets in _offsets(sizes, steps, inner):
                moved = [start + offset for start, offset in zip(starts, offsets, strict=True)]
                loop([_foreign().cast("void *", start) for start in moved], count)

        _in_threads(piece, size, n_threads, math.prod(sizes) * kernel._work)

    return run


def _numba_plan(
    kernel: Any, dtype: np.dtype[Any], size: int, steps: list[tuple[int, ...]]
) -> Callable[[list[Any], int], None]:
    """One call of a loop, complete but for the pointers and the number of threads."""
    outer = [step[0] for step in steps]
    loop = _numba_chosen(kernel, dtype)(size, outer + [stride for step in steps for stride in step[1:]])

    def run(starts: list[Any], n_threads: int) -> None:
        if n_threads == 1:
            loop(starts, size)
            return
        cast = _foreign().cast
        addresses = [start if isinstance(start, int) else int(cast("intptr_t", start)) for start in starts]

        def piece(first: int, count: int) -> None:
            moved = [address + first * step for address, step in zip(addresses, outer)]  # noqa: B905
            loop([cast("void *", address) for address in moved], count)

        _in_threads(piece, size, n_threads, size * kernel._work)

    return run


def _kernel_of(cls: Any, function: Any, signature: str) -> Any:
    """A kernel of a function that was not generated."""
    parsed = _parsed(signature)
    code = getattr(function, "py_func", function).__code__
    names = code.co_varnames[: code.co_argcount]
    if parsed is None or len(parsed[0]) != len(names):
        raise ValueError(
            f"{function.__name__}: signature {signature!r}; expected the shapes of its {len(names)} arguments "
            f"({', '.join(names)}) and of its results, as in (8),(3)->(3)"
        )
    results = ["out"] if len(parsed[1]) == 1 else [f"out{k}" for k in range(len(parsed[1]))]
    inputs, outputs = (tuple(zip(*part, strict=True)) for part in ((names, parsed[0]), (results, parsed[1])))
    kernel = cls(function.__name__, function.__doc__ or "", inputs, outputs, {}, {}, False, (function,))
    kernel._user = _element_of_user(function)
    return kernel
