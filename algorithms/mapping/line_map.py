"""Maps of line segments: association of measured segments, fusion in information form, extension and merging."""

from __future__ import annotations

import struct
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from generated import line_maps, pga2

from ..arguments import Reals, finite, real_array
from ..precision import SINGLE
from .segments import Segments
from .status import MappingStatus

_ANGLE = np.sin(np.radians(7.0))
"""The largest sine of the angle between segments of one wall."""
_OFFSET = 0.12
"""The largest distance between segments of one wall where both were seen, in metres."""
_GAP, _GAP_OFFSET = 0.25, 0.05
"""Segments that do not overlap are of one wall if the gap, and the offset there, are at most this."""
_FLOOR = np.array([np.radians(0.3) ** 2, 0.0, 0.015**2])
"""The covariance of angle and offset that poses and scanners add to each measured segment, as an upper triangle."""
_CHUNK = 256
"""A limit on memory: the number of lines that are compared with all earlier ones at a time."""
_VERSION = 1
"""The version of the format of files."""
_DAMAGED = (
    *(ValueError, EOFError, LookupError, TypeError, AttributeError, RuntimeError, OverflowError, SyntaxError),
    *(struct.error, zipfile.BadZipFile, zlib.error),
)
"""What readers of archives and of numpy raise for damaged files."""
_EXPECTED = {
    "lines": "a unit line",
    "spans": "a start before its end",
    "spreads": "the upper triangle of a covariance",
    "counts": "a number of readings",
    "n_views": "a number of views",
}


