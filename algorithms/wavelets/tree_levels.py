"""Levels of dual trees along any axes, as orthogonal periodic transforms of rearranged samples."""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals
from .discrete import divided
from .discrete import joined as joined_bands
from .families import orthogonal_filters
from .filter_bank import Taps, as_taps, extended, merge, merge_taps, split_taps, stack
from .filter_bank import split as filtered
from .filters import LEVEL_ONE_ANALYSIS, LEVEL_ONE_SYNTHESIS, QSHIFT
from .sharing import Progress, n_threads, steps

Bands = dict[str, Reals]
"""The details of one level, named as in `WaveletPyramid`, with both trees interleaved along each axis."""


def split(
    array: Reals,
    axes: tuple[int, ...],
    levels: int,
    first: str,
    later: str,
    workers: int | None = None,
    progress: Progress | None = None,
) -> tuple[Reals, list[Bands]]:
    """Return the approximation and the details of each level, with the trees interleaved along all axes."""
    _check_filters(first, later)
    n_threads(workers)
    step_done, bands = steps(progress, levels), []
    for level in range(levels):
        array = _padded(array, axes, level)
        # A large single allocation is served by the system in large pages.
        work = list(np.empty((2 ** len(axes) - 1, 2, *array.shape), array.dtype)) if level == 0 else []

        def halves(band: Reals, axis: int, level: int = level, work: list[Reals] = work) -> tuple[Reals, Reals]:
            return (
                _first_halves(band, first, axis, work.pop(), workers)
                if level == 0
                else _later_halves(band, later, axis, workers)
            )

        array, details = divided(array, axes, halves)
        bands.append(details)
        step_done()
    return array.copy() if levels == 1 else array, bands


