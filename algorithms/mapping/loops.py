"""Closures of loops: earlier poses of a path at which the surroundings of the last one were seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generated import pga2

from ..arguments import Reals
from .keyframes import Keyframes
from .matching import EXPLAINED, match_scans
from .motions import are_near, length_and_angle, relative
from .outlines import outline_of
from .scan import Scan
from .status import MappingStatus
from .support import support
from .surfaces import Alignment, Surface, align

_OLDER = 8.0
"""Loops are at least this long, in metres."""
_RADIUS, _DRIFT = 2.0, 0.02
"""Earlier poses within this distance are compared: in metres, and as a share of the path since the last closure."""
_BEFORE, _AROUND = 6, 8
"""How many poses before the last one, and on each side of an earlier one, make the submaps that are compared."""
_SHARE, _RMS = 0.75, 0.05
"""The least share of points on the surface of the other submap, and the largest root mean square of their distances."""
_DETERMINED = 0.03
"""The least ratio of the information along a corridor and across it."""
_FAR_OLDER = 30.0
"""Loops without a prior are at least this long, in metres."""
_FAR, _FAR_DRIFT, _MOST_TRIED, _APART = 4.0, 0.03, 4, 2.0
"""How far they are looked for, as for `_RADIUS` and `_DRIFT`, at how many places, and how far these are apart."""
_SCORE = 0.6
"""The least score of two scans at the ends of such a loop."""
_AGREED = 0.5, float(np.radians(3.0))
"""Two closures agree if what they correct differs by at most this."""
_MOST_POINTS = 500
"""A limit on work: about the number of points of a submap that are aligned."""
_FEWEST_POINTS = 60
"""Points that a submap needs to be compared with others."""


@dataclass(frozen=True, slots=True, eq=False)
class Closure:
    """A loop that was found."""

    edge: tuple[int, int]
    motion: Reals
    information: Reals
    shift: float
    """How far the closure moves the last pose, in metres and radians, each relative to 1 m and 1 rad."""


class StoredScans:
    """Scans in single precision. It has one owner, the builder of a map, which adds scans."""

    def __init__(self) -> None:
        self._stored: list[tuple[Reals, float, float, float]] = []

    def add(self, scan: Scan) -> None:
        """Store a scan."""
        self._stored.append((scan.ranges.astype(np.float32), scan.angle_min, scan.angle_step, scan.max_range))

    def __getitem__(self, row: int) -> Scan:
        """Return a scan."""
        return Scan(*self._stored[row])


def find_loop(path: Keyframes, since: float) -> Closure | None:
    """Look for an earlier pose near the last one whose surroundings agree with those of the last one.

    Parameters
    ----------
    path : Keyframes
    since : float
        The length of the path since the last closure.
    """
    last = len(path) - 1
    motors = relative(path.motors[last], path.motors)
    angles, shifts = pga2.motor_to_angle_translation(motors)
    distances = np.hypot(shifts[:, 0], shifts[:, 1])
    older = path.travelled[last] - path.travelled > _OLDER
    near = np.flatnonzero(older & (distances < _RADIUS + _DRIFT * since))
    if not len(near):
        return None
    # Scanners look forward: of the poses near by, one with a similar direction sees more of the same.
    other = int(near[np.argmin(distances[near] + 1.5 * np.abs(np.sin(angles[near] / 2)))])
    return _compared(path, other, relative(path.motors[other], path.motors[last]))


def find_far_loop(path: Keyframes, scans: StoredScans, since: float) -> Closure | None:
    """Look for an earlier pose farther away, without a prior for the motion.

    Parameters
    ----------
    path : Keyframes
    scans : StoredScans
        The scans at the poses.
    since : float
        The length of the path since the last closure.

    Notes
    -----
    Places look alike, so that one such closure alone is no proof: see `agree`.
    """
    last = len(path) - 1
    places = pga2.motor_to_angle_translation(path.motors)[1]
    distances = np.hypot(*(places - places[last]).T)
    near = np.flatnonzero(
        (path.travelled[last] - path.travelled > _FAR_OLDER) & (distances < _FAR + _FAR_DRIFT * since)
    )
    tried: list[int] = []
    for row in near[np.argsort(distances[near], kind="stable")]:
        if len(tried) == _MOST_TRIED:
            break
        if tried and np.hypot(*(places[tried] - places[row]).T).min() < _APART:
            continue
        tried.append(int(row))
        match = match_scans(scans[int(row)], scans[last])
        if match.status == MappingStatus.OK and match.score >= _SCORE:
            found = _compared(path, int(row), match.motor)
            if found is not None:
                return found
    return None


def find_certain(path: Keyframes, scans: StoredScans, certain: Reals, first: int) -> Closure | None:
    """Look for a pose in the certain part of a path at which the scan of the last pose was taken, without a prior.

    Parameters
    ----------
    path : Keyframes
    scans : StoredScans
        The scans at the poses.
    certain : array, (n,)
        Whether each pose is certain.
    first : int
        The first one of the last poses between which all motions are measured.

    Notes
    -----
    A few poses are tried for each scan, spread over the path, and others for the next one.
    """
    last, rows = len(path) - 1, np.flatnonzero(certain)
    scan = scans[last]
    for row in rows[last % -(-len(rows) // _MOST_TRIED) :: -(-len(rows) // _MOST_TRIED)].tolist():
        match = match_scans(scans[row], scan)
        if match.status != MappingStatus.OK or match.score < _SCORE:
            continue
        # Without a prior, places that look alike differ in what scans see through.
        if support(outline_of(scans[row]), outline_of(scan), match.motor, EXPLAINED).contradicting >= 1:
            continue
        found = _compared(path, row, match.motor, rows, first)
        if found is not None:
            return found
    return None


def agree(path: Keyframes, a: Closure, b: Closure) -> bool:
    """Return whether two closures correct the path alike."""
    corrections = []
    for each in (a, b):
        first, second = path.motors[each.edge[0]], path.motors[each.edge[1]]
        moved = pga2.motor_product(first, each.motion)
        corrections.append(pga2.motor_product(moved, pga2.motor_inverse(second)))
    # Both are compared at the last pose, since far from the origin small angles move points far.
    here = path.motors[b.edge[1]]
    one, other = (np.asarray(pga2.motor_product(each, here)) for each in corrections)
    return bool(are_near(one, other, *_AGREED))


def _compared(
    path: Keyframes, other: int, start: Reals, allowed: Reals | None = None, first: int = 0
) -> Closure | None:
    """Align the submap of poses from `first` to the last one with that around another one.

    The latter is made of allowed poses, or else of those that are earlier by a length of the path.
    """
    last = len(path) - 1
    rows = np.arange(max(other - _AROUND, 0), min(other + _AROUND + 1, last))
    if allowed is None:
        rows = rows[path.travelled[last] - path.travelled[rows] > _OLDER / 2]
    else:
        rows = np.intersect1d(rows, allowed)
    seen = _thinned(path.parts(np.arange(max(last - _BEFORE, first), last + 1), last))
    if len(seen.points) < _FEWEST_POINTS:
        return None
    found = align(path.submap(rows, other), seen, start)
    if not (is_certain(found) if allowed is None else _agrees(found)):
        return None
    shift = relative(relative(path.motors[other], path.motors[last]), found.motor)
    return Closure((other, last), found.motor, found.information, sum(length_and_angle(shift)))


def is_certain(found: Alignment) -> bool:
    """Return whether an alignment fits well and is determined in all directions."""
    return found.share >= _SHARE and _is_determined(found)


def _agrees(found: Alignment) -> bool:
    """Return the same of what both submaps show: a lost robot may see walls that the map does not have."""
    return found.agreement >= _SHARE and _is_determined(found)


def _is_determined(found: Alignment) -> bool:
    values = np.linalg.eigvalsh(found.information[1:, 1:])
    return bool(found.rms <= _RMS and values[0] >= _DETERMINED * values[1])


def _thinned(parts: list[Surface]) -> Surface:
    points, normals = (np.concatenate([getattr(part, name) for part in parts]) for name in ("points", "normals"))
    step = max(-(-len(points) // _MOST_POINTS), 1)
    return Surface(points[::step], normals[::step])
