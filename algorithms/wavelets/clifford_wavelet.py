"""The continuous wavelet transform of fields of multivectors in space, over rotations, scales and shifts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import vga3

from ..arguments import Reals, positive_number, real_array
from ..precision import SINGLE
from .clifford_fourier import clifford_fft, iclifford_fft
from .discrete import check_finite
from .sharing import Progress, steps


@dataclass(frozen=True)
class CliffordWavelet:
    """Result of `clifford_wavelet`.

    Attributes
    ----------
    coefficients : array, (A, R, L, M, N, 8)
        For each of A scales and R rotations, elements of G(3).
    filters : array, (A, R, L, M, N)
        The factors of the spectrum.
    """

    coefficients: Reals
    filters: NDArray[np.float64]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """The frequencies, (L, M, N), at which some filter does not vanish."""
        return covered_by(self.filters)

    def inverse(self, workers: int | None = None) -> Reals:
        """Return the part of the field at the covered frequencies, (L, M, N, 8).

        It is the least-squares solution: its coefficients are the nearest to these coefficients.

        Parameters
        ----------
        workers : int, optional
            As in `scipy.fft`.

        Returns
        -------
        array, (L, M, N, 8)
        """
        return nearest_field(self.coefficients, self.filters, clifford_fft, iclifford_fft, workers)


def covered_by(filters: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return the frequencies at which some of the filters, stacked along the first two axes, do not vanish."""
    weight = (filters**2).sum((0, 1))
    return np.asarray(weight > SINGLE * weight.max())


def nearest_field(
    coefficients: Reals,
    filters: NDArray[np.float64],
    forth: Callable[..., Reals],
    back: Callable[..., Reals],
    workers: int | None,
) -> Reals:
    """Return the least-squares inverse at the covered frequencies, for a transform `forth` and its inverse `back`."""
    weight, covered = (filters**2).sum((0, 1)), covered_by(filters)
    spectrum = np.zeros(coefficients.shape[2:], coefficients.dtype)
    for place in np.ndindex(filters.shape[:2]):
        spectrum += forth(coefficients[place], workers=workers) * filters[place][..., None].astype(spectrum.dtype)
    spectrum *= np.where(covered, 1 / np.where(covered, weight, 1), 0)[..., None]
    return back(spectrum, workers=workers)


def clifford_wavelet(
    field: ArrayLike,
    scales: Sequence[float],
    rotors: ArrayLike,
    frequency: float = 1.5,
    sigma: tuple[float, float, float] = (2.0, 2.0, 2.0),
    progress: Progress | None = None,
    workers: int | None = None,
) -> CliffordWavelet:
    """Compute the wavelet transform of a periodic field in space with rotated and scaled Gabor wavelets.

    Parameters
    ----------
    field : array_like, (L, M, N, 8)
        Elements of G(3), coefficients 1 e1 e2 e3 e12 e13 e23 e123. float32 is kept; integers are converted to float64.
    scales : sequence of float
        A positive scales a; the wavelet is a times as wide and its frequency is divided by a.
    rotors : array_like, (R, 4)
        Unit rotors 1 e12 e13 e23, as in `generated.vga3`, that rotate the wavelet. The array axes are e1, e2 and e3.
    frequency : float
        Frequency of the wavelet of scale 1, along e1, in radians per pixel.
    sigma : (float, float, float)
        Standard deviations of its Gaussian along e1, e2 and e3, in pixels.
    progress : function of (done, total), optional
        Called after each of the A R wavelets.
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    CliffordWavelet

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real numbers of these shapes, or if a scale, a sigma or the frequency is not
        positive.

    Notes
    -----
    ``T(a, r, b) = sum f(x) ~psi(R^-1 (x - b) / a) a**(-3/2)``, where R is the rotation of r, with the Clifford-Gabor
    wavelet ``psi(x) = g(x) (exp(e123 w0 x1) - c)``, whose constant c makes its sum 0 (Mawardi and Hitzer, *Int. J.
    Wavelets, Multiresolution and Information Processing* 4:61, 2006). It is computed with the Clifford-Fourier
    transform, in which the wavelet is real at every frequency: a difference of two Gaussians.
    """
    array = real_array(field, "field", (-1, -1, -1, 8), "fields L M N 8 of G(3)")
    if array.ndim != 4:
        raise ValueError(f"field: shape {array.shape}; expected one field L M N 8")
    check_finite(array, "field")
    unit_rotors = real_array(rotors, "rotors", (4,), "unit rotors").astype(float).reshape(-1, 4)
    check_finite(unit_rotors, "rotors")
    if np.abs(np.linalg.norm(unit_rotors, axis=-1) - 1).max() > SINGLE:
        raise ValueError("rotors: not of norm 1; expected unit rotors, such as of vga3.rotor_from_axis_angle")
    sizes = [positive_number(a, "scales") for a in scales]
    centre = np.array([positive_number(frequency, "frequency"), 0, 0])
    widths = np.array([positive_number(s, "sigma") for s in sigma])
    if not sizes or widths.shape != (3,):
        raise ValueError(f"scales, sigma: {len(sizes)} and {len(widths)}; expected at least one scale and three sigmas")
    grid = [2 * np.pi * np.fft.fftfreq(n) for n in array.shape[:3]]
    w = np.stack(np.meshgrid(*grid, indexing="ij"), -1)
    spectrum, step_done = clifford_fft(array, workers=workers), steps(progress, len(sizes) * len(unit_rotors))
    filters = np.empty((len(sizes), len(unit_rotors), *array.shape[:3]))
    coefficients = np.empty((*filters.shape, 8), array.dtype)
    for k, a in enumerate(sizes):
        for n, rotor in enumerate(unit_rotors):
            filters[k, n] = a**1.5 * _gabor(a * vga3.rotate_vector_back(rotor, w), centre, widths)
            product = spectrum * filters[k, n][..., None].astype(array.dtype)
            coefficients[k, n] = iclifford_fft(product, workers=workers)
            step_done()
    return CliffordWavelet(coefficients, filters)


def _gabor(w: Reals, centre: Reals, widths: Reals) -> Reals:
    """Return the spectrum of the wavelet: a Gaussian about its frequency minus one about 0, which makes it 0 at 0."""
    about, around = (((widths * (w - c)) ** 2).sum(-1) / 2 for c in (centre, 0 * centre))
    constant = ((widths * centre) ** 2).sum() / 2
    return np.asarray(np.exp(-about) - np.exp(-around - constant))
