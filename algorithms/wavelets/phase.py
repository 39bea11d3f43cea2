"""Quaternionic Gabor filters and the phases of quaternions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.ndimage
from numpy.typing import ArrayLike, NDArray

from generated import quaternion

from ..arguments import Reals, finite_number, real_array
from .checks import positive_number
from .discrete import check_finite
from .sharing import in_threads

_REACH = 4.0
"""Gabor filters end at so many standard deviations, where the Gaussian is 3e-4."""


class Phase(NamedTuple):
    """The polar form ``q = amplitude exp(i phi) exp(k psi) exp(j theta)``; all arrays have one shape.

    Attributes
    ----------
    amplitude : array
    phi, theta, psi : array
        In [-pi, pi], [-pi/2, pi/2] and [-pi/4, pi/4].
    singular : array of bool
        Where ``psi`` is pi/4 or -pi/4 to rounding: q says only what ``phi - theta`` or ``phi + theta`` is.
    """

    amplitude: Reals
    phi: Reals
    theta: Reals
    psi: Reals
    singular: NDArray[np.bool_]


def quaternion_phase(q: ArrayLike) -> Phase:
    """Amplitude and the three phases of quaternions.

    Parameters
    ----------
    q : array_like, (..., 4)
        Quaternions (w, x, y, z). All phases of 0 are 0.

    Returns
    -------
    Phase

    Raises
    ------
    TypeError, ValueError
        Where `q` is not an array of real numbers of that shape.

    Notes
    -----
    Buelow, *Hypercomplex spectral signal representations*, thesis, Kiel 1999. `generated.quaternion.from_phases` gives
    q again to 4 units of the last place of the amplitude, in the singular set too.
    """
    array = real_array(q, "q", (4,), "quaternions")
    amplitude, phi, theta, psi, cosine = quaternion.to_phases(array)
    return Phase(amplitude, phi, theta, psi, np.asarray(cosine < 16 * np.finfo(array.dtype).eps))


def gabor_bank(
    image: ArrayLike,
    frequencies: Sequence[tuple[float, float]],
    sigma: float | Sequence[float] = 4.0,
    balanced: bool = False,
    workers: int | None = None,
) -> Reals:
    """Images filtered by quaternionic Gabor functions ``g(x, y) exp(i 2 pi u x) exp(j 2 pi v y)``.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images; x runs along M and y along N. Beyond their edges they go on mirrored.
    frequencies : sequence of (u, v)
        In cycles per pixel, from 0 to 1/2.
    sigma : float or sequence of float
        Standard deviations of the Gaussians g, of sum 1, in pixels; one for all or one for each frequency.
    balanced : bool
        Whether the cosines lose a part of the Gaussian, so that their sum is 0 and brightness does not count.
    workers : int, optional
        How many threads share the work, counted as in `scipy.fft`; the result is the same.

    Returns
    -------
    array, (..., K, M, N, 4)
        Quaternions (w, x, y, z) for each of K frequencies. The complex Gabor filters of (u, v) and (u, -v) are
        ``(w - z) + i (x + y)`` and ``(w + z) + i (x - y)``.

    Raises
    ------
    TypeError, ValueError
        Where `image` is not an array of finite real numbers with two axes, for frequencies and sigmas out of range.
    """
    array = real_array(image, "image", (-1, -1), "images M N")
    check_finite(array, "image")
    pairs = [(_frequency(u), _frequency(v)) for u, v in frequencies]
    given = [sigma] * len(pairs) if np.ndim(sigma) == 0 else list(np.atleast_1d(sigma))
    widths = [positive_number(each, "sigma") for each in given]
    if len(widths) != len(pairs):
        raise ValueError(f"sigma: {len(widths)} for {len(pairs)} frequencies; expected one, or one for each")
    result = np.empty((*array.shape[:-2], len(pairs), *array.shape[-2:], 4), array.dtype)

    def part(place: tuple[int, int]) -> None:
        k, m = place
        rows, columns = (gabor_taps(2 * np.pi * frequency, widths[k], balanced) for frequency in pairs[k])
        along = filtered(array, rows[m], -2)
        for n, column in enumerate(columns):
            result[..., k, :, :, m + 2 * n] = filtered(along, column, -1)

    in_threads(part, [(k, m) for k in range(len(pairs)) for m in range(2)], workers)
    return result


def gabor_taps(frequency: float, sigma: float, balanced: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The even and the odd part of a Gabor filter; `frequency` in radians per pixel."""
    reach = int(np.ceil(_REACH * sigma))
    x = np.arange(-reach, reach + 1.0)
    g = np.exp(-(x**2) / (2 * sigma**2))
    g /= g.sum()
    even = g * np.cos(frequency * x)
    if balanced:
        even = even - even.sum() * g
    return even, g * np.sin(frequency * x)


def filtered(array: Reals, taps: NDArray[np.float64], axis: int) -> Reals:
    """The convolution along one axis, mirrored at the ends; symmetric and antisymmetric taps are recognised."""
    result: Reals = scipy.ndimage.convolve1d(array, taps, axis, mode="reflect")
    return result


def _frequency(value: float) -> float:
    number = finite_number(value, "frequencies")
    if not 0 <= number <= 0.5:
        raise ValueError(f"frequencies: {number}; expected cycles per pixel from 0 to 0.5")
    return number
