"""The branches of one pose of a robot: the kernels of `solve`, without what only batches and doubtful branches need."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from generated import pga3, reaching

from ...arguments import Reals
from ..model import Model
from .chain import Chain, Method
from .closed import Closed, SphericalWrist, Tables, ThreeParallel
from .solutions import Solutions, Status

MOTION = 1e-3
"""A matrix is a rigid motion if no entry of its rotation differs by more than this from that of its motor."""
_FLOAT64 = np.dtype(np.float64)
_BOOL = np.dtype(bool)
_SIDES = np.array([(a, b, c) for a in (1.0, -1.0) for b in (1.0, -1.0) for c in (1.0, -1.0)])
"""Of each branch the solution of each of three equations that have two."""
_FOUND, _SINGULAR, _INCOMPLETE = (np.array(s, np.int8) for s in (Status.FOUND, Status.SINGULAR, Status.INCOMPLETE))


@dataclass(frozen=True, slots=True, eq=False)
class SinglePose:
    """What the branches of a single pose of a robot are computed with.

    Attributes
    ----------
    tool : array, (8,)
    judged : callable
        From the motion of all joints, (8,), and a configuration to be near to, (n,): what `judged_branch` returns for
        all branches, and whether none is missing.
    name : str
        The method, as in `Solutions`.
    still : array, (n,)
        Zeros.
    """

    tool: Reals
    judged: Callable[[Reals, Reals], tuple[Any, ...]]
    name: str
    still: Reals

    @classmethod
    def of(cls, robot: Model, chain: Chain, form: Closed, judging: Tables) -> SinglePose:
        """Return the kernels for a robot, and the tables by which branches are judged."""
        judging = {"axes": chain.tables["axes"], "size": chain.size, **judging}
        one = form.one if isinstance(form, (SphericalWrist, ThreeParallel)) else None
        return cls(
            robot.tool,
            _one_by_one(*one, judging) if one else _in_block(form, judging),
            form.name,
            np.zeros(len(chain)),
        )

    def attempt(self, pose: object, near: object) -> Solutions | None:
        """Return the branches of a pose in double precision; None for other arguments, or if there is any doubt."""
        if type(pose) is not np.ndarray or pose.dtype is not _FLOAT64:
            return None
        if pose.shape == (8,):
            goal = pga3.motor_between_frames(self.tool, pga3.normalize_motor(pose))
        elif pose.shape == (4, 4):
            goal, away = reaching.goal_of_pose(pose, self.tool)
            if not away <= MOTION:
                return None
        else:
            return None
        wish = 0.0
        if near is None:
            near = self.still
        elif type(near) is np.ndarray and near.dtype is _FLOAT64 and near.shape == self.still.shape:
            if not np.isfinite(near).all():
                return None
            wish = 1.0
        else:
            return None
        moved, valid, within, alike, doubts, complete = self.judged(goal, near)
        nearest, singular, doubtful = reaching.preferred_branch(moved, valid, within, alike, doubts, near, wish)
        if doubtful:
            return None
        status = (_SINGULAR if singular else _FOUND) if complete else _INCOMPLETE
        return Solutions(moved, valid.astype(_BOOL), status.copy(), nearest, self.name, within.astype(_BOOL))


def _one_by_one(kernel: Method, arm: Tables, judging: Tables) -> Callable[[Reals, Reals], tuple[Any, ...]]:
    """Return what computes and judges branches next to each other in vectors."""
    bound = kernel.bind(**arm, **judging)
    return lambda goal, near: (*bound(goal, _SIDES, near), True)


def _in_block(form: Closed, judging: Tables) -> Callable[[Reals, Reals], tuple[Any, ...]]:
    """Return what judges the branches of a method that takes blocks of goals."""
    judge = reaching.judged_branch.bind(**judging)

    def judged(goal: Reals, near: Reals) -> tuple[Any, ...]:
        q, gap, *complete = form.solve(goal[None])
        found = judge(np.ascontiguousarray(q[0]), np.ascontiguousarray(gap[0]), goal, near)
        return *found, not complete or complete[0][0]

    return judged
