"""The continuous wavelet transform of signals with real wavelets, and the analytic one of Morlet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, finite_number, real_array
from .discrete import check_finite

_MORLET = 5.0
"""Radians per unit of time of Morlet's wave."""
_REACH = 8.0
"""Where wavelets are below 1e-13, in units of time at scale 1."""
_COVERED = 1e-6
"""Frequencies count where the sum of squared filters is larger than this part of its largest value."""


def _mexican_hat(w: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.sqrt(8 / 3) * np.pi**0.25 * w**2 * np.exp(-(w**2) / 2))


def _morlet(w: NDArray[np.float64]) -> NDArray[np.float64]:
    both = np.exp(-((w - _MORLET) ** 2) / 2) + np.exp(-((w + _MORLET) ** 2) / 2)
    return np.asarray(np.sqrt(np.pi / 2) * both)


def _analytic_morlet(w: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(w > 0, np.sqrt(2 * np.pi) * np.exp(-((w - _MORLET) ** 2) / 2), 0)


WAVELETS: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    "mexican_hat": _mexican_hat,
    "morlet": _morlet,
    "analytic_morlet": _analytic_morlet,
}
"""Fourier transforms of the wavelets, which are all real."""


@dataclass(frozen=True)
class ContinuousWavelet:
    """What `continuous_wavelet` gives.

    Attributes
    ----------
    padded : array, (..., A, P)
        Coefficients at A scales: for the N places of the signal and, with zeros outside, for places beyond it.
    filters : array, (A, P)
        What the spectrum was multiplied by.
    size : int
        N.
    """

    padded: NDArray[Any]
    filters: NDArray[np.float64]
    size: int

    @property
    def coefficients(self) -> NDArray[Any]:
        """Those at the places of the signal, (..., A, N); a view of `padded`."""
        return self.padded[..., : self.size]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """The frequencies, (P,) as of ``numpy.fft.fftfreq``, that some filter sees. 0 is never among them."""
        weight = self._weight()
        return np.asarray(weight > _COVERED * weight.max())

    def inverse(self, workers: int | None = None) -> Reals:
        """The part of the signal at the covered frequencies, (..., N); 1e-10 of the largest number.

        Of all signals, its coefficients are nearest to those that are here.

        Parameters
        ----------
        workers : int, optional
            As in `scipy.fft`.

        Returns
        -------
        array, (..., N)
        """
        spectrum = (scipy.fft.fft(self.padded, axis=-1, workers=workers) * self.filters).sum(-2)
        opposite = np.roll(spectrum[..., ::-1], 1, -1)
        weight = self._weight()
        share = np.where(self.covered, 1 / np.where(self.covered, weight, 1), 0)
        # The filters of analytic wavelets see one sign of frequencies; a real signal has the other too.
        result = scipy.fft.ifft((spectrum + opposite.conj()) * share, workers=workers).real
        return np.asarray(result[..., : self.size], self.padded.real.dtype)

    def _weight(self) -> NDArray[np.float64]:
        weight = (self.filters**2).sum(0)
        return np.asarray(weight + np.roll(weight[::-1], 1))


def continuous_wavelet(
    signal: ArrayLike,
    scales: Sequence[float],
    wavelet: str = "morlet",
    mode: str = "zero",
    workers: int | None = None,
) -> ContinuousWavelet:
    """The continuous wavelet transform ``W(a, b) = sum f(x) psi((x - b) / a) / sqrt(a)``.

    Parameters
    ----------
    signal : array_like, (..., N)
        Real numbers. float32 stays; integers become float64.
    scales : sequence of float
        A positive numbers a, in samples.
    wavelet : str
        "mexican_hat", of norm 1: ``2 / (sqrt(3) pi**(1/4)) (1 - t**2) exp(-t**2 / 2)``; "morlet":
        ``cos(5 t) exp(-t**2 / 2)``; "analytic_morlet": that with ``exp(5 i t)``, and without negative frequencies.
    mode : str
        "zero": zeros outside; "periodic".
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    ContinuousWavelet
        Complex for "analytic_morlet", and real for the others.

    Raises
    ------
    TypeError, ValueError
        Where `signal` is not an array of finite real numbers, for scales that are not positive, and unknown names.

    Notes
    -----
    "mexican_hat" and "morlet" are "mexh" and "morl" of PyWavelets, which averages them over a sample and is half a
    sample late: of a signal so averaged and moved, results agree to 2e-3. Filters are the Fourier transforms of the
    wavelets up to half a cycle per sample; what wavelets of small scales have beyond that is cut off.
    """
    array = real_array(signal, "signal", (-1,), "signals N")
    check_finite(array, "signal")
    if wavelet not in WAVELETS:
        raise ValueError(f"wavelet: {wavelet!r}; expected {', '.join(map(repr, WAVELETS))}")
    if mode not in ("zero", "periodic"):
        raise ValueError(f"mode: {mode!r}; expected 'zero' or 'periodic'")
    sizes = np.array([finite_number(a, "scales") for a in scales])
    if sizes.size == 0 or not (sizes > 0).all():
        raise ValueError(f"scales: {list(scales)!r}; expected at least one number, all positive")
    count = array.shape[-1]
    length = count
    if mode == "zero":
        length = int(scipy.fft.next_fast_len(count + int(np.ceil(2 * _REACH * sizes.max()))))
    w = 2 * np.pi * np.fft.fftfreq(length)
    # The conjugate and mirrored wavelet has the same real transform.
    filters = np.sqrt(sizes)[:, None] * WAVELETS[wavelet](sizes[:, None] * w)
    spectrum = scipy.fft.fft(array, length, workers=workers)[..., None, :]
    if wavelet == "analytic_morlet":
        product = spectrum * filters.astype(array.dtype)
        return ContinuousWavelet(scipy.fft.ifft(product, overwrite_x=True, workers=workers), filters, count)
    half = length // 2 + 1
    product = spectrum[..., :half] * filters[:, :half].astype(array.dtype)
    return ContinuousWavelet(scipy.fft.irfft(product, length, overwrite_x=True, workers=workers), filters, count)


def admissibility(wavelet: str) -> float:
    """The constant ``C = integral of |psi^(w)|**2 / |w|`` over all w, by which the energy of a transform is divided.

    The integral of ``W(a, b)**2 da / a**2 db`` over all positive scales is ``C / 2`` times the energy of the signal.

    Raises
    ------
    ValueError
        For an unknown name.
    """
    if wavelet not in WAVELETS:
        raise ValueError(f"wavelet: {wavelet!r}; expected {', '.join(map(repr, WAVELETS))}")
    # In the logarithm of w the integrand is smooth and falls off at both ends: equal steps are as exact as any rule.
    steps = np.linspace(-40, 4, 40001)
    values = WAVELETS[wavelet](np.exp(steps)) ** 2 + WAVELETS[wavelet](-np.exp(steps)) ** 2
    return float(values.sum() * (steps[1] - steps[0]))
