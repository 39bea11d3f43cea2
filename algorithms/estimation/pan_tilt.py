"""Pan-tilt heads: robots with two joints that carry a camera."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3
from generated import tracking as kernels

from ..arguments import Reals, real_array
from ..elements import LINE, MOTOR, elements
from ..evidence.least_squares import STEPS
from ..kinematics import Body, Robot
from ..precision import CONVERGED, TINY
from .body_eye import BodyEye
from .image_jacobians import Chain, chain_of
from .tracking import Tracker, TrackingStatus, VelocityStep

_SECOND, _LAST = 1e2, 1e9
"""Ranks of solutions: more than the sum of two angles, and more than that many radians beyond limits."""
_PAN, _TILT = np.array([[1.0, 0, 0, 0, 0, 0], [0.0, 1.0, 0, 0, 0, 0]])
"""The lines of z, and of -y: a positive tilt raises the view along x."""
_FORWARDS = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
"""The axes of a camera that looks along x, with y down."""
_BODIES = (
    Body(1.2, (0.0, 0.0, -0.03), (2e-3, 0.0, 0.0, 2e-3, 0.0, 2e-3), 1e-3),
    Body(0.6, (0.03, 0.0, 0.0), (8e-4, 0.0, 0.0, 9e-4, 0.0, 9e-4), 1e-3),
)
"""The bodies of a head of 1.8 kg, for examples: mass, centre, inertia, and inertia of the rotor."""
_LIMITS = ((-2.9, 2.9, 4.0, 20.0), (-1.4, 1.4, 4.0, 20.0))
"""Limits of both joints, for examples: the least and largest angle, velocity and torque."""


@elements(axes=LINE, eye=MOTOR)
def pan_tilt_head(
    axes: ArrayLike | None = None,
    eye: ArrayLike | None = None,
    bodies: tuple[Body, Body] = _BODIES,
    limits: ArrayLike = _LIMITS,
) -> Robot:
    """Return a pan-tilt head as a robot, whose end effector is its camera.

    Parameters
    ----------
    axes : array_like, (2, 6), optional
        Lines of both joints in the frame of the body. By default z, and the line -y, about which a positive angle
        raises the camera.
    eye : array_like, (8,), optional
        The motor from the frame of the camera to that of the body, with both joints at 0, as in `BodyEye.motor`. By
        default the camera is at the origin and looks along x, with y down.
    bodies : two Body, optional
        The bodies that the joints carry, in the frame of the body. By default those of a small head.
    limits : array_like, (2, 4), optional
        Lowest and highest angle, largest speed and torque of each joint.

    Returns
    -------
    Robot

    Raises
    ------
    DescriptionError, TypeError, ValueError
        If axes are not lines, `eye` is not a unit motor, or limits have a different shape.
    """
    lines = np.stack([_PAN, _TILT]) if axes is None else real_array(axes, "axes", (2, 6), "lines")
    matrix = np.eye(4)
    matrix[:3, :3] = _FORWARDS
    motor = pga3.motor_from_matrix(matrix) if eye is None else eye
    robot = Robot.from_screws(lines, motor, name="pan-tilt head", bodies=bodies)
    return replace(robot, limits=real_array(limits, "limits", (2, 4), "limits of joints").astype(np.float64))


def calibrated_head(found: BodyEye, **more: object) -> Robot:
    """Return the pan-tilt head that `body_eye` measured; keyword arguments are those of `pan_tilt_head`."""
    return pan_tilt_head(found.axes, found.motor, **more)  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True, eq=False)
class Aim:
    """Result of `aim`."""

    q: Reals
    """(..., n) Angles within the limits; the nearest ones that were found if they do not reach the point."""
    reached: Reals
    """(...) bool. Whether the point is on the optical axis, in front of the camera."""


def aim(robot: Robot, points: ArrayLike, near: ArrayLike | None = None) -> Aim:
    """Return angles of a pan-tilt head that put points on the optical axis, by Newton's method on stereographic images.

    Parameters
    ----------
    robot : Robot
        With two joints.
    points : array_like, (..., 3)
        In the base frame.
    near : array_like, (..., 2), optional
        Of several solutions, the one nearest to these angles. By default 0.

    Returns
    -------
    Aim

    Raises
    ------
    JointCountError, TypeError, ValueError
        If the robot does not have two joints, or an argument has a different shape or type.
    """
    if robot.n_joints != 2:
        raise ValueError(f"{robot.name}: {robot.n_joints} joints; expected a head with two")
    chain = chain_of(robot)
    places = real_array(points, "points", (3,), "points").astype(np.float64)
    start = np.zeros(2) if near is None else real_array(near, "near", (2,), "angles").astype(np.float64)
    grid = np.stack(np.meshgrid(np.arange(-3, 4) * np.pi / 4, np.array([-0.8, 0.0, 0.8])), -1).reshape(-1, 2)
    q = np.concatenate([np.zeros((1, 2)), grid]) + start[..., None, :]
    q = np.broadcast_to(q, (*np.broadcast_shapes(q.shape[:-2], places.shape[:-1]), *q.shape[-2:])).copy()
    target = places[..., None, :]
    step = _newton(chain, 1e-3, 1e-2)
    for _ in range(STEPS):
        q += step(q, target)[0]
    _, error, _, status = _newton(chain, 0.0, 0.0)(q, target)
    size = np.abs(error).max(-1)
    reached = (status <= TrackingStatus.SATURATED) & (size <= CONVERGED)
    q = start[..., None, :] + (q - start[..., None, :] + np.pi) % (2 * np.pi) - np.pi
    low, high = robot.limits[:, 0], robot.limits[:, 1]
    q = np.where(q > high, q - 2 * np.pi, np.where(q < low, q + 2 * np.pi, q))
    outside = np.maximum(np.maximum(low - q, q - high), 0).sum(-1)
    reached &= outside <= CONVERGED
    # Solutions within limits come first, then those that are least beyond them, then the others.
    score = np.where(size <= CONVERGED, _SECOND * outside, _LAST + np.nan_to_num(size, nan=_LAST))
    score = np.where(reached, np.abs(q - start[..., None, :]).sum(-1), _SECOND + score)
    best = np.argmin(score, -1)[..., None]
    chosen = np.take_along_axis(np.clip(q, low, high), best[..., None], -2)[..., 0, :]
    return Aim(np.nan_to_num(chosen), np.take_along_axis(reached, best, -1)[..., 0])


def gaze_rates(tracker: Tracker, q: ArrayLike, points: ArrayLike) -> VelocityStep:
    """Return rates that turn a pan-tilt head to points from anywhere, also where they are not in the image.

    The errors are those of the angles: the joints move straight to the nearest angles within their limits that put the
    point on the optical axis (`aim`), with ``e' = -gain e`` for points at rest. `Tracker.rates_for_point` moves the
    image straight to the goal instead, which may lead to a limit.

    Parameters
    ----------
    tracker : Tracker
        Of a robot with two joints. Its gain and speeds are used.
    q : array_like, (..., 2)
        Angles of the joints.
    points : array_like, (..., 3)
        In the base frame.

    Returns
    -------
    VelocityStep
        The status is NOT_VISIBLE where no angles within the limits were found; the rates are then 0. The singular value
        is 1, that of the angles themselves.

    Raises
    ------
    JointCountError, TypeError, ValueError
        As in `aim`.
    """
    angles = real_array(q, "q", (2,), "angles").astype(np.float64)
    finite = np.isfinite(angles).all(-1) & np.isfinite(np.asarray(points, float)).all(-1)
    safe = np.where(np.isfinite(angles), angles, 0.0)
    found = aim(tracker.robot, points, safe)
    error = safe - found.q
    speeds = np.maximum(tracker.robot.limits[:, 2], TINY)
    excess = (np.abs(tracker.gain * error) / speeds).max(-1)
    moves = finite & found.reached
    rates = np.where(moves[..., None], -tracker.gain * error / np.maximum(excess, 1.0)[..., None], 0.0)
    status = np.where(excess > 1, TrackingStatus.SATURATED, TrackingStatus.OK)
    status = np.where(found.reached, status, TrackingStatus.NOT_VISIBLE)
    status = np.where(finite, status, TrackingStatus.NOT_FINITE)
    return VelocityStep(rates, error, np.ones(status.shape), status[()])


def _newton(chain: Chain, threshold: float, damping: float) -> Callable[[Reals, Reals], tuple[Reals, ...]]:
    """Return the kernel of Newton's steps towards the optical axis, which are at most half a radian long."""
    nothing, one = np.zeros(2), np.ones(2)

    def step(q: Reals, points: Reals) -> tuple[Reals, ...]:
        rates, error, least, status = kernels.rates_for_point(
            q,
            **chain.tables,
            point=points,
            mirror=1.0,
            twist=np.zeros(6),
            goal=nothing,
            goal_rate=nothing,
            gain=one,
            weights=one,
            limits=0.5 * one,
            threshold=threshold,
            damping=damping,
        )
        return rates, error, least, status

    return step
