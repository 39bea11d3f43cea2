"""Shrinking of wavelet coefficients, thresholds, and denoising of signals, images and volumes of any number of axes."""

from __future__ import annotations

from math import log, log2, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, as_given, finite_number, real_array, whole_number
from .checks import MEDIAN
from .discrete import WaveletPyramid, band_names, discrete_wavelet
from .families import wavelet_filters
from .stationary import StationaryWavelet, stationary_wavelet

_KINDS = ("soft", "hard", "garrote", "firm")
_RULES = ("bayes", "sure", "visu")


def shrink(coefficients: ArrayLike, threshold: ArrayLike, kind: str = "soft", upper: ArrayLike | None = None) -> Reals:
    """Reduce the magnitudes of coefficients; `threshold` and `threshold_firm` of PyWavelets.

    Parameters
    ----------
    coefficients : array_like
        Real or complex numbers c of any shape. float32 and complex64 are kept. Complex numbers keep their phases.
    threshold : array_like
        The threshold t, 0 or more: a number, or numbers that broadcast with the coefficients.
    kind : str
        The factor of numbers with ``|c| > t``; other numbers become 0. "soft": ``1 - t / |c|``; "hard": 1; "garrote":
        ``1 - t**2 / |c|**2``; "firm": ``u (|c| - t) / ((u - t) |c|)`` up to u, and 1 above.
    upper : array_like, optional
        The upper threshold u of "firm", at least t.

    Returns
    -------
    array, of the shape of the coefficients

    Raises
    ------
    TypeError, ValueError
        If the coefficients are not finite numbers, if a threshold is negative, if u is below t, or if u is given for
        another kind or missing.

    Notes
    -----
    Donoho and Johnstone, *Biometrika* 81:425, 1994 (soft, hard); Gao, *J. Comput. Graph. Stat.* 7:469, 1998 (garrote);
    Gao and Bruce, *Statistica Sinica* 7:855, 1997 (firm).
    """
    values = as_given(coefficients, "coefficients")
    if values.dtype.kind != "c":
        values = real_array(coefficients, "coefficients")
    if not np.isfinite(values).all():
        raise ValueError("coefficients: a number is not finite; expected finite numbers")
    if kind not in _KINDS:
        raise ValueError(f"kind: {kind!r}; expected {', '.join(map(repr, _KINDS))}")
    if (upper is not None) != (kind == "firm"):
        raise ValueError(f"upper: {upper!r}; expected an upper threshold for 'firm', and none for other kinds")
    low = _threshold(threshold, "threshold", values)
    sizes = np.abs(values)
    is_kept = sizes > low
    part = np.divide(low, sizes, out=np.ones_like(sizes), where=is_kept)
    if kind == "soft":
        factor = 1 - part
    elif kind == "hard":
        factor = is_kept
    elif kind == "garrote":
        factor = 1 - part**2
    else:
        high = _threshold(upper, "upper", values)
        if (high < low).any():
            raise ValueError("upper: below the threshold; expected at least the threshold")
        all_of = 1 - np.divide(low, high, out=np.zeros_like(low + high), where=high > low)
        factor = np.where(sizes > high, is_kept, (1 - part) / all_of)
    return np.asarray(values * factor, values.dtype)


def universal_threshold(count: int, sigma: float = 1.0) -> float:
    """Return ``sigma sqrt(2 log n)``, which noise in n coefficients rarely exceeds; VisuShrink.

    Raises
    ------
    TypeError, ValueError
        If n is less than 1, or sigma is negative.
    """
    whole_number(count, "count", 1)
    return _deviation(sigma) * sqrt(2 * log(count))


def sure_threshold(coefficients: ArrayLike, sigma: float = 1.0) -> float:
    """Return the threshold of soft shrinking with the least estimated squared error; SureShrink.

    Parameters
    ----------
    coefficients : array_like
        Real numbers with normal noise.
    sigma : float
        Standard deviation of the noise.

    Raises
    ------
    TypeError, ValueError
        If the coefficients are not finite real numbers, if there are none, or if sigma is negative.

    Notes
    -----
    Donoho and Johnstone, *J. Amer. Stat. Assoc.* 90:1200, 1995: Stein's unbiased estimate of the risk is minimised over
    all magnitudes below the universal threshold. Where the coefficients have hardly more energy than the noise, the
    estimate is too uncertain, and the universal threshold is returned.
    """
    values = np.sort(np.abs(_checked(coefficients)).astype(float), axis=None)
    noise, count = _deviation(sigma), values.size
    most = universal_threshold(count, noise)
    if noise == 0:
        return 0.0
    squared = (values / noise) ** 2
    if (squared.sum() - count) / count <= log2(count) ** 1.5 / sqrt(count):
        return most
    places = np.arange(1, count + 1)
    risks = count - 2 * places + np.cumsum(squared) + (count - places) * squared
    found = np.searchsorted(values, most, "right")
    # Without a threshold, the risk is that of the noise.
    risks = np.concatenate([[count], risks[:found]])
    return float(np.concatenate([[0.0], values])[risks.argmin()])


def bayes_threshold(coefficients: ArrayLike, sigma: float = 1.0) -> float:
    """Return the variance of the noise divided by the standard deviation of the signal; BayesShrink.

    If the coefficients have no more energy than the noise, it is the largest magnitude, which removes all of them.

    Raises
    ------
    TypeError, ValueError
        If the coefficients are not finite real numbers, if there are none, or if sigma is negative.

    Notes
    -----
    Chang, Yu and Vetterli, *IEEE Trans. Image Processing* 9:1532, 2000.
    """
    values, noise = np.abs(_checked(coefficients)).astype(float), _deviation(sigma)
    largest = float(values.max())
    if noise == 0 or largest == 0:
        return 0.0
    scale = max(largest, noise)
    signal = sqrt(max(float(((values / scale) ** 2).mean()) - (noise / scale) ** 2, 0))
    return min(noise * (noise / scale) / signal, largest) if signal > 0 else largest


