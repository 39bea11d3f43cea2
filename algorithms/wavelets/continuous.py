"""The continuous wavelet transform of signals with real wavelets and with the analytic Morlet wavelet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, finite_number, real_array
from .discrete import check_finite

_MORLET = 5.0
"""Frequency of the Morlet wavelet, in radians per unit of time."""
_REACH = 8.0
"""Time, in units of the scale, beyond which wavelets are below 1e-13."""
_COVERED = 1e-6
"""Frequencies are covered where the sum of squared filters exceeds this fraction of its maximum."""


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
"""Fourier transforms of the wavelets, all of which are real."""


@dataclass(frozen=True)
class ContinuousWavelet:
    """Result of `continuous_wavelet`.

    Attributes
    ----------
    padded : array, (..., A, P)
        Coefficients at A scales: for the N samples of the signal and, with mode "zero", for positions beyond its end.
    filters : array, (A, P)
        The factors of the spectrum.
    size : int
        N.
    """

    padded: NDArray[Any]
    filters: NDArray[np.float64]
    size: int

    @property
    def coefficients(self) -> NDArray[Any]:
        """The coefficients at the samples of the signal, (..., A, N); a view of `padded`."""
        return self.padded[..., : self.size]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """The frequencies, (P,) as in ``numpy.fft.fftfreq``, where some filter is not zero; 0 is never covered."""
        weight = self._weight()
        return np.asarray(weight > _COVERED * weight.max())

    def inverse(self, workers: int | None = None) -> Reals:
        """Return the part of the signal at the covered frequencies, (..., N), to 1e-10 of the largest number.

        It is the least-squares solution: its coefficients are the nearest to these coefficients.

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
        # Analytic wavelets respond to one sign of frequencies; a real signal has both.
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
    """Compute the continuous wavelet transform ``W(a, b) = sum f(x) psi((x - b) / a) / sqrt(a)``.

    Parameters
    ----------
    signal : array_like, (..., N)
        Real numbers. float32 is kept; integers are converted to float64.
    scales : sequence of float
        A positive scales a, in samples.
    wavelet : str
        "mexican_hat", of norm 1: ``2 / (sqrt(3) pi**(1/4)) (1 - t**2) exp(-t**2 / 2)``; "morlet":
        ``cos(5 t) exp(-t**2 / 2)``; "analytic_morlet": the same with ``exp(5 i t)``, without negative frequencies.
    mode : str
        "zero", with zeros outside the signal, or "periodic".
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    ContinuousWavelet
        Complex for "analytic_morlet" and real for the others.

    Raises
    ------
    TypeError, ValueError
        If `signal` is not an array of finite real numbers, if scales are not positive, or if a name is unknown.

    Notes
    -----
    "mexican_hat" and "morlet" are "mexh" and "morl" of PyWavelets, which averages the wavelets over a sample and shifts
    them by half a sample; with the signal averaged and shifted accordingly, results agree to 2e-3. The filters are the
    Fourier transforms of the wavelets up to half a cycle per sample; higher frequencies of wavelets of small scale are
    cut off.
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
    """Return the constant ``C = integral of |psi^(w)|**2 / |w|`` over all w.

    It normalizes the energy of a transform: the integral of ``W(a, b)**2 da / a**2 db`` over all positive scales is
    ``C / 2`` times the energy of the signal.

    Raises
    ------
    ValueError
        If the name is unknown.
    """
    if wavelet not in WAVELETS:
        raise ValueError(f"wavelet: {wavelet!r}; expected {', '.join(map(repr, WAVELETS))}")
    # The integrand is smooth in log w and decays at both ends, so the trapezoidal rule is as accurate as any other.
    steps = np.linspace(-40, 4, 40001)
    values = WAVELETS[wavelet](np.exp(steps)) ** 2 + WAVELETS[wavelet](-np.exp(steps)) ** 2
    return float(values.sum() * (steps[1] - steps[0]))
