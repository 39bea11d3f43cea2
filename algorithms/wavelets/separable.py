"""Filters of images along one axis, several at once, and medians, in loops that numba compiles."""

from __future__ import annotations

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
    reach = taps.shape[1] // 2
    weights = np.ascontiguousarray(taps[:, ::-1], image.dtype)
    if axis == 0:
        places = np.pad(np.arange(len(image)), reach, "symmetric")
        _along_columns(np.ascontiguousarray(image), weights, places, result)
    else:
        _along_rows(np.pad(image, [(0, 0), (reach, reach)], "symmetric"), weights, result)
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


def _network(size: int) -> NDArray[np.intp]:
    """Pairs to compare and exchange: Batcher's merge exchange (Knuth, *The Art of Computer Programming* 3, 5.2.2 M)."""
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
    return np.array(pairs)


@njit
def _along_columns(image: Any, weights: Any, places: Any, result: Any) -> None:
    for row in range(image.shape[0]):
        for t in range(weights.shape[0]):
            out = result[t, row]
            out[:] = 0
            for k in range(weights.shape[1]):
                line, weight = image[places[row + k]], weights[t, k]
                for x in range(out.size):
                    out[x] += weight * line[x]


@njit
def _along_rows(padded: Any, weights: Any, result: Any) -> None:
    for row in range(padded.shape[0]):
        for t in range(weights.shape[0]):
            out = result[t, row]
            out[:] = 0
            for k in range(weights.shape[1]):
                line, weight = padded[row, k : k + out.size], weights[t, k]
                for x in range(out.size):
                    out[x] += weight * line[x]


@njit
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


@njit
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
