"""Fields of multivectors as complex planes, in memory where `scipy.fft` transforms them in place, and back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from ..arguments import Reals
from .sharing import Progress, in_threads, n_threads, slices, steps

Complexes = NDArray[Any]
"""An array of complex64 or complex128."""

Directions = tuple[tuple[int, ...], tuple[int, ...]]
"""The axes of space along which a plane is transformed forward, and backward."""

NORMS = {None: "forward", "backward": "forward", "forward": "backward", "ortho": "ortho"}
"""scipy's norms, with the one that gives a transform with the sign of the exponent turned round the same scale."""

_LINE = 64
"""Bytes of a line of a cache."""
_BLOCK = 2**21
"""Bytes of complex numbers that stay in a cache between a kernel and the planes."""
_KEPT = 2**26
"""Bytes that are kept for the next transform: new memory from the system costs a tenth of the time."""
_memory: list[NDArray[np.uint8]] = []
"""One piece at most."""
_LONG = 4096
"""Elements in a slab from which on kernels go to the planes and back themselves."""


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
) -> Reals:
    """The transform of a field: complex ones in place, between two passes of kernels.

    Parameters
    ----------
    field : array, (..., *space, K)
        In any memory order; it is not copied.
    name : str
        What the caller calls it.
    pack, unpack : kernel
        From elements (n, K) to as many complex numbers (n, 2) as there are planes, real parts first, and back.
    planes : sequence of directions
        Of each complex number.
    inverse : bool
        Whether all directions are turned round.
    norm, workers
        As in `scipy.fft`. Workers share the passes of kernels too.
    progress : function of (done, total), optional
        Called after each step: each part of the two passes, and each plane between them.

    Returns
    -------
    array, (..., *space, K)
        Coefficients are first in memory where they are in `field`, else last.

    Raises
    ------
    ValueError
        For an unknown norm, an empty axis of space, and where a number, or the transform, is not finite.
    """
    check_norm(norm)
    axes = sum(map(len, planes[0]))
    space, size = field.shape[-1 - axes : -1], field.shape[-1]
    if 0 in space:
        raise ValueError(f"{name}: shape {field.shape}; expected no empty axis")
    slabs = int(np.prod(field.shape[:-axes])), int(np.prod(space[1:]))
    memory, numbers = _empty_planes(len(planes), *slabs, np.result_type(field.dtype, np.complex64))
    # Where nothing is copied through the cache and no threads wait for parts, fewer calls are faster.
    block = _BLOCK if slabs[1] < _LONG or n_threads(workers) > 1 else 4 * _BLOCK
    places = list(slices(slabs[0], max(block // (len(planes) * slabs[1] * numbers.itemsize), 1)))
    told = steps(progress, 2 * len(places) + len(planes))

    def packed(place: slice) -> None:
        some, values = numbers[:, place], elements[place]
        dense = _dense(some)
        pack(_as_one(values, dense), out=_pairs(dense))
        # Along all axes but the first, while these slabs are in the cache.
        inside = dense.reshape(len(planes), -1, *space[1:], copy=False)
        _transform(inside, planes, range(1, axes), inverse, norm, 1)
        if dense is not some:
            some[...] = dense
        told()

    def unpacked(place: slice) -> None:
        some, values = numbers[:, place], elements[place]
        dense = _dense(some)
        if dense is not some:
            dense[...] = some
        unpack(*_pairs(dense), out=_as_one(values, dense))
        told()

    elements = field.reshape(*slabs, size)
    in_threads(packed, places, workers)
    stack = numbers.reshape(len(planes), -1, space[0], slabs[1], copy=False)
    for k in range(len(planes)):
        _transform(stack[k : k + 1], planes[k : k + 1], range(1), inverse, norm, workers)
        told()
    result = _empty_like(field.reshape(-1, *space, size))
    elements = result.reshape(*slabs, size, copy=False)
    in_threads(unpacked, places, workers)
    _keep(memory)
    first: Any = (slice(None), *(0,) * axes, slice(None))
    if not np.isfinite(result[first]).all():
        # Every number is a term of the first of the result.
        raise ValueError(f"{name}: a number, or the sum of all, is not finite; expected finite numbers")
    return result.reshape(field.shape)


def _empty_planes(count: int, slabs: int, size: int, dtype: np.dtype[Any]) -> tuple[NDArray[np.uint8], Complexes]:
    """Planes of so many slabs, (count, slabs, size), an odd number of lines of the cache apart.

    Also the memory that they are in, for `_keep`.

    At a large power of two all numbers along the first axis would fall into the same few places of the cache, and the
    transform takes half as long again.
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
        _memory[:] = [memory]  # in one step, whatever other threads keep


def _empty_like(field: Reals) -> Reals:
    """A dense stack of fields of this shape: coefficients last, or before space where they are in this one."""
    for place in (0, 1):
        first = np.moveaxis(field, -1, place)
        if first.flags.c_contiguous and not field.flags.c_contiguous:
            return np.moveaxis(np.empty(first.shape, field.dtype), place, -1)
    return np.empty(field.shape, field.dtype)


def check_norm(norm: str | None) -> None:
    """Refuse what scipy does not know."""
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
    """Along the chosen axes of space, which the third axis of `numbers` begins with, in place."""
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
    """Itself where kernels may go over its slabs, else other memory, without gaps."""
    return numbers if numbers.shape[-1] >= _LONG else np.empty(numbers.shape, numbers.dtype)


def _as_one(elements: Reals, numbers: Complexes) -> Reals:
    """All slabs of elements as one, where those of numbers are."""
    return elements.reshape(-1, elements.shape[-1]) if numbers.flags.c_contiguous else elements


def _pairs(numbers: Complexes) -> tuple[Reals, ...]:
    """Each plane as pairs of numbers, real part first, in the same memory; all slabs as one where that is possible."""
    parts = numbers.reshape(len(numbers), -1) if numbers.flags.c_contiguous else numbers
    return tuple(parts[..., None].view(numbers.real.dtype))
