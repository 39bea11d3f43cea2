"""Filters of images along one axis, several at once, and medians, in loops that numba compiles."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ..arguments import Reals

_BLOCK = 64
"""Pixels whose medians are computed side by side."""


def filter_bank(image: Reals, taps: NDArray[np.float64], axis: int) -> Reals:
    """Convolutions of an image, mirrored at its edges, with filters of one odd length.

    Parameters
    ----------
    image : array, (M, N)
    taps : array, (T, K)
    axis : int
        0 or 1.

    Returns
    -------
    array, (T, M, N)
    """
    result = np.empty((len(taps), *image.shape), image.dtype)
    # Zeros make the number of taps a multiple of four.
    weights = np.zeros((len(taps), -(-taps.shape[1] // 4) * 4), image.dtype)
    weights[:, : taps.shape[1]] = taps[:, ::-1]
    places = _mirrored(image.shape[axis], taps.shape[1] // 2, weights.shape[1])
    (_along_columns if axis == 0 else _along_rows)(np.ascontiguousarray(image), weights, places, result)
    return result


def median_5(image: Reals) -> Reals:
    """Medians of 5 x 5 pixels; beyond the edges, the nearest pixel is repeated."""
    result = np.empty(image.shape, image.dtype)
    padded = np.pad(image, [(2, 2), (2, 2 + _BLOCK)], "edge")
    _medians(padded, _network(25), result)
    return result


def sampled(spline: Reals, uv: Reals) -> Reals:
    """An image at (x + u, y + v) for every pixel; outside, the nearest pixel is repeated.

    Parameters
    ----------
    spline : array, (M, N)
        Its coefficients, of ``scipy.ndimage.spline_filter(image, 3)``.
    uv : array, (2, M, N)

    Returns
    -------
    array, (M, N)
    """
    result = np.empty_like(spline)
    _sampled(spline, uv, result)
    return result


@lru_cache
def _mirrored(size: int, reach: int, taps: int) -> NDArray[np.intp]:
    """The places that filters see, from `reach` before the first one on."""
    r = np.arange(-reach, size - reach + taps - 1) % (2 * size)
    return np.minimum(r, 2 * size - 1 - r)


@lru_cache
def _network(size: int) -> NDArray[np.intp]:
    """Pairs to compare and exchange so that the middle one of an odd number of places has the median.

    Batcher's merge exchange (Knuth, *The Art of Computer Programming* 3, 5.2.2 M), less what the middle does not see.
    """
    pairs = []
    top = 1 << (size - 1).bit_length() - 1
    p = top
    while p > 0:
        q, r, d = top, 0, p
        while True:
            pairs += [(i, i + d) for i in range(size - d) if i & p == r]
            if q == p:
                break
            d, q, r = q - p, q >> 1, p
        p >>= 1
    seen, kept = {size // 2}, []
    for pair in pairs[::-1]:
        if not seen.isdisjoint(pair):
            seen.update(pair)
            kept.append(pair)
    return np.array(kept[::-1])


@njit(nogil=True, fastmath={"contract"})
def _four(out: Any, a: Any, b: Any, c: Any, d: Any, w: Any, fresh: Any) -> None:
    """Four terms at once, as what is added to goes through memory."""
    p, q, r, s = w[0], w[1], w[2], w[3]
    if fresh:
        for x in range(out.size):
            out[x] = p * a[x] + q * b[x] + r * c[x] + s * d[x]
    else:
        for x in range(out.size):
            out[x] += p * a[x] + q * b[x] + r * c[x] + s * d[x]


@njit(nogil=True, fastmath={"contract"})
def _four_twice(out: Any, other: Any, a: Any, b: Any, c: Any, d: Any, w: Any, v: Any, fresh: Any) -> None:
    """As `_four`, for two filters."""
    p, q, r, s = w[0], w[1], w[2], w[3]
    e, f, g, h = v[0], v[1], v[2], v[3]
    if fresh:
        for x in range(out.size):
            out[x] = p * a[x] + q * b[x] + r * c[x] + s * d[x]
            other[x] = e * a[x] + f * b[x] + g * c[x] + h * d[x]
    else:
        for x in range(out.size):
            out[x] += p * a[x] + q * b[x] + r * c[x] + s * d[x]
            other[x] += e * a[x] + f * b[x] + g * c[x] + h * d[x]


@njit(nogil=True)
def _filters(result: Any, row: Any, a: Any, b: Any, c: Any, d: Any, weights: Any, k: Any) -> None:
    """What four lines add to a row of all results."""
    t = 0
    while t < weights.shape[0]:
        w, v = weights[t, k : k + 4], weights[min(t + 1, weights.shape[0] - 1), k : k + 4]
        if t + 1 < weights.shape[0]:
            _four_twice(result[t, row], result[t + 1, row], a, b, c, d, w, v, k == 0)
        else:
            _four(result[t, row], a, b, c, d, w, k == 0)
        t += 2


@njit(nogil=True)
def _along_columns(image: Any, weights: Any, places: Any, result: Any) -> None:
    for row in range(image.shape[0]):
        for k in range(0, weights.shape[1], 4):
            at = places[row + k : row + k + 4]
            _filters(result, row, image[at[0]], image[at[1]], image[at[2]], image[at[3]], weights, k)


@njit(nogil=True)
def _along_rows(image: Any, weights: Any, places: Any, result: Any) -> None:
    size = image.shape[1]
    line = np.empty(places.size, image.dtype)
    for row in range(image.shape[0]):
        for n in range(places.size):
            line[n] = image[row, places[n]]
        for k in range(0, weights.shape[1], 4):
            _filters(result, row, line[k : k + size], line[k + 1 :], line[k + 2 :], line[k + 3 :], weights, k)


@njit(nogil=True)
def _medians(padded: Any, pairs: Any, result: Any) -> None:
    rows, columns = result.shape
    block = np.empty((25, _BLOCK), padded.dtype)
    for row in range(rows):
        for start in range(0, columns, _BLOCK):
            for k in range(25):
                first = start + k % 5
                block[k] = padded[row + k // 5, first : first + _BLOCK]
            for n in range(len(pairs)):
                low, high = block[pairs[n, 0]], block[pairs[n, 1]]
                for x in range(_BLOCK):
                    a, b = low[x], high[x]
                    low[x] = a if a < b else b
                    high[x] = b if a < b else a
            end = min(columns, start + _BLOCK)
            result[row, start:end] = block[12, : end - start]


@njit(inline="always")
def _inside(place: int, size: int) -> int:
    """The place mirrored about the first and the last one, as splines go on."""
    place = abs(place)
    place = size - 1 - abs(size - 1 - place)
    return min(max(place, 0), size - 1)


@njit(inline="always")
def _weights(t: Any) -> Any:
    """The cubic B-spline at t + 1, t, t - 1 and t - 2, for t from 0 to 1."""
    s = 1 - t
    return s * s * s / 6, (4 - 3 * t * t * (2 - t)) / 6, (4 - 3 * s * s * (2 - s)) / 6, t * t * t / 6


@njit(nogil=True)
def _sampled(spline: Any, uv: Any, result: Any) -> None:
    rows, columns = result.shape
    for row in range(rows):
        for column in range(columns):
            y = min(max(row + uv[1, row, column], 0.0), rows - 1.0)
            x = min(max(column + uv[0, row, column], 0.0), columns - 1.0)
            top, left = int(np.floor(y)), int(np.floor(x))
            down, across = _weights(y - top), _weights(x - left)
            total = 0.0
            for k in range(4):
                i = _inside(top - 1 + k, rows)
                part = 0.0
                for n in range(4):
                    part += across[n] * spline[i, _inside(left - 1 + n, columns)]
                total += down[k] * part
            result[row, column] = total
