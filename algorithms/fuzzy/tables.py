"""The tables of an output for the kernels of `generated.fuzzy`, and its numbers for strengths of its sets."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from generated import fuzzy as kernels

from ..arguments import Reals
from ..precision import ROUNDING
from .ramps import Ramps, ramps_of
from .sets import FuzzyVariable
from .unions import bisectors, sorted_unions
from .workspace import Workspace

Integers = NDArray[np.int64]
_INSIDE = 3
"""The largest number of points in an interval for which its bisector is computed without sorting."""
_SORTED = 1 << 18
"""The largest number of places that are sorted at once."""


class OutputTables:
    """An output, prepared for the computation of its numbers.

    Coordinates of the kernels are in units of the grid, from 0 for the first place.

    Parameters
    ----------
    variable : FuzzyVariable
    scaled : bool
        Whether sets are multiplied by their strengths, and not clipped.
    """

    def __init__(self, variable: FuzzyVariable, scaled: bool) -> None:
        self.heights = variable.memberships
        self.sets = len(variable.sets)
        self._name, self._scaled = f"output {variable.name}", float(scaled)
        self._low, self._step, self._coordinates = self._units(variable)
        self._tolerance = ROUNDING * self._coordinates[-1]
        self._peaks = self.heights.max(0)
        self._ramps: Ramps = ramps_of(self.heights, self._coordinates, self._low / self._step)
        self._left, self._right = np.arange(self.sets), np.arange(self.sets, 2 * self.sets)
        self._prepare()

    def _units(self, variable: FuzzyVariable) -> tuple[float, float, Reals]:
        """Return the origin and the unit of coordinates, and those of the places."""
        step = (variable.high - variable.low) / (variable.samples - 1)
        return variable.low, step, np.arange(variable.samples, dtype=float)

    def _prepare(self) -> None:
        self._samples()
        self._pairs_of_points()

    def _samples(self) -> None:
        """Prepare the positive samples of all places, two in a row, and at least one row for each place."""
        n = len(self.heights)
        place, term = np.nonzero(self.heights > 0)
        number = np.arange(len(place)) - np.searchsorted(place, place)
        width = max(-(-int(number.max(initial=0) + 1) // 2), 1)
        terms, heights = np.zeros((n, width, 2), np.int64), np.zeros((n, width, 2))
        terms[place, number // 2, number % 2] = term
        heights[place, number // 2, number % 2] = self.heights[place, term]
        used = heights[:, :, 0] > 0
        used[:, 0] = True
        place = np.nonzero(used)[0]
        last = np.append(place[1:] != place[:-1], True).astype(float)
        area, moment = np.ones(n), np.arange(n, dtype=float)
        area[[0, -1]] = 0.5
        moment[[0, -1]] = 1 / 6, (3 * n - 4) / 6
        sums = np.ones(n)
        sums[0] = 0.5
        rows = [*heights[used].T, np.append(0.0, 1 - last[:-1])]
        self._area_rows = np.stack([*rows, last * area[place], last * moment[place]], 1)
        self._sum_rows = np.stack([*rows, last * sums[place], np.zeros(len(place))], 1)
        self._terms = tuple(np.ascontiguousarray(part) for part in terms[used].T)
        self._place_ends = np.flatnonzero(last), np.array([len(last) - 1])

    def _pairs_of_points(self) -> None:
        """Prepare the index tables of pairs of points and sets, and of couples of points."""
        sets = self.heights.shape[1]
        count = 2 * sets
        self._snap = np.repeat([self._tolerance, -self._tolerance], sets)
        # Rows of 1, 2 or 4 numbers are copied fastest.
        width = sets if sets != 3 else 4
        padded = np.pad(self.heights, ((0, 0), (0, width - sets)))
        self._left_rows, self._right_rows = padded[:-1].copy(), padded[1:].copy()
        term = np.append(np.arange(sets), np.zeros(width - sets, np.int64))
        self._pairs = _table(count, width, term)
        self._flanks = np.tile(np.arange(sets), 2), self._ramps.flanks
        self._covers = _table(count, sets, np.arange(sets))
        first, second = np.tril_indices(count)
        self._couples = first, second, np.stack([second == 0, first == second], 1).astype(float)
        # A point is inserted after those before it; the first one needs a row, too.
        rows = (second < first) | (first == 0)
        one, other = first[rows], second[rows]
        final = np.append(np.flatnonzero(np.diff(one)), len(one) - 1)
        self._insertions = one, other, np.stack([other == 0, one != other], 1).astype(float), final
        self._turns = _rounds(sets, sets)
        self._steps = _rounds(min(count, _INSIDE) + 1, count)

    def _places(self, numbers: Reals) -> Reals:
        return np.asarray(self._low + self._step * numbers)

    def _crossings(self, cuts: Reals, work: Workspace) -> Reals:
        """Return the points where sets cross their strengths; sets that are multiplied cross nothing: their peaks."""
        points = work.array(f"{self._name} points", len(cuts), len(self._ramps.peaks))
        if self._scaled:
            points[:] = self._ramps.peaks
        else:
            kernels.crossing_points(cuts, *self._ramps.tables, out=points)
        return points

    def _points(self, cuts: Reals, work: Workspace) -> tuple[Reals, ...]:
        """Return the points where sets cross their strengths, the places to the left, and the memberships beside."""
        n, count, width = len(cuts), len(self._ramps.peaks), self._left_rows.shape[1]
        points = self._crossings(cuts, work)
        whole = work.indices(f"{self._name} rows", n, count)
        np.copyto(whole, points, casting="unsafe")
        np.clip(whole, 0, len(self.heights) - 2, out=whole)
        cells = work.array(f"{self._name} cells", n, count)
        np.copyto(cells, whole)
        left, right = (work.array(f"{self._name} {side}", n, count, width) for side in ("left", "right"))
        self._left_rows.take(whole, 0, out=left, mode="clip")
        self._right_rows.take(whole, 0, out=right, mode="clip")
        return points, cells, left.reshape(n, -1), right.reshape(n, -1)

    def numbers(self, method: str, cuts: Reals, work: Workspace) -> tuple[Reals, NDArray[np.bool_]]:
        """Compute the numbers (n,) of unions, given the strengths (n, sets), and whether there are any.

        Parameters
        ----------
        method : str
            One of `DEFUZZIFIERS`.
        cuts : array, (n, sets)
        work : Workspace
            For at least n elements.
        """
        if method in ("som", "lom"):
            return self._ends_of_maxima(cuts, method == "lom")
        found = {"centroid": self._centroids, "bisector": self._bisectors, "mom": self._means_of_maxima}[method]
        return found(cuts, work)

    def _part_size(self) -> int:
        """Return how many unions are sorted at once."""
        return max(_SORTED // len(self.heights), 1)

    def _sorted(self, cuts: Reals, points: Reals) -> tuple[Reals, Reals]:
        return sorted_unions(cuts, points, self._coordinates, self.heights, self._ramps.flanks, bool(self._scaled))

    def _centroids(self, cuts: Reals, work: Workspace) -> tuple[Reals, NDArray[np.bool_]]:
        """Compute the centroids (n,) of unions, given the strengths (n, sets), and whether there are any."""
        area, moment = kernels.area_on_grid(cuts, self._area_rows, *self._terms, self._scaled)  # type: ignore[call-overload]
        if not self._scaled:
            more, turn = kernels.area_by_points(  # type: ignore[call-overload]
                cuts, *self._points(cuts, work), *self._pairs, *self._flanks, *self._insertions
            )
            area, moment = area + more, moment + turn
        fires = np.asarray(area > 0)
        return self._places(moment / np.where(fires, area, 1)), fires

    def _ends_of_maxima(self, cuts: Reals, greatest: bool) -> tuple[Reals, NDArray[np.bool_]]:
        """Compute the smallest or the greatest of the points with the largest membership."""
        highest, *ends = kernels.ends_of_maximum(  # type: ignore[call-overload]
            cuts, self._peaks, self._scaled, *self._ramps.tables, self._left, self._right
        )
        return self._places(ends[int(greatest)]), np.asarray(highest > 0)

    def _means_of_maxima(self, cuts: Reals, work: Workspace) -> tuple[Reals, NDArray[np.bool_]]:
        """Compute the means of the points with the largest membership."""
        n, count, sets = len(cuts), len(self._ramps.peaks), len(self._left)
        points = self._crossings(cuts, work)
        grid = work.array(f"{self._name} grid", n, count)
        np.subtract(points, self._snap, out=grid)
        np.ceil(grid[:, :sets], out=grid[:, :sets])
        np.floor(grid[:, sets:], out=grid[:, sets:])
        highest, mean = kernels.mean_of_maximum(  # type: ignore[call-overload]
            cuts, self._peaks, self._scaled, self._tolerance, points, grid, self._left, self._right, *self._turns,
            *self._covers, *self._couples,
        )  # fmt: skip
        return self._places(mean), np.asarray(highest > 0)

    def _bisectors(self, cuts: Reals, work: Workspace) -> tuple[Reals, NDArray[np.bool_]]:
        """Compute the points that divide the areas into halves."""
        half = kernels.half_on_grid(cuts, self._sum_rows, *self._terms, self._scaled, *self._place_ends)  # type: ignore[call-overload]
        points = self._points(cuts, work)
        bisector: Any = kernels.bisector  # mypy takes seconds to find that unpacked arguments fit no overload
        found, inside = bisector(cuts, *points, *self._pairs, *self._flanks, *self._insertions, *self._steps, *half)
        # Few elements have more points in the interval, or a bisector in another one because of the points before it.
        rest = np.flatnonzero(inside < 1)
        size = self._part_size()
        for start in range(0, len(rest), size):
            part = rest[start : start + size]
            found[part] = bisectors(*self._sorted(cuts[part], points[0][part]))
        return self._places(found), np.asarray(half[-1] > 0)


def _table(count: int, width: int, terms: Integers) -> tuple[NDArray[np.generic], ...]:
    """Return points and sets of all pairs of them, whether a pair continues its point, and the last pairs."""
    point = np.repeat(np.arange(count), width)
    same = np.tile(np.arange(width) > 0, count).astype(float)
    return point, np.tile(terms, count), same, np.arange(width - 1, count * width, width)


def _rounds(count: int, size: int) -> tuple[Integers, Reals]:
    """Return the numbers below `size`, repeated, and whether they are the first and the last of a round."""
    number = np.tile(np.arange(size), count)
    return number, np.stack([number == 0, number == size - 1], 1).astype(float)
