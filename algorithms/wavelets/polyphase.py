"""Pairs of filters along one axis, split into their even and odd taps, in loops that numba compiles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

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
"""Numbers from which on threads share the work."""


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
    out: tuple[Reals, Reals] | None = None,
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
    out : (array, array), optional
        Dense arrays for the results.
    workers : int, optional
        How many threads share the results, see `n_threads`.

    Returns
    -------
    (array, array)
    """
    stack = _stack(array, axis)
    shape = list(array.shape)
    shape[axis] = len(to[0])
    low, high = (np.empty(shape, array.dtype) for _ in range(2)) if out is None else out
    stacks = [band.reshape(len(stack), len(to[0]), stack.shape[2], copy=False) for band in (low, high)]
    border = lines.border.astype(array.dtype)
    weights, more = np.ascontiguousarray(taps, array.dtype), taps.shape[1] - step

    def work(part: tuple[slice, slice]) -> None:
        some, place = part
        seen = lines.places[step * place.start : step * place.stop + more]
        results = (band[some] for band in stacks)
        _split(stack[some], step, weights, seen, border, to[0][place], to[1][place], *results)

    in_threads(work, _parts(stack, len(to[0]), workers), workers)
    return low, high


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
    pairs = np.ascontiguousarray(taps.reshape(2, -1, 2).transpose(2, 1, 0).reshape(2, -1), result.dtype)
    half = taps.shape[1] // 2

    def work(part: tuple[slice, slice]) -> None:
        some, place = part
        # Two results to each number; the first of all may be left out.
        begin, end = max(2 * place.start - first, 0), 2 * place.stop - first
        seen = (at[place.start : place.stop + half - 1] for at in places)
        low, high = (stack[some] for stack in stacks)
        _merge(low, high, pairs, *seen, 0 if place.start else first, to[begin:end], result[some])

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


@njit(nogil=True, error_model="numpy", fastmath={"contract"})
def _begin(one: Any, other: Any, a: Any, b: Any, w: Any, j: Any) -> None:
    p, q, r, s = w[0, j], w[0, j + 1], w[1, j], w[1, j + 1]
    for n in range(one.size):
        one[n] = p * a[n] + q * b[n]
        other[n] = r * a[n] + s * b[n]


@njit(nogil=True, error_model="numpy", fastmath={"contract"})
def _add(one: Any, other: Any, a: Any, b: Any, w: Any, j: Any) -> None:
    p, q, r, s = w[0, j], w[0, j + 1], w[1, j], w[1, j + 1]
    for n in range(one.size):
        one[n] += p * a[n] + q * b[n]
        other[n] += r * a[n] + s * b[n]


