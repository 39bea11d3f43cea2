"""Lines of scans by split and merge, fitted by total least squares from prefix sums."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from generated import mapping as kernels

from ..arguments import Reals, finite_number
from .scan import Scan

TOLERANCE = 0.06
"""Largest distance of points from the chord of their run, in metres."""
_SMALLEST_DEVIATION = 0.005
"""Metres; measured deviations of few points may be accidentally small."""


@dataclass(frozen=True, eq=False)
class Segments:
    """Straight pieces of an outline, in the order of the beams.

    Attributes
    ----------
    normals : array, (k, 2)
        Unit normals, away from the scanner.
    offsets : array, (k,)
        Distances from the origin: the points of a line satisfy ``normal . x = offset``.
    ends : array, (k, 2, 2)
        The first and the last point, projected onto the line.
    covariances : array, (k, 2, 2)
        Of the angle of the normal, in radians, and of the offset, in metres.
    counts : array, (k,)
        The number of points of each line.
    deviations : array, (k,)
        Root mean square of the distances of the points from the line, in metres.
    first : array, (k,)
        Row of the first point of each line among the points of the scan.
    """

    normals: Reals
    offsets: Reals
    ends: Reals
    covariances: Reals
    counts: Reals
    deviations: Reals
    first: Reals

    def __len__(self) -> int:
        """Return the number of segments."""
        return len(self.offsets)

    @property
    def lengths(self) -> Reals:
        """(k,) The lengths in metres."""
        return np.asarray(np.linalg.norm(self.ends[:, 1] - self.ends[:, 0], axis=1))


class Fits(NamedTuple):
    """Lines of runs: unit normals, offsets, means, and mean squares off and along the line."""

    normals: Reals
    offsets: Reals
    means: Reals
    squares: Reals


class Runs(NamedTuple):
    """Straight runs of consecutive points, neighbours sharing their end: the rows of ends, and the lines."""

    first: Reals
    last: Reals
    fits: Fits


def segments(scan: Scan, *, tolerance: float = TOLERANCE, min_length: float = 0.3, min_points: int = 4) -> Segments:
    """Find the straight pieces of a scan.

    Runs of points are split at the point farthest from the chord between their ends, all runs at once, and neighbours
    are merged if one line fits both. The line of a run follows from prefix sums in constant time.

    Parameters
    ----------
    scan : Scan
    tolerance : float
        Largest distance of points from the chord of their run, in metres.
    min_length : float
        Shortest segment, in metres.
    min_points : int
        Fewest points of a segment, at least 3.

    Returns
    -------
    Segments
        Without rows if the scan has no straight piece.

    Raises
    ------
    ValueError
        If a parameter is not positive, or `min_points` less than 3.
    """
    if finite_number(tolerance, "tolerance") <= 0 or finite_number(min_length, "min_length") <= 0:
        raise ValueError(f"tolerance, min_length: {tolerance}, {min_length}; expected positive lengths in metres")
    if min_points < 3:
        raise ValueError(f"min_points: {min_points}; expected at least 3, which two points on a line are not")
    points = scan.points()
    return _chosen(points, straight_runs(points, tolerance), min_length, min_points)


def straight_runs(points: Reals, tolerance: float = TOLERANCE) -> Runs:
    """Divide points, in their order, into runs that are straight up to a tolerance."""
    if len(points) < 2:
        none = np.zeros(0, int)
        return Runs(none, none, Fits(np.zeros((0, 2)), np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2))))
    sums = np.asarray(kernels.prefix_sums(points))
    bounds = np.flatnonzero(kernels.straight_bounds(points, sums, tolerance))
    sums = np.concatenate([np.zeros((1, 5)), sums])
    return Runs(bounds[:-1], bounds[1:], _fits(sums, bounds[:-1], bounds[1:]))


def _fits(sums: Reals, first: Reals, last: Reals) -> Fits:
    return Fits(*kernels.line_of_run(sums[first], sums[last + 1], last + 1.0 - first))


def _chosen(points: Reals, runs: Runs, min_length: float, min_points: int) -> Segments:
    first, last, fits = runs.first, runs.last, runs.fits
    directions = np.stack([-fits.normals[:, 1], fits.normals[:, 0]], 1)
    along = np.stack([np.einsum("ij,ij->i", points[k] - fits.means, directions) for k in (first, last)], 1)
    counts = last + 1 - first
    keep = (counts >= min_points) & (np.abs(along[:, 1] - along[:, 0]) >= min_length)
    first, counts, directions, along = first[keep], counts[keep], directions[keep], along[keep]
    fits = Fits(*(x[keep] for x in fits))
    ends = fits.means[:, None] + along[:, :, None] * directions[:, None]
    # Two parameters are fitted, so that the mean square is too small by a factor.
    variance = np.maximum(fits.squares[:, 0] * counts / (counts - 2), _SMALLEST_DEVIATION**2)
    spread = variance / (counts * np.maximum(fits.squares[:, 1], 1e-12))
    lever = np.einsum("ij,ij->i", fits.means, directions)
    covariances = np.empty((len(counts), 2, 2))
    covariances[:, 0, 0] = spread
    covariances[:, 0, 1] = covariances[:, 1, 0] = lever * spread
    covariances[:, 1, 1] = variance / counts + lever**2 * spread
    return Segments(fits.normals, fits.offsets, ends, covariances, counts, np.sqrt(fits.squares[:, 0]), first)
