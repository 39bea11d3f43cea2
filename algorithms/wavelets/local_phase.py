"""Complex Gabor banks; phase, frequency and confidence at every pixel, from complex and from quaternionic filters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import quaternion

from ..arguments import Reals, finite_number, real_array
from .checks import positive_number
from .discrete import check_finite
from .phase import filtered, gabor_bank, gabor_taps, quaternion_phase
from .sharing import in_threads

Complexes = NDArray[Any]

_FLOOR = 0.2
"""The part of the root mean square amplitude at which confidence is halved."""


class LocalPhase(NamedTuple):
    """What `local_phase` gives; arrays (..., M, N).

    Attributes
    ----------
    amplitude, phase : array
    frequency : array, (..., M, N, 2)
        The slope of the phase along x and y, in radians per pixel.
    confidence : array
        From 0, where the amplitude vanishes or the frequency leaves the band of the filter, to 1.
    """

    amplitude: Reals
    phase: Reals
    frequency: Reals
    confidence: Reals


class QuaternionLocalPhase(NamedTuple):
    """What `quaternion_local_phase` gives; arrays (..., M, N).

    Attributes
    ----------
    amplitude, phi, theta, psi : array
        As in `quaternion_phase`.
    frequency : array, (..., M, N, 2)
        The slope of phi along x and that of theta along y, in radians per pixel.
    confidence : array
        From 0, where the amplitude vanishes, psi is pi/4 or -pi/4, or a frequency leaves the band of the filter, to 1.
    """

    amplitude: Reals
    phi: Reals
    theta: Reals
    psi: Reals
    frequency: Reals
    confidence: Reals


def complex_gabor_bank(
    image: ArrayLike,
    frequencies: Sequence[tuple[float, float]],
    sigma: float | Sequence[float] = 4.0,
    aspect: float = 1.0,
    balanced: bool = False,
    workers: int | None = None,
) -> Complexes:
    """Images filtered by complex Gabor functions ``g(x, y) exp(i 2 pi (u x + v y))``.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images; x runs along M and y along N. Beyond their edges they go on mirrored.
    frequencies : sequence of (u, v)
        In cycles per pixel, from -1/2 to 1/2.
    sigma : float or sequence of float
        Standard deviations along x of the Gaussians g, of sum 1, in pixels; one for all or one for each frequency.
    aspect : float
        The standard deviation along x over that along y.
    balanced : bool
        Whether the wave loses a part of the Gaussian, so that its sum is 0 and brightness does not count.
    workers : int, optional
        How many threads share the work, counted as in `scipy.fft`; the result is the same.

    Returns
    -------
    array of complex, (..., K, M, N)

    Raises
    ------
    TypeError, ValueError
        Where `image` is not an array of finite real numbers with two axes, for frequencies and widths out of range.

    Notes
    -----
    Along rows and columns one after the other: six filters of one axis for each frequency.
    """
    array = real_array(image, "image", (-1, -1), "images M N")
    check_finite(array, "image")
    pairs = [(_frequency(u), _frequency(v)) for u, v in frequencies]
    widths = [sigma] * len(pairs) if isinstance(sigma, (int, float, np.integer, np.floating)) else list(sigma)
    if len(widths) != len(pairs):
        raise ValueError(f"sigma: {len(widths)} for {len(pairs)} frequencies; expected one, or one for each")
    ratio = positive_number(aspect, "aspect")
    result = np.empty((*array.shape[:-2], len(pairs), *array.shape[-2:]), np.result_type(array.dtype, np.complex64))
    sizes = [positive_number(width, "sigma") for width in widths]

    def filter_one(k: int) -> None:
        (u, v), size = pairs[k], sizes[k]
        rows = gabor_taps(2 * np.pi * u, size, False)
        columns = gabor_taps(2 * np.pi * v, size / ratio, False)
        even, odd = (filtered(array, taps, -2) for taps in rows)
        part = result[..., k, :, :]
        part.real = filtered(even, columns[0], -1) - filtered(odd, columns[1], -1)
        part.imag = filtered(even, columns[1], -1) + filtered(odd, columns[0], -1)
        if balanced:
            smooth = [gabor_taps(0.0, each, False)[0] for each in (size, size / ratio)]
            part.real -= rows[0].sum() * columns[0].sum() * filtered(filtered(array, smooth[0], -2), smooth[1], -1)

    in_threads(filter_one, range(len(pairs)), workers)
    return result


def local_phase(
    image: ArrayLike, frequency: tuple[float, float], sigma: float = 4.0, balanced: bool = True
) -> LocalPhase:
    """Amplitude, phase, frequency and confidence at every pixel, from one complex Gabor filter.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images, at least 2 x 2.
    frequency : (u, v)
        Of the filter, in cycles per pixel, from -1/2 to 1/2.
    sigma : float
        Its standard deviation in pixels.
    balanced : bool
        As in `complex_gabor_bank`.

    Returns
    -------
    LocalPhase

    Raises
    ------
    TypeError, ValueError
        As in `complex_gabor_bank`.

    Notes
    -----
    Phases are not reliable near zeros of the amplitude, where the frequency leaves the band, or the amplitude changes
    fast (Fleet and Jepson, *IEEE Trans. Pattern Analysis and Machine Intelligence* 15:1253, 1993).
    """
    array = _image(image)
    band = complex_gabor_bank(array, [frequency], sigma, balanced=balanced)[..., 0, :, :]
    slopes, confidence = _slopes(band, 2 * np.pi * np.array(frequency), float(sigma))
    return LocalPhase(np.abs(band), np.angle(band), slopes, confidence)


def quaternion_local_phase(
    image: ArrayLike, frequency: tuple[float, float], sigma: float = 4.0, balanced: bool = True
) -> QuaternionLocalPhase:
    """Amplitude, the three phases, frequencies and confidence at every pixel, from one quaternionic Gabor filter.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images, at least 2 x 2.
    frequency : (u, v)
        Of the filter, in cycles per pixel, from 0 to 1/2.
    sigma : float
        Its standard deviation in pixels.
    balanced : bool
        As in `gabor_bank`.

    Returns
    -------
    QuaternionLocalPhase

    Raises
    ------
    TypeError, ValueError
        As in `gabor_bank`.

    Notes
    -----
    The two complex planes of the quaternion have the phases ``phi + theta`` and ``phi - theta``; their slopes need no
    unwrapping. One of them vanishes where psi is pi/4 or -pi/4: the confidence is that of the less reliable plane.
    """
    array = _image(image)
    q = gabor_bank(array, [frequency], sigma, balanced)[..., 0, :, :, :]
    phase = quaternion_phase(q)
    planes = [
        np.ascontiguousarray(part).view(np.result_type(part.dtype, np.complex64))[..., 0]
        for part in quaternion.pack_two_sided(q)
    ]
    centre = 2 * np.pi * np.array(frequency)
    across, sure_across = _slopes(planes[0], centre * [1, -1], float(sigma))
    along, sure_along = _slopes(planes[1], centre, float(sigma))
    slopes = np.stack([(along[..., 0] + across[..., 0]) / 2, (along[..., 1] - across[..., 1]) / 2], -1)
    confidence = np.minimum(sure_across, sure_along)
    return QuaternionLocalPhase(phase.amplitude, phase.phi, phase.theta, phase.psi, slopes, confidence)


def _slopes(band: Complexes, centre: NDArray[np.float64], sigma: float) -> tuple[Reals, Reals]:
    """The slope of the phase along both axes, and how reliable the phase is.

    Slopes are half the change between opposite neighbours, whose product of one with the other's conjugate needs no
    unwrapping; for neighbours of an edge, the change to the pixel itself.
    """
    amplitude = np.abs(band)
    floor = _FLOOR * np.sqrt((amplitude**2).mean((-2, -1), keepdims=True)) + np.finfo(amplitude.dtype).tiny
    slopes = np.empty((*band.shape, 2), amplitude.dtype)
    bandwidth = np.zeros(band.shape, amplitude.dtype)
    for k, axis in enumerate((-2, -1)):
        moved, sizes = np.moveaxis(band, axis, -1), np.moveaxis(amplitude, axis, -1)
        steps = np.full(moved.shape[-1], 2)
        steps[[0, -1]] = 1
        after = np.minimum(np.arange(len(steps)) + 1, len(steps) - 1)
        before = np.maximum(np.arange(len(steps)) - 1, 0)
        change = np.angle(moved[..., after] * moved[..., before].conj()) / steps
        growth = (sizes[..., after] - sizes[..., before]) / steps / (sizes + floor)
        slopes[..., k] = np.moveaxis(change, -1, axis)
        off = change - centre[k].astype(change.dtype)
        bandwidth += np.moveaxis(off**2 + growth**2, -1, axis)
    confidence = amplitude**2 / (amplitude**2 + floor**2) / (1 + sigma**2 * bandwidth)
    return slopes, confidence


def _image(image: ArrayLike) -> Reals:
    array = real_array(image, "image", (-1, -1), "images M N")
    check_finite(array, "image")
    if min(array.shape[-2:]) < 2:
        raise ValueError(f"image: shape {array.shape}; expected at least 2 x 2 pixels, as slopes need neighbours")
    return array


def _frequency(value: float) -> float:
    number = finite_number(value, "frequencies")
    if abs(number) > 0.5:
        raise ValueError(f"frequencies: {number}; expected cycles per pixel from -0.5 to 0.5")
    return number