def noise_deviation(coefficients: ArrayLike) -> float:
    """Return the standard deviation of normal noise in coefficients of which most are noise: median / 0.6745.

    0.6745 is the median of the absolute value of a standard normal variable.

    Raises
    ------
    TypeError, ValueError
        If the coefficients are not finite real numbers, or if there are none.
    """
    return float(np.median(np.abs(_checked(coefficients))) / MEDIAN)


def denoise_wavelet(
    signal: ArrayLike,
    wavelet: str = "sym8",
    levels: int | None = None,
    rule: str = "bayes",
    kind: str = "soft",
    sigma: float | None = None,
    axes: tuple[int, ...] | None = None,
    is_stationary: bool = False,
    mode: str = "symmetric",
    workers: int | None = None,
) -> Reals:
    """Remove white normal noise from signals by shrinking their wavelet coefficients.

    For images, `denoise` with the dual tree has smaller errors.

    Parameters
    ----------
    signal : array_like
        Real numbers of any shape and size. float32 is kept; integers are converted to float64.
    wavelet, levels, axes
        As in `discrete_wavelet`.
    rule : str
        The threshold of each band: "bayes", "sure" or "visu", see `bayes_threshold`, `sure_threshold` and
        `universal_threshold`, of all numbers of the signal.
    kind : str
        "soft", "hard" or "garrote", see `shrink`.
    sigma : float, optional
        Standard deviation of the noise. The default is estimated from the finest details, see `noise_deviation`.
    is_stationary : bool
        Use the stationary transform, which is periodic, and average over all shifts of the signal.
    mode : str
        Extension of the signal, see `discrete_wavelet`; the stationary transform does not use it.
    workers : int, optional
        Number of threads, as in `scipy.fft`; the result does not depend on it.

    Returns
    -------
    array, of the shape of the signal

    Raises
    ------
    TypeError, ValueError
        As in `discrete_wavelet`; if the rule or kind are unknown; or if sigma is negative.

    Notes
    -----
    Noise that is white in the signal has the standard deviation sigma times the norms of the filters in each band,
    which are 1 for orthogonal wavelets. Signals along other axes have common thresholds.
    """
    if rule not in _RULES:
        raise ValueError(f"rule: {rule!r}; expected {', '.join(map(repr, _RULES))}")
    if kind not in _KINDS[:3]:
        raise ValueError(f"kind: {kind!r}; expected {', '.join(map(repr, _KINDS[:3]))}")
    given = None if sigma is None else _deviation(sigma)
    pyramid: WaveletPyramid | StationaryWavelet
    if is_stationary:
        pyramid = stationary_wavelet(signal, wavelet, levels, axes, workers=workers)
    else:
        pyramid = discrete_wavelet(signal, wavelet, levels, mode, axes, workers)
    gains = _gains(wavelet, len(pyramid.detail), len(pyramid.axes))
    if not gains:
        return pyramid.approx.copy()
    if given is None:
        finest = band_names(len(pyramid.axes))["d" * len(pyramid.axes)]
        given = noise_deviation(pyramid.detail[0][finest]) / gains[0][finest]
    count = np.size(signal)
    for bands, norms in zip(pyramid.detail, gains, strict=True):
        for name, band in bands.items():
            noise = given * norms[name]
            if rule == "visu":
                threshold = universal_threshold(count, noise)
            else:
                threshold = (bayes_threshold if rule == "bayes" else sure_threshold)(band, noise)
            band[...] = shrink(band, threshold, kind)
    return pyramid.inverse(workers)


def _gains(wavelet: str, levels: int, axes: int) -> list[dict[str, float]]:
    """Return the norms of the filters of all bands: the standard deviations of details of white noise of variance 1."""
    filters = wavelet_filters(wavelet)
    found, smooth = [], np.ones(1)
    for level in range(levels):
        low, high = (np.zeros((len(taps) - 1) * 2**level + 1) for taps in (filters.low, filters.high))
        low[:: 2**level], high[:: 2**level] = filters.low, filters.high
        norms = {"a": np.linalg.norm(np.convolve(smooth, low)), "d": np.linalg.norm(np.convolve(smooth, high))}
        smooth = np.convolve(smooth, low)
        found.append({name: float(np.prod([norms[k] for k in word])) for word, name in band_names(axes).items()})
    return found


def _checked(coefficients: ArrayLike) -> Reals:
    values = real_array(coefficients, "coefficients")
    if values.size == 0:
        raise ValueError(f"coefficients: shape {values.shape}; expected at least one number")
    if not np.isfinite(values).all():
        raise ValueError("coefficients: a number is not finite; expected finite numbers")
    return values


def _deviation(sigma: float) -> float:
    noise = finite_number(sigma, "sigma")
    if noise < 0:
        raise ValueError(f"sigma: {noise}; expected 0 or more")
    return noise


def _threshold(value: Any, name: str, values: NDArray[Any]) -> Reals:
    array = real_array(value, name)
    if not (array >= 0).all() or not np.isfinite(array).all():
        raise ValueError(f"{name}: {array.min()}; expected finite numbers, 0 or more")
    return array.astype(values.real.dtype, copy=False)
