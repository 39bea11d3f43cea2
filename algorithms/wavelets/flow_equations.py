"""Equations for the motion between two images, one level of a pyramid at a time."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generated import images

from ..arguments import Reals

_OFFSET = 80
"""Numbers between planes: five lines of a cache."""
LARGE = 2**14
"""Number of values above which a quarter of them suffices for a median."""
_LINES = 64
"""A limit on work: some so many rows and columns decide whether structure is too fine for a coarser level."""
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
_NEAR = half_gaussian(1.5, 6) * np.float32(2**0.5)
"""A Gaussian over which equations of half of the pixels are averaged."""
_STRUCTURE_OF_NOISE = 2.2067
"""Mean square of a derivative that white noise alone exceeds with a probability of 1/1000, if that of differences is 1.

The unit is the least mean squared difference of the two images at the same place, as noise may vary. The derivative is
that of their mean, whose variance is a quarter of that of the difference. The number follows from the filters above and
from the distribution of F; a test computes it.
"""


class Level:
    """One level of the pyramid: two images, and their comparison for a given motion.

    Motions are stored at every other row and column, the nodes, because equations are averaged over more pixels than
    that. The images are compared at the nodes and in the middles of four nodes. Of such noise as is left by the filter,
    this half of the pixels determines averages nearly as well as all of them.

    Parameters
    ----------
    pair : array, (2, M, N)
        The images, in single precision, with contrast 1.
    threads : int
    """

    def __init__(self, pair: Reals, threads: int) -> None:
        self._shape, self._threads = pair.shape[1:], threads
        here, there = images.band(pair, _FINE, _COARSE, num_threads=threads)
        self._there = _planes(6, there.shape)
        images.jets(there, out=tuple(self._there))
        rows, columns = self._shape
        self._nodes = -(-rows // 2), -(-columns // 2)
        sizes = list(zip(self._nodes, self._shape, strict=True))
        self._last = np.array([columns - 1, rows - 1], np.float32)
        self._places = [
            [np.minimum(np.arange(k, 2 * count, 2), size - 1).astype(np.float32) for count, size in sizes]
            for k in range(2)
        ]
        parts = [self._padded(part) for part in (here, *images.slopes(here))]
        self._here = [[part[k::2, k::2].reshape(-1) for part in parts] for k in range(2)]
        self._terms = [_planes(6, self._nodes) for _ in range(2)]

    def _padded(self, plane: Reals) -> Reals:
        """Return a plane (M, N), and its last row or column twice if their number is odd."""
        rows, columns = self._shape
        return np.pad(plane, [(0, rows % 2), (0, columns % 2)], "edge") if rows % 2 or columns % 2 else plane

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
        even, odd = self._terms
        for k in range(2):
            out = tuple(self._terms[k].reshape(6, -1))
            images.motion_terms(*self._there.reshape(6, -1), *self._ends(motion, k), *self._here[k], out=out)
        sums = images.averaged(even, odd, _NEAR, num_threads=self._threads)
        # Contrasts of 1 give sums of about 1: the second term matters only where the image is empty.
        ridge = np.float32(1e-4 * (sums[0].mean() + sums[2].mean()) + 1e-12)
        left, least = images.motion_evidence(sums.reshape(6, -1).T, ridge).T.reshape(2, *self._nodes)
        structure = np.maximum(least - _STRUCTURE_OF_NOISE * left, 0)
        return sums, structure / (structure + left + ridge), max(median(left), _LEAST_NOISE)

    def _ends(self, motion: Reals, k: int) -> tuple[Any, ...]:
        """Return the pixels where motions end, the distances from them, and 1 inside the image, else 0.

        The motions are those of the nodes or, for k = 1, of the pixels between four nodes.
        """
        rows, columns = self._places[k]
        at = _between(motion) if k else motion
        i, j, right, down, known = images.motion_ends(at[0], at[1], rows, columns, self._last)
        row, column = i.astype(np.intp), j.astype(np.intp)
        row *= self._shape[1]
        row += column
        return tuple(part.reshape(-1) for part in (row, right, down, known))

    def pixels(self, motion: Reals) -> Reals:
        """Return the motion (..., m, n) of the nodes, interpolated between them, for all pixels."""
        return enlarged(motion)[..., : self._shape[0], : self._shape[1]]


def _between(motion: Reals) -> Reals:
    """Return the motion (2, m, n) in the middle of four nodes; beyond the last ones, that of these."""
    for axis in (1, 2):
        after = motion.copy()
        lines, found = motion.swapaxes(0, axis), after.swapaxes(0, axis)
        found[:-1] += lines[1:]
        found[:-1] *= np.float32(0.5)
        motion = after
    return motion


def _planes(count: int, shape: tuple[int, ...]) -> Reals:
    """Return an array (count, M, N) for single precision whose planes begin at different places of lines of a cache.

    Kernels read the same place of all planes; if sizes are powers of 2, these would displace each other.
    """
    size = int(np.prod(shape))
    return np.empty((count, size + _OFFSET), np.float32)[:, :size].reshape(count, *shape, copy=False)


def halved(pair: Reals, threads: int) -> Reals:
    """Return every other pixel of smoothed images (2, M, N), starting at the first row and the first column."""
    even = np.pad(pair, [(0, 0), (0, 1), (0, 0)], "edge") if pair.shape[1] % 2 else pair
    means = images.pair_means(even[:, ::2], even[:, 1::2], _HALVING, num_threads=threads)
    return np.ascontiguousarray(means[..., ::2])


def too_fine(pair: Reals) -> bool:
    """Return whether most of the structure of images (2, M, N) along an axis is lost in `halved` ones.

    Waves shorter than two pixels of these become longer ones, which move differently, and differences of pixels say
    little about waves shorter than three pixels of these, of frequency ``w = pi/3`` here. The squares of second and
    first differences are as ``(1 - cos w)^2`` to ``(sin w)^2``, which is 1 to 3 there.
    """
    taps = np.concatenate([_SEEN[:0:-1], _SEEN])
    for every in (pair, pair.swapaxes(1, 2)):
        lines = every[:, :: max(every.shape[1] // _LINES, 1)]
        # Edges are left out: what is beyond them is unknown.
        count = lines.shape[-1] - 2 * _REACH
        smooth = sum(tap * lines[..., k : k + count] for k, tap in enumerate(taps)) if count > 0 else lines[..., :0]
        slope = smooth[..., 2:] - smooth[..., :-2]
        bend = smooth[..., 2:] + smooth[..., :-2] - 2 * smooth[..., 1:-1]
        if 3 * np.vdot(bend, bend) > np.vdot(slope, slope):
            return True
    return False


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
    return float(np.median(values[::2, ::2] if values.size > LARGE else values))


def widened(mask: NDArray[np.bool_], axis: int, distance: int = 1) -> NDArray[np.bool_]:
    """Return where a mask is true within a distance along an axis."""
    wide = mask.copy()
    found, lines = np.moveaxis(wide, axis, 0), np.moveaxis(mask, axis, 0)
    for k in range(1, distance + 1):
        found[k:] |= lines[:-k]
        found[:-k] |= lines[k:]
    return wide


def outside(uv: Reals) -> NDArray[np.bool_]:
    """Return where a motion (2, M, N) leads out of the image."""
    rows, columns = uv.shape[1:]
    y, x = np.arange(rows, dtype=uv.dtype)[:, None] + uv[1], np.arange(columns, dtype=uv.dtype) + uv[0]
    return np.asarray((x < -0.5) | (x > columns - 0.5) | (y < -0.5) | (y > rows - 0.5))
