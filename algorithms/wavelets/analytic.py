"""Analytic signals of one-dimensional signals, and five kinds of analytic signals of images."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import vga3

from ..arguments import Reals, finite_number, real_array
from ..scaling import back_in_range, in_range
from .checks import image_stack
from .discrete import check_finite
from .sharing import blocks, in_threads, slices

Complexes = NDArray[Any]
"""Array of complex64 or complex128."""

_BLOCK = 2**19
"""Bytes of complex numbers that remain in a cache between the forward and the inverse transform."""


class Monogenic(NamedTuple):
    """The monogenic signal of an image f with Riesz transforms r1 and r2: the vector r1 e1 + r2 e2 + f e3.

    Attributes
    ----------
    vector : array, (..., M, N, 3)
        r1, r2 and f.
    amplitude, phase, orientation : array, (..., M, N)
        The norm of the vector, its angle with e3, from 0 to pi, and the direction of (r1, r2), from -pi to pi.
    """

    vector: Reals
    amplitude: Reals
    phase: Reals
    orientation: Reals


def analytic_signal(signal: ArrayLike, axis: int = -1, workers: int | None = None) -> Complexes:
    """Return the analytic signal ``f + i H f`` along one axis, with the Hilbert transform H of periodic signals.

    Parameters
    ----------
    signal : array_like
        Real numbers of any shape. float32 gives complex64; integers are converted to float64.
    axis : int
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    array of complex, of the shape of `signal`
        As ``scipy.signal.hilbert``: without negative frequencies. The frequency 0 and, for even sizes, 1/2 are
        unchanged.

    Raises
    ------
    TypeError, ValueError
        If `signal` is not an array of finite real numbers or does not have this axis.
    """
    array = real_array(signal, "signal", (-1,))
    check_finite(array, "signal")
    if isinstance(axis, bool) or not isinstance(axis, (int, np.integer)) or not -array.ndim <= axis < array.ndim:
        raise ValueError(f"axis: {axis!r}; expected an axis of an array of {array.ndim}")
    last = np.moveaxis(array, axis, -1)
    spectrum = scipy.fft.fft(last, workers=workers)
    spectrum *= (1 + _sign(last.shape[-1])).astype(array.dtype)
    return np.moveaxis(scipy.fft.ifft(spectrum, overwrite_x=True, workers=workers), -1, axis)


def total_analytic_signal(image: ArrayLike, workers: int | None = None) -> Complexes:
    """Return ``f + i H1 H2 f``, whose imaginary part is the Hilbert transform along both axes.

    Its spectrum is that of the image multiplied by ``1 - i sgn(u) sgn(v)``; no frequency vanishes.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images, assumed periodic. float32 gives complex64; integers are converted to float64.
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    array of complex, (..., M, N)

    Raises
    ------
    TypeError, ValueError
        If `image` is not an array of finite real numbers with two axes.
    """
    array = image_stack(image)
    spectrum = scipy.fft.rfft2(array, workers=workers)
    s, t = _signs(array)
    result = np.empty(array.shape, np.result_type(array.dtype, np.complex64))
    result.real = array
    result.imag = scipy.fft.irfft2(-s * t * spectrum, array.shape[-2:], overwrite_x=True, workers=workers)
    return result


def partial_analytic_signal(image: ArrayLike, angle: float = 0.0, workers: int | None = None) -> Complexes:
    """Return the analytic signal along one direction: the frequencies on one side of a line are kept and doubled.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images, assumed periodic; x runs along M and y along N.
    angle : float
        Angle of the direction (cos, sin) along x and y, in radians. With 0, the result is the analytic signal of each
        column.
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    array of complex, (..., M, N)
        Its real part is the image.

    Raises
    ------
    TypeError, ValueError
        As in `total_analytic_signal`, and if `angle` is not finite.
    """
    array = image_stack(image)
    direction = finite_number(angle, "angle")
    u, v = (np.fft.fftfreq(n) for n in array.shape[-2:])
    along = np.cos(direction) * u[:, None] + np.sin(direction) * v
    # Waves perpendicular to the direction, up to rounding, are on neither side.
    side = np.where(np.abs(along) < 1e-12, 0, np.sign(along))
    side = (side - np.roll(side[::-1, ::-1], 1, (0, 1))) / 2
    spectrum = scipy.fft.fft2(array, workers=workers)
    spectrum *= (1 + side).astype(array.dtype)
    return np.asarray(scipy.fft.ifft2(spectrum, overwrite_x=True, workers=workers))


def single_orthant_signal(image: ArrayLike, workers: int | None = None) -> Complexes:
    """Return Hahn's analytic signal ``(f - H1 H2 f) + i (H1 f + H2 f)``: only positive frequencies u and v are kept.

    Parameters, results and errors are those of `total_analytic_signal`. For odd sizes the result agrees with
    ``scipy.signal.hilbert2``; for even sizes, that function drops the frequency 1/2, which is kept here as in
    `analytic_signal`.
    """
    array = image_stack(image)
    s, t = (_sign(n).astype(array.dtype) for n in array.shape[-2:])
    spectrum = scipy.fft.fft2(array, workers=workers)
    spectrum *= (1 + s)[:, None] * (1 + t)
    return np.asarray(scipy.fft.ifft2(spectrum, overwrite_x=True, workers=workers))


def quaternionic_analytic_signal(image: ArrayLike, workers: int | None = None) -> Reals:
    """Return Bülow's analytic signal ``f + i H1 f + j H2 f + k H1 H2 f``.

    Its two-sided quaternion Fourier transform is that of the image multiplied by ``(1 + sgn(u)) (1 + sgn(v))``.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images, assumed periodic; H1 acts along M and H2 along N. float32 is kept; integers are converted to
        float64.
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    array, (..., M, N, 4)
        Quaternions (w, x, y, z).

    Raises
    ------
    TypeError, ValueError
        As in `total_analytic_signal`.

    Notes
    -----
    The transforms along columns are real; those along rows are complex and transform the image and H1 f together.
    """
    array = image_stack(image)
    images = array.reshape(-1, *array.shape[-2:])
    rows, columns = images.shape[1:]
    result = np.empty((*images.shape, 4), array.dtype)
    # The complex numbers (w, x) and (y, z).
    numbers = result.view(np.result_type(array.dtype, np.complex64))
    down = (-1j * _sign(rows)[: rows // 2 + 1]).astype(numbers.dtype)[:, None]
    across = (-1j * _sign(columns)).astype(numbers.dtype)

    def along_columns(part: tuple[slice, slice]) -> None:
        some, place = part
        values = images[some, :, place]
        spectrum = scipy.fft.rfft(values, axis=1, workers=1)
        spectrum *= down
        result[some, :, place, 0] = values
        result[some, :, place, 1] = scipy.fft.irfft(spectrum, rows, axis=1, overwrite_x=True, workers=1)

    def along_rows(place: slice) -> None:
        both = numbers.reshape(-1, columns, 2, copy=False)[place]
        spectrum = scipy.fft.fft(both[..., 0], workers=1)
        spectrum *= across
        both[..., 1] = scipy.fft.ifft(spectrum, overwrite_x=True, workers=1)

    least = _BLOCK // numbers.itemsize
    in_threads(along_columns, blocks(len(images), columns, rows, least), workers)
    in_threads(along_rows, list(slices(len(images) * rows, max(least // columns, 1))), workers)
    return result.reshape(*array.shape, 4)


def monogenic_signal(image: ArrayLike, workers: int | None = None) -> Monogenic:
    """Compute the monogenic signal, which is isotropic.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images, assumed periodic. Subtract their mean first if possible: it has no Riesz transform.
    workers : int, optional
        As in `scipy.fft`.

    Returns
    -------
    Monogenic

    Raises
    ------
    TypeError, ValueError
        As in `total_analytic_signal`.

    Notes
    -----
    Riesz transforms multiply the spectrum by ``-i u / |(u, v)|`` and ``-i v / |(u, v)|`` (Felsberg and Sommer, *IEEE
    Trans. Signal Processing* 49:3136, 2001). For a plane wave, the result is its amplitude and phase, and the
    orientation of its frequency.
    """
    array, exponents = in_range(image_stack(image))
    spectrum = scipy.fft.rfft2(array, workers=workers)
    u, v = np.fft.fftfreq(array.shape[-2])[:, None], np.fft.rfftfreq(array.shape[-1])
    length = np.hypot(u, v)
    length[0, 0] = 1
    vector = np.empty((*array.shape, 3), array.dtype)
    for k, frequency in enumerate((u, v)):
        # The frequency 1/2 is also -1/2 and has no sign.
        weight = -1j * np.where(np.abs(frequency) == 0.5, 0, frequency) / length
        part = spectrum * weight.astype(spectrum.dtype)
        vector[..., k] = scipy.fft.irfft2(part, array.shape[-2:], overwrite_x=True, workers=workers)
    vector[..., 2] = array
    amplitude = back_in_range(vga3.vector_norm(vector), exponents)
    phase = np.arctan2(np.hypot(vector[..., 0], vector[..., 1]), vector[..., 2])
    orientation = np.arctan2(vector[..., 1], vector[..., 0])
    return Monogenic(back_in_range(vector, exponents[..., None]), amplitude, phase, orientation)


def _sign(size: int) -> NDArray[np.float64]:
    """Return the signs of the frequencies; those of 0 and 1/2 are 0."""
    frequency = np.fft.fftfreq(size)
    return np.where(frequency == -0.5, 0, np.sign(frequency))


def _signs(array: Reals) -> tuple[Reals, Reals]:
    """Return the signs along both axes, with half of the frequencies along the last one."""
    rows, columns = array.shape[-2:]
    return _sign(rows).astype(array.dtype)[:, None], _sign(columns)[: columns // 2 + 1].astype(array.dtype)
