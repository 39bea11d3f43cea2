"""Following of paths: Lyapunov control, pure pursuit, and stops in front of obstacles on the way of the robot."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from generated import navigation as kernels
from generated import pga2

from ..arguments import Reals, finite_number, real_array
from ..precision import NEGLIGIBLE, TINY
from .navigation_status import FollowStatus, PathStatus
from .paths import PlanarPath

_WINDOW = 1.0
"""The nearest point of the path is searched within this distance from the previous one, in metres."""
_PREDICTED = 0.05
"""A limit on work: metres between the places of the way back to the path, which is that of the control law."""
_ON_PATH, _ALONG = 0.01, 0.05
"""Metres and radians: a robot this near to the path follows it, to less than the noise of scans."""


@dataclass(frozen=True, slots=True)
class FollowSettings:
    """Settings of `follow`, in metres, seconds and radians."""

    speed: float = 0.5
    law: Literal["lyapunov", "pursuit"] = "lyapunov"
    gains: tuple[float, float] = (9.0, 6.0)
    """Of the distance, 1/m2, and of the angle, 1/m: for small errors, ``e'' + k2 v e' + k1 v**2 e = 0``."""
    look_ahead: float = 0.5
    """Along the path, of pure pursuit."""
    largest_curvature: float = 4.0
    deceleration: float = 0.5
    width: float = 0.5
    """Of the robot with a margin: obstacles are on the path if they are within half of this from it."""
    stop: float = 0.5
    """The distance along the path at which the robot stands in front of an obstacle."""
    horizon: float = 3.0
    """Obstacles are considered up to this distance ahead."""
    arrived: float = 0.01
    """The distance from the end at which the robot has arrived."""
    farthest: float = 1.0
    """The robot stands if it is farther from the path than this."""

    def __post_init__(self) -> None:
        """Raise ValueError or TypeError if a setting is invalid."""
        if self.law not in ("lyapunov", "pursuit"):
            raise ValueError(f"law: {self.law!r}; expected 'lyapunov' or 'pursuit'")
        for name in ("speed", "look_ahead", "largest_curvature", "deceleration", "horizon", "farthest"):
            if finite_number(getattr(self, name), name) <= 0:
                raise ValueError(f"{name}: {getattr(self, name)}; expected a positive number; robots move ahead")
        for name in ("width", "stop", "arrived"):
            if finite_number(getattr(self, name), name) < 0:
                raise ValueError(f"{name}: {getattr(self, name)}; expected a length that is not negative")
        gains = real_array(self.gains, "gains", (2,), "two gains")
        if gains.shape != (2,) or not ((gains > 0) & np.isfinite(gains)).all():
            raise ValueError(f"gains: {self.gains}; expected two positive numbers")


@dataclass(frozen=True, slots=True)
class Command:
    """Result of `follow`."""

    speed: float
    """m/s."""
    turn: float
    """rad/s, positive to the left."""
    position: float
    """The position of the nearest point of the path; pass it to the next step."""
    distance: float
    """The signed distance from the path, positive on its left."""
    angle: float
    """The heading relative to the path, in (-pi, pi]."""
    clearance: float
    """The distance along the way of the robot to where it is nearest to the first obstacle; infinite without one."""
    status: FollowStatus


def follow(
    path: PlanarPath,
    motor: ArrayLike,
    position: float = 0.0,
    obstacles: ArrayLike | None = None,
    settings: FollowSettings | None = None,
) -> Command:
    """Compute the speed and the turn with which a robot follows a path.

    Parameters
    ----------
    path : PlanarPath
    motor : array_like, (4,)
        The pose as a motor of `generated.pga2`; the robot moves along its x axis.
    position : float, optional
        Of the previous step, in metres along the path, so that a path may cross itself.
    obstacles : array_like, (k, 2), optional
        Points in the frame of the path, as those of a scan; what is not finite is ignored.
    settings : FollowSettings, optional

    Returns
    -------
    Command

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type.

    Notes
    -----
    A robot beside the path drives back to it on a way that is predicted with the control law. Obstacles count if they
    are within half of the width from this way, or from the part of the path that follows it. Those from which the robot
    moves away do not.
    """
    own = settings or FollowSettings()
    pose = real_array(motor, "motor", (4,), "a motor").astype(float)
    if path.status != PathStatus.OK:
        return _standing(position, FollowStatus.NO_PATH)
    if not (np.isfinite(pose).all() and np.isfinite(position)):
        return _standing(position, FollowStatus.NOT_FINITE)
    at, distance, angle = _located(path, pose, position)
    if abs(distance) > own.farthest:
        return _standing(at, FollowStatus.OFF_PATH, distance)
    rest = path.length - at
    clearance = _clearance(path, at, distance, angle, obstacles, own)
    if rest <= own.arrived:
        return Command(0.0, 0.0, at, distance, angle, clearance, FollowStatus.ARRIVED)
    gap = max(clearance - own.stop, 0.0)
    if gap == 0:
        return Command(0.0, 0.0, at, distance, angle, clearance, FollowStatus.BLOCKED)
    allowed = float(np.sqrt(2 * own.deceleration * gap))
    speed = min(own.speed, allowed, float(np.sqrt(2 * own.deceleration * rest)))
    turn, wanted = _turn(path, pose, at, distance, angle, speed, own)
    status = FollowStatus.SLOWED if allowed < own.speed else FollowStatus.OK
    if abs(wanted) > abs(turn) * (1 + NEGLIGIBLE):
        status = FollowStatus.SATURATED
    return Command(speed, turn, at, distance, angle, clearance, status)


