"""What matching needs of a scan: points with normals, samples of equal spacing, and the histogram of directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arguments import Reals
from .narrow_objects import narrow_objects
from .scan import Scan
from .segments import Runs, straight_runs

BINS = 360
"""Bins of the histogram of directions over a full turn."""
_MOST_POINTS = 190
"""Scans with more points are thinned after their lines are found."""
_SPACING, _MOST = 0.15, 8
"""Distance between samples of lines in metres, and the most of them between two points."""
_NEAR = 0.3
"""Metres up to which neighbouring points off lines count as one surface."""
_LEAST_POINTS, _LEAST_LENGTH, _ROUGHNESS = 4, 0.2, 0.04
"""What makes a run a line: its points, its length, and its deviation in metres."""
_FEWEST = 20
"""Narrow objects in front of others, such as people, are left out if at least this many readings remain."""
_LONG = 1.0
"""Length of lines that are expected to continue, in metres."""
_REACH = 0.1
"""Half of the length of line, in metres, that a point represents without a loss in distance."""
_ALONG_LINES, _ALONG_POINTS = 0.001, 0.6
"""Weights of distances at right angles to the normals."""
_BLUR = 2.0
"""Standard deviation of the smoothing of histograms, in bins."""

_bins = np.minimum(np.arange(BINS), BINS - np.arange(BINS))
_KERNEL = np.fft.rfft(np.exp(-0.5 * (_bins / _BLUR) ** 2))


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
    along, weights : arrays, (k,)
        Weights of distances at right angles to the normals, and of points.
    targets : array, (k, 5)
        Points, normals, and factors of squared distances, for the kernel `nearest`.
    few : array, (k // 2, 5)
        Every other target, for coarse comparisons.
    lines : array, (l, 5)
        Long lines, as targets with the factor 0.
    samples : array, (s, 2)
        Points of equal spacing along the lines, and the points off lines.
    histogram : array, (BINS // 2 + 1,)
        The Fourier transform of the histogram of directions of normals.
    closest : array, (n,)
        For each beam, the least range of it and its neighbours; infinite where none is measured.
    """

    scan: Scan
    stride: int
    points: Reals
    normals: Reals
    on_line: Reals
    along: Reals
    weights: Reals
    targets: Reals
    few: Reals
    lines: Reals
    samples: Reals
    histogram: Reals
    closest: Reals


def outline_of(scan: Scan) -> Outline:
    """Compute the outline of a scan with at least two valid readings."""
    points = still_points(scan)
    n = len(points)
    runs = straight_runs(points)
    is_line = _lines(points, runs)
    own = _run_of_points(runs, is_line, n)
    on_line = is_line[own]
    radial = points / np.sqrt(np.einsum("ij,ij->i", points, points))[:, None]
    normals = np.where(on_line[:, None], runs.fits.normals[own], radial)
    steps = points[1:] - points[:-1]
    gaps = np.sqrt(np.einsum("ij,ij->i", steps, steps))
    of_step = np.repeat(np.arange(len(is_line)), runs.last - runs.first)
    along_line = is_line[of_step]
    line_gaps = np.where(along_line, gaps, 0.0)
    spacing = 0.6 * np.maximum(np.append(line_gaps, 0), np.append(0, line_gaps))
    stride = 1 + n // _MOST_POINTS
    keep = slice(None, None, stride)
    spacing = np.clip(stride * spacing, _REACH, 3.0)
    factors = np.where(on_line, (_REACH / spacing) ** 2, 1.0)
    targets = np.column_stack([points, normals, factors])[keep]
    counts = np.where(along_line, np.clip(np.ceil(gaps / _SPACING), 1, _MOST), 1).astype(int)
    index = np.repeat(np.arange(n - 1), counts)
    fraction = (np.arange(len(index)) - (np.cumsum(counts) - counts)[index]) / counts[index]
    return Outline(
        scan,
        stride,
        points[keep],
        normals[keep],
        on_line[keep],
        np.where(on_line, _ALONG_LINES, _ALONG_POINTS)[keep],
        np.where(on_line, 1.0, 0.5)[keep],
        targets,
        _thinned(targets, on_line[keep]),
        _long_lines(points, runs, is_line),
        points[index] + fraction[:, None] * steps[index],
        _histogram(points, steps, gaps, along_line, runs.fits.normals[of_step]),
        _closest(scan),
    )


def still_points(scan: Scan) -> Reals:
    """Return the readings without narrow objects in front of others, or all if too few would remain."""
    still = ~narrow_objects(scan)
    return scan.points()[still] if still.sum() > _FEWEST else scan.points()


def _thinned(targets: Reals, on_line: Reals) -> Reals:
    few = targets[::2].copy()
    few[:, 4] = np.where(on_line[::2], few[:, 4] / 4, 1.0)
    return few


def _lines(points: Reals, runs: Runs) -> Reals:
    across = points[runs.last] - points[runs.first]
    counts = runs.last + 1 - runs.first
    long = np.einsum("ij,ij->i", across, across) > _LEAST_LENGTH**2
    return np.asarray((counts >= _LEAST_POINTS) & long & (runs.fits.squares[:, 0] < _ROUGHNESS**2))


def _long_lines(points: Reals, runs: Runs, is_line: Reals) -> Reals:
    across = points[runs.last] - points[runs.first]
    long = is_line & (np.einsum("ij,ij->i", across, across) > _LONG**2)
    return np.column_stack([runs.fits.means[long], runs.fits.normals[long], np.zeros(int(long.sum()))])


def _run_of_points(runs: Runs, is_line: Reals, n: int) -> Reals:
    """Return the run of each point; a shared end belongs to the line with more points."""
    own = np.repeat(np.arange(len(is_line)), np.diff(np.append(runs.first, n)))
    size = np.where(is_line, runs.last - runs.first, 0)
    before = np.flatnonzero(size[:-1] > size[1:])
    own[runs.first[before + 1]] = before
    return own


def _histogram(points: Reals, steps: Reals, gaps: Reals, along_line: Reals, line_normals: Reals) -> Reals:
    """Return the transform of the root of the smoothed histogram of directions, weighted by length."""
    side = np.sign(points[:-1, 0] * points[1:, 1] - points[:-1, 1] * points[1:, 0])
    x = np.where(along_line, line_normals[:, 0], side * steps[:, 1])
    y = np.where(along_line, line_normals[:, 1], -side * steps[:, 0])
    bins = np.floor(np.arctan2(y, x) * (BINS / (2 * np.pi))).astype(int) % BINS
    weights = np.where(along_line, np.minimum(gaps, 1.0), np.where(gaps < _NEAR, 0.3 * gaps, 0.0))
    counts = np.bincount(bins, weights, BINS)
    smooth = np.fft.irfft(np.fft.rfft(counts) * _KERNEL, BINS)
    return np.asarray(np.fft.rfft(np.sqrt(np.maximum(smooth, 0))))


def _closest(scan: Scan) -> Reals:
    ranges = np.full(len(scan) + 2, np.inf)
    ranges[1:-1][scan.beams] = scan.ranges[scan.beams]
    return np.asarray(np.minimum(np.minimum(ranges[:-2], ranges[1:-1]), ranges[2:]))
