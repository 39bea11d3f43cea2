"""The stationary wavelet transform: a discrete wavelet transform without downsampling, of periodic signals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import gcd

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, real_array
from .colours import refuse_channels
from .discrete import check_finite, checked_axes, checked_levels, divided, joined
from .families import wavelet_filters
from .filter_bank import Taps, as_taps, extended, split, split_taps, stack
from .sharing import Progress, n_threads, steps


@dataclass(frozen=True)
class StationaryWavelet:
    """Result of `stationary_wavelet`.

    Attributes
    ----------
    approx : array
        The approximation after all levels, of the shape of the signals.
    detail : tuple of dict
        ``detail[l]``, finest first, named as in `WaveletPyramid`; all arrays have the shape of the signals.
    wavelet : str
    axes : tuple of int
    is_tight : bool
    """

    approx: Reals
    detail: tuple[dict[str, Reals], ...]
    wavelet: str
    axes: tuple[int, ...]
    is_tight: bool

    def inverse(self, workers: int | None = None, progress: Progress | None = None) -> Reals:
        """Return the reconstructed signals, exact up to rounding if no coefficient was changed; `iswt` of PyWavelets.

        If coefficients were changed, it is the mean of the inverses of all decimated transforms that they contain.

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
        step_done, array = steps(progress, len(self.detail)), self.approx
        n_threads(workers)
        for level in range(len(self.detail) - 1, -1, -1):
            gap = 2**level

            def join(low: Reals, high: Reals, axis: int, gap: int = gap) -> Reals:
                return _join(low, high, self.wavelet, self.is_tight, axis, gap, workers)

            array = joined(array, self.detail[level], self.axes, join)
            step_done()
        return array


def stationary_wavelet(
    signal: ArrayLike,
    wavelet: str = "db4",
    levels: int | None = None,
    axes: tuple[int, ...] | None = None,
    is_tight: bool = False,
    workers: int | None = None,
    progress: Progress | None = None,
) -> StationaryWavelet:
    """Compute the stationary (undecimated) wavelet transform along one or more axes; `swt`, `swt2` of PyWavelets.

    A shift of a periodic signal shifts the coefficients. Each level has as many numbers in each band as the signal.

    Parameters
    ----------
    signal : array_like
        Real numbers of any shape and any size, including odd sizes. float32 is kept; integers are converted to float64.
    wavelet : str
        See `wavelet_filters`.
    levels : int, optional
        Number of levels. The maximum is the largest for which ``2**levels`` is at most the smallest size; the default
        is the largest for which the filters, whose taps are ``2**(levels - 1)`` samples apart, fit into the signal.
    axes : tuple of int, optional
        As in `discrete_wavelet`.
    is_tight : bool
        Divide the filters by the square root of 2, so that orthogonal wavelets preserve the energy; `norm` of
        PyWavelets.
    workers : int, optional
        Number of threads, as in `scipy.fft`; the result does not depend on it.
    progress : function of (done, total), optional
        Called after each level.

    Returns
    -------
    StationaryWavelet

    Raises
    ------
    TypeError, ValueError
        If `signal` is not an array of finite real numbers, if the wavelet or axes are unknown, or if there are too many
        levels.

    Notes
    -----
    Nason and Silverman, in *Wavelets and Statistics*, Springer 1995. Coefficients agree with PyWavelets, which requires
    multiples of ``2**levels``; here the filters wrap around signals of any size, and `inverse` recovers the signal to
    1e-12 of the largest number.
    """
    array = real_array(signal, "signal", (-1,))
    length = len(wavelet_filters(wavelet).low)
    chosen = checked_axes(axes, array.ndim)
    if axes is None:
        refuse_channels(array.shape, "signal", "axes=(0, 1) takes all channels, axes=(-2, -1) images of so few columns")
    check_finite(array, "signal")
    size = min(array.shape[axis] for axis in chosen)
    most = size.bit_length() - 1
    count = checked_levels(levels, most, f"as {size} numbers have")
    if levels is None:
        count = (size // (length - 1)).bit_length()
        count = min(count, most)
    n_threads(workers)
    detail, step_done = [], steps(progress, count)
    for level in range(count):
        gap = 2**level

        def halves(band: Reals, axis: int, gap: int = gap) -> tuple[Reals, Reals]:
            return _halves(band, wavelet, is_tight, axis, gap, workers)

        array, bands = divided(array, chosen, halves)
        detail.append(bands)
        step_done()
    return StationaryWavelet(array, tuple(detail), wavelet, chosen, is_tight)


def _halves(
    array: Reals, wavelet: str, is_tight: bool, axis: int, gap: int, workers: int | None
) -> tuple[Reals, Reals]:
    """Return both filtered signals of one level, with filters whose taps are `gap` samples apart."""
    taps = _taps(wavelet, is_tight, array.dtype)[0]
    x, places = _cosets(stack(array, axis), gap)
    half = taps.every.shape[1] // 2
    results = split(extended(x, "periodic", half - 1, half), 1, taps, x.shape[1], workers)
    return _whole(results[0], places, array.shape), _whole(results[1], places, array.shape)


def _join(low: Reals, high: Reals, wavelet: str, is_tight: bool, axis: int, gap: int, workers: int | None) -> Reals:
    """Return the signal whose `_halves` are given."""
    taps = _taps(wavelet, is_tight, low.dtype)[1]
    (a, places), (d, _) = (_cosets(stack(np.asarray(band, low.dtype), axis), gap) for band in (low, high))
    # Numbers of both bands alternate. A window of both contains those of two adjacent results.
    outer, count, inner = a.shape
    both = np.stack([a, d], 2).reshape(outer, 2 * count, inner)
    reach = (taps.every.shape[1] - 2) // 2
    pairs = (count + 1) // 2
    results = split(extended(both, "periodic", reach, reach), 4, taps, pairs, workers)
    x = np.stack(results, 2).reshape(outer, 2 * pairs, inner)[:, :count]
    return _whole(x, places, low.shape)


@lru_cache(256)
def _taps(wavelet: str, is_tight: bool, dtype: np.dtype[np.floating]) -> tuple[Taps, Taps]:
    """Return the taps of the analysis, and those of the synthesis for two adjacent results from alternating bands."""
    filters, root = wavelet_filters(wavelet), np.sqrt(2)
    forth, back = (1 / root, 1 / root) if is_tight else (1.0, 0.5)
    joint = back * np.stack([filters.low_back[::-1], filters.high_back[::-1]], 1).ravel()
    taps = np.stack([np.pad(joint, (0, 2)), np.pad(joint, (2, 0))])
    return split_taps(forth * filters.low, forth * filters.high, dtype), as_taps(taps, dtype)


def _cosets(x: Reals, gap: int) -> tuple[Reals, NDArray[np.intp] | None]:
    """Return signals (outer, n, inner) as periodic signals of samples that are `gap` apart, along the middle axis.

    Also return the places of these samples in the original order, or None if the array is only reshaped.
    """
    outer, size, inner = x.shape
    if size % gap == 0:
        return x.reshape(outer, size // gap, gap * inner), None
    common = gcd(size, gap)
    places = (np.arange(common) + gap * np.arange(size // common)[:, None]).ravel() % size
    return x.take(places, 1).reshape(outer, size // common, common * inner), np.argsort(places)


def _whole(x: Reals, places: NDArray[np.intp] | None, shape: tuple[int, ...]) -> Reals:
    """Return signals in the original order and shape."""
    if places is None:
        return x.reshape(shape)
    return x.reshape(len(x), len(places), -1).take(places, 1).reshape(shape)
