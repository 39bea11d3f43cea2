"""Arms with seven joints, a spherical shoulder and a spherical wrist: the elbow moves on a circle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from generated import arms, closed_arms, pga3

from ...arguments import Reals, real_array
from ..model import Model
from .chain import Chain, arm_of, common_point, parallel
from .closed import Tables

_ON_AXIS = 1e-20
"""Squared sines up to this count as 0."""


@dataclass(frozen=True, slots=True, eq=False)
class ElbowCircle:
    """Closed form for arms with spherical shoulder and wrist, given the elbow angle.

    The distance from shoulder to wrist determines the fourth joint. The upper arm can then rotate about the line
    through both. The caller gives the angle of the fourth axis about this line, measured from the commutator product of
    the line and the first axis. Finally, the joints of shoulder and wrist are solved as two rotations.
    """

    chain: Chain
    shoulder: Reals
    wrist: Reals

    name = "elbow circle"

    @classmethod
    def of(cls, chain: Chain) -> ElbowCircle | None:
        """Return the closed form of a chain, or None if the chain is of another kind."""
        if len(chain) != 7 or any(chain.slides) or any(parallel(*chain.axes[j : j + 2]) for j in (0, 1, 4, 5)):
            return None
        shoulder, wrist = (common_point(chain.axes[part], chain.size) for part in (slice(0, 3), slice(4, 7)))
        return None if shoulder is None or wrist is None else cls(chain, shoulder, wrist)

    @property
    def tables(self) -> Tables:
        """What `gacompiler.robots.elbow_circle` takes."""
        return {"shoulder": self.shoulder, "wrist": self.wrist}

    def solve(self, goals: Reals, elbow: Reals) -> tuple[Reals, Reals]:
        """Return variables (N, 8, 7) and discriminants (N, 8) for motors (N, 8) and elbow angles (N,)."""
        return closed_arms.elbow_circle(goals, elbow, self.chain.axes, self.shoulder, self.wrist)

    def reference(self, goal: Reals) -> tuple[Reals, Reals, Reals]:
        """Return the line to the wrist, the reference of the elbow angle, and a squared sine.

        The last result is the squared sine of the angle between the line and the first axis. If the wrist is on the
        first axis, the second axis at home is used instead.
        """
        line = pga3.normalize_line(pga3.join_points(self.shoulder, goal))
        axis = self.chain.axes[0]
        across = pga3.line_commutator(line, axis)
        sine_squared = np.sin(pga3.angle_between_lines(line, axis)) ** 2
        spare = pga3.line_commutator(line, self.chain.axes[1])
        return line, np.where(sine_squared[..., None] > _ON_AXIS, across, spare), sine_squared


def elbow_angle(robot: Model, q: ArrayLike) -> Reals:
    """Return the elbow angle of configurations, the parameter `elbow` of `Robot.inverse`.

    Parameters
    ----------
    robot : Robot
        A robot with seven joints, whose first three axes intersect in one point and last three in another.
    q : array_like, (..., 7)

    Returns
    -------
    array, (...)
        Radians in [-pi, pi].

    Raises
    ------
    TypeError, ValueError
        If the arm is of another kind, or `q` has a wrong shape.
    """
    arm = elbow_circle(robot)
    joints = real_array(q, f"{robot.name}: q", (7,), "7 joint variables")
    upper, lower = (arm.chain.part(0, k).motion_of_all(joints[..., :k]) for k in (3, 4))
    line, start, _ = arm.reference(pga3.move_point(lower, arm.wrist))
    return arms.turn_between_lines(line, start, pga3.move_line(upper, arm.chain.axes[3]))  # type: ignore[no-any-return]


_form = lru_cache(maxsize=256)(ElbowCircle.of)


def elbow_circle(robot: Model) -> ElbowCircle:
    """Return the closed form of a robot near the origin, or raise a `ValueError`."""
    arm = _form(arm_of(robot).centred(np.eye(1, 8))[0])
    if arm is None:
        raise ValueError(
            f"{robot.name}: elbow: not an arm with spherical shoulder and wrist; expected seven revolute joints, the "
            "first three and the last three with intersecting axes; give the value of a joint by "
            "locked={joint: value} instead"
        )
    return arm
