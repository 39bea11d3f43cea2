"""Pairs of filters along one axis, split into their even and odd taps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

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
"""How a signal goes on beyond its ends, in PyWavelets' words."""


_LEAST = 2**14
"""Numbers from which on threads share the work, and lines are not copied that lie as filters need them."""
_BLOCK = 2**15
"""Results that stay in a cache."""


@dataclass(frozen=True)
class Lines:
    """Where the numbers that filters see are found in a signal of n numbers x.

    Attributes
    ----------
    places : array of int
        For each number in turn; n + k stands for the k-th border number.
    border : array, (borders, 4)
        p, s, u and v of each border number, ``s x[p] + u x[0] + v x[n - 1]``.
    """

    places: Places
    border: NDArray[np.float64]


def split(
    array: Reals,
    axis: int,
    step: int,
    taps: Reals,
    lines: Lines,
    to: tuple[Places, Places],
    out: Reals | None = None,
    workers: int | None = None,
) -> tuple[Reals, Reals]:
    """Two filters along an axis: ``sum_j taps[t, j] y[step i + j]`` for the numbers y that `lines` finds.

    Parameters
    ----------
    array : array
    axis, step : int
        step is 1 or 2.
    taps : array, (2, K)
        K is even.
    lines : Lines
    to : (array of int, array of int)
        Where the results i are put, for either filter.
    out : array, (2, ...), optional
        Dense, for the results.
    workers : int, optional
        How many threads share the results, see `n_threads`.

    Returns
    -------
    (array, array)
    """
    stack = _stack(array, axis)
    shape = list(array.shape)
    shape[axis] = len(to[0])
    both = np.empty((2, *shape), array.dtype) if out is None else out
    result = both.reshape(2, len(stack), len(to[0]), stack.shape[2], copy=False)
    weights = np.ascontiguousarray(taps, array.dtype)

    def work(part: tuple[slice, slice]) -> None:
        some, place = part
        _split(stack[some], step, weights, lines, to, place, result[:, some])

    in_threads(work, _parts(stack, len(to[0]), workers), workers)
    return both[0], both[1]


