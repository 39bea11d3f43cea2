"""Votes of two outlines for rotations and translations between them."""

from __future__ import annotations

import numpy as np
import scipy

from generated import pga2

from ..arguments import Reals
from .outlines import BINS, Outline

_MOST_ROTATIONS = 8
"""A limit on work: the number of rotations for which translations are voted."""
_ROTATION_SHARE, _ROTATION_GAP = 0.4, 5
"""Peaks of rotations have at least this share of the votes of the largest one, and distance in bins."""
_CELLS, _CELL = 64, 0.2
"""Cells along an axis of the periodic grid of translations, a power of two, and their size in metres."""
_LAST = _CELLS - 1
"""The number of the last cell, also for the remainder of numbers of cells."""
_BEFORE, _AFTER = np.arange(-1, _LAST) & _LAST, np.arange(1, _CELLS + 1) & _LAST
"""The neighbours of cells along an axis."""
_LARGEST = 1e15
"""From floating point: larger numbers of cells are no integers."""
_TRANSLATION_SHARE, _MOST_MOTIONS = 0.6, 40
"""Peaks of translations have more than this share of the votes of the largest one. A limit on work: the number of
motions."""


def rotation_votes(a: Outline, b: Outline) -> Reals:
    """Return the rotations from `b` to `a`, in radians, for which most pairs of directions vote.

    Every pair of pieces of the outlines votes for the angle between its normals with the product of their weights, so
    that the votes are the circular correlation of the histograms of directions.
    """
    votes = np.fft.irfft(a.histogram * np.conj(b.histogram), BINS)
    peaks = np.flatnonzero((votes >= np.roll(votes, 1)) & (votes >= np.roll(votes, -1)))
    peaks = peaks[np.argsort(-votes[peaks])]
    kept: list[int] = []
    for k in peaks.tolist():
        if votes[k] < _ROTATION_SHARE * votes[peaks[0]] or len(kept) == _MOST_ROTATIONS:
            break
        if all(abs((k - j + BINS // 2) % BINS - BINS // 2) > _ROTATION_GAP for j in kept):
            kept.append(k)
    at = np.array(kept)
    before, here, after = votes[at - 1], votes[at], votes[(at + 1) % BINS]
    vertex = 0.5 * (before - after) / np.minimum(before - 2 * here + after, -1e-12)
    return np.asarray((at + vertex) * (2 * np.pi / BINS))


def motion_votes(a: Outline, b: Outline, rotations: Reals) -> Reals:
    """Return motors (k, 4) from `b` to `a` for which most samples of `b` fall near samples of `a`, best first.

    Translations are voted for on a periodic grid: the cell of largest motion is that of half its size.
    """
    near = _occupied(a.samples)
    cosines, sines = np.cos(rotations)[:, None], np.sin(rotations)[:, None]
    x, y = b.samples.T
    column, row = _on_grid(cosines * x - sines * y), _on_grid(sines * x + cosines * y)
    n, size = len(rotations), _CELLS * _CELLS
    place = np.arange(n)[:, None] * size + row * _CELLS + column
    counts = np.bincount(place.ravel(), minlength=n * size).reshape(n, _CELLS, _CELLS).astype(np.float32)
    transformed = scipy.fft.rfft2(near) * np.conj(scipy.fft.rfft2(counts))
    votes = scipy.fft.irfft2(transformed, (_CELLS, _CELLS))
    flat = votes.ravel()
    at = np.flatnonzero(flat > _TRANSLATION_SHARE * flat.max())
    at = at[(flat[at] >= flat[_beside(at)]).all(0)]
    at = at[np.argsort(-flat[at])][:_MOST_MOTIONS]
    of, cell = np.divmod(at, size)
    shift = np.stack(np.divmod(cell, _CELLS)[::-1], 1)
    shift = (shift + _CELLS // 2) % _CELLS - _CELLS // 2
    return np.asarray(pga2.motor_from_angle_translation(rotations[of], shift * _CELL))


def _on_grid(coordinates: Reals) -> Reals:
    """Return columns or rows of the periodic grid; coordinates beyond those of integers are brought there."""
    return np.floor(np.clip(coordinates / _CELL, -_LARGEST, _LARGEST)).astype(int) & _LAST


def _beside(at: Reals) -> Reals:
    """Return the cells beside others, of the same rotation, on the periodic grid."""
    column, row = at % _CELLS, at // _CELLS % _CELLS
    grid = at - row * _CELLS - column
    left, right, above, below = (column - 1) % _CELLS, (column + 1) % _CELLS, row - 1, row + 1
    above, below = grid + above % _CELLS * _CELLS, grid + below % _CELLS * _CELLS
    here = grid + row * _CELLS
    pairs = [(here, left), (here, right), (above, column), (below, column)]
    pairs += [(above, left), (above, right), (below, left), (below, right)]
    return np.array([line + cell for line, cell in pairs])


def _occupied(samples: Reals) -> Reals:
    """Return a periodic grid: 1 in cells with samples, a half beside them."""
    column, row = _on_grid(samples).T
    grid = np.zeros((_CELLS, _CELLS), np.float32)
    grid[row, column] = 1
    for axis in (0, 1):
        beside = np.maximum(grid.take(_BEFORE, axis), grid.take(_AFTER, axis))
        grid = np.maximum(grid, np.float32(0.5) * beside)
    return grid
