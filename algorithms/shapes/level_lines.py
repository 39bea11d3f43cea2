"""Closed level lines of images, with places between pixels by linear interpolation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals


def level_line(field: Reals, level: float) -> Reals:
    """Return the longest closed line (n, 2) of row, column on which an image has a value.

    Values outside of the image count as below the level. Larger values are to the left of the direction, if rows point
    down and columns to the right; diagonal neighbours above the level are not connected.

    Raises
    ------
    ValueError
        If no value is above the level.
    """
    # Twice the level less the largest value: the line follows the border half a pixel outside of the object.
    padded = np.pad(field.astype(float), 1, constant_values=min(2 * level - float(field.max()), float(field.min())))
    follows = _links(padded > level)
    starts = np.flatnonzero(follows >= 0)
    if not len(starts):
        raise ValueError(f"image: no value is above {level:g}; expected an object")
    loops = _loops(follows, starts)
    edges = max(loops, key=len)
    return _crossings(padded, edges, level) - 1


def _links(inside: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return for each side of a cell that lines leave towards a side, that side, or -1.

    Side 2 k joins pixel k with the next one of the row, and side 2 k + 1 with the next one of the column.
    """
    rows, columns = inside.shape
    index = np.arange(rows * columns).reshape(rows, columns)[:-1, :-1]
    corners = [inside[:-1, :-1], inside[:-1, 1:], inside[1:, 1:], inside[1:, :-1]]
    sides = [2 * index, 2 * (index + 1) + 1, 2 * (index + columns), 2 * index + 1]
    follows = np.full(2 * rows * columns, -1)
    for k in range(4):
        enters = ~corners[k] & corners[(k + 1) % 4]
        second, third = corners[(k + 2) % 4], corners[(k + 3) % 4]
        out = np.where(~second, sides[(k + 1) % 4], np.where(~third, sides[(k + 2) % 4], sides[(k + 3) % 4]))
        follows[sides[k][enters]] = out[enters]
    return follows


def _loops(follows: NDArray[np.intp], starts: NDArray[np.intp]) -> list[list[int]]:
    table = follows.tolist()
    seen = bytearray(len(table))
    loops = []
    for start in starts.tolist():
        if seen[start]:
            continue
        loop = []
        at = start
        while not seen[at]:
            seen[at] = 1
            loop.append(at)
            at = table[at]
        loops.append(loop)
    return loops


def _crossings(field: Reals, sides: list[int], level: float) -> Reals:
    side = np.array(sides)
    columns = field.shape[1]
    row, column = side // 2 // columns, side // 2 % columns
    down = side % 2
    a, b = field[row, column], field[row + down, column + 1 - down]
    share = (level - a) / (b - a)
    return np.column_stack([row + share * down, column + share * (1 - down)])
