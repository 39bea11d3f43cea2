"""Calls of compiled loops by address, and iteration of a loop over a batch of any shape."""

from __future__ import annotations

import importlib.util
import math
import threading
from collections.abc import Callable, Sequence
from typing import Any

from .arrays import address_of, coalesced, outer_offsets, steps_of
from .definition import Definition, Shape
from .threads import LEAST_WORK, in_threads

LOCK = threading.RLock()
"""Held while a kernel or a library is compiled or loaded."""

Loop = Callable[[Any, Any, Any], Any]
"""The loop of a kernel, which takes pointers to the arrays, lengths, and strides."""

_ffi: Any = None


class _Ctypes:
    """A replacement for the parts of cffi that loops need, used if cffi is not installed."""

    def new(self, kind: str, values: Sequence[int]) -> Any:
        import ctypes

        return (ctypes.c_ssize_t * len(values))(*values)

    def cast(self, kind: str, address: int) -> Any:
        import ctypes

        if kind == "void *":
            return address
        result = {"intptr_t": ctypes.c_ssize_t, "int": ctypes.c_int}.get(kind.partition("(")[0])
        return ctypes.CFUNCTYPE(result, *[ctypes.c_void_p] * (kind.count(",") + 1))(address)


def foreign() -> Any:
    """Return the foreign function interface: that of cffi, or one based on ctypes if cffi is not installed."""
    global _ffi
    if _ffi is None:
        if importlib.util.find_spec("_cffi_backend"):
            # The FFI of cffi's compiled modules parses C types without loading a C parser.
            import _cffi_backend  # type: ignore[import-untyped]

            _ffi = _cffi_backend.FFI()
        else:
            _ffi = _Ctypes()
    return _ffi


class StridedLoop:
    """A compiled loop that takes pointers, lengths and strides, applied to arrays of any shape.

    Parameters
    ----------
    definition : Definition
    loop : callable
    """

    def __init__(self, definition: Definition, loop: Loop) -> None:
        self.definition, self._loop, self._work = definition, loop, definition.work

    def run_arrays(self, operands: Sequence[Any], targets: Sequence[Any], leading: Shape, n_threads: int) -> None:
        """Fill the results of a batch of shape `leading`, using `n_threads` threads if the batch is large."""
        arrays, shapes = [*operands, *targets], [*self.definition.shapes, *self.definition.out_shapes]
        steps = [steps_of(array, leading, shape) for array, shape in zip(arrays, shapes, strict=True)]
        sizes, steps = coalesced(leading, steps)
        threads = n_threads if math.prod(leading) * self._work >= LEAST_WORK else 1
        run_over_batch(self._loop, arrays, sizes, steps, threads, self._work)


def run_over_batch(
    loop: Loop, arrays: list[Any], sizes: list[int], steps: list[tuple[int, ...]], n_threads: int, work: int
) -> None:
    """Run a loop over a batch: the compiled loop along the longest axis, Python loops along the others.

    Parameters
    ----------
    loop : callable
        The loop of a kernel.
    arrays : list of array
        Arguments and results.
    sizes : list of int
        Lengths of the axes of the batch.
    steps : list of tuple of int
        For each array, the strides in bytes along each of these axes, and then along the axes of one element.
    n_threads : int
        Number of threads.
    work : int
        Work for one element, see `Definition.work`.
    """
    new, integers = foreign().new, "intptr_t[]"
    depth = len(sizes)
    inner = max(range(depth), key=lambda axis: (sizes[axis], axis)) if depth > 1 else 0
    flat = [step[inner] for step in steps]
    for step in steps:
        flat += step[depth:]
    strides = new(integers, flat)
    addresses = [address_of(array) for array in arrays]

    def piece(first: int, count: int) -> None:
        dimensions = new(integers, (count,))
        starts = [address + first * step for address, step in zip(addresses, flat, strict=False)]
        for offsets in outer_offsets(sizes, steps, inner):
            moved = [start + offset for start, offset in zip(starts, offsets, strict=True)]
            loop(new(integers, moved), dimensions, strides)

    in_threads(piece, sizes[inner], n_threads, math.prod(sizes) * work)
