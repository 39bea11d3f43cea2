"""Points where sets cross levels, as sums of ramps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals
from ..precision import ROUNDING

Integers = NDArray[np.int64]
_LEAST_RISE = 1e-290
"""Smaller rises are replaced by it, so that no slope is infinite."""

_HALF_EPS = float(np.finfo(float).eps) / 2
"""From floating point: the largest relative error of rounding."""


@dataclass(frozen=True, eq=False)
class Ramps:
    """The flanks of sets as arguments of the kernels of `generated.fuzzy`.

    The points are those of all rising flanks, in the order of the sets, followed by those of all falling flanks.

    Attributes
    ----------
    ramps : array, (n, 3)
        The least height, the rise, and the width divided by the rise, which is negative on falling flanks. The first
        row is empty.
    terms : int array, (n,)
        The sets.
    starts, ends : int arrays, (points,)
        The row before the first ramp of each flank, and the last ramp.
    flanks : array, (points, 4)
        The memberships at the lower and the upper end of each flank, the place of the lower end, and the largest
        distance at which a point coincides with it.
    peaks : array, (points,)
        The places of the upper ends.
    """

    ramps: Reals
    terms: Integers
    starts: Integers
    ends: Integers
    flanks: Reals
    peaks: Reals

    @property
    def tables(self) -> tuple[NDArray[np.generic], ...]:
        """The arguments of `crossing_points` after the first one."""
        return self.ramps, self.terms, self.starts, self.ends, self.flanks


def ramps_of(heights: Reals, coordinates: Reals, origin: float) -> Ramps:
    """Divide the flanks of sets into linear pieces.

    Parameters
    ----------
    heights : array, (n, sets)
        Memberships of the places of a grid, which rise and then fall.
    coordinates : array, (n,)
        The places, from 0 for the first one.
    origin : float
        The first place in the same units, for the rounding errors of coordinates.
    """
    rows: list[tuple[float, float, float]] = [(0.0, 1.0, 0.0)]
    terms, starts, ends, flanks, peaks = [0], [], [], [], []
    size, sets = heights.shape
    for falls in (False, True):
        for k in range(sets):
            own = heights[::-1, k] if falls else heights[:, k]
            along = coordinates[-1] - coordinates[::-1] if falls else coordinates
            top = int(np.argmax(own))
            # Of samples that are 0, one is enough: the others never cross a level.
            start = max(int(np.argmax(own > 0)) - 1, 0) if own[top] > 0 else top
            found = _pieces(own[start : top + 1], along[start : top + 1])
            starts.append(len(rows) - 1)
            rows += [(height, rise, -run if falls else run) for height, rise, run in found]
            terms += [k] * len(found)
            ends.append(len(rows) - 1)
            base = coordinates[size - 1 - start if falls else start]
            # A point coincides with a place if their difference is lost in rounding their coordinates.
            flanks.append((own[start], own[top], base, _HALF_EPS * abs(origin + base)))
            peaks.append(coordinates[size - 1 - top if falls else top])
    return Ramps(
        np.array(rows), np.array(terms, np.int64), np.array(starts, np.int64), np.array(ends, np.int64),
        np.array(flanks, float), np.array(peaks, float),
    )  # fmt: skip


def _pieces(heights: Reals, places: Reals) -> list[tuple[float, float, float]]:
    """Return least heights, rises, and widths divided by rises of the linear pieces of ascending samples."""
    slopes = (np.diff(heights) / np.diff(places)).tolist()
    bounds = [k for k in range(1, len(slopes)) if abs(slopes[k] - slopes[k - 1]) > ROUNDING * slopes[k]]
    pieces = []
    for first, last in zip([0, *bounds], [*bounds, len(slopes)], strict=True):
        low, high = float(heights[first]), float(heights[last])
        if last == first:
            continue
        # A level above samples of equal heights is crossed at their end: the rise is that to the next number.
        rise = max(high - low, float(np.nextafter(low, 2) - low), _LEAST_RISE)
        pieces.append((low, rise, float(places[last] - places[first]) / rise))
    return pieces
