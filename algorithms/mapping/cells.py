"""The lines of a map in the cells of a grid, so that the lines near a place are found without a search."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from ..arguments import Reals
from ..precision import NEGLIGIBLE

FAR, NEAR = 1.2, 0.5
"""Metres from a place up to which its cell lists all lines: the reach of the first step of an alignment, and one for
which lists are short."""
_SIZES = {FAR: 1.0, NEAR: 0.5}
"""The sizes of cells in metres."""
_MOST_CELLS = 1000
"""A limit on memory: the most cells along an axis, above which they are larger. A line is in a few in each row."""


class Lines(Protocol):
    """What relocation needs of a map: segments with normals away from the side from which they were seen."""

    @property
    def normals(self) -> Reals:
        """(k, 2) Unit normals."""

    @property
    def offsets(self) -> Reals:
        """(k,) The points of a line satisfy ``normal . x = offset``."""

    @property
    def ends(self) -> Reals:
        """(k, 2, 2) The ends."""


class Cells(NamedTuple):
    """The lines of a map as the kernels `sum_of_place_scores` and `step_to_map` take them.

    Attributes
    ----------
    segments : array, (k, 5)
        Middles, unit normals, and halves of lengths.
    entries : array, (e,)
        Rows of segments within the reach of each cell, cell after cell.
    starts : array, (c + 1,)
        The number of the first entry of each cell, and that after the last one.
    grid : array, (6,)
        The corner x, y, the size of cells, the numbers of columns and rows, and the reach.
    """

    segments: Reals
    entries: Reals
    starts: Reals
    grid: Reals


class MapCells(NamedTuple):
    """Cells that list the lines of a map up to two distances."""

    far: Cells
    near: Cells


def cells_of(line_map: Lines) -> MapCells:
    """Return the cells of a map; lines that are not finite are in none."""
    ends = np.asarray(line_map.ends, float).reshape(-1, 2, 2)
    halves = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2
    segments = np.column_stack([ends.mean(1), line_map.normals, halves]).astype(float)
    used = np.flatnonzero(np.isfinite(segments).all(1))
    return MapCells(*(_listed(segments, ends, used, reach) for reach in (FAR, NEAR)))


def _listed(segments: Reals, ends: Reals, used: Reals, reach: float) -> Cells:
    size = _SIZES[reach]
    if not len(used):
        return Cells(segments, np.zeros(0), np.zeros(2), np.array([0.0, 0.0, size, 1.0, 1.0, reach]))
    low, high = ends[used].min(1) - reach, ends[used].max(1) + reach
    corner = low.min(0)
    size = max(size, float((high.max(0) - corner).max()) / _MOST_CELLS)
    first, last = (np.floor((each - corner) / size).astype(int) for each in (low, high))
    width, height = last.max(0) + 1
    # The rows that a line crosses, and in each the columns that may be within the reach of its part there: the box of
    # the whole line would have the area of a map.
    beyond = reach + size / np.sqrt(2)
    counts = last[:, 1] - first[:, 1] + 1
    part, line = _counted(counts, first[:, 1])
    one, two = ends[used].transpose(1, 0, 2)
    steps = two - one
    level = corner[1] + (line + 0.5) * size - one[part, 1]
    is_flat = np.abs(steps[:, 1]) <= NEGLIGIBLE * np.abs(steps[:, 0])
    rise = np.where(is_flat, 1.0, steps[:, 1])
    reached = np.stack([level - beyond, level + beyond], 1) / rise[part, None]
    reached = np.where(is_flat[part, None], [0.0, 1.0], np.clip(np.sort(reached, 1), 0, 1))
    sides = np.sort(one[part, 0, None] + reached * steps[part, 0, None] - corner[0], 1)
    columns = np.floor((sides + np.array([-beyond, beyond])) / size).astype(int)
    left, right = np.clip(columns, first[part, :1], last[part, :1]).T
    step, column = _counted(right - left + 1, left)
    row, line = part[step], line[step]
    mx, my, nx, ny, half = segments[used[row]].T
    x, y = corner[0] + (column + 0.5) * size - mx, corner[1] + (line + 0.5) * size - my
    off, along = nx * x + ny * y, np.maximum(np.abs(nx * y - ny * x) - half, 0)
    is_near = off * off + along * along <= beyond**2
    cell = (line * width + column)[is_near]
    order = np.argsort(cell, kind="stable")
    starts = np.append(0, np.cumsum(np.bincount(cell, minlength=width * height)))
    grid = np.array([*corner, size, width, height, reach])
    return Cells(segments, used[row[is_near][order]].astype(float), starts.astype(float), grid)


def _counted(counts: Reals, first: Reals) -> tuple[Reals, Reals]:
    """Return, for each of some intervals, its row and all of its integers."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, first[row] + np.arange(len(row)) - (np.cumsum(counts) - counts)[row]
