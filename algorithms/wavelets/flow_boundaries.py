"""Motion at boundaries: pixels choose among the motions of neighbours, and hidden pixels are detected."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from generated import filters, images

from ..arguments import Reals
from .flow_equations import Level, median, outside
from .phase import gabor_taps
from .separable import cells, half_taps

_DISTANCE = 6
"""Distance in pixels of the candidates: about how far bands and averages spread motion across a boundary."""
_ROUNDS = 2
_OTHER = 0.25
"""Squared difference, in pixels, of motions that are worth comparing."""
_LIGHT = 8.0
"""Standard deviation, in pixels, of the neighbourhood over which brightness and contrast are constant."""
_STEP = 4
"""Size of the blocks over which brightness and contrast are averaged before smoothing, in pixels."""
_WINDOW = half_taps(gabor_taps(0.0, 1.2, False)[0], np.float32)
"""A Gaussian over which differences of images are averaged: narrow, for sharp boundaries."""
_SQUARE = 11
"""Side of the squares, in pixels; windows do not extend beyond adjacent squares."""
_BETTER = 0.8
"""Another motion must reduce the differences to this fraction."""
_EXCESS = 6.0
"""Differences averaged over the window exceed noise if they are larger than this multiple of the median."""
_LEAST = 1e-5
"""Lower bound of the median of squared differences, for images of contrast 1."""
_TOLERANCE, _SHARE = 0.5, 0.01
"""Tolerance of the forward-backward check in squared pixels, and the fraction of the squared motions added to it."""


def chosen(first: Reals, level: Level, uv: Reals) -> Reals:
    """Return the motion, replaced at each pixel by that of a nearby pixel where that explains the images better.

    Parameters
    ----------
    first : array, (M, N)
    level : Level
        The level of the same image and the second one.
    uv : array, (2, M, N)

    Returns
    -------
    array, (2, M, N)
    """
    offers = [(dy * _DISTANCE, dx * _DISTANCE) for dy, dx in product((-1, 0, 1), repeat=2) if dy or dx]
    if not any(_far(other, uv).any() for other in _shifted(uv, offers)):
        return uv
    here = level.moved(uv)
    comparison = _Comparison(first, here)
    best, result = comparison.cost(here), uv.copy()
    for _ in range(_ROUNDS):
        before, own = result.copy(), best.copy()
        for other in _shifted(before, offers):
            wanted = _far(other, before)
            if wanted.any():
                # The costs of wanted pixels are averages over these pixels; elsewhere costs are not used.
                row, column = np.nonzero(_near(wanted))
                other_image = here.copy()
                other_image[row, column] = level.moved_at(other[:, row, column], row, column)
                offered = comparison.cost(other_image)
                wanted &= (offered + 0.1 * comparison.noise < best) & (offered < _BETTER * own) & ~outside(other)
                best = np.where(wanted, offered, best)
                result = np.where(wanted, other, result)
    return result


def visible(forward: Reals, backward: Reals, first: Reals, here: Reals) -> NDArray[np.bool_]:
    """Return which pixels of the first image are visible in the second one.

    Parameters
    ----------
    forward, backward : array, (2, M, N)
        The forward motion, from the first image to the second one, and the backward motion.
    first, here : array, (M, N)
        The first image, and the second one resampled with the forward motion.

    Notes
    -----
    A pixel is visible if its motion ends inside the image and one of two conditions holds. Either the backward motion
    leads to where the forward motion started, or the images agree and no other pixel moves to the same place; the
    second condition is needed because boundaries of the backward motion may be less sharp.
    """
    y, x = np.indices(first.shape, np.float32) + forward[::-1]
    back = _followed(backward, forward)
    allowed = _TOLERANCE + _SHARE * ((forward**2).sum(0) + (back**2).sum(0))
    inside = ~outside(forward)
    confirmed = (((forward + back) ** 2).sum(0) <= allowed) & inside
    rows, columns = (np.clip(np.rint(p).astype(int), 0, n - 1) for p, n in zip((y, x), first.shape, strict=True))
    taken = np.zeros(first.shape, bool)
    taken[rows[confirmed], columns[confirmed]] = True
    comparison = _Comparison(first, here)
    agrees = comparison.cost(here) <= _EXCESS * comparison.noise
    return np.asarray(confirmed | (agrees & ~taken[rows, columns] & inside))


def _followed(backward: Reals, forward: Reals) -> Reals:
    """Return the backward motion, (2, M, N), at the end points of the forward motion."""
    rows, columns = forward.shape[1:]
    padded = np.pad(backward, [(0, 0), (0, 1), (0, 1)], "edge")
    # u of a pixel and of the next one, and v of both.
    table = np.stack([padded[0, :, :-1], padded[0, :, 1:], padded[1, :, :-1], padded[1, :, 1:]], -1).reshape(-1, 4)
    (left, x), (top, y) = cells(forward, np.arange(rows)[:, None], np.arange(columns), (rows, columns))
    place, parts = (top * columns + left).reshape(-1), (x.reshape(-1), y.reshape(-1))
    found = images.motion_samples(table[:-columns], table[columns:], place, *parts)
    return np.moveaxis(found.reshape(rows, columns, 2), -1, 0)


class _Comparison:
    """Squared differences between the first image and the second one for any motion.

    `here` is the second image resampled with the current motion, from which brightness and contrast are adapted.
    """

    def __init__(self, first: Reals, here: Reals) -> None:
        self._first = first
        self._gain, self._offset = _light(first, here)
        self.noise = max(median(self._squares(here)), _LEAST)

    def cost(self, moved: Reals) -> Reals:
        """Return differences averaged over a few pixels, each clipped to a bound."""
        squares = np.minimum(self._squares(moved), np.float32(36 * self.noise + 0.05))
        return filters.smoothed(squares, _WINDOW)

    def _squares(self, moved: Reals) -> Reals:
        return np.asarray((self._first - self._gain * moved - self._offset) ** 2)


def _light(first: Reals, second: Reals) -> tuple[Reals, Reals]:
    """Return the local gain and offset that give the second image the brightness and contrast of the first one.

    They vary slowly and are computed from coarse images, in which each pixel is the mean of a square.
    """
    across, down = (_coarse_gaussian(size) for size in first.shape[::-1])

    def mean(image: Reals) -> Reals:
        return down.smooth @ _reduced(_reduced(image).T).T @ across.smooth.T

    a, b = mean(first), mean(second)
    # Where there is no contrast, the gain is 1.
    least = np.float32(0.01 * second.var() + 1e-12)
    gain = (mean(first * second) - a * b + least) / (mean(second * second) - b * b + least)
    gain, offset = (down.enlarge @ coarse @ across.enlarge.T for coarse in (gain, a - gain * b))
    return gain, offset


class _CoarseGaussian(NamedTuple):
    """Matrices that smooth a line of means of `_STEP` numbers each, and that interpolate between these means."""

    smooth: Reals
    enlarge: Reals


@lru_cache(64)
def _coarse_gaussian(size: int) -> _CoarseGaussian:
    count = -(-size // _STEP)
    identity = np.eye(count)
    smooth = scipy.ndimage.gaussian_filter1d(identity, _LIGHT / _STEP, axis=0, mode="nearest")
    middles = np.arange(count) * _STEP + (_STEP - 1) / 2
    enlarge = np.stack([np.interp(np.arange(size), middles, row) for row in identity], -1)
    return _CoarseGaussian(smooth.astype(np.float32), enlarge.astype(np.float32))


def _reduced(image: Reals) -> Reals:
    """Return means of `_STEP` rows each; the last row is repeated."""
    missing = -len(image) % _STEP
    if missing:
        image = np.concatenate([image, np.repeat(image[-1:], missing, 0)])
    return np.asarray(sum(image[k::_STEP] for k in range(_STEP)) / np.float32(_STEP))


def _shifted(uv: Reals, offers: Sequence[tuple[int, int]]) -> list[Reals]:
    """Return the motions of pixels at these offsets in rows and columns, as views."""
    padded = np.pad(uv, [(0, 0), (_DISTANCE, _DISTANCE), (_DISTANCE, _DISTANCE)], "edge")
    rows, columns = uv.shape[1:]
    starts = [(_DISTANCE + down, _DISTANCE + across) for down, across in offers]
    return [padded[:, top : top + rows, left : left + columns] for top, left in starts]


def _near(wanted: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the pixels in all squares of the size of a window that contain, or adjoin a square with, wanted pixels."""
    rows, columns = wanted.shape
    padded = np.pad(wanted, [(0, -rows % _SQUARE), (0, -columns % _SQUARE)])
    squares = padded.reshape(padded.shape[0] // _SQUARE, _SQUARE, -1, _SQUARE).any((1, 3))
    squares = scipy.ndimage.binary_dilation(squares, np.ones((3, 3), bool))
    return np.asarray(squares.repeat(_SQUARE, 0).repeat(_SQUARE, 1)[:rows, :columns])


def _far(a: Reals, b: Reals) -> NDArray[np.bool_]:
    return np.asarray(((a - b) ** 2).sum(0) > _OTHER)