def _turn(
    path: PlanarPath, pose: Reals, at: float, distance: float, angle: float, speed: float, own: FollowSettings
) -> tuple[float, float]:
    """Return the turn, and that without the limit of the curvature."""
    if own.law == "pursuit":
        target = pga2.motor_to_angle_translation(path.pose(at + own.look_ahead))[1]
        wanted = speed * float(kernels.pursuit_curvature(pose, target))
        bound = own.largest_curvature * speed
        return float(np.clip(wanted, -bound, bound)), wanted
    curvature = float(path.curvature(at))
    turn, wanted = kernels.lyapunov_turn(
        distance, angle, curvature, speed, np.array(own.gains), own.largest_curvature
    )  # fmt: skip
    return float(turn), float(wanted)


def _clearance(
    path: PlanarPath,
    at: float,
    distance: float,
    angle: float,
    obstacles: ArrayLike | None,
    own: FollowSettings,
) -> float:
    """Return the distance along the way back to the path, and then along the path, to the first obstacle."""
    if obstacles is None:
        return float("inf")
    points = real_array(obstacles, "obstacles", (2,), "points").astype(float).reshape(-1, 2)
    points = points[np.isfinite(points).all(1)]
    if not len(points):
        return float("inf")
    way, joined = _way_back(path, at, distance, angle, own)
    # Where the robot is nearest to each obstacle: on which step, and which part of it has passed.
    first, passed = float("inf"), _PREDICTED * (len(way) - 1)
    if len(way) > 1:
        step = np.diff(way, axis=0)
        off = points[:, None] - way[:-1]
        part = np.clip((off * step).sum(-1) / np.maximum((step**2).sum(-1), TINY), 0, 1)
        away = np.linalg.norm(off - part[..., None] * step, axis=-1)
        nearest = away.argmin(1)
        reached = nearest + np.take_along_axis(part, nearest[:, None], 1)[:, 0]
        hit = (away.min(1) <= own.width / 2) & (reached > 0)
        first = _PREDICTED * float(reached[hit].min(initial=np.inf))
    found = path.locate(points, joined, joined + max(own.horizon - passed, 0.0))
    # Behind the robot the nearest position is the lower bound itself.
    ahead = (np.abs(found.distance) <= own.width / 2) & (found.position > joined)
    return min(first, passed + float((found.position[ahead] - joined).min(initial=np.inf)))


def _way_back(path: PlanarPath, at: float, distance: float, angle: float, own: FollowSettings) -> tuple[Reals, float]:
    """Return places (k, 2) on the way of a robot to the path, and the position on the path at its end.

    The state is the position, distance and angle of the robot at the path, integrated by the rule of the midpoint.
    """
    rows, begins, curvatures = [(at, distance)], path.positions.tolist(), path.curvatures.tolist()
    for _ in range(int(own.horizon / _PREDICTED)):
        if (abs(distance) <= _ON_PATH and abs(angle) <= _ALONG) or abs(distance) > own.farthest:
            break
        curvature = curvatures[max(bisect_right(begins, at) - 1, 0)]
        bend = _bend(path, at, distance, angle, curvature, own)
        ahead = 1 / max(1 - curvature * distance, _ON_PATH)
        middle = angle + _PREDICTED / 2 * (bend - curvature * cos(angle) * ahead)
        move = _PREDICTED * cos(middle) * ahead
        at, distance = at + move, distance + _PREDICTED * sin(middle)
        angle = (angle + _PREDICTED * bend - curvature * move + pi) % (2 * pi) - pi
        rows.append((at, distance))
    position, aside = np.array(rows).T
    return _beside(path, position, aside), at


def _bend(path: PlanarPath, at: float, distance: float, angle: float, curvature: float, own: FollowSettings) -> float:
    """Return the curvature of the way of a robot."""
    if own.law == "lyapunov":
        turn, _ = kernels.lyapunov_turn(distance, angle, curvature, 1.0, np.array(own.gains), own.largest_curvature)
        return float(turn)
    beside = pga2.motor_from_angle_translation(angle, np.array([0.0, distance]))
    pose = pga2.motor_product(path.pose(at), beside)
    target = pga2.motor_to_angle_translation(path.pose(at + own.look_ahead))[1]
    return float(np.clip(kernels.pursuit_curvature(pose, target), -own.largest_curvature, own.largest_curvature))


def _beside(path: PlanarPath, position: Reals, distance: Reals) -> Reals:
    """Return places at signed distances from places on a path."""
    return np.asarray(pga2.move_point(path.pose(position), np.stack([np.zeros_like(distance), distance], -1)))


def _located(path: PlanarPath, pose: Reals, position: float) -> tuple[float, float, float]:
    """Return the position of a robot on the path, its signed distance, infinite if it is far, and its angle."""
    heading, place = pga2.motor_to_angle_translation(pose)
    found = path.locate(place, position - _WINDOW, position + _WINDOW)
    at, distance = float(found.position), float(found.distance)
    tangent = float(pga2.motor_to_angle_translation(path.pose(at))[0])
    return at, distance, float((heading - tangent + np.pi) % (2 * np.pi) - np.pi)


def _standing(position: float, status: FollowStatus, distance: float = float("nan")) -> Command:
    return Command(0.0, 0.0, position, distance, float("nan"), float("inf"), status)
