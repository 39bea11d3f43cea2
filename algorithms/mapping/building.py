"""Maps from streams of scans with odometry: poses along the path, closures of loops, and a map of line segments."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from generated import pga2

from ..arguments import Reals
from .built_map import BuildSettings, BuiltMap, Progress, ScanStatus
from .carmen import CarmenLog, Problem
from .g2o import read_g2o
from .keyframes import IDENTITY, Keyframes
from .line_map import LineMap
from .line_views import View, seen_through
from .loops import Closure, StoredScans, agree, find_far_loop, find_loop
from .matching import match_scans
from .motions import length_and_angle, relative
from .odometry_noise import OdometryNoise
from .scan import Scan
from .segments import Segments, segments
from .status import MappingStatus
from .surfaces import Alignment, Reference, Surface, align, surface

_GOOD, _ENOUGH = 0.55, 0.4
"""Shares of readings on known surfaces below which other starts are tried, and below which a scan is refused."""
_AGREES, _OVERLAP = 0.7, 0.15
"""With odometry, a smaller share is enough if at least this part of the readings near known surfaces are on them."""
_CREDIBLE = 20.0
"""The largest squared deviation of a motion from that by odometry, divided by its covariance."""
_CERTAIN = 0.85
"""The share of readings on known surfaces from which a motion is accepted although odometry contradicts it."""
_TURNS = np.radians([7.0, -7.0, 14.0, -14.0, 25.0, -25.0])
_SHIFT, _RARELY, _MOST_NEW_LOOPS = 0.15, 100, 50
"""Poses are optimised if a loop moves the last one by more than this and the path is longer by a hundredth, or after
this many loops."""
_LONG_AGO, _SELDOM, _CONFIRMED_WITHIN = 25.0, 3, 8.0
"""Loops without a prior are looked for at every third scan after this length of path without a loop, in metres, and
are confirmed by another one within this length."""
_MOST_UNMATCHED = 1
"""After this many scans in sequence that do not match, the next one is added by odometry alone."""
_LONGEST_STEP, _FASTEST = 3.0, 2.0
"""Odometry jumps if it moves by more than a length in metres and a velocity in metres per second."""
_SPREAD = np.array([np.radians(3.0), 0.1, 0.1])
"""Standard deviations of odometry between two scans: angle, x, y."""
_SHARE_OF_ANGLE, _SHARE_OF_LENGTH = 0.1, 0.15
"""What standard deviations grow by, as a share of the angle and the length of a motion."""
_LOST = np.array([np.radians(30.0), 1.0, 1.0])
"""Standard deviations of the motion between two scans without odometry."""


def build_map(
    source: str | Path | Iterable[Any],
    settings: BuildSettings | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> BuiltMap:
    """Build a map of line segments from scans, with or without odometry.

    Parameters
    ----------
    source : path, or iterable
        A log of CARMEN; a graph of g2o with scans (``.g2o``, or a zip archive), whose vertices are the odometry; or an
        iterable of triples of a `Scan`, the odometry or None, and the time or None, such as `CarmenLog`; or of scans
        alone. The odometry is x, y and an angle, or a motor (4,).
    settings : BuildSettings, optional
    progress : callable, optional
        Called with a `Progress` after each scan and before each later stage.

    Returns
    -------
    BuiltMap

    Raises
    ------
    OSError
        If a file cannot be read.
    TypeError, ValueError
        If an element of the iterable has no `Scan`, or its odometry has another shape.

    Notes
    -----
    Scans are read one at a time. Of each scan the pose and the status are kept, and of added ones also the readings on
    surfaces and the segments.
    """
    options = settings or BuildSettings()
    readings, log = _readings(source)
    builder = _Builder(options)
    for item in readings:
        scan, odometry, time = _triple(item)
        builder.add(scan, odometry, time)
        if progress is not None:
            progress(Progress(len(builder.statuses), len(builder.path), len(builder.path.loops), "scans"))
    return replace(builder.finished(progress), problems=tuple(log()))


def _readings(source: Any) -> tuple[Iterable[Any], Callable[[], Iterable[Problem]]]:
    if isinstance(source, (str, Path)):
        if str(source).endswith((".g2o", ".g2o.gz", ".zip")):
            graph = read_g2o(source)
            return graph.readings, lambda: graph.problems
        source = CarmenLog(source)
    return source, lambda: getattr(source, "problems", ())


def _triple(item: Any) -> tuple[Scan, Reals | None, float | None]:
    """Return the scan of an element, its odometry as x, y and angle, and its time."""
    parts = (item,) if isinstance(item, Scan) else item
    if not isinstance(parts, (tuple, list)) or not parts or not isinstance(parts[0], Scan):
        raise TypeError(f"scans: {type(item).__name__}; expected triples of a Scan, the odometry and the time")
    scan, odometry, time = (*parts[:3], None, None)[:3]
    if odometry is None:
        return scan, None, time
    pose = np.asarray(odometry, float)
    if pose.shape not in ((3,), (4,)):
        raise ValueError(f"odometry: shape {pose.shape}; expected (3,), x, y and angle, or (4,), a motor")
    if not np.isfinite(pose).all():
        return scan, None, time
    if pose.shape == (4,):
        angle, shift = pga2.motor_to_angle_translation(pose)
        pose = np.array([*shift, angle])
    return scan, pose, time


def _is_new_view(found: Alignment) -> bool:
    """Return whether readings near known surfaces are on them, though most readings are elsewhere."""
    return found.agreement >= _AGREES and found.share >= _OVERLAP


class _Builder:
    """The state while scans are read."""

    def __init__(self, options: BuildSettings) -> None:
        self._options = options
        self.path = Keyframes()
        self.statuses: list[int] = []
        self._bases: list[int] = []
        self._offsets: list[Reals] = []
        """The pose of each scan, in the frame of the added scan `base`."""
        self._times: list[float] = []
        self._added: list[int] = []
        self._segments: list[Segments] = []
        self._scans = StoredScans()
        self._pending: Closure | None = None
        """A loop without a prior that no other one has confirmed."""
        self._motion = IDENTITY
        """The last estimate of the pose in the frame of the last added scan."""
        self._odometry: Reals | None = None
        """The odometry at that estimate."""
        self._uncertain = _SPREAD**2
        self._noise = OdometryNoise()
        self._unmatched = 0
        self._speed = IDENTITY
        self._closed_at = 0.0
        self._new_loops, self._optimised_at = 0, 0

    def add(self, scan: Scan, odometry: Reals | None, time: float | None) -> None:
        """Take the next scan of the stream."""
        self._times.append(np.nan if time is None else float(time))
        # After a scan that was added without odometry, one with odometry begins a new sequence.
        measured = odometry is not None and self._odometry is not None
        jumped = self._predict(odometry)
        few = len(scan.beams) < self._options.min_points
        if not few and len(self.path) and measured and not jumped and self._is_near():
            self._keep(ScanStatus.STANDING)
            return
        seen = surface(scan)
        if few or len(seen.points) < self._options.min_points:
            self._keep(ScanStatus.TOO_FEW_READINGS)
        elif not len(self.path):
            self._extend(scan, seen, IDENTITY, np.eye(3), ScanStatus.ADDED)
        else:
            self._match(scan, seen, jumped, measured)
        if odometry is None and self.statuses[-1] == ScanStatus.ADDED:
            self._odometry = None

    def _predict(self, odometry: Reals | None) -> bool:
        """Move the estimate by odometry, and return whether that jumps."""
        jumped = False
        if odometry is not None:
            now = pga2.motor_from_angle_translation(odometry[2], odometry[:2])
            if self._odometry is not None:
                step = relative(self._odometry, now)
                length, angle = length_and_angle(step)
                passed = np.diff(self._times[-2:])[0] if len(self._times) > 1 else np.nan
                allowed = _LONGEST_STEP + (_FASTEST * passed if 0 < passed < 60 else 0.0)
                jumped = length > allowed
                if not jumped:
                    self._motion = np.asarray(pga2.motor_product(self._motion, step))
                    added = np.array([_SHARE_OF_ANGLE * angle, *[_SHARE_OF_LENGTH * length] * 2])
                    self._uncertain = self._uncertain + added**2
            self._odometry = now
        return jumped

    def _is_near(self) -> bool:
        length, angle = length_and_angle(self._motion)
        return bool(length < self._options.min_length and angle < self._options.min_angle)

    def _keep(self, status: ScanStatus) -> None:
        self.statuses.append(status)
        self._bases.append(len(self.path) - 1)
        self._offsets.append(self._motion)

    def _extend(self, scan: Scan, seen: Surface, motion: Reals, information: Reals, status: ScanStatus) -> None:
        self.path.add(seen, motion, information)
        self._segments.append(segments(scan))
        self._scans.add(scan)
        self._added.append(len(self.statuses))
        self._motion, self._uncertain, self._unmatched = IDENTITY, _SPREAD**2, 0
        self._speed = motion
        self._keep(status)
        if self._options.close_loops:
            self._close_loop()

    def _match(self, scan: Scan, seen: Surface, jumped: bool, measured: bool) -> None:
        last = len(self.path) - 1
        reference = self.path.submap(np.arange(max(last + 1 - self._options.n_recent, 0), last + 1), last)
        sure = measured and not jumped
        prior = np.diag(1 / (self._noise.learnt(self._uncertain) if sure else _LOST**2))
        # Without odometry, robots go on as before, or have stopped.
        guesses = [self._motion] if sure else [self._motion, self._speed] if measured else [self._speed, self._motion]
        best = self._best(scan, seen, reference, guesses, prior)
        if best is not None and (best.share >= _ENOUGH or (sure and _is_new_view(best))):
            if not measured:
                self._motion = best.motor
                if self._is_near():
                    self._keep(ScanStatus.STANDING)
                    return
            if sure:
                angle, shift = pga2.motor_to_angle_translation(relative(self._motion, best.motor))
                self._noise.add(np.array([angle, *shift]), self._uncertain)
            self._extend(scan, seen, best.motor, best.information + prior, ScanStatus.ADDED)
            return
        self._unmatched += 1
        if sure and self._unmatched > _MOST_UNMATCHED:
            self._extend(scan, seen, self._motion, prior, ScanStatus.BY_ODOMETRY)
        else:
            self._keep(ScanStatus.ODOMETRY_JUMP if jumped else ScanStatus.NOT_MATCHED)

    def _best(
        self, scan: Scan, seen: Surface, reference: Reference, guesses: list[Reals], prior: Reals
    ) -> Alignment | None:
        """Return the alignment that explains most readings; more starts are tried until one explains enough."""

        def starts() -> Iterator[Reals]:
            yield from guesses
            if len(guesses) > 1:
                yield from matched()
            for turn in _TURNS:
                for guess in guesses:
                    yield pga2.motor_product(guess, pga2.motor_from_angle_translation(turn, np.zeros(2)))
            if len(guesses) == 1:
                yield from matched()

        def matched() -> Iterator[Reals]:
            match = match_scans(self._scans[len(self.path) - 1], scan)
            if match.status not in (MappingStatus.NOT_MATCHED, MappingStatus.TOO_FEW_READINGS):
                yield from (match.motor, *match.others)

        best: Alignment | None = None
        for start in starts():
            found = align(reference, seen, start, guesses[0], prior)
            angle, shift = pga2.motor_to_angle_translation(relative(guesses[0], found.motor))
            off = np.array([angle, *shift])
            if off @ prior @ off > _CREDIBLE and found.share < _CERTAIN:
                continue
            if best is None or found.share > best.share:
                best = found
            if best.share >= _GOOD or (len(guesses) == 1 and _is_new_view(best)):
                break
        return best

    def _close_loop(self) -> None:
        here = float(self.path.travelled[-1])
        found = find_loop(self.path, here - self._closed_at)
        if found is not None:
            self._pending = None
        elif here - self._closed_at > _LONG_AGO and len(self.path) % _SELDOM == 0:
            found = self._confirmed(find_far_loop(self.path, self._scans, here - self._closed_at))
        if found is None:
            return
        self._closed_at = here
        self.path.add_loop(found.edge, found.motion, found.information)
        self._new_loops += 1
        n = len(self.path)
        is_due = found.shift > _SHIFT and n - self._optimised_at > n / _RARELY
        if is_due or self._new_loops > max(_MOST_NEW_LOOPS, n / 20):
            self.path.optimise()
            self._new_loops, self._optimised_at = 0, n

    def _confirmed(self, found: Closure | None) -> Closure | None:
        """Return a loop without a prior if the previous one, a short way before, corrects the path alike."""
        before = self._pending
        if found is None:
            return None
        self._pending = found
        if before is None or self.path.travelled[-1] - self.path.travelled[before.edge[1]] > _CONFIRMED_WITHIN:
            return None
        if not agree(self.path, before, found):
            return None
        self._pending = None
        self.path.add_loop(before.edge, before.motion, before.information)
        return found

    def finished(self, progress: Callable[[Progress], None] | None) -> BuiltMap:
        """Optimise the poses, and fuse the segments."""

        def report(stage: str) -> None:
            if progress is not None:
                progress(Progress(len(self.statuses), len(self.path), len(self.path.loops), stage))

        report("poses")
        wrong = 0
        if len(self.path.loops):
            wrong = self.path.n_bounded(self.path.optimise())
        report("lines")
        line_map, residual = self._line_map()
        added = np.array(self._added, int)
        return BuiltMap(
            self._motors(), np.array(self.statuses, int), line_map, added, added[self.path.loops], wrong, residual,
            np.array(self._times),
        )  # fmt: skip

    def _motors(self) -> Reals:
        bases, offsets = np.array(self._bases, int), np.array(self._offsets).reshape(-1, 4)
        if not len(self.path):
            return offsets
        # Scans before the first one that was added are in its frame.
        return np.asarray(pga2.motor_product(self.path.motors[np.maximum(bases, 0)], offsets))

    def _line_map(self) -> tuple[LineMap, float]:
        found = LineMap.empty()
        for each, motor in zip(self._segments, self.path.motors, strict=True):
            found = found.updated(each, motor).map
        views = (View(motor, part.points) for motor, part in zip(self.path.motors, self.path.surfaces, strict=True))
        options = self._options
        rough = found.merged().pruned(options.min_views, options.min_segment)
        cut, residual = seen_through(rough, views)
        return cut.merged().pruned(options.min_views, options.min_segment, options.most_lines), residual
