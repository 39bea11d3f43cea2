"""The chain of screws that is inverted: its motions, and how its axes lie to each other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from generated import arms, pga3

from ...arguments import Reals

TOLERANCE = 1e-9
"""Sines of angles, and distances as parts of the arm's size, up to this are 0: axes meet, or are parallel."""

COINCIDE = 1e-12
"""Discriminants up to this are branches that coincide to 1e-6 radians."""

SAME = 1e-5
"""Configurations are the same where their largest difference is less."""
_ONE = np.eye(8)[0]


@dataclass(frozen=True, eq=False)
class Chain:
    """Joints that turn about their axes or slide along them, ``E_1(q_1) ... E_n(q_n)``.

    Attributes
    ----------
    axes : array, (n, 6)
        Unit lines where all variables are 0.
    slides : tuple of bool
        Which joints are prismatic.
    """

    axes: Reals
    slides: tuple[bool, ...]

    def __len__(self) -> int:
        return len(self.slides)

    def part(self, joints: slice) -> Chain:
        """Some joints in a row."""
        return Chain(self.axes[joints], self.slides[joints])

    @cached_property
    def backwards(self) -> Chain:
        """The chain whose motion is the inverse, of the same variables in the other order."""
        return Chain(-self.axes[::-1], self.slides[::-1])

    @cached_property
    def size(self) -> float:
        """A length of the order of the arm's reach: of the way from axis to axis, or 1 where that is 0."""
        points = pga3.line_support(self.axes)
        on_next = pga3.project_point_on_line(points[:-1], self.axes[1:])
        total = float(np.linalg.norm(points[:-1] - on_next, axis=-1).sum() + np.linalg.norm(np.ptp(points, axis=0)))
        return total if total > 0 else 1.0

    def motion(self, joint: int, q: Reals) -> Reals:
        """The motor of one joint, (...) to (..., 8)."""
        if self.slides[joint]:
            return pga3.motor_from_screw(self.axes[joint], 0.0, q)  # type: ignore[no-any-return]
        return pga3.motor_from_line(self.axes[joint], q)  # type: ignore[no-any-return]

    def motions(self, q: Reals) -> list[Reals]:
        """The motors of the first 1, 2, ..., n joints, (..., n) to n times (..., 8)."""
        found = [self.motion(0, q[..., 0])]
        for j in range(1, len(self)):
            found.append(pga3.motor_product(found[-1], self.motion(j, q[..., j])))
        return found

    def motion_of_all(self, q: Reals) -> Reals:
        """The motor of all joints, (..., n) to (..., 8)."""
        first, *rest = self._groups(q)
        for motion in rest:
            first = pga3.motor_product(first, motion)
        return first

    def distance(self, q: Reals, goals: Reals) -> Reals:
        """How far the motor of all joints is from goals: the kernel `distance_to_goal`, (..., n), (..., 8) to (...)."""
        *most, last = self._groups(q)
        first = _ONE if not most else most[0]
        for motion in most[1:]:
            first = pga3.motor_product(first, motion)
        return arms.distance_to_goal(first, last, goals, self.size)  # type: ignore[no-any-return]

    def _groups(self, q: Reals) -> list[Reals]:
        """The motors of three joints in a row where all turn, and of single ones."""
        found, j = [], 0
        while j < len(self):
            three = slice(j, j + 3)
            if j + 3 <= len(self) and not any(self.slides[three]):
                found.append(arms.motion_of_three_turns(*self.axes[three], q[..., three]))
                j += 3
            else:
                found.append(self.motion(j, q[..., j]))
                j += 1
        return found

    def wrapped(self, q: Reals) -> Reals:
        """Joint variables with angles in (-pi, pi]."""
        turned = q - 2 * np.pi * np.ceil((q - np.pi) / (2 * np.pi))
        return np.where(np.array(self.slides) | (np.abs(q) < np.pi), q, np.clip(turned, -np.pi, np.pi))

    def lock(self, joint: int, value: Reals, goals: Reals) -> tuple[Chain, Reals]:
        """The chain without one joint, and the motors it must make: (N, 8).

        A joint between others carries the axes behind it along, so that it has one value for all goals.
        """
        motion = self.motion(joint, value)
        keep = [j for j in range(len(self)) if j != joint]
        slides = tuple(self.slides[j] for j in keep)
        if joint == 0:
            return Chain(self.axes[1:], slides), pga3.motor_relative(motion, goals)
        axes = self.axes.copy()
        if joint < len(self) - 1:
            axes[joint + 1 :] = pga3.move_line(motion, axes[joint + 1 :])
        return Chain(axes[keep], slides), pga3.motor_between_frames(motion, goals)


def apart(a: Reals, b: Reals, slides: Reals) -> Reals:
    """The largest difference of two configurations."""
    away = a - b
    away[..., ~slides] = (away[..., ~slides] + np.pi) % (2 * np.pi) - np.pi
    return np.asarray(np.abs(away).max(-1))


def direction(line: Reals) -> Reals:
    """The direction of a line."""
    return pga3.line_to_direction_moment(line)[0]  # type: ignore[no-any-return]


def parallel(a: Reals, b: Reals) -> bool:
    """Whether two unit lines have the same direction, or opposite ones."""
    angle = float(pga3.angle_between_lines(a, b))
    return min(angle, np.pi - angle) <= TOLERANCE


def common_point(lines: Reals, size: float) -> Reals | None:
    """The point in which unit lines meet, or None; lines that are all parallel have none."""
    angles = {
        (i, j): np.sin(pga3.angle_between_lines(lines[i], lines[j])) for i, j in combinations(range(len(lines)), 2)
    }
    i, j = max(angles, key=lambda pair: float(angles[pair]))
    if angles[i, j] <= TOLERANCE:
        return None
    # The two nearest points of skew lines: those of lines that meet are the same.
    point: Reals = pga3.point_from_trivector(pga3.meet_lines(lines[i], lines[j]))
    near = np.all(pga3.distance_point_line(point, lines) <= TOLERANCE * size)
    return point if near else None
