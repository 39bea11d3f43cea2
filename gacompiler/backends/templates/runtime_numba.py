"""Kernels under numba: functions for loops of others, and batches as fast as a C compiler makes them.

A batch is run as in the C files: what lies at unit stride is used where it lies, everything else is moved through rows
of a block, and the loop over a block is vectorised. LLVM does not do that by itself, since it would have to compare the
place of every component of a result with every other. So that loop is not printed, but written as LLVM has it, with the
promise that no element reads what another one writes; who calls it has made copies where that would not hold.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any

import numpy as np

from .runtime_batches import (
    _AS_IT_LIES,
    _DONE,
    _FORM,
    _HEAD,
    _LEAST_ALIGNED,
    _LEAST_ROW,
    _LINE,
    _MOVED,
    _N_FLAGS,
    _ROW,
    _SPACE,
    _STILL,
    _numba_batch,
    _numba_lay_rows,
    _numba_move_block,
    _numba_move_part,
    _numba_move_rows,
)
from .runtime_functions import _OF_ANGLES, _SCALAR, _bound
from .runtime_intrinsics import _numba_call_on_one
from .runtime_libraries import _LOCK, _foreign
from .runtime_llvm import _Element, _tools
from .runtime_loops import _Loop, _numba_loop_over
from .runtime_movers import _numba_movers
from .runtime_strides import _address, _parsed
from .runtime_transcendental import _numba_transcendental

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


def _numba_element(function: Callable[..., None], near: bool) -> Any:
    """A kernel's text under numba: rounding as written, inf and nan instead of exceptions, inlined where it is used."""
    import numba

    options = {"error_model": "numpy", "forceinline": True}
    tools = _tools()
    with _LOCK:
        if not _scalar_names:
            for name, scalar in _SCALAR.items():
                plain = isinstance(scalar, FunctionType)
                compiled = _kept(numba.njit, scalar, pipeline_class=tools.Compiler, **options) if plain else scalar
                _scalar_names[name] = compiled
    bound = _bound(function, {"__name__": __name__, **_scalar_names, **_numba_transcendental(near)})
    if near:
        bound.__qualname__ += "_near"
    compiler = tools.NotingCompiler if near else tools.Compiler
    return _kept(numba.njit, bound, pipeline_class=compiler, **_INNER, **options)


def _scalar_kernel(kernel: Any) -> Any:
    """What a kernel has for other functions under numba."""
    import numba

    apply = _numba_call_on_one(kernel, kernel._user or _element_of(kernel._functions[0]))
    bound = _bound(_numba_jit, {"__name__": __name__, "_apply": apply})
    bound.__name__ = bound.__qualname__ = kernel.name
    return numba.njit(bound, error_model="numpy", forceinline=True)


_elements: dict[tuple[Callable[..., None], bool], _Element] = {}


def _element_of(function: Callable[..., None], near: bool = False) -> _Element:
    """A kernel's text under numba; if `near`, where angles are too far for vectors it only notes that."""
    with _LOCK:
        if (function, near) not in _elements:
            _elements[function, near] = _Element(_numba_element(function, near), notes=near)
        return _elements[function, near]


def _element_of_user(function: Any) -> _Element:
    """A function that was not generated, and is not kept on disk: another one may have its name."""
    import numba

    return _Element(numba.njit(getattr(function, "py_func", function), error_model="numpy", forceinline=True), True)


