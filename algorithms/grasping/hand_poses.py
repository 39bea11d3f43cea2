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
from .closing import APPROACH, OPENINGS, opened
from .clusters import Clusters, clusters_of
from .hands import Hand
from .meshes import Surface
from .triples import triangle_sides

_STARTS = np.array([[0.2, 0.8, 0.8, 0.8], [0.8, 1.1, 1.1, 1.1], [1.3, 0.6, 0.6, 0.6], [0.5, 1.5, 1.5, 1.5]])
"""Variables of the hand from which it is fitted to a triple."""
_ORDERS = np.array(list(permutations(range(3))))
REACHED = 1e-7
"""Largest error of a fingertip, in metres."""
_TOUCH = 0.0015
"""How far the hand may intersect the object, in metres: its skin yields, and samples are some millimetres apart."""
_STRIDE = 64
"""Poses are tested with one of so many samples first; those that pass, with more of them, and with the outline."""
_TRIES = 4
"""The largest number of poses of a triple that are tested with more samples."""
_SWEPT = 8
"""Motions of the hand, and poses at first, are tested with one of so many samples."""
_CLUSTER = 32
"""Number of neighbouring points that are tested together."""
_SHARES = np.array([0.0, 0.2, 0.4, 0.6, 0.8])
"""Parts of the closing motion at which it is tested."""
_BACKWARDS = APPROACH * np.array([0.1, 0.2, 0.4, 0.7, 1.0])
"""Distances from the grasp at which the approach is tested, in metres."""


@dataclass(frozen=True, slots=True, eq=False)
class Others:
    """Obstacles of the hand other than the object."""

    frame: Reals
    """(8,) The motor from the frame of the surface to that of the obstacles."""
    obstacles: tuple[Obstacle, ...]
    margin: float

    def clear(self, ends: Reals, radii: Reals) -> Flags:
        """Return whether hands, (n, k, 2, 3), are clear of the obstacles, (n,)."""
        found = np.ones(len(ends), bool)
        if self.obstacles and len(ends):
            placed = pga3.move_point(self.frame, ends)
            for one in self.obstacles:
                found &= (one.clearance(placed, radii) > self.margin).all(-1)
        return found


@dataclass(frozen=True, slots=True, eq=False)
class HandPoses:
    """Poses of the hand with the fingertips at contacts."""

    triple: Integers
    """(n,) The row of the triple of each pose, in order."""
    samples: Integers
    """(n, 3) The samples of the fingers."""
    motors: Reals
    joints: Reals

    def capsules(self, hand: Hand, which: Integers) -> Reals:
        """Return the ends (n, k, 2, 3) of all capsules of the hand in some of the poses."""
        return pga3.move_point(self.motors[which, None, None, :], hand.placed_capsules(self.joints[which]))


