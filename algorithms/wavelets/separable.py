"""Filters of images along rows and columns, several at once, and medians, in loops that numba compiles.

All work on some rows of the result, so that what lies between stays in a cache and threads can share the rows.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from generated import images

from ..arguments import Reals

_GROUP = 5
"""Pairs of numbers, as far from the middle on either side, that three filters take at once: as many as registers hold
the weights of."""
_REACH = 2 * _GROUP
"""Of all filters."""
_WIDE = 160
_TILE = _WIDE - 2 * _REACH
"""Columns that are filtered together, and results that they give."""


def half_taps(taps: NDArray[np.float64], dtype: Any) -> Reals:
    """The middle and the later half of symmetric or antisymmetric taps, at most 21 of them, with zeros behind.

    Parameters
    ----------
    taps : array, (..., K)
        K is odd.

    Returns
    -------
    array, (..., 11)
    """
    middle = taps.shape[-1] // 2
    if middle > _REACH:
        raise ValueError(f"taps: {taps.shape[-1]} of them; expected at most {2 * _REACH + 1}")
    result = np.zeros((*taps.shape[:-1], _REACH + 1), dtype)
    result[..., : middle + 1] = taps[..., middle:]
    return result


def gabor_rows(image: Reals, taps: Reals, border: int, place: slice, out: Reals) -> None:
    """Some rows of an image, mirrored at its edges, filtered by quaternionic Gabor filters and along one axis.

    Parameters
    ----------
    image : array, (M, N)
        Dense.
    taps : array, (F, 3, 11)
        `half_taps` for each of F frequencies: of the Gaussian, of the even and of the odd part.
    border : int
        How far the result goes beyond the image.
    place : slice
        Rows of the result, of M + 2 border.
    out : array, (F, 8, rows, N + 2 border)
        Filled with quaternions w, x, y, z, and real and imaginary parts of waves along columns, and along rows.
    """
    _gabor(image, taps, *_around(image, border, place), out)


def smooth_rows(images: Reals, taps: Reals, place: slice, out: Reals) -> None:
    """Some rows of images, mirrored at their edges, filtered along both axes.

    Parameters
    ----------
    images : array, (K, M, N)
        Dense.
    taps : array, (11,)
        `half_taps` of a symmetric filter.
    place : slice
    out : array, (K, rows, N)
    """
    _smooth(images, taps, *_around(images, 0, place), out)


def median_rows(padded: Reals, place: slice, out: Reals) -> None:
    """Some rows of the medians of 5 x 5 pixels.

    Parameters
    ----------
    padded : array, (M + 4, N + 4)
        Dense, with two pixels more on all sides.
    place : slice
    out : array, (rows, N)
    """
    wide, size = padded.shape[1], padded.itemsize
    # As one line of numbers, where neighbours are so many places apart; those at the right are cut off.
    medians = np.empty((place.stop - place.start, wide), padded.dtype)
    line, inside = padded.ravel()[place.start * wide :], medians.ravel()[:-4]
    pixels = np.lib.stride_tricks.as_strided(line, (inside.size, 5, 5), (size, wide * size, size), writeable=False)
    images.median_of_25(pixels, out=inside)
    out[...] = medians[:, :-4]


def sampled_rows(spline: Reals, uv: Reals, place: slice, out: Reals) -> None:
    """Some rows of an image at (x + u, y + v) for every pixel; outside, the nearest pixel is repeated.

    Parameters
    ----------
    spline : array, (M, N)
        Its coefficients, of ``scipy.ndimage.spline_filter(image, 3)``.
    uv : array, (2, M, N)
    place : slice
    out : array, (rows, N)
    """
    _sampled(spline, uv, place.start, out)


def _around(images: Reals, border: int, place: slice) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The rows and the columns that filters see for these rows of the result."""
    rows, columns = (_mirrored(size, border + _REACH) for size in images.shape[-2:])
    return rows[place.start : place.stop + 2 * _REACH], columns


@lru_cache
def _mirrored(size: int, reach: int) -> NDArray[np.intp]:
    """Places, from `reach` before the first one to as many after the last."""
    r = np.arange(-reach, size + reach) % (2 * size)
    return np.minimum(r, 2 * size - 1 - r)


