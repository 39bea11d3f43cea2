"""Equations for the motion between two images, one level of a pyramid at a time."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from generated import filters, images

from ..arguments import Reals

_LARGE = 2**14
"""Number of values above which a quarter of them suffices for a median."""
_LEAST_NOISE = 1e-6
"""Squared difference of images of contrast 1 after rounding to bytes, averaged over neighbours."""


@lru_cache
def half_gaussian(sigma: float, reach: int) -> Reals:
    """Return a Gaussian from its middle to the distance `reach`; the whole one has the sum 1."""
    values = np.exp(-(np.arange(reach + 1) ** 2) / (2 * sigma**2))
    return (values / (2 * values.sum() - 1)).astype(np.float32)


_FINE, _COARSE = half_gaussian(0.7, 10), half_gaussian(2.0, 10)
"""The images that are compared are the difference of both, without noise between pixels and without brightness."""
_NEIGHBOURHOOD = half_gaussian(1.5, 5)
"""A Gaussian over which equations are averaged."""


class Level:
    """One level of the pyramid: two images, and their comparison for a given motion.

    Motions are stored at every other pixel in both directions, the nodes, because equations are averaged over more
    pixels than that.

    Parameters
    ----------
    first, second : array, (M, N)
        In single precision, with contrast 1.
    """

    def __init__(self, first: Reals, second: Reals) -> None:
        rows, columns = first.shape
        self._first = np.pad(_filtered(first), [(0, rows % 2), (0, columns % 2)], "edge")
        self._second = _doubled(_filtered(second))
        wide, self._last = self._first.shape, np.array([columns - 1, rows - 1], np.float32)
        self.shape, self.nodes = first.shape, (wide[0] // 2, wide[1] // 2)
        self._rows, self._columns = (np.arange(size, dtype=np.float32) for size in wide)
        self._pixels: Reals = np.empty((2, *wide), np.float32)
        self._terms: Reals = np.empty((6, *wide), np.float32)

    def equations(self, motion: Reals) -> tuple[Reals, Reals, float]:
        """Return averaged equations for a correction of the motion of the nodes.

        Returns
        -------
        sums : array, (6, m, n)
            Results of `images.motion_terms`, averaged over neighbours.
        confidence : array, (m, n)
            As in `images.motion_confidence`.
        noise : float
            The median over the image of the least squared difference, which is due to noise.
        """
        u, v = enlarged(motion, out=self._pixels)
        images.motion_terms(
            self._second, self._first, u, v, self._rows, self._columns, self._last, out=tuple(self._terms)
        )
        sums: Reals = np.empty((6, *self.nodes), np.float32)
        for terms, result in zip(self._terms, sums, strict=True):
            result[...] = images.pair_means(terms[::2], terms[1::2], _NEIGHBOURHOOD)[:, ::2]
        # Contrasts of 1 give sums of about 1: the second term matters only where the image is empty.
        ridge = np.float32(1e-4 * (sums[0].mean() + sums[2].mean()) + 1e-12)
        lines = sums.reshape(6, -1).T
        left, confidence = images.motion_confidence(lines, ridge).T.reshape(2, *self.nodes)
        return sums, confidence, max(median(left), _LEAST_NOISE)

    def pixels(self, motion: Reals) -> Reals:
        """Return the motion (2, m, n) of the nodes, interpolated between them, for all pixels."""
        return enlarged(motion)[:, : self.shape[0], : self.shape[1]]


def _filtered(image: Reals) -> Reals:
    return np.asarray(filters.smoothed(image, _FINE) - filters.smoothed(image, _COARSE))


@lru_cache
def _between() -> Reals:
    """Return the taps that interpolate half a pixel away from the nearest one by cubic splines."""
    impulse = np.zeros(4 * images_reach() + 1)
    impulse[2 * images_reach()] = 1
    places = 2 * images_reach() + 0.5 + np.arange(images_reach())
    taps = scipy.ndimage.map_coordinates(impulse, places[None], order=3)
    return (taps / (2 * taps.sum())).astype(np.float32)


def images_reach() -> int:
    """Return the number of neighbours on one side from which `images.halfway` interpolates."""
    return 5


def _doubled(image: Reals) -> Reals:
    """Return an image with twice as many rows and columns; beyond the last ones it is mirrored."""
    result: Reals = np.empty((2 * image.shape[0], 2 * image.shape[1]), np.float32)
    result[::2, ::2] = image
    result[::2, 1::2], result[1::2, ::2], result[1::2, 1::2] = images.halfway(image, _between())
    return result


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