@dataclass(frozen=True, slots=True, eq=False)
class LineMap:
    """A map of line segments; every change makes a new map.

    Each row is a side of a wall: the normal points away from the side from which it was seen.
    """

    lines: Reals
    """(k, 3) The unit lines of `generated.pga2`."""
    spans: Reals
    """(k, 2) The positions of the two ends along the line (`pga2.position_along_line`), the smaller first."""
    spreads: Reals
    """(k, 3) Upper triangles of the covariances of the angle, and of the offset at the middle of the segment."""
    counts: Reals
    """(k,) How many readings each segment was fitted to."""
    n_views: Reals
    """(k,) In how many scans it was found."""

    @classmethod
    def empty(cls) -> LineMap:
        """Return a map without segments."""
        return cls(np.zeros((0, 3)), np.zeros((0, 2)), np.zeros((0, 3)), np.zeros(0, int), np.zeros(0, int))

    def __len__(self) -> int:
        """Return the number of segments."""
        return len(self.lines)

    @property
    def normals(self) -> Reals:
        """(k, 2) Unit normals n of the lines ``n . x = offset``."""
        return self.lines[:, :2]

    @property
    def offsets(self) -> Reals:
        """(k,) Signed distances of the lines from the origin, along the normals."""
        return -self.lines[:, 2]

    @property
    def ends(self) -> Reals:
        """(k, 2, 2) The points at the two ends."""
        return np.asarray(pga2.point_on_line(self.lines[:, None], self.spans))

    @property
    def middles(self) -> Reals:
        """(k, 2) The points halfway between the ends."""
        return np.asarray(pga2.point_on_line(self.lines, self.spans.mean(1)))

    @property
    def lengths(self) -> Reals:
        """(k,) The lengths in metres."""
        return self.spans[:, 1] - self.spans[:, 0]

    @property
    def covariances(self) -> Reals:
        """(k, 2, 2) Covariances of the angle and of the distance from the origin."""
        feet = np.asarray(pga2.line_support(self.lines))
        _, triangles = line_maps.line_seen_from(self.lines, feet, self.lines, self.middles, self.spreads)
        return np.asarray(triangles[:, [0, 1, 1, 2]].reshape(-1, 2, 2))

    def updated(self, found: Segments, motor: ArrayLike) -> LineMapUpdate:
        """Add the segments of a scan.

        A segment is fused with the one of the map that it overlaps most, if their angle and their distance there are
        small and they were seen from the same side; it extends that one. The others become rows of the map.

        Parameters
        ----------
        found : Segments
            In the frame of the robot.
        motor : array_like, (4,)
            The pose, a unit motor from that frame to the frame of the map.

        Returns
        -------
        LineMapUpdate
            With the same map if no segment is usable.
        """
        pose = real_array(motor, "motor", (4,), "a motor").astype(float)
        good = (
            np.isfinite(found.offsets)
            & np.isfinite(found.covariances).all((1, 2))
            & np.isfinite(found.ends).all((1, 2))
        )
        rows = np.full(len(found), -1)
        if not good.any() or not np.isfinite(pose).all():
            return LineMapUpdate(self, MappingStatus.TOO_FEW_READINGS, rows)
        measured = _measured(found, good, pose)
        kept = np.flatnonzero(good)
        result = self
        chosen = result._partners(measured)
        # A row can take one segment at a time, since it changes.
        while (chosen >= 0).any():
            _, first = np.unique(np.where(chosen >= 0, chosen, len(result)), return_index=True)
            first = first[chosen[first] >= 0]
            result = result._fused(chosen[first], measured.rows(first))
            rows[kept[first]] = chosen[first]
            chosen[first] = -1
        alone = np.flatnonzero(rows[kept] < 0)
        rows[kept[alone]] = len(result) + np.arange(len(alone))
        return LineMapUpdate(result._joined(measured.rows(alone)), MappingStatus.OK, rows)

    def merged(self) -> LineMap:
        """Return a map in which rows that are of one wall are fused."""
        result = self
        for _ in range(20):
            order = np.argsort(-result.counts, kind="stable")
            result = result.rows(order)
            partners = result._earlier_partners()
            # Pairs are disjoint in each round: a row that takes another one is not taken.
            taken = np.flatnonzero((partners >= 0) & (partners[np.maximum(partners, 0)] < 0))
            _, first = np.unique(partners[taken], return_index=True)
            taken = taken[first]
            if not len(taken):
                break
            fused = result._fused(partners[taken], result.rows(taken))
            result = fused.rows(np.setdiff1d(np.arange(len(result)), taken))
        return result

    def pruned(self, min_views: int = 2, min_length: float = 0.3, most: int | None = None) -> LineMap:
        """Return the map without segments that were found in few scans or are short, and of the others the longest."""
        rows = np.flatnonzero((self.n_views >= min_views) & (self.lengths >= min_length))
        if most is not None and len(rows) > most:
            rows = np.sort(rows[np.argsort(-self.lengths[rows], kind="stable")[:most]])
        return self.rows(rows)

    def moved(self, motor: ArrayLike) -> LineMap:
        """Return the map, moved by a unit motor."""
        pose = finite(real_array(motor, "motor", (4,), "a motor").astype(float), "motor")
        ends = np.asarray(pga2.move_point(pose, self.ends))
        lines = np.asarray(pga2.move_line(pose, self.lines))
        return replace(self, lines=lines, spans=_positions(lines, ends))

    def save(self, path: str | Path) -> None:
        """Write the map as a file of numpy (npz)."""
        arrays = {name: getattr(self, name) for name in self.__dataclass_fields__}
        with Path(path).open("wb") as file:
            np.savez_compressed(file, version=_VERSION, **arrays)

    @classmethod
    def load(cls, path: str | Path) -> LineMap:
        """Read a map that `save` has written.

        Raises
        ------
        OSError, ValueError
            If the file cannot be read, is damaged or not a map, or if its lines are not unit lines, spans are reversed,
            or covariances have negative eigenvalues.
        """
        try:
            with Path(path).open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
        except _DAMAGED as error:
            raise ValueError(f"{path}: {error}; expected a map of LineMap.save; the file is damaged") from error
        missing = {*cls.__dataclass_fields__, "version"} - set(arrays)
        if missing:
            raise ValueError(f"{path}: no array {', '.join(sorted(missing))}; expected a map of LineMap.save")
        version = arrays.pop("version")
        if version.shape != () or version != _VERSION:
            raise ValueError(f"{path}: version {version}; expected {_VERSION}")
        arrays = {name: arrays[name] for name in cls.__dataclass_fields__}
        k = arrays["lines"].shape[0] if arrays["lines"].ndim else 0
        shapes = {"lines": (k, 3), "spans": (k, 2), "spreads": (k, 3), "counts": (k,), "n_views": (k,)}
        for name, shape in shapes.items():
            kind = arrays[name].dtype.kind
            if arrays[name].shape != shape or kind not in "iuf" or not np.isfinite(arrays[name]).all():
                raise ValueError(f"{path}: {name} has shape {arrays[name].shape}; expected {shape}, finite numbers")
        lengths = np.hypot(*arrays["lines"][:, :2].T)
        first, mixed, second = arrays["spreads"].T
        for name, wrong in (
            ("lines", np.abs(lengths - 1) > SINGLE),
            ("spans", arrays["spans"][:, 0] > arrays["spans"][:, 1]),
            ("spreads", (first < 0) | (second < 0) | (mixed**2 > first * second * (1 + SINGLE))),
            ("counts", arrays["counts"] < 0),
            ("n_views", arrays["n_views"] < 0),
        ):
            if wrong.any():
                k = int(np.argmax(wrong))
                raise ValueError(f"{path}: {name}[{k}] {arrays[name][k]}; expected {_EXPECTED[name]}")
        return cls(**arrays)

    def rows(self, rows: Reals) -> LineMap:
        """Return the map of some rows."""
        return LineMap(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    def with_spans(self, spans: Reals, shares: Reals) -> LineMap:
        """Return pieces of the segments, which have shares of their readings."""
        middles = np.asarray(pga2.point_on_line(self.lines, spans.mean(1)))
        _, spreads = line_maps.line_seen_from(self.lines, middles, self.lines, self.middles, self.spreads)
        counts = np.round(self.counts * shares).astype(int)
        return replace(self, spans=spans, spreads=np.asarray(spreads), counts=counts)

    def _joined(self, other: LineMap) -> LineMap:
        names = self.__dataclass_fields__
        return LineMap(*(np.concatenate([getattr(self, name), getattr(other, name)]) for name in names))

    def _scores(self, other: LineMap) -> Reals:
        """Return for each segment of another map and each row how well they fit; negative infinite if not at all."""
        p, q = np.moveaxis(other.ends, 1, 0)[:, :, None]
        lines, spans = self.lines[None], self.spans
        overlap, sine, first, second = line_maps.overlap_of_segments(lines, spans[:, 0], spans[:, 1], p, q)
        same_side = other.normals @ self.normals.T > 0
        off = np.maximum(np.abs(first), np.abs(second))
        close = np.where(overlap > 0, off < _OFFSET, (overlap > -_GAP) & (off < _GAP_OFFSET))
        good = same_side & close & (np.abs(sine) < _ANGLE)
        return np.where(good, overlap - off, -np.inf)

    def _partners(self, other: LineMap) -> Reals:
        """Return for each segment of another map the row that it belongs to, or -1."""
        if not len(self) or not len(other):
            return np.full(len(other), -1)
        reach = (self.lengths / 2)[None] + (other.lengths / 2)[:, None] + _GAP
        apart = np.abs(other.middles[:, None] - self.middles[None]).max(-1)
        near = np.flatnonzero((apart < reach).any(0))
        if not len(near):
            return np.full(len(other), -1)
        scores = self.rows(near)._scores(other)
        return np.where(np.isfinite(scores.max(1)), near[scores.argmax(1)], -1)

    def _earlier_partners(self) -> Reals:
        """Return for each row an earlier one that is of the same wall, or -1."""
        found = np.full(len(self), -1)
        for start in range(0, len(self), _CHUNK):
            rows = np.arange(start, min(start + _CHUNK, len(self)))
            scores = self.rows(np.arange(rows[-1] + 1))._scores(self.rows(rows))
            scores[np.arange(rows[-1] + 1)[None] >= rows[:, None]] = -np.inf
            found[rows] = np.where(np.isfinite(scores.max(1)), scores.argmax(1), -1)
        return found

    def _fused(self, rows: Reals, other: LineMap) -> LineMap:
        """Return the map with each segment of another one fused into its row; rows must differ."""
        lines, middles = self.lines[rows], self.middles[rows]
        change, spreads = line_maps.line_seen_from(lines, middles, other.lines, other.middles, other.spreads)
        correction, fused, _ = line_maps.fuse_lines(self.spreads[rows], spreads, change)
        new = np.asarray(line_maps.changed_line(lines, middles, correction))
        ends = np.concatenate([self.ends[rows], other.ends], 1)
        spans = _positions(new, ends)
        centres = np.asarray(pga2.point_on_line(new, spans.mean(1)))
        _, at_centres = line_maps.line_seen_from(new, centres, new, middles, fused)
        arrays = {name: getattr(self, name).copy() for name in self.__dataclass_fields__}
        for name, values in (("lines", new), ("spans", spans), ("spreads", at_centres)):
            arrays[name][rows] = values
        arrays["counts"][rows] += other.counts
        arrays["n_views"][rows] += other.n_views
        return LineMap(**arrays)


@dataclass(frozen=True, slots=True, eq=False)
class LineMapUpdate:
    """Result of `LineMap.updated`."""

    map: LineMap
    status: MappingStatus
    """OK, or TOO_FEW_READINGS if nothing was usable; the map is then the one before."""
    rows: Reals
    """(k,) For each segment of the scan its row in the map, or -1 if it was not usable."""


def same_wall(line_map: LineMap) -> Iterator[tuple[int, int]]:
    """Yield pairs of rows that are of one wall: of a map without duplicates, none."""
    for row, partner in enumerate(line_map._earlier_partners()):
        if partner >= 0:
            yield int(partner), row


def _measured(found: Segments, good: Reals, pose: Reals) -> LineMap:
    """Return the usable segments of a scan as a map of their own."""
    lines = np.concatenate([found.normals, -found.offsets[:, None]], 1)[good]
    middles = found.ends[good].mean(1)
    triangles = found.covariances[good].reshape(-1, 4)[:, [0, 1, 3]]
    feet = np.asarray(pga2.line_support(lines))
    _, spreads = line_maps.line_seen_from(lines, middles, lines, feet, triangles)
    moved = np.asarray(pga2.move_line(pose, lines))
    spans = _positions(moved, np.asarray(pga2.move_point(pose, found.ends[good])))
    return LineMap(moved, spans, spreads + _FLOOR, found.counts[good].astype(int), np.ones(len(lines), int))


def _positions(lines: Reals, points: Reals) -> Reals:
    """Return the smallest and largest positions (k, 2) of points (k, n, 2) along lines (k, 3)."""
    positions = np.asarray(pga2.position_along_line(points, lines[:, None]))
    return np.stack([positions.min(1), positions.max(1)], 1)
