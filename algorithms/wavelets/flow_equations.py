"""Equations for the motion between two images, from the local phases of quaternionic Gabor bands."""

from __future__ import annotations

from collections.abc import Callable
from queue import SimpleQueue

import numpy as np
import scipy
from numpy.typing import NDArray

from generated import filters, images, quaternion

from ..arguments import Reals
from .phase import gabor_taps
from .separable import Sampler, gabor_rows, half_taps
from .sharing import in_threads, n_threads, slices

_FREQUENCIES = (0.7, 1.2)
"""Radians per pixel, at every level of the pyramid."""
_SIGMA = 2.2
_TAPS = half_taps(
    np.array([[gabor_taps(0.0, _SIGMA, False)[0], *gabor_taps(one, _SIGMA, True)] for one in _FREQUENCIES]), np.float32
)
_COUNT = len(_FREQUENCIES)
BANDS = 4 * _COUNT
"""Number of complex bands, each of which gives one equation."""
_NEIGHBOURHOOD = half_taps(gabor_taps(0.0, 2.5, False)[0], np.float32)
"""A Gaussian over which equations are averaged."""
_FLOOR = 0.1
"""Bands are used where they are larger than this fraction of their median."""
_PIXELS = 2**14
"""Number of pixels whose values remain in a cache from one filter or kernel to the next."""
_LARGE = 2**16
"""Number of pixels above which a quarter of them suffices for a median."""
_LEAST_NOISE = 1e-6
"""Squared residual of a band of an image of contrast 1 after rounding to bytes."""


