"""Simulation of laser scans in a floor plan, with noise, outliers and moving people, and of logs with odometry."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from generated import cga2, pga2

from ..arguments import Reals, real_array
from ..precision import TINY
from .floor_plans import FloorPlan
from .motions import relative
from .navigation_status import PlanStatus
from .scan import Scan

NO_WALL, PERSON, OUTLIER = -1, -2, -3
"""What a beam met instead of a wall."""
_RADIUS, _CLEARANCE = 0.2, 0.5
"""The radius of people, and their distance and that of robots from walls ahead, in metres."""


@dataclass(frozen=True, slots=True)
class Scanner:
    """A laser range finder."""

    n_beams: int = 181
    field_of_view: float = np.pi
    """The angle between the first and the last beam, in rad."""
    max_range: float = 30.0
    """The range that is reported where nothing is met nearer, in metres."""
    noise: float = 0.01
    """The standard deviation of ranges, in metres."""
    outliers: float = 0.0
    """The probability that a beam reports a shorter range at random."""
    missing: float = 0.0
    """The probability that a beam reports the maximum range."""

    def __post_init__(self) -> None:
        if self.n_beams < 2 or not 0 < self.field_of_view <= 2 * np.pi or not self.max_range > 0:
            raise ValueError(
                f"n_beams, field_of_view, max_range: {self.n_beams}, {self.field_of_view}, {self.max_range}; expected "
                "at least 2 beams within a full turn and a positive range"
            )
        if not (0 <= self.noise < np.inf and 0 <= self.outliers <= 1 and 0 <= self.missing <= 1):
            raise ValueError("noise, outliers, missing: expected a finite length and two probabilities")

    @property
    def angles(self) -> Reals:
        """(n_beams,) The angles of the beams, symmetric about the x axis."""
        return np.linspace(-self.field_of_view / 2, self.field_of_view / 2, self.n_beams)


@dataclass(frozen=True, slots=True)
class Odometry:
    """Standard deviations of measured motions; those of independent causes add as squares."""

    turn_per_turn: float = 0.03
    turn_per_metre: float = 0.02
    """rad."""
    length_per_metre: float = 0.03
    least_turn: float = 0.001
    """rad, of each motion."""
    least_length: float = 0.001
    """Metres, of each motion."""

    def covariances(self, motions: Reals) -> Reals:
        """Return the covariances (..., 3, 3) of the twists of motions (..., 4): angle, ahead, to the left."""
        angle, shift = pga2.motor_to_angle_translation(motions)
        way = np.linalg.norm(shift, axis=-1)
        turn = (self.turn_per_turn * angle) ** 2 + (self.turn_per_metre * way) ** 2 + self.least_turn**2
        length = (self.length_per_metre * way) ** 2 + self.least_length**2
        found = np.zeros((*np.shape(way), 3, 3))
        found[..., 0, 0], found[..., 1, 1], found[..., 2, 2] = turn, length, length
        return found


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedScan:
    """Result of `simulate_scan`."""

    scan: Scan
    walls: Reals
    """(n,) The index of the wall that each beam met, or NO_WALL, PERSON or OUTLIER."""
    status: PlanStatus


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedLog:
    """Result of `simulate_log`: t scans."""

    times: Reals
    """(t,) Seconds."""
    truth: Reals
    """(t, 4) Poses as motors of `generated.pga2`, from the frame of the robot to that of the plan."""
    motions: Reals
    """(t, 4) Motions since the previous scan as measured by odometry, in the frame of the robot; the first is none."""
    covariances: Reals
    """(t, 3, 3) Of the twists of the motions."""
    ranges: Reals
    """(t, n) Metres."""
    walls: Reals
    """(t, n) What each beam met, as in `SimulatedScan`."""
    people: Reals
    """(t, k, 2) The places of people."""
    status: Reals
    """(t,) A `PlanStatus` for each scan."""
    scanner: Scanner

    def __len__(self) -> int:
        """Return the number of scans."""
        return len(self.times)

    def __iter__(self) -> Iterator[Scan]:
        """Iterate over the scans."""
        return (self.scan(k) for k in range(len(self)))

    def scan(self, k: int) -> Scan:
        """Return the scan with index k."""
        return _scan(self.ranges[k], self.scanner)

    @property
    def odometry(self) -> Reals:
        """(t, 4) Poses by odometry alone, from the true first pose."""
        poses = [self.truth[0]]
        for motion in self.motions[1:]:
            poses.append(pga2.normalize_motor(pga2.motor_product(poses[-1], motion)))
        return np.array(poses)

    @property
    def hits(self) -> Reals:
        """(k, 2) The points in which beams met walls, without noise of poses."""
        angles, shifts = pga2.motor_to_angle_translation(self.truth)
        t, n = np.nonzero(self.walls >= 0)
        turned = np.asarray(angles)[t] + self.scanner.angles[n]
        return np.asarray(shifts[t] + self.ranges[t, n][:, None] * np.stack([np.cos(turned), np.sin(turned)], -1))


def simulate_scan(
    plan: FloorPlan,
    pose: ArrayLike,
    scanner: Scanner | None = None,
    people: ArrayLike | None = None,
    seed: int | np.random.Generator = 0,
) -> SimulatedScan:
    """Simulate a scan in a floor plan.

    Parameters
    ----------
    plan : FloorPlan
    pose : array_like, (4,)
        Motor of `generated.pga2` from the frame of the scanner to that of the plan.
    scanner : Scanner, optional
    people : array_like, (k, 2), optional
        Places of people, circles of radius 0.2 m.
    seed : int or Generator, optional
        Of noise and outliers.

    Returns
    -------
    SimulatedScan
        All ranges are NaN if the pose is within a wall or not finite.
    """
    device = scanner or Scanner()
    motor = real_array(pose, "pose", (4,), "a motor").astype(float).reshape(1, 4)
    places = None if people is None else real_array(people, "people", (2,), "places").astype(float).reshape(1, -1, 2)
    ranges, walls, status = _measured(plan, motor, device, places, np.random.default_rng(seed))
    return SimulatedScan(_scan(ranges[0], device), walls[0], PlanStatus(int(status[0])))


def simulate_log(
    plan: FloorPlan,
    poses: ArrayLike,
    scanner: Scanner | None = None,
    odometry: Odometry | None = None,
    *,
    n_people: int = 0,
    interval: float = 0.2,
    seed: int = 0,
) -> SimulatedLog:
    """Simulate the log of a robot that moves in a floor plan.

    Parameters
    ----------
    plan : FloorPlan
    poses : array_like, (t, 4)
        True poses, as motors of `generated.pga2`.
    scanner : Scanner, optional
    odometry : Odometry, optional
    n_people : int, optional
        People who walk near the robot.
    interval : float, optional
        Seconds between scans.
    seed : int, optional

    Returns
    -------
    SimulatedLog
    """
    truth = real_array(poses, "poses", (4,), "motors").astype(float).reshape(-1, 4)
    device, wheels = scanner or Scanner(), odometry or Odometry()
    rng = np.random.default_rng(seed)
    times = interval * np.arange(len(truth))
    people = walking_people(plan, truth, n_people, interval, rng)
    ranges, walls, status = _measured(plan, truth, device, people, rng)
    motions = np.tile([1.0, 0, 0, 0], (len(truth), 1))
    if len(truth) > 1:
        motions[1:] = relative(truth[:-1], truth[1:])
    covariances = wheels.covariances(motions)
    covariances[:1] = 0
    errors = rng.normal(size=(len(truth), 3)) * np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    measured = pga2.normalize_motor(pga2.motor_product(motions, motor_of_error(errors)))
    return SimulatedLog(times, truth, np.asarray(measured), covariances, ranges, walls, people, status, device)


def motor_of_error(errors: Reals) -> Reals:
    """Return the motors of twists (..., 3): angle, translation ahead and to the left, in the frame of the robot."""
    return np.asarray(pga2.motor_from_twist(pga2.twist_from_velocities(errors[..., 0], errors[..., 1:])))


def error_of_motor(motors: Reals) -> Reals:
    """Return the twists (..., 3) of motors near the identity, the inverse of `motor_of_error`."""
    turn, shift = pga2.twist_to_velocities(pga2.motor_to_twist(motors))
    return np.concatenate([np.asarray(turn)[..., None], shift], -1)


def walking_people(
    plan: FloorPlan, poses: Reals, n_people: int, interval: float, rng: np.random.Generator, speed: float = 1.0
) -> Reals:
    """Return places (t, k, 2) of people who walk near a robot, straight ahead until they are close to a wall.

    Whoever is more than 4 m from the robot begins again near it.
    """
    angles, shifts = (np.asarray(x) for x in pga2.motor_to_angle_translation(poses))
    places = np.zeros((len(poses), n_people, 2))
    if not n_people:
        return places
    now, heading = np.full((n_people, 2), np.inf), np.zeros(n_people)
    for t in range(len(poses)):
        with np.errstate(invalid="ignore"):
            away = ~(np.linalg.norm(now - shifts[t], axis=1) <= 4.0)
        for k in np.flatnonzero(away):
            turn, length = rng.uniform(-1.4, 1.4), rng.uniform(1.0, 3.0)
            direction = angles[t] + turn
            free = float(plan.cast(poses[t], np.array([turn]))[0][0]) - _CLEARANCE
            now[k] = shifts[t] + max(min(length, free), 0.6) * np.array([np.cos(direction), np.sin(direction)])
            heading[k] = rng.uniform(-np.pi, np.pi)
        places[t] = now
        motors = np.asarray(pga2.motor_from_angle_translation(heading, now))
        ahead = plan.cast(motors, np.zeros(1))[0][:, 0]
        room = ahead > _CLEARANCE + interval * speed
        step = interval * speed * np.stack([np.cos(heading), np.sin(heading)], 1)
        now = np.where(room[:, None], now + step, now)
        heading = np.where(room, heading, rng.uniform(-np.pi, np.pi, n_people))
    return places


def _measured(
    plan: FloorPlan, poses: Reals, scanner: Scanner, people: Reals | None, rng: np.random.Generator
) -> tuple[Reals, Reals, Reals]:
    """Return ranges and what was met (t, n), and statuses (t,)."""
    finite = np.asarray(np.isfinite(poses).all(-1))
    safe = np.where(finite[:, None], poses, [1.0, 0, 0, 0])
    within = plan.is_within_wall(safe)
    distances, walls = plan.cast(safe, scanner.angles)
    if people is not None and people.shape[1]:
        nearest = _to_people(safe, scanner.angles, people)
        hit = nearest < distances
        distances, walls = np.where(hit, nearest, distances), np.where(hit, PERSON, walls)
    noisy = distances + rng.normal(scale=max(scanner.noise, TINY), size=distances.shape)
    strays = rng.random(distances.shape) < scanner.outliers
    shorter = rng.uniform(0.1, 1.0, distances.shape) * np.minimum(distances, scanner.max_range)
    noisy, walls = np.where(strays, shorter, noisy), np.where(strays, OUTLIER, walls)
    nothing = (rng.random(distances.shape) < scanner.missing) | ~(noisy < scanner.max_range)
    noisy, walls = np.where(nothing, scanner.max_range, noisy), np.where(nothing, NO_WALL, walls)
    status = np.where(within, PlanStatus.WITHIN_WALL, PlanStatus.OK if len(plan) else PlanStatus.EMPTY)
    status = np.where(finite, status, PlanStatus.NOT_FINITE)
    bad = (status == PlanStatus.WITHIN_WALL) | (status == PlanStatus.NOT_FINITE)
    noisy[bad], walls[bad] = np.nan, NO_WALL
    return np.maximum(noisy, 0.0), walls, status


def _to_people(poses: Reals, angles: Reals, people: Reals) -> Reals:
    """Return the distances (t, n) to the first person along beams."""
    headings, places = (np.asarray(x) for x in pga2.motor_to_angle_translation(poses))
    turned = headings[:, None] + angles
    directions = np.stack([np.cos(turned), np.sin(turned)], -1)
    nearest = np.full(turned.shape, np.inf)
    for k in range(people.shape[1]):
        circles = np.asarray(cga2.circle_from_centre(people[:, k], _RADIUS))
        found = np.asarray(cga2.hit_ray_circle(places[:, None], directions, circles[:, None]))
        nearest = np.fmin(nearest, found)
    return nearest


def _scan(ranges: Reals, scanner: Scanner) -> Scan:
    angles = scanner.angles
    return Scan(ranges, float(angles[0]), float(angles[1] - angles[0]), scanner.max_range)


def exact(scanner: Scanner) -> Scanner:
    """Return the scanner without noise, outliers and missing ranges."""
    return replace(scanner, noise=0.0, outliers=0.0, missing=0.0)
