"""Closures of loops: earlier poses of a path at which the surroundings of the last one were seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generated import pga2

from ..arguments import Reals
from .surfaces import Alignment, Surface, align
from .keyframes import Keyframes, length_and_angle, relative

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
_MOST_POINTS = 500
_FEWEST_POINTS = 60


@dataclass(frozen=True, slots=True, eq=False)
class Closure:
    """A loop that was found."""

    edge: tuple[int, int]
    motion: Reals
    information: Reals
    shift: float
    """How far the closure moves the last pose, in metres and radians, each relative to 1 m and 1 rad."""


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
    rows = np.arange(max(other - _AROUND, 0), min(other + _AROUND + 1, last))
    rows = rows[path.travelled[last] - path.travelled[rows] > _OLDER / 2]
    seen = _thinned(path.parts(np.arange(max(last - _BEFORE, 0), last + 1), last))
    if len(seen.points) < _FEWEST_POINTS:
        return None
    start = relative(path.motors[other], path.motors[last])
    found = align(path.submap(rows, other), seen, start)
    if not is_certain(found):
        return None
    length, angle = length_and_angle(relative(start, found.motor))
    return Closure((other, last), found.motor, found.information, length + angle)


def is_certain(found: Alignment) -> bool:
    """Return whether an alignment fits well and is determined in all directions."""
    values = np.linalg.eigvalsh(found.information[1:, 1:])
    return bool(found.share >= _SHARE and found.rms <= _RMS and values[0] >= _DETERMINED * values[1])


def _thinned(parts: list[Surface]) -> Surface:
    points, normals = (np.concatenate([getattr(part, name) for part in parts]) for name in ("points", "normals"))
    step = -(-len(points) // _MOST_POINTS)
    return Surface(points[::step], normals[::step])
