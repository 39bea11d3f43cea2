"""Grasps of an object by a hand with three fingers (section 20.4)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import permutations
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3, grasping, pga3

from ..arguments import Reals, finite_number
from .closing import APPROACH, OPENINGS, opened
from .clusters import Clusters, clusters_of
from .hands import Hand, HandTable, hand_of_table
from .meshes import Flags, Integers, Surface, checked_mesh, surface_of
from .obstacles import Obstacle
from .quality import grasp_quality
from .status import GraspStatus
from .triples import LEAST_QUALITY, Span, triples

_BLOCK = 10
"""Number of triples for which the hand is placed at a time."""
_BLOCKS = 20
_STARTS = np.array([[0.2, 0.8, 0.8, 0.8], [0.8, 1.1, 1.1, 1.1], [1.3, 0.6, 0.6, 0.6], [0.5, 1.5, 1.5, 1.5]])
"""Variables of the hand from which it is fitted to a triple."""
_ORDERS = np.array(list(permutations(range(3))))
_GOOD = 0.85
"""The search ends at a grasp whose quality is more than this part of the bound of all further triples."""
_MORE = 3
"""It also ends with so many grasps more than were asked for."""
_REACHED = 1e-7
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
_THINNEST = 0.002
"""The least thickness of an object, in metres."""


@dataclass(frozen=True, slots=True, eq=False)
class Grasp:
    """A grasp of an object, or the reason why there is none."""

    contacts: Reals
    """(3, 3) Points of the surface; row k is that of finger k + 1. NaN without a grasp."""
    normals: Reals
    """(3, 3) Outward unit normals of the faces at the contacts."""
    motor: Reals
    """(8,) The pose of the hand, a motor of `generated.pga3`; the identity without a grasp."""
    joints: Reals
    """(4,) The spread and the bend of each finger, in rad; zeros without a grasp."""
    quality: float
    """The quality of `grasp_quality` about the centre of mass, with the largest distance of a vertex as length."""
    status: GraspStatus
    open_joints: Reals = field(default_factory=lambda: np.zeros(4))
    """(4,) The joints before the fingers close: the same spread, and smaller bends."""


@dataclass(frozen=True, slots=True, eq=False)
class GraspPlan(Sequence[Grasp]):
    """Grasps, the best first. Without a grasp, it has one element, whose status names the cause."""

    grasps: tuple[Grasp, ...]
    hand: Hand
    friction: float
    vertices: Reals = field(default_factory=lambda: np.zeros((0, 3)))
    """(n, 3) The mesh for which it was planned, (n, 3) and (m, 3); empty if the mesh is not valid."""
    faces: Integers = field(default_factory=lambda: np.zeros((0, 3), np.intp))

    @property
    def status(self) -> GraspStatus:
        """The status of the first grasp."""
        return self.grasps[0].status

    def __len__(self) -> int:
        return len(self.grasps)

    @overload
    def __getitem__(self, at: int) -> Grasp: ...
    @overload
    def __getitem__(self, at: slice) -> tuple[Grasp, ...]: ...
    def __getitem__(self, at: int | slice) -> Grasp | tuple[Grasp, ...]:
        return self.grasps[at]

    def __iter__(self) -> Iterator[Grasp]:
        return iter(self.grasps)


def plan_grasps(
    vertices: ArrayLike,
    faces: ArrayLike,
    style: int = 1,
    *,
    hand: HandTable | Hand | None = None,
    friction: float = 0.5,
    edges: int = 8,
    count: int = 2,
    obstacles: Sequence[Obstacle] = (),
    margin: float = 0.003,
) -> GraspPlan:
    """Plan grasps of an object, given as a closed mesh, by a hand with three fingers.

    Parameters
    ----------
    vertices : array_like, (n, 3)
        In metres.
    faces : array_like of int, (m, 3)
        The vertices of each triangle. All are oriented alike; if they point inwards, normals are reversed.
    style : {1, 2, 3}
        1: three contacts around a section through the centre of mass. 2: contacts whose friction cones contain the
        direction to the centre of mass. 3: a thumb opposite to two fingers.
    hand : HandTable or Hand, optional
        The BH8-280 by default.
    friction : float
        The coefficient of friction.
    edges : int
        The number of edges of a friction cone.
    count : int
        The largest number of grasps.
    obstacles : sequence of Obstacle
        Bodies in the frame of the mesh that the hand must not touch in the grasp, before it closes, and at the
        beginning of its approach, such as a table.
    margin : float
        The distance to keep from obstacles, in metres.

    Returns
    -------
    GraspPlan
        Grasps with the status OK have force closure, contacts on the surface, joints within limits, and fingertips at
        the contacts. The hand is clear of the object and of itself: in the grasp, while the fingers close, and while
        the open hand approaches along its axis z from a distance of 8 cm.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong type or shape, a coordinate is not finite, a face refers to a missing vertex, or
        an option is out of its range.
    """
    model = hand if isinstance(hand, Hand) else hand_of_table() if hand is None else hand_of_table(hand)
    if isinstance(style, bool) or style not in (1, 2, 3):
        raise ValueError(f"plan_grasps: style: {style!r}; expected 1, 2 or 3")
    if not finite_number(friction, "plan_grasps: friction") > 0:
        raise ValueError(f"plan_grasps: friction: {friction}; expected a positive number")
    for name, value, least in (("edges", edges, 3), ("count", count, 1)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
            raise ValueError(f"plan_grasps: {name}: {value!r}; expected an integer of at least {least}")
    if not finite_number(margin, "plan_grasps: margin") >= 0:
        raise ValueError(f"plan_grasps: margin: {margin}; expected at least 0 metres")
    points, corners = checked_mesh(vertices, faces, "plan_grasps")
    surface = surface_of(points, corners)
    if isinstance(surface, GraspStatus):
        return GraspPlan((_failed(surface),), model, friction)
    found = _planned(surface, model, style, friction, edges, count, _Others(surface.frame, tuple(obstacles), margin))
    grasps = (_failed(found),) if isinstance(found, GraspStatus) else found
    return GraspPlan(grasps, model, friction, points, corners)


def _failed(status: GraspStatus) -> Grasp:
    nowhere = np.full((3, 3), np.nan)
    return Grasp(nowhere, nowhere.copy(), np.eye(8)[0], np.zeros(4), 0.0, status)


def _planned(
    surface: Surface, hand: Hand, style: int, friction: float, edges: int, count: int, others: _Others
) -> tuple[Grasp, ...] | GraspStatus:
    if surface.extents.min() < _THINNEST:
        return GraspStatus.TOO_THIN
    opening = _opening(hand)
    if surface.extents.min() + 2 * hand.table.radius > opening:
        return GraspStatus.TOO_LARGE
    span = Span(hand.table.radius, 2 * hand.table.radius, opening)
    rows, bounds = triples(surface, style, friction, span)
    if not len(rows):
        return _cause_of_none(surface, style, friction, span)
    centres = surface.points + hand.table.radius * surface.normals
    # For each triple, the largest bound of those from there on.
    ahead = np.maximum.accumulate(bounds[::-1])[::-1]
    cause = GraspStatus.OUT_OF_REACH
    found: list[Grasp] = []
    body = _body(surface)
    for first in range(0, min(len(rows), _BLOCK * _BLOCKS), _BLOCK):
        poses = _reaching(surface, hand, centres, rows[first : first + _BLOCK])
        if len(poses.triple):
            cause = max(cause, GraspStatus.COLLISION)
        for at, start in _clear_poses(
            body, hand, poses, others, lambda row: bounds[first + row] > _least(found, count)
        ):
            cause = GraspStatus.NO_FORCE_CLOSURE
            pose = poses.samples[at], poses.motors[at], poses.joints[at], start
            one = _verified(surface, hand, *pose, friction, edges)
            if one is not None:
                found.append(one)
            if _is_enough(found, count, ahead[first + poses.triple[at]]):
                break
        if _is_enough(found, count, ahead[min(first + _BLOCK, len(ahead) - 1)]):
            break
    found.sort(key=lambda one: -one.quality)
    return tuple(found[:count]) or cause


def _cause_of_none(surface: Surface, style: int, friction: float, span: Span) -> GraspStatus:
    """Return why there are no triples within the span of the hand."""
    if len(triples(surface, style, friction, Span(span.radius, span.least, np.inf))[0]):
        return GraspStatus.TOO_LARGE
    if len(triples(surface, style, friction, Span(span.radius, 0.0, span.most))[0]):
        return GraspStatus.TOO_THIN
    return GraspStatus.NO_CONTACTS


def _least(found: list[Grasp], count: int) -> float:
    """Return the quality above which a grasp is one of the best."""
    return sorted(one.quality for one in found)[-count] if len(found) >= count else 0.0


def _is_enough(found: list[Grasp], count: int, bound: float) -> bool:
    """Return whether the search ends, with a bound of the qualities of the remaining triples."""
    if len(found) < count:
        return False
    best = max(one.quality for one in found)
    return len(found) >= count + _MORE or best > _GOOD * bound


@dataclass(frozen=True, slots=True, eq=False)
class _Others:
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


def _opening(hand: Hand) -> float:
    """Return the largest distance of the first from the third fingertip."""
    bends = np.linspace(hand.limits[1, 0], hand.limits[1, 1], 64)
    joints = np.stack([0 * bends, bends, bends, bends], -1)
    return float(_sides(hand.fingertips(joints)).max())


def _sides(points: Reals) -> Reals:
    gaps = points - np.roll(points, -1, -2)
    return np.sqrt(np.square(gaps).sum(-1))  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True, eq=False)
class _Poses:
    """Poses of the hand with the fingertips at contacts."""

    triple: Integers
    """(n,) The row of the triple of each pose, in order."""
    samples: Integers
    """(n, 3) The samples of the fingers."""
    motors: Reals
    joints: Reals

    def capsules(self, hand: Hand, which: Integers) -> Reals:
        """Return the ends (n, k, 2, 3) of all capsules of the hand in some of the poses."""
        return pga3.move_point(  # type: ignore[no-any-return]
            self.motors[which, None, None, :], hand.placed_capsules(self.joints[which])
        )


def _reaching(surface: Surface, hand: Hand, centres: Reals, rows: Integers) -> _Poses:
    """Return the poses of the hand, in all orders of the fingers, that reach triples of samples."""
    orders = rows[:, _ORDERS]
    start = np.broadcast_to(_STARTS, (*orders.shape[:2], *_STARTS.shape))
    sides = _sides(centres[orders])[:, :, None]
    joints, errors = hand.preshaped(start, sides)
    triple, order, seed = np.nonzero(errors < _REACHED)
    joints, samples = joints[triple, order, seed], orders[triple, order]
    motors = _aligned(hand.fingertips(joints), centres[samples])
    return _Poses(triple, samples, motors, joints)


@dataclass(frozen=True, slots=True, eq=False)
class _Body:
    """Points of an object with which the hand must not collide."""

    coarse: Reals
    swept: Clusters
    outline: Clusters


def _body(surface: Surface) -> _Body:
    swept = clusters_of(surface.points[::_SWEPT], _CLUSTER // 2)
    return _Body(np.ascontiguousarray(surface.points[::_STRIDE]), swept, clusters_of(surface.outline, _CLUSTER))


def _clear_poses(
    body: _Body, hand: Hand, poses: _Poses, others: _Others, worth: Callable[[int], bool]
) -> Iterator[tuple[int, Reals]]:
    """Generate for each triple the first pose that the hand reaches without collisions, and the joints before that.

    Triples that are not worth it when their turn comes are left out.
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
        if not worth(int(triple)):
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


def _opening_of(swept: Clusters, hand: Hand, motor: Reals, joints: Reals, others: _Others) -> Reals | None:
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
    return pga3.motor_product(goal, pga3.motor_inverse(own))  # type: ignore[no-any-return]


def _verified(
    surface: Surface,
    hand: Hand,
    samples: Integers,
    motor: Reals,
    joints: Reals,
    start: Reals,
    friction: float,
    edges: int,
) -> Grasp | None:
    """Return a grasp in the frame of the mesh if its fingertips touch the contacts and it has force closure."""
    contacts, normals = surface.points[samples], surface.normals[samples]
    tips = pga3.move_point(motor, hand.fingertips(joints))
    if not np.abs(tips - contacts - hand.table.radius * normals).max() < 10 * _REACHED:
        return None
    quality = grasp_quality(contacts, normals, friction, edges, length=surface.length)
    if not quality > LEAST_QUALITY:
        return None
    return Grasp(
        pga3.move_point(surface.frame, contacts),
        pga3.move_direction(surface.frame, normals),
        pga3.motor_product(surface.frame, motor),
        joints,
        quality,
        GraspStatus.OK,
        start,
    )
