"""What runs a kernel over a batch: the built C library, or numba.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

import functools
import importlib.util
import itertools
import os
import threading
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from .runtime_functions import _SCALAR, _bound
from .runtime_strides import _address, _offsets

_SUFFIX = {4: "f32", 8: "f64"}


_MODULE = ""
_LIBRARY = ""


def _chosen_backend() -> str:
    """``c`` if this module's library is built, else ``numba``, unless GAC_BACKEND says otherwise."""
    chosen = os.environ.get("GAC_BACKEND", "")
    if chosen not in ("", "c", "numba", "arrays"):
        raise ImportError(f"GAC_BACKEND: {chosen!r}; expected c, numba or arrays")
    built = os.path.exists(_LIBRARY)
    if chosen == "c" and not built:
        raise ImportError(
            f"GAC_BACKEND=c, but {_LIBRARY} is not there; expected the library of this very module; "
            "build it with `gac build`, or unset GAC_BACKEND"
        )
    return chosen or ("c" if built and importlib.util.find_spec("_cffi_backend") else "numba")


backend = _chosen_backend() if _LIBRARY else ""
_ffi: Any = None
_library: Any = None
_from_buffer: Any = None


def _c_address(name: str) -> int:
    """Where a function of the built library is."""
    global _library
    import ctypes

    if _library is None:
        try:
            _library = ctypes.CDLL(_LIBRARY)
        except OSError as error:
            raise ImportError(f"{error}; build it again with `gac build`, or set GAC_BACKEND=numba") from None
    address = ctypes.cast(getattr(_library, f"{_MODULE}_{name}"), ctypes.c_void_p).value
    assert address is not None
    return address


def _c_function(name: str, types: str) -> Any:
    """A function of the built library."""
    global _ffi, _from_buffer
    if _ffi is None:
        # This FFI is the one that cffi's compiled modules use; it reads C types without loading a C parser.
        import _cffi_backend  # type: ignore[import-untyped]

        _ffi = _cffi_backend.FFI()
        _from_buffer = _ffi.from_buffer
    return _ffi.cast(f"void(*)({types})", _c_address(name))


def _c_element(kernel: Any) -> Callable[..., Any]:
    types = ["void *" if shape else "double" for shape in kernel._shapes] + ["void *"] * len(kernel._outputs)
    return _c_function(f"{kernel.name}_f64", ", ".join(types))  # type: ignore[no-any-return]


def _c_loop(kernel: Any, dtype: np.dtype[Any]) -> Callable[..., None]:
    function = _c_function(f"{kernel.name}_loop_{_SUFFIX[dtype.itemsize]}", "void *, void *, void *")
    new, pointers, integers = _ffi.new, _ffi.typeof("void *[]"), _ffi.typeof("intptr_t[]")

    def run(arrays: list[Any], sizes: list[int], steps: list[tuple[int, ...]], inner: int) -> None:
        depth = len(sizes)
        dimensions = new(integers, (sizes[inner],))
        flat = [step[inner] for step in steps]
        for step in steps:
            flat += step[depth:]
        strides = new(integers, flat)
        if depth == 1:
            function(new(pointers, [_pointer(array) for array in arrays]), dimensions, strides)
            return
        addresses = [_address(array) for array in arrays]
        for offsets in _offsets(sizes, steps, inner):
            starts = [address + offset for address, offset in zip(addresses, offsets, strict=True)]
            function(new(integers, starts), dimensions, strides)

    return run


def _c_plan(kernel: Any, dtype: np.dtype[Any], size: int, steps: list[tuple[int, ...]]) -> Callable[[list[Any]], None]:
    """One call of a loop, complete but for the pointers."""
    function = _c_function(f"{kernel.name}_loop_{_SUFFIX[dtype.itemsize]}", "void *, void *, void *")
    new, pointers, integers = _ffi.new, _ffi.typeof("void *[]"), _ffi.typeof("intptr_t[]")
    dimensions = new(integers, (size,))
    strides = new(integers, [step[0] for step in steps] + [stride for step in steps for stride in step[1:]])

    def run(starts: list[Any]) -> None:
        function(new(pointers, starts), dimensions, strides)

    return run


