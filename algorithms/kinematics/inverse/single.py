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
from .closed import Closed, SphericalWrist, ThreeParallel
from .solutions import FOUND, Solutions, Status

MOTION = 1e-3
"""A matrix is a rigid motion if no entry of its rotation differs by more than this from that of its motor."""
_FLOAT64 = np.dtype(np.float64)
_STATUS = tuple(np.array(status) for status in FOUND)
_INCOMPLETE = np.array(Status.INCOMPLETE, np.int8)


@dataclass(frozen=True, slots=True, eq=False)
class SinglePose:
    """What the branches of a single pose of a robot are computed with.

    Attributes
    ----------
    tool : array, (8,)
    branches : callable
        From the motion of all joints, (8,), or if `takes_pose`, from the pose: branches (B, n), discriminants (B,), and
        whether none is missing.
    takes_pose : bool
    judge : Method
        The kernel `judged_branches` for this robot.
    name : str
        The method, as in `Solutions`.
    still : array, (n,)
        Zeros.
    """

    tool: Reals
    branches: Callable[[Reals], tuple[Reals, Reals, Any]]
    takes_pose: bool
    judge: Method
    name: str
    still: Reals

    @classmethod
    def of(cls, robot: Model, chain: Chain, form: Closed, own: Method | None, judge: Method) -> SinglePose:
        """Return the kernels for a robot; `own` is that of its own module."""
        branches = _complete(own or form.solve) if own or isinstance(form, (SphericalWrist, ThreeParallel)) else None
        if isinstance(form, SphericalWrist) and not form.regional.is_two_sums:
            branches = None
        still = np.zeros(len(chain))
        return cls(
            robot.tool, branches or _in_block(form), own is not None, judge, form.name, still
        )

    def attempt(self, pose: object, near: object) -> Solutions | None:
        """Return the branches of a pose in double precision; None for other arguments, or if there is any doubt."""
        if type(pose) is not np.ndarray or pose.dtype is not _FLOAT64:
            return None
        if pose.shape == (8,):
            motor = pga3.normalize_motor(pose)
        elif pose.shape == (4, 4):
            motor, away = reaching.motor_of_pose(pose)
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
        goal = pga3.motor_between_frames(self.tool, motor)
        q, gap, complete = self.branches(motor if self.takes_pose else goal)
        moved, valid, within, nearest, singular, doubtful = self.judge(q, gap, goal, near, wish)
        if doubtful:
            return None
        is_valid = valid.astype(bool)
        if np.count_nonzero(valid) < len(q):
            moved[~is_valid] = np.nan
        status = _STATUS[int(singular)] if complete else _INCOMPLETE
        return Solutions(moved, is_valid, status.copy(), nearest, self.name, within.astype(bool))


def _complete(solve: Callable[..., Any]) -> Callable[[Reals], tuple[Reals, Reals, Any]]:
    """Return the branches of a kernel, of which none is missing."""

    def branches(goal: Reals) -> tuple[Reals, Reals, bool]:
        found = solve(goal)
        return found[0], found[1], True

    return branches


def _in_block(form: Closed) -> Callable[[Reals], tuple[Reals, Reals, Any]]:
    """Return the branches of a method that takes blocks of goals."""

    def branches(goal: Reals) -> tuple[Reals, Reals, Any]:
        q, gap, *complete = form.solve(goal[None])
        return np.ascontiguousarray(q[0]), np.ascontiguousarray(gap[0]), not complete or complete[0][0]

    return branches
