"""Reader of logs of laser scans and odometry in the text format of CARMEN, one scan at a time."""

from __future__ import annotations

import gzip
import itertools
import math
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..arguments import Reals
from .scan import Scan

FARTHEST = 30.0
"""The default range, in metres, from which readings count as not measured: scanners report 30 or 80 m for nothing."""
_LONGEST_STEP = 60.0
"""Time stamps jump if they increase by more than this, in seconds."""
_MOST_PROBLEMS = 20
"""A limit on memory: the number of problems that are described; further ones are only counted."""
_SEARCHED = 2000
"""A limit on memory: lines that are searched for odometry before the first scan is returned, and scans that wait for
the next line of odometry."""
_LONGEST_GAP = 1.0
"""Odometry is interpolated between lines that are at most this far apart, in seconds: robots turn and stop."""
_RULER = 1e6
"""Coordinates of poses beyond this, in metres, are errors."""


class Reading(NamedTuple):
    """A scan of a log, with what is known of where and when it was taken."""

    scan: Scan
    odometry: Reals | None
    """(3,) x, y and the angle of the robot by its wheels, or None if the log has none."""
    time: float | None
    """The time stamp in seconds, or None if the log has none."""
    pose: Reals | None = None
    """(3,) The pose that the log has for the scan itself; in corrected logs, the result of another program."""


class _Odometry(NamedTuple):
    """A line of odometry: x, y and the angle, and its time stamp if there is one."""

    pose: Reals
    time: float | None = None


def _between(one: _Odometry | None, two: _Odometry | None, time: float | None) -> Reals | None:
    """Return the pose at a time between two lines of odometry; None if it is not known."""
    if one is None or two is None or time is None or one.time is None or two.time is None:
        return None
    passed = two.time - one.time
    if not (0 < passed <= _LONGEST_GAP and one.time <= time <= two.time):
        return None
    change = two.pose - one.pose
    change[2] = (change[2] + np.pi) % (2 * np.pi) - np.pi
    return np.asarray(one.pose + (time - one.time) / passed * change)


class Problem(NamedTuple):
    """A part of a log that could not be used."""

    line: int
    """The number of the line, from 1."""
    reason: str


def beam_angles(n: int) -> tuple[float, float]:
    """Return the angle of the first beam, and the step, of a scanner with n beams over half a turn, in radians.

    With 181 or 361 beams the first and the last one are half a turn apart. With 180, 360 and other numbers, the last
    beam is one step before that.
    """
    if n in (181, 361):
        return -math.pi / 2, math.pi / (n - 1)
    return -math.pi / 2, math.pi / max(n, 1)


