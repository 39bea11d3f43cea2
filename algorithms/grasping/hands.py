"""Hands: a tree of joints on a palm, fingertips that touch objects, and capsules that cover all parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from generated import collisions, pga3

from ..arguments import Reals, finite, real_array
from ..geometry.meshes import Flags, Integers
from ..kinematics import Robot
from ..kinematics.denavit_hartenberg import Joint
from ..kinematics.errors import DescriptionError
from ..kinematics.tables import followed, path_to
from .preshapes import LARGEST_ERROR, Preshapes, preshapes_of

_STILL = np.eye(8)[:1]
_CONTACTS = 3
"""The number of fingers that hold an object: three hard ones resist all wrenches, and two soft ones."""


@dataclass(frozen=True, slots=True, eq=False)
class Fingertips:
    """Spheres with which fingers touch objects."""

    carriers: Integers
    """(f,) The joint that carries each fingertip."""
    centres: Reals
    """(f, 3) In the frame of the hand, where all joints are at 0."""
    radii: Reals
    """(f,)"""


@dataclass(frozen=True, slots=True, eq=False)
class Capsules:
    """Capsules that cover the parts of a hand."""

    carriers: Integers
    """(k,) The joint that carries each capsule; -1 for the palm."""
    ends: Reals
    """(k, 2, 3) The ends of the axes in the frame of the hand, where all joints are at 0."""
    radii: Reals
    """(k,)"""
    is_first: Flags
    """(k,) Whether it is among those with which most collisions are found, which are tested first."""


@dataclass(frozen=True, slots=True, eq=False)
class Hand:
    """A hand with at least two fingers, whose frame is that of its palm. Made by `hand_of_table` or `hand_from_urdf`.

    Attributes
    ----------
    robot : Robot
        Its joints. Those that mimic others have no variable.
    tips : Fingertips
    parts : Capsules
    limits : array, (m, 2)
        The lowest and highest value of each variable; a full turn for joints that turn without limits.
    closing : array, (m,)
        How fast each variable changes while the fingers close, between -1 and 1.
    approach : array, (3,)
        The unit direction in which the hand moves to an object.
    torsion : float
        The largest torque about its normal that a fingertip resists for a normal force of 1, in metres; 0 for a hard
        one.
    breakaway : array of int, (b,)
        Joints that follow a variable through a clutch: they continue when the parts before them are stopped.
    pairs : array of int, (p, 2)
        Capsules that must not meet: those of different fingers, and of fingertips and the palm.
    preshapes : tuple of Preshapes
        Postures for each choice of fingers that hold an object.
    """

    robot: Robot
    tips: Fingertips
    parts: Capsules
    limits: Reals
    closing: Reals
    approach: Reals
    torsion: float
    breakaway: Integers
    pairs: Integers
    preshapes: tuple[Preshapes, ...]
    at_home: tuple[Reals, Reals]
    """The centres of the fingertips and the ends of the capsules in the frames after the joints that carry them."""

    @property
    def radii(self) -> Reals:
        """The radii (k,) of the capsules."""
        return self.parts.radii

    @property
    def first(self) -> Integers:
        """Indices of the capsules that are tested first."""
        return np.flatnonzero(self.parts.is_first)

    @property
    def contacts(self) -> int:
        """The number of fingers that hold an object."""
        return len(self.preshapes[0].fingers)

    @property
    def tip_radius(self) -> float:
        """The largest radius of the capsules of a fingertip."""
        own = np.isin(self.parts.carriers, self.tips.carriers)
        return float(self.radii[own].max(initial=self.tips.radii.max()))

    @property
    def opening(self) -> float:
        """The largest distance of two fingertips."""
        return max(shape.largest for shape in self.preshapes)

    def fingertips(self, joints: ArrayLike) -> Reals:
        """Return the centres (..., f, 3) of the fingertips in the frame of the hand at variables (..., m)."""
        frames = self.robot.forward_all(self._checked(joints))
        return pga3.move_point(frames[..., self.tips.carriers, :], self.at_home[0])

    def placed_capsules(self, joints: ArrayLike, which: Integers | None = None) -> Reals:
        """Return the ends (..., k, 2, 3) of all capsules, or of some, in the frame of the hand."""
        frames = self.robot.forward_all(self._checked(joints))
        carriers, ends = self.parts.carriers, self.at_home[1]
        if which is not None:
            carriers, ends = carriers[which], ends[which]
        still = np.broadcast_to(_STILL, (*frames.shape[:-2], 1, 8))
        motors = np.concatenate([frames, still], -2)[..., carriers, :]
        return pga3.move_point(motors[..., None, :], ends)

    def own_clearances(self, ends: Reals) -> Reals:
        """Return the distances (..., p) of `pairs` for placed capsules (..., k, 2, 3)."""
        return _clearances(ends, self.radii, self.pairs)

    def _checked(self, joints: ArrayLike) -> Reals:
        count = len(self.limits)
        return finite(real_array(joints, "joints", (count,), f"{count} variables of a hand"), "joints")


def hand_of(
    robot: Robot,
    tips: Fingertips,
    parts: Capsules,
    *,
    closing: Reals | None = None,
    approach: Reals | None = None,
    torsion: float = 0.0,
    breakaway: Sequence[int] = (),
) -> Hand:
    """Return the hand of a robot whose base is the palm.

    Parameters
    ----------
    robot : Robot
    tips : Fingertips
    parts : Capsules
    closing : array, (m,), optional
        By default, each variable changes in proportion to the mean rate at which it moves fingertips to the middle of
        all, over those random postures that have most room for an object.
    approach : array, (3,), optional
        By default, the axis z.
    torsion : float
    breakaway : sequence of int, optional
    """
    clutches = np.array(breakaway, np.intp)
    limits = _ranges(robot)
    homes = np.concatenate([robot.home, _STILL])
    at_home = (
        pga3.move_point_back(homes[tips.carriers], tips.centres),
        pga3.move_point_back(homes[parts.carriers][:, None], parts.ends),
    )
    pairs = _pairs(robot, tips, parts)

    def own_clear(placed: Reals) -> Flags:
        return np.asarray((_clearances(placed, parts.radii, pairs) > 0).all(-1))

    direction = np.array([0.0, 0.0, 1.0]) if approach is None else approach
    hand = Hand(robot, tips, parts, limits, np.zeros(len(limits)), direction, torsion, clutches, pairs, (), at_home)
    count = min(_CONTACTS, len(tips.radii))
    closes, preshapes = preshapes_of(
        robot, limits, tips.carriers, at_home[0], closing, own_clear, hand.placed_capsules, parts.radii,
        [np.array(chosen) for chosen in combinations(range(len(tips.radii)), count)],
    )  # fmt: skip
    for array in (limits, closes, direction, clutches, pairs, *at_home, *_arrays(tips), *_arrays(parts)):
        array.flags.writeable = False
    return Hand(robot, tips, parts, limits, closes, direction, torsion, clutches, pairs, preshapes, at_home)


def _ranges(robot: Robot) -> Reals:
    """Return the limits (m, 2) of the variables; a full turn for joints that turn without limits."""
    limits = robot.limits[:, :2].copy()
    # Some files write huge numbers for no limit: those whose neighbours are farther apart than errors may be.
    with np.errstate(invalid="ignore"):
        is_none = ~(np.spacing(np.abs(limits)) < LARGEST_ERROR)
    limits[is_none] = np.copysign(np.inf, limits[is_none])
    variables, ratios, _ = followed(robot)
    for variable in np.flatnonzero(~np.isfinite(limits).all(1)):
        low, high = limits[variable]
        for joint in np.flatnonzero((variables == variable) & (ratios != 0)):
            if robot.kinds[joint] is Joint.PRISMATIC:
                raise DescriptionError(
                    f"{robot.name}: joint {robot.joint_names[joint]!r} slides between {low} and {high}; expected a "
                    "finite range for a hand"
                )
        if np.isfinite(low):
            limits[variable] = low, low + 2 * np.pi
        elif np.isfinite(high):
            limits[variable] = high - 2 * np.pi, high
        else:
            limits[variable] = -np.pi, np.pi
    return limits


def _arrays(record: Fingertips | Capsules) -> list[Reals]:
    return [getattr(record, name) for name in record.__slots__]


def _clearances(ends: Reals, radii: Reals, pairs: Integers) -> Reals:
    a, b = pairs.T
    return collisions.capsule_pair_clearance(
        ends[..., a, 0, :], ends[..., a, 1, :], ends[..., b, 0, :], ends[..., b, 1, :], radii[a] + radii[b]
    )


def _pairs(robot: Robot, tips: Fingertips, parts: Capsules) -> Integers:
    """Return pairs of capsules that can meet: of different fingers, and of fingertips and the palm.

    Those that overlap where all joints are at 0 belong together, such as neighbouring knuckles.
    """
    above = [set(path_to(robot, int(carrier))) for carrier in parts.carriers]
    is_tip = np.isin(parts.carriers, tips.carriers)
    found = []
    for a, b in combinations(range(len(parts.carriers)), 2):
        fingers = above[a] and above[b] and not (above[a] <= above[b] or above[b] <= above[a])
        palm = (is_tip[a] and not above[b]) or (is_tip[b] and not above[a])
        if fingers or palm:
            found.append((a, b))
    pairs = np.array(found, np.intp).reshape(-1, 2)
    return pairs[_clearances(parts.ends, parts.radii, pairs) > 0]
