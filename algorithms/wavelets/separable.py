"""Filters of images along rows and columns, several at once, and interpolation between pixels.

All functions compute some rows of the result, so that intermediate values remain in a cache and threads can share rows.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generated import filters, images

from ..arguments import Reals

_REACH = 10
"""Pixels on either side of a pixel that filters use."""


def half_taps(taps: NDArray[np.float64], dtype: Any) -> Reals:
    """Return the middle and the later half of symmetric or antisymmetric taps, at most 21 of them, padded with zeros.

    Parameters
    ----------
    taps : array, (..., K)
        K must be odd.

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
    """Filter some rows of an image, mirrored at its edges, with quaternionic Gabor filters and filters along one axis.

    Parameters
    ----------
    image : array, (M, N)
        Dense array.
    taps : array, (F, 3, 11)
        `half_taps` for each of F frequencies: of the Gaussian, of the even part and of the odd part.
    border : int
        Number of pixels by which the result extends beyond the image.
    place : slice
        Rows of the result, which has M + 2 border rows.
    out : array, (F, 8, rows, N + 2 border)
        Output: quaternions w, x, y, z, and the real and imaginary parts of waves along columns and along rows.
    """
    seen, (count, _, rows, wide) = _seen(image, border, place), out.shape
    # All rows form one line, because kernels are faster on long lines. Results at the ends of rows, where windows
    # extend into the next row, are cut off.
    line, low, even, odd = seen.shape[1], *np.moveaxis(_whole(taps), 1, 0)
    size = rows * line
    lines = np.zeros((count, 3, size + 2 * _REACH), seen.dtype)
    three = np.stack([even, odd, low], 1)[:, None]
    filters.three_filters(_windows(seen.reshape(-1), size, line), three, out=np.moveaxis(lines[:, :, :size], 1, -1))
    found = np.empty((count, 4, 2, size), seen.dtype)
    windows = _windows(lines, size, 1)
    filters.three_filters(windows[:, :2], three[:, None], out=found[:, :3].transpose(0, 2, 3, 1))
    filters.even_and_odd_filter(windows[:, 2], three[:, :, :2], out=np.moveaxis(found[:, 3], 1, -1))
    out[...] = found.reshape(count, 8, rows, line)[..., :wide]


def sampled_rows(spline: Reals, uv: Reals, place: slice, out: Reals) -> None:
    """Interpolate some rows of an image at (x + u, y + v); outside the image, the nearest pixel is repeated.

    Parameters
    ----------
    spline : array, (M, N)
        Spline coefficients from ``scipy.ndimage.spline_filter(image, 3)``.
    uv : array, (2, M, N)
    place : slice
    out : array, (rows, N)
    """
    Sampler(spline).rows(uv, place, out)


class Sampler:
    """Interpolation of an image between its pixels; outside the image, the nearest pixel is repeated.

    Parameters
    ----------
    spline : array, (M, N)
        Spline coefficients from ``scipy.ndimage.spline_filter(image, 3)``.
    """

    def __init__(self, spline: Reals) -> None:
        padded = np.pad(spline, [(1, 2), (1, 2)], "reflect")
        self._shape, self._wide = spline.shape, padded.shape[1]
        table = np.ascontiguousarray(np.lib.stride_tricks.sliding_window_view(padded.ravel(), 4))
        count = len(table) - 3 * self._wide
        self._tables = [table[k * self._wide : k * self._wide + count] for k in range(4)]

    def rows(self, uv: Reals, place: slice, out: Reals) -> None:
        """Interpolate some rows of the image at (x + u, y + v); see `sampled_rows`."""
        out[...] = self.at(uv[:, place], np.arange(place.start, place.stop)[:, None], np.arange(self._shape[1]))

    def at(self, uv: Reals, row: NDArray[np.intp], column: NDArray[np.intp]) -> Reals:
        """Return the image at (column + u, row + v) for some pixels; `uv` is (2, ...)."""
        (left, x), (top, y) = cells(uv, row, column, self._shape)
        place = (top * self._wide + left).reshape(-1)
        found: Reals = images.cubic_samples(*self._tables, place, x.reshape(-1), y.reshape(-1))  # type: ignore[call-overload]
        return found.reshape(uv.shape[1:])


def cells(
    uv: Reals, row: NDArray[np.intp], column: NDArray[np.intp], shape: tuple[int, ...]
) -> list[tuple[NDArray[np.intp], Reals]]:
    """Return the integer and the fractional parts of ``(column + u, row + v)``, clipped to the image.

    Parameters
    ----------
    uv : array, (2, ...)
    row, column : array of int
    shape : (int, int)
        Shape of the image.

    Returns
    -------
    [(columns, x), (rows, y)]
        Whole numbers, and fractions from 0 to 1.
    """
    found = []
    for motion, own, size in zip(uv, (column, row), shape[::-1], strict=True):
        whole = np.floor(motion)
        part = motion - whole
        pixel = np.clip(whole, -size, size, out=whole).astype(np.intp)
        pixel += own
        part *= (pixel >= 0) & (pixel < size - 1)
        found.append((np.clip(pixel, 0, size - 1, out=pixel), part))
    return found


def _seen(images: Reals, border: int, place: slice) -> Reals:
    """Return the inputs for some rows of the result: with rows and columns before and after, mirrored at the edges."""
    rows, columns = (_mirrored(size, border + _REACH) for size in images.shape[-2:])
    lines = images[..., rows[place.start : place.stop + 2 * _REACH], :]
    reach = border + _REACH
    seen = np.empty((*lines.shape[:-1], len(columns)), images.dtype)
    seen[..., reach:-reach] = lines
    seen[..., :reach], seen[..., -reach:] = lines[..., columns[:reach]], lines[..., columns[-reach:]]
    return seen


@lru_cache
def _mirrored(size: int, reach: int) -> NDArray[np.intp]:
    """Return mirrored indices, from `reach` before the first one to `reach` after the last one."""
    r = np.arange(-reach, size + reach) % (2 * size)
    return np.minimum(r, 2 * size - 1 - r)


def _windows(numbers: Reals, count: int, step: int) -> Reals:
    """Return the windows of `count` neighbours on a line: `2 * _REACH + 1` numbers each, with this step."""
    shape, strides = (*numbers.shape[:-1], count, 2 * _REACH + 1), (*numbers.strides, step * numbers.strides[-1])
    return np.lib.stride_tricks.as_strided(numbers, shape, strides, writeable=False)


def _whole(taps: Reals) -> Reals:
    """Return the full taps of symmetric or antisymmetric filters with these `half_taps`."""
    return np.concatenate([np.zeros_like(taps[..., 1:]), taps[..., :1], 2 * taps[..., 1:]], -1)
