"""Closed loop of a robot in a floor plan: scans, localisation, and control along a path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga2

from ..arguments import Reals, real_array
from .floor_plans import FloorPlan
from .following import FollowSettings, follow
from .localization import LineLocalizer, normalized_error
from .navigation_status import FollowStatus
from .paths import PlanarPath
from .scan_simulation import Odometry, Scanner, motor_of_error, simulate_scan


@dataclass(frozen=True, slots=True, eq=False)
class NavigationRun:
    """Result of `simulate_following`, with a row for each of t steps."""

    times: Reals
    """(t,) Seconds."""
    truth: Reals
    """(t, 4) True poses, as motors of `generated.pga2`."""
    estimates: Reals
    """(t, 4) Poses by localisation."""
    covariances: Reals
    """(t, 3, 3) Of the errors of the estimates."""
    distances: Reals
    """(t,) Signed distances of the true places from the path."""
    speeds: Reals
    """(t,) m/s."""
    normalized_errors: Reals
    """(t,) Squared errors of the estimates, divided by their covariances."""
    localization: Reals
    """(t,) A `LocalizationStatus` for each step."""
    following: Reals
    """(t,) A `FollowStatus` for each step."""
    points: tuple[Reals, ...]
    """The points (k, 2) of each scan, in the frame of the robot."""


def simulate_following(
    plan: FloorPlan,
    path: PlanarPath,
    localizer: LineLocalizer,
    pose: ArrayLike,
    *,
    scanner: Scanner | None = None,
    odometry: Odometry | None = None,
    settings: FollowSettings | None = None,
    obstacles: ArrayLike | None = None,
    interval: float = 0.1,
    longest: float = 300.0,
    seed: int = 0,
) -> NavigationRun:
    """Simulate a robot that follows a path by its own localisation, until it has arrived or stands.

    In each step a scan updates the pose, the control law computes speed and turn from the estimate, and the robot moves
    along an arc. Odometry measures the motion with noise.

    Parameters
    ----------
    plan : FloorPlan
    path : PlanarPath
    localizer : LineLocalizer
        With the estimate of the first pose; it is updated.
    pose : array_like, (4,)
        The true first pose.
    scanner : Scanner, optional
    odometry : Odometry, optional
    settings : FollowSettings, optional
    obstacles : array_like, (k, 2), optional
        Places of people who stand.
    interval : float, optional
        Seconds between scans.
    longest : float, optional
        Seconds after which the simulation ends.
    seed : int, optional

    Returns
    -------
    NavigationRun
    """
    rng = np.random.default_rng(seed)
    device, wheels = scanner or Scanner(), odometry or Odometry()
    truth = real_array(pose, "pose", (4,), "a motor").astype(float)
    position, rows, clouds = 0.0, [], []
    for k in range(int(longest / interval)):
        scan = simulate_scan(plan, truth, device, obstacles, rng).scan
        located = localizer.update(scan)
        seen = np.asarray(pga2.move_point(localizer.motor, scan.points())).reshape(-1, 2)
        command = follow(path, localizer.motor, position, seen, settings)
        position = command.position
        place = pga2.motor_to_angle_translation(truth)[1]
        off = float(path.locate(place, position - 2.0, position + 2.0).distance)
        error = float(normalized_error(localizer.motor, localizer.covariance, truth))
        rows.append((k * interval, truth, localizer.motor, localizer.covariance, off, command.speed, error, located,
                     command.status))  # fmt: skip
        clouds.append(scan.points())
        if command.status >= FollowStatus.BLOCKED:
            break
        twist = interval * np.array([command.turn, command.speed, 0.0])
        motion = motor_of_error(twist)
        spread = wheels.covariances(motion)
        error_of_wheels = rng.normal(size=3) * np.sqrt(np.diag(spread))
        truth = np.asarray(pga2.normalize_motor(pga2.motor_product(truth, motion)))
        localizer.move(pga2.motor_product(motion, motor_of_error(error_of_wheels)), spread)
    times, truths, estimates, spreads, offs, speeds, errors, statuses, commands = (
        np.array(column) for column in zip(*rows, strict=True)
    )
    return NavigationRun(
        times, truths, estimates, spreads, offs, speeds, errors, statuses, commands, tuple(clouds)
    )  # fmt: skip
