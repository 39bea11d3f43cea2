"""The tables of a robot that the kernels of `generated.robots` loop over.

Each joint has a frame in its link, with the origin on the joint's axis. The tables store these frames relative to each
other. So their values do not depend on the distance of the robot from the origin, except for the positions of joints
that the base carries. A floating base is joint 0, whose row has a screw and a ratio of 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from generated import pga3

from .constants import Constants, Floats
from .denavit_hartenberg import Joint
from .errors import FloatingBaseError, MissingInertiaError

Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Joints:
    """Data of joints, one row each; see `gacompiler.specs.robots`.

    Attributes
    ----------
    parents, variables, coordinates : array of int, (N,)
    ratios, offsets : array, (N,)
    places : array, (N, 3)
    screws : array, (N, 6)
    turns : array, (N,)
    """

    parents: Indices
    variables: Indices
    coordinates: Indices
    ratios: Floats
    offsets: Floats
    places: Floats
    screws: Floats
    turns: Floats

    @property
    def rows(self) -> tuple[NDArray[np.generic], ...]:
        """All columns except the parents, in the order of the kernels' parameters."""
        return self.variables, self.coordinates, self.ratios, self.offsets, self.places, self.screws, self.turns

    @property
    def relative_to_first(self) -> Joints:
        """The same joints with the base moved to the first joint, for results independent of the base's position."""
        roots, places = self.parents < 0, self.places.copy()
        places[roots] -= places[0]
        return replace(self, places=places)

    def along(self, path: Sequence[int]) -> Joints:
        """Return the joints of a path from the base, each of which carries the next."""
        return Joints(np.arange(-1, len(path) - 1), *(np.ascontiguousarray(row[list(path)]) for row in self.rows))


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Pairs of a joint and itself or one of its ancestors: the entries of matrices over the variables.

    Attributes
    ----------
    lower, upper : array of int, (P,)
        A joint, and the same joint or one of its ancestors.
    lower_coordinates, upper_coordinates : array of int, (P,)
    is_strict : array, (P,)
        1 where the joints differ, otherwise 0.
    """

    lower: Indices
    upper: Indices
    lower_coordinates: Indices
    upper_coordinates: Indices
    is_strict: Floats


def origins_of(model: Constants) -> Floats:
    """Return the origins (N, 3) of the joints' frames in the base frame, at the zero configuration.

    Each is the point of the joint's axis that is nearest to the origin of the parent. For joints that the base carries,
    it is the point nearest to the frame after joint `tip`, which is close to the robot wherever the robot is mounted.
    """
    found = list[tuple[float, float, float]]()
    reference = pga3.motor_to_matrix(model.home[model.tip])[:3, 3].tolist()
    for row, parent in zip(model.axes.tolist(), model.parents, strict=True):
        # The order of summation must be the same on every machine, which BLAS does not guarantee.
        e12, e13, e23, u, v, w = map(float, row)
        x, y, z = e23, -e13, e12
        before = found[parent] if parent >= 0 else reference
        along = x * before[0] + y * before[1] + z * before[2]
        found.append((y * w - z * v + along * x, z * u - x * w + along * y, x * v - y * u + along * z))
    return np.array(found)


def joints_of(model: Constants) -> Joints:
    """Return the table of all joints."""
    origins = origins_of(model)
    places, screws = origins.copy(), np.zeros((len(model.kinds), 6))
    for joint, (axis, parent) in enumerate(zip(model.axes, model.parents, strict=True)):
        if parent >= 0:
            places[joint] -= origins[parent]
        if model.kinds[joint] is Joint.REVOLUTE:
            screws[joint, :3] = axis[:3]
        elif model.kinds[joint] is Joint.PRISMATIC:
            screws[joint, 3:] = axis[2], -axis[1], axis[0]
    turns = np.array([float(kind is Joint.REVOLUTE) for kind in model.kinds])
    coordinates, ratios, offsets = followed(model)
    variables = coordinates + (model.n_positions - model.n_joints)
    return Joints(np.array(model.parents, np.int64), variables, coordinates, ratios, offsets, places, screws, turns)


def followed(model: Constants) -> tuple[Indices, Floats, Floats]:
    """Return the coordinate that each joint follows, the ratio, and the offset; 0 for a floating base."""
    count = len(model.kinds)
    if not model.coupling.size:
        first = model.n_joints - count
        coordinates, ratios = np.arange(first, first + count), np.ones(count)
        if is_floating(model):
            coordinates[0], ratios[0] = 0, 0
        return coordinates, ratios, np.zeros(count)
    ratios = model.coupling[:, :-1]
    coordinates = np.abs(ratios).argmax(axis=1)
    return coordinates, np.ascontiguousarray(ratios[np.arange(count), coordinates]), model.coupling[:, -1].copy()


def leaders_of(model: Constants) -> tuple[int, ...]:
    """Return the leaders of a model if they equal its variables, otherwise the first joints that do or are moved."""
    coordinates, ratios, offsets = followed(model)
    given = model.leaders if len(model.leaders) == model.n_joints else ()
    found = [0] * model.n_joints
    for coordinate in range(FREEDOMS if is_floating(model) else 0, model.n_joints):
        own = coordinates == coordinate
        same = own & (ratios == 1) & (offsets == 0)
        first = int((same if same.any() else own).argmax())
        found[coordinate] = given[coordinate] if given and given[coordinate] in np.flatnonzero(same) else first
    return tuple(found)


FREEDOMS = 6
"""The number of rates of a floating base."""
MOTOR = 8
"""The number of its variables."""


def is_floating(model: Constants) -> bool:
    """Return whether joint 0 is a floating base."""
    return model.kinds[0] is Joint.FLOATING


def need_fixed_base(model: Constants, method: str) -> None:
    """Raise a FloatingBaseError if the base of a robot floats."""
    if is_floating(model):
        raise FloatingBaseError(f"{model.name}: {method}: the base floats; expected a robot whose base is fixed")


@dataclass(frozen=True, slots=True, eq=False)
class Base:
    """The tables of a floating base; without rows if the base is fixed.

    Attributes
    ----------
    base : array of int, (c, 8)
        The numbers of its motor in `q`; c is 1 or 0.
    freedoms : array of int, (c, 6)
        The places of its rates in `qd`.
    trunk : array of int, (c,)
        Its joint.
    units : array, (e, 6)
        Its twists at unit rates, in its frame; e is 6 or 0.
    unit_freedoms : array of int, (e,)
    own_freedoms : array of int, (e, 6)
        All freedoms, for each of them.
    moved, moved_coordinates : array of int, (f,)
        The joints that it carries, and their coordinates.
    moved_freedoms : array of int, (f, 6)
        The freedoms of the base, for each of them.
    """

    base: Indices
    freedoms: Indices
    trunk: Indices
    units: Floats
    unit_freedoms: Indices
    own_freedoms: Indices
    moved: Indices
    moved_coordinates: Indices
    moved_freedoms: Indices


def base_of(model: Constants) -> Base:
    """Return the tables of the base."""
    count = int(is_floating(model))
    moved = np.arange(1, len(model.kinds))[: count * len(model.kinds)]
    freedoms = np.arange(FREEDOMS)
    units = pga3.twist_from_velocities(np.eye(FREEDOMS)[:, :3], np.eye(FREEDOMS)[:, 3:])
    return Base(
        base=np.tile(np.arange(MOTOR), (count, 1)),
        freedoms=np.tile(freedoms, (count, 1)),
        trunk=np.zeros(count, np.int64),
        units=units[: count * FREEDOMS],
        unit_freedoms=freedoms[: count * FREEDOMS],
        own_freedoms=np.tile(freedoms, (count * FREEDOMS, 1)),
        moved=moved,
        moved_coordinates=followed(model)[0][moved],
        moved_freedoms=np.tile(freedoms, (len(moved), 1)),
    )


def armature_of(model: Constants) -> Floats:
    """Return the rotor inertias (N,), with 1 for a floating base, whose row does not move and may not be singular."""
    found = np.array(model.armature)
    if is_floating(model):
        found[0] = 1
    return found


def divided(ratios: Floats) -> Floats:
    """Return the inverses of ratios, but 0 for 0."""
    return np.divide(1, ratios, out=np.zeros_like(ratios), where=ratios != 0)


def without_base(model: Constants) -> range:
    """Return the joints that have one variable each."""
    return range(int(is_floating(model)), len(model.kinds))


def homes_of(model: Constants) -> tuple[Floats, Floats]:
    """Return rotors (N, 4) and positions (N, 3) of the links' frames, relative to the frames of the joints."""
    rotors, places = pga3.motor_to_rotor_translation(model.home)
    return rotors, places - origins_of(model)


