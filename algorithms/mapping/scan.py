"""Scans of a laser range finder in a plane."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite_number, real_array

_BY_CHANCE = 1e-4
"""From a probability: the largest one of equal ranges that are not taken for the limit of a scanner."""
_TURN = 2 * np.pi * (1 + 1e-3)
"""Largest angle between the first and the last beam; steps of logs are rounded."""


@dataclass(frozen=True, eq=False)
class Scan:
    """One scan: the ranges of beams at equal angular steps about the origin.

    Beam i has the angle ``angle_min + i angle_step`` from the x axis towards y. A scanner that is mounted upside down
    has a negative step.

    Parameters
    ----------
    ranges : array_like, (n,)
        In metres. Beams count as not measured if their range is NaN, infinite, not positive, or at least `max_range`.
        So do all beams of the largest range, if neighbouring beams share it more often than chance gives: scanners
        report their limit where they measure nothing, and it is often less than the one that they are said to have.
    angle_min, angle_step : float
        The angle of the first beam and the step between beams, in radians.
    max_range : float
        The range that the scanner reports if it measures nothing; may be infinite.

    Raises
    ------
    TypeError
        If the ranges are not real numbers, or the other arguments not numbers.
    ValueError
        If the ranges are not one row, the step is 0, the beams cover more than a full turn, or the maximal range is not
        positive.

    Examples
    --------
    >>> import numpy as np
    >>> scan = Scan([2.0, np.nan, 3.0], -np.pi / 2, np.pi / 2, 50.0)
    >>> scan.points().round(12).tolist()
    [[0.0, -2.0], [0.0, 3.0]]
    """

    ranges: Reals
    angle_min: float
    angle_step: float
    max_range: float

    def __init__(self, ranges: ArrayLike, angle_min: float, angle_step: float, max_range: float) -> None:
        row = np.array(real_array(ranges, "ranges", (-1,)), float)
        if row.ndim != 1:
            raise ValueError(f"ranges: shape {row.shape}; expected (n,), the ranges of one scan")
        row.flags.writeable = False
        start, step = finite_number(angle_min, "angle_min"), finite_number(angle_step, "angle_step")
        if step == 0 or abs(step) * (len(row) - 1) > _TURN:
            raise ValueError(
                f"angle_step: {step} for {len(row)} beams; expected a step in radians, not 0, with which the beams "
                "cover at most a full turn"
            )
        farthest = float("inf") if max_range == np.inf else finite_number(max_range, "max_range")
        if farthest <= 0:
            raise ValueError(f"max_range: {farthest}; expected a positive length, or infinity")
        for name, value in (("ranges", row), ("angle_min", start), ("angle_step", step), ("max_range", farthest)):
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        """Return the number of beams, measured or not."""
        return len(self.ranges)

    @cached_property
    def valid(self) -> Reals:
        """(n,) Whether each beam has measured a range."""
        with np.errstate(invalid="ignore"):
            found = (self.ranges > 0) & (self.ranges < self.max_range)
        return _constant(found & ~_at_limit(self.ranges, found))

    @cached_property
    def beams(self) -> Reals:
        """(k,) The indices of the beams with a range, in the order of `points`."""
        return _constant(np.flatnonzero(self.valid))

    @cached_property
    def angles(self) -> Reals:
        """(n,) The angles of all beams."""
        return _constant(self.angle_min + self.angle_step * np.arange(len(self.ranges)))

    def points(self) -> Reals:
        """Return the (k, 2) points of the beams with a range; the array is read-only."""
        return self._points

    @cached_property
    def _points(self) -> Reals:
        angles, ranges = self.angles[self.beams], self.ranges[self.beams]
        return _constant(ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1))


def _at_limit(ranges: Reals, found: Reals) -> Reals:
    """Return which readings are the limit of the scanner, which has reported it as their range.

    Neighbours on a surface have equal ranges by the steps of readings only, at the rate that other readings show.
    Readings that are all equal show no rate: a round room has them as well.
    """
    limit = ranges[found].max(initial=0.0)
    largest = found & (ranges == limit)
    if np.count_nonzero(largest) < 2:
        return np.zeros_like(found)
    pairs = found[1:] & found[:-1]
    equal = pairs & (ranges[1:] == ranges[:-1])
    there = pairs & (largest[1:] | largest[:-1])
    n_there, n_others = np.count_nonzero(equal & there), np.count_nonzero(equal & ~there)
    rate = (n_others + 1) / (np.count_nonzero(pairs & ~there) + 1)
    return largest if rate**n_there < _BY_CHANCE else np.zeros_like(found)


def _constant(array: Reals) -> Reals:
    array.flags.writeable = False
    return array
