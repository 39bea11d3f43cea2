"""Segments of a map compared with readings: removal of pieces that beams pass through, or without readings."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from generated import pga2

from ..arguments import Reals
from .line_map import LineMap
from .segments import Segments

_BIN = 0.1
"""The length of the pieces for which readings are counted, in metres."""
_HIT = 0.1
"""Readings up to this distance from a segment are of it."""
_BEYOND = 0.4
"""Beams pass through a segment if they end at least this far behind it."""
_STEEP = 0.35
"""The smallest sine of the angle between a segment and a beam that passes through it."""
_FEWEST_CROSSINGS = 3
"""Beams that have to pass through a piece of a segment before it counts as open: fewer may be errors."""
_HOLE = 0.4
"""Gaps between readings shorter than this are not cut out, in metres."""
_FAR = 15.0
"""Beams longer than this are too far apart to show a hole."""


class View(NamedTuple):
    """Readings from one place."""

    motor: Reals
    """(4,) The pose."""
    points: Reals
    """(n, 2) In the frame of the robot."""


@dataclass(slots=True)
class _Bins:
    """Counts of readings on the pieces of all segments, which follow each other in one array."""

    first: Reals
    hits: Reals
    crossings: Reals
    square: float
    n_hits: int


def seen_through(line_map: LineMap, views: Iterable[View]) -> tuple[LineMap, float]:
    """Split segments where beams pass through them, as at doors, and remove pieces without readings.

    Parameters
    ----------
    line_map : LineMap
    views : iterable of View

    Returns
    -------
    line_map : LineMap
        The pieces. Each has the line of its segment, and its share of the counts.
    residual : float
        The root mean square of the distances of readings from their segments; NaN without readings on segments.
    """
    sizes = np.maximum(np.ceil(line_map.lengths / _BIN).astype(int), 1)
    first = np.concatenate([[0], np.cumsum(sizes)])
    bins = _Bins(first, np.zeros(first[-1], int), np.zeros(first[-1], int), 0.0, 0)
    if len(line_map):
        probes = _Probes(line_map)
        for view in views:
            _count(line_map, probes, bins, view)
    residual = float(np.sqrt(bins.square / bins.n_hits)) if bins.n_hits else float("nan")
    return _split(line_map, bins), residual


def fused(
    found: Iterable[Segments], views: list[View], min_views: int, min_segment: float, most: int
) -> tuple[LineMap, float]:
    """Fuse the segments of scans into a map, without pieces that beams pass through.

    Parameters
    ----------
    found : iterable of Segments
        Of each scan.
    views : list of View
        The readings of each scan, and its pose.
    min_views : int
        The number of scans in which a segment of the map was found, at least.
    min_segment : float
        The length of the shortest segment.
    most : int
        The longest ones up to this number are kept.

    Returns
    -------
    line_map : LineMap
    residual : float
        As of `seen_through`.
    """
    line_map = LineMap.empty()
    for each, view in zip(found, views, strict=True):
        line_map = line_map.updated(each, view.motor).map
    cut, residual = seen_through(line_map.merged().pruned(min_views, min_segment), views)
    return cut.merged().pruned(min_views, min_segment, most), residual


class _Probes:
    """Points along the segments, to find those near a place."""

    def __init__(self, line_map: LineMap) -> None:
        steps = np.maximum(np.ceil(line_map.lengths).astype(int), 1) + 1
        rows = np.repeat(np.arange(len(line_map)), steps)
        share = np.concatenate([np.linspace(0, 1, n) for n in steps])
        spans = line_map.spans[rows]
        along = spans[:, 0] + share * (spans[:, 1] - spans[:, 0])
        self._rows = rows
        self._tree = scipy.spatial.cKDTree(np.asarray(pga2.point_on_line(line_map.lines[rows], along)))

    def near(self, place: Reals, reach: float) -> Reals:
        """Return the rows of segments near a place."""
        return np.unique(self._rows[self._tree.query_ball_point(place, reach + 0.5)])


def _count(line_map: LineMap, probes: _Probes, bins: _Bins, view: View) -> None:
    if not len(view.points):
        return
    lengths = np.hypot(*view.points.T)
    points = view.points[lengths < _FAR]
    place, ends = np.asarray(pga2.move_point(view.motor, np.zeros(2))), np.asarray(pga2.move_point(view.motor, points))
    rows = probes.near(place, min(float(lengths.max()), _FAR))
    if not len(rows) or not len(points):
        return
    lines, spans = line_map.lines[rows], line_map.spans[rows]
    off = np.asarray(pga2.signed_distance_point_line(ends[:, None], lines[None]))
    along = np.asarray(pga2.position_along_line(ends[:, None], lines[None]))
    from_here = np.asarray(pga2.signed_distance_point_line(place, lines))
    within = (along >= spans[:, 0]) & (along <= spans[:, 1])
    # Of several segments, a reading is of the nearest one that faces the scanner.
    distance = np.where(within & (from_here < 0), np.abs(off), np.inf)
    nearest = distance.argmin(1)
    hit = distance[np.arange(len(ends)), nearest] < _HIT
    beam, column = np.flatnonzero(hit), nearest[hit]
    np.add.at(bins.hits, _bin(bins, rows[column], along[beam, column] - spans[column, 0]), 1)
    bins.square += float((off[beam, column] ** 2).sum())
    bins.n_hits += len(beam)
    # The signed distances of both ends of a beam show where it crosses the line.
    share = -from_here / np.where(off == from_here, np.inf, off - from_here)
    start = np.asarray(pga2.position_along_line(place, lines))
    at = start + share * (along - start)
    steep = np.abs(off - from_here) > _STEEP * np.hypot(*(ends - place).T)[:, None]
    crosses = (from_here < 0) & (off > _BEYOND) & steep & (at > spans[:, 0]) & (at < spans[:, 1])
    beam, column = np.nonzero(crosses)
    np.add.at(bins.crossings, _bin(bins, rows[column], at[beam, column] - spans[column, 0]), 1)


def _bin(bins: _Bins, rows: Reals, along: Reals) -> Reals:
    last = bins.first[rows + 1] - 1
    return np.asarray(np.minimum(bins.first[rows] + (along / _BIN).astype(int), last))


def _split(line_map: LineMap, bins: _Bins) -> LineMap:
    open_ = (bins.crossings >= _FEWEST_CROSSINGS) & (bins.crossings > bins.hits)
    confirmed = (bins.hits > 0) & ~open_
    rows, spans, shares = [], [], []
    for row in range(len(line_map)):
        piece = slice(bins.first[row], bins.first[row + 1])
        hits, there = bins.hits[piece], np.flatnonzero(confirmed[piece])
        if not len(there):
            continue
        begin, end = line_map.spans[row]
        breaks = np.flatnonzero(np.diff(there) * _BIN > _HOLE)
        for run in np.split(there, breaks + 1):
            rows.append(row)
            spans.append((begin + run[0] * _BIN, min(begin + (run[-1] + 1) * _BIN, end)))
            shares.append(hits[run].sum() / max(hits.sum(), 1))
    picked = line_map.rows(np.array(rows, int))
    return picked.with_spans(np.array(spans).reshape(-1, 2), np.array(shares))