class CarmenLog:
    """A log of lines ``FLASER``, ``ROBOTLASER1`` and ``ODOM``; iterating yields a `Reading` for each scan.

    The memory does not grow with the log. Lines that are damaged are left out and listed in `problems`. A file that has
    lines, but no scan, odometry or damaged one of them, is of another format: ValueError is raised at its end.

    Parameters
    ----------
    source : path, or iterable of str
        A file, which may be compressed by gzip, or lines.
    max_range : float, optional
        Readings from this range on count as not measured. The ranges of ``ROBOTLASER1`` lines that state a smaller one
        are cut there.

    Notes
    -----
    The odometry of a scan is interpolated to its time between ``ODOM`` lines that are at most a second apart. Otherwise
    it is that of the last line before it, or of the first one in the log for earlier scans. A scan is returned once the
    next line of odometry, a scan more than a second after the last one, or 2,000 more scans were read.

    If the log begins with 2,000 lines without ``ODOM``, it is the odometry in the line of the scan; of an iterator,
    these lines are kept until then. In corrected logs those numbers are the corrected pose again.

    Examples
    --------
    >>> lines = ["ODOM 1.0 2.0 0.5 0 0 0 7.0 robot 7.0", "FLASER 2 1.5 81.83 4.0 5.0 0.1 4.0 5.0 0.1 7.1 robot 7.1"]
    >>> reading, = CarmenLog(lines)
    >>> reading.scan.points().round(9).tolist(), reading.odometry.tolist(), reading.time
    ([[0.0, -1.5]], [1.0, 2.0, 0.5], 7.1)
    """

    def __init__(self, source: str | Path | Iterable[str], max_range: float = FARTHEST) -> None:
        if not max_range > 0:
            raise ValueError(f"max_range: {max_range}; expected a positive length in metres")
        self._source, self._max_range = source, float(max_range)
        self.problems: list[Problem] = []
        """The first 20 parts of the log that could not be used."""
        self.n_problems = 0
        """How many there are."""
        self.n_scans = 0
        """The number of scans so far."""
        self.n_jumps = 0
        """How many time stamps are earlier than the previous one, or more than a minute later."""
        self.n_untimed = 0
        """How many scans have no time stamp, or 0."""

    def __iter__(self) -> Iterator[Reading]:
        """Read the log from its start."""
        self.problems, self.n_problems, self.n_scans, self.n_jumps, self.n_untimed = [], 0, 0, 0, 0
        first, lines = self._begun()
        last = None if first is None else _Odometry(first)
        earlier: _Odometry | None = None
        waiting: list[Reading] = []
        before: float | None = None
        number, known = 0, False
        for number, line in enumerate(lines, 1):
            kind = line.split(maxsplit=1)[0] if not line.isspace() else ""
            known |= kind == "ODOM" or kind in _PARSERS
            try:
                if kind == "ODOM":
                    earlier, last = last, _odometry(line)
                    yield from _placed(waiting, earlier, last, earlier)
                    waiting = []
                elif kind in _PARSERS:
                    reading = _PARSERS[kind](line, self._max_range)
                    self.n_scans += 1
                    self.n_untimed += reading.time is None
                    if reading.time is not None:
                        self.n_jumps += before is not None and not 0 <= reading.time - before <= _LONGEST_STEP
                        before = reading.time
                    if len(waiting) < _SEARCHED and _waits(last, reading, bool(waiting)):
                        waiting.append(reading)
                    else:
                        # Either the scan was taken between the last two lines, or nothing is known of its time.
                        yield from _placed(waiting, last, None, last)
                        waiting = []
                        yield from _placed([reading], earlier, last, last)
            except ValueError as error:
                self._report(number, f"{kind}: {error}; the line was left out")
        yield from _placed(waiting, last, None, last)
        if number and not known:
            name = self._source if isinstance(self._source, (str, Path)) else "log"
            raise ValueError(
                f"{name}: {number} lines, none of them FLASER, ROBOTLASER1 or ODOM; expected a log of CARMEN"
            )

    def _report(self, number: int, reason: str) -> None:
        self.n_problems += 1
        if len(self.problems) < _MOST_PROBLEMS:
            self.problems.append(Problem(number, reason))

    def _begun(self) -> tuple[Reals | None, Iterator[str]]:
        """Return the first odometry near the start, if there is one, and all lines."""
        # The lines of an iterator can be read only once.
        is_once = not isinstance(self._source, (str, Path)) and iter(self._source) is self._source
        lines, read = self._lines(quiet=True), []
        first: Reals | None = None
        for line in itertools.islice(lines, _SEARCHED):
            if is_once:
                read.append(line)
            if line.startswith("ODOM"):
                try:
                    first = _pose(line.split()[1:4])
                    break
                except ValueError:
                    continue
        return first, itertools.chain(read, lines) if is_once else self._lines()

    def _lines(self, quiet: bool = False) -> Iterator[str]:
        if not isinstance(self._source, (str, Path)):
            yield from self._source
            return
        number = 0
        with Path(self._source).open("rb") as raw:
            packed = raw.read(2) == b"\x1f\x8b"
            raw.seek(0)
            file = gzip.GzipFile(fileobj=raw) if packed else raw
            try:
                for line in file:
                    number += 1
                    yield line.decode("ascii", "replace")
            except (EOFError, OSError, zlib.error) as error:
                if not quiet:
                    self._report(number + 1, f"{error}; the log ends here")