def _pointer(array: Any) -> Any:
    """Where an array starts; the buffer protocol is quicker than numpy's interface, but knows only dense arrays."""
    flags = array.flags
    if flags.c_contiguous:
        return _from_buffer(array)
    return _from_buffer(array.T) if flags.f_contiguous else _ffi.cast("void *", _address(array))


_LOCK = threading.RLock()
_numba_names: dict[str, Any] = {}


def _compiled(function: Callable[..., None], names: dict[str, Any], signature: Any = None) -> Any:
    """`function` under numba: rounding as written, and inf and nan instead of exceptions."""
    if not _numba_names:
        for name, scalar in _SCALAR.items():
            _numba_names[name] = _jitted(scalar) if isinstance(scalar, FunctionType) else scalar
    bound = _bound(function, {"__name__": __name__, "range": range, "len": len, **_numba_names, **names})
    return _jitted(bound, signature)


def _jitted(function: Callable[..., Any], signature: Any = None) -> Any:
    """`function` under numba, kept on disk beside this file or in the user's cache if either can be written."""
    import numba

    decorate = functools.partial(
        numba.njit, *([] if signature is None else [signature]), error_model="numpy", nogil=True
    )
    try:
        return decorate(cache=True)(function)
    except RuntimeError:
        return decorate()(function)


def _numba_loop(kernel: Any, dtype: np.dtype[Any]) -> Callable[..., None]:
    import numba

    real = numba.from_dtype(dtype)
    types = [numba.types.Array(real, 1 + len(shape), "A", readonly=True) for shape in kernel._shapes]
    types += [numba.types.Array(real, 1 + max(len(shape), 1), "A") for shape in kernel._out_shapes]
    n_inputs = len(kernel._inputs)
    signature = numba.types.void(*types)
    loops: dict[int, Callable[..., None]] = {}
    names = [name for name, _ in kernel._inputs]

    def chosen(size: int, still: list[bool]) -> Callable[..., None]:
        """The loop of the first form whose arguments are the same for all elements, else the ordinary one."""
        which = -1
        for k, (same, least, _) in enumerate(kernel._forms):
            if size >= least and all(still[names.index(name)] for name in same):
                which = k
                break
        if which not in loops:
            with _LOCK:
                if which < 0:
                    loop = _compiled(kernel._functions[1], {f"_{kernel.name}": kernel.jit}, signature)
                else:
                    prepare, apply, together = kernel._forms[which][2]
                    parts = {part.__name__: _compiled(part, {}) for part in (prepare, apply)}
                    loop = _compiled(together, {**parts, "empty": np.empty}, signature)
                loops[which] = loop
        return loops[which]

    strided = np.lib.stride_tricks.as_strided

    def run(arrays: list[Any], sizes: list[int], steps: list[tuple[int, ...]], inner: int) -> None:
        loop = chosen(sizes[inner], [step[inner] == 0 for step in steps])
        views = []
        for k, (array, shape, step) in enumerate(zip(arrays, kernel._all_shapes, steps, strict=True)):
            if k >= n_inputs and not shape:
                shape, step = (1,), (*step, array.itemsize)
            if len(sizes) == 1 and step[0] and array.ndim == 1 + len(shape) and array.shape[0] == sizes[0]:
                views.append(array)
                continue
            view = strided(array, (*sizes, *shape), step, writeable=k >= n_inputs)
            views.append(np.moveaxis(view, inner, len(sizes) - 1) if len(sizes) > 1 else view)
        if len(sizes) == 1:
            loop(*views)
            return
        for turns in itertools.product(*(range(size) for axis, size in enumerate(sizes) if axis != inner)):
            loop(*(view[turns] for view in views))

    return run