def carried_by(model: Constants, joint: int, motor: Floats) -> Floats:
    """Return the motor relative to the frame of a joint of a frame with the given motor at home."""
    rotor, place = pga3.motor_to_rotor_translation(motor)
    return pga3.motor_from_rotor_translation(rotor, place - origins_of(model)[joint])


def inertias_of(model: Constants) -> Floats:
    """Return the inertias (N, 10) about the origins of the joints' frames, or raise a MissingInertiaError."""
    need_inertia(model)
    bodies = model.bodies.copy()
    bodies[:, 1:4] -= origins_of(model)
    return pga3.inertia_of_moved_body(np.eye(8)[0], bodies)


def need_inertia(model: Constants) -> None:
    """Raise a MissingInertiaError if the inertia of some moving link is unknown."""
    if model.without_inertia:
        links = ", ".join(model.without_inertia)
        raise MissingInertiaError(f"{model.name}: no inertia of {links}; expected one for every moving link")
    if not model.bodies.size:
        raise MissingInertiaError(f"{model.name}: unknown masses; expected bodies, one for each joint")


def path_to(model: Constants, joint: int) -> tuple[int, ...]:
    """Return the joints from the base to the given joint, inclusive."""
    found = []
    while joint >= 0:
        found.append(joint)
        joint = model.parents[joint]
    return tuple(reversed(found))