def reaching(surface: Surface, hand: Hand, centres: Reals, rows: Integers) -> HandPoses:
    """Return the poses of the hand, in all orders of the fingers, that reach triples of samples."""
    orders = rows[:, _ORDERS]
    start = np.broadcast_to(_STARTS, (*orders.shape[:2], *_STARTS.shape))
    sides = triangle_sides(centres[orders])[:, :, None]
    joints, errors = hand.preshaped(start, sides)
    triple, order, seed = np.nonzero(errors < REACHED)
    joints, samples = joints[triple, order, seed], orders[triple, order]
    motors = _aligned(hand.fingertips(joints), centres[samples])
    return HandPoses(triple, samples, motors, joints)


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Points of an object with which the hand must not collide."""

    coarse: Reals
    swept: Clusters
    outline: Clusters


def body_of(surface: Surface) -> Body:
    """Return the points of a surface with which poses are tested."""
    swept = clusters_of(surface.points[::_SWEPT], _CLUSTER // 2)
    return Body(np.ascontiguousarray(surface.points[::_STRIDE]), swept, clusters_of(surface.outline, _CLUSTER))


def clear_poses(
    body: Body, hand: Hand, poses: HandPoses, others: Others, bounds: Reals, least: Callable[[], float]
) -> Iterator[tuple[int, Reals]]:
    """Generate for each triple the first pose that the hand reaches without collisions, and the joints before that.

    Triples whose bounds, in the order of the triples, are not more than the least one at their turn are left out.
    """
    ends, radii = hand.placed_capsules(poses.joints, hand.first), hand.radii[hand.first]
    ends = pga3.move_point(poses.motors[:, None, None, :], ends)
    clear = _clearance(body.coarse, ends, radii)
    kept = np.flatnonzero(clear > -_TOUCH)
    if others.obstacles:
        kept = kept[others.clear(poses.capsules(hand, kept), hand.radii)]
    kept = kept[np.lexsort((-np.round(clear[kept], 9), poses.triple[kept]))]
    # Of each triple, the poses with the largest clearances.
    starts = np.searchsorted(poses.triple[kept], poses.triple[kept])
    kept = kept[np.arange(len(kept)) - starts < _TRIES]
    kept = kept[body.swept.clear_of(ends[kept], radii, -_TOUCH)]
    for triple in np.unique(poses.triple[kept]):
        if not bounds[triple] > least():
            continue
        own = kept[poses.triple[kept] == triple]
        placed = poses.capsules(hand, own)
        for at in np.flatnonzero(body.swept.clear_of(placed, hand.radii, -_TOUCH)):
            if body.outline.clear_of(placed[at : at + 1], hand.radii, -_TOUCH)[0]:
                pose = own[at]
                by = _opening_of(body.swept, hand, poses.motors[pose], poses.joints[pose], others)
                if by is not None:
                    yield int(pose), by
                    break


def _opening_of(swept: Clusters, hand: Hand, motor: Reals, joints: Reals, others: Others) -> Reals | None:
    """Return joints from which the fingers close without collisions after a straight approach; None if there are none.

    The smallest opening comes first.
    """
    if not (hand.own_clearances(hand.placed_capsules(joints)) > 0).all():
        return None
    for by in OPENINGS:
        start = opened(hand, joints, by)
        closing = hand.placed_capsules(start + _SHARES[:, None] * (joints - start))
        if not (hand.own_clearances(closing) > 0).all():
            continue
        approach = closing[0] - _BACKWARDS[:, None, None, None] * [0.0, 0.0, 1.0]
        ends = pga3.move_point(motor, np.concatenate([closing, approach]))
        free = swept.clear_of(ends, hand.radii, -_TOUCH).all()
        if free and others.clear(ends[[0, -1]], hand.radii).all():
            return start
    return None


def _clearance(points: Reals, ends: Reals, radii: Reals) -> Reals:
    each = grasping.capsule_clearance(points, ends[..., 0, :], ends[..., 1, :], radii)
    return each.min(-1)  # type: ignore[no-any-return]


def _frames(points: Reals) -> Reals:
    """Return poses (..., 4, 4) of the circles through three points: centre, direction of the first point, normal."""
    a, b, c = (points[..., k, :] for k in range(3))
    circles = cga3.circle_from_points(a, b, c)
    poses = np.zeros((*a.shape[:-1], 4, 4))
    centre, normal = cga3.circle_centre(circles), cga3.circle_normal(circles)
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    first = (a - centre) / np.linalg.norm(a - centre, axis=-1, keepdims=True)
    poses[..., :3, 0], poses[..., :3, 1], poses[..., :3, 2] = first, np.cross(normal, first), normal
    poses[..., :3, 3], poses[..., 3, 3] = centre, 1
    return poses


def _aligned(tips: Reals, targets: Reals) -> Reals:
    """Return the motors that take the circles of fingertips to those of the targets, tip by tip."""
    own, goal = pga3.motor_from_matrix(_frames(tips)), pga3.motor_from_matrix(_frames(targets))
    return pga3.motor_product(goal, pga3.motor_inverse(own))
