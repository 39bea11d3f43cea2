"""Postures of a hand whose fingertips have given distances from each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import scipy

from generated import grasping, pga3

from ..arguments import Reals
from ..geometry.meshes import Flags, Integers
from ..kinematics import Robot
from ..kinematics.errors import DescriptionError
from ..kinematics.tables import followed, joints_of, origins_of, path_to

LARGEST_ERROR = 1e-7
"""Largest error of a fingertip, in metres."""
_POSTURES = 4096
"""Limit on work: the number of random postures of a hand that are stored."""
_NEAR, _TRIED = 48, 4
"""Limits on work: of so many stored postures with the nearest distances, those with most room for an object are
starts."""
_ROOMY = 4
"""The quarter of the random postures with most room for an object is the one in which a hand closes."""
_STEP = 1e-4
"""The difference of a variable for its rate, in radians or metres: far above rounding errors, far below a finger."""
_JOINTS = "parents", "variables", "ratios", "offsets", "places", "screws", "turns"


def ends_of(count: int) -> tuple[Integers, Integers]:
    """Return the points of the distances of some number of points: all pairs, for three points in a cycle."""
    if count == 3:
        return np.array([0, 1, 2]), np.array([1, 2, 0])
    first, second = np.array(list(combinations(range(count), 2)), np.intp).T
    return first, second


def sides_of(points: Reals) -> Reals:
    """Return the distances (..., s) of points (..., c, 3) from each other."""
    first, second = ends_of(points.shape[-2])
    gaps = points[..., first, :] - points[..., second, :]
    return np.sqrt(np.square(gaps).sum(-1))  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True, eq=False)
class Preshapes:
    """Postures of a hand, and the fingers that are to touch an object."""

    fingers: Integers
    """(c,)"""
    joints: Reals
    """(k, m) Stored postures, in which no parts meet."""
    room: Reals
    """(k,) The distance of the parts of the hand from the middle of the fingertips, less that of the nearest fingertip:
    the more, the less the parts intersect a round object between the fingertips."""
    sides: Any
    """The distances (k, s) of their fingertips, as a tree for searches."""
    largest: float
    """The largest distance."""
    solve: Callable[[Reals, Reals], tuple[Reals, Reals]]
    """The kernel `preshape` with the tables of the hand."""

    def reached(self, sides: Reals) -> tuple[Reals, Reals]:
        """Return postures (..., t, m) with given distances (..., s), from several starts, and their errors (..., t)."""
        near = self.sides.query(sides, min(_NEAR, len(self.joints)))[1]
        near = near.reshape(*sides.shape[:-1], -1)
        best = np.argsort(-self.room[near], axis=-1, kind="stable")[..., :_TRIED]
        starts = self.joints[np.take_along_axis(near, best, -1)]
        wanted = np.ascontiguousarray(np.broadcast_to(sides[..., None, :], (*starts.shape[:-1], sides.shape[-1])))
        return self.solve(starts, wanted)


def preshapes_of(
    robot: Robot,
    limits: Reals,
    carriers: Integers,
    centres: Reals,
    closing: Reals | None,
    own_clear: Callable[[Reals], Flags],
    placed: Callable[[Reals], Reals],
    radii: Reals,
    choices: Sequence[Integers],
) -> tuple[Reals, tuple[Preshapes, ...]]:
    """Return how fast each variable changes while the hand closes, and postures for each choice of fingers.

    Parameters
    ----------
    robot : Robot
    limits : array, (m, 2)
    carriers, centres : array, (f,) and (f, 3)
        The joints that carry the fingertips, and the centres in the frames after these joints.
    closing : array, (m,), optional
        Given by the hand.
    own_clear, placed : callable
        Whether capsules do not meet, and the capsules at given variables.
    radii : array, (k,)
        Of the capsules.
    choices : sequence of array of int, (c,)

    Raises
    ------
    DescriptionError
        If no variable changes the distances of the fingertips.
    """

    def tips(q: Reals) -> Reals:
        return pga3.move_point(robot.forward_all(q)[..., carriers, :], centres)

    def room(points: Reals, capsules: Reals) -> Reals:
        middle = points.mean(1)[:, None]
        gaps = grasping.capsule_gap(middle, capsules[..., 0, :], capsules[..., 1, :], radii)
        return np.asarray(gaps.min(-1) - np.sqrt(np.square(points - middle).sum(-1)).min(1))

    low, high = limits.T
    q = np.random.default_rng(20).uniform(low, high, (_POSTURES, len(low)))
    if not (np.ptp(sides_of(tips(q)), 0) > LARGEST_ERROR).any():
        names = ", ".join(repr(robot.joint_names[carrier]) for carrier in carriers)
        raise DescriptionError(
            f"{robot.name}: no variable changes the distances of the fingertips at joints {names}; expected fingers "
            "that close"
        )
    if closing is None:
        clear = q[own_clear(placed(q))]
        some = clear if len(clear) else q
        roomy = np.argsort(-room(tips(some), placed(some)), kind="stable")[: len(some) // _ROOMY + 1]
        closing = _closing(tips, some[roomy])
    closes = closing
    # Closing from the open hand passes through postures that random ones may miss: the largest opening is among them.
    rest, widest = np.clip(0.0, low, high), max(2 * np.pi, (high - low).max())
    parked = np.clip(rest - widest * closes, low, high)
    shares = np.linspace(0, widest, _TRIED * _NEAR)[:, None]
    q = np.concatenate([q, np.clip(parked + shares * closes, low, high)])
    moves = _moves(robot, carriers)
    found = []
    for fingers in choices:
        own = np.where(moves[fingers].any(0), q, parked)
        capsules = placed(own)
        kept = own_clear(capsules)
        if not kept.any():
            kept[:] = True
        own, capsules = own[kept], capsules[kept]
        points = tips(own)[:, fingers]
        sides = sides_of(points)
        solve = _bound(robot, limits, carriers, centres, fingers)
        tree = scipy.spatial.cKDTree(sides)
        found.append(Preshapes(fingers, own, room(points, capsules), tree, float(sides.max()), solve))
    return closes, tuple(found)


def _closing(tips: Callable[[Reals], Reals], q: Reals) -> Reals:
    """Return the mean rates at which variables move fingertips to the middle of all, relative to the largest one."""
    middle = tips(q).mean(1)[:, None]

    def apart(q: Reals) -> Reals:
        return np.asarray(np.sqrt(np.square(tips(q) - middle).sum(-1)).sum(-1))

    rates = np.array([(apart(q - s) - apart(q + s)).mean() for s in _STEP * np.eye(q.shape[1])])
    return rates / np.abs(rates).max()  # type: ignore[no-any-return]


def _moves(robot: Robot, carriers: Integers) -> Flags:
    """Return whether each variable moves each fingertip, (f, m)."""
    variables, ratios, _ = followed(robot)
    found = np.zeros((len(carriers), robot.n_joints), bool)
    for tip, carrier in enumerate(carriers):
        path = list(path_to(robot, int(carrier)))
        found[tip, variables[path]] |= ratios[path] != 0
    return found


def _bound(
    robot: Robot, limits: Reals, carriers: Integers, centres: Reals, fingers: Integers
) -> Callable[[Reals, Reals], tuple[Reals, Reals]]:
    """Return the kernel `preshape` for some fingers."""
    table, origins = joints_of(robot), origins_of(robot)
    own = carriers[fingers]
    at_home = pga3.move_point(robot.home[own], centres[fingers]) - origins[own]
    pairs = np.array([(k, joint) for k, carrier in enumerate(own) for joint in path_to(robot, int(carrier))])
    moved, movers = np.ascontiguousarray(pairs.T)
    shares = np.zeros((robot.n_joints, len(pairs)))
    variables, ratios, _ = followed(robot)
    shares[variables[movers], np.arange(len(pairs))] = ratios[movers]
    starts, ends = ends_of(len(fingers))
    signs = (moved == starts[:, None]).astype(float) - (moved == ends[:, None])
    tables = {name: getattr(table, name) for name in _JOINTS}
    kernel = grasping.preshape.bind(
        {"m": robot.n_joints, "s": len(starts)},
        **tables, tips=own, centres=at_home, moved=moved, movers=movers, shares=shares,
        starts=starts, ends=ends, signs=signs,
        low=np.ascontiguousarray(limits[:, 0]), high=np.ascontiguousarray(limits[:, 1]),
    )  # fmt: skip
    return kernel