def _callback(function: Any, signature: Any, name: str, names: dict[str, Any], kept: bool = True) -> Any:
    """A function that C can call."""
    import numba

    bound = _bound(function, {"__name__": __name__, "range": range, "min": min, "abs": abs, "np": np, **names})
    bound.__qualname__ = name
    decorate = functools.partial(numba.cfunc, signature, error_model="numpy")
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
            names = {"_w": dtype.itemsize, "_real": real, "_call": tools.call, "_place": tools.place, "_at": tools.at}
            names |= {"_ROW": _ROW, "_LEAST_ROW": _LEAST_ROW, "_SPACE": _SPACE, **_numba_movers(kind)}
            names |= {"_LINE": _LINE, "_LEAST_ALIGNED": _LEAST_ALIGNED}
            names |= {"_HEAD": _HEAD, "_FORM": _FORM, "_N_FLAGS": _N_FLAGS, "_DONE": _DONE}
            names |= {"_STILL": _STILL, "_AS_IT_LIES": _AS_IT_LIES, "_MOVED": _MOVED}
            plain = {"__name__": __name__, "range": range, "min": min, "abs": abs}
            integer, integers = numba.types.intp, numba.types.CPointer(numba.types.intp)
            types = dict.fromkeys(("table", "arrays", "steps", "strides"), integers)
            types |= dict.fromkeys(("starts", "rows", "kinds", "cores"), integer[::1])
            for function in (_numba_move_rows, _numba_move_part, _numba_lay_rows, _numba_move_block):
                name = function.__name__.removeprefix("_numba")
                bound = _bound(function, {**plain, **names})
                bound.__qualname__ = f"{name}_{real}"
                # Of that signature only: numba would make one more for each number that it sees.
                kinds = [types.get(part, integer) for part in _parameters(function)]
                decorate = functools.partial(numba.njit, numba.types.void(*kinds))
                names[name] = _kept(decorate, bound, error_model="numpy", **_INNER)
            batch = _callback(_numba_batch, integer(*[integers] * 4), f"_batch_{real}", names)
            call = _foreign().cast("intptr_t(*)(void *, void *, void *, void *)", batch.address)
            _drivers[str(real)] = call, batch
        return _drivers[str(real)]


class _Loops:
    """The loops of a kernel over batches of one type, compiled when they are first wanted.

    Called with pointers to places, lengths and strides, as the loop of a kernel in C is.
    """

    def __init__(self, kernel: Any, dtype: np.dtype[Any]) -> None:
        names = [name for name, _ in kernel._inputs]
        shapes = kernel._all_shapes
        table = [len(names), len(shapes), sum(map(len, shapes))]
        for shape in shapes:
            table += [math.prod(shape), len(shape), *shape]
        self._kernel, self._dtype, self._first_form = kernel, dtype, len(table)
        # The kernel itself is a form in which nothing stays.
        flagged = names[:_N_FLAGS]
        self._forms = [form for form in kernel._forms if all(name in flagged for name in form[0])]
        self._forms.append(((), 0, 0, kernel._functions))
        for same, least, n_prepared, _ in self._forms:
            table += [sum(1 << names.index(name) for name in same), least, n_prepared, 0, 0]
        self._table = np.array(table, np.intp)
        self._driver, function = _numba_driver(dtype)
        self._pointer = _foreign().from_buffer(self._table)
        self._compiled: list[Any] = [function]
        self.way = 0, function.address, _address(self._table)

    def __call__(self, starts: Any, dimensions: Any, steps: Any) -> None:
        while (missing := self._driver(self._pointer, starts, dimensions, steps)) != _DONE:
            if missing == 0:
                raise MemoryError(f"{self._kernel.name}: no memory for blocks of elements")
            self._compile(missing)

    def _compile(self, place: int) -> None:
        import numba

        with _LOCK:
            if self._table[place]:
                return
            kernel, real = self._kernel, numba.from_dtype(self._dtype)
            which, entry = divmod(place - self._first_form, _FORM)
            same, _, n_prepared, parts = self._forms[which]
            dense, still = entry == _FORM - 1, tuple(k for k, (name, _) in enumerate(kernel._inputs) if name in same)
            exact = kernel._user or _element_of(parts[-1])
            near = _element_of(parts[-1], near=True) if _has_turns(kernel, parts) else None
            prepare = (_element_of(parts[0]), n_prepared) if same else None
            loop = _Loop(kernel._shapes, kernel._out_shapes, real, exact, near, still, prepare, dense)
            rows = _numba_loop_over(loop)
            name = f"{parts[-1].__name__}_{'dense' if dense else 'rows'}_{real}"
            signature = numba.types.void(*[numba.types.intp] * 3)
            function = _callback(_numba_rows, signature, name, {"_run_rows": rows}, not kernel._user)
            self._compiled.append(function)
            self._table[place] = function.address


def _has_turns(kernel: Any, parts: Sequence[Callable[..., None]]) -> bool:
    """Whether what runs for each element has sines or cosines that vectors can compute if they are near."""
    return not kernel._user and not _OF_ANGLES.isdisjoint(parts[-1].__code__.co_names)


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
