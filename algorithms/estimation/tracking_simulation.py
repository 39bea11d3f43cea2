"""Simulation of tracking: a camera with noise, delay and dropped frames, and a robot moved by rates or by forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from .tracking import Tracker, TrackingStatus

_CENTRE = np.zeros(2)
"""The goal of images: the centre."""
_EARLY = 1e-12
"""Seconds by which rounding errors may make a frame late."""
Path = Callable[[float], ArrayLike]
"""A function of the time in seconds that returns the place (3,) of a target in the base frame."""


@dataclass(frozen=True, slots=True)
class Sensor:
    """A camera that measures the place of a target, as a stereo camera does."""

    frame_time: float = 1 / 30
    """Seconds between two frames."""
    delay: float = 0.0
    """Seconds from the exposure of a frame to the arrival of its measurement."""
    noise: float = 0.0
    """The standard deviation of the image coordinates x/z and y/z."""
    depth_noise: float = 0.0
    """The relative standard deviation of depths."""
    drop: float = 0.0
    """The probability that a frame is lost."""
    field_of_view: float = np.inf
    """The largest absolute value of image coordinates at which the target is seen."""

    def __post_init__(self) -> None:
        for name in ("delay", "noise", "depth_noise", "drop"):
            if not 0 <= getattr(self, name) < np.inf:
                raise ValueError(f"{name} {getattr(self, name)}; expected a finite number that is not negative")
        if not self.frame_time > 0 or not self.field_of_view > 0:
            raise ValueError("frame_time, field_of_view: expected positive numbers")


@dataclass(slots=True)
class Prediction:
    """The place and the velocity of a target from measurements at irregular times: an alpha-beta filter.

    The filter is the Kalman filter of a constant velocity with fixed gains (Kalata, *IEEE Trans. Aerosp. Electron.
    Syst.* 20:174, 1984). Measurements that are not finite are counted and not used.
    """

    alpha: float = 0.6
    """The part of a deviation by which the place is corrected, in (0, 1]."""
    longest: float = 0.5
    """Seconds after a measurement for which the velocity is trusted; the predicted place then stands still."""
    time: float = field(default=-np.inf, init=False)
    place: Reals = field(default_factory=lambda: np.full(3, np.nan), init=False)
    velocity: Reals = field(default_factory=lambda: np.zeros(3), init=False)
    n_skipped: int = field(default=0, init=False)

    def add(self, time: float, place: Reals) -> None:
        """Add a measurement; it is skipped if it is not finite or not later than the last."""
        place = real_array(place, "place", (3,), "a point")
        if not (np.isfinite(place).all() and time > self.time):
            self.n_skipped += 1
            return
        step = time - self.time
        if step > self.longest:
            self.place, self.velocity = np.array(place, float), np.zeros(3)
        else:
            expected = self.place + step * self.velocity
            off = place - expected
            beta = self.alpha**2 / (2 - self.alpha)
            self.place, self.velocity = expected + self.alpha * off, self.velocity + beta / step * off
        self.time = time

    def at(self, time: float) -> tuple[Reals, Reals]:
        """Return the place and the velocity at a time; NaN and 0 before the first measurement."""
        age = time - self.time
        if age > self.longest:
            return self.place + (self.longest * self.velocity if np.isfinite(age) else 0.0), np.zeros(3)
        return self.place + age * self.velocity, self.velocity


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Result of `simulate_tracking`, with a row for each step of control."""

    times: Reals
    """(m,) Seconds."""
    q: Reals
    """(m, n) Joint variables."""
    rates: Reals
    """(m, n) Rates of the joints."""
    error: Reals
    """(m, 2) The true image of the target minus the goal; NaN while the target is behind the camera."""
    status: Reals
    """(m,) A `TrackingStatus` for each step."""
    targets: Reals
    """(m, 3) True places of the target."""
    n_frames: int
    """The number of frames."""
    n_dropped: int
    """The number of frames that were lost, or in which the target was not seen."""


