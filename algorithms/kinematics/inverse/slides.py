"""Arms with six joints, two or three of which are prismatic.

Prismatic joints do not rotate anything: the revolute joints determine the rotation, and the remaining equations are
linear in the prismatic variables. Three revolute joints have two solutions for a rotation, and three prismatic joints
follow. With four revolute joints one angle is free. The error that two prismatic joints cannot correct is a function of
this angle, whose roots are located on a grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from generated import arms, pga3

from ...arguments import Reals
from .candidates import by_goal, completed, gathered
from .chain import COINCIDE, TOLERANCE, Chain, direction, parallel
from .solutions import Branches

_GRID = 48
"""Number of values of the free angle on the grid, at intervals of 7.5 degrees."""
_HALVINGS = 14
"""A limit on work: bisections of an angle before Newton's method, which then converges."""
_BLOCK = 256
"""Number of goals in a block, such that their grids fit into the second-level cache."""
_ORIGIN, _ONE = np.zeros(3), np.eye(8)[0]


@dataclass(frozen=True, slots=True, eq=False)
class ThreeSlides:
    """Arms with three revolute joints, consecutive ones not parallel, and three prismatic joints."""

    chain: Chain
    turns: tuple[int, ...]
    slides: tuple[int, ...]

    name = "three slides"

    @classmethod
    def of(cls, chain: Chain) -> ThreeSlides | None:
        """Return the method for a chain, or None if the chain is of another kind."""
        turns, slides = _parts(chain)
        if len(slides) != 3 or len(turns) != 3 or not _skew(chain, turns):
            return None
        found = cls(chain, turns, slides)
        # the discriminant is 0 for coplanar prismatic axes and negative for unreachable rotations
        q = np.random.default_rng(0).uniform(-np.pi, np.pi, (8, 6))
        _, gap = found.solve(chain.motion_of_all(q))
        return found if np.any(gap > TOLERANCE) else None

    def solve(self, goals: Reals) -> tuple[Reals, Reals]:
        """As in `Closed`."""
        q = np.zeros((len(goals), 2, 6))
        q[..., self.turns], gap = arms.wrist_turns(*_directions(self.chain, self.turns), _rotation(goals))  # type: ignore[call-overload]
        (a, b, c), rest = _remaining(self.chain, self.slides, q, goals[:, None])
        across = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], -2)
        volume = np.sum(a * across[..., 0, :], axis=-1)
        flat = np.abs(volume) <= COINCIDE
        found = np.einsum("...ij,...j->...i", across, rest) / np.where(flat, 1.0, volume)[..., None]
        q[..., self.slides] = np.where(flat[..., None], 0.0, found)
        return q, np.where(flat, 0.0, gap[:, None])


