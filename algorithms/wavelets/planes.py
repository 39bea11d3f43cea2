"""Fields of multivectors as complex planes, in a memory layout that `scipy.fft` transforms in place, and back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arguments import Reals
from .sharing import Progress, in_threads, n_threads, slices, steps

Complexes = NDArray[Any]
"""Array of complex64 or complex128."""

Directions = tuple[tuple[int, ...], tuple[int, ...]]
"""The spatial axes along which a plane is transformed forward, and those along which it is transformed backward."""

NORMS = {None: "forward", "backward": "forward", "forward": "backward", "ortho": "ortho"}
"""Norms of scipy, each with the norm that gives the transform with the opposite sign of the exponent the same scale."""

_ALONG = {"both": {0, 1, 2, 3}, "space": {1, 2, 3}, "time": {0}}
_LINE = 64
"""Size of a cache line in bytes."""
_BLOCK = 2**21
"""Bytes of complex numbers that remain in a cache between a kernel and the planes."""
_KEPT = 2**26
"""Bytes of memory that are reused for the next transform: allocating new memory takes a tenth of the time."""
_memory: list[NDArray[np.uint8]] = []
"""The reused memory, at most one array."""
_LONG = 4096
"""Number of elements in a slab above which kernels read and write the planes directly."""


def through_planes(
    field: Reals,
    name: str,
    pack: Callable[..., Any],
    unpack: Callable[..., Any],
    planes: Sequence[Directions],
    inverse: bool,
    norm: str | None,
    workers: int | None,
    progress: Progress | None = None,
    axes: int | None = None,
) -> Reals:
    """Transform a field by complex transforms in place, between two passes of kernels.

    Parameters
    ----------
    field : array, (..., *space, K)
        A field in any memory order; it is not copied.
    name : str
        Name of the field in error messages.
    pack, unpack : kernel
        Kernels from elements (n, K) to as many complex numbers (n, 2) as there are planes, real parts first, and back.
    planes : sequence of directions
        The directions of each plane.
    inverse : bool
        Whether all directions are reversed.
    norm, workers
        As in `scipy.fft`. Workers also share the passes of kernels.
    progress : function of (done, total), optional
        Called after each step. The steps are the parts of the two passes and the planes between them.
    axes : int, optional
        Number of axes of space, if some of them are not transformed.

    Returns
    -------
    array, (..., *space, K)
        Coefficients are first in memory if they are in `field`, otherwise last.

    Raises
    ------
    ValueError
        If `norm` is unknown, if a spatial axis is empty, or if a number or the transform is not finite.
    """
    check_norm(norm)
    transformed = {axis for along in planes[0] for axis in along}
    axes = len(transformed) if axes is None else axes
    space, size = field.shape[-1 - axes : -1], field.shape[-1]
    if 0 in space:
        raise ValueError(f"{name}: shape {field.shape}; expected no empty axis")
    slabs = int(np.prod(field.shape[:-axes])), int(np.prod(space[1:]))
    memory, numbers = _empty_planes(len(planes), *slabs, np.result_type(field.dtype, np.complex64))
    # If nothing is copied through the cache and no threads wait for parts, fewer calls are faster.
    block = _BLOCK if slabs[1] < _LONG or n_threads(workers) > 1 else 4 * _BLOCK
    places = list(slices(slabs[0], max(block // (len(planes) * slabs[1] * numbers.itemsize), 1)))
    step_done = steps(progress, 2 * len(places) + len(planes))

    def packed(place: slice) -> None:
        some, values = numbers[:, place], elements[place]
        dense = _dense(some)
        pack(_as_one(values, dense), out=_pairs(dense))
        # Transform along all axes but the first while these slabs are in the cache.
        inside = dense.reshape(len(planes), -1, *space[1:], copy=False)
        _transform(inside, planes, range(1, axes), inverse, norm, 1)
        if dense is not some:
            some[...] = dense
        step_done()

    def unpacked(place: slice) -> None:
        some, values = numbers[:, place], elements[place]
        dense = _dense(some)
        if dense is not some:
            dense[...] = some
        unpack(*_pairs(dense), out=_as_one(values, dense))
        step_done()

    elements = field.reshape(*slabs, size)
    in_threads(packed, places, workers)
    stack = numbers.reshape(len(planes), -1, space[0], slabs[1], copy=False)
    for k in range(len(planes)):
        _transform(stack[k : k + 1], planes[k : k + 1], range(1), inverse, norm, workers)
        step_done()
    result = _empty_like(field.reshape(-1, *space, size))
    elements = result.reshape(*slabs, size, copy=False)
    in_threads(unpacked, places, workers)
    _keep(memory)
    first: Any = (slice(None), *(0 if axis in transformed else slice(None) for axis in range(axes)))
    if not np.isfinite(result[first]).all():
        # Every number is a term of the first element of the result.
        raise ValueError(f"{name}: a number, or the sum of all, is not finite; expected finite numbers")
    return result.reshape(field.shape)


def _empty_planes(count: int, slabs: int, size: int, dtype: np.dtype[Any]) -> tuple[NDArray[np.uint8], Complexes]:
    """Return memory and planes in it, (count, slabs, size), whose rows are an odd number of cache lines apart.

    The memory is returned for `_keep`. If the distance were a large power of two, all numbers along the first axis
    would share a few cache sets, and the transform would take half as long again.
    """
    each = _LINE // dtype.itemsize
    shape = count, slabs, (-(-size // each) | 1) * each
    needed = int(np.prod(shape)) * dtype.itemsize
    try:
        memory = _memory.pop()
    except IndexError:
        memory = np.empty(0, np.uint8)
    if memory.size < needed:
        memory = np.empty(needed, np.uint8)
    return memory, memory[:needed].view(dtype).reshape(shape)[..., :size]


def _keep(memory: NDArray[np.uint8]) -> None:
    if memory.size <= _KEPT:
        _memory[:] = [memory]  # atomic with respect to other threads


def _empty_like(field: Reals) -> Reals:
    """Return a dense array for fields of this shape, with coefficients last, or before space if they are in `field`."""
    for place in (0, 1):
        first = np.moveaxis(field, -1, place)
        if first.flags.c_contiguous and not field.flags.c_contiguous:
            return np.moveaxis(np.empty(first.shape, field.dtype), place, -1)
    return np.empty(field.shape, field.dtype)


def of_spacetime(along: str, planes: Sequence[Directions]) -> list[Directions]:
    """Return the directions along the axes of space, 1 to 3, or that of time, 0.

    Raises
    ------
    ValueError
        If `along` is unknown.
    """
    if along not in _ALONG:
        raise ValueError(f"along: {along!r}; expected 'both', 'space' or 'time'")
    kept = _ALONG[along]
    return [(tuple(set(plus) & kept), tuple(set(minus) & kept)) for plus, minus in planes]


def check_norm(norm: str | None) -> None:
    """Raise an error for norms that scipy does not know."""
    if norm not in NORMS:
        raise ValueError(f"norm: {norm!r}; expected None, 'backward', 'ortho' or 'forward'")


def _transform(
    numbers: Complexes,
    planes: Sequence[Directions],
    chosen: range,
    inverse: bool,
    norm: str | None,
    workers: int | None,
) -> None:
    """Transform `numbers` in place along the chosen spatial axes, which start at its third axis."""
    kept = [tuple(tuple(axis for axis in along if axis in chosen) for along in plane) for plane in planes]
    start = 0
    for end in range(1, len(kept) + 1):
        if end < len(kept) and kept[end] == kept[start]:
            continue
        some = numbers[start:end]
        for along, forward in zip(kept[start], (not inverse, inverse), strict=True):
            if along:
                function = scipy.fft.fftn if forward else scipy.fft.ifftn
                scale = norm if forward is not inverse else NORMS[norm]
                places = tuple(axis - chosen.start + 2 for axis in along)
                found = function(some, axes=places, norm=scale, overwrite_x=True, workers=workers)
                if not np.may_share_memory(found, some):
                    some[...] = found
        start = end


def _dense(numbers: Complexes) -> Complexes:
    """Return `numbers` if kernels can process its slabs directly, otherwise a buffer without gaps."""
    return numbers if numbers.shape[-1] >= _LONG else np.empty(numbers.shape, numbers.dtype)


def _as_one(elements: Reals, numbers: Complexes) -> Reals:
    """Return all slabs of elements as one if those of `numbers` are contiguous."""
    return elements.reshape(-1, elements.shape[-1]) if numbers.flags.c_contiguous else elements


def _pairs(numbers: Complexes) -> tuple[Reals, ...]:
    """Return each plane as pairs of numbers, real part first, as a view; slabs are merged if they are contiguous."""
    parts = numbers.reshape(len(numbers), -1) if numbers.flags.c_contiguous else numbers
    return tuple(parts[..., None].view(numbers.real.dtype))