def simulate_tracking(
    tracker: Tracker,
    q: ArrayLike,
    target: Path,
    duration: float,
    sensor: Sensor | None = None,
    control_time: float = 1e-3,
    prediction: Prediction | None = None,
    by_forces: bool = False,
    motor_time: float = 0.0,
    seed: int = 0,
) -> Recording:
    """Simulate a robot that keeps a moving point on the optical axis of its camera.

    Each frame measures the target in the frame of the camera. With the joint variables at its exposure, the measurement
    gives a place in the base frame, which is filtered and predicted to the current time: this compensates the delay and
    bridges dropped frames. The tracker computes rates, or forces, from the predicted place and velocity. Joints stop at
    their limits.

    Parameters
    ----------
    tracker : Tracker
    q : array_like, (n,)
        The initial joint variables. The robot is at rest.
    target : callable
        Function from the time in seconds to the place (3,) of the target in the base frame. Where it is not finite, the
        target is not seen.
    duration : float
        Seconds.
    sensor : Sensor, optional
        By default without noise, delay and dropped frames.
    control_time : float, optional
        Seconds between two steps of control.
    prediction : Prediction, optional
        The filter of the target's places.
    by_forces : bool, optional
        Whether the joints are moved by forces, which are constant during a step, instead of rates.
    motor_time : float, optional
        The time constant with which the rates of the joints follow the commanded ones, in seconds.
    seed : int, optional
        Of noise and dropped frames.

    Returns
    -------
    Recording

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type, or times are not positive.
    """
    if not 0 < control_time <= duration < np.inf:
        raise ValueError(f"duration {duration}, control_time {control_time}; expected positive times, the first larger")
    robot = tracker.robot
    x = real_array(q, "q", (robot.n_joints,), "joint variables").astype(np.float64).copy()
    v = np.zeros_like(x)
    eye = _Eye(tracker, sensor or Sensor(), np.random.default_rng(seed), prediction or Prediction())
    times = np.arange(0.0, duration, control_time)
    share = 1.0 if motor_time <= 0 else 1 - np.exp(-control_time / motor_time)
    rows: dict[str, list[ArrayLike]] = {name: [] for name in ("q", "rates", "error", "status", "targets")}
    for time in times:
        place = np.asarray(target(float(time)), float)
        image = eye.look(float(time), x, place)
        expected, velocity = eye.prediction.at(float(time))
        twist = np.append(np.zeros(3), velocity)
        move = _moved_by_forces if by_forces else _moved_by_rates
        x, v, status = move(tracker, x, v, expected, twist, control_time, share)
        stopped = (x < robot.limits[:, 0]) | (x > robot.limits[:, 1])
        x = np.clip(x, robot.limits[:, 0], robot.limits[:, 1])
        v = np.where(stopped, 0.0, v)
        for name, value in (("q", x), ("rates", v), ("error", image), ("status", status), ("targets", place)):
            rows[name].append(value)
    q_rows, rates, errors, statuses, targets = (np.array(row) for row in rows.values())
    return Recording(times, q_rows, rates, errors, statuses, targets, eye.n_frames, eye.n_dropped)


@dataclass(slots=True)
class _Eye:
    """The camera of a simulation, whose measurements arrive late."""

    tracker: Tracker
    sensor: Sensor
    rng: np.random.Generator
    prediction: Prediction
    n_frames: int = 0
    n_dropped: int = 0
    next_frame: float = 0.0
    waiting: list[tuple[float, float, Reals]] = field(default_factory=list)
    """Measurements on their way: the times of arrival and exposure, and places."""
    mount: Reals = field(init=False)

    def __post_init__(self) -> None:
        self.mount = pga3.motor_product(pga3.motor_inverse(self.tracker.robot.tool), self.tracker.chain.camera)

    def look(self, time: float, q: Reals, place: Reals) -> Reals:
        """Return the true image of a target, and measure it if a frame is due; NaN behind the camera."""
        camera = pga3.motor_product(self.tracker.robot.forward(q), self.mount)
        seen = np.asarray(pga3.move_point_back(camera, place))
        image = seen[:2] / seen[2] if seen[2] > 0 else np.full(2, np.nan)
        if time >= self.next_frame - _EARLY:
            self.next_frame += self.sensor.frame_time
            self._expose(time, camera, image, float(seen[2]))
        while self.waiting and self.waiting[0][0] <= time + _EARLY:
            self.prediction.add(*self.waiting.pop(0)[1:])
        return image

    def _expose(self, time: float, camera: Reals, image: Reals, depth: float) -> None:
        sensor = self.sensor
        self.n_frames += 1
        noise, lost = self.rng.normal(size=3), self.rng.random() < sensor.drop
        if lost or not np.abs(image).max() <= sensor.field_of_view:
            self.n_dropped += 1
            return
        measured = depth * (1 + sensor.depth_noise * noise[2]) * np.append(image + sensor.noise * noise[:2], 1.0)
        self.waiting.append((time + sensor.delay, time, pga3.move_point(camera, measured)))


def _moved_by_rates(
    tracker: Tracker, q: Reals, qd: Reals, place: Reals, twist: Reals, step: float, share: float
) -> tuple[Reals, Reals, Reals | int]:
    """Return variables, rates and the status after a step in which the rates approach the commanded ones."""
    found = tracker.rates_for_point(q, place, _CENTRE, _CENTRE, twist)
    qd = qd + share * (found.rates - qd)
    return q + step * qd, qd, found.status


def _moved_by_forces(
    tracker: Tracker, q: Reals, qd: Reals, place: Reals, twist: Reals, step: float, _share: float
) -> tuple[Reals, Reals, Reals | int]:
    """Return variables, rates and the status after a step with constant forces. Without a target joints are braked."""
    push = tracker.forces_for_point(q, qd, place, _CENTRE, _CENTRE, _CENTRE, twist)
    is_lost = push.status >= TrackingStatus.NOT_VISIBLE
    forces = tracker.robot.inverse_dynamics(q, qd, -2 * tracker.gain * qd) if is_lost else push.forces
    largest = tracker.robot.limits[:, 3]
    return *_moved(tracker, q, qd, np.clip(forces, -largest, largest), step), push.status


def _moved(tracker: Tracker, q: Reals, qd: Reals, forces: Reals, step: float) -> tuple[Reals, Reals]:
    """Return variables and rates after a step with constant forces, by the Runge-Kutta method of fourth order."""
    n = len(q)

    def slope(state: Reals) -> Reals:
        return np.append(state[n:], tracker.robot.forward_dynamics(state[:n], state[n:], forces))

    state = np.append(q, qd)
    a = slope(state)
    b = slope(state + step / 2 * a)
    c = slope(state + step / 2 * b)
    d = slope(state + step * c)
    state = state + step / 6 * (a + 2 * b + 2 * c + d)
    return state[:n], state[n:]
