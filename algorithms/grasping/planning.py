"""Grasps of an object by a hand (section 20.4)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite, finite_number, real_array
from ..geometry.meshes import Integers, checked_mesh
from ..kinematics.collisions.obstacles import Obstacle
from .barrett import HandTable, hand_of_table
from .forces import ForceStatus, contact_forces
from .hand_poses import Body, Others, body_of, clear_poses, reaching
from .hands import Hand
from .meshes import Surface, surface_of
from .pairs import pairs
from .preshapes import LARGEST_ERROR
from .quality import grasp_quality
from .status import GraspStatus
from .triples import LEAST_QUALITY, Span, triples

_BLOCK = 10
"""Number of sets of contacts, triples or pairs, for which the hand is placed at a time."""
_BLOCKS = 20
"""Limit on work: the number of blocks after which the search ends."""
_GOOD, _FAIR = 0.85, 0.6
"""The search ends at a grasp whose quality is more than the first part of the bound of all further sets of contacts,
and at the end of a block if it is more than the second part."""
_POOR = 0.3
"""A second search begins if the best grasp has less than this part of the best bound."""
_MORE = 3
"""It also ends with so many grasps more than requested."""
_THINNEST = 0.002
"""The least thickness of an object, in metres."""
_DISPLACED = 24
"""Limit on work: the number of random displacements of the contacts of a grasp."""


@dataclass(frozen=True, slots=True, eq=False)
class Grasp:
    """A grasp of an object, or the reason why there is none."""

    contacts: Reals
    """(c, 3) Points of the surface, each of which a fingertip touches. NaN without a grasp."""
    normals: Reals
    """(c, 3) Outward unit normals of the faces at the contacts."""
    motor: Reals
    """(8,) The pose of the hand, a motor of `generated.pga3`; the identity without a grasp."""
    joints: Reals
    """(m,) The variables of the hand; zeros without a grasp. Those of a Barrett hand are the spread and three bends."""
    quality: float
    """The quality of `grasp_quality` about the centre of mass, with the largest distance of a vertex as length."""
    status: GraspStatus
    open_joints: Reals
    """(m,) The joints before the fingers close; zeros without a grasp."""
    fingers: Integers
    """(c,) The number of the fingertip at each contact. Other fingers are open."""
    largest: float = np.nan
    """The largest normal force of a finger that balances each of the loads of `plan_grasps`; NaN without loads."""


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
    displacement: float = 0.0,
    loads: ArrayLike | None = None,
) -> GraspPlan:
    """Plan grasps of an object, given as a closed mesh, by three fingertips of a hand, or by both of a gripper.

    Parameters
    ----------
    vertices : array_like, (n, 3)
        In metres.
    faces : array_like of int, (m, 3)
        The vertices of each triangle. All are oriented alike; if they point inwards, normals are reversed. There may
        be several solids that touch or overlap; contacts are then on the outside of all, and masses are added.
    style : {1, 2, 3}
        1: three contacts around a section through the centre of mass. 2: contacts whose friction cones contain the
        direction to the centre of mass. 3: a thumb opposite to two fingers. Without effect for hands with two fingers,
        which hold an object on opposite sides.
    hand : HandTable or Hand, optional
        The BH8-280 by default. `hand_from_urdf` returns others.
    friction : float
        The coefficient of friction.
    edges : int
        The number of edges of a friction cone.
    count : int
        The largest number of grasps.
    obstacles : sequence of Obstacle
        Bodies in the frame of the mesh that the hand must not touch, nor be inside, in the grasp, before it closes, and
        at the beginning of its approach, such as a table.
    margin : float
        The distance to keep from obstacles, in metres.
    displacement : float
        How far the contacts may be displaced on the surface, such as by an error of the object's pose, in metres. The
        quality of a grasp is then the least one of some random displacements of this size.
    loads : array_like, (k, 6), optional
        What is to act on the object: forces and torques about its centre of mass, in the frame of the mesh. Grasps that
        balance all of them are returned, those first whose fingers push least.

    Returns
    -------
    GraspPlan
        Grasps with the status OK have force closure, contacts on the surface, joints within limits, and fingertips at
        the contacts. The hand is clear of the object and of itself: in the grasp, while the fingers close, and while
        the open hand approaches in its direction, `Hand.approach`, from a distance of 8 cm.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong type or shape, a coordinate is not finite, a face refers to a missing vertex, or
        an option is out of its range.
    """
    model = any_hand(hand)
    wanted = Wanted.checked("plan_grasps", style, friction, edges, count, margin, displacement, loads)
    points, corners = checked_mesh(vertices, faces, "plan_grasps")
    surface = surface_of(points, corners)
    if isinstance(surface, GraspStatus):
        return GraspPlan((failed(surface, model),), model, friction)
    others = Others(surface.frame, tuple(obstacles), margin)
    found = planned(surface, body_of(surface), model, wanted, others)
    grasps = (failed(found, model),) if isinstance(found, GraspStatus) else found
    return GraspPlan(grasps, model, friction, points, corners)


def any_hand(hand: HandTable | Hand | None) -> Hand:
    """Return a hand, that of a table, or the default one."""
    return hand if isinstance(hand, Hand) else hand_of_table() if hand is None else hand_of_table(hand)


def failed(status: GraspStatus, hand: Hand) -> Grasp:
    """Return the reason why there is no grasp."""
    nowhere, rest = np.full((hand.contacts, 3), np.nan), np.zeros(len(hand.limits))
    fingers = hand.preshapes[0].fingers
    return Grasp(nowhere, nowhere.copy(), np.eye(8)[0], rest, 0.0, status, rest.copy(), fingers)


@dataclass(frozen=True, slots=True, eq=False)
class Wanted:
    """The options of `plan_grasps` that concern contacts and forces."""

    style: int
    friction: float
    edges: int
    count: int
    displacement: float
    loads: Reals

    @classmethod
    def checked(
        cls,
        name: str,
        style: int,
        friction: float,
        edges: int,
        count: int,
        margin: float,
        displacement: float = 0.0,
        loads: ArrayLike | None = None,
    ) -> Wanted:
        """Return options of a function that has a name, if they are in their ranges."""
        if isinstance(style, bool) or style not in (1, 2, 3):
            raise ValueError(f"{name}: style: {style!r}; expected 1, 2 or 3")
        if not finite_number(friction, f"{name}: friction") > 0:
            raise ValueError(f"{name}: friction: {friction}; expected a positive number")
        for option, value, least in (("edges", edges, 3), ("count", count, 1)):
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
                raise ValueError(f"{name}: {option}: {value!r}; expected an integer of at least {least}")
        for option, length in (("margin", margin), ("displacement", displacement)):
            if not finite_number(length, f"{name}: {option}") >= 0:
                raise ValueError(f"{name}: {option}: {length}; expected at least 0 metres")
        task = np.zeros((0, 6))
        if loads is not None:
            task = np.atleast_2d(finite(real_array(loads, "loads", (6,), "forces and torques as rows"), "loads"))
        return cls(style, friction, edges, count, float(displacement), task)


def planned(
    surface: Surface, body: Body, hand: Hand, wanted: Wanted, others: Others
) -> tuple[Grasp, ...] | GraspStatus:
    """Return grasps with contacts on a surface at which the hand is clear of a body, or why there is none."""
    if surface.extents.min() < _THINNEST:
        return GraspStatus.TOO_THIN
    radius = float(hand.tips.radii.min())
    span = Span(radius, 2 * radius, hand.opening)
    kept = others.touchable(surface, radius)
    if not kept.any():
        return GraspStatus.COLLISION
    whole, surface = surface, surface if kept.all() else surface.with_samples(kept)

    friction = float(np.tan(np.arctan(wanted.friction) - surface.errors[:, 1].min()))

    def contacts(span: Span, thorough: bool = False) -> tuple[Integers, Reals]:
        if hand.contacts == 2:
            return pairs(surface, friction, hand.torsion, span)
        return triples(surface, wanted.style, friction, span, thorough)

    rows, bounds = contacts(span)
    if not len(rows):
        return _cause_of_none(contacts, span)
    search = _Search(surface, hand, wanted, others, body)
    found, cause = search.grasps(rows, bounds)
    if hand.contacts > 2 and cause != GraspStatus.OUT_OF_REACH and _best(found) < _POOR * bounds.max():
        # The fingers collide at contacts that are close together; a triple far apart is better than a poor one.
        far = Span(span.radius, 2 * hand.tip_radius, hand.opening)
        more, _ = search.grasps(*contacts(far, True))
        found += more
    found.sort(key=lambda one: -one.quality)
    count = wanted.count
    if len(wanted.loads):
        loaded = [_loaded(surface, hand, wanted, one) for one in found]
        found = sorted((one for one in loaded if one.largest < np.inf), key=lambda one: one.largest)
    held = np.array([(one.contacts, one.normals) for one in found[:count]]).reshape(-1, 2, hand.contacts, 3)
    if not surface.is_outer(*np.swapaxes(held, 0, 1).reshape(2, -1, 3)).all():
        # Solids overlap: the search begins again with the samples of their common surface.
        return planned(whole.outside(), body, hand, wanted, others)
    return tuple(found[:count]) or cause


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """What a search for grasps among triples or pairs of contacts needs."""

    surface: Surface
    hand: Hand
    wanted: Wanted
    others: Others
    body: Body

    def grasps(self, rows: Integers, bounds: Reals) -> tuple[list[Grasp], GraspStatus]:
        """Return grasps at some of the contacts (t, c) with their bounds, and why there are not more."""
        surface, hand, count = self.surface, self.hand, self.wanted.count
        # The largest bound of the rows from each one on.
        ahead = np.append(np.maximum.accumulate(bounds[::-1])[::-1], 0.0)
        cause = GraspStatus.OUT_OF_REACH
        found: list[Grasp] = []
        for first in range(0, min(len(rows), _BLOCK * _BLOCKS), _BLOCK):
            poses = reaching(surface, hand, rows[first : first + _BLOCK])
            if len(poses.row):
                cause = max(cause, GraspStatus.COLLISION)
            limits = bounds[first : first + _BLOCK]
            for at, start in clear_poses(self.body, hand, poses, self.others, limits, lambda: _least(found, count)):
                cause = GraspStatus.NO_FORCE_CLOSURE
                pose = poses.samples[at], poses.fingers[at], poses.motors[at], poses.joints[at], start
                one = _verified(surface, hand, *pose, self.wanted)
                if one is not None:
                    found.append(one)
                if _is_enough(found, count, _GOOD * ahead[first + poses.row[at] + 1]):
                    break
            if _is_enough(found, count, _FAIR * ahead[min(first + _BLOCK, len(rows))]):
                break
        return found, cause


def _best(found: list[Grasp]) -> float:
    return max((one.quality for one in found), default=0.0)


def _cause_of_none(contacts: Callable[[Span], tuple[Integers, Reals]], span: Span) -> GraspStatus:
    """Return why there are no contacts within the span of the hand."""
    if len(contacts(Span(span.radius, span.least, np.inf))[0]):
        return GraspStatus.TOO_LARGE
    if len(contacts(Span(span.radius, 0.0, span.most))[0]):
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


def _verified(
    surface: Surface,
    hand: Hand,
    samples: Integers,
    fingers: Integers,
    motor: Reals,
    joints: Reals,
    start: Reals,
    wanted: Wanted,
) -> Grasp | None:
    """Return a grasp in the frame of the mesh if its fingertips touch the contacts and it has force closure."""
    contacts, normals = surface.points[samples], surface.normals[samples]
    tips = pga3.move_point(motor, hand.fingertips(joints)[fingers])
    if not np.abs(tips - contacts - hand.tips.radii[fingers, None] * normals).max() < 10 * LARGEST_ERROR:
        return None
    least = np.inf
    for at in (samples, *_displaced(surface, samples, wanted.displacement)):
        friction, error = surface.certain(at, wanted.friction)
        quality = grasp_quality(
            surface.points[at],
            surface.normals[at],
            friction,
            wanted.edges,
            length=surface.length,
            torsion=hand.torsion,
        )
        # A force of the cone, of at most this size, has another moment if its contact is displaced.
        least = min(least, quality - error * float(np.hypot(1, friction)) / surface.length)
        if not least > LEAST_QUALITY:
            return None
    return Grasp(
        pga3.move_point(surface.frame, contacts),
        pga3.move_direction(surface.frame, normals),
        pga3.motor_product(surface.frame, motor),
        joints,
        least,
        GraspStatus.OK,
        start,
        fingers,
    )


def _displaced(surface: Surface, samples: Integers, most: float) -> list[Integers]:
    """Return samples that are at most a distance from those of a grasp, the same in each process."""
    if most == 0:
        return []
    gaps = np.sqrt(np.square(surface.points - surface.points[samples, None]).sum(-1))
    near = [np.flatnonzero(gap <= most) for gap in gaps]
    rng = np.random.default_rng(22)
    return [np.array([rng.choice(one) for one in near]) for _ in range(_DISPLACED)]


def _loaded(surface: Surface, hand: Hand, wanted: Wanted, one: Grasp) -> Grasp:
    """Return a grasp with the force that balances each of the loads, infinite if some load cannot be balanced."""
    centre = pga3.move_point(surface.frame, np.zeros(3))
    largest = 0.0
    for load in wanted.loads:
        held = contact_forces(
            one.contacts, one.normals, load, wanted.friction, wanted.edges, centre, torsion=hand.torsion
        )
        largest = max(largest, held.largest if held.status == ForceStatus.OK else np.inf)
    return replace(one, largest=largest)
