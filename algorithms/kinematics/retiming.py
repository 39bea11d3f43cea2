"""The fastest motion of a robot along a given path under limits of velocity, acceleration and torque."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import retiming as kernels

from ..arguments import Reals, finite, real_array
from ..evidence import Status
from ..precision import ROUNDING
from .robot import Robot
from .tables import need_fixed_base

_STAGES = 500
"""Default number of stages of a path. Motions are longer than the shortest one by a share of about one stage."""
_UNLIMITED = 1e100
"""A squared speed above all others."""


class RetimingStatus(Status):
    """Outcome of `retime`.

    ``OK``: the limits hold at the ends of all stages. ``TOO_HEAVY``: somewhere on the path, torques that hold the
    robot still reach or exceed the limits. ``NOT_FINITE``: a torque along the path is NaN or infinite.
    """

    OK = 0
    TOO_HEAVY = 1
    NOT_FINITE = 2


@dataclass(frozen=True, slots=True, eq=False)
class TimedPath:
    """A motion along a path, from rest to rest.

    Attributes
    ----------
    status : RetimingStatus
    duration : float
        In seconds; NaN unless the status is OK.
    times : array, (N + 1,)
        When the ends of the stages are passed, s.
    places : array, (N + 1,)
        The parameter of the path there, from 0 to 1.
    speeds : array, (N + 1,)
        The rate of the parameter there, 1/s.
    """

    status: RetimingStatus
    duration: float
    times: Reals
    places: Reals
    speeds: Reals
    _path: Callable[..., Any]

    def at(self, times: ArrayLike) -> tuple[Reals, Reals, Reals]:
        """Return the motion at some times; before the first and after the last one the robot is at rest.

        Parameters
        ----------
        times : array_like, (...)
            In seconds.

        Returns
        -------
        q, qd, qdd : array, (..., n)
            Variables, rates and accelerations. They are NaN unless the status is OK.

        Raises
        ------
        TypeError, ValueError
            If `times` are not real numbers.
        """
        when = real_array(times, "times")
        clipped = np.clip(when, self.times[0], self.times[-1])
        stage = np.clip(np.searchsorted(self.times, clipped, side="right") - 1, 0, len(self.times) - 2)
        length = self.times[stage + 1] - self.times[stage]
        rate = (self.speeds[stage + 1] - self.speeds[stage]) / length
        since = clipped - self.times[stage]
        speed = self.speeds[stage] + rate * since
        place = self.places[stage] + (self.speeds[stage] + speed) / 2 * since
        outside = ((when < self.times[0]) | (when > self.times[-1]))[..., None]
        slope, bend = self._path(place, 1), self._path(place, 2)
        qd = slope * speed[..., None]
        qdd = slope * rate[..., None] + bend * (speed**2)[..., None]
        return self._path(place), np.where(outside, 0.0, qd), np.where(outside, 0.0, qdd)


def retime(
    robot: Robot,
    path: ArrayLike | scipy.interpolate.PPoly,
    *,
    velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    torque: ArrayLike | None = None,
    stages: int = _STAGES,
) -> TimedPath:
    """Return the fastest motion along a path, from rest to rest.

    Parameters
    ----------
    robot : Robot
        With a fixed base; with inertias if there are limits of torque.
    path : array_like, (k, n), or spline
        Configurations, through which a cubic spline is laid whose parameter is the distance along them; or a spline of
        `scipy.interpolate` of degree 2 or more over its own interval, with a continuous first derivative.
    velocity, acceleration, torque : array_like, () or (n,), optional
        Bounds of the absolute values: rad/s, rad/s², N m; or m/s, m/s², N. The default of `velocity` are the limits of
        the robot; those of the others are infinite. At least one of `acceleration` and `torque` is needed. The limits
        of torque in a URDF file are ``robot.limits[:, 3]``.
    stages : int
        Number of parts of the path in which the acceleration along it is constant. The limits hold at both ends of each
        stage; between them they are exceeded by an amount that decreases with the square of the number of stages.

    Returns
    -------
    TimedPath
        The motion with its status and duration; ``found.at(times)`` evaluates it.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or is not finite, a bound is not positive, nothing limits the acceleration, or
        two successive configurations are equal.
    FloatingBaseError
        If the base floats.
    MissingInertiaError
        If there are limits of torque and the robot has no inertias.

    Notes
    -----
    The method is the time-optimal path parametrization by reachability of Pham and Pham (*IEEE Trans. Robotics*
    34:645, 2018), with the constraints of a stage at both of its ends. The kernels are those of
    `gacompiler.specs.retiming`.

    Examples
    --------
    >>> from algorithms.kinematics import Robot, retime
    >>> arm = Robot.named("panda")
    >>> found = retime(arm, [[0, 0, 0, -1.5, 0, 1.5, 0], [1, 0.5, 0, -1, 0, 1, 0]], acceleration=5.0)
    >>> q, qd, qdd = found.at(np.linspace(0, found.duration, 100))
    """
    need_fixed_base(robot, "retime")
    if acceleration is None and torque is None:
        raise ValueError("acceleration, torque: none; expected at least one of them, since one must limit the motion")
    if isinstance(stages, bool) or not isinstance(stages, (int, np.integer)) or stages < 2:
        raise ValueError(f"stages: {stages!r}; expected an integer of 2 or more")
    curve = _curve(robot, path)
    if velocity is None:
        fastest = _bounds(robot, robot.limits[:, 2], "limits of velocity")
    else:
        fastest = _bounds(robot, velocity, "velocity")
    places = np.linspace(0.0, 1.0, stages + 1)
    q, slope, bend = (np.ascontiguousarray(curve(places, k)) for k in range(3))
    rows = []
    if acceleration is not None:
        rows.append((slope, bend, np.zeros_like(slope), _bounds(robot, acceleration, "acceleration")))
    if torque is not None:
        still = robot.inverse_dynamics(q, np.zeros_like(q), np.zeros_like(q))
        start = robot.inverse_dynamics(q, np.zeros_like(q), slope) - still
        moving = robot.inverse_dynamics(q, slope, bend) - still
        rows.append((start, moving, still, _bounds(robot, torque, "torque")))
    push, pull, held, most = (np.concatenate(parts, -1) for parts in zip(*_like(rows), strict=True))
    nothing = np.full(stages + 1, np.nan)
    if not np.isfinite([push, pull, held]).all():
        return TimedPath(RetimingStatus.NOT_FINITE, np.nan, nothing, places, nothing, curve)
    if (np.abs(held) >= most).any():
        return TimedPath(RetimingStatus.TOO_HEAVY, np.nan, nothing, places, nothing, curve)
    with np.errstate(divide="ignore"):
        top = ((fastest / np.abs(slope)) ** 2).min(-1)
    return _passed(curve, places, push, pull, held, most, np.minimum(top, _UNLIMITED))


def _passed(
    curve: Callable[..., Any], places: Reals, push: Reals, pull: Reals, held: Reals, most: Reals, top: Reals
) -> TimedPath:
    """Return the motion whose limits are ``|push u + pull x + held| <= most`` at each place, and ``x <= top``."""
    steps = np.diff(places)
    # At the end of a stage, x is larger by 2 step u.
    sides = [(push[:-1], pull[:-1], held[:-1], most[:-1])]
    sides.append((push[1:] + 2 * steps[:, None] * pull[1:], pull[1:], held[1:], most[1:]))
    lines = zip(*(_lines(*side) for side in sides), strict=True)
    above, below, slopes, free = (np.ascontiguousarray(np.concatenate(parts, -1)) for parts in lines)
    bounds = np.minimum(top[:-1], free.min(-1))
    if not np.isfinite(above).any(-1).all():
        raise ValueError("acceleration, torque: nothing limits the motion on a part of the path; give finite bounds")
    reachable = kernels.reachable_speeds(above, below, slopes, bounds, steps, 0.0)
    after = np.append(reachable[1:], 0.0)
    ends, _ = kernels.fastest_speeds(above, slopes, after, steps, 0.0)
    speeds = np.sqrt(np.concatenate([[0.0], ends]))
    lasting = 2 * steps / (speeds[1:] + speeds[:-1])
    times = np.concatenate([[0.0], np.cumsum(lasting)])
    return TimedPath(RetimingStatus.OK, float(times[-1]), times, places, speeds, curve)


def _lines(push: Reals, pull: Reals, held: Reals, most: Reals) -> tuple[Reals, Reals, Reals, Reals]:
    """Return limits of u as ``below + slope x <= u <= above + slope x``, and the limits of x where u has no influence.

    Limits that there are not are infinite.
    """
    moves = np.abs(push) > ROUNDING * np.abs(push).max(initial=0.0)
    divisor = np.where(moves, push, 1.0)
    ends = np.stack([(most - held) / divisor, (-most - held) / divisor])
    above, below = np.where(moves, ends.max(0), np.inf), np.where(moves, ends.min(0), -np.inf)
    free = np.where(pull > 0, most - held, most + held)
    with np.errstate(divide="ignore", invalid="ignore"):
        largest = np.where(moves | (pull == 0), np.inf, free / np.abs(pull))
    return above, below, np.where(moves, -pull / divisor, 0.0), largest


def _like(rows: list[tuple[Reals, Reals, Reals, Reals]]) -> list[tuple[Reals, ...]]:
    """Return limits with as many rows as the places."""
    return [(*parts, np.broadcast_to(most, parts[0].shape)) for *parts, most in rows]


def _bounds(robot: Robot, value: ArrayLike, name: str) -> Reals:
    """Return a positive bound for each variable."""
    array = real_array(value, f"{robot.name}: {name}").astype(float)
    if array.shape not in ((), (robot.n_joints,)):
        raise ValueError(f"{robot.name}: {name}: shape {array.shape}; expected () or ({robot.n_joints},)")
    if not (array > 0).all():
        raise ValueError(f"{robot.name}: {name}: {array}; expected positive numbers")
    return np.broadcast_to(array, (robot.n_joints,))


def _curve(robot: Robot, path: Any) -> Callable[..., Any]:
    """Return a function of the place, from 0 to 1, and of the order of the derivative."""
    count = robot.n_joints
    if isinstance(path, (scipy.interpolate.PPoly, scipy.interpolate.BSpline)):
        knots = path.x if isinstance(path, scipy.interpolate.PPoly) else path.t[path.k : len(path.t) - path.k]
        ends = knots[0], knots[-1]
        degree = len(path.c) - 1 if isinstance(path, scipy.interpolate.PPoly) else path.k
        if degree < 2:
            raise ValueError(f"{robot.name}: path: a spline of degree {degree}; expected 2 or more, without corners")
        if path(ends[0]).shape != (count,):
            raise ValueError(f"{robot.name}: path: values of shape {path(ends[0]).shape}; expected ({count},)")
        size = ends[1] - ends[0]
        return lambda place, order=0: path(ends[0] + size * place, order) * size**order
    points = finite(real_array(path, f"{robot.name}: path", (-1, count), "configurations"), f"{robot.name}: path")
    if points.ndim != 2 or len(points) < 2:
        raise ValueError(f"{robot.name}: path: shape {points.shape}; expected (k, {count}) with at least two rows")
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    if not (lengths > 0).all():
        row = int(np.argmin(lengths))
        raise ValueError(f"{robot.name}: path: rows {row} and {row + 1} are equal; expected different configurations")
    at = np.concatenate([[0.0], np.cumsum(lengths)]) / lengths.sum()
    return scipy.interpolate.CubicSpline(at, points)  # type: ignore[no-any-return]
