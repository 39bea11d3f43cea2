"""What runs a kernel over a batch: the built C library, or numba.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

import importlib.util
import math
import os
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from .runtime_strides import _address, _offsets
from .runtime_threads import _in_threads

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


class _Ctypes:
    """As much of cffi as numba's loops need, where it is not installed."""

    def from_buffer(self, array: Any) -> int:
        return _address(array)

    def typeof(self, kind: str) -> str:
        return kind

    def new(self, kind: str, values: list[int]) -> Any:
        import ctypes

        return (ctypes.c_ssize_t * len(values))(*values)

    def cast(self, kind: str, address: int) -> Any:
        import ctypes

        if kind == "void *":
            return address
        result = ctypes.c_ssize_t if kind.startswith("intptr_t") else None
        return ctypes.CFUNCTYPE(result, *[ctypes.c_void_p] * (kind.count(",") + 1))(address)


def _foreign() -> Any:
    """What calls functions at an address."""
    global _ffi, _from_buffer
    if _ffi is None:
        if importlib.util.find_spec("_cffi_backend"):
            # This FFI is the one that cffi's compiled modules use; it reads C types without loading a C parser.
            import _cffi_backend  # type: ignore[import-untyped]

            _ffi = _cffi_backend.FFI()
        else:
            _ffi = _Ctypes()
        _from_buffer = _ffi.from_buffer
    return _ffi


def _c_function(name: str, types: str) -> Any:
    """A function of the built library."""
    return _foreign().cast(f"void(*)({types})", _c_address(name))


def _c_element(kernel: Any) -> Callable[..., Any]:
    types = ["void *" if shape else "double" for shape in kernel._shapes] + ["void *"] * len(kernel._outputs)
    return _c_function(f"{kernel.name}_f64", ", ".join(types))  # type: ignore[no-any-return]


def _c_ways(kernel: Any) -> list[tuple[int, int, int]]:
    """Where the loops of doubles and of floats are, as the extension takes it."""
    return [(_c_address(f"{kernel.name}_loop_{_SUFFIX[size]}"), 0, 0) for size in (8, 4)]


def _c_loop(kernel: Any, dtype: np.dtype[Any]) -> Any:
    return _c_function(f"{kernel.name}_loop_{_SUFFIX[dtype.itemsize]}", "void *, void *, void *")


def _run_batch(
    kernel: Any,
    loop: Callable[..., None],
    arrays: list[Any],
    sizes: list[int],
    steps: list[tuple[int, ...]],
    inner: int,
    n_threads: int,
) -> None:
    """Run a loop, which is called with pointers to places, lengths and strides, over any batch."""
    new, pointers, integers = _foreign().new, "void *[]", "intptr_t[]"
    depth = len(sizes)
    flat = [step[inner] for step in steps]
    for step in steps:
        flat += step[depth:]
    strides = new(integers, flat)
    if depth == 1 and n_threads == 1:
        loop(new(pointers, [_pointer(array) for array in arrays]), new(integers, (sizes[0],)), strides)
        return
    addresses = [_address(array) for array in arrays]

    def piece(first: int, count: int) -> None:
        dimensions = new(integers, (count,))
        starts = [address + first * step for address, step in zip(addresses, flat)]  # noqa: B905
        for offsets in _offsets(sizes, steps, inner):
            moved = [start + offset for start, offset in zip(starts, offsets, strict=True)]
            loop(new(integers, moved), dimensions, strides)

    _in_threads(piece, sizes[inner], n_threads, math.prod(sizes) * kernel._work)


def _plan(
    kernel: Any, loop: Callable[..., None], size: int, steps: list[tuple[int, ...]]
) -> Callable[[list[Any], int], None]:
    """One call of a loop, complete but for the pointers and the number of threads."""
    ffi = _foreign()
    new, pointers, integers = ffi.new, ffi.typeof("void *[]"), ffi.typeof("intptr_t[]")
    dimensions = new(integers, (size,))
    outer = [step[0] for step in steps]
    strides = new(integers, outer + [stride for step in steps for stride in step[1:]])

    def run(starts: list[Any], n_threads: int) -> None:
        if n_threads == 1:
            loop(new(pointers, starts), dimensions, strides)
            return
        addresses = [start if isinstance(start, int) else int(ffi.cast("intptr_t", start)) for start in starts]

        def piece(first: int, count: int) -> None:
            moved = [address + first * step for address, step in zip(addresses, outer)]  # noqa: B905
            loop(new(integers, moved), new(integers, (count,)), strides)

        _in_threads(piece, size, n_threads, size * kernel._work)

    return run


def _pointer(array: Any) -> Any:
    """Where an array starts; the buffer protocol is quicker than numpy's interface, but knows only dense arrays."""
    flags = array.flags
    if flags.c_contiguous:
        return _from_buffer(array)
    return _from_buffer(array.T) if flags.f_contiguous else _ffi.cast("void *", _address(array))


_LOCK = threading.RLock()