def merge(
    bands: tuple[Reals, Reals],
    axis: int,
    taps: Reals,
    places: tuple[Places, Places],
    first: int,
    to: Places,
    workers: int | None = None,
) -> Reals:
    """The sum of two signals with zeros put between their numbers, each filtered.

    Parameters
    ----------
    bands : (array, array)
        Of one shape.
    axis : int
    taps : array, (2, K)
        K is even.
    places : (array of int, array of int)
        Where the numbers of either band are found, ``places[K/2 - 1]`` that which the first two results end with.
    first : int
        1 where the first of all results is left out, else 0.
    to : array of int
        Where the others are put.
    workers : int, optional
        As in `split`.

    Returns
    -------
    array
    """
    stacks = [_stack(np.asarray(band, bands[0].dtype), axis) for band in bands]
    shape = list(bands[0].shape)
    shape[axis] = len(to)
    result = np.empty((len(stacks[0]), len(to), stacks[0].shape[2]), bands[0].dtype)
    # Of even and of odd results, for either band, for numbers of the bands in their order.
    pairs = np.ascontiguousarray(taps.reshape(2, -1, 2)[:, ::-1].transpose(2, 0, 1), result.dtype)

    def work(part: tuple[slice, slice]) -> None:
        some, place = part
        _merge([stack[some] for stack in stacks], pairs, places, first, to, place, result[some])

    in_threads(work, _parts(result, (len(to) + first + 1) // 2, workers), workers)
    return result.reshape(shape)


def _parts(stack: Reals, count: int, workers: int | None) -> list[tuple[slice, slice]]:
    """What threads share: parts of the first axis, or else of `count` results along the middle one."""
    whole = slice(0, len(stack)), slice(0, count)
    if n_threads(workers) < 2 or stack.size < _LEAST:
        return [whole]
    if len(stack) > 1 or stack.shape[2] == 1:
        return [(some, whole[1]) for some in shares(len(stack), workers)]
    return [(whole[0], place) for place in shares(count, workers)]


@lru_cache(256)
def beyond(mode: str, size: int, start: int, count: int) -> Lines:
    """`count` numbers of a signal of `size`, from place `start` on, which go on beyond both ends in some mode."""
    places = np.arange(start, start + count)
    outside = np.flatnonzero((places < 0) | (places >= size))
    border = np.array([_border(mode, size, int(q)) for q in places[outside]], float).reshape(-1, 4)
    places[outside] = size + np.arange(len(outside))
    return Lines(places, border)


def _border(mode: str, n: int, q: int) -> tuple[int, float, float, float]:
    """p, s, u and v of the number at q, see `Lines`."""
    if mode == "zero":
        return 0, 0.0, 0.0, 0.0
    if mode == "constant" or n == 1:
        sign = (-1.0) ** q if mode == "antisymmetric" else 1.0
        return min(max(q, 0), n - 1), sign, 0.0, 0.0
    if mode == "periodic":
        return q % n, 1.0, 0.0, 0.0
    if mode == "periodization":
        return min(q % (n + n % 2), n - 1), 1.0, 0.0, 0.0
    if mode == "reflect":
        r = q % (2 * n - 2)
        return min(r, 2 * n - 2 - r), 1.0, 0.0, 0.0
    if mode in ("symmetric", "antisymmetric"):
        r = q % (2 * n)
        return min(r, 2 * n - 1 - r), 1.0 if mode == "symmetric" or r < n else -1.0, 0.0, 0.0
    if mode == "smooth":
        return (1, float(q), 1.0 - q, 0.0) if q < 0 else (n - 2, n - 1.0 - q, 0.0, q + 2.0 - n)
    m = q // (n - 1)
    if m % 2 == 0:
        return q - m * (n - 1), 1.0, -float(m), float(m)
    return (m + 1) * (n - 1) - q, -1.0, 1.0 - m, m + 1.0


def _stack(array: Reals, axis: int) -> Reals:
    """Three axes: those before, this one, and those after."""
    axis %= array.ndim
    shape = (int(np.prod(array.shape[:axis])), array.shape[axis], int(np.prod(array.shape[axis + 1 :])))
    return np.ascontiguousarray(array).reshape(shape)


def _split(
    x: Reals, step: int, taps: Reals, lines: Lines, to: tuple[Places, Places], part: slice, out: Reals
) -> None:
    """Some results of `split`; `out` is (2, outer, count, inner)."""
    length = taps.shape[1]
    inside = [] if x.size < _LEAST else _segments(lines.places, x.shape[1])
    firsts = [(-(-start // step), (stop - length) // step + 1) for start, stop in inside]
    placed = [_segments(places) for places in to]
    # Few results go apart in one band and together in the other one.
    apart = [(i, i + 1) for i in np.flatnonzero(np.diff(to[0]) != np.diff(to[1])).tolist()]
    for start, stop in _cut(part, [bounds for bounds in firsts if bounds[0] < bounds[1]], *placed, apart):
        seen = lines.places[step * start : step * (stop - 1) + length]
        is_inside = any(first <= start and stop <= last for first, last in firsts)
        y, at = (x, seen) if is_inside else _gathered(x, seen, lines.border)
        windows = _windows(y, at, stop - start, step, length)
        low, high = (places[start:stop] for places in to)
        to_next, to_high = out.strides[2] * _stride(low), out.strides[0] + out.strides[2] * int(high[0] - low[0])
        shape, strides = (len(x), stop - start, x.shape[2], 2), (out.strides[1], to_next, out.strides[3], to_high)
        _filter(windows, taps, as_strided(out[0, :, low[0] :], shape, strides))


def _filter(windows: Reals, taps: Reals, out: Reals) -> None:
    """Both filters: the first two to eight taps, and eight more at a time."""
    length = taps.shape[1]
    head = length % 8 or 8
    for lines in _blocks(out, length > head):
        seen, results = windows[:, lines], out[:, lines]
        _SPLIT[head](seen[..., :head], taps[:, :head], out=results)
        for k in range(head, length, 8):
            filters.split_8_more(results, seen[..., k : k + 8], taps[:, k : k + 8], out=results)


def _merge(
    stacks: list[Reals], pairs: Reals, places: tuple[Places, Places], first: int, to: Places, part: slice, out: Reals
) -> None:
    """Some pairs of results of `merge`; `out` is (outer, results, inner)."""
    half, size = pairs.shape[2], stacks[0].shape[1]
    inside = [[] if out.size < _LEAST else _segments(at, size) for at in places]
    firsts = [[(start, stop - half + 1) for start, stop in segments if stop - start >= half] for segments in inside]
    # Both results of a pair are there, at places of one segment; others are put in their places one by one.
    whole = [(-(-(start + first) // 2), (stop + first) // 2) for start, stop in _segments(to)]
    for start, stop in _cut(part, *firsts, [bounds for bounds in whole if bounds[0] < bounds[1]]):
        windows = []
        for stack, at, bounds in zip(stacks, places, firsts, strict=True):
            seen = at[start : stop + half - 1]
            is_inside = any(one <= start and stop <= last for one, last in bounds)
            y, seen = (stack, seen) if is_inside else _gathered(stack, seen)
            windows.append(_windows(y, seen, stop - start, 1, half))
        shape = len(out), stop - start, out.shape[2], 2
        at_once = any(one <= start and stop <= last for one, last in whole)
        if at_once:
            begin = 2 * start - first
            stride = out.strides[1] * int(to[begin + 1] - to[begin])
            results = as_strided(out[:, to[begin] :], shape, (out.strides[0], 2 * stride, out.strides[2], stride))
        else:
            results = np.empty(shape, out.dtype)
        _join(windows, pairs, results)
        if not at_once:
            for pair in range(start, stop):
                for k, result in enumerate((2 * pair - first, 2 * pair + 1 - first)):
                    if 0 <= result < len(to):
                        out[:, to[result]] = results[:, pair - start, :, k]


def _join(windows: list[Reals], pairs: Reals, out: Reals) -> None:
    """As `_filter`, four numbers of each band at a time."""
    low, high = windows
    half = pairs.shape[2]
    head = half % 4 or 4
    for lines in _blocks(out, half > head):
        results = out[:, lines]
        _MERGE[head](low[:, lines, :, :head], high[:, lines, :, :head], pairs[..., :head], out=results)
        for k in range(head, half, 4):
            some = slice(k, k + 4)
            filters.merge_4_more(
                results, low[:, lines, :, some], high[:, lines, :, some], pairs[..., some], out=results
            )


def _blocks(out: Reals, is_repeated: bool) -> Iterator[slice]:
    """Lines of results that stay in a cache while more is added to them."""
    count = out.shape[1]
    size = max(_BLOCK * count // max(out.size, 1), 1) if is_repeated else count
    for start in range(0, count, size):
        yield slice(start, start + size)


def _windows(y: Reals, at: Places, count: int, step: int, length: int) -> Reals:
    """What `count` results see, (outer, count, inner, length), of lines at places with one stride."""
    stride = y.strides[1] * _stride(at)
    shape = len(y), count, y.shape[2], length
    return as_strided(y[:, at[0] :], shape, (y.strides[0], step * stride, y.strides[2], stride), writeable=False)


def _gathered(x: Reals, places: Places, border: NDArray[np.float64] | None = None) -> tuple[Reals, Places]:
    """The lines at some places, one after the other, and where they are now."""
    y = x.take(np.minimum(places, x.shape[1] - 1), 1)
    for k in np.flatnonzero(places >= x.shape[1]):
        p, s, u, v = border[places[k] - x.shape[1]]  # type: ignore[index]
        y[:, k] = s * x[:, int(p)] + u * x[:, 0] + v * x[:, -1]
    return y, np.arange(len(places))


def _stride(places: Places) -> int:
    return int(places[1] - places[0]) if len(places) > 1 else 1


def _segments(places: Places, size: int | None = None) -> list[tuple[int, int]]:
    """Parts of places that have one stride; of those from `size` on, none."""
    steps = np.diff(places)
    if size is not None:
        steps[(places[1:] >= size) | (places[:-1] >= size)] = np.iinfo(steps.dtype).min
    turns = (np.flatnonzero(np.diff(steps)) + 1).tolist()
    found, start, last = [], 0, len(places) - 1
    for turn in [*turns, last]:
        # A turn behind the last segment, where this one begins, is none of this one.
        if turn <= start and turn < last or start > last:
            continue
        if size is None or places[start] < size and places[turn] < size:
            found.append((start, turn + 1))
        start = turn + 1
    return found


def _cut(part: slice, *bounds: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """A part of results, cut at all bounds."""
    cuts = {each for pairs in bounds for pair in pairs for each in pair if part.start < each < part.stop}
    places = [part.start, *sorted(cuts), part.stop]
    return list(zip(places[:-1], places[1:], strict=True)) if part.start < part.stop else []


_SPLIT = {2: filters.split_2, 4: filters.split_4, 6: filters.split_6, 8: filters.split_8}
_MERGE = {1: filters.merge_1, 2: filters.merge_2, 3: filters.merge_3, 4: filters.merge_4}