class Level:
    """One level of the pyramid: the bands of the first image, and their comparison with those of the second image.

    Both are computed in blocks of rows, which threads share.
    """

    def __init__(self, first: Reals, second: Reals, workers: int | None) -> None:
        image = first
        self._second: Reals = second
        self._sampler = Sampler(scipy.ndimage.spline_filter(second, 3, np.float32))
        rows, columns = image.shape
        self._workers, self._places = workers, list(slices(rows, max(_PIXELS // columns, 1)))
        self._most = max(place.stop - place.start for place in self._places)
        self._bands, self._derivatives = (np.empty((_COUNT, 8, rows, columns), image.dtype) for _ in range(2))
        wide = columns + 2

        def filtered(place: slice, memory: Reals) -> None:
            bands, rest = _bands(image, 1, slice(place.start, place.stop + 2), memory)
            self._bands[:, :, place] = bands[..., 1:-1, 1:-1]
            # The rows form one line of numbers, in which neighbours are at constant distances; borders are cut off.
            size = bands[0, 0].size - 2 * wide
            derivatives = rest[: 8 * size].reshape(8, size)
            for band, result in zip(_lines(bands), self._derivatives, strict=True):
                west, east, north, south = (band[wide + k : wide + k + size - 2] for k in (0, 2, 1 - wide, 1 + wide))
                images.phase_derivatives(
                    west, east, north, south, out=derivatives.T.reshape(size, 4, 2, copy=False)[1:-1]
                )
                result[:, place] = derivatives.reshape(8, -1, wide)[..., 1:-1]

        self._each(filtered, (_COUNT + 1) * 8 * (self._most + 2) * wide)
        some = np.moveaxis(self._bands[:, :, ::3, ::3], 1, -1)
        parts = (*quaternion.pack_two_sided(some[..., :4]), some[..., 4:6], some[..., 6:])
        squares = np.stack([np.median((part**2).sum(-1), (1, 2)) for part in parts], -1)
        self._floors = (_FLOOR * np.sqrt(squares)).astype(image.dtype)

    def moved(self, uv: Reals) -> Reals:
        """Return the second image resampled at the places to which the motion (2, M, N) moves the pixels."""
        if not uv.any():
            return self._second
        result: Reals = np.empty(self._second.shape, np.float32)
        in_threads(lambda place: self._sampler.rows(uv, place, result[place]), self._places, self._workers)
        return result

    def moved_at(self, uv: Reals, row: NDArray[np.intp], column: NDArray[np.intp]) -> Reals:
        """Return the same as `moved` for some pixels of the first image; `uv` is (2, n)."""
        return self._sampler.at(uv, row, column)

    def equations(self, moved: Reals, uv: Reals) -> tuple[Reals, Reals, float]:
        """Return averaged equations for a correction of the motion.

        `moved` is the second image resampled with the motion `uv`.

        Returns
        -------
        sums : array, (6, M, N)
            Results of `images.phase_equations`, averaged over neighbours; 0 where the motion leads out of the image.
        confidence : array, (M, N)
            As in `images.solve_motion`.
        noise : float
            The median over the image of the squared residual of a band, which is due to noise.
        """
        sums = np.empty((6, *moved.shape), moved.dtype)

        def compared(place: slice, memory: Reals) -> None:
            bands, rest = _bands(moved, 0, place, memory)
            total, more = sums[:, place].reshape(6, -1, copy=False), rest[: 6 * moved[place].size].reshape(6, -1)
            known = (_lines(array[:, :, place]) for array in (self._bands, self._derivatives))
            for k, (first, derivatives, second, floors) in enumerate(
                zip(*known, _lines(bands), self._floors, strict=True)
            ):
                derivatives = derivatives.reshape(-1, 4, 2, copy=False)
                images.phase_equations(first, derivatives, second, floors, out=(more if k else total).T)
                if k:
                    total += more

        self._each(compared, (8 * _COUNT + 6) * self._most * moved.shape[1])
        # Waves of amplitude 1 give sums of about 1: the second term matters only where the image is empty.
        ridge = np.asarray(1e-4 * (sums[0].mean() + sums[2].mean()) + 1e-12, moved.dtype)
        smooth = filters.smoothed(sums, _NEIGHBOURHOOD, num_threads=n_threads(self._workers))
        found = np.empty((3, *moved.shape), moved.dtype)

        def solved(place: slice) -> None:
            images.solve_motion(_lines(smooth[:, place]), ridge, out=_lines(found[:, place]))

        in_threads(solved, self._places, self._workers)
        left = smooth[5] - found[0] * smooth[3] - found[1] * smooth[4]
        noise = max(median(left) / BANDS, _LEAST_NOISE)
        smooth *= ~outside(uv)
        return smooth, found[2], noise

    def _each(self, work: Callable[[slice, Reals], None], size: int) -> None:
        """Apply `work` to all rows, with a buffer of `size` numbers for each thread."""
        free: SimpleQueue[Reals] = SimpleQueue()
        for _ in range(min(n_threads(self._workers), len(self._places))):
            free.put(np.empty(size, np.float32))

        def with_memory(place: slice) -> None:
            memory = free.get()
            try:
                work(place, memory)
            finally:
                free.put(memory)

        in_threads(with_memory, self._places, self._workers)


def _bands(image: Reals, border: int, place: slice, memory: Reals) -> tuple[Reals, Reals]:
    """Return some rows of the bands of an image, (K, 8, rows, columns), extended beyond the image by a border.

    For each frequency there are a quaternion, for diagonal waves, and waves along columns and rows. The bands are
    stored in `memory`; the rest of `memory` is returned too.
    """
    shape = (_COUNT, 8, place.stop - place.start, image.shape[1] + 2 * border)
    size = int(np.prod(shape))
    bands = memory[:size].reshape(shape)
    gabor_rows(image, _TAPS, border, place, bands)
    return bands, memory[size:]


def _lines(images: Reals) -> Reals:
    """Return images (..., K, rows, columns) as one line of K numbers per pixel, (..., n, K), as a view."""
    return np.swapaxes(images.reshape(*images.shape[:-2], -1, copy=False), -1, -2)


def median(image: Reals) -> float:
    """Return the median of an image; for large images, the median of every other row and column."""
    return float(np.median(image[::2, ::2] if image.size > _LARGE else image))


def outside(uv: Reals) -> NDArray[np.bool_]:
    """Return where a motion (2, M, N) leads out of the image."""
    rows, columns = uv.shape[1:]
    y, x = np.arange(rows, dtype=uv.dtype)[:, None] + uv[1], np.arange(columns, dtype=uv.dtype) + uv[0]
    return np.asarray((x < -0.5) | (x > columns - 0.5) | (y < -0.5) | (y > rows - 0.5))
