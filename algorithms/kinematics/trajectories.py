"""Trajectories: splines in joint space, and screw motions of the end effector."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from ..elements import MOTOR, elements
from ..precision import CONVERGED
from .inverse.chain import arm_of
from .inverse.search import descend
from .robot import Robot

_STEPS = 40
"""A limit on work: the number of steps from one pose of a path to the next."""


def joint_motion(points: ArrayLike, times: ArrayLike, at: ArrayLike) -> tuple[Reals, Reals, Reals]:
    """Return a cubic spline through joint configurations, at rest at both ends.

    Parameters
    ----------
    points : array_like, (k, n)
        At least two configurations.
    times : array_like, (k,)
        Increasing times of these configurations, s.
    at : array_like, (m,)
        Times at which the motion is evaluated. Before the first and after the last time the joints are at rest.

    Returns
    -------
    q, qd, qdd : array, (m, n)
        `q` and `qd` are continuous. `qdd` is continuous except at the ends.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape, or times do not increase.
    """
    where, when = real_array(points, "points", (-1, -1), "configurations"), real_array(times, "times", (-1,), "seconds")
    now = real_array(at, "at", (-1,), "seconds")
    if len(where) < 2 or len(where) != len(when) or not (np.diff(when) > 0).all():
        raise ValueError(
            f"times: {when}; expected increasing times, one for each of the {len(where)} points, at least two"
        )
    spline = scipy.interpolate.CubicSpline(when, where, bc_type="clamped")
    inside = ((now >= when[0]) & (now <= when[-1]))[:, None]
    clipped = np.clip(now, when[0], when[-1])
    return spline(clipped), np.where(inside, spline(clipped, 1), 0.0), np.where(inside, spline(clipped, 2), 0.0)


@elements(goal=MOTOR)
def screw_motion(robot: Robot, start: ArrayLike, goal: ArrayLike, count: int) -> Reals:
    """Return configurations of a screw motion of the end effector to a pose, from rest to rest.

    The motor follows ``exp(s log(goal start^-1)) start`` with ``s = 10 t³ - 15 t⁴ + 6 t⁵``. Each configuration is
    computed by damped least squares from the previous one, so that the arm remains in its branch and redundant arms
    avoid unnecessary motion.

    Parameters
    ----------
    robot : Robot
    start : array_like, (n,)
    goal : array_like, (8,) or (4, 4)
        A motor of either sign, or a matrix.
    count : int
        Number of configurations including both ends, at least two.

    Returns
    -------
    array, (count, n)

    Raises
    ------
    ArithmeticError
        If the path leaves the workspace, or passes a singularity where the arm cannot follow. The message names the
        step.
    TypeError, ValueError
        If an argument has a wrong shape.
    """
    first = real_array(start, f"{robot.name}: start", (robot.n_joints,), "joint variables").astype(float)
    if first.ndim != 1:
        raise ValueError(f"{robot.name}: start: shape {first.shape}; expected ({robot.n_joints},)")
    pose = real_array(goal, f"{robot.name}: goal", ())
    if pose.shape not in ((8,), (4, 4)):
        raise ValueError(f"{robot.name}: goal: shape {pose.shape}; expected (8,) or (4, 4)")
    if count < 2:
        raise ValueError(f"{robot.name}: count {count}; expected at least two")
    t = np.linspace(0, 1, count)
    end = pga3.normalize_motor(pose.astype(float)) if pose.shape == (8,) else pga3.motor_from_matrix(pose.astype(float))
    path = pga3.interpolate_motors(robot.forward(first), end, t**3 * (10 - 15 * t + 6 * t * t))
    arm, variables = robot._arm()
    chain, goals = arm_of(arm).centred(pga3.motor_between_frames(arm.tool, path))
    found = np.tile(first, (count, 1))
    q = first[None, variables]
    for k in range(1, count):
        q, _, off = descend(chain, q, goals[k : k + 1], _STEPS)
        if not off[0] <= CONVERGED:
            raise ArithmeticError(
                f"{robot.name}: step {k} of {count - 1}: the pose is missed by {off[0]:.1e} of the arm's size"
            )
        found[k, variables] = q[0]
    return found
