"""Equations for the motion between two images, one level of a pyramid at a time."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from generated import images

from ..arguments import Reals
from ..evidence import largest_ratio

_OFFSET = 80
"""Numbers between planes: five lines of a cache."""
_LARGE = 2**14
"""Number of values above which a quarter of them suffices for a median."""
_STEP = 4
"""A limit on work: one of so many rows and columns decides whether structure is too fine for a coarser level."""
_LEAST_NOISE = 1e-6
"""Squared difference of images of contrast 1 after rounding to bytes, averaged over neighbours."""


@lru_cache
def half_gaussian(sigma: float, reach: int) -> Reals:
    """Return a Gaussian from its middle to the distance `reach`; the whole one has the sum 1."""
    values = np.exp(-(np.arange(reach + 1) ** 2) / (2 * sigma**2))
    return np.asarray(values / (2 * values.sum() - 1), np.float32)


_FINE, _COARSE = half_gaussian(0.7, 3), half_gaussian(2.0, 7)
"""The images that are compared are the difference of both, without noise from pixel to pixel and without brightness."""
_HALVING = half_gaussian(1.0, 5)
"""Half of the filter before every second pixel is taken."""
_REACH = 5
"""Distance in pixels of the farthest pixels of `_SEEN`."""
_SEEN = half_gaussian(np.hypot(1.0, 2 * 0.7), _REACH)
"""A Gaussian as wide as that of halved images and the finer one together."""
_NEIGHBOURHOOD = half_gaussian(1.5, 5)
"""A Gaussian over which equations are averaged."""


class Level:
    """One level of the pyramid: two images, and their comparison for a given motion.

    Motions are stored at every other row and column, the nodes, because equations are averaged over more pixels than
    that.

    Parameters
    ----------
    pair : array, (2, M, N)
        The images, in single precision, with contrast 1.
    threads : int
    """

    def __init__(self, pair: Reals, threads: int) -> None:
        self._shape, self._threads = pair.shape[1:], threads
        rows, columns = self._shape
        here, there = images.band(pair, _FINE, _COARSE, num_threads=threads)
        self._here = np.pad(here, [(0, rows % 2), (0, columns % 2)], "edge")
        self._there = images.jets(there, out=tuple(_planes(10, there.shape)))
        self._last = np.array([columns - 1, rows - 1], np.float32)
        wide = self._here.shape
        self._nodes = wide[0] // 2, wide[1] // 2
        self._rows, self._columns = (np.arange(size, dtype=np.float32) for size in wide)
        self._pixels = _planes(2, wide)
        self._terms = _planes(6, wide)

    def equations(self, motion: Reals) -> tuple[Reals, Reals, float]:
        """Return averaged equations for a correction of the motion of the nodes, (2, m, n).

        Returns
        -------
        sums : array, (6, m, n)
            Results of `images.motion_terms`, averaged over neighbours.
        confidence : array, (m, n)
            From 0 to 1: ``e / (e + r + ridge)`` with the least squared difference r and the structure e in the
            direction that has least of it, without what noise may contribute.
        noise : float
            The median over the image of the least squared difference, which is due to noise.
        """
        u, v = enlarged(motion, out=self._pixels)
        places = self._rows, self._columns, self._last
        images.motion_terms(*self._there, self._here, u, v, *places, out=tuple(self._terms))
        sums = _at_even_places(self._terms, _NEIGHBOURHOOD, self._threads)
        # Contrasts of 1 give sums of about 1: the second term matters only where the image is empty.
        ridge = np.float32(1e-4 * (sums[0].mean() + sums[2].mean()) + 1e-12)
        left, least = images.motion_evidence(sums.reshape(6, -1).T, ridge).T.reshape(2, *self._nodes)
        structure = np.maximum(least - structure_of_noise() * left, 0)
        return sums, structure / (structure + left + ridge), max(median(left), _LEAST_NOISE)

    def pixels(self, motion: Reals) -> Reals:
        """Return the motion (..., m, n) of the nodes, interpolated between them, for all pixels."""
        return enlarged(motion)[..., : self._shape[0], : self._shape[1]]


@lru_cache
def structure_of_noise() -> float:
    """Return the mean square of a derivative that white noise alone exceeds with the probability `WRONG`.

    The unit is the least mean squared difference of the two images at the same place, as noise may vary. The derivative
    is that of their mean, whose variance is a quarter of that of the difference.
    """
    width = len(_COARSE)
    fine, coarse = (np.concatenate([taps[:0:-1], taps]).astype(float) for taps in (_FINE, _COARSE))
    band = np.pad(np.outer(fine, fine), width - len(_FINE)) - np.outer(coarse, coarse)
    slopes = np.apply_along_axis(np.convolve, 1, band, [1 / 12, -2 / 3, 0, 2 / 3, -1 / 12])
    # The motion, two numbers, takes its part of the differences.
    differences = _freedom(band)
    variance = differences / (differences - 2)
    ratio = largest_ratio(_freedom(slopes), differences - 2)
    return float(variance * ratio * (slopes**2).sum() / (band**2).sum() / 4)


def _freedom(taps: Reals) -> int:
    """Return the degrees of freedom of the distribution of chi-square that averaged squares of filtered noise have.

    It is the one with the same variance.
    """
    # The correlation of the filter with itself; importing `scipy.signal` takes half a second.
    spectrum = np.abs(np.fft.rfft2(taps, [2 * n - 1 for n in taps.shape])) ** 2
    alike = np.fft.fftshift(np.fft.irfft2(spectrum, [2 * n - 1 for n in taps.shape]))
    near = np.concatenate([_NEIGHBOURHOOD[:0:-1], _NEIGHBOURHOOD]).astype(float)
    pairs = np.correlate(near, near, "full")
    rows, columns = ((size - len(pairs)) // 2 for size in alike.shape)
    part = alike[rows : rows + len(pairs), columns : columns + len(pairs)] / alike.max()
    return round(1 / float((np.outer(pairs, pairs) * part**2).sum()))


def _planes(count: int, shape: tuple[int, ...]) -> Reals:
    """Return an array (count, M, N) for single precision whose planes begin at different places of lines of a cache.

    Kernels read the same place of all planes; if sizes are powers of 2, these would displace each other.
    """
    size = int(np.prod(shape))
    return np.empty((count, size + _OFFSET), np.float32)[:, :size].reshape(count, *shape, copy=False)


def halved(pair: Reals, threads: int) -> Reals:
    """Return every other pixel of smoothed images (2, M, N), starting at the first row and the first column."""
    return _at_even_places(np.pad(pair, [(0, 0), (0, pair.shape[1] % 2), (0, 0)], "edge"), _HALVING, threads)


def too_fine(pair: Reals) -> bool:
    """Return whether most of the structure of images (2, M, N) along an axis is lost in `halved` ones.

    Waves shorter than two pixels of these become longer ones, which move differently, and differences of pixels say
    little about waves shorter than three pixels of these, of frequency ``w = pi/3`` here. The squares of second and
    first differences are as ``(1 - cos w)^2`` to ``(sin w)^2``, which is 1 to 3 there.
    """
    taps = np.concatenate([_SEEN[:0:-1], _SEEN])
    for lines in (pair[:, ::_STEP], pair[:, :, ::_STEP].swapaxes(1, 2)):
        # Edges are left out: what is beyond them is unknown.
        smooth = scipy.ndimage.correlate1d(lines, taps)[..., _REACH:-_REACH]
        slope = smooth[..., 2:] - smooth[..., :-2]
        bend = smooth[..., 2:] + smooth[..., :-2] - 2 * smooth[..., 1:-1]
        if 3 * np.vdot(bend, bend) > np.vdot(slope, slope):
            return True
    return False


def _at_even_places(planes: Reals, taps: Reals, threads: int) -> Reals:
    """Return filtered images (K, M, N), with an even number of rows, at their even rows and columns."""
    means = images.pair_means(planes[:, ::2], planes[:, 1::2], taps, num_threads=threads)
    return np.ascontiguousarray(means[..., ::2])


def enlarged(motion: Reals, out: Reals | None = None) -> Reals:
    """Return a field (..., m, n) with twice as many rows and columns; the last ones are repeated."""
    rows, columns = motion.shape[-2:]
    result: Reals = np.empty((*motion.shape[:-2], 2 * rows, 2 * columns), np.float32) if out is None else out
    even, odd = result[..., ::2, :], result[..., 1::2, :]
    even[..., ::2] = motion
    np.add(motion[..., :-1], motion[..., 1:], out=even[..., 1:-1:2])
    even[..., 1:-1:2] *= np.float32(0.5)
    even[..., -1] = motion[..., -1]
    np.add(even[..., :-1, :], even[..., 1:, :], out=odd[..., :-1, :])
    odd[..., :-1, :] *= np.float32(0.5)
    odd[..., -1, :] = even[..., -1, :]
    return result


def median(values: Reals) -> float:
    """Return the median of an array (m, n); for large ones, that of every other row and column."""
    return float(np.median(values[::2, ::2] if values.size > _LARGE else values))


def outside(uv: Reals) -> NDArray[np.bool_]:
    """Return where a motion (2, M, N) leads out of the image."""
    rows, columns = uv.shape[1:]
    y, x = np.arange(rows, dtype=uv.dtype)[:, None] + uv[1], np.arange(columns, dtype=uv.dtype) + uv[0]
    return np.asarray((x < -0.5) | (x > columns - 0.5) | (y < -0.5) | (y > rows - 0.5))
