"""The pose of a robot's end effector from reference lines that it carries, as the robot moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from ..evidence import gate_of
from ..kinematics import Robot
from .motor_filter import MotorFilter
from .motor_objects import LINES


@dataclass(frozen=True, slots=True, eq=False)
class EndEffectorTrack:
    """Poses of an end effector along a motion."""

    motors: Reals
    """(t, 8) From the frame of the end effector to that of the base."""
    covariances: Reals
    """(t, 6, 6) As of `MotorFilter`."""
    status: Reals
    """(t,) int, an `EstimationStatus` each."""


def track_end_effector(
    robot: Robot,
    q: ArrayLike,
    lines: ArrayLike,
    measured: ArrayLike,
    sigma: ArrayLike,
    *,
    covariance: ArrayLike,
    noise: ArrayLike = 0.0,
    gate: float | None = None,
) -> EndEffectorTrack:
    """Estimate the poses of an end effector from lines that it carries and that are measured in the base frame.

    Joint positions predict how the end effector moves between measurements, ``M_k = f(q_k) ~f(q_{k-1}) M_{k-1}``;
    lines correct it. Errors of the tool, of the base and of joint offsets are thus found, and are followed if they
    change (section 18.6.5).

    Parameters
    ----------
    robot : Robot
        The model of the robot.
    q : array_like, (t, m)
        Joint positions.
    lines : array_like, (k, 6)
        Reference lines in the frame of the end effector.
    measured : array_like, (t, k, 6)
        The same lines as measured; NaN where they are not seen.
    sigma : float or pair of floats
        As for `MotorFilter.update_lines`.
    covariance : array_like, (6, 6) or (6,)
        Of the error of the first pose.
    noise : array_like, (6, 6) or (6,)
        Covariance of the error of the motion of each step.
    gate : float, optional
        As for `MotorFilter`: lines that are farther off are left out. By default one right line in a thousand is.

    Returns
    -------
    EndEffectorTrack
    """
    positions = real_array(q, "q", (-1, robot.n_joints)).astype(float)
    model = real_array(lines, "lines", (-1, 6)).astype(float)
    seen = real_array(measured, "measured", (len(positions), len(model), 6)).astype(float)
    poses = robot.forward(positions)
    motions = pga3.motor_product(poses[1:], pga3.motor_inverse(poses[:-1]))
    spread = real_array(covariance, "covariance", (6,), "variances or rows of a matrix").astype(float)
    limit = gate_of(LINES.n_numbers) if gate is None else gate
    follower = MotorFilter(poses[0], spread if spread.ndim == 2 else np.diag(spread), gate=limit)
    motors, covariances, status = [], [], []
    for k, now in enumerate(seen):
        if k:
            follower.move(motions[k - 1], noise)
        follower.update_lines(model, now, sigma)
        motors.append(follower.motor)
        covariances.append(follower.covariance)
        status.append(follower.status)
    return EndEffectorTrack(np.array(motors), np.array(covariances), np.array(status))
