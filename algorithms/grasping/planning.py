"""Grasps of an object by a hand with three fingers (section 20.4)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite_number
from ..geometry.meshes import Integers, checked_mesh
from ..kinematics.collisions.obstacles import Obstacle
from .hand_poses import REACHED, Body, Others, body_of, clear_poses, reaching
from .hands import Hand, HandTable, hand_of_table
from .meshes import Surface, surface_of
from .quality import grasp_quality
from .status import GraspStatus
from .triples import LEAST_QUALITY, Span, triangle_sides, triples

_BLOCK = 10
"""Number of triples for which the hand is placed at a time."""
_BLOCKS = 20
_GOOD, _FAIR = 0.85, 0.6
"""The search ends at a grasp whose quality is more than the first part of the bound of all further triples, and at the
end of a block if it is more than the second part."""
_POOR = 0.3
"""A second search begins if the best grasp has less than this part of the best bound."""
_MORE = 3
"""It also ends with so many grasps more than requested."""
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
        The vertices of each triangle. All are oriented alike; if they point inwards, normals are reversed. There may
        be several solids that touch or overlap; contacts are then on the outside of all, and masses are added.
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
    found = _planned(surface, model, style, friction, edges, count, Others(surface.frame, tuple(obstacles), margin))
    grasps = (_failed(found),) if isinstance(found, GraspStatus) else found
    return GraspPlan(grasps, model, friction, points, corners)


def _failed(status: GraspStatus) -> Grasp:
    nowhere = np.full((3, 3), np.nan)
    return Grasp(nowhere, nowhere.copy(), np.eye(8)[0], np.zeros(4), 0.0, status)


def _planned(
    surface: Surface, hand: Hand, style: int, friction: float, edges: int, count: int, others: Others
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
    search = _Search(surface, hand, friction, edges, count, others, body_of(surface))
    found, cause = search.grasps(rows, bounds)
    if cause != GraspStatus.OUT_OF_REACH and _best(found) < _POOR * bounds.max():
        # The fingers collide at contacts that are close together; a triple far apart is better than a poor one.
        far = Span(span.radius, 2 * hand.tip_radius, opening)
        more, _ = search.grasps(*triples(surface, style, friction, far, thorough=True))
        found += more
    found.sort(key=lambda one: -one.quality)
    contacts = np.array([(one.contacts, one.normals) for one in found[:count]]).reshape(-1, 2, 3, 3)
    if not surface.is_outer(*np.swapaxes(contacts, 0, 1).reshape(2, -1, 3)).all():
        # Solids overlap: the search begins again with the samples of their common surface.
        return _planned(surface.outside(), hand, style, friction, edges, count, others)
    return tuple(found[:count]) or cause


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """What a search for grasps among triples of contacts needs."""

    surface: Surface
    hand: Hand
    friction: float
    edges: int
    count: int
    others: Others
    body: Body

    def grasps(self, rows: Integers, bounds: Reals) -> tuple[list[Grasp], GraspStatus]:
        """Return grasps with some of the triples (t, 3) and their bounds, and why there are not more."""
        surface, hand, count = self.surface, self.hand, self.count
        centres = surface.points + hand.table.radius * surface.normals
        # The largest bound of the triples from each one on.
        ahead = np.append(np.maximum.accumulate(bounds[::-1])[::-1], 0.0)
        cause = GraspStatus.OUT_OF_REACH
        found: list[Grasp] = []
        for first in range(0, min(len(rows), _BLOCK * _BLOCKS), _BLOCK):
            poses = reaching(surface, hand, centres, rows[first : first + _BLOCK])
            if len(poses.triple):
                cause = max(cause, GraspStatus.COLLISION)
            limits = bounds[first : first + _BLOCK]
            for at, start in clear_poses(self.body, hand, poses, self.others, limits, lambda: _least(found, count)):
                cause = GraspStatus.NO_FORCE_CLOSURE
                pose = poses.samples[at], poses.motors[at], poses.joints[at], start
                one = _verified(surface, hand, *pose, self.friction, self.edges)
                if one is not None:
                    found.append(one)
                if _is_enough(found, count, _GOOD * ahead[first + poses.triple[at] + 1]):
                    break
            if _is_enough(found, count, _FAIR * ahead[min(first + _BLOCK, len(rows))]):
                break
        return found, cause


def _best(found: list[Grasp]) -> float:
    return max((one.quality for one in found), default=0.0)


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


def _is_enough(found: list[Grasp], count: int, quality: float) -> bool:
    """Return whether the search ends, with the quality at which the best grasp is good enough."""
    if len(found) < count:
        return False
    return len(found) >= count + _MORE or _best(found) > quality


def _opening(hand: Hand) -> float:
    """Return the largest distance of the first from the third fingertip."""
    bends = np.linspace(hand.limits[1, 0], hand.limits[1, 1], 64)
    joints = np.stack([0 * bends, bends, bends, bends], -1)
    return float(triangle_sides(hand.fingertips(joints)).max())


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
    if not np.abs(tips - contacts - hand.table.radius * normals).max() < 10 * REACHED:
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
