"""Arms of six joints or fewer whose structure gives all branches in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from generated import arms, pga3

from ...arguments import Reals
from .chain import COINCIDE, TOLERANCE, Chain, common_point, direction, parallel
from .regional import Regional


class Closed(Protocol):
    """A way to all branches, chosen once for a chain."""

    @property
    def name(self) -> str:
        """What the arm has that makes it work."""

    def solve(self, goals: Reals) -> tuple[Reals, Reals]:
        """Variables (N, branches, n) and discriminants (N, branches) for motors (N, 8) that the joints should make."""


def closed_form(chain: Chain) -> Closed | None:
    """The closed form of a chain, from either end, or None."""
    for way in (ParallelAxes.of, SphericalWrist.of, ThreeParallel.of):
        found = way(chain)
        if found:
            return found
    for way in (SphericalWrist.of, ThreeParallel.of):
        found = way(chain.backwards)
        if found:
            return Backwards(found)
    return None


@dataclass(frozen=True, slots=True, eq=False)
class Backwards:
    """A chain that is solved from its end to its base."""

    forwards: Closed

    @property
    def name(self) -> str:
        """What the arm has, seen from its base."""
        return self.forwards.name.replace("wrist", "shoulder")

    def solve(self, goals: Reals) -> tuple[Reals, Reals]:
        """As in `Closed`."""
        q, gap = self.forwards.solve(pga3.motor_inverse(goals))
        return q[..., ::-1], gap


@dataclass(frozen=True, slots=True, eq=False)
class SphericalWrist:
    """The last three axes meet: their point gives the first three joints, then a line and a plane the others."""

    chain: Chain
    regional: Regional

    name = "spherical wrist"

    @classmethod
    def of(cls, chain: Chain) -> SphericalWrist | None:
        """The chain prepared, or None where it is of another kind."""
        if len(chain) != 6 or any(chain.slides[3:]):
            return None
        centre = common_point(chain.axes[3:], chain.size)
        if centre is None or parallel(chain.axes[3], chain.axes[4]) or parallel(chain.axes[4], chain.axes[5]):
            return None
        regional = Regional.of(chain.part(slice(0, 3)), centre)
        return None if regional is None else cls(chain, regional)

    def solve(self, goals: Reals) -> tuple[Reals, Reals]:
        """As in `Closed`."""
        q, gap = self.regional.solve(pga3.move_point(goals, self.regional.point))
        arm = self.regional.chain.motion_of_all(q)
        wrist, gap_wrist = arms.wrist_turns(*self.chain.axes[3:], pga3.motor_relative(arm, goals[:, None]))
        return joined(q, gap, wrist, gap_wrist)


@dataclass(frozen=True, slots=True, eq=False)
class ThreeParallel:
    """The second, third and fourth axes are parallel, and the last two meet.

    Turns about parallel axes leave the planes across them in place. Where the last two axes meet gives the first
    angle, the normal of the planes the last two, and what is left is a motion in a plane.
    """

    chain: Chain
    point: Reals
    signs: Reals
    """Which of the three axes have the direction of the first."""

    name = "three parallel axes"

    @classmethod
    def of(cls, chain: Chain) -> ThreeParallel | None:
        """The chain prepared, or None where it is of another kind."""
        axes = chain.axes
        if len(chain) != 6 or any(chain.slides) or not (parallel(axes[1], axes[2]) and parallel(axes[2], axes[3])):
            return None
        point = common_point(axes[4:], chain.size)
        if point is None or parallel(axes[0], axes[1]):
            return None
        signs = np.sign(direction(axes[1:4]) @ direction(axes[1]))
        return cls(chain, point, signs)

    def solve(self, goals: Reals) -> tuple[Reals, Reals]:
        """As in `Closed`."""
        axes = self.chain.axes
        plane = pga3.plane_orthogonal_to_line(self.point, axes[1])
        one, gap = arms.turns_to_plane(-axes[0], pga3.move_point(goals, self.point), plane)
        rest = pga3.motor_relative(self.chain.motion(0, one), goals[:, None])
        normal = pga3.move_line(pga3.motor_inverse(rest), axes[1])
        *wrist, gap_wrist = arms.turns_about_two_axes(axes[4], axes[5], normal, axes[1])
        q, gap = joined(one[..., None], gap[:, None], np.stack(wrist, -2), gap_wrist)
        rest = np.repeat(rest, 2, axis=1)
        tail = pga3.motor_product(self.chain.motion(4, q[..., 1]), self.chain.motion(5, q[..., 2]))
        middle, gap_middle = arms.planar_turns(
            *(axes[1:4] * self.signs[:, None]), pga3.motor_between_frames(tail, rest)
        )
        ahead, gap = joined(q, gap, middle * self.signs, gap_middle)
        return ahead[..., [0, 3, 4, 5, 1, 2]], gap


@dataclass(frozen=True, slots=True, eq=False)
class ParallelAxes:
    """Planar arms and SCARA: at most three turns about parallel axes, and at most one slide along them."""

    chain: Chain
    turns: tuple[int, ...]
    slides: tuple[int, ...]

    name = "parallel axes"

    @classmethod
    def of(cls, chain: Chain) -> ParallelAxes | None:
        """The chain prepared, or None where it is of another kind."""
        turns = tuple(j for j in range(len(chain)) if not chain.slides[j])
        slides = tuple(j for j in range(len(chain)) if chain.slides[j])
        if not 1 <= len(turns) <= 3 or len(slides) > 1 or not all(parallel(chain.axes[0], a) for a in chain.axes):
            return None
        supports = pga3.line_support(chain.axes[list(turns)])
        # Two turns about one axis are one turn.
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
            found, gap = arms.planar_turns(*(lines * signs[:, None]), goals)
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
    """Branches of the first joints, (N, B, k), each with those of the next, (N, B, 2, m), as (N, 2 B, k + m).

    Discriminants are the smaller ones, but 0 stays: what comes after a joint that turns freely depends on its angle.
    """
    branches = 2 * q.shape[1]
    both = np.concatenate([np.broadcast_to(q[:, :, None], (*more.shape[:-1], q.shape[-1])), more], -1)
    return both.reshape(len(q), branches, both.shape[-1]), np.where(
        np.abs(gap) <= COINCIDE, gap, np.minimum(gap, gap_more)
    ).repeat(2, axis=-1)
