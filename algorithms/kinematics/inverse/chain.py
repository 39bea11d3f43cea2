"""Serial chains of screws: motions of the joints, and geometric relations between the axes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import combinations
from typing import Any

import numpy as np

from generated import eliminations, pga3, reaching

from ...arguments import Reals
from ...precision import NEGLIGIBLE, ROOT
from ..model import Model

TOLERANCE = 1e-9
"""Tolerance for sines of angles and for distances relative to the arm's size, to detect intersecting or parallel axes.
"""

COINCIDE = 1e-12
"""Branches with discriminants up to this coincide to 1e-6 radians."""

SAME = 1e-5
"""Configurations are considered equal if their largest difference is less than this."""
RIGHT = 2e-11
"""Differences between the coefficients of motors up to this are not significant."""
_ROUNDED = 2.0**-49
"""Rounding errors of goals relative to their distance from the origin: those of eight operations."""
ROUNDING = 1e-15
"""Errors up to this, relative to the arm's size, are rounding errors."""

Method = Any
"""A kernel with the tables of a chain bound to it."""


@dataclass(frozen=True, eq=False)
class Chain:
    """A product of revolute and prismatic joint motions, ``E_1(q_1) ... E_n(q_n)``.

    Attributes
    ----------
    axes : array, (n, 6)
        Unit lines at the zero configuration.
    slides : tuple of bool
        Which joints are prismatic.
    blur : float
        Rounding errors of goals far from the origin, relative to the size.
    """

    axes: Reals
    slides: tuple[bool, ...]
    blur: float = 0.0

    def __len__(self) -> int:
        return len(self.slides)

    def part(self, first: int, end: int) -> Chain:
        """Return the chain of consecutive joints, from the first to the one before the end."""
        return chain_of(self.axes[first:end], self.slides[first:end])

    @cached_property
    def backwards(self) -> Chain:
        """The chain with the inverse motion, with the same variables in reverse order."""
        return chain_of(-self.axes[::-1], self.slides[::-1])

    @cached_property
    def size(self) -> float:
        """A length of the order of the arm's reach: that of a path from axis to axis, or 1 if that is 0."""
        points = pga3.line_support(self.axes)
        on_next = pga3.project_point_on_line(points[:-1], self.axes[1:])
        total = float(np.linalg.norm(points[:-1] - on_next, axis=-1).sum() + np.linalg.norm(np.ptp(points, axis=0)))
        return total if total > 0 else 1.0

    @cached_property
    def _moved(self) -> tuple[Reals, Chain] | None:
        """The translation from the origin to the point nearest to all axes, and the chain moved back by it.

        None if this point is not farther from the origin than the size of the arm, where rates of joints are not nearly
        dependent.
        """
        directions, moments = pga3.line_to_direction_moment(self.axes)
        across = np.eye(3) - directions[:, :, None] * directions[:, None]
        point = np.linalg.lstsq(across.sum(0), np.cross(directions, moments).sum(0))[0]
        distance = float(np.linalg.norm(point))
        place = pga3.motor_from_twist(pga3.twist_from_velocities(np.zeros(3), point))
        moments = np.cross(np.cross(directions, moments) - point, directions)
        # Axes through the point have no length beside rounding errors, not a tiny one.
        moments[np.abs(moments) <= _ROUNDED * distance] = 0.0
        axes = pga3.line_from_direction_moment(directions, moments)
        size = Chain(axes, self.slides).size
        if distance <= size:
            return None
        return place, chain_of(axes, self.slides, self.blur + _ROUNDED * distance / size)

    @property
    def is_near(self) -> bool:
        """Whether the arm is not farther from the origin than its size."""
        return self._moved is None

    def centred(self, goals: Reals) -> tuple[Chain, Reals]:
        """Return the chain with its axes near the origin, and goals (N, 8), moved with it if that takes a motion."""
        if self._moved is None:
            return self, goals
        place, chain = self._moved
        return chain, pga3.motor_product(pga3.motor_relative(place, goals), place)

    @property
    def right(self) -> float:
        """A branch is valid if the coefficients of its motor differ by less than this, lengths relative to the size."""
        return RIGHT + self.blur

    @cached_property
    def ranges(self) -> Reals:
        """Bounds of random configurations, (n, 2): a whole turn, or the arm's size."""
        return np.where(np.array(self.slides), self.size, np.pi)[:, None] * [-1.0, 1.0]

    @cached_property
    def tables(self) -> dict[str, Reals]:
        """The arguments `axes` and `turns` of the kernels of `generated.reaching`."""
        still = np.zeros(3)
        lines = [
            pga3.twist_from_velocities(still, direction(axis)) if slides else axis
            for axis, slides in zip(self.axes, self.slides, strict=True)
        ]
        return {"axes": np.array(lines), "turns": 1.0 - np.array(self.slides)}

    @cached_property
    def motion_of_all(self) -> Method:
        """The motor of all joints, (..., n) to (..., 8)."""
        return reaching.motion_of_joints.bind(**self.tables)

    @cached_property
    def distance_rows(self) -> Method:
        """The distance of the motor of all joints to goals, both in rows: (..., n), (..., 8) to (...)."""
        return reaching.distance_to_goal.bind(**self.tables, size=self.size)

    def distance(self, q: Reals, goals: Reals) -> Reals:
        """Return the distance of the motor of all joints to goals, (..., n), (..., 8) to (...)."""
        return self.distance_rows(*paired(q, goals))  # type: ignore[no-any-return]

    @cached_property
    def descent(self) -> Method:
        """Damped least squares from configurations (..., n) to goals (..., 8), in a number of steps."""
        return reaching.descend.bind(**self.tables, size=self.size, enough=ROUNDING * self.size)

    @cached_property
    def descent_inside(self) -> Method:
        """The same with lower and upper limits, (n,) each, before the number of steps."""
        return reaching.descend_inside.bind(**self.tables, size=self.size, enough=ROUNDING * self.size)

    @cached_property
    def rates(self) -> Method:
        """Twists of the joints in the frame of the last link, angular velocities times the size: (..., n, 6)."""
        return reaching.rates_of_joints.bind(**self.tables, size=self.size)

    @cached_property
    def distinct(self) -> Method:
        """Which configurations (..., b, n), at distances (..., b), are branches, and where these coincide."""
        return eliminations.distinct_branches.bind(
            **self.tables, size=self.size, close=NEGLIGIBLE, same=SAME, flat=ROOT
        )

    def motion(self, joint: int, q: Reals) -> Reals:
        """Return the motor of one joint, (...) to (..., 8)."""
        return self.part(joint, joint + 1).motion_of_all(np.ascontiguousarray(q, float)[..., None])  # type: ignore[no-any-return]

    def wrapped(self, q: Reals) -> Reals:
        """Return joint variables with angles in (-pi, pi]."""
        turns = np.ceil((q - np.pi) / (2 * np.pi)) * self.tables["turns"]
        if not np.count_nonzero(turns):
            return q
        return np.where(turns == 0, q, np.minimum(np.maximum(q - 2 * np.pi * turns, -np.pi), np.pi))

    def lock(self, joint: int, value: Reals, goals: Reals) -> tuple[Chain, Reals]:
        """Return the chain without one joint, and its goal motors, (N, 8).

        The value of a joint that is neither the first nor the last must be the same for all goals, because it moves the
        axes of the joints after it.
        """
        motion = self.motion(joint, value)
        keep = [j for j in range(len(self)) if j != joint]
        slides = tuple(self.slides[j] for j in keep)
        if joint == 0:
            return chain_of(self.axes[1:], slides, self.blur), pga3.motor_relative(motion, goals)
        axes = self.axes.copy()
        if joint < len(self) - 1:
            axes[joint + 1 :] = pga3.move_line(motion, axes[joint + 1 :])
        return chain_of(axes[keep], slides, self.blur), pga3.motor_between_frames(motion, goals)


