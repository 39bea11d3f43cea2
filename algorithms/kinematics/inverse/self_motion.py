"""Self-motions: curves of configurations in which an arm with seven joints keeps its end effector where it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import pga3

from ...arguments import Reals, finite_number, real_array
from ...elements import MOTOR, plain
from ..model import Model
from .chain import Chain, apart, arm_of
from .search import REACHED, descend

_STARTS = 96
"""Limit on work: random starts, from which the branches are found. Few arms have more than sixteen."""
_SAMPLES = 4000
"""Limit on work: configurations of one branch."""
_SHORTEST = 1 / 1024
"""A curve ends where steps this much shorter than the given one do not lead on."""


@dataclass(frozen=True, slots=True, eq=False)
class SelfMotion:
    """One branch of a self-motion.

    Attributes
    ----------
    q : array, (k, n)
        Configurations along the branch. Angles are continuous; they may exceed a half turn.
    parameter : array, (k,)
        The distance along the branch, radians for revolute joints and metres for prismatic ones. It is the Euclidean
        length of the curve of configurations.
    within_limits : array of bool, (k,)
        Whether each configuration, with angles shifted by whole turns where possible, is within the limits.
    is_closed : bool
        Whether the branch returns to its first configuration. Otherwise it ends at singular configurations, or after
        4,000 configurations in both directions.
    """

    q: Reals
    parameter: Reals
    within_limits: NDArray[np.bool_]
    is_closed: bool


def self_motions(robot: Model, pose: ArrayLike, step: float) -> tuple[SelfMotion, ...]:
    """Return all branches of the self-motion of a serial arm; see `Robot.self_motions`."""
    size = finite_number(step, "step")
    if not 1e-4 <= size <= 0.5:
        raise ValueError(f"step: {size}; expected 1e-4 to 0.5")
    chain = arm_of(robot)
    if len(chain) != 7:
        raise ValueError(f"{robot.name}: self_motions: {len(chain)} joints; expected an arm with seven joints")
    motor = real_array(plain(pose, "pose", MOTOR), f"{robot.name}: pose")
    if motor.shape == (4, 4):
        motor = pga3.motor_from_matrix(motor)
    if motor.shape != (8,):
        raise ValueError(f"{robot.name}: pose: shape {motor.shape}; expected one motor (8,) or matrix (4, 4)")
    motor = pga3.normalize_motor(motor.astype(float))
    if not np.isfinite(motor).all():
        raise ValueError(f"{robot.name}: pose: NaN, infinite or no rigid motion; expected a finite motor or matrix")
    chain, goals = chain.centred(pga3.motor_between_frames(robot.tool, motor)[None])
    goal = goals[0]
    rng = np.random.default_rng(7)
    begin = rng.uniform(chain.ranges[:, 0], chain.ranges[:, 1], (_STARTS, len(chain)))
    q, error, _ = descend(chain, begin, np.tile(goal, (_STARTS, 1)))
    starts = q[error <= REACHED * chain.size]
    slides = np.array(chain.slides)
    found = []
    while len(starts):
        curve, is_closed = _branch(chain, starts[0], goal, size)
        lengths = np.linalg.norm(np.diff(curve, axis=0), axis=-1)
        found.append(
            SelfMotion(curve, np.concatenate([[0.0], np.cumsum(lengths)]), _within(robot, curve, slides), is_closed)
        )
        near = np.array([apart(start, curve, slides).min() for start in starts])
        near[0] = 0.0
        starts = starts[near > size]
    return tuple(found)


def _branch(chain: Chain, start: Reals, goal: Reals, step: float) -> tuple[Reals, bool]:
    """Return the configurations of the branch through a start, and whether it is closed."""
    ahead, is_closed = _followed(chain, start, goal, step, 1.0)
    if is_closed:
        return ahead, True
    back, _ = _followed(chain, start, goal, step, -1.0)
    return np.concatenate([back[:0:-1], ahead]), False


def _followed(chain: Chain, start: Reals, goal: Reals, step: float, sign: float) -> tuple[Reals, bool]:
    """Return the configurations in one direction, and whether the last one is the start again."""
    first = sign * _tangent(chain, start)
    found, tangent, length = [start], first, step
    slides = np.array(chain.slides)
    while len(found) < _SAMPLES:
        wish = found[-1] + length * tangent
        q, error, _ = chain.descent(wish, goal, 10.0)
        after = _tangent(chain, q)
        after = after * np.sign(after @ tangent)
        # A step leads on if it is corrected by less than half of its length, and turns by less than a quarter turn.
        leads_on = error <= REACHED * chain.size and np.linalg.norm(q - wish) < length / 2 and after @ tangent > 0.5
        if not leads_on:
            length /= 2
            if length < _SHORTEST * step:
                return np.array(found), False
            continue
        if len(found) > 2 and apart(q, start, slides) < step:
            whole = q - 2 * np.pi * np.where(slides, 0.0, np.rint((q - start) / (2 * np.pi)))
            if (whole - start) @ first >= 0 > (whole - start - (q - found[-1])) @ first and after @ first > 0:
                return np.array([*found, start + (q - whole)]), True
        found.append(q)
        tangent, length = after, min(2 * length, step)
    return np.array(found), False


def _tangent(chain: Chain, q: Reals) -> Reals:
    """Return the unit vector of rates that do not move the end effector."""
    return np.asarray(np.linalg.svd(chain.rates(q).T)[2][-1])


def _within(robot: Model, curve: Reals, slides: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return whether configurations are within the limits after whole turns of revolute joints."""
    low, high = robot.limits[:, 0], robot.limits[:, 1]
    turn = 2 * np.pi
    # The lowest value within the lower limit or, without one, the highest within the upper limit.
    up = np.where(slides | np.isinf(low), 0.0, turn * np.floor((curve - low) / turn))
    down = np.where(slides | np.isfinite(low) | np.isinf(high), 0.0, turn * np.ceil((curve - high) / turn))
    shifted = curve - up - down
    return np.asarray(((shifted >= low) & (shifted <= high)).all(-1))
