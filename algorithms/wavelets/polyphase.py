"""Pairs of filters along one axis, split into their even and odd taps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

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
"""Extensions of a signal beyond its ends, with the names of PyWavelets."""


_LEAST = 2**14
"""Number of elements from which threads share the work, and from which contiguous lines are used without a copy."""
_BLOCK = 2**15
"""Number of results that remain in a cache."""


@dataclass(frozen=True)
class Lines:
    """Sources of the inputs of filters, for a signal of n numbers x.

    Attributes
    ----------
    places : array of int
        The index for each input in order; n + k stands for the k-th border number.
    border : array, (borders, 4)
        p, s, u and v of each border number, which is ``s x[p] + u x[0] + v x[n - 1]``.
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
    """Apply two filters along an axis: ``sum_j taps[t, j] y[step i + j]``, where `lines` locates the numbers y.

    Parameters
    ----------
    array : array
    axis, step : int
        step must be 1 or 2.
    taps : array, (2, K)
        K must be even.
    lines : Lines
    to : (array of int, array of int)
        Positions at which the results i of either filter are stored.
    out : array, (2, ...), optional
        Dense array for the results.
    workers : int, optional
        Number of threads that share the results, see `n_threads`.

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
    """Upsample two signals by inserting zeros, filter each, and return the sum.

    Parameters
    ----------
    bands : (array, array)
        Two arrays of the same shape.
    axis : int
    taps : array, (2, K)
        K must be even.
    places : (array of int, array of int)
        Positions of the numbers of either band; ``places[K/2 - 1]`` is the last one that enters the first two results.
    first : int
        1 if the first of all results is omitted, otherwise 0.
    to : array of int
        Positions at which the other results are stored.
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
    # The taps for even and for odd results and for either band, ordered as the numbers of the bands.
    pairs = np.ascontiguousarray(taps.reshape(2, -1, 2)[:, ::-1].transpose(2, 0, 1), result.dtype)

    def work(part: tuple[slice, slice]) -> None:
        some, place = part
        _merge([stack[some] for stack in stacks], pairs, places, first, to, place, result[some])

    in_threads(work, _parts(result, (len(to) + first + 1) // 2, workers), workers)
    return result.reshape(shape)


def _parts(stack: Reals, count: int, workers: int | None) -> list[tuple[slice, slice]]:
    """Return the parts that threads share: of the first axis, or else of `count` results along the middle axis."""
    whole = slice(0, len(stack)), slice(0, count)
    if n_threads(workers) < 2 or stack.size < _LEAST:
        return [whole]
    if len(stack) > 1 or stack.shape[2] == 1:
        return [(some, whole[1]) for some in shares(len(stack), workers)]
    return [(whole[0], place) for place in shares(count, workers)]


@lru_cache(256)
def beyond(mode: str, size: int, start: int, count: int) -> Lines:
    """Return the sources of `count` numbers from position `start` of a signal of `size`, extended beyond both ends."""
    places = np.arange(start, start + count)
    outside = np.flatnonzero((places < 0) | (places >= size))
    border = np.array([_border(mode, size, int(q)) for q in places[outside]], float).reshape(-1, 4)
    places[outside] = size + np.arange(len(outside))
    return Lines(places, border)


def _border(mode: str, n: int, q: int) -> tuple[int, float, float, float]:
    """Return p, s, u and v of the number at q, see `Lines`."""
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
    """Return the array with three axes: the preceding axes merged, this axis, and the following axes merged."""
    axis %= array.ndim
    shape = (int(np.prod(array.shape[:axis])), array.shape[axis], int(np.prod(array.shape[axis + 1 :])))
    return np.ascontiguousarray(array).reshape(shape)


def _split(x: Reals, step: int, taps: Reals, lines: Lines, to: tuple[Places, Places], part: slice, out: Reals) -> None:
    """Compute some results of `split`; `out` is (2, outer, count, inner)."""
    length, small = taps.shape[1], x.size < _LEAST
    low_to, high_to = to
    keys = lines.places.tobytes(), low_to.tobytes(), high_to.tobytes()
    for start, stop, is_inside, at, to_next, low_first, apart in _split_runs(
        *keys, step, length, x.shape[1], small, part.start, part.stop
    ):
        y, first, stride = x, *at
        if not is_inside:
            seen = lines.places[step * start : step * (stop - 1) + length]
            y, first, stride = _gathered(x, seen, lines.border), 0, 1
        windows = _windows(y, first, stride, stop - start, step, length)
        shape = len(x), stop - start, x.shape[2], 2
        along = out.strides[2]
        strides = out.strides[1], along * to_next, out.strides[3], out.strides[0] + along * apart
        _filter(windows, taps, as_strided(out[0, :, low_first:], shape, strides))


@lru_cache(512)
def _split_runs(
    places: bytes, low: bytes, high: bytes, step: int, length: int, size: int, small: bool, first: int, last: int
) -> list[tuple[int, int, bool, tuple[int, int], int, int, int]]:
    """Return runs of results, from `start` to `stop`, that need one view of the signal or a copy, and one of the bands.

    For each run, also return whether the view is of the signal, its first line and its stride, the stride of the
    results, the first low result and the offset of the high results from it.
    """
    at, low_to, high_to = (np.frombuffer(each, np.intp) for each in (places, low, high))
    segments = [] if small else _segments(at, size)
    firsts = [(-(-start // step), (stop - length) // step + 1) for start, stop in segments]
    # Results that are separate in one band and adjacent in the other one are rare.
    apart = [(i, i + 1) for i in np.flatnonzero(np.diff(low_to) != np.diff(high_to)).tolist()]
    bounds = [pair for pair in firsts if pair[0] < pair[1]], _segments(low_to), _segments(high_to), apart
    found = []
    for start, stop in _cut(slice(first, last), *bounds):
        is_inside = any(one <= start and stop <= other for one, other in firsts)
        k = step * start
        line = int(at[k]), int(at[k + 1] - at[k]) if k + 1 < len(at) else 1
        to_next = int(low_to[start + 1] - low_to[start]) if stop - start > 1 else 1
        found.append((start, stop, is_inside, line, to_next, int(low_to[start]), int(high_to[start] - low_to[start])))
    return found


def _filter(windows: Reals, taps: Reals, out: Reals) -> None:
    """Apply both filters: first two to eight taps, then eight more at a time."""
    length = taps.shape[1]
    head = length % 8 or 8
    for lines in _blocks(out, length > head):
        seen, results = windows[lines], out[lines]
        _SPLIT[head](seen[..., :head], taps[:, :head], out=results)
        for k in range(head, length, 8):
            filters.split_8_more(results, seen[..., k : k + 8], taps[:, k : k + 8], out=results)


def _merge(
    stacks: list[Reals], pairs: Reals, places: tuple[Places, Places], first: int, to: Places, part: slice, out: Reals
) -> None:
    """Compute some pairs of results of `merge`; `out` is (outer, results, inner)."""
    half, small = pairs.shape[2], out.size < _LEAST
    keys = (*(at.tobytes() for at in places), to.tobytes())
    for start, stop, seen, begin, stride in _merge_runs(
        *keys, half, stacks[0].shape[1], first, small, part.start, part.stop
    ):
        windows = []
        for stack, at, line in zip(stacks, places, seen, strict=True):
            y = stack.take(at[start : stop + half - 1], 1) if line is None else stack
            windows.append(_windows(y, *(line or (0, 1)), stop - start, 1, half))
        shape = len(out), stop - start, out.shape[2], 2
        if stride:
            step = out.strides[1] * stride
            results = as_strided(out[:, begin:], shape, (out.strides[0], 2 * step, out.strides[2], step))
            _join(windows, pairs, results)
            continue
        results = np.empty(shape, out.dtype)
        _join(windows, pairs, results)
        for pair in range(start, stop):
            for k, result in enumerate((2 * pair - first, 2 * pair + 1 - first)):
                if 0 <= result < len(to):
                    out[:, to[result]] = results[:, pair - start, :, k]


@lru_cache(512)
def _merge_runs(
    low: bytes, high: bytes, places: bytes, half: int, size: int, first: int, small: bool, begin: int, end: int
) -> list[tuple[int, int, list[tuple[int, int] | None], int, int]]:
    """Return runs of pairs of results, from `start` to `stop`, that need one view of each band or a copy.

    For each run, also return the first line of either band and its stride (None for a copy), and the first result and
    the stride of the results, which is 0 if they are stored one by one.
    """
    ats, to = [np.frombuffer(each, np.intp) for each in (low, high)], np.frombuffer(places, np.intp)
    inside = [[] if small else _segments(at, size) for at in ats]
    firsts = [[(start, stop - half + 1) for start, stop in segments if stop - start >= half] for segments in inside]
    whole = [(-(-(start + first) // 2), (stop + first) // 2) for start, stop in _segments(to)]
    found = []
    for start, stop in _cut(slice(begin, end), *firsts, [pair for pair in whole if pair[0] < pair[1]]):
        seen = []
        for at, bounds in zip(ats, firsts, strict=True):
            is_inside = any(one <= start and stop <= last for one, last in bounds)
            stride = int(at[start + 1] - at[start]) if start + 1 < len(at) else 1
            seen.append((int(at[start]), stride) if is_inside else None)
        k = 2 * start - first
        at_once = any(one <= start and stop <= last for one, last in whole)
        found.append((start, stop, seen, int(to[k]), int(to[k + 1] - to[k])) if at_once else (start, stop, seen, 0, 0))
    return found


def _join(windows: list[Reals], pairs: Reals, out: Reals) -> None:
    """Apply the filters as `_filter` does, with four numbers of each band at a time."""
    low, high = windows
    half = pairs.shape[2]
    head = half % 4 or 4
    for lines in _blocks(out, half > head):
        results, a, b = out[lines], low[lines], high[lines]
        _MERGE[head](a[..., :head], b[..., :head], pairs[..., :head], out=results)
        for k in range(head, half, 4):
            some = slice(k, k + 4)
            filters.merge_4_more(results, a[..., some], b[..., some], pairs[..., some], out=results)


def _blocks(out: Reals, is_repeated: bool) -> Iterator[tuple[slice, slice]]:
    """Return blocks of results that remain in a cache while terms are added to them."""
    everything = slice(None)
    axis = 0 if out.shape[2] == 1 else 1
    count = out.shape[axis]
    size = max(_BLOCK * count // max(out.size, 1), 1) if is_repeated else max(count, 1)
    for start in range(0, count, size):
        some = slice(start, start + size)
        yield (some, everything) if axis == 0 else (everything, some)


def _windows(y: Reals, first: int, stride: int, count: int, step: int, length: int) -> Reals:
    """Return the inputs of `count` results, (outer, count, inner, length), for lines from `first` with this stride."""
    along = y.strides[1] * stride
    shape = len(y), count, y.shape[2], length
    return as_strided(y[:, first:], shape, (y.strides[0], step * along, y.strides[2], along), writeable=False)


def _gathered(x: Reals, places: Places, border: NDArray[np.float64]) -> Reals:
    """Return the lines at these places, see `Lines`, as a copy."""
    y: Reals = x.take(np.minimum(places, x.shape[1] - 1), 1)
    outside = np.flatnonzero(places >= x.shape[1])
    if len(outside):
        p, s, u, v = border[places[outside] - x.shape[1]].astype(x.dtype).T[:, :, None]
        numbers = s * x[:, p[:, 0].astype(np.intp)]
        if u.any() or v.any():
            numbers += u * x[:, :1] + v * x[:, -1:]
        y[:, outside] = numbers
    return y


def _segments(places: Places, size: int | None = None) -> list[tuple[int, int]]:
    """Return the ranges of places that have a constant stride; places from `size` on are in no range."""
    steps = np.diff(places)
    if size is not None:
        steps[(places[1:] >= size) | (places[:-1] >= size)] = np.iinfo(steps.dtype).min
    changes = (np.flatnonzero(np.diff(steps)) + 1).tolist()
    found, start, last = [], 0, len(places) - 1
    for change in [*changes, last]:
        # A change of stride directly behind the previous segment, where this one begins, does not end this one.
        if (change <= start and change < last) or start > last:
            continue
        if size is None or (places[start] < size and places[change] < size):
            found.append((start, change + 1))
        start = change + 1
    return found


def _cut(part: slice, *bounds: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Split a range of results at all bounds."""
    cuts = {each for pairs in bounds for pair in pairs for each in pair if part.start < each < part.stop}
    places = [part.start, *sorted(cuts), part.stop]
    return list(pairwise(places)) if part.start < part.stop else []


_SPLIT = {2: filters.split_2, 4: filters.split_4, 6: filters.split_6, 8: filters.split_8}
_MERGE = {1: filters.merge_1, 2: filters.merge_2, 3: filters.merge_3, 4: filters.merge_4}
