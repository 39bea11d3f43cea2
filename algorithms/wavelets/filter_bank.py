"""Pairs of filters along the middle axis of arrays (outer, n, inner), and extensions of signals beyond their ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from math import prod

import numpy as np
from numpy.typing import DTypeLike, NDArray

from generated import filters

from ..arguments import Reals
from .sharing import in_threads, n_threads, shares

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
_GATHERED = 2**11
"""Number of elements below which one indexed copy is faster than three slices."""
_BLOCK = 2**15
"""Number of results that remain in a cache."""
_SPLIT = {2: filters.split_2, 4: filters.split_4, 6: filters.split_6, 8: filters.split_8}
_MERGE = {1: filters.merge_1, 2: filters.merge_2, 3: filters.merge_3, 4: filters.merge_4}


def stack(array: Reals, axis: int) -> Reals:
    """Return the array with three axes: the preceding axes merged, this axis, and the following axes merged."""
    shape = array.shape
    axis %= len(shape)
    return np.ascontiguousarray(array).reshape(prod(shape[:axis]), shape[axis], prod(shape[axis + 1 :]))


def extended(x: Reals, mode: str, before: int, after: int) -> Reals:
    """Return signals (outer, n, inner) with numbers of the mode before and after them."""
    if before == after == 0:
        return x
    size = x.shape[1]
    if x.size < _GATHERED:
        places = _places(mode, size, before, after)
        if places is not None:
            return x.take(places, 1)
    y = np.empty((len(x), before + size + after, x.shape[2]), x.dtype)
    y[:, before : before + size] = x
    for start, stop in ((-before, 0), (size, size + after)):
        sources, factors = _outside(mode, size, start, stop)
        numbers = x.take(sources, 1)
        if factors is not None:  # "zero", "smooth", "antisymmetric" and "antireflect".
            s, u, v = factors.astype(x.dtype)[:, :, None]
            numbers = s * numbers
            if u.any() or v.any():
                numbers += u * x[:, :1] + v * x[:, -1:]
        y[:, before + start : before + stop] = numbers
    return y


def split(y: Reals, step: int, taps: Reals, count: int, workers: int | None = None, out: Reals | None = None) -> Reals:
    """Apply two filters along the middle axis: ``sum_j taps[t, j] y[step i + j]`` for the results i.

    Parameters
    ----------
    y : array, (outer, n, inner)
    step : int
    taps : array, (2, K)
        Contiguous and of the type of `y`; K must be even.
    count : int
        Number of results.
    workers : int, optional
        Number of threads that share the results, see `n_threads`.
    out : array, (2, outer, count, inner), optional

    Returns
    -------
    array, (2, outer, count, inner)
    """
    length, (outer, _, inner) = taps.shape[1], y.shape
    both = np.empty((2, outer, count, inner), y.dtype) if out is None else out
    a, b, c = y.strides
    windows = np.ndarray((outer, count, inner, length), y.dtype, y, 0, (a, step * b, c, b))
    results = both.transpose(1, 2, 3, 0)
    head = length % 8 or 8

    def work(part: tuple[slice, slice]) -> None:
        for lines in _blocks(results[part], length > head):
            seen, some = windows[part][lines], results[part][lines]
            _SPLIT[head](seen[..., :head], taps[:, :head], out=some)
            for k in range(head, length, 8):
                filters.split_8_more(some, seen[..., k : k + 8], taps[:, k : k + 8], out=some)

    _shared(work, y, count, workers)
    return both


def merge(low: Reals, high: Reals, taps: Reals, pairs: int, workers: int | None = None) -> Reals:
    """Upsample two bands by inserting zeros, filter each, and return the sum of the results.

    Parameters
    ----------
    low, high : array, (outer, n, inner)
    taps : array, (2, 2, K)
        For even and for odd results, and for each band, the taps in the order of its numbers.
    pairs : int
        Number of pairs of results; pair i has the numbers i to i + K - 1 of each band.
    workers : int, optional
        As in `split`.

    Returns
    -------
    array, (outer, 2 * pairs, inner)
    """
    half, (outer, _, inner) = taps.shape[2], low.shape
    result = np.empty((outer, 2 * pairs, inner), low.dtype)
    windows = [
        np.ndarray((outer, pairs, inner, half), band.dtype, band, 0, (*band.strides, band.strides[1]))
        for band in (low, high)
    ]
    results = result.reshape(outer, pairs, 2, inner).transpose(0, 1, 3, 2)
    head = half % 4 or 4

    def work(part: tuple[slice, slice]) -> None:
        for lines in _blocks(results[part], half > head):
            (a, b), some = (each[part][lines] for each in windows), results[part][lines]
            _MERGE[head](a[..., :head], b[..., :head], taps[..., :head], out=some)
            for k in range(head, half, 4):
                more = slice(k, k + 4)
                filters.merge_4_more(some, a[..., more], b[..., more], taps[..., more], out=some)

    _shared(work, result, pairs, workers)
    return result


def split_taps(low: NDArray[np.float64], high: NDArray[np.float64], dtype: DTypeLike) -> Reals:
    """Return the taps of `split` for filters that are given as for convolutions."""
    return np.ascontiguousarray(np.stack([low[::-1], high[::-1]]), dtype)


def merge_taps(low: NDArray[np.float64], high: NDArray[np.float64], dtype: DTypeLike) -> Reals:
    """Return the taps of `merge` for filters that are given as for convolutions."""
    return np.ascontiguousarray(np.stack([low, high]).reshape(2, -1, 2)[:, ::-1].transpose(2, 0, 1), dtype)


@lru_cache(256)
def _places(mode: str, size: int, before: int, after: int) -> Places | None:
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


def _blocks(out: Reals, is_repeated: bool) -> Iterator[tuple[slice, slice]]:
    """Return blocks of results that remain in a cache while terms are added to them."""
    everything = slice(None)
    axis = 0 if out.shape[2] == 1 else 1
    count = out.shape[axis]
    size = max(_BLOCK * count // max(out.size, 1), 1) if is_repeated else max(count, 1)
    for start in range(0, count, size):
        some = slice(start, start + size)
        yield (some, everything) if axis == 0 else (everything, some)
