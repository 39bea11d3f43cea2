"""Following of paths: Lyapunov control, pure pursuit, and stops in front of obstacles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from generated import navigation as kernels
from generated import pga2

from ..arguments import Reals, real_array
from .navigation_status import FollowStatus, PathStatus
from .paths import PlanarPath

_WINDOW = 1.0
"""The nearest point of the path is searched within this distance from the previous one, in metres."""


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
    """The distance along the path to the first obstacle; infinite without one."""
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
    """
    own = settings or FollowSettings()
    pose = real_array(motor, "motor", (4,), "a motor").astype(float)
    if path.status != PathStatus.OK:
        return _standing(position, FollowStatus.NO_PATH)
    if not (np.isfinite(pose).all() and np.isfinite(position)):
        return _standing(position, FollowStatus.NOT_FINITE)
    heading, place = pga2.motor_to_angle_translation(pose)
    found = path.locate(place, position - _WINDOW, position + _WINDOW)
    at, distance = float(found.position), float(found.distance)
    if abs(distance) > own.farthest or found.piece < 0:
        return _standing(at, FollowStatus.OFF_PATH, distance)
    tangent = float(pga2.motor_to_angle_translation(path.pose(at))[0])
    angle = float((heading - tangent + np.pi) % (2 * np.pi) - np.pi)
    rest = path.length - at
    clearance = _clearance(path, at, obstacles, own)
    if rest <= own.arrived:
        return Command(0.0, 0.0, at, distance, angle, clearance, FollowStatus.ARRIVED)
    gap = max(clearance - own.stop, 0.0)
    if gap == 0:
        return Command(0.0, 0.0, at, distance, angle, clearance, FollowStatus.BLOCKED)
    allowed = float(np.sqrt(2 * own.deceleration * gap))
    speed = min(own.speed, allowed, float(np.sqrt(2 * own.deceleration * rest)))
    turn, wanted = _turn(path, pose, at, distance, angle, speed, own)
    status = FollowStatus.SLOWED if allowed < own.speed else FollowStatus.OK
    if abs(wanted) > abs(turn) * (1 + 1e-9):
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


def _clearance(path: PlanarPath, at: float, obstacles: ArrayLike | None, own: FollowSettings) -> float:
    if obstacles is None:
        return float("inf")
    points = real_array(obstacles, "obstacles", (2,), "points").astype(float).reshape(-1, 2)
    points = points[np.isfinite(points).all(1)]
    if not len(points):
        return float("inf")
    found = path.locate(points, at, at + own.horizon)
    # Behind the robot the nearest position is the lower bound itself.
    ahead = (np.abs(found.distance) <= own.width / 2) & (found.position > at)
    return float((found.position[ahead] - at).min()) if ahead.any() else float("inf")


def _standing(position: float, status: FollowStatus, distance: float = float("nan")) -> Command:
    return Command(0.0, 0.0, position, distance, float("nan"), float("inf"), status)
