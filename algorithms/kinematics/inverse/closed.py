"""Closed-form inverse kinematics of arms with at most six joints and a suitable structure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from generated import arms, closed_arms, pga3

from ...arguments import Reals
from .chain import COINCIDE, TOLERANCE, Chain, Method, common_point, direction, parallel
from .regional import Regional
from .solutions import Branches

Tables = dict[str, Any]
"""The constants of a closed form, for the kernel of one robot."""


Measured = tuple[Reals, Reals, Reals]


class Closed(Protocol):
    """A method that computes all branches, selected once for a chain."""

    @property
    def name(self) -> str:
        """The structure of the arm that the method uses."""

    def solve(self, goals: Reals) -> tuple[Reals, Reals] | Branches:
        """Return variables (N, branches, n) and discriminants (N, branches) for goal motors (N, 8).

        Methods that may miss a branch return `Branches`.
        """


def closed_form(chain: Chain) -> Closed | None:
    """Return the closed form of a chain, from either end, or None."""
    for form in (ParallelAxes.of, SphericalWrist.of, ThreeParallel.of):
        found = form(chain)
        if found:
            return found
    for form in (SphericalWrist.of, ThreeParallel.of):
        found = form(chain.backwards)
        if found:
            return Backwards(found)
    return None


@dataclass(frozen=True, slots=True, eq=False)
class Backwards:
    """A closed form applied from the end of the chain to its base."""

    forwards: Closed

    @property
    def name(self) -> str:
        """The structure of the arm, seen from its base."""
        return self.forwards.name.replace("wrist", "shoulder")

    def solve(self, goals: Reals) -> tuple[Reals, Reals]:
        """As in `Closed`."""
        q, gap, *_ = self.forwards.solve(pga3.motor_inverse(goals))
        return q[..., ::-1], gap


@dataclass(frozen=True, slots=True, eq=False)
class SphericalWrist:
    """The last three axes intersect.

    The intersection point determines the first three joints, then a line and a plane determine the others.
    """

    chain: Chain
    regional: Regional

    name = "spherical wrist"

    @classmethod
    def of(cls, chain: Chain) -> SphericalWrist | None:
        """Return the closed form of a chain, or None if the chain is of another kind."""
        if len(chain) != 6 or any(chain.slides[3:]):
            return None
        centre = common_point(chain.axes[3:], chain.size)
        if centre is None or parallel(chain.axes[3], chain.axes[4]) or parallel(chain.axes[4], chain.axes[5]):
            return None
        regional = Regional.of(chain.part(0, 3), centre)
        return None if regional is None else cls(chain, regional)

    @property
    def tables(self) -> Tables:
        """What `gacompiler.robots.spherical_wrist` takes; empty if the first three joints need a quartic, or slide."""
        if not self.regional.is_two_sums:
            return {}
        names = ("centre", "base", "mix", "third", "is_first_before_third")
        *rows, order = self.regional.two_sums
        return dict(zip(names, (*rows, order > 0), strict=True))

    @property
    def one(self) -> tuple[Method, Tables] | None:
        """As in `ThreeParallel`; None if the first three joints need a quartic, or slide."""
        if not self.regional.is_two_sums:
            return None
        named = dict(zip(("centre", "base", "mix", "third", "order"), self.regional.two_sums, strict=True))
        return closed_arms.spherical_wrist_branch, {"lines": self.chain.axes, **named}

    def measured(self, goals: Reals) -> Measured | None:
        """As in `ThreeParallel`; None if the first three joints need a quartic, or slide."""
        if not self.regional.is_two_sums:
            return None
        return closed_arms.spherical_wrist(goals, self.chain.axes, *self.regional.two_sums, self.chain.size)

    def solve(self, goals: Reals) -> tuple[Reals, Reals]:
        """As in `Closed`."""
        found = self.measured(goals)
        if found is not None:
            return found[:2]
        q, gap = self.regional.solve(pga3.move_point(goals, self.regional.point))
        arm = self.regional.chain.motion_of_all(q)
        wrist, gap_wrist = arms.wrist_turns(*self.chain.axes[3:], pga3.motor_relative(arm, goals[:, None]))  # type: ignore[call-overload]
        return joined(q, gap, wrist, gap_wrist)


@dataclass(frozen=True, slots=True, eq=False)
class ThreeParallel:
    """The second, third and fourth axes are parallel, and the last two intersect.

    Rotations about parallel axes preserve the planes orthogonal to them. The intersection point of the last two axes
    determines the first angle, the normal of these planes the last two angles. The remaining motion is planar.
    """

    chain: Chain
    point: Reals
    plane: Reals
    """The plane through the point that is orthogonal to the three axes."""
    signs: Reals
    """1 or -1 for each of the three axes: whether it has the direction of the first of them or the opposite."""

    name = "three parallel axes"

    @classmethod
    def of(cls, chain: Chain) -> ThreeParallel | None:
        """Return the closed form of a chain, or None if the chain is of another kind."""
        axes = chain.axes
        if len(chain) != 6 or any(chain.slides) or not (parallel(axes[1], axes[2]) and parallel(axes[2], axes[3])):
            return None
        point = common_point(axes[4:], chain.size)
        if point is None or parallel(axes[0], axes[1]):
            return None
        signs = np.sign(direction(axes[1:4]) @ direction(axes[1]))
        return cls(chain, point, pga3.plane_orthogonal_to_line(point, axes[1]), signs)

    @property
    def tables(self) -> Tables:
        """What `gacompiler.robots.three_parallel_axes` takes."""
        return {"point": self.point, "plane": self.plane, "signs": self.signs}

    @property
    def one(self) -> tuple[Method, Tables]:
        """The kernel that computes and judges one branch, and its tables that describe the arm."""
        return closed_arms.three_parallel_axes_branch, {"lines": self.chain.axes, **self.tables}

    def measured(self, goals: Reals) -> Measured:
        """Return branches and discriminants as `solve`, and the distances of the branches from the goals, (N, 8)."""
        tables = self.point, self.plane, self.signs, self.chain.size
        return closed_arms.three_parallel_axes(goals, self.chain.axes, *tables)

    def solve(self, goals: Reals) -> tuple[Reals, Reals]:
        """As in `Closed`."""
        return self.measured(goals)[:2]


@dataclass(frozen=True, slots=True, eq=False)
class ParallelAxes:
    """Planar arms and SCARA: one to three revolute joints with parallel axes, at most one parallel prismatic joint."""

    chain: Chain
    turns: tuple[int, ...]
    slides: tuple[int, ...]

    name = "parallel axes"

    @classmethod
    def of(cls, chain: Chain) -> ParallelAxes | None:
        """Return the closed form of a chain, or None if the chain is of another kind."""
        turns = tuple(j for j in range(len(chain)) if not chain.slides[j])
        slides = tuple(j for j in range(len(chain)) if chain.slides[j])
        if not 1 <= len(turns) <= 3 or len(slides) > 1 or not all(parallel(chain.axes[0], a) for a in chain.axes):
            return None
        supports = pga3.line_support(chain.axes[list(turns)])
        # Two revolute joints with a common axis are redundant.
        if np.any(np.linalg.norm(np.diff(supports, axis=0), axis=-1) <= TOLERANCE * chain.size):
            return None
        return cls(chain, turns, slides)

    def solve(self, goals: Reals) -> tuple[Reals, Reals]:
        """As in `Closed`."""
        axes = self.chain.axes
        q = np.zeros((len(goals), 2 if len(self.turns) == 3 else 1, len(self.chain)))
        for j in self.slides:
            point = pga3.line_support(axes[j])
            q[..., j] = pga3.position_along_line(pga3.move_point(goals, point), axes[j])[:, None]
            goals = pga3.motor_relative(self.chain.motion(j, q[:, 0, j]), goals)
        lines = axes[list(self.turns)]
        signs = np.sign(direction(lines) @ direction(lines[0]))
        if len(self.turns) == 3:
            found, gap = arms.planar_turns(*(lines * signs[:, None]), goals)  # type: ignore[call-overload]
            q[..., self.turns] = found * signs
            return q, np.repeat(gap[:, None], 2, axis=1)
        # Along e1 or e2, whichever the axes are farther from.
        across = pga3.line_from_direction_moment(np.eye(3)[np.argmin(np.abs(direction(lines[0])))], np.zeros(3))
        whole = arms.turn_between_lines(lines[0], across, pga3.move_line(goals, across))
        if len(self.turns) == 2:
            point = pga3.line_support(lines[1])
            first = arms.turn_between_points(lines[0], point, pga3.move_point(goals, point))
            q[..., 0, self.turns[0]], q[..., 0, self.turns[1]] = first, signs[1] * (whole - first)
        else:
            q[..., 0, self.turns[0]] = whole
        return self.chain.wrapped(q), np.ones((len(goals), 1))


def joined(q: Reals, gap: Reals, more: Reals, gap_more: Reals) -> tuple[Reals, Reals]:
    """Combine branches of the first joints, (N, B, k), with those of the next, (N, B, 2, m), to (N, 2 B, k + m).

    The discriminant is the smaller of the two. A discriminant of 0 of the first joints is kept, because the following
    joints depend on the angle of a freely rotating joint.
    """
    branches = 2 * q.shape[1]
    both = np.concatenate([np.broadcast_to(q[:, :, None], (*more.shape[:-1], q.shape[-1])), more], -1)
    return both.reshape(len(q), branches, both.shape[-1]), np.where(
        np.abs(gap) <= COINCIDE, gap, np.minimum(gap, gap_more)
    ).repeat(2, axis=-1)
