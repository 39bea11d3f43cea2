"""The continuous wavelet transform of signals with real and with complex wavelets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, finite_number, real_array
from ..precision import SINGLE
from .discrete import check_finite
from .mother_wavelets import mother_wavelet


@dataclass(frozen=True)
class ContinuousWavelet:
    """Result of `continuous_wavelet`.

    Attributes
    ----------
    padded : array, (..., A, P)
        Coefficients at A scales: for the N samples of the signal and, with mode "zero", for positions beyond its end.
    filters : array, (A, P)
        The factors of the spectrum, complex where a wavelet is not symmetric.
    size : int
        N.
    """

    padded: NDArray[Any]
    filters: NDArray[Any]
    size: int

    @property
    def coefficients(self) -> NDArray[Any]:
        """The coefficients at the samples of the signal, (..., A, N); a view of `padded`."""
        return self.padded[..., : self.size]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """The frequencies, (P,) as in ``numpy.fft.fftfreq``, where some filter is not zero; 0 is never covered."""
        weight = self._weight()
        return np.asarray(weight > SINGLE * weight.max())

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
        spectrum = (scipy.fft.fft(self.padded, axis=-1, workers=workers) * self.filters.conj()).sum(-2)
        opposite = np.roll(spectrum[..., ::-1], 1, -1)
        weight = self._weight()
        share = np.where(self.covered, 1 / np.where(self.covered, weight, 1), 0)
        # Analytic wavelets respond to one sign of frequencies; a real signal has both.
        result = scipy.fft.ifft((spectrum + opposite.conj()) * share, workers=workers).real
        return np.asarray(result[..., : self.size], self.padded.real.dtype)

    def _weight(self) -> NDArray[np.float64]:
        weight = (np.abs(self.filters) ** 2).sum(0)
        return np.asarray(weight + np.roll(weight[::-1], 1))


def continuous_wavelet(
    signal: ArrayLike,
    scales: Sequence[float],
    wavelet: str = "morlet",
    mode: str = "zero",
    workers: int | None = None,
) -> ContinuousWavelet:
    """Compute the continuous wavelet transform ``W(a, b) = sum f(x) psi*((x - b) / a) / sqrt(a)``; `cwt` of PyWavelets.

    Parameters
    ----------
    signal : array_like, (..., N)
        Real numbers. float32 is kept; integers are converted to float64.
    scales : sequence of float
        A positive scales a, in samples.
    wavelet : str
        A name of `mother_wavelet`: "mexican_hat", "morlet", "analytic_morlet", "gaus1" to "gaus8", "cgau1" to "cgau8",
        "cmorB-C", "shanB-C" or "fbspM-B-C" with numbers for the letters, as in "cmor1.5-1.0".
    mode : str
        "zero", with zeros outside the signal, or "periodic".
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    ContinuousWavelet
        Real for "mexican_hat", "morlet" and "gaus", and complex for the others.

    Raises
    ------
    TypeError, ValueError
        If `signal` is not an array of finite real numbers, if scales are not positive, or if a name is unknown.

    Notes
    -----
    "mexican_hat" and "morlet" are "mexh" and "morl" of PyWavelets, which averages all wavelets over a sample and shifts
    them by half a sample; with the signal averaged and shifted accordingly, results agree to 2e-3. The filters are the
    Fourier transforms of the wavelets up to half a cycle per sample; higher frequencies of wavelets of small scale are
    cut off. Only "shan" and "fbsp", which decay slowly, are sampled in time if the mode is "zero".
    """
    array = real_array(signal, "signal", (-1,), "signals N")
    check_finite(array, "signal")
    mother = mother_wavelet(wavelet)
    if mode not in ("zero", "periodic"):
        raise ValueError(f"mode: {mode!r}; expected 'zero' or 'periodic'")
    sizes = np.array([finite_number(a, "scales") for a in scales])
    if sizes.size == 0 or not (sizes > 0).all():
        raise ValueError(f"scales: {list(scales)!r}; expected at least one number, all positive")
    count = array.shape[-1]
    length = count
    if mode == "zero":
        beyond = count - 1 if mother.values else int(np.ceil(2 * mother.reach * sizes.max()))
        length = int(scipy.fft.next_fast_len(count + beyond))
    roots = np.sqrt(sizes)[:, None]
    if mode == "zero" and mother.values:
        lags = np.fft.fftfreq(length, 1 / length)
        filters = scipy.fft.fft(mother.values(-lags / sizes[:, None]).conj() / roots, workers=workers)
    else:
        # The conjugate and mirrored wavelet has the conjugate transform.
        filters = roots * mother.spectrum(sizes[:, None] * (2 * np.pi * np.fft.fftfreq(length))).conj()
    if not mother.is_complex and length % 2 == 0:
        filters[:, length // 2] = filters[:, length // 2].real
    factors = filters.astype(np.result_type(array.dtype, np.complex64) if filters.dtype.kind == "c" else array.dtype)
    spectrum = scipy.fft.fft(array, length, workers=workers)[..., None, :]
    if mother.is_complex:
        return ContinuousWavelet(scipy.fft.ifft(spectrum * factors, overwrite_x=True, workers=workers), filters, count)
    half = length // 2 + 1
    product = spectrum[..., :half] * factors[:, :half]
    return ContinuousWavelet(scipy.fft.irfft(product, length, overwrite_x=True, workers=workers), filters, count)


def admissibility(wavelet: str) -> float:
    """Return the constant ``C = integral of |psi^(w)|**2 / |w|`` over all w.

    It normalizes the energy of a transform: the integral of ``W(a, b)**2 da / a**2 db`` over all positive scales is
    ``C / 2`` times the energy of the signal.

    Raises
    ------
    ValueError
        If the name is unknown, or if the wavelet has frequencies of both signs around 0, for which C is infinite.
    """
    mother = mother_wavelet(wavelet)
    if mother.band:
        low, high = mother.band
        if low <= 0:
            raise ValueError(f"wavelet: {wavelet!r}, whose constant is infinite; expected 2 C > B")
        return float(scipy.integrate.quad(lambda w: np.abs(mother.spectrum(np.array(w))) ** 2 / w, low, high)[0])
    # The integrand is smooth in log w and decays at both ends, so the trapezoidal rule is as accurate as any other.
    steps = np.linspace(-40, np.log(mother.highest), 40001)
    values = np.abs(mother.spectrum(np.exp(steps))) ** 2 + np.abs(mother.spectrum(-np.exp(steps))) ** 2
    return float(values.sum() * (steps[1] - steps[0]))
