"""Quaternionic Gabor filters and the phases of quaternions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import quaternion

from ..arguments import Reals, finite_number, positive_number, real_array
from .checks import TRUNCATE, image_stack, in_range
from .sharing import in_threads


class Phase(NamedTuple):
    """The polar form ``q = amplitude exp(i phi) exp(k psi) exp(j theta)``; all arrays have the same shape.

    Attributes
    ----------
    amplitude : array
    phi, theta, psi : array
        In [-pi, pi], [-pi/2, pi/2] and [-pi/4, pi/4].
    singular : array of bool
        True where ``psi`` is pi/4 or -pi/4 up to rounding; there q determines only ``phi - theta`` or ``phi + theta``.
    """

    amplitude: Reals
    phi: Reals
    theta: Reals
    psi: Reals
    singular: NDArray[np.bool_]


def quaternion_phase(q: ArrayLike) -> Phase:
    """Compute the amplitude and the three phases of quaternions.

    Parameters
    ----------
    q : array_like, (..., 4)
        Quaternions (w, x, y, z). All phases of the zero quaternion are 0.

    Returns
    -------
    Phase

    Raises
    ------
    TypeError, ValueError
        If `q` is not an array of real numbers of this shape.

    Notes
    -----
    Bülow, *Hypercomplex spectral signal representations*, thesis, Kiel 1999. `generated.quaternion.from_phases`
    recovers q to 4 units in the last place of the amplitude, also in the singular set.
    """
    array = real_array(q, "q", (4,), "quaternions")
    parts = [np.asarray(part) for part in quaternion.to_phases(array)]
    amplitude = parts[0]
    outside = _outside(amplitude)
    if outside.any():
        some, exponents = in_range(array[outside], (-1,))
        for part, found in zip(parts, quaternion.to_phases(some), strict=True):
            part[outside] = found
        with np.errstate(over="ignore"):
            amplitude[outside] = np.ldexp(amplitude[outside], exponents[..., 0])
    _, phi, theta, psi, cosine = parts
    return Phase(amplitude, phi, theta, psi, np.asarray(cosine < 16 * np.finfo(array.dtype).eps))


def amplitudes(q: Reals) -> Reals:
    """Return the norms of quaternions (..., 4) without overflow or underflow."""
    found = np.asarray(quaternion.norm(q))
    outside = _outside(found)
    if outside.any():
        some, exponents = in_range(q[outside], (-1,))
        with np.errstate(over="ignore"):
            found[outside] = np.ldexp(quaternion.norm(some), exponents[..., 0])
    return found


def _outside(amplitude: Reals) -> NDArray[np.bool_]:
    """Return where squares may have overflowed or underflowed; zeros and non-finite values are included."""
    low, high = (float(bound) ** 0.25 for bound in (np.finfo(amplitude.dtype).tiny, np.finfo(amplitude.dtype).max))
    return np.asarray(~((amplitude > low) & (amplitude < high)))


def gabor_bank(
    image: ArrayLike,
    frequencies: Sequence[tuple[float, float]],
    sigma: float | Sequence[float] = 4.0,
    balanced: bool = False,
    workers: int | None = None,
    *,
    aspect: float = 1.0,
    truncate: float = TRUNCATE,
) -> Reals:
    """Filter images with quaternionic Gabor functions ``g(x, y) exp(i 2 pi u x) exp(j 2 pi v y)``.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images; x runs along M and y along N. Images are mirrored at their edges.
    frequencies : sequence of (u, v)
        In cycles per pixel, from 0 to 1/2.
    sigma : float or sequence of float
        Standard deviations along x of the Gaussians g, of sum 1, in pixels: one for all frequencies or one for each.
    balanced : bool
        Whether a multiple of the Gaussian is subtracted, so that the filter has sum 0 and ignores constant brightness.
    workers : int, optional
        Number of threads, as in `scipy.fft`; the result does not depend on it.
    aspect : float
        Ratio of the standard deviation along x to that along y.
    truncate : float
        Truncation of the filters in standard deviations, rounded up to a pixel. Spectra of the filters are Gaussian to
        2e-4 for 4, 2e-7 for 5.5, and 1e-8 for 6.

    Returns
    -------
    array, (..., K, M, N, 4)
        Quaternions (w, x, y, z) for each of K frequencies. The complex Gabor filters of (u, v) and (u, -v) are
        ``(w - z) + i (x + y)`` and ``(w + z) + i (x - y)``, balanced or not.

    Raises
    ------
    TypeError, ValueError
        If `image` is not an array of finite real numbers with two axes or has channels, or if frequencies, widths or
        options are out of range.
    """
    array = image_stack(image)
    pairs = [(_frequency(u), _frequency(v)) for u, v in frequencies]
    sizes = widths(sigma, aspect, len(pairs))
    reach = positive_number(truncate, "truncate")
    result = np.empty((*array.shape[:-2], len(pairs), *array.shape[-2:], 4), array.dtype)

    def part(place: tuple[int, int]) -> None:
        k, m = place
        rows, columns = (
            gabor_taps(2 * np.pi * frequency, size, False, reach)
            for frequency, size in zip(pairs[k], sizes[k], strict=True)
        )
        along = filtered(array, rows[m], -2)
        for n, column in enumerate(columns):
            result[..., k, :, :, m + 2 * n] = filtered(along, column, -1)
        if balanced and m == 0:
            result[..., k, :, :, 0] -= brightness(array, (rows[0], columns[0]), sizes[k], reach)

    in_threads(part, [(k, m) for k in range(len(pairs)) for m in range(2)], workers)
    return result


def widths(sigma: float | Sequence[float], aspect: float, count: int) -> list[tuple[float, float]]:
    """Return the standard deviations of `count` Gabor filters, along x and y."""
    given = [sigma] * count if np.ndim(sigma) == 0 else list(np.atleast_1d(sigma))
    if len(given) != count:
        raise ValueError(f"sigma: {len(given)} for {count} frequencies; expected one, or one for each")
    ratio = positive_number(aspect, "aspect")
    return [(size, size / ratio) for size in (positive_number(each, "sigma") for each in given)]


def brightness(
    array: Reals, even: tuple[NDArray[np.float64], NDArray[np.float64]], sizes: tuple[float, float], truncate: float
) -> Reals:
    """Return the response of a filter with these even parts along x and y to the smoothed images.

    Only products of even parts have a nonzero sum. Subtracting the response balances the whole band; filters balanced
    along one axis would vanish where the frequency along this axis is 0.
    """
    rows, columns = (gabor_taps(0.0, size, False, truncate)[0] for size in sizes)
    smooth = filtered(filtered(array, rows, -2), columns, -1)
    return np.asarray(array.dtype.type(even[0].sum() * even[1].sum()) * smooth)


def gabor_taps(
    frequency: float, sigma: float, balanced: bool, truncate: float = TRUNCATE
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the even and the odd part of a Gabor filter along one axis; `frequency` in radians per pixel."""
    reach = int(np.ceil(truncate * sigma))
    x = np.arange(-reach, reach + 1.0)
    g = np.exp(-(x**2) / (2 * sigma**2))
    g /= g.sum()
    even = g * np.cos(frequency * x)
    if balanced:
        even = even - even.sum() * g
    return even, g * np.sin(frequency * x)


def filtered(array: Reals, taps: NDArray[np.float64], axis: int) -> Reals:
    """Return the convolution along one axis, mirrored at the ends; symmetric and antisymmetric taps are recognised."""
    result: Reals = scipy.ndimage.convolve1d(array, taps, axis, mode="reflect")
    return result


def _frequency(value: float) -> float:
    number = finite_number(value, "frequencies")
    if not 0 <= number <= 0.5:
        raise ValueError(f"frequencies: {number}; expected cycles per pixel from 0 to 0.5")
    return number
