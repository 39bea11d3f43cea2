"""What `Mapper` and `build_map` take and return: settings, progress, the statuses of scans, and the map."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from generated import pga2

from ..arguments import Reals
from ..evidence import Status
from .carmen import Problem
from .line_map import LineMap


class ScanStatus(Status):
    """What was done with a scan."""

    ADDED = 0
    """The scan agrees with the scans before it, and was added to the map."""
    STANDING = 1
    """The robot has hardly moved since the last scan of the map; the pose is that by odometry."""
    BY_ODOMETRY = 2
    """The last scans did not agree with those before them; the scan was added at the pose by odometry."""
    TOO_FEW_READINGS = 3
    """Refused: not enough readings are on surfaces. The pose is that by odometry, or the previous one."""
    NOT_MATCHED = 4
    """Refused: no motion explains enough of the readings."""
    ODOMETRY_JUMP = 5
    """Refused: the odometry jumps, and no motion explains the readings."""
    ASSUMED = 6
    """Without odometry, the scan and the previous one do not determine the motion. The scan was added at a motion which
    agrees with the readings, such as the last one again; the covariance is that of an unknown motion."""
    LOST = 7
    """The scan agrees with the ones before it and was added, or the robot stands, but scans contradict the odometry at
    some time before, and nothing has shown yet where in the map the robot was then. The covariance is that of an
    unknown motion, and the scans before that time are the part of the map that is certain."""


REFUSED = (ScanStatus.TOO_FEW_READINGS, ScanStatus.NOT_MATCHED, ScanStatus.ODOMETRY_JUMP)
"""The statuses of scans that leave the map as it was."""


@dataclass(frozen=True, slots=True)
class BuildSettings:
    """Settings of `build_map`; lengths in metres, angles in radians."""

    close_loops: bool = True
    """Whether earlier places are recognised."""
    min_length: float = 0.1
    min_angle: float = float(np.radians(5.0))
    """Scans are added if the robot has moved or turned by one of these since the last one that was added."""
    n_recent: int = 25
    """The number of scans that a new one is compared with."""
    min_points: int = 10
    """The fewest readings on surfaces of a usable scan."""
    most_lines: int = 600
    """The map keeps at most this many segments, the longest."""
    min_views: int = 2
    """Segments of the map were found in at least this many scans."""
    min_segment: float = 0.3
    """The length of the shortest segment."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far the building of a map is."""

    n_scans: int
    n_added: int
    n_loops: int
    stage: str
    """``scans``, ``poses`` or ``lines``."""


@dataclass(frozen=True, slots=True, eq=False)
class MapStep:
    """Result of `Mapper.add`."""

    motor: Reals
    """(4,) The pose of the scan: the motor from its frame to that of the map, which is that of the first scan."""
    status: ScanStatus
    covariance: Reals
    """(3, 3) Of the error of the pose in the frame of the scan: angle, x, y, in radians and metres."""
    closure: tuple[int, ...] | None
    """The earlier and the later one of the two scans between which a loop was closed; None if there was none."""
    moved: bool
    """Whether the poses of earlier scans have changed."""
    n_scans: int
    n_added: int
    n_loops: int
    lost_since: int | None = None
    """The scan since which the place in the map is unknown; None if it is known."""

    @property
    def pose(self) -> Reals:
        """(3,) x, y and the angle of the pose."""
        angle, shift = pga2.motor_to_angle_translation(self.motor)
        return np.array([*shift, angle])


@dataclass(frozen=True, slots=True, eq=False)
class BuiltMap:
    """Result of `build_map`."""

    motors: Reals
    """(n, 4) The pose of each scan: the motor from its frame to that of the map, which is that of the first scan."""
    statuses: Reals
    """(n,) int, a `ScanStatus` each."""
    line_map: LineMap
    added: Reals
    """(k,) int. The scans that were added to the map."""
    certain: Reals
    """(k,) bool. Whether scans tie each of these to the first one, rather than odometry that they contradict."""
    closures: Reals
    """(m, 2) int. Pairs of scans, earlier and later, between which a loop was closed."""
    n_wrong_closures: int
    """How many of these contradict the others, so that they had little influence."""
    residual: float
    """The root mean square of the distances of readings from segments of the map, in metres."""
    times: Reals
    """(n,) Time stamps; NaN where there are none."""
    problems: tuple[Problem, ...] = ()
    """Parts of the log that could not be read."""

    @property
    def poses(self) -> Reals:
        """(n, 3) x, y and the angle of each pose."""
        angles, shifts = pga2.motor_to_angle_translation(self.motors)
        return np.concatenate([shifts, angles[..., None]], -1)

    @property
    def refused(self) -> dict[str, int]:
        """How many scans were refused, by reason."""
        found = Counter(int(status) for status in self.statuses)
        return {status.name: found[status] for status in REFUSED if found[status]}
