"""Power of speech in bands of the Bark or mel scale over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, as_given, finite, finite_number, positive_number, real_array, whole_number

_CLIPPED = 0.01
"""Share of samples at the largest amplitude, in runs of three and more, from which a recording counts as clipped."""


def bark_image(
    samples: ArrayLike, rate: float, bands: int = 20, scale: str = "bark", frame: float = 0.0256, step: float = 0.01
) -> Reals:
    """Compute the image of speech: the power in bands over time, in decibels.

    Parameters
    ----------
    samples : array_like, (N,)
        Real numbers, usually from -1 to 1; one channel.
    rate : float
        Samples per second, at least 4000.
    bands : int
        Number of bands from 0 to half the rate.
    scale : str
        "bark" or "mel", see `band_filters`.
    frame, step : float
        Length of frames, and time from one to the next, in seconds; rounded to samples.

    Returns
    -------
    array, (bands, frames)
        ``10 log10`` of `band_powers`, limited from below by 1e-10 and by 80 decibels under the largest number.

    Raises
    ------
    TypeError, ValueError
        If the samples are integers, not finite, of several channels, shorter than a frame, silent or clipped, or if
        options are out of range.
    """
    power = np.maximum(band_powers(samples, rate, bands, scale, frame, step), 1e-10)
    level = 10 * np.log10(power)
    return np.asarray(np.maximum(level, level.max() - 80))


def band_powers(
    samples: ArrayLike, rate: float, bands: int = 20, scale: str = "bark", frame: float = 0.0256, step: float = 0.01
) -> Reals:
    """Compute the power of speech in bands over time; arguments and errors are those of `bark_image`.

    Returns
    -------
    array, (bands, frames)
        Frame k is centred at sample ``k step``, with zeros outside the recording, and weighted by a periodic Hann
        window; the squared amplitudes of its discrete Fourier transform are weighted by `band_filters`.
    """
    array, per_second = _checked(samples, rate)
    length, hop = (
        max(round(positive_number(value, name) * per_second), 1) for value, name in ((frame, "frame"), (step, "step"))
    )
    if len(array) < length:
        raise ValueError(f"samples: {len(array)}; expected at least {length}, the length of a frame")
    padded = np.pad(array, length // 2)
    windows = np.lib.stride_tricks.sliding_window_view(padded, length)[::hop]
    hann = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / length)
    power = np.abs(np.fft.rfft(windows * hann)) ** 2
    return np.asarray(band_filters(per_second, length, bands, scale) @ power.T)


def band_filters(rate: float, length: int, bands: int = 20, scale: str = "bark") -> NDArray[np.float64]:
    """Compute triangular filters whose corners are equally spaced on a scale from 0 to half the rate.

    Parameters
    ----------
    rate : float
    length : int
        Number of samples of a frame.
    bands : int
    scale : str
        "bark": ``26.81 f / (1960 + f) - 0.53`` (Traunmüller). "mel": linear up to 1000 Hz, logarithmic above (Slaney).

    Returns
    -------
    array, (bands, length // 2 + 1)
        Of area 1 over frequencies in Hz.

    Raises
    ------
    ValueError
        If the scale is another one, or a band contains none of the frequencies.
    """
    if scale not in ("bark", "mel"):
        raise ValueError(f"scale: {scale!r}; expected 'bark' or 'mel'")
    if isinstance(bands, bool) or not isinstance(bands, (int, np.integer)) or bands < 1:
        raise ValueError(f"bands: {bands!r}; expected a whole number, 1 or more")
    positive_number(rate, "rate")
    whole_number(length, "length", 2)
    to, back = (_bark, _hertz_of_bark) if scale == "bark" else (_mel, _hertz_of_mel)
    low, high = to(np.array([0.0, rate / 2]))
    corners = back(np.linspace(low, high, bands + 2))
    f = np.arange(length // 2 + 1) * (rate / length)
    left, middle, right = (corners[k : k + bands, None] for k in range(3))
    weights = np.maximum(np.minimum((f - left) / (middle - left), (right - f) / (right - middle)), 0)
    if not weights.any(1).all():
        raise ValueError(f"bands: {bands} at frames of {length} samples; some contain no frequency; expected fewer")
    return np.asarray(weights * (2 / (right - left)))


def _bark(f: Reals) -> Reals:
    return np.asarray(26.81 * f / (1960 + f) - 0.53)


def _hertz_of_bark(z: Reals) -> Reals:
    return np.asarray(1960 * (z + 0.53) / (26.28 - z))


def _mel(f: Reals) -> Reals:
    return np.where(f < 1000, f * 3 / 200, 15 + 27 * np.log(np.maximum(f, 1000) / 1000) / np.log(6.4))


def _hertz_of_mel(m: Reals) -> Reals:
    return np.where(m < 15, m * 200 / 3, 1000 * np.exp((m - 15) * np.log(6.4) / 27))


def _checked(samples: ArrayLike, rate: float) -> tuple[Reals, float]:
    """Return samples of one channel, and their rate."""
    given = as_given(samples, "samples")
    if given.dtype.kind in "iub" and given.size:
        raise TypeError("samples: whole numbers; expected numbers from -1 to 1: divide by 32768 for 16 bits")
    array, per_second = real_array(samples, "samples"), finite_number(rate, "rate")
    if array.ndim != 1:
        raise ValueError(f"samples: shape {array.shape}; expected (N,), one channel; take one, or their mean")
    if array.size < 2:
        raise ValueError(f"samples: {array.size}; expected a recording of at least one frame")
    if per_second < 4000:
        raise ValueError(f"rate: {per_second}; expected at least 4000 samples per second")
    size = np.abs(finite(array, "samples"))
    if size.max() == 0:
        raise ValueError("samples: all are 0; expected a recording that is not silent")
    top = size == size.max()
    runs = top[:-2] & top[1:-1] & top[2:]
    if runs.sum() > _CLIPPED * array.size:
        raise ValueError(f"samples: {runs.sum()} runs at the largest amplitude; expected a recording without clipping")
    return array, per_second
