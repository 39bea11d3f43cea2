"""Poses of a hand with its fingertips at contacts, and which of them are clear while the hand moves there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from generated import cga3, grasping, pga3

from ..arguments import Reals
from ..geometry.meshes import Flags, Integers
from ..kinematics.collisions.obstacles import Obstacle
from .closing import APPROACH, OPENINGS, closing_speeds, opened
from .clusters import Clusters, clusters_of
from .hands import Hand
from .meshes import Surface
from .preshapes import LARGEST_ERROR, sides_of

_TURNS = np.pi / 8 * np.arange(16)
"""Angles about the line through two fingertips at which the hand is placed."""
_TOUCH = 0.0015
"""How far the hand may intersect the object in a grasp, in metres: its skin yields."""
_BETWEEN = 0.0005
"""Limit on work: how far it may intersect the object more than that while it moves."""
_STRIDE = 64
"""Poses are tested with one of so many samples first; those that pass, with more of them, and with all faces."""
_TRIES = 4
"""The largest number of poses of a row that are tested with more samples."""
_SWEPT = 8
"""Poses are tested with one of so many samples before they are with all faces."""
_CLUSTER = 16
"""Number of neighbouring samples or faces that are tested together."""
_SHARES = np.array([0.0, 0.2, 0.4, 0.6, 0.8])
"""Parts of the closing motion at which the fingers are tested against each other."""


@dataclass(frozen=True, slots=True, eq=False)
class Others:
    """Obstacles of the hand other than the object."""

    frame: Reals
    """(8,) The motor from the frame of the surface to that of the obstacles."""
    obstacles: tuple[Obstacle, ...]
    margin: float

    def clear(self, ends: Reals, radii: Reals) -> Flags:
        """Return whether hands, (n, k, 2, 3), are outside and clear of the obstacles, (n,)."""
        found = np.arange(len(ends))
        if self.obstacles and len(ends):
            placed = pga3.move_point(self.frame, ends)
            for one in self.obstacles:
                found = found[(one.clearance(placed[found], radii) > self.margin).all(-1)]
                # A capsule that does not meet the surface is inside if a point of it is.
                points = placed[found, :, 0]
                found = found[~one.contains(points.reshape(-1, 3)).reshape(points.shape[:2]).any(-1)]
        return np.isin(np.arange(len(ends)), found)

    def touchable(self, surface: Surface, radius: float) -> Flags:
        """Return whether a fingertip at each sample (n,) is clear of the obstacles."""
        centres = surface.points + radius * surface.normals
        return self.clear(np.repeat(centres[:, None, None], 2, 2), np.array([radius]))


@dataclass(frozen=True, slots=True, eq=False)
class HandPoses:
    """Poses of the hand with the fingertips at contacts."""

    row: Integers
    """(n,) The row of the contacts of each pose, in order."""
    samples: Integers
    """(n, c) The samples of the fingers,"""
    fingers: Integers
    """(n, c) and their numbers."""
    motors: Reals
    joints: Reals

    def capsules(self, hand: Hand, which: Integers) -> Reals:
        """Return the ends (n, k, 2, 3) of all capsules of the hand in some of the poses."""
        return pga3.move_point(self.motors[which, None, None, :], hand.placed_capsules(self.joints[which]))


def reaching(surface: Surface, hand: Hand, rows: Integers) -> HandPoses:
    """Return the poses of the hand, with all choices and orders of the fingers, that reach contacts (t, c)."""
    orders = rows[:, list(permutations(range(rows.shape[1])))]
    points, normals = surface.points[orders], surface.normals[orders]
    found: list[tuple[Reals, ...]] = []
    for shape in hand.preshapes:
        targets = points + hand.tips.radii[shape.fingers][:, None] * normals
        joints, errors = shape.reached(sides_of(targets))
        row, order, start = np.nonzero(errors < LARGEST_ERROR)
        joints = joints[row, order, start]
        tips = hand.fingertips(joints)[:, shape.fingers]
        motors = _aligned(tips, targets[row, order], hand.approach)
        turns = motors.shape[1]
        chosen = np.tile(shape.fingers, (len(row) * turns, 1))
        each = row, orders[row, order], joints
        found.append((*(np.repeat(one, turns, 0) for one in each), chosen, motors.reshape(-1, 8)))
    row, samples, joints, fingers, motors = (np.concatenate(parts) for parts in zip(*found, strict=True))
    sorted_ = np.argsort(row, kind="stable")
    return HandPoses(*(one[sorted_] for one in (row, samples, fingers, motors, joints)))


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """What the hand must not collide with: some points of an object, more of them, and all of its surface."""

    coarse: Reals
    sampled: Clusters
    surface: Clusters


def body_of(surface: Surface) -> Body:
    """Return the samples and the faces of a surface with which poses are tested."""
    sampled = clusters_of(surface.points[::_SWEPT], _CLUSTER)
    triangles = pga3.move_point_back(surface.frame, surface.vertices)[surface.faces]
    return Body(np.ascontiguousarray(surface.points[::_STRIDE]), sampled, clusters_of(triangles, _CLUSTER))


def clear_poses(
    body: Body, hand: Hand, poses: HandPoses, others: Others, bounds: Reals, least: Callable[[], float]
) -> Iterator[tuple[int, Reals]]:
    """Generate for each row the first pose that the hand reaches without collisions, and the joints before that.

    Rows whose bounds are not more than the least one at their turn are left out.
    """
    ends, radii = hand.placed_capsules(poses.joints, hand.first), hand.radii[hand.first]
    ends = pga3.move_point(poses.motors[:, None, None, :], ends)
    clear = _clearance(body.coarse, ends, radii)
    kept = np.flatnonzero(clear > -_TOUCH)
    if others.obstacles:
        kept = kept[others.clear(poses.capsules(hand, kept), hand.radii)]
    kept = kept[np.lexsort((-np.round(clear[kept], 9), poses.row[kept]))]
    # Of each row, the poses with the largest clearances.
    starts = np.searchsorted(poses.row[kept], poses.row[kept])
    kept = kept[np.arange(len(kept)) - starts < _TRIES]
    kept = kept[body.sampled.clear_of(ends[kept], radii, -_TOUCH)]
    for row in np.unique(poses.row[kept]):
        if not bounds[row] > least():
            continue
        own = kept[poses.row[kept] == row]
        placed = poses.capsules(hand, own)
        for at in np.flatnonzero(body.sampled.clear_of(placed, hand.radii, -_TOUCH)):
            if body.surface.clear_of(placed[at : at + 1], hand.radii, -_TOUCH)[0]:
                pose = own[at]
                by = _opening_of(body, hand, poses.motors[pose], poses.joints[pose], others)
                if by is not None:
                    yield int(pose), by
                    break


def _opening_of(body: Body, hand: Hand, motor: Reals, joints: Reals, others: Others) -> Reals | None:
    """Return joints from which the fingers close without collisions after a straight approach; None if there are none.

    The smallest opening comes first.
    """
    if not (hand.own_clearances(hand.placed_capsules(joints)) > 0).all():
        return None
    for by in OPENINGS:
        start = opened(hand, joints, by)
        if not (hand.own_clearances(hand.placed_capsules(start + _SHARES[:, None] * (joints - start))) > 0).all():
            continue
        away = hand.placed_capsules(start) - APPROACH * hand.approach
        ends = pga3.move_point(motor, np.stack([hand.placed_capsules(start), away]))
        if not others.clear(ends, hand.radii).all():
            continue

        def closing(shares: Reals, start: Reals = start) -> Reals:
            return np.asarray(pga3.move_point(motor, hand.placed_capsules(start + shares * (joints - start))))

        def arriving(shares: Reals, ends: Reals = ends) -> Reals:
            return np.asarray(ends[1] + shares[:, None, None] * (ends[0] - ends[1]))

        moves = closing_speeds(hand) @ np.abs(joints - start)
        if _is_clear(body, hand, closing, moves) and _is_clear(body, hand, arriving, np.full(len(moves), APPROACH)):
            return start
    return None


def _is_clear(body: Body, hand: Hand, motion: Callable[[Reals], Reals], moves: Reals) -> bool:
    """Return whether a hand is clear of a body during a motion.

    Parameters
    ----------
    motion : callable
        The capsules (m, k, 2, 3) at parts (m, 1) of the motion, from 0 to 1.
    moves : array, (k,)
        Bounds of how far the motion displaces each capsule.

    Notes
    -----
    A capsule that is wider by half of its displacement contains it at all moments of a part of the motion, if it is
    placed at the middle of the part. Parts in which wider capsules are not clear are halved.
    """
    middles, half = np.array([[0.5]]), 0.5
    while True:
        ends, wider = motion(middles), half * moves
        open_ = ~body.surface.clear_of(ends, hand.radii + wider, -_TOUCH - _BETWEEN)
        middles = middles[open_]
        if not len(middles):
            return True
        if wider.max() < _BETWEEN or not body.sampled.clear_of(ends[open_], hand.radii, -_TOUCH).all():
            return False
        half /= 2
        middles = np.concatenate([middles - half, middles + half])


def _clearance(points: Reals, ends: Reals, radii: Reals) -> Reals:
    each = grasping.capsule_clearance(points, ends[..., 0, :], ends[..., 1, :], radii)
    return each.min(-1)  # type: ignore[no-any-return]


def _frames(points: Reals, aside: Reals) -> Reals:
    """Return poses (..., 4, 4) of two points, with an axis near a direction, or of the circles through three points."""
    a, b = points[..., 0, :], points[..., 1, :]
    poses = np.zeros((*a.shape[:-1], 4, 4))
    if points.shape[-2] == 2:
        centre, first = (a + b) / 2, b - a
        normal = np.cross(first, np.cross(aside, first))
    else:
        circles = cga3.circle_from_points(a, b, points[..., 2, :])
        centre, normal = cga3.circle_centre(circles), cga3.circle_normal(circles)
        first = a - centre
    first, normal = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (first, normal))
    poses[..., :3, 0], poses[..., :3, 1], poses[..., :3, 2] = first, np.cross(normal, first), normal
    poses[..., :3, 3], poses[..., 3, 3] = centre, 1
    return poses


def _aligned(tips: Reals, targets: Reals, approach: Reals) -> Reals:
    """Return the motors (n, k, 8) that take fingertips (n, c, 3) to the targets, one for three of them.

    Two fingertips leave a rotation about the line through them free: there is one motor for each angle.
    """
    if tips.shape[-2] == 3:
        own, goal = (pga3.motor_from_matrix(_frames(points, approach)) for points in (tips, targets))
        return pga3.motor_product(goal, pga3.motor_inverse(own))[:, None]
    # Of the axes of the object, the one that is most across the line.
    along = targets[:, 1] - targets[:, 0]
    aside = np.eye(3)[np.abs(along).argmin(-1)]
    own, goal = (pga3.motor_from_matrix(_frames(*each)) for each in ((tips, approach), (targets, aside)))
    turns = pga3.motor_from_rotation_vector_translation(_TURNS[:, None] * [1.0, 0, 0], np.zeros((len(_TURNS), 3)))
    return pga3.motor_product(pga3.motor_product(goal[:, None], turns), pga3.motor_inverse(own)[:, None])