@dataclass(frozen=True, slots=True, eq=False)
class TwoSlides:
    """Arms with four revolute and two prismatic joints, scanned from one end or both.

    Of the last three revolute joints, seen from the respective end, no consecutive two are parallel.
    """

    chain: Chain
    scans: tuple[tuple[bool, Scan], ...]
    """Pairs of a scan and whether it uses the reversed chain."""

    name = "search"

    @classmethod
    def of(cls, chain: Chain) -> TwoSlides | None:
        """Return the method for a chain, or None if the chain is of another kind."""
        found = ((False, Scan.of(chain)), (True, Scan.of(chain.backwards)))
        scans = tuple((backwards, scan) for backwards, scan in found if scan is not None)
        return cls(chain, scans) if scans else None

    def solve(self, goals: Reals) -> Branches:
        """As in `Closed`. Close roots that one end misses are usually found from the other end, or from a neighbour."""
        return completed(self.chain, self._once, goals)._replace(complete=np.zeros(len(goals), bool))

    def _once(self, goals: Reals, _: int) -> tuple[Branches, Reals]:
        """Return the branches of one scan, complete if their number is even."""
        parts, nearest = [(np.zeros(0, int), np.zeros((0, 6)))], np.empty((len(goals), 6))
        for backwards, scan in self.scans:
            ends = pga3.motor_inverse(goals) if backwards else goals
            for start in range(0, len(goals), _BLOCK):
                block = slice(start, start + _BLOCK)
                which, q, near = scan.candidates(ends[block])
                parts.append((which + start, q[:, ::-1] if backwards else q))
                nearest[block] = near[:, ::-1] if backwards else near
        which, q = (np.concatenate(part) for part in zip(*parts, strict=True))
        found, gap, count = gathered(self.chain, by_goal(which, q, len(goals)), goals)
        lost = np.isnan(found[..., 0]).all(-1)
        found[lost, 0] = nearest[lost]
        return Branches(found, gap, lost | (count % 2 == 0)), np.full(len(goals), np.nan)


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """A scan of the first revolute joint over a grid; the other three have two solutions for the rotation."""

    chain: Chain
    turns: tuple[int, ...]
    slides: tuple[int, ...]

    @classmethod
    def of(cls, chain: Chain) -> Scan | None:
        """Return the method for a chain, or None if the chain is of another kind."""
        turns, slides = _parts(chain)
        if len(slides) != 2 or len(turns) != 4 or not _skew(chain, turns[1:]):
            return None
        # two prismatic joints that are always parallel are redundant
        (a, b), _ = _remaining(chain, slides, np.random.default_rng(0).uniform(-np.pi, np.pi, (8, 6)), _ONE)
        return cls(chain, turns, slides) if np.abs(np.cross(a, b)).max() > TOLERANCE else None

    def candidates(self, goals: Reals) -> tuple[Reals, Reals, Reals]:
        """Return indices of goals, (K,), configurations close to them, (K, 6), and the nearest of each goal, (N, 6).

        The nearest configurations are those on the grid.
        """
        angles = np.arange(_GRID) * (2 * np.pi / _GRID)
        grid, left, gap = self._at(np.broadcast_to(angles, (len(goals), _GRID)), goals[:, None])
        there = (gap >= 0)[..., None] & np.isfinite(left)
        after, there_after = np.roll(left, -1, axis=1), np.roll(there, -1, axis=1)
        crossing = there & there_after & (left * after <= 0)
        which, k, branch = np.nonzero(crossing)
        low, high, value = angles[k], angles[k] + 2 * np.pi / _GRID, left[which, k, branch]
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            same = self._at(middle, goals[which])[1][np.arange(len(which)), branch] * value > 0
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        # ends of the intervals where solutions exist, and local minima of the remaining error
        near = (np.abs(left) <= np.abs(after)) & (np.abs(left) <= np.roll(np.abs(left), 1, axis=1))
        edge = there & ~(there_after & np.roll(there, 1, axis=1))
        more, j, side = np.nonzero(there & near & ~crossing & ~np.roll(crossing, 1, axis=1) | edge)
        which, branch = np.concatenate([which, more]), np.concatenate([branch, side])
        q, _, _ = self._at(np.concatenate([(low + high) / 2, angles[j]]), goals[which])
        best = np.where(there, np.abs(left), np.inf).reshape(len(goals), -1).argmin(-1)
        nearest = grid.reshape(len(goals), -1, 6)[np.arange(len(goals)), best]
        return which, q[np.arange(len(which)), branch], nearest

    def _at(self, angle: Reals, goals: Reals) -> tuple[Reals, Reals, Reals]:
        """Return configurations (..., 2, 6) for values of the first angle, remaining errors and discriminants.

        The error is the component orthogonal to both prismatic axes.
        """
        q = np.zeros((*angle.shape, 2, 6))
        first, *others = _directions(self.chain, self.turns)
        rest_of_rotation = pga3.motor_relative(pga3.motor_from_line(first, angle), _rotation(goals))
        q[..., self.turns[0]] = angle[..., None]
        q[..., self.turns[1:]], gap = arms.wrist_turns(*others, rest_of_rotation)  # type: ignore[call-overload]
        (a, b), rest = _remaining(self.chain, self.slides, q, goals[..., None, :])
        across = np.cross(a, b)
        left = np.sum(across * rest, axis=-1)
        # least-squares solution in the plane of both prismatic axes
        aa, ab, bb = np.sum(a * a, -1), np.sum(a * b, -1), np.sum(b * b, -1)
        ar, br = np.sum(a * rest, -1), np.sum(b * rest, -1)
        area = np.maximum(aa * bb - ab * ab, COINCIDE)
        q[..., self.slides[0]], q[..., self.slides[1]] = (bb * ar - ab * br) / area, (aa * br - ab * ar) / area
        return q, left, gap


def _parts(chain: Chain) -> tuple[tuple[int, ...], tuple[int, ...]]:
    joints = range(len(chain))
    return tuple(j for j in joints if not chain.slides[j]), tuple(j for j in joints if chain.slides[j])


def _skew(chain: Chain, turns: tuple[int, ...]) -> bool:
    """Return whether no two consecutive axes are parallel."""
    return not any(parallel(chain.axes[i], chain.axes[j]) for i, j in pairwise(turns))


def _directions(chain: Chain, turns: tuple[int, ...]) -> list[Reals]:
    """Return axes translated to the origin."""
    return [pga3.line_from_direction_moment(direction(chain.axes[j]), _ORIGIN) for j in turns]


def _rotation(goals: Reals) -> Reals:
    """Return motors without their translation."""
    rotor, _ = pga3.motor_to_rotor_translation(goals)
    return pga3.motor_from_rotor_translation(rotor, _ORIGIN)


def _remaining(chain: Chain, slides: tuple[int, ...], q: Reals, goals: Reals) -> tuple[list[Reals], Reals]:
    """Return the directions of prismatic axes at given configurations, and the position error of the origin."""
    before = [chain.part(0, k).motion_of_all(q[..., :k]) if k else _ONE for k in slides]
    directions = [direction(pga3.move_line(motion, chain.axes[k])) for motion, k in zip(before, slides, strict=True)]
    return directions, pga3.move_point(goals, _ORIGIN) - pga3.move_point(chain.motion_of_all(q), _ORIGIN)