def pairs_of(model: Constants) -> Pairs:
    """Return all pairs of a joint and itself or one of its ancestors."""
    joints, floating = without_base(model), is_floating(model)
    pairs = [(joint, carrier) for joint in joints for carrier in path_to(model, joint)[floating:]]
    below, above = np.array(pairs, np.int64).reshape(-1, 2).T
    coordinates = followed(model)[0]
    return Pairs(below, above, coordinates[below], coordinates[above], (below != above).astype(float))


@dataclass(frozen=True, slots=True, eq=False)
class Pushes:
    """Pairs of a pushed joint with its ancestors, and with the joints that move in response.

    They are the loops of the kernel `inverse_mass_matrix`, which applies a unit force to each joint in turn.

    Attributes
    ----------
    below, carriers : array of int, (P,)
        For each pushed joint, in the order towards the base: the row of the previous pair, and the joint itself or an
        ancestor.
    is_own : array, (P,)
        1 where the carrier is the pushed joint itself, otherwise 0.
    before, joints, pairs : array of int, (R,)
        The row of the same pushed joint with the moved joint's parent, the moved joint, and the row over P.
    is_carrier : array, (R,)
        1 where the moved joint is the pushed joint or an ancestor of it, otherwise 0.
    factors : array, (R,)
    rows, columns, mirrored : array of int, (R,)
    at_base : array of int, (G,)
        For each joint on a floating base, the row over P of its pair with the base.
    moved_coordinates : array of int, (G,)
    moved_freedoms : array of int, (G, 6)
    moved_factors : array, (G,)
    first, second, first_rows, second_rows, first_mirrored : array of int, (S,)
        All pairs of these joints.
    """

    below: Indices
    carriers: Indices
    is_own: Floats
    before: Indices
    joints: Indices
    pairs: Indices
    is_carrier: Floats
    factors: Floats
    rows: Indices
    columns: Indices
    mirrored: Indices
    at_base: Indices
    moved_coordinates: Indices
    moved_freedoms: Indices
    moved_factors: Floats
    first: Indices
    second: Indices
    first_rows: Indices
    second_rows: Indices
    first_mirrored: Indices


def pushes_of(model: Constants) -> Pushes:
    """Return the pairs of each pushed joint with its ancestors, and with the joints of its tree up to its own index.

    No joint mimics another. The joints that a floating base carries are the roots of trees.
    """
    coordinates, _, _ = followed(model)
    pushable, root = without_base(model), int(is_floating(model))
    paths = {joint: path_to(model, joint) for joint in pushable}
    upwards = [(pushed, carrier) for pushed in pushable for carrier in reversed(paths[pushed])]
    place = {pair: row for row, pair in enumerate(upwards)}
    below = [-1 if pushed == carrier else row - 1 for row, (pushed, carrier) in enumerate(upwards)]
    moved = [
        (pushed, joint)
        for pushed in pushable
        for joint in pushable
        if joint <= pushed and paths[joint][root] == paths[pushed][root]
    ]
    after = {pair: row for row, pair in enumerate(moved)}
    pushed, joints = np.array(moved, np.int64).reshape(-1, 2).T
    columns = coordinates[pushed]
    carried = np.array([joint for joint in pushable if root], np.int64)
    first, second = np.array([(a, b) for a in range(len(carried)) for b in range(a + 1)], np.int64).reshape(-1, 2).T
    first_rows = coordinates[carried[first]]
    return Pushes(
        below=np.array(below, np.int64),
        carriers=np.array([carrier for _, carrier in upwards], np.int64),
        is_own=np.array([float(row < 0) for row in below]),
        before=np.array([after.get((push, model.parents[joint]), -1) for push, joint in moved], np.int64),
        joints=joints,
        pairs=np.array([place.get(pair, 0) for pair in moved], np.int64),
        is_carrier=np.array([float(pair in place) for pair in moved]),
        factors=np.ones(len(moved)),
        rows=coordinates[joints],
        columns=columns,
        mirrored=np.where(pushed == joints, -1, columns),
        at_base=np.array([place[joint, 0] for joint in carried], np.int64),
        moved_coordinates=coordinates[carried],
        moved_freedoms=np.tile(np.arange(FREEDOMS), (len(carried), 1)),
        moved_factors=np.ones(len(carried)),
        first=first,
        second=second,
        first_rows=first_rows,
        second_rows=coordinates[carried[second]],
        first_mirrored=np.where(first == second, -1, first_rows),
    )
