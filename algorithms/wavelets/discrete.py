"""Discrete wavelet transforms of signals, images and volumes with orthogonal and biorthogonal filters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import filters

from ..arguments import Reals, real_array
from .colours import refuse_channels
from .families import wavelet_filters
from .filter_bank import (
    MODES,
    SHORT,
    Taps,
    extended,
    halved,
    merge,
    merge_lines,
    merge_taps,
    places_of,
    split_lines,
    split_taps,
    stack,
)
from .sharing import Progress, n_threads, steps

_TERMS = 4
"""Bound of the sums in transforms and filters, as a multiple of the sum of the absolute values of all numbers."""
_NAMES = {"da": "H", "ad": "V", "dd": "D"}
"""Names of the details of images: horizontal, vertical and diagonal structures."""


@dataclass(frozen=True)
class WaveletPyramid:
    """Result of `discrete_wavelet`.

    Attributes
    ----------
    approx : array
        The approximation after all levels.
    detail : tuple of dict
        ``detail[l]``, finest first. Signals have the key "D"; images have "H", "V" and "D" for horizontal, vertical and
        diagonal structures; keys of volumes have one letter per axis, "a" where it is smoothed and "d" where it is
        differenced.
    wavelet, mode : str
    axes : tuple of int
    shapes : tuple
        For each level, the lengths of the axes before that level.
    """

    approx: Reals
    detail: tuple[dict[str, Reals], ...]
    wavelet: str
    mode: str
    axes: tuple[int, ...]
    shapes: tuple[tuple[int, ...], ...]

    def inverse(self, workers: int | None = None, progress: Progress | None = None) -> Reals:
        """Return the reconstructed signals, exact up to rounding if no coefficient was changed.

        Parameters
        ----------
        workers : int, optional
            Number of threads, as in `scipy.fft`; the result does not depend on it.
        progress : function of (done, total), optional
            Called after each level.

        Returns
        -------
        array, of the shape of the signals
        """
        step_done = steps(progress, len(self.detail))
        n_threads(workers)
        array = self.approx
        for detail, shape in zip(self.detail[::-1], self.shapes[::-1], strict=True):
            sizes = dict(zip(self.axes, shape, strict=True))

            def join(low: Reals, high: Reals, axis: int, sizes: dict[int, int] = sizes) -> Reals:
                return synthesis(low, high, self.wavelet, self.mode, axis, sizes[axis], workers)

            array = joined(array, detail, self.axes, join)
            step_done()
        return array


def discrete_wavelet(
    signal: ArrayLike,
    wavelet: str = "db4",
    levels: int | None = None,
    mode: str = "symmetric",
    axes: tuple[int, ...] | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> WaveletPyramid:
    """Compute the discrete wavelet transform along one or more axes.

    Parameters
    ----------
    signal : array_like
        Real numbers of any shape and any size, including odd sizes. float32 is kept; integers are converted to float64.
    wavelet : str
        See `wavelet_filters`.
    levels : int, optional
        Number of levels. The default, and the maximum, leaves at least one coefficient unaffected by boundaries.
    mode : str
        Extension of the signal beyond its ends: "symmetric" (c b a | a b c), "reflect" (c b | a b c), "zero",
        "constant", "periodic", "smooth" (linear extrapolation of the last two numbers), "antisymmetric", "antireflect",
        or "periodization", which is periodic and has as many coefficients as the signal has numbers.
    axes : tuple of int, optional
        The default is the last two axes, or the only one. It is required for arrays with the shape of pictures with
        channels, whose last axis has at most 4 elements and whose preceding axes are longer.
    workers : int, optional
        Number of threads, as in `scipy.fft`; the result does not depend on it.
    progress : function of (done, total), optional
        Called after each level.

    Returns
    -------
    WaveletPyramid

    Raises
    ------
    TypeError, ValueError
        If `signal` is not an array of finite real numbers, if names or axes are unknown, or if there are too many
        levels.

    Notes
    -----
    Coefficients agree with PyWavelets to 1e-10 of the largest number; `inverse` recovers the signal to 1e-12 of it.
    """
    array, chosen, count = checked_signal(signal, wavelet, levels, mode, axes)
    detail, shapes, step_done = [], [], steps(progress, count)
    n_threads(workers)
    for _ in range(count):
        shapes.append(tuple(array.shape[axis] for axis in chosen))
        array, bands = divided(array, chosen, lambda band, axis: analysis(band, wavelet, mode, axis, workers))
        detail.append(bands)
        step_done()
    return WaveletPyramid(array, tuple(detail), wavelet, mode, chosen, tuple(shapes))


def divided(
    array: Reals, axes: tuple[int, ...], halves: Callable[[Reals, int], tuple[Reals, Reals]]
) -> tuple[Reals, dict[str, Reals]]:
    """Return the approximation and the named details of one level, which `halves` splits along each axis."""
    bands = {"": array}
    for axis in axes:
        bands = {
            word + letter: half for word in bands for letter, half in zip("ad", halves(bands[word], axis), strict=True)
        }
    return bands.pop("a" * len(axes)), {_name(word): band for word, band in bands.items()}


def joined(
    approx: Reals, detail: dict[str, Reals], axes: tuple[int, ...], join: Callable[[Reals, Reals, int], Reals]
) -> Reals:
    """Return the array that `divided` has split; `join` joins the halves along an axis."""
    bands = {"a" * len(axes): approx, **{_letters(key, len(axes)): band for key, band in detail.items()}}
    for k in range(len(axes) - 1, -1, -1):
        words = map("".join, product("ad", repeat=k))
        bands = {word: join(bands[word + "a"], bands[word + "d"], axes[k]) for word in words}
    return bands[""]


def dwt(
    signal: ArrayLike, wavelet: str = "db4", mode: str = "symmetric", axis: int = -1, workers: int | None = None
) -> tuple[Reals, Reals]:
    """Compute one level of the discrete wavelet transform along one axis, for signals of any size.

    Parameters
    ----------
    signal, wavelet, mode, workers
        As in `discrete_wavelet`.
    axis : int

    Returns
    -------
    smooth, rough : array
        The approximation and the details, of ``(n + taps - 1) // 2`` numbers, or half of n rounded up with the mode
        "periodization".

    Raises
    ------
    TypeError, ValueError
        As in `discrete_wavelet`.
    """
    array = real_array(signal, "signal", (-1,))
    if mode not in MODES:
        raise ValueError(f"mode: {mode!r}; expected {', '.join(map(repr, MODES))}")
    check_finite(array, "signal")
    if not -array.ndim <= axis < array.ndim:
        raise ValueError(f"axis: {axis}; expected an axis of an array of {array.ndim}")
    if workers is not None:
        n_threads(workers)
    return analysis(array, wavelet, mode, axis, workers)


def idwt(
    smooth: ArrayLike,
    rough: ArrayLike,
    wavelet: str = "db4",
    mode: str = "symmetric",
    axis: int = -1,
    size: int | None = None,
    workers: int | None = None,
) -> Reals:
    """Return the signals whose `dwt` is given.

    Parameters
    ----------
    smooth, rough : array_like
        The approximation and the details, of the same shape.
    wavelet, mode, axis, workers
        As in `dwt`.
    size : int, optional
        The length of the signals, of the two that are possible; the default is the even one.

    Returns
    -------
    array

    Raises
    ------
    TypeError, ValueError
        If the bands are not arrays of finite real numbers of the same shape, if names or the axis are unknown, or if
        the size differs from both possible sizes.
    """
    low, high = real_array(smooth, "smooth", (-1,)), real_array(rough, "rough", (-1,))
    if low.shape != high.shape:
        raise ValueError(f"rough: shape {high.shape}; expected that of smooth, {low.shape}")
    if mode not in MODES:
        raise ValueError(f"mode: {mode!r}; expected {', '.join(map(repr, MODES))}")
    check_finite(low, "smooth")
    check_finite(high, "rough")
    if not -low.ndim <= axis < low.ndim:
        raise ValueError(f"axis: {axis}; expected an axis of an array of {low.ndim}")
    if workers is not None:
        n_threads(workers)
    length = len(wavelet_filters(wavelet).low)
    most = 2 * low.shape[axis] - (0 if mode == "periodization" else length - 2)
    if most < 1:
        raise ValueError(
            f"smooth: {low.shape[axis]} numbers along the axis; expected at least {length // 2}, for filters of "
            f"{length} taps"
        )
    count = most if size is None else size
    if not most - 1 <= count <= most or count < 1:
        raise ValueError(
            f"size: {count}; expected {most} or {most - 1}, of which {low.shape[axis]} numbers are the transform"
        )
    return synthesis(low, high, wavelet, mode, axis, count, workers)


def analysis(array: Reals, wavelet: str, mode: str, axis: int, workers: int | None = None) -> tuple[Reals, Reals]:
    """Return the smoothed and the differenced half of one level along one axis."""
    shape = array.shape
    taps, count, before, places = _plan(wavelet, mode, shape[axis], array.dtype)
    is_last = axis in (-1, len(shape) - 1)
    if is_last and places is not None and array.size < SHORT:
        return split_lines(array.take(places, -1), taps, count)
    low, high = halved(stack(array, axis), mode, before, taps, count, workers)
    half = shape[:axis] + (count,) + (() if is_last else shape[axis + 1 :])
    return low.reshape(half), high.reshape(half)


def synthesis(
    smooth: Reals, rough: Reals, wavelet: str, mode: str, axis: int, size: int, workers: int | None = None
) -> Reals:
    """Return the signal of `size` numbers along an axis from the results of `analysis`."""
    taps = _taps(wavelet, smooth.dtype)[1]
    half, shape = taps.every.shape[2], smooth.shape
    rough, count = np.asarray(rough, smooth.dtype), shape[axis]
    is_last = axis in (-1, len(shape) - 1)
    # With results numbered from 0, those before the first wanted one end with earlier numbers of the bands.
    first = before = after = 0
    if mode == "periodization":
        first, before, after = (half - 1) % 2, half // 2, (half + size) // 2 - count
    pairs = before + count + after - half + 1
    if is_last and smooth.size < SHORT:
        if before or after:
            places = np.arange(-before, count + after) % count
            smooth, rough = smooth.take(places, -1), rough.take(places, -1)
        sums = merge_lines(smooth, rough, taps, pairs)
        return sums.reshape((*shape[:-1], 2 * pairs))[..., first : first + size]
    low, high = (extended(stack(band, axis), "periodic", before, after) for band in (smooth, rough))
    result = merge(low, high, taps, pairs, workers)[:, first : first + size]
    return result.reshape(shape[:axis] + (size,) + (() if is_last else shape[axis + 1 :]))


@lru_cache(256)
def _taps(wavelet: str, dtype: np.dtype[np.floating]) -> tuple[Taps, Taps]:
    """Return the taps of analysis and of synthesis."""
    filters = wavelet_filters(wavelet)
    return split_taps(filters.low, filters.high, dtype), merge_taps(filters.low_back, filters.high_back, dtype)


@lru_cache(256)
def _plan(
    wavelet: str, mode: str, size: int, dtype: np.dtype[np.floating]
) -> tuple[Taps, int, int, NDArray[np.intp] | None]:
    """Return the taps of analysis, the number of results and of numbers before the signal, and places if it is short.

    The places are those of the numbers of the extended signal, see `places_of`.
    """
    taps = _taps(wavelet, dtype)[0]
    length = taps.every.shape[1]
    if mode == "periodization":
        count, before = (size + 1) // 2, length // 2 - 1
    else:
        count, before = (size + length - 1) // 2, length - 2
    after = 2 * count + length - 2 - size - before
    return taps, count, before, places_of(mode, size, before, after) if size < SHORT else None


def checked_signal(
    signal: ArrayLike, wavelet: str, levels: int | None, mode: str, axes: tuple[int, ...] | None
) -> tuple[Reals, tuple[int, ...], int]:
    """Return the array, the axes and the number of levels after validation."""
    array = real_array(signal, "signal", (-1,))
    length = len(wavelet_filters(wavelet).low)
    if mode not in MODES:
        raise ValueError(f"mode: {mode!r}; expected {', '.join(map(repr, MODES))}")
    chosen = checked_axes(axes, array.ndim)
    if axes is None:
        refuse_channels(array.shape, "signal", "axes=(0, 1) takes all channels, axes=(-2, -1) images of so few columns")
    check_finite(array, "signal")
    count = _levels(levels, [array.shape[axis] for axis in chosen], length)
    return array, chosen, count


def check_finite(array: Reals, name: str) -> None:
    """Raise an error for empty arrays and for numbers that are not finite or whose sum would overflow."""
    if array.size == 0:
        raise ValueError(f"{name}: shape {array.shape}; expected no empty axis")
    is_short = array.dtype.kind == "f" and array.size < SHORT and array.flags.c_contiguous
    if is_short and isfinite(filters.energy(array if array.ndim == 1 else array.reshape(-1))):
        return  # One sum is faster than two searches.
    largest = max(float(array.max()), -float(array.min()))
    if not np.isfinite(largest):
        raise ValueError(f"{name}: a number is not finite; expected finite numbers")
    if array.dtype.kind == "f" and largest > np.finfo(array.dtype).max / (_TERMS * array.size):
        raise ValueError(
            f"{name}: numbers up to {largest:.3g}, whose sums in the transforms overflow; expected smaller numbers: "
            "divide by a power of 2"
        )


def checked_levels(levels: int | None, most: int, why: str) -> int:
    """Return the number of levels after validation; `most` is the maximum and the default."""
    if levels is None:
        return most
    if isinstance(levels, bool) or not isinstance(levels, (int, np.integer)) or levels < 0:
        raise ValueError(f"levels: {levels!r}; expected a whole number, 0 or more")
    if levels > most:
        raise ValueError(f"levels: {levels}; expected at most {most}, {why}")
    return int(levels)


def _levels(levels: int | None, sizes: list[int], length: int) -> int:
    smallest = min(sizes)
    most = max(int(np.floor(np.log2(smallest / (length - 1)))), 0) if smallest >= length else 0
    return checked_levels(levels, most, f"as {smallest} numbers have with a filter of {length} taps")


def checked_axes(axes: tuple[int, ...] | None, dimension: int) -> tuple[int, ...]:
    """Return axes counted from the end, so that they remain valid if leading axes are added."""
    chosen = tuple(range(-min(dimension, 2), 0)) if axes is None else tuple(axes)
    if not chosen or any(not -dimension <= axis < dimension for axis in chosen):
        raise ValueError(f"axes: {axes}; expected axes of an array of {dimension}")
    chosen = tuple(axis % dimension - dimension for axis in chosen)
    if len(set(chosen)) < len(chosen):
        raise ValueError(f"axes: {axes}; expected each axis once")
    return chosen


def band_names(axes: int) -> dict[str, str]:
    """Return the names of the details of one level, for words with one letter per axis."""
    words = map("".join, product("ad", repeat=axes))
    return {word: _name(word) for word in words if "d" in word}


def _name(word: str) -> str:
    return "D" if word == "d" else _NAMES.get(word, word)


def _letters(key: str, axes: int) -> str:
    return "d" if axes == 1 else next((word for word, name in _NAMES.items() if name == key), key)