@njit(nogil=True, error_model="numpy", fastmath={"contract"})
def _add_four(one: Any, other: Any, a: Any, b: Any, c: Any, d: Any, w: Any, j: Any) -> None:
    """Four terms at once, as what is added to goes through memory."""
    p, q, r, s = w[0, j], w[0, j + 1], w[0, j + 2], w[0, j + 3]
    t, u, v, x = w[1, j], w[1, j + 1], w[1, j + 2], w[1, j + 3]
    for n in range(one.size):
        one[n] += p * a[n] + q * b[n] + r * c[n] + s * d[n]
        other[n] += t * a[n] + u * b[n] + v * c[n] + x * d[n]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _split(
    x: Any, step: Any, taps: Any, places: Any, border: Any, low_to: Any, high_to: Any, low: Any, high: Any
) -> None:
    size, inner, count, half = x.shape[1], x.shape[2], low_to.size, taps.shape[1] // 2
    # The numbers that a line of results sees: along the axis, or whole lines of numbers after it.
    lines = np.empty((step if inner == 1 else 0, count + 2 * half), x.dtype)
    pads = np.empty((border.shape[0], inner), x.dtype)
    one, other = np.empty(count, x.dtype), np.empty(count, x.dtype)
    for o in range(x.shape[0]):
        for k in range(border.shape[0]):
            p, s, u, v = int(border[k, 0]), border[k, 1], border[k, 2], border[k, 3]
            for n in range(inner):
                pads[k, n] = s * x[o, p, n] + u * x[o, 0, n] + v * x[o, size - 1, n]
        if inner == 1:
            for r in range(step):
                for n in range((places.size - r + step - 1) // step):
                    p = places[step * n + r]
                    lines[r, n] = x[o, p, 0] if p < size else pads[p - size, 0]
            even, odd = lines[0], lines[step - 1, 2 - step :]
            each = 3 - step
            _begin(one, other, even[:count], odd[:count], taps, 0)
            j = 1
            while j < half:
                k = each * j
                a, b = even[k : k + count], odd[k : k + count]
                if j + 1 < half:
                    k += each
                    _add_four(one, other, a, b, even[k : k + count], odd[k : k + count], taps, 2 * j)
                else:
                    _add(one, other, a, b, taps, 2 * j)
                j += 2
            for n in range(count):
                low[o, low_to[n], 0] = one[n]
                high[o, high_to[n], 0] = other[n]
            continue
        for i in range(count):
            left, right, at = low[o, low_to[i]], high[o, high_to[i]], places[step * i : step * i + 2 * half]
            _begin(left, right, _line(x[o], pads, at[0]), _line(x[o], pads, at[1]), taps, 0)
            j = 1
            while j < half:
                a, b = _line(x[o], pads, at[2 * j]), _line(x[o], pads, at[2 * j + 1])
                if j + 1 < half:
                    c, d = _line(x[o], pads, at[2 * j + 2]), _line(x[o], pads, at[2 * j + 3])
                    _add_four(left, right, a, b, c, d, taps, 2 * j)
                else:
                    _add(left, right, a, b, taps, 2 * j)
                j += 2


@njit(nogil=True)
def _line(x: Any, pads: Any, place: Any) -> Any:
    return x[place] if place < len(x) else pads[place - len(x)]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _merge(low: Any, high: Any, taps: Any, low_at: Any, high_at: Any, first: Any, to: Any, result: Any) -> None:
    """`taps` has pairs, of the low and of the high filter, for even results and for odd ones."""
    inner, half = low.shape[2], taps.shape[1] // 2
    count = (to.size + first + 1) // 2
    a_line, b_line = np.empty(count + half - 1, low.dtype), np.empty(count + half - 1, low.dtype)
    wide = max(count, inner)
    one, other = np.empty(wide, low.dtype), np.empty(wide, low.dtype)
    for o in range(low.shape[0]):
        if inner == 1:
            for n in range(len(a_line)):
                a_line[n], b_line[n] = low[o, low_at[n], 0], high[o, high_at[n], 0]
            even, odd = one[:count], other[:count]
            k = half - 1
            _begin(even, odd, a_line[k : k + count], b_line[k : k + count], taps, 0)
            j = 1
            while j < half:
                k = half - 1 - j
                a, b = a_line[k : k + count], b_line[k : k + count]
                if j + 1 < half:
                    c, d = a_line[k - 1 : k - 1 + count], b_line[k - 1 : k - 1 + count]
                    _add_four(even, odd, a, b, c, d, taps, 2 * j)
                else:
                    _add(even, odd, a, b, taps, 2 * j)
                j += 2
            for n in range(to.size):
                place = n + first
                result[o, to[n], 0] = odd[place // 2] if place % 2 else even[place // 2]
            continue
        for i in range(count):
            before, after = 2 * i - first, 2 * i + 1 - first
            even = result[o, to[before]] if before >= 0 else one[:inner]
            odd = result[o, to[after]] if after < to.size else other[:inner]
            k = i + half - 1
            _begin(even, odd, low[o, low_at[k]], high[o, high_at[k]], taps, 0)
            j = 1
            while j < half:
                k = i + half - 1 - j
                a, b = low[o, low_at[k]], high[o, high_at[k]]
                if j + 1 < half:
                    _add_four(even, odd, a, b, low[o, low_at[k - 1]], high[o, high_at[k - 1]], taps, 2 * j)
                else:
                    _add(even, odd, a, b, taps, 2 * j)
                j += 2
