"""The tables of an output for the kernels of `generated.fuzzy`, and its numbers for strengths of its sets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generated import fuzzy as kernels

from ..arguments import Reals
from .fuzzy_sets import FuzzyVariable

Integers = NDArray[np.int64]
_CLOSE = 1e-12
"""Distance, relative to the range, up to which points count as one."""


@dataclass(frozen=True, eq=False)
class _Points:
    """Points where sets cross their strengths, arrays of shape (n, 2 sets), and memberships (n, 2 sets * sets)."""

    exists: Reals
    left: Reals
    right: Reals
    start: Reals
    run: Reals
    left_heights: Reals
    right_heights: Reals


class OutputTables:
    """An output, prepared for the computation of its numbers.

    Parameters
    ----------
    variable : FuzzyVariable
    scaled : bool
        Whether sets are multiplied by their strengths, and not clipped.
    """

    def __init__(self, variable: FuzzyVariable, scaled: bool) -> None:
        self.places, self.heights = variable.places, variable.memberships
        self._scaled = float(scaled)
        self._tolerance = _CLOSE * (variable.high - variable.low)
        self._samples()
        self._flanks()
        self._pairs()

    def _samples(self) -> None:
        """Prepare the positive samples of all places, and at least one sample of each."""
        x, heights = self.places, self.heights
        width = np.diff(x)
        area, moment = np.zeros((2, len(x)))
        area[:-1] += width / 2
        area[1:] += width / 2
        moment[:-1] += width * (2 * x[:-1] + x[1:]) / 6
        moment[1:] += width * (x[:-1] + 2 * x[1:]) / 6
        used = heights > 0
        used[:, 0] |= ~used.any(1)
        place, term = np.nonzero(used)
        last = np.append(place[1:] != place[:-1], True).astype(float)
        same = np.append(0.0, 1 - last[:-1])
        own = heights[place, term]
        self._terms = term.astype(np.int64)
        self._area_rows = np.stack([own, same, last * area[place], last * moment[place]], 1)
        self._place_rows = np.stack([own, same, last, x[place]], 1)
        self._width_rows = np.stack([own, same, last, np.append(0.0, width)[place]], 1)
        self._peaks = heights.max(0)

    def _flanks(self) -> None:
        """Prepare the samples of rising and falling flanks: one rising flank for each set, then the falling ones."""
        n, sets = self.heights.shape
        heights, falling, terms, flanks = [], [], [], []
        lengths, starts = np.zeros(2 * sets, np.int64), np.zeros(2 * sets, np.int64)
        for k, own in enumerate(self.heights.T):
            first, last = int(np.argmax(own)), n - 1 - int(np.argmax(own[::-1]))
            # Of samples that are 0, one is enough: the others never cross a strength.
            positive = np.flatnonzero(own > 0)
            start, end = (max(positive[0] - 1, 0), positive[-1] + 2) if len(positive) else (first, last + 1)
            starts[k] = start
            for flank, part in ((k, own[start : first + 1]), (sets + k, own[last:end])):
                heights.append(part)
                falling.append(np.full(len(part), float(flank >= sets)))
                terms.append(np.full(len(part), k))
                flanks.append(np.full(len(part), flank))
                lengths[flank] = len(part)
            starts[sets + k] = last
        self._flank_heights, self._falling = np.concatenate(heights), np.concatenate(falling)
        self._flank_terms, self._flank_index = (np.concatenate(x).astype(np.int64) for x in (terms, flanks))
        self._lengths, self._starts = lengths, starts
        self._own = np.tile(np.arange(sets), 2)
        rise = np.diff(self.heights, axis=0)
        width = np.diff(self.places)[:, None]
        self._runs = np.where(rise != 0, width, 0) / np.where(rise != 0, rise, 1)

    def _pairs(self) -> None:
        """Prepare pairs of points and sets, and couples of points."""
        sets = self.heights.shape[1]
        count = 2 * sets
        self._pair_point = np.repeat(np.arange(count), sets)
        self._pair_term = np.tile(np.arange(sets), count)
        self._same = (self._pair_term > 0).astype(float)
        self._ends = np.arange(sets - 1, count * sets, sets)
        first, second = np.tril_indices(count)
        self._couples = first.astype(np.int64), second.astype(np.int64)
        self._last = np.stack([second == 0, first == second], 1).astype(float)

    def _points(self, cuts: Reals) -> _Points:
        counts = kernels.counts_on_flanks(
            cuts,
            self._flank_heights,
            self._falling,
            self._flank_terms,
            self._flank_index,
            np.zeros(len(self._lengths)),
        )
        exists = (counts > 0) & (counts < self._lengths)
        cell = counts.astype(np.int64)
        cell += self._starts - 1
        cell *= exists
        runs = self._runs[cell, self._own] * exists
        left, right = self.heights.take(cell, 0), self.heights.take(cell + 1, 0)
        start = self.heights[cell, self._own]
        n, pairs = len(cuts), len(self._same)
        places = self.places
        return _Points(
            exists.astype(float),
            places[cell],
            places[cell + 1],
            start,
            runs,
            left.reshape(n, pairs),
            right.reshape(n, pairs),
        )

    def _point_arguments(self, p: _Points) -> tuple[NDArray[np.generic], ...]:
        return (
            p.exists, p.left, p.right, p.start, p.run, self._own, p.left_heights, p.right_heights, self._pair_point,
            self._pair_term, self._same, self._ends,
        )  # fmt: skip

    def areas(self, cuts: Reals) -> tuple[Reals, Reals]:
        """Compute areas (n,) and first moments (n,) of unions, given the strengths (n, sets)."""
        area, moment = kernels.area_on_grid(cuts, self._area_rows, self._terms, self._scaled)
        if not self._scaled:
            points = self._point_arguments(self._points(cuts))
            more, turn = kernels.area_by_points(cuts, *points, *self._couples, self._last, np.inf)
            area, moment = area + more, moment + turn
        return area, moment

    def _crossings(self, cuts: Reals) -> tuple[Reals, ...]:
        """Return places, unions, and neighbours on the grid of the points, arrays (n, 2 sets)."""
        points = self._points(cuts)
        place, top, left_top, right_top = kernels.crossing_points(cuts, *self._point_arguments(points))
        return place, top, points.left, points.right, left_top, right_top

    def maxima(self, cuts: Reals) -> tuple[Reals, Reals, Reals]:
        """Compute the mean, the smallest and the largest of the points with the largest membership."""
        if self._scaled:
            # Sets that are multiplied cross nothing: all points coincide with the first place.
            n, count = len(cuts), len(self._lengths)
            place, top = np.full((n, count), self.places[0]), np.full((n, count), -1.0)
            points: tuple[Reals, ...] = (place, top, place, np.full_like(place, self.places[1]), top, top)
        else:
            points = self._crossings(cuts)
        return tuple(
            kernels.places_of_maximum(
                cuts, self._place_rows, self._terms, self._peaks, *points, *self._couples, self._last, self._scaled,
                self._tolerance,
            )
        )  # fmt: skip

    def bisectors(self, cuts: Reals) -> Reals:
        """Compute the places that divide the areas into halves."""
        if self._scaled:
            return self._sorted_bisectors(cuts)
        points = self._points(cuts)
        arguments = self._point_arguments(points)

        def more(limit: Reals | float) -> Reals:
            found = kernels.area_by_points(cuts, *arguments, *self._couples, self._last, limit)
            return np.asarray(found[0])

        half = (kernels.area_on_grid(cuts, self._area_rows, self._terms, 0.0)[0] + more(np.inf)) / 2
        # The points left of the interval change the area, and so perhaps the interval.
        added = np.zeros(len(cuts))
        for _ in range(2):
            before = added
            target = half - added
            at, area, low, high = kernels.place_of_area(cuts, self._width_rows, self._terms, 0.0, target)
            left = np.maximum(at.astype(np.int64), 1) - 1
            added = more(self.places[left])
        found = _halved(self.places[left], np.diff(self.places)[left], low, high, target - area)
        inside = ((points.left == self.places[left][:, None]) & (points.exists > 0)).any(1)
        rest = inside | (added != before) | (at < 0)
        if rest.any():
            found[rest] = self._sorted_bisectors(cuts[rest])
        return found

    def _sorted_bisectors(self, cuts: Reals) -> Reals:
        """Compute bisectors from the sorted places and points."""
        members = self.heights.T * cuts[:, :, None] if self._scaled else np.minimum(self.heights.T, cuts[:, :, None])
        x, top = np.broadcast_to(self.places, (len(cuts), len(self.places))), members.max(1)
        if not self._scaled:
            place, height, *_ = self._crossings(cuts)
            x, top = np.concatenate([x, place], 1), np.concatenate([top, height], 1)
            order = np.argsort(x, 1, kind="stable")
            x, top = np.take_along_axis(x, order, 1), np.take_along_axis(top, order, 1)
        width = np.diff(x)
        pieces = width * (top[:, :-1] + top[:, 1:]) / 2
        sums = np.cumsum(pieces, 1)
        half = sums[:, -1:] / 2
        at = np.argmax(sums >= half, 1)[:, None]
        a, low, high, step, whole, end = (
            np.take_along_axis(table, at + k, 1)[:, 0]
            for table, k in ((x, 0), (top, 0), (top, 1), (width, 0), (pieces, 0), (sums, 0))
        )
        return _halved(a, step, low, high, np.clip(half[:, 0] - (end - whole), 0, whole))


def _halved(left: Reals, width: Reals, low: Reals, high: Reals, area: Reals) -> Reals:
    """Return the places up to which linear functions on intervals have given areas."""
    slope = (high - low) / np.where(width > 0, width, 1)
    root = np.sqrt(np.maximum(low * low + 2 * slope * area, 0))
    return np.asarray(left + 2 * area / np.where(low + root > 0, low + root, 1))
