"""Pairs of filters along the middle axis of arrays (outer, n, inner), and extensions of signals beyond their ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from math import prod

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import DTypeLike, NDArray

from generated import filters

from ..arguments import Reals
from .sharing import blocks, in_threads, n_threads, shares

Places = NDArray[np.intp]

MODES = (
    "symmetric",
    "reflect",
    "zero",
    "constant",
    "periodic",
    "smooth",
    "antisymmetric",
    "antireflect",
    "periodization",
)
"""Extensions of a signal beyond its ends, with the names of PyWavelets."""

_SHARED = 2**14
"""Number of elements from which threads share the work, since starting one takes as long as filtering this many."""
_WHOLE = 2**18
"""Number of elements of lines below which one thread filters a copy at once: it is 2 MB, and remains in a cache."""
SHORT = 2**12
"""Number of elements below which one indexed copy is faster than three slices."""
_BLOCK = 2**15
"""Number of results that remain in a cache."""
_PIECE = 2**13
"""Number of results of lines in arrays of 64 kB, for which no memory is requested from the system."""
_LINE = 8
"""Taps of the kernels for lines; the last ones are 0 for other lengths."""
_SPLIT = {2: filters.split_2, 4: filters.split_4, 6: filters.split_6, 8: filters.split_8}
_MERGE = {1: filters.merge_1, 2: filters.merge_2, 3: filters.merge_3, 4: filters.merge_4}


def stack(array: Reals, axis: int) -> Reals:
    """Return the array with three axes: the preceding axes merged, this axis, and the following axes merged."""
    shape = array.shape
    axis %= len(shape)
    return np.ascontiguousarray(array).reshape(prod(shape[:axis]), shape[axis], prod(shape[axis + 1 :]))


@dataclass(frozen=True)
class Taps:
    """Taps of two filters: all of them, and those of the kernels for lines, eight or two times four at a time."""

    every: Reals
    lines: tuple[Reals, ...]


def extended(x: Reals, mode: str, before: int, after: int, out: Reals | None = None) -> Reals:
    """Return signals (outer, n, inner) with numbers of the mode before and after them, if there are any, in `out`."""
    if before == after == 0:
        return x
    size = x.shape[1]
    if out is None and x.size < SHORT:
        places = places_of(mode, size, before, after)
        if places is not None:
            return x.take(places, 1)
    return np.concatenate([_beyond(x, mode, -before, 0), x, _beyond(x, mode, size, size + after)], 1, out)


def _beyond(x: Reals, mode: str, start: int, stop: int) -> Reals:
    """Return the numbers of extended signals from `start` to `stop`, all before or all after the signals."""
    sources, factors = _outside(mode, x.shape[1], start, stop)
    numbers = x.take(sources, 1)
    if factors is not None:  # "zero", "smooth", "antisymmetric" and "antireflect".
        s, u, v = factors.astype(x.dtype)[:, :, None]
        numbers = s * numbers
        if u.any() or v.any():
            numbers += u * x[:, :1] + v * x[:, -1:]
    return numbers


def halved(x: Reals, mode: str, before: int, taps: Taps, count: int, workers: int | None = None) -> tuple[Reals, Reals]:
    """Return the results of `split` with a step of 2 for extended signals.

    Long signals are not copied if the kernels write to parts of an array.
    """
    size, length = x.shape[1], taps.every.shape[1]
    # The results from `first` to `last` need no numbers beyond the ends.
    first, last = (before + 1) // 2, (before + size - length) // 2 + 1
    if x.size < _SHARED or first >= last or _at_once(x, workers):
        return split(extended(x, mode, before, 2 * count + length - 2 - size - before), 2, taps, count, workers)
    both = np.empty((2, len(x), count, x.shape[2]), x.dtype)
    split(x[:, 2 * first - before :], 2, taps, last - first, workers, both[:, :, first:last])
    if first > 0:
        stop = 2 * first - 2 + length - before
        start = np.concatenate([_beyond(x, mode, -before, 0), x[:, :stop]], 1)
        split(start, 2, taps, first, 1, both[:, :, :first])
    if last < count:
        stop = 2 * count - 2 + length - before
        end = np.concatenate([x[:, 2 * last - before :], _beyond(x, mode, size, stop)], 1)
        split(end, 2, taps, count - last, 1, both[:, :, last:])
    return both[0], both[1]


def split(
    y: Reals, step: int, taps: Taps, count: int, workers: int | None = None, out: Reals | None = None
) -> tuple[Reals, Reals]:
    """Apply two filters along the middle axis: ``sum_j taps[t, j] y[step i + j]`` for the results i.

    Parameters
    ----------
    y : array, (outer, n, inner)
    step : int
    taps : Taps
        (2, K), of the type of `y`; K must be even.
    count : int
        Number of results.
    workers : int, optional
        Number of threads that share the results, see `n_threads`.
    out : array, (2, outer, count, inner), optional

    Returns
    -------
    (array, array), (outer, count, inner)
    """
    outer, _, inner = y.shape
    are_lines = inner == 1 and step == 2
    if are_lines and out is None and _at_once(y, workers):
        low, high = split_lines(y[..., 0], taps, count)
        return low[..., None], high[..., None]
    if step == 1 and out is None and y.size < SHORT:
        return split_rows(y, taps, count)
    length, both = taps.every.shape[1], np.empty((2, outer, count, inner), y.dtype) if out is None else out
    a, b, c = y.strides
    windows = as_strided(y, (outer, count, inner, length), (a, step * b, c, b), writeable=False)
    results = both.transpose(1, 2, 3, 0)
    head = length % 8 or 8

    def work_on_lines(part: tuple[slice, slice]) -> None:
        for some, start, stop in _pieces(part, outer, count):
            lines = np.ascontiguousarray(y[some, 2 * start : 2 * stop - 2 + length, 0])
            both[0, some, start:stop, 0], both[1, some, start:stop, 0] = split_lines(lines, taps, stop - start)

    def work(part: tuple[slice, slice]) -> None:
        for lines in _blocks(results[part], length > head):
            seen, some = windows[part][lines], results[part][lines]
            _SPLIT[head](seen[..., :head], taps.every[:, :head], out=some)
            for k in range(head, length, 8):
                filters.split_8_more(some, seen[..., k : k + 8], taps.every[:, k : k + 8], out=some)

    _shared(work_on_lines if are_lines else work, y, count, workers)
    return both[0], both[1]


def _at_once(numbers: Reals, workers: int | None) -> bool:
    """Return whether numbers are lines that one thread filters without dividing them."""
    few = _WHOLE if n_threads(workers) < 2 else _SHARED
    return numbers.shape[2] == 1 and numbers.size < few


def split_rows(y: Reals, taps: Taps, count: int) -> tuple[Reals, Reals]:
    """Return the results of `split` with a step of 1, in one thread."""
    low, high = filters.filter_rows(y, taps.lines[0], np.empty((count, y.shape[2]), y.dtype))
    for k, more in enumerate(taps.lines[1:], 1):
        low, high = filters.filter_rows_more(low, high, np.ascontiguousarray(y[:, _LINE * k :]), more)
    return low, high


def split_lines(y: Reals, taps: Taps, count: int) -> tuple[Reals, Reals]:
    """Return the results of `split` with a step of 2 for lines, the last axis of `y`, in one thread."""
    low, high = filters.split_line(y, taps.lines[0], np.empty(count, y.dtype))
    for k, more in enumerate(taps.lines[1:], 1):
        # A contiguous copy costs a tenth of what the kernel takes to read other arrays.
        low, high = filters.split_line_more(low, high, np.ascontiguousarray(y[..., _LINE * k :]), more)
    return low, high


def merge(low: Reals, high: Reals, taps: Taps, pairs: int, workers: int | None = None) -> Reals:
    """Upsample two bands by inserting zeros, filter each, and return the sum of the results.

    Parameters
    ----------
    low, high : array, (outer, n, inner)
    taps : Taps
        (2, 2, K): for even and for odd results, and for each band, the taps in the order of its numbers.
    pairs : int
        Number of pairs of results; pair i has the numbers i to i + K - 1 of each band.
    workers : int, optional
        As in `split`.

    Returns
    -------
    array, (outer, 2 * pairs, inner)
    """
    half, (outer, _, inner) = taps.every.shape[2], low.shape
    if _at_once(low, workers):
        return merge_lines(low[..., 0], high[..., 0], taps, pairs).reshape(outer, 2 * pairs, 1)
    result = np.empty((outer, 2 * pairs, inner), low.dtype)
    windows = [
        as_strided(band, (outer, pairs, inner, half), (*band.strides, band.strides[1]), writeable=False)
        for band in (low, high)
    ]
    results = result.reshape(outer, pairs, 2, inner).transpose(0, 1, 3, 2)
    head = half % 4 or 4

    def work_on_lines(part: tuple[slice, slice]) -> None:
        for some, start, stop in _pieces(part, outer, pairs):
            a, b = (np.ascontiguousarray(band[some, start : stop - 1 + half, 0]) for band in (low, high))
            results[some, start:stop, 0] = merge_lines(a, b, taps, stop - start)

    def work(part: tuple[slice, slice]) -> None:
        for lines in _blocks(results[part], half > head):
            (a, b), some = (each[part][lines] for each in windows), results[part][lines]
            _MERGE[head](a[..., :head], b[..., :head], taps.every[..., :head], out=some)
            for k in range(head, half, 4):
                more = slice(k, k + 4)
                filters.merge_4_more(some, a[..., more], b[..., more], taps.every[..., more], out=some)

    _shared(work_on_lines if inner == 1 else work, result, pairs, workers)
    return result


def merge_lines(low: Reals, high: Reals, taps: Taps, pairs: int) -> Reals:
    """Return the results of `merge` for lines, the last axes of the bands, as pairs, in one thread."""
    sums: Reals = filters.merge_line(low, high, taps.lines[0], np.empty(pairs, low.dtype))
    for k, more in enumerate(taps.lines[1:], 1):
        rest = slice(_LINE // 2 * k, None)
        bands = np.ascontiguousarray(low[..., rest]), np.ascontiguousarray(high[..., rest])
        sums = filters.merge_line_more(sums, *bands, more)
    return sums


def split_taps(low: NDArray[np.float64], high: NDArray[np.float64], dtype: DTypeLike) -> Taps:
    """Return the taps of `split` for filters that are given as for convolutions."""
    return as_taps(np.stack([low[::-1], high[::-1]]), dtype)


def merge_taps(low: NDArray[np.float64], high: NDArray[np.float64], dtype: DTypeLike) -> Taps:
    """Return the taps of `merge` for filters that are given as for convolutions."""
    every = np.ascontiguousarray(np.stack([low, high]).reshape(2, -1, 2)[:, ::-1].transpose(2, 0, 1), dtype)
    return Taps(every, _parts(every, _LINE // 2))


def as_taps(every: Reals, dtype: DTypeLike) -> Taps:
    """Return the taps of `split` for sums of products."""
    contiguous = np.ascontiguousarray(every, dtype)
    return Taps(contiguous, _parts(contiguous, _LINE))


def _parts(taps: Reals, size: int) -> tuple[Reals, ...]:
    count = -(-taps.shape[-1] // size)
    padded = np.zeros((*taps.shape[:-1], count * size), taps.dtype)
    padded[..., : taps.shape[-1]] = taps
    return tuple(np.ascontiguousarray(padded[..., k * size : (k + 1) * size]) for k in range(count))


@lru_cache(256)
def places_of(mode: str, size: int, before: int, after: int) -> Places | None:
    """Return the places of all numbers of an extended signal, or None if some are not numbers of the signal."""
    first, last = _outside(mode, size, -before, 0), _outside(mode, size, size, size + after)
    if first[1] is not None or last[1] is not None:
        return None
    return np.concatenate([first[0], np.arange(size), last[0]])


@lru_cache(256)
def _outside(mode: str, n: int, start: int, stop: int) -> tuple[Places, NDArray[np.float64] | None]:
    """Return sources p and factors s, u, v of the numbers at `start` to `stop`: ``s x[p] + u x[0] + v x[n - 1]``.

    Factors are None if all numbers are x[p].
    """
    q = np.arange(start, stop)
    s, u, v = np.ones(len(q)), np.zeros(len(q)), np.zeros(len(q))
    if mode == "zero":
        p, s = 0 * q, 0 * s
    elif mode == "constant" or n == 1:
        p = np.clip(q, 0, n - 1)
        s = np.where((q % 2 == 1) & (mode == "antisymmetric"), -1.0, s)
    elif mode == "periodic":
        p = q % n
    elif mode == "periodization":
        p = np.minimum(q % (n + n % 2), n - 1)
    elif mode == "reflect":
        r = q % (2 * n - 2)
        p = np.minimum(r, 2 * n - 2 - r)
    elif mode in ("symmetric", "antisymmetric"):
        r = q % (2 * n)
        p = np.minimum(r, 2 * n - 1 - r)
        s = np.where((r >= n) & (mode == "antisymmetric"), -1.0, s)
    elif mode == "smooth":
        p = np.where(q < 0, 1, n - 2)
        s, u, v = np.where(q < 0, [q, 1 - q, 0 * q], [n - 1 - q, 0 * q, q + 2 - n]).astype(float)
    else:
        m, r = np.divmod(q, n - 1)
        is_even = m % 2 == 0
        p = np.where(is_even, r, n - 1 - r)
        s, u, v = np.where(is_even, [0 * m + 1, -m, m], [0 * m - 1, 1 - m, m + 1]).astype(float)
    has_factors = (s != 1).any() or u.any() or v.any()
    return p.astype(np.intp), np.stack([s, u, v]) if has_factors else None


def _shared(work: Callable[[tuple[slice, slice]], None], whole: Reals, count: int, workers: int | None) -> None:
    """Call `work` for parts that threads share: of the first axis, or else of `count` results along the middle axis."""
    every = slice(None)
    if whole.size < _SHARED or n_threads(workers) < 2:
        work((every, every))
    elif len(whole) > 1 or whole.shape[2] == 1:
        in_threads(work, [(some, every) for some in shares(len(whole), workers)], workers)
    else:
        in_threads(work, [(every, some) for some in shares(count, workers)], workers)


def _pieces(part: tuple[slice, slice], outer: int, count: int) -> Iterator[tuple[slice, int, int]]:
    """Return blocks of a part of lines whose results remain in a cache, before they are copied."""
    first, last, _ = part[0].indices(outer)
    start, stop, _ = part[1].indices(count)
    for some, place in blocks(last - first, stop - start, 1, _PIECE):
        yield slice(first + some.start, first + some.stop), start + place.start, start + place.stop


def _blocks(out: Reals, is_repeated: bool) -> Iterator[tuple[slice, slice]]:
    """Return blocks of results that remain in a cache while terms are added to them."""
    everything = slice(None)
    axis = 0 if out.shape[2] == 1 else 1
    count = out.shape[axis]
    size = max(_BLOCK * count // max(out.size, 1), 1) if is_repeated else max(count, 1)
    for start in range(0, count, size):
        some = slice(start, start + size)
        yield (some, everything) if axis == 0 else (everything, some)