def _filters(step: int) -> tuple[Any, Any]:
    """Three filters, and one, of numbers so many places apart: at places that the compiler knows, so that it uses wide
    vectors.

    They take the numbers from the first on that the first result sees, `half_taps`, and the results, one after the
    other.
    """
    m = _REACH * step
    a, b, c, d, e = (m - k * step for k in range(1, _GROUP + 1))
    f, g, h, i, j = (m + k * step for k in range(1, _GROUP + 1))
    n = _GROUP * step

    @njit(nogil=True, fastmath={"contract"})
    def three(s: Any, w: Any, out: Any) -> None:
        u0, u1, u2, u3, u4, u5 = w[0, 0], w[0, 1], w[0, 2], w[0, 3], w[0, 4], w[0, 5]
        v0, v1, v2, v3, v4, v5 = w[1, 0], w[1, 1], w[1, 2], w[1, 3], w[1, 4], w[1, 5]
        z1, z2, z3, z4, z5 = w[2, 1], w[2, 2], w[2, 3], w[2, 4], w[2, 5]
        for x in range(_WIDE):
            p, q, r = s[x + a] + s[x + f], s[x + b] + s[x + g], s[x + c] + s[x + h]
            t, y = s[x + d] + s[x + i], s[x + e] + s[x + j]
            out[x] = u0 * s[x + m] + u1 * p + u2 * q + u3 * r + u4 * t + u5 * y
            out[x + _WIDE] = v0 * s[x + m] + v1 * p + v2 * q + v3 * r + v4 * t + v5 * y
            p, q, r = s[x + a] - s[x + f], s[x + b] - s[x + g], s[x + c] - s[x + h]
            t, y = s[x + d] - s[x + i], s[x + e] - s[x + j]
            out[x + 2 * _WIDE] = z1 * p + z2 * q + z3 * r + z4 * t + z5 * y
        u1, u2, u3, u4, u5 = w[0, 6], w[0, 7], w[0, 8], w[0, 9], w[0, 10]
        v1, v2, v3, v4, v5 = w[1, 6], w[1, 7], w[1, 8], w[1, 9], w[1, 10]
        z1, z2, z3, z4, z5 = w[2, 6], w[2, 7], w[2, 8], w[2, 9], w[2, 10]
        for x in range(_WIDE):
            p, q, r = s[x + a - n] + s[x + f + n], s[x + b - n] + s[x + g + n], s[x + c - n] + s[x + h + n]
            t, y = s[x + d - n] + s[x + i + n], s[x + e - n] + s[x + j + n]
            out[x] += u1 * p + u2 * q + u3 * r + u4 * t + u5 * y
            out[x + _WIDE] += v1 * p + v2 * q + v3 * r + v4 * t + v5 * y
            p, q, r = s[x + a - n] - s[x + f + n], s[x + b - n] - s[x + g + n], s[x + c - n] - s[x + h + n]
            t, y = s[x + d - n] - s[x + i + n], s[x + e - n] - s[x + j + n]
            out[x + 2 * _WIDE] += z1 * p + z2 * q + z3 * r + z4 * t + z5 * y

    @njit(nogil=True, fastmath={"contract"})
    def one(s: Any, w: Any, out: Any) -> None:
        w0, w1, w2, w3, w4, w5 = w[0], w[1], w[2], w[3], w[4], w[5]
        w6, w7, w8, w9, w10 = w[6], w[7], w[8], w[9], w[10]
        for x in range(_WIDE):
            near = w0 * s[x + m] + w1 * (s[x + a] + s[x + f]) + w2 * (s[x + b] + s[x + g]) + w3 * (s[x + c] + s[x + h])
            near += w4 * (s[x + d] + s[x + i]) + w5 * (s[x + e] + s[x + j])
            far = w6 * (s[x + a - n] + s[x + f + n]) + w7 * (s[x + b - n] + s[x + g + n])
            far += w8 * (s[x + c - n] + s[x + h + n]) + w9 * (s[x + d - n] + s[x + i + n])
            out[x] = near + far + w10 * (s[x + e - n] + s[x + j + n])

    return three, one


_three_rows, _one_row = _filters(_WIDE)
_three_columns, _one_column = _filters(1)


@njit(nogil=True)
def _copy(numbers: Any, count: Any, out: Any) -> None:
    for x in range(count):
        out[x] = numbers[x]


