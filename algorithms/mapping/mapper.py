"""Maps from streams of scans with odometry: poses along the path, closures of loops, and a map of line segments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from generated import pga2

from ..arguments import Reals, finite_number
from .built_map import BuildSettings, BuiltMap, MapStep, Progress, ScanStatus
from .free_space import sight_of
from .keyframes import IDENTITY, Keyframes
from .line_views import View, fused
from .loop_closing import Loops
from .loops import StoredScans
from .matching import Match, match_scans
from .motions import length_and_angle, relative
from .odometry_noise import OdometryNoise, pose_of
from .recovery import ENOUGH, RESTING, contradicts, earlier_match, has_moved, is_far, is_new_view
from .rivals import Rivals
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
_KNOWN = (ScanStatus.ADDED, ScanStatus.ASSUMED, ScanStatus.STANDING, ScanStatus.LOST)
"""The statuses of scans at a known motion from the scans before them."""


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

    What later scans see through, such as people, is left out of the surfaces that scans are aligned with. Covariances
    include the other motions that odometry leaves possible, by what they explain of a scan.

    Where scans see through walls at the place by odometry, the robot may have been carried. The scans that follow are
    LOST until two of them match scans of the map before, without a prior, and both agree on the place.
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
        self._loops = Loops()
        self._speed = IDENTITY
        """The motion between the last two added scans."""

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
        n_loops, optimised_at = len(self._path.loops), self._loops.optimised_at
        self._take(scan, pose_of(odometry), seconds)
        loops, lost = self._path.loops, self._loops.parts.lost_since
        closure = None if len(loops) == n_loops else tuple(self._added[row] for row in loops[-1])
        return MapStep(
            self.motor, ScanStatus(self._statuses[-1]), self.covariance, closure,
            self._loops.optimised_at != optimised_at, len(self._statuses), len(self._path), len(loops),
            None if lost is None else self._added[lost],
        )  # fmt: skip

    @property
    def _first(self) -> int:
        """The first pose whose scan is compared with the next one."""
        return max(len(self._path) - self._options.n_recent, self._loops.parts.start)

    def _take(self, scan: Scan, odometry: Reals | None, time: float | None) -> None:
        self._times.append(np.nan if time is None else float(time))
        measured = self._predict(scan, odometry)
        # The motion of a sequence of scans that do not match may be that much for each of them.
        self._spread = np.diag(self._variances() if measured else (_LOST * (1 + self._unmatched)) ** 2)
        self._keep_or_add(scan, odometry, measured)
        known = measured or self._statuses[-1] in _KNOWN
        if known and not self._rests:
            self._last = scan

    def _keep_or_add(self, scan: Scan, odometry: Reals | None, measured: bool) -> None:
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
            self._match(scan, seen, measured, odometry is not None)

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
        if status in (ScanStatus.ADDED, ScanStatus.STANDING) and self._loops.parts.lost_since is not None:
            status = ScanStatus.LOST
        self._statuses.append(status)
        self._bases.append(len(self._path) - 1)
        self._offsets.append(self._motion)

    def _extend(self, scan: Scan, seen: Surface, motion: Reals, information: Reals, status: ScanStatus) -> None:
        self._path.add(seen, motion, information)
        self._path.look(sight_of(scan), self._first)
        self._speed = motion
        self._segments.append(segments(scan))
        self._scans.add(scan)
        self._added.append(len(self._statuses))
        self._motion, self._spread, self._unmatched = IDENTITY, np.zeros((3, 3)), 0
        self._uncertain, self._by_scans = _SPREAD**2, np.zeros(3)
        self._keep(status)
        if self._options.close_loops and self._loops.close(self._path, self._scans):
            # Scans have shown where a lost robot is.
            self._statuses[-1] = ScanStatus.ADDED

    def _match(self, scan: Scan, seen: Surface, measured: bool, has_odometry: bool) -> None:
        last = len(self._path) - 1
        reference = self._path.submap(np.arange(self._first, last + 1), last)
        prior = np.diag(1 / np.diag(self._spread))
        has_failed = has_odometry and not self._by_odometry and not self._jumped
        # Without a prediction, robots go on as before, or have stopped.
        guesses = [self._motion] if measured else [self._speed, self._motion]
        others = Rivals(reference, seen, self._motion, prior) if measured and len(reference.points) else None
        likely = [] if others is None else [others.best]
        # It takes as long as the rest, and is not always needed.
        match = lru_cache(maxsize=1)(lambda: match_scans(self._scans[last], scan))
        best = self._aligned(seen, reference, guesses, prior, likely, match)
        accepted = best is not None and (best.share >= ENOUGH or (measured and is_new_view(best)))
        if best is not None and self._by_odometry and accepted and others is not None:
            wrong = contradicts(match(), best, reference, seen, others) or self._is_contradicted(scan, best.motor)
            accepted = not wrong
        if best is not None and accepted:
            if self._by_odometry:
                angle, shift = pga2.motor_to_angle_translation(relative(self._motion, best.motor))
                self._noise.add(np.array([angle, *shift]), self._uncertain)
            # Without a prediction, the readings agree with the motion but do not prove it.
            motor, information = best.motor, prior
            if others is not None:
                information = best.information + prior
                # Wheels have slipped if the scan sees through walls wherever odometry leaves it.
                if not (others.is_slip(motor) and self._is_contradicted(scan, others.best)):
                    motor, spread = others.around(motor)
                    information = np.linalg.inv(np.linalg.inv(information) + spread)
            if has_failed and is_far(motor, _LOST * (1 + self._unmatched)):
                # Rooms look alike.
                information = self._loops.begin_part(len(self._path))
            self._motion, self._spread = motor, np.linalg.inv(information)
            if not measured and self._is_near():
                self._keep(ScanStatus.STANDING)
            else:
                if not measured and has_odometry:
                    information = self._loops.begin_part(len(self._path))
                status = ScanStatus.ADDED if measured or has_odometry else ScanStatus.ASSUMED
                self._extend(scan, seen, motor, information, status)
            return
        recovered = earlier_match(self._path, self._scans, scan, seen, self._motion, match())
        if recovered is not None and not (has_failed and recovered[0] != last):
            row, found = recovered
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
            information = prior
            if self._is_contradicted(scan, self._motion):
                information = self._loops.begin_part(len(self._path))
            self._extend(scan, seen, self._motion, information, ScanStatus.BY_ODOMETRY)
        else:
            self._keep(ScanStatus.ODOMETRY_JUMP if self._jumped else ScanStatus.NOT_MATCHED)

    def _is_contradicted(self, scan: Scan, motion: Reals) -> bool:
        return self._path.is_contradicted(sight_of(scan), motion, self._first)

    def _aligned(
        self, seen: Surface, reference: Reference, guesses: list[Reals], prior: Reals, likely: list[Reals],
        match: Callable[[], Match],
    ) -> Alignment | None:  # fmt: skip
        """Return the alignment that explains most readings; more starts are tried until one explains enough."""

        def starts() -> Iterator[Reals]:
            yield from (*likely, *guesses)
            if len(guesses) > 1:
                yield from matched()
            for turn in _TURNS:
                for guess in guesses:
                    yield pga2.motor_product(guess, pga2.motor_from_angle_translation(turn, np.zeros(2)))
            if len(guesses) == 1:
                yield from matched()

        def matched() -> Iterator[Reals]:
            if match().status not in (MappingStatus.NOT_MATCHED, MappingStatus.TOO_FEW_READINGS):
                yield from (match().motor, *match().others)

        best: Alignment | None = None
        for start in starts():
            found = align(reference, seen, start, guesses[0], prior)
            angle, shift = pga2.motor_to_angle_translation(relative(guesses[0], found.motor))
            off = np.array([angle, *shift])
            if off @ prior @ off > _CREDIBLE and (found.share < _CERTAIN or len(match().others)):
                continue
            if best is None or found.share > best.share:
                best = found
            if best.share >= _GOOD or (len(guesses) == 1 and is_new_view(best)):
                break
        return best

    def map(self, progress: Callable[[Progress], None] | None = None, *, certain: bool = False) -> BuiltMap:
        """Optimise the poses, and fuse the segments of all scans so far. More scans can be added afterwards.

        Parameters
        ----------
        progress : callable, optional
            Called with a `Progress` before each stage.
        certain : bool, optional
            Whether to leave out the lines of scans that nothing ties to the first one.

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
        tied = self._loops.parts.certain(len(self._path))
        rows = np.flatnonzero(tied if certain else np.ones_like(tied)).tolist()
        views = [View(self._path.motors[row], self._path.surfaces[row].points) for row in rows]
        options = self._options
        line_map, residual = fused(
            [self._segments[row] for row in rows], views, options.min_views, options.min_segment, options.most_lines
        )
        added = np.array(self._added, int)
        closures = added[np.array(self._path.loops, int).reshape(-1, 2)]
        return BuiltMap(
            self._motors(), np.array(self._statuses, int), line_map, added, tied, closures, wrong, residual,
            np.array(self._times),
        )  # fmt: skip

    def _motors(self) -> Reals:
        bases, offsets = np.array(self._bases, int), np.array(self._offsets).reshape(-1, 4)
        if not len(self._path):
            return offsets
        # Scans before the first one that was added are in its frame.
        return np.asarray(pga2.motor_product(self._path.motors[np.maximum(bases, 0)], offsets))