def joined(
    approx: Reals,
    axes: tuple[int, ...],
    bands: list[Bands],
    first: str,
    later: str,
    size: tuple[int, ...],
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reals:
    """Return the arrays whose `split` is given, with `size` numbers along the axes: the inverse of `split`."""
    n_threads(workers)
    array, step_done = approx, steps(progress, len(bands))
    sizes = [size]
    for level in range(1, len(bands)):
        sizes.append(tuple(_halved_size(n, level) for n in sizes[-1]))
    for level in range(len(bands) - 1, -1, -1):

        def join(low: Reals, high: Reals, axis: int, level: int = level) -> Reals:
            return (
                _first_join(low, high, first, axis, workers)
                if level == 0
                else _later_join(low, high, later, axis, workers)
            )

        array = joined_bands(array, bands[level], axes, join)
        places = [slice(None)] * array.ndim
        for axis, wanted in zip(axes, sizes[level], strict=True):
            before = (array.shape[axis] - wanted) // 2
            places[axis] = slice(before, before + wanted)
        array = array[tuple(places)]
        step_done()
    return np.ascontiguousarray(array)


def trees(samples: Reals, axes: tuple[int, ...]) -> list[Reals]:
    """Return the samples of each tree; the last axis changes fastest."""
    found = []
    for starts in product((0, 1), repeat=len(axes)):
        places = [slice(None)] * samples.ndim
        for axis, start in zip(axes, starts, strict=True):
            places[axis] = slice(start, None, 2)
        found.append(samples[tuple(places)])
    return found


def _padded(array: Reals, axes: tuple[int, ...], level: int) -> Reals:
    """Return the array with edges repeated: to even sizes before level 0, and to multiples of 4 before others.

    The first level appends one number. Later ones add one before and one after, so that the trees remain mirror images.
    """
    padding = [(0, 0)] * array.ndim
    for axis in axes:
        size = array.shape[axis]
        padding[axis] = (0, size % 2) if level == 0 else (size % 4 // 2, size % 4 // 2)
    return np.pad(array, padding, "edge") if any(map(any, padding)) else array


def _halved_size(size: int, level: int) -> int:
    """Return the size of the approximation before this level, 1 or more, from that before the previous level."""
    return size + size % 2 if level == 1 else (size + size % 4) // 2


def _first_halves(array: Reals, name: str, axis: int, work: Reals, workers: int | None) -> tuple[Reals, Reals]:
    """Return both filtered arrays of the first level, whose trees take the even and the odd samples."""
    x = stack(array, axis)
    taps = _first_taps(name, x.dtype)[0]
    reach = taps.every.shape[1] // 2
    out = work.reshape(2, *x.shape, copy=False)
    low, high = filtered(extended(x, "symmetric", reach - 1, reach), 1, taps, x.shape[1], workers, out)
    return low.reshape(array.shape), high.reshape(array.shape)


def _later_halves(array: Reals, name: str, axis: int, workers: int | None) -> tuple[Reals, Reals]:
    # The transform is periodic over the samples of one tree forward, followed by those of the other backward.
    x = stack(array, axis)
    size, taps = x.shape[1], _later_taps(name, x.dtype)[0]
    before = taps.every.shape[1] // 2 - 1
    y = extended(x.take(_there_and_back(size, 0), 1), "periodic", before, before)
    low, high = filtered(y, 2, taps, size // 2, workers)
    shape = list(array.shape)
    shape[axis] //= 2
    parts = low.take(_and_back(size // 2, 0), 1), high.take(_and_back(size // 2, 1), 1)
    return parts[0].reshape(shape), parts[1].reshape(shape)


def _first_join(low: Reals, high: Reals, name: str, axis: int, workers: int | None) -> Reals:
    """Return the sum of both filtered bands, two adjacent results for each window of alternating numbers."""
    taps = _first_taps(name, low.dtype)[1]
    reach = (taps.every.shape[1] // 2 - 2) // 2
    bands = [stack(band, axis) for band in (low, high)]
    outer, size, inner = bands[0].shape
    both = np.empty((outer, size + 2 * reach, 2, inner), low.dtype)
    for k, band in enumerate(bands):
        extended(band, "symmetric", reach, reach, both[:, :, k])
    pairs = size // 2
    result = np.empty((outer, pairs, 2, inner), low.dtype)
    filtered(both.reshape(outer, -1, inner), 4, taps, pairs, workers, result.transpose(2, 0, 1, 3))
    return result.reshape(low.shape)


def _later_join(low: Reals, high: Reals, name: str, axis: int, workers: int | None) -> Reals:
    shape, size = list(low.shape), low.shape[axis]
    taps = _later_taps(name, low.dtype)[1]
    half = taps.every.shape[2]
    bands = [
        extended(stack(band, axis).take(_there_and_back(size, start), 1), "periodic", half // 2, half // 2)
        for start, band in enumerate((low, high))
    ]
    around = merge(bands[0], bands[1], taps, size + 1 - half % 2, workers)
    shape[axis] *= 2
    return around[:, (half - 1) % 2 :].take(_and_back(2 * size, 0), 1).reshape(shape)


@lru_cache
def _first_taps(name: str, dtype: np.dtype[np.floating]) -> tuple[Taps, Taps]:
    """Return the taps of analysis, and those of synthesis for two adjacent results from alternating bands.

    The symmetric filters have different lengths: zeros surround the shorter one. One zero after both makes the number
    of taps even.
    """
    low, back = np.array(LEVEL_ONE_ANALYSIS[name]), np.array(LEVEL_ONE_SYNTHESIS[name])
    high, high_back = (taps * (-1.0) ** (np.arange(len(taps)) - len(taps) // 2) for taps in (back, low))
    reach = max(len(low), len(back)) // 2
    low, high, back, high_back = (np.pad(taps, reach - len(taps) // 2) for taps in (low, high, back, high_back))
    joint = np.stack([back, high_back], 1).ravel()
    forth = np.pad(np.stack([low, high]), [(0, 0), (0, 1)])
    return as_taps(forth, dtype), as_taps(np.stack([np.pad(joint, (0, 2)), np.pad(joint, (2, 0))]), dtype)


@lru_cache
def _later_taps(name: str, dtype: np.dtype[np.floating]) -> tuple[Taps, Taps]:
    """Return the taps of analysis and of synthesis."""
    filters = orthogonal_filters(np.array(QSHIFT[name])[::-1])
    return split_taps(filters.low, filters.high, dtype), merge_taps(filters.low_back, filters.high_back, dtype)


@lru_cache
def _there_and_back(size: int, start: int) -> NDArray[np.intp]:
    """Return the samples of one tree forward, then those of the other one backward."""
    forward = np.arange(start, size, 2)
    return np.concatenate([forward, np.arange(1 - start, size, 2)[::-1]])


@lru_cache
def _and_back(size: int, start: int) -> NDArray[np.intp]:
    """Return the inverse of the permutation `_there_and_back`."""
    return np.argsort(_there_and_back(size, start))


def _check_filters(first: str, later: str) -> None:
    for name, value, known in (("first", first, LEVEL_ONE_ANALYSIS), ("later", later, QSHIFT)):
        if value not in known:
            raise ValueError(f"{name}: {value!r}; expected {', '.join(map(repr, known))}")