def paired(q: Reals, goals: Reals) -> tuple[Reals, Reals]:
    """Return configurations (..., n) and goals (..., 8) as contiguous arrays of one shape, the fast path of kernels."""
    return np.ascontiguousarray(q), np.ascontiguousarray(np.broadcast_to(goals, (*q.shape[:-1], 8)))


def chain_of(axes: Reals, slides: tuple[bool, ...], blur: float = 0.0) -> Chain:
    """Return a chain, the same object for equal arguments, so that what is computed for it once is found again."""
    return _chain(np.ascontiguousarray(axes, float).tobytes(), slides, blur)


@lru_cache(maxsize=256)
def _chain(axes: bytes, slides: tuple[bool, ...], blur: float) -> Chain:
    return Chain(np.frombuffer(axes).reshape(-1, 6), slides, blur)


def arm_of(robot: Model) -> Chain:
    """Return the joints of a robot."""
    return chain_of(robot.axes, tuple(kind.value == "prismatic" for kind in robot.kinds))


def apart(a: Reals, b: Reals, slides: Reals) -> Reals:
    """Return the largest difference between two configurations."""
    away = a - b
    away -= np.where(slides, 0.0, 2 * np.pi) * np.rint(away / (2 * np.pi))
    return np.asarray(np.abs(away).max(-1))


def direction(line: Reals) -> Reals:
    """Return the direction of a line."""
    return pga3.line_to_direction_moment(line)[0]


def parallel(a: Reals, b: Reals) -> bool:
    """Return whether two unit lines have the same or opposite directions."""
    angle = float(pga3.angle_between_lines(a, b))
    return min(angle, np.pi - angle) <= TOLERANCE


def common_point(lines: Reals, size: float) -> Reals | None:
    """Return the common point of unit lines, or None. Lines that are all parallel have none."""
    angles = {
        (i, j): np.sin(pga3.angle_between_lines(lines[i], lines[j])) for i, j in combinations(range(len(lines)), 2)
    }
    i, j = max(angles, key=lambda pair: float(angles[pair]))
    if angles[i, j] <= TOLERANCE:
        return None
    # For skew lines this point is not on all lines.
    point: Reals = pga3.point_from_trivector(pga3.meet_lines(lines[i], lines[j]))
    near = np.all(pga3.distance_point_line(point, lines) <= TOLERANCE * size)
    return point if near else None
