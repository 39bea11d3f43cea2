"""What matching needs of a scan: points with normals, samples of equal spacing, and the histogram of directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from generated import mapping as kernels

from ..arguments import Reals
from .free_space import sight_of
from .narrow_objects import narrow_objects
from .scan import Scan
from .segments import TOLERANCE

BINS = 360
"""Bins of the histogram of directions over a full turn."""
MOST_POINTS = 190
"""Scans with more points are thinned after their lines are found."""
_FEWEST = 20
"""Narrow objects in front of others, such as people, are left out if at least this many readings remain."""
_NOWHERE = 1e9
"""Metres, farther than any scanner reaches."""
_BLUR = 2.0
"""Standard deviation of the smoothing of histograms, in bins."""

_bins = np.minimum(np.arange(BINS), BINS - np.arange(BINS))
_KERNEL = np.fft.rfft(np.exp(-0.5 * (_bins / _BLUR) ** 2))
"""The Fourier transform of the Gaussian with which histograms are smoothed."""


class Outline(NamedTuple):
    """The outline of the surroundings that a scan shows, without narrow objects in front of others.

    Attributes
    ----------
    scan : Scan
    stride : int
        Every so many readings are kept.
    points, normals : arrays, (k, 2)
        Readings, and unit normals away from the scanner.
    on_line : array, (k,)
        Whether the readings are on lines.
    rows : array, (k, 6)
        Points, normals, weights of distances at right angles to them, and of points, for the kernel `step_between`.
    targets : array, (k, 5)
        Points, normals, and factors of squared distances, for the kernel `nearest`.
    few : array, (k // 2, 5)
        Every other target, for coarse comparisons.
    fours, few_fours : arrays, (f, 4, 5)
        The same in rows of four, for the kernel `nearest_square`.
    lines : array, (l, 5)
        Long lines, as targets with the factor 0.
    samples : array, (s, 2)
        Points of equal spacing along the lines, and the points off lines.
    histogram : array, (BINS // 2 + 1,)
        The Fourier transform of the histogram of directions of normals.
    closest : array, (n,)
        For each beam, the least range of it and its neighbours; 0 where none is measured.
    """

    scan: Scan
    stride: int
    points: Reals
    normals: Reals
    on_line: Reals
    rows: Reals
    targets: Reals
    few: Reals
    fours: Reals
    few_fours: Reals
    lines: Reals
    samples: Reals
    histogram: Reals
    closest: Reals


def outline_of(scan: Scan) -> Outline:
    """Compute the outline of a scan with at least two valid readings."""
    points = still_points(scan)
    sums = kernels.prefix_sums(points)
    bounds = kernels.straight_bounds(points, sums, TOLERANCE)
    stride = 1 + len(points) // MOST_POINTS
    surface, targets, lines, steps = kernels.outline_of_runs(points, sums, bounds, float(stride))
    if stride > 1:
        surface, targets = (np.ascontiguousarray(each[::stride]) for each in (surface, targets))
    on_line = surface[:, 5] == 1
    counts = steps[:, 2].astype(int)
    index = np.repeat(np.arange(len(points)), counts)
    fraction = (np.arange(len(index)) - (np.cumsum(counts) - counts)[index]) / counts[index]
    few = _thinned(targets, on_line)
    long = lines[lines[:, 4] > 0]
    long[:, 4] = 0
    return Outline(
        scan,
        stride,
        np.ascontiguousarray(surface[:, :2]),
        surface[:, 2:4],
        on_line,
        surface,
        targets,
        few,
        in_fours(targets),
        in_fours(few),
        long,
        points[index] + fraction[:, None] * steps[index, :2],
        _histogram(steps[:, 3], steps[:, 4]),
        sight_of(scan).closest,
    )


def still_points(scan: Scan) -> Reals:
    """Return the readings without narrow objects in front of others, or all if too few would remain."""
    still = ~narrow_objects(scan)
    return scan.points()[still] if still.sum() > _FEWEST else scan.points()


def in_fours(targets: Reals) -> Reals:
    """Return targets (m, 5) in rows of four, the last of which may have points far away."""
    padded = np.full((-(-len(targets) // 4) * 4, 5), _NOWHERE)
    padded[: len(targets)] = targets
    return padded.reshape(-1, 4, 5)


def _thinned(targets: Reals, on_line: Reals) -> Reals:
    few = targets[::2].copy()
    few[:, 4] = np.where(on_line[::2], few[:, 4] / 4, 1.0)
    return few


def _histogram(angles: Reals, weights: Reals) -> Reals:
    """Return the transform of the root of the smoothed histogram of directions, weighted by length."""
    bins = np.floor(angles * (BINS / (2 * np.pi))).astype(int) % BINS
    smooth = np.fft.irfft(np.fft.rfft(np.bincount(bins, weights, BINS)) * _KERNEL, BINS)
    return np.asarray(np.fft.rfft(np.sqrt(np.maximum(smooth, 0))))
