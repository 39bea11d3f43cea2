"""Quaternionic Gabor filters and the phases of quaternions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import quaternion

from ..arguments import Reals, finite_number, positive_number, real_array
from ..scaling import back_in_range, in_range
from .checks import TRUNCATE, image_stack
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
    pairs = [(_frequency(u), _frequency(v)) for u, v in frequencies]
    sizes = widths(sigma, aspect, len(pairs))
    bands = GaborBands(image, sizes, balanced, truncate)
    result = np.empty((*bands.shape[:-2], len(pairs), *bands.shape[-2:], 4), bands.dtype.type(0).real.dtype)

    def part(k: int) -> None:
        one, other = (bands.band((pairs[k][0], v), sizes[k]) for v in (pairs[k][1], -pairs[k][1]))
        numbers = result[..., k, :, :, :]
        for place, of_one, of_other, combine in (
            (0, one.real, other.real, np.add),
            (1, one.imag, other.imag, np.add),
            (2, one.imag, other.imag, np.subtract),
            (3, other.real, one.real, np.subtract),
        ):
            combine(of_one, of_other, out=numbers[..., place])
        numbers *= 0.5

    in_threads(part, range(len(pairs)), workers)
    return bands.restored(result)


class GaborBands:
    """Bands of images, each a product of spectra; images are mirrored at their edges.

    Parameters
    ----------
    image : array_like, (..., M, N)
    sizes : sequence of (float, float)
        Standard deviations along x and y of all filters.
    balanced, truncate
        As in `gabor_bank`.

    Attributes
    ----------
    shape, dtype
        Those of a band, complex.
    """

    def __init__(self, image: ArrayLike, sizes: Sequence[tuple[float, float]], balanced: bool, truncate: float) -> None:
        array, self._exponents = in_range(image_stack(image))
        self._reach, self._balanced = positive_number(truncate, "truncate"), balanced
        self.shape, self.dtype = array.shape, np.result_type(array.dtype, np.complex64)
        reaches = [max((int(np.ceil(self._reach * size[axis])) for size in sizes), default=0) for axis in (0, 1)]
        self._lengths, around = list[int](), [(0, 0)] * (array.ndim - 2)
        for n, reach in zip(self.shape[-2:], reaches, strict=True):
            # Mirrored images repeat after twice their length, which suffices for all filters.
            length = scipy.fft.next_fast_len(n + 2 * reach)
            self._lengths.append(min(length, 2 * n))
            around.append((reach, reach) if length <= 2 * n else (0, n))
        rows, columns = (slice(before, before + n) for (before, _), n in zip(around[-2:], self.shape[-2:], strict=True))
        self._inside = ..., rows, columns
        self._spectrum = scipy.fft.fft2(np.pad(np.ascontiguousarray(array), around, "symmetric"), self._lengths)

    def band(self, frequency: tuple[float, float], sizes: tuple[float, float]) -> NDArray[Any]:
        """Return the band (..., M, N) of a frequency, in cycles per pixel, of the images as they are in range."""
        taps = [gabor_taps(2 * np.pi * f, size, self._reach) for f, size in zip(frequency, sizes, strict=True)]
        factors = _spectrum_of(taps, self._lengths)
        if self._balanced:
            # Only products of even parts have a nonzero sum. Balancing the whole band rather than one axis keeps bands
            # whose frequency along this axis is 0.
            even = np.prod([tap.real.sum() for tap in taps])
            factors -= even * _spectrum_of([gabor_taps(0.0, size, self._reach) for size in sizes], self._lengths)
        return np.asarray(scipy.fft.ifft2(self._spectrum * factors.astype(self.dtype), overwrite_x=True)[self._inside])

    def restored(self, result: Reals) -> Reals:
        """Multiply real results (..., K, M, N) or (..., K, M, N, 4) by the powers of 2 of images out of range."""
        more = result.ndim - self._exponents.ndim - 1
        return back_in_range(result, self._exponents.reshape(*self._exponents.shape, *[1] * (1 + more)))


def _spectrum_of(taps: Sequence[NDArray[Any]], lengths: Sequence[int]) -> NDArray[Any]:
    """Return the spectrum (M, N) of a filter that is the product of two along the axes, with the middle ones at 0."""
    around = [np.zeros(length, np.complex128) for length in lengths]
    for tap, part in zip(taps, around, strict=True):
        np.add.at(part, np.arange(-(len(tap) // 2), len(tap) // 2 + 1) % len(part), tap)
    rows, columns = map(scipy.fft.fft, around)
    return np.asarray(rows[:, None] * columns)


def widths(sigma: float | Sequence[float], aspect: float, count: int) -> list[tuple[float, float]]:
    """Return the standard deviations of `count` Gabor filters, along x and y."""
    given = [sigma] * count if np.ndim(sigma) == 0 else list(np.atleast_1d(sigma))
    if len(given) != count:
        raise ValueError(f"sigma: {len(given)} for {count} frequencies; expected one, or one for each")
    ratio = positive_number(aspect, "aspect")
    return [(size, size / ratio) for size in (positive_number(each, "sigma") for each in given)]


def gabor_taps(frequency: float, sigma: float, truncate: float = TRUNCATE) -> NDArray[np.complex128]:
    """Return a Gabor filter along one axis, a Gaussian times a wave; `frequency` in radians per pixel."""
    reach = int(np.ceil(truncate * sigma))
    x = np.arange(-reach, reach + 1.0)
    g = np.exp(-(x**2) / (2 * sigma**2))
    return np.asarray(g / g.sum() * np.exp(1j * frequency * x))


def _frequency(value: float) -> float:
    number = finite_number(value, "frequencies")
    if not 0 <= number <= 0.5:
        raise ValueError(f"frequencies: {number}; expected cycles per pixel from 0 to 0.5")
    return number