@njit(nogil=True)
def _seen(image: Any, rows: Any, columns: Any, start: Any, seen: Any) -> None:
    """What the filters of one tile see, in lines of `_WIDE` numbers."""
    count = min(_WIDE, columns.size - start)
    first = columns[start]
    # Away from the edges, or else about them.
    plain = first > 0 and columns[start + count - 1] - first == count - 1
    for m in range(rows.size):
        line, to = image[rows[m]], seen[m * _WIDE :]
        if plain:
            _copy(line[first:], count, to)
        else:
            for x in range(count):
                to[x] = line[columns[start + x]]


@njit(cache=True, nogil=True)
def _gabor(image: Any, taps: Any, rows: Any, columns: Any, out: Any) -> None:
    wide = out.shape[3]
    seen = np.zeros(rows.size * _WIDE, image.dtype)
    # Along columns: the Gaussian, and the even and the odd part, for each frequency, with room behind.
    lines = np.zeros((3 * len(taps) + 1) * _WIDE, image.dtype)
    found = np.zeros(3 * _WIDE, image.dtype)
    for start in range(0, wide, _TILE):
        size = min(_TILE, wide - start)
        _seen(image, rows, columns, start, seen)
        for n in range(rows.size - 2 * _REACH):
            for f in range(len(taps)):
                _three_rows(seen[n * _WIDE :], taps[f], lines[3 * f * _WIDE :])
            for f in range(len(taps)):
                for k in range(3):
                    _three_columns(lines[(3 * f + k) * _WIDE :], taps[f], found)
                    if k > 0:
                        _copy(found, size, out[f, 3 + k, n, start:])
                    even, odd = (k - 1, k + 1) if k > 0 else (6, 7)
                    _copy(found[_WIDE:], size, out[f, even, n, start:])
                    _copy(found[2 * _WIDE :], size, out[f, odd, n, start:])


@njit(cache=True, nogil=True)
def _smooth(images: Any, taps: Any, rows: Any, columns: Any, result: Any) -> None:
    wide = result.shape[2]
    seen = np.zeros(rows.size * _WIDE, images.dtype)
    line, found = np.zeros(2 * _WIDE, images.dtype), np.zeros(_WIDE, images.dtype)
    for m in range(len(images)):
        for start in range(0, wide, _TILE):
            _seen(images[m], rows, columns, start, seen)
            for n in range(rows.size - 2 * _REACH):
                _one_row(seen[n * _WIDE :], taps, line)
                _one_column(line, taps, found)
                _copy(found, min(_TILE, wide - start), result[m, n, start:])


@njit(inline="always")
def _inside(place: int, size: int) -> int:
    """The place mirrored about the first and the last one, as splines go on."""
    place = abs(place)
    place = size - 1 - abs(size - 1 - place)
    return min(max(place, 0), size - 1)


@njit(inline="always")
def _weights(t: Any) -> Any:
    """The cubic B-spline at t + 1, t, t - 1 and t - 2, for t from 0 to 1."""
    s, sixth = 1 - t, 1 / 6
    before, after = s * s * s * sixth, t * t * t * sixth
    return before, 2 / 3 - t * t * (1 - t / 2), 2 / 3 - s * s * (1 - s / 2), after


@njit(cache=True, nogil=True, fastmath={"contract"})
def _sampled(spline: Any, uv: Any, start: Any, result: Any) -> None:
    rows, columns = spline.shape
    for n in range(len(result)):
        row = start + n
        for column in range(columns):
            y = min(max(row + uv[1, row, column], 0.0), rows - 1.0)
            x = min(max(column + uv[0, row, column], 0.0), columns - 1.0)
            top, left = int(y), int(x)
            down, across = _weights(y - top), _weights(x - left)
            total = 0.0
            if 0 < top < rows - 2 and 0 < left < columns - 2:
                for k in range(4):
                    line = spline[top - 1 + k, left - 1 : left + 3]
                    part = across[0] * line[0] + across[1] * line[1] + across[2] * line[2] + across[3] * line[3]
                    total += down[k] * part
            else:
                for k in range(4):
                    i = _inside(top - 1 + k, rows)
                    part = 0.0
                    for m in range(4):
                        part += across[m] * spline[i, _inside(left - 1 + m, columns)]
                    total += down[k] * part
            result[n, column] = total
