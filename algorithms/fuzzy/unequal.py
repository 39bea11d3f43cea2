"""Numbers of outputs whose places are not equidistant."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals
from .sets import FuzzyVariable
from .tables import OutputTables
from .unions import bisectors, centroids
from .workspace import Workspace


class UnequalTables(OutputTables):
    """An output with its own places, prepared for the computation of its numbers.

    Coordinates are distances from the first place. The points of unions, and the ends of maxima, are those of the
    kernels; the other numbers are sums over sorted places and points with numpy.

    Parameters
    ----------
    variable : FuzzyVariable
    scaled : bool
        As for `OutputTables`.
    """

    def _units(self, variable: FuzzyVariable) -> tuple[float, float, Reals]:
        return variable.low, 1.0, variable.places - variable.low

    def _prepare(self) -> None:
        """Prepare nothing more: the kernels with loops over the grid need equidistant places."""

    def _in_parts(
        self, cuts: Reals, points: Reals, found: Callable[[Reals, Reals], tuple[Reals, Reals]]
    ) -> tuple[Reals, Reals]:
        """Return two numbers (n,) of each union, computed for as many at a time as fit into the cache."""
        sizes, numbers = np.empty(len(cuts)), np.empty(len(cuts))
        step = self._part_size()
        for start in range(0, len(cuts), step):
            part = slice(start, start + step)
            sizes[part], numbers[part] = found(cuts[part], points[part])
        return sizes, numbers

    def _centroids(self, cuts: Reals, work: Workspace) -> tuple[Reals, NDArray[np.bool_]]:
        area, moment = self._in_parts(
            cuts, self._crossings(cuts, work), lambda own, points: centroids(*self._sorted(own, points))
        )
        fires = np.asarray(area > 0)
        return self._places(moment / np.where(fires, area, 1)), fires

    def _bisectors(self, cuts: Reals, work: Workspace) -> tuple[Reals, NDArray[np.bool_]]:
        def found(own: Reals, points: Reals) -> tuple[Reals, Reals]:
            x, top = self._sorted(own, points)
            return centroids(x, top)[0], bisectors(x, top)

        area, half = self._in_parts(cuts, self._crossings(cuts, work), found)
        return self._places(half), np.asarray(area > 0)

    def _means_of_maxima(self, cuts: Reals, work: Workspace) -> tuple[Reals, NDArray[np.bool_]]:
        highest, mean = self._in_parts(cuts, self._crossings(cuts, work), self._mean_of_maximum)
        return self._places(mean), np.asarray(highest > 0)

    def _mean_of_maximum(self, cuts: Reals, points: Reals) -> tuple[Reals, Reals]:
        """Return the maxima of unions, and the means of the places and points where they are reached."""
        tops = cuts * self._peaks if self._scaled else np.minimum(cuts, self._peaks)
        highest = tops.max(1)
        hit = tops >= highest[:, None]
        begin = np.where(hit, points[:, : self.sets] - self._tolerance, np.inf)[:, :, None]
        end = np.where(hit, points[:, self.sets :] + self._tolerance, -np.inf)[:, :, None]
        # Points count if no place, and no point before them, is at the same position.
        above = np.searchsorted(self._coordinates, points).clip(1, len(self._coordinates) - 1)
        nearest = np.minimum(np.abs(points - self._coordinates[above - 1]), np.abs(points - self._coordinates[above]))
        equal = np.abs(points[:, :, None] - points[:, None, :]) <= self._tolerance
        alone = ~np.tril(equal, -1).any(2) & (nearest > self._tolerance)
        x = np.concatenate([np.broadcast_to(self._coordinates, (len(cuts), len(self._coordinates))), points], 1)
        counts = np.concatenate([np.ones((len(cuts), len(self._coordinates)), bool), alone], 1)
        counts &= ((begin <= x[:, None]) & (x[:, None] <= end)).any(1)
        return highest, np.asarray((x * counts).sum(1) / counts.sum(1))


def tables_of(variable: FuzzyVariable, scaled: bool) -> OutputTables:
    """Return the tables of an output; the arguments are those of `OutputTables`."""
    return UnequalTables(variable, scaled) if variable.grid else OutputTables(variable, scaled)
