"""Fields of multivectors as complex planes, in memory where `scipy.fft` transforms them in place, and back."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import product as every
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from ..arguments import Reals

Complexes = NDArray[Any]
"""An array of complex64 or complex128."""

Progress = Callable[[int, int], object]
"""Told how many of how many steps are done."""

Directions = tuple[tuple[int, ...], tuple[int, ...]]
"""The axes of space along which a plane is transformed forward, and backward."""

NORMS = {None: "forward", "backward": "forward", "forward": "backward", "ortho": "ortho"}
"""scipy's norms, with the one that gives a transform with the sign of the exponent turned round the same scale."""

_LINE = 64
"""Bytes of a line of a cache."""
_BLOCK = 2**18
"""Bytes of all planes that a kernel writes at once, so that they are in a cache when they are moved."""
_SMALL = 1024
"""Numbers in the last two axes from which on the axes before them get room between their neighbours."""


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
        Called after each step: the two passes, and each plane along each axis.

    Returns
    -------
    array, (..., *space, K)
        Coefficients are first in memory where they are in `field`, else last.

    Raises
    ------
    ValueError
        For an unknown norm, an empty axis of space, and where a number, or the transform, is not finite.
    """
    if norm not in NORMS:
        raise ValueError(f"norm: {norm!r}; expected None, 'backward', 'ortho' or 'forward'")
    axes = sum(map(len, planes[0]))
    if 0 in field.shape[-1 - axes : -1]:
        raise ValueError(f"{name}: shape {field.shape}; expected no empty axis")
    numbers = empty_planes(len(planes), field.shape[:-1], axes, np.result_type(field.dtype, np.complex64))
    total = len(planes) * axes + 2
    done = 0

    def told(steps: int) -> None:
        nonlocal done
        done += steps
        if progress is not None:
            progress(done, total)

    def packed(values: Reals, some: Complexes, dense: Complexes) -> None:
        pack(values.reshape(-1, values.shape[-1]), out=_pairs(dense))
        some[...] = dense

    def unpacked(values: Reals, some: Complexes, dense: Complexes) -> None:
        dense[...] = some
        unpack(*_pairs(dense), out=values.reshape(-1, values.shape[-1]))

    _in_blocks(field, numbers, packed, workers)
    told(1)
    start = 0
    while start < len(planes):
        end = start + 1
        while end < len(planes) and planes[end] == planes[start] and progress is None:
            end += 1
        _transform(numbers[start:end], axes, planes[start], inverse, norm, workers, told)
        start = end
    result = empty_like(field)
    _in_blocks(result, numbers, unpacked, workers)
    told(1)
    first: Any = (..., *(0,) * axes, slice(None))
    if not np.isfinite(result[first]).all():
        # Every number is a term of the first of the result.
        raise ValueError(f"{name}: a number, or the sum of all, is not finite; expected finite numbers")
    return result


def empty_planes(count: int, shape: tuple[int, ...], axes: int, dtype: np.dtype[Any]) -> Complexes:
    """Planes, (count, *shape), whose last `axes` axes will be transformed.

    Neighbours along an axis are an odd number of lines of the cache apart, with room between rows: at powers of two
    they would fall into the same few places of the cache, and a transform takes half as long again.
    """
    rows = list(shape)
    each = _LINE // dtype.itemsize
    rows[-1] = (-(-shape[-1] // each) | 1) * each
    if axes > 2 and shape[-1] * shape[-2] >= _SMALL:
        for axis in range(1 - axes, -1):
            rows[axis] |= 1
    inside: Any = (..., *(slice(n) for n in shape))
    planes: Complexes = np.empty((count, *rows), dtype)[inside]
    return planes


def empty_like(field: Reals) -> Reals:
    """A field of this shape: coefficients are first in memory where they are in this one, else last."""
    first = np.moveaxis(field, -1, 0)
    if first.flags.c_contiguous and not field.flags.c_contiguous:
        return np.moveaxis(np.empty(first.shape, field.dtype), 0, -1)
    return np.empty(field.shape, field.dtype)


def n_threads(workers: int | None) -> int:
    """How many threads `workers` are, counted as by `scipy.fft`."""
    if not workers:
        return 1
    return workers if workers > 0 else max((os.cpu_count() or 1) + 1 + workers, 1)


def in_threads(run: Callable[[int, int], object], pieces: int, workers: int | None) -> None:
    """``run(k, n)`` in n threads, at most one for each of so many pieces; thread k does every n-th of them."""
    several = min(n_threads(workers), pieces)
    if several < 2:
        run(0, 1)
        return
    with ThreadPoolExecutor(several) as pool:
        list(pool.map(run, range(several), [several] * several))


def _transform(
    numbers: Complexes,
    axes: int,
    directions: Directions,
    inverse: bool,
    norm: str | None,
    workers: int | None,
    told: Callable[[int], None],
) -> None:
    """In place, as all memory of `empty_planes` is complex."""
    for along, forward in ((directions[0], not inverse), (directions[1], inverse)):
        function = scipy.fft.fftn if forward else scipy.fft.ifftn
        scale = norm if forward is not inverse else NORMS[norm]
        for chosen in [(axis,) for axis in along] if len(numbers) == 1 else [along] if along else []:
            places = tuple(axis - axes for axis in chosen)
            result = function(numbers, axes=places, norm=scale, overwrite_x=True, workers=workers)
            if not np.may_share_memory(result, numbers):
                numbers[...] = result
            told(len(numbers) * len(chosen))


def _pairs(dense: Complexes) -> tuple[Reals, ...]:
    """Each plane as pairs of numbers, (n, 2), real part first, in the same memory."""
    return tuple(dense.reshape(len(dense), -1, 1).view(dense.real.dtype))


def _in_blocks(field: Reals, planes: Complexes, work: Callable[..., None], workers: int | None) -> None:
    """For every block of rows: the elements, their numbers in the planes, and dense memory for these."""
    if field.ndim < 3:
        field, planes = field[None], planes[:, None]
    field, planes = _joined(field, planes)
    count, (lines, columns) = len(planes), field.shape[-3:-1]
    rows = max(min(_BLOCK // max(count * columns * planes.itemsize, 1), lines), 1)
    places: list[Any] = [
        (*lead, slice(start, start + rows))
        for lead in every(*map(range, field.shape[:-3]))
        for start in range(0, lines, rows)
    ]

    def run(first: int, step: int) -> None:
        dense = np.empty(count * rows * columns, planes.dtype)
        for place in places[first::step]:
            numbers = planes[(slice(None), *place)]
            work(field[place], numbers, dense[: numbers.size].reshape(numbers.shape))

    in_threads(run, len(places), workers)


def _joined(field: Reals, planes: Complexes) -> tuple[Reals, Complexes]:
    """All axes before the columns as one, where no memory is between them."""
    rows = int(np.prod(field.shape[:-2]))
    try:
        one = np.reshape(field, (rows, *field.shape[-2:]), copy=False)
        return one, np.reshape(planes, (len(planes), rows, planes.shape[-1]), copy=False)
    except ValueError:
        return field, planes
