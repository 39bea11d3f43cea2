"""Continuous Clifford wavelets of fields in the plane, in space and in six dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, positive_number, real_array
from ..precision import SINGLE
from .clifford_wavelet import covered_by, nearest_field
from .discrete import check_finite
from .pseudoscalar_fourier import ipseudoscalar_fft, pseudoscalar_fft
from .sharing import Progress, steps


@dataclass(frozen=True)
class CliffordWaveletND:
    """Result of `clifford_wavelet_nd`.

    Attributes
    ----------
    coefficients : array, (A, R, N1, ..., Nn, 2**n)
        For each of A scales and R orientations, elements of G(n).
    filters : array, (A, R, N1, ..., Nn)
        The factors of the spectrum.
    """

    coefficients: Reals
    filters: NDArray[np.float64]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """The frequencies, (N1, ..., Nn), at which some filter does not vanish."""
        return covered_by(self.filters)

    def inverse(self, workers: int | None = None) -> Reals:
        """Return the part of the field at the covered frequencies, (N1, ..., Nn, 2**n), to 1e-10 of the largest number.

        It is the least-squares solution: its coefficients are the nearest to these coefficients.

        Parameters
        ----------
        workers : int, optional
            As in `scipy.fft`.

        Returns
        -------
        array, (N1, ..., Nn, 2**n)
        """
        return nearest_field(self.coefficients, self.filters, pseudoscalar_fft, ipseudoscalar_fft, workers)


def clifford_wavelet_nd(
    field: ArrayLike,
    scales: Sequence[float],
    turns: ArrayLike,
    frequency: float = 1.5,
    sigma: Sequence[float] | float = 2.0,
    progress: Progress | None = None,
    workers: int | None = None,
) -> CliffordWaveletND:
    """Compute the wavelet transform of a periodic field with rotated and scaled Gabor wavelets in 2, 3 or 6 dimensions.

    Parameters
    ----------
    field : array_like, (N1, ..., Nn, 2**n)
        Elements of G(n), coefficients as in `pseudoscalar_fft`. float32 is kept; integers are converted to float64.
    scales : sequence of float
        A positive scales a; the wavelet is a times as wide and its frequency is divided by a.
    turns : array_like, (R, n, n)
        Orthogonal matrices that rotate the wavelet, for example from ``vga2.rotor_to_matrix`` or
        ``vga3.rotor_to_matrix``.
    frequency : float
        Frequency of the wavelet of scale 1, along e1, in radians per pixel.
    sigma : float or sequence of n floats
        Standard deviations of its Gaussian along the axes, in pixels.
    progress : function of (done, total), optional
        Called after each scale and orientation.
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    CliffordWaveletND

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real numbers of these shapes, if matrices are not orthogonal, or if a scale, a sigma
        or the frequency is not positive.

    Notes
    -----
    ``T(a, r, b) = sum f(x) ~psi(r^-1 (x - b) / a) a**(-n/2)`` with the Clifford-Gabor wavelet
    ``psi(x) = g(x) (exp(I w0 x1) - c)`` and the pseudoscalar I (Mawardi, Ashino and Vaillancourt, *Int. J. Wavelets,
    Multiresolution and Information Processing* 9:67, 2011). The field is the left factor because in even dimensions I
    commutes with even elements only. Wavelets are even elements, so right-sided spectra can be multiplied in every
    dimension. In space, `clifford_wavelet` computes the same transform with rotors.
    """
    array = real_array(field, "field", (-1, -1), "a field N1 ... Nn 2**n")
    n = array.ndim - 1
    if n not in (2, 3, 6) or array.shape[-1] != 2**n:
        raise ValueError(f"field: shape {array.shape}; expected a field N1 ... Nn 2**n in n = 2, 3 or 6 dimensions")
    check_finite(array, "field")
    matrices = real_array(turns, "turns", (n, n), "orthogonal matrices").astype(float).reshape(-1, n, n)
    check_finite(matrices, "turns")
    if np.abs(matrices @ np.swapaxes(matrices, 1, 2) - np.eye(n)).max() > SINGLE:
        raise ValueError("turns: not orthogonal; expected matrices of rotations")
    sizes = [positive_number(a, "scales") for a in scales]
    given = [sigma] * n if isinstance(sigma, (int, float, np.integer, np.floating)) else list(sigma)
    widths = np.array([positive_number(s, "sigma") for s in given])
    if not sizes or len(widths) != n:
        raise ValueError(f"scales, sigma: {len(sizes)} and {len(widths)}; expected at least one scale and {n} sigmas")
    centre = np.zeros(n)
    centre[0] = positive_number(frequency, "frequency")
    w = np.stack(np.meshgrid(*(2 * np.pi * np.fft.fftfreq(m) for m in array.shape[:-1]), indexing="ij"), -1)
    spectrum = pseudoscalar_fft(array, workers=workers)
    filters = np.empty((len(sizes), len(matrices), *array.shape[:-1]))
    coefficients = np.empty((*filters.shape, 2**n), array.dtype)
    step_done = steps(progress, len(sizes) * len(matrices))
    for k, m in np.ndindex(filters.shape[:2]):
        # The frequency rotated back.
        there = sizes[k] * w @ matrices[m]
        about, around = (((widths * (there - c)) ** 2).sum(-1) / 2 for c in (centre, 0 * centre))
        constant = ((widths * centre) ** 2).sum() / 2
        filters[k, m] = sizes[k] ** (n / 2) * (np.exp(-about) - np.exp(-around - constant))
        product = spectrum * filters[k, m][..., None].astype(array.dtype)
        coefficients[k, m] = ipseudoscalar_fft(product, workers=workers)
        step_done()
    return CliffordWaveletND(coefficients, filters)
