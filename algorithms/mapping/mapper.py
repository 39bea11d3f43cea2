"""Maps from streams of scans with odometry: poses along the path, closures of loops, and a map of line segments."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import ArrayLike

from generated import pga2

from ..arguments import Reals, finite_number
from .built_map import BuildSettings, BuiltMap, MapStep, Progress, ScanStatus
from .keyframes import IDENTITY, Keyframes
from .line_map import LineMap
from .line_views import View, seen_through
from .loops import Closure, StoredScans, agree, find_far_loop, find_loop
from .matching import match_scans
from .motions import length_and_angle, relative
from .odometry_noise import OdometryNoise, pose_of
from .recovery import ENOUGH, RESTING, contradicts, earlier_match, has_moved, is_new_view
from .scan import Scan
from .segments import Segments, segments
from .status import MappingStatus
from .surfaces import Alignment, Reference, Surface, align, surface

_GOOD = 0.55
"""The share of readings on known surfaces below which other starts are tried."""
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


class Mapper:
    """Build a map of line segments from scans, one at a time.

    Parameters
    ----------
    settings : BuildSettings, optional

    Examples
    --------
    >>> import numpy as np
    >>> from algorithms.mapping import Mapper, Scan
    >>> beams = np.linspace(-np.pi / 2, np.pi / 2, 181)
    >>> walls = 3 / np.maximum(np.abs(np.sin(beams)), 1e-9), 4 / np.maximum(np.cos(beams), 1e-9)
    >>> mapper = Mapper()
    >>> step = mapper.add(Scan(np.minimum(*walls), -np.pi / 2, np.pi / 180, 30.0), odometry=[0, 0, 0], time=0.0)
    >>> step.status.name, step.pose.tolist(), len(mapper.map().added)
    ('ADDED', [0.0, 0.0, 0.0], 1)

    Notes
    -----
    Of each scan the pose and the status are kept, and of added ones also the readings on surfaces and the segments.
    `pickle` stores a mapper in a file, and it continues where it was.

    Scans are compared once odometry has moved by the least length or angle of the settings; until then they are
    STANDING. Odometry that rests while most readings change has failed, and counts as missing.
    """

    def __init__(self, settings: BuildSettings | None = None) -> None:
        self._options = settings or BuildSettings()
        self._path = Keyframes()
        self._statuses: list[int] = []
        self._bases: list[int] = []
        self._offsets: list[Reals] = []
        """The pose of each scan, in the frame of the added scan `base`."""
        self._times: list[float] = []
        self._added: list[int] = []
        self._segments: list[Segments] = []
        self._scans = StoredScans()
        self._pending: Closure | None = None
        """A loop without a prior that no other one has confirmed."""
        self._motion: Reals = IDENTITY
        self._spread: Reals = np.zeros((3, 3))
        """The last estimate of the pose in the frame of the last added scan, and its covariance."""
        self._odometry: Reals | None = None
        """The odometry at that estimate."""
        self._last: Scan | None = None
        """The last scan at a known motion from the last added one."""
        self._jumped = self._by_odometry = self._rests = False
        """Whether the odometry of the last scan jumps, whether the estimate was moved by it, and whether both rest."""
        self._uncertain, self._by_scans = _SPREAD**2, np.zeros(3)
        """The variances of the motion by odometry and by scans since the last added one: angle, x, y."""
        self._noise = OdometryNoise()
        self._unmatched = 0
        self._closed_at = 0.0
        self._speed = IDENTITY
        """The motion between the last two added scans."""
        self._new_loops, self._optimised_at = 0, 0

    @property
    def status(self) -> ScanStatus | None:
        """What was done with the last scan; None before the first one."""
        return ScanStatus(self._statuses[-1]) if self._statuses else None

    @property
    def motor(self) -> Reals:
        """(4,) The pose of the last scan: the motor from its frame to that of the map."""
        if not len(self._path):
            return self._motion
        return np.asarray(pga2.motor_product(self._path.motors[-1], self._motion))

    @property
    def covariance(self) -> Reals:
        """(3, 3) Of the error of the pose in the frame of the scan: angle, x, y, in radians and metres.

        It is that of the motions along the path until a closure of a loop leads to an optimisation, and then the
        marginal covariance in the graph of poses.
        """
        if not len(self._path):
            return self._spread
        return self._path.spread_after(self._motion, self._spread)

    def add(self, scan: Scan, odometry: ArrayLike | None = None, time: float | None = None) -> MapStep:
        """Take the next scan of the stream.

        Parameters
        ----------
        scan : Scan
        odometry : array_like, (3,) or (4,), optional
            x, y and the angle, or a unit motor of `generated.pga2`; in a frame of its own. Odometry that is not finite
            counts as missing.
        time : float, optional
            In seconds. It limits how far odometry can have moved.

        Returns
        -------
        MapStep

        Raises
        ------
        TypeError, ValueError
            If `scan` is no `Scan`, the odometry is neither a pose nor a unit motor, or the time is no finite number.
        """
        if not isinstance(scan, Scan):
            raise TypeError(f"scan: {type(scan).__name__}; expected a Scan")
        seconds = None if time is None else finite_number(time, "time")
        n_loops, optimised_at = len(self._path.loops), self._optimised_at
        self._take(scan, pose_of(odometry), seconds)
        loops = self._path.loops
        closure = None if len(loops) == n_loops else tuple(self._added[row] for row in loops[-1])
        return MapStep(
            self.motor, ScanStatus(self._statuses[-1]), self.covariance, closure, self._optimised_at != optimised_at,
            len(self._statuses), len(self._path), len(loops),
        )  # fmt: skip

    def _take(self, scan: Scan, odometry: Reals | None, time: float | None) -> None:
        self._times.append(np.nan if time is None else float(time))
        measured = self._predict(scan, odometry)
        # The motion of a sequence of scans that do not match may be that much for each of them.
        self._spread = np.diag(self._variances() if measured else (_LOST * (1 + self._unmatched)) ** 2)
        self._keep_or_add(scan, measured)
        known = measured or self._statuses[-1] in (ScanStatus.ADDED, ScanStatus.ASSUMED, ScanStatus.STANDING)
        if known and not self._rests:
            self._last = scan

    def _keep_or_add(self, scan: Scan, measured: bool) -> None:
        few = len(scan.beams) < self._options.min_points
        if not few and len(self._path) and measured and self._is_near():
            self._keep(ScanStatus.STANDING)
            return
        seen = surface(scan)
        if few or len(seen.points) < self._options.min_points:
            self._keep(ScanStatus.TOO_FEW_READINGS)
        elif not len(self._path):
            self._extend(scan, seen, IDENTITY, np.eye(3), ScanStatus.ADDED)
        else:
            self._match(scan, seen, measured)

    def _predict(self, scan: Scan, odometry: Reals | None) -> bool:
        """Move the estimate by odometry, or else by the last scan, and return whether one of them is known."""
        before, self._jumped, self._by_odometry, self._rests = self._odometry, False, False, False
        self._odometry = None
        if odometry is not None:
            self._odometry = pga2.motor_from_angle_translation(odometry[2], odometry[:2])
        if before is not None and self._odometry is not None:
            step = relative(before, self._odometry)
            length, angle = length_and_angle(step)
            passed = np.diff(self._times[-2:])[0] if len(self._times) > 1 else np.nan
            self._jumped = length > _LONGEST_STEP + (_FASTEST * passed if 0 < passed < 60 else 0.0)
            self._rests = max(length, angle) < RESTING and not has_moved(self._last, scan)
            # Otherwise, the odometry has failed if it rests: the motion is that from the last scan before it did.
            if not self._jumped and (self._rests or max(length, angle) >= RESTING):
                self._by_odometry = True
                added = np.array([_SHARE_OF_ANGLE * angle, *[_SHARE_OF_LENGTH * length] * 2])
                return self._moved(step, added**2, np.zeros(3))
        if self._last is None or not len(self._path):
            return False
        match = match_scans(self._last, scan)
        if match.status != MappingStatus.OK:
            return False
        xx, yy, angles = np.diag(match.covariance)
        return self._moved(match.motor, np.zeros(3), np.array([angles, xx + yy, xx + yy]))

    def _moved(self, step: Reals, uncertain: Reals, by_scans: Reals) -> bool:
        self._motion = np.asarray(pga2.motor_product(self._motion, step))
        self._uncertain, self._by_scans = self._uncertain + uncertain, self._by_scans + by_scans
        return True

    def _variances(self) -> Reals:
        """Return the variances of the predicted motion: angle, x, y."""
        return np.asarray(self._noise.learnt(self._uncertain) + self._by_scans)

    def _is_near(self) -> bool:
        length, angle = length_and_angle(self._motion)
        return bool(length < self._options.min_length and angle < self._options.min_angle)

    def _keep(self, status: ScanStatus) -> None:
        self._statuses.append(status)
        self._bases.append(len(self._path) - 1)
        self._offsets.append(self._motion)

    def _extend(self, scan: Scan, seen: Surface, motion: Reals, information: Reals, status: ScanStatus) -> None:
        self._path.add(seen, motion, information)
        self._speed = motion
        self._segments.append(segments(scan))
        self._scans.add(scan)
        self._added.append(len(self._statuses))
        self._motion, self._spread, self._unmatched = IDENTITY, np.zeros((3, 3)), 0
        self._uncertain, self._by_scans = _SPREAD**2, np.zeros(3)
        self._keep(status)
        if self._options.close_loops:
            self._close_loop()

    def _match(self, scan: Scan, seen: Surface, measured: bool) -> None:
        last = len(self._path) - 1
        reference = self._path.submap(np.arange(max(last + 1 - self._options.n_recent, 0), last + 1), last)
        prior = np.diag(1 / np.diag(self._spread))
        # Without a prediction, robots go on as before, or have stopped.
        guesses = [self._motion] if measured else [self._speed, self._motion]
        best = self._aligned(scan, seen, reference, guesses, prior)
        accepted = best is not None and (best.share >= ENOUGH or (measured and is_new_view(best)))
        if best is not None and self._by_odometry and accepted:
            accepted = not contradicts(self._scans[last], scan, best)
        if best is not None and accepted:
            if self._by_odometry:
                angle, shift = pga2.motor_to_angle_translation(relative(self._motion, best.motor))
                self._noise.add(np.array([angle, *shift]), self._uncertain)
            # Without a prediction, the readings agree with the motion but do not prove it.
            information = best.information + prior if measured else prior
            self._motion, self._spread = best.motor, np.linalg.inv(information)
            if not measured and self._is_near():
                self._keep(ScanStatus.STANDING)
            else:
                status = ScanStatus.ADDED if measured else ScanStatus.ASSUMED
                self._extend(scan, seen, best.motor, information, status)
            return
        recovered = earlier_match(self._path, self._scans, scan, seen, self._motion)
        if recovered is not None:
            row, found = recovered
            last = len(self._path) - 1
            there = pga2.motor_product(self._path.motors[row], found.motor)
            motion = np.asarray(relative(self._path.motors[last], there))
            self._motion, self._spread = motion, np.linalg.inv(found.information)
            if row == last:
                self._extend(scan, seen, motion, found.information, ScanStatus.ADDED)
                return
            # The motion since the last scan is not measured: the closure determines the pose.
            self._extend(scan, seen, motion, np.diag(1 / _LOST**2), ScanStatus.ADDED)
            self._path.add_loop((row, last + 1), found.motor, found.information)
            return
        self._unmatched += 1
        if measured and self._unmatched > _MOST_UNMATCHED:
            self._extend(scan, seen, self._motion, prior, ScanStatus.BY_ODOMETRY)
        else:
            self._keep(ScanStatus.ODOMETRY_JUMP if self._jumped else ScanStatus.NOT_MATCHED)

    def _aligned(
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
            match = match_scans(self._scans[len(self._path) - 1], scan)
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
            if best.share >= _GOOD or (len(guesses) == 1 and is_new_view(best)):
                break
        return best

    def _close_loop(self) -> None:
        here = float(self._path.travelled[-1])
        found = find_loop(self._path, here - self._closed_at)
        if found is not None:
            self._pending = None
        elif here - self._closed_at > _LONG_AGO and len(self._path) % _SELDOM == 0:
            found = self._confirmed(find_far_loop(self._path, self._scans, here - self._closed_at))
        if found is None:
            return
        self._closed_at = here
        self._path.add_loop(found.edge, found.motion, found.information)
        self._new_loops += 1
        n = len(self._path)
        is_due = found.shift > _SHIFT and n - self._optimised_at > n / _RARELY
        if is_due or self._new_loops > max(_MOST_NEW_LOOPS, n / 20):
            self._path.optimise()
            self._new_loops, self._optimised_at = 0, n

    def _confirmed(self, found: Closure | None) -> Closure | None:
        """Return a loop without a prior if the previous one, a short way before, corrects the path alike."""
        before = self._pending
        if found is None:
            return None
        self._pending = found
        if before is None or self._path.travelled[-1] - self._path.travelled[before.edge[1]] > _CONFIRMED_WITHIN:
            return None
        if not agree(self._path, before, found):
            return None
        self._pending = None
        self._path.add_loop(before.edge, before.motion, before.information)
        return found

    def map(self, progress: Callable[[Progress], None] | None = None) -> BuiltMap:
        """Optimise the poses, and fuse the segments of all scans so far. More scans can be added afterwards.

        Parameters
        ----------
        progress : callable, optional
            Called with a `Progress` before each stage.

        Returns
        -------
        BuiltMap
        """

        def report(stage: str) -> None:
            if progress is not None:
                progress(Progress(len(self._statuses), len(self._path), len(self._path.loops), stage))

        report("poses")
        wrong = 0
        if len(self._path.loops):
            wrong = self._path.n_bounded(self._path.optimise())
        report("lines")
        line_map, residual = self._line_map()
        added = np.array(self._added, int)
        closures = added[np.array(self._path.loops, int).reshape(-1, 2)]
        return BuiltMap(
            self._motors(), np.array(self._statuses, int), line_map, added, closures, wrong, residual,
            np.array(self._times),
        )  # fmt: skip

    def _motors(self) -> Reals:
        bases, offsets = np.array(self._bases, int), np.array(self._offsets).reshape(-1, 4)
        if not len(self._path):
            return offsets
        # Scans before the first one that was added are in its frame.
        return np.asarray(pga2.motor_product(self._path.motors[np.maximum(bases, 0)], offsets))

    def _line_map(self) -> tuple[LineMap, float]:
        found = LineMap.empty()
        for each, motor in zip(self._segments, self._path.motors, strict=True):
            found = found.updated(each, motor).map
        views = (View(motor, part.points) for motor, part in zip(self._path.motors, self._path.surfaces, strict=True))
        options = self._options
        rough = found.merged().pruned(options.min_views, options.min_segment)
        cut, residual = seen_through(rough, views)
        return cut.merged().pruned(options.min_views, options.min_segment, options.most_lines), residual