def _waits(odometry: _Odometry | None, reading: Reading, others_wait: bool) -> bool:
    """Return whether the next line of odometry may tell where a scan was taken, or scans before it wait for one."""
    if odometry is None or odometry.time is None or reading.time is None:
        return others_wait
    passed = reading.time - odometry.time
    return passed <= _LONGEST_GAP and (others_wait or passed > 0)


def _placed(
    readings: list[Reading], one: _Odometry | None, two: _Odometry | None, before: _Odometry | None
) -> Iterator[Reading]:
    """Yield readings with the odometry between two lines, or else that of the line before them, if there is one."""
    for each in readings:
        pose = _between(one, two, each.time)
        if pose is None and before is not None:
            pose = before.pose
        yield each if pose is None else each._replace(odometry=pose)


def _odometry(line: str) -> _Odometry:
    words = line.split()
    try:
        time = float(words[7]) if len(words) > 7 else 0.0
    except ValueError:
        time = 0.0
    return _Odometry(_pose(words[1:4]), time if np.isfinite(time) and time > 0 else None)


def _pose(words: list[str]) -> Reals:
    if len(words) < 3:
        raise ValueError(f"{len(words)} numbers of a pose; expected 3")
    pose = np.array(words[:3], float)
    if not np.isfinite(pose).all() or np.abs(pose).max() > _RULER:
        raise ValueError(f"pose {' '.join(words[:3])}; expected finite numbers up to {_RULER:.0e}")
    return pose


def _ranges(words: list[str], n: int) -> Reals:
    if len(words) < n:
        raise ValueError(f"{len(words)} of {n} ranges")
    return np.array(words[:n], float)


def _count(word: str, what: str) -> int:
    n = int(word)
    if n < 0:
        raise ValueError(f"{n} {what}; expected 0 or more")
    return n


def _time(words: list[str], line: str) -> float | None:
    """Return the time stamp before the name of the host; a line without its end may be cut within a number."""
    if len(words) < 3 and not line.endswith("\n"):
        raise ValueError("the line is cut off")
    time = float(words[0]) if words else 0.0
    return time if np.isfinite(time) and time > 0 else None


def _flaser(line: str, max_range: float) -> Reading:
    words = line.split()
    if len(words) < 2:
        raise ValueError("no number of ranges")
    n = _count(words[1], "ranges")
    ranges, rest = _ranges(words[2:], n), words[2 + n :]
    if len(rest) < 6:
        raise ValueError(f"{len(rest)} numbers after the ranges; expected 6 of the two poses")
    pose, odometry = _pose(rest[:3]), _pose(rest[3:6])
    return Reading(Scan(ranges, *beam_angles(n), max_range), odometry, _time(rest[6:], line), pose)


def read_robotlaser(line: str, max_range: float) -> Reading:
    """Read a line ``ROBOTLASER1``.

    Raises
    ------
    ValueError
        If the line is damaged.
    """
    words = line.split()
    if len(words) < 9:
        raise ValueError(f"{len(words) - 1} numbers; expected 8 of the scanner")
    start, _, step, farthest = (float(word) for word in words[2:6])
    n = _count(words[8], "ranges")
    ranges, rest = _ranges(words[9:], n), words[9 + n :]
    rest = rest[1 + _count(rest[0], "remissions") if rest else 0 :]
    if len(rest) < 6:
        raise ValueError(f"{len(rest)} numbers after the remissions; expected 6 of the two poses")
    pose, odometry = _pose(rest[:3]), _pose(rest[3:6])
    if step == 0 and n > 1:
        start, step = beam_angles(n)
    limit = min(max_range, farthest) if farthest > 0 else max_range
    return Reading(Scan(ranges, start, step or 1.0, limit), odometry, _time(rest[11:], line), pose)


_PARSERS = {"FLASER": _flaser, "ROBOTLASER1": read_robotlaser}
