"""The tables of a robot that the kernels of `generated.robots` loop over.

Each joint has a frame in its link, with the origin on the joint's axis. The tables store these frames relative to each
other. So their values do not depend on the distance of the robot from the origin, except for the positions of joints
that the base carries.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from generated import pga3

from .constants import Constants, Floats
from .denavit_hartenberg import Joint
from .errors import MissingInertiaError

Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Joints:
    """Data of joints, one row each; see `gacompiler.specs.robots`.

    Attributes
    ----------
    parents, variables : array of int, (N,)
    ratios, offsets : array, (N,)
    places : array, (N, 3)
    screws : array, (N, 6)
    turns : array, (N,)
    """

    parents: Indices
    variables: Indices
    ratios: Floats
    offsets: Floats
    places: Floats
    screws: Floats
    turns: Floats

    @property
    def rows(self) -> tuple[NDArray[np.generic], ...]:
        """All columns except the parents, in the order of the kernels' parameters."""
        return self.variables, self.ratios, self.offsets, self.places, self.screws, self.turns

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
    lower_variables, upper_variables : array of int, (P,)
    is_strict : array, (P,)
        1 where the joints differ, otherwise 0.
    """

    lower: Indices
    upper: Indices
    lower_variables: Indices
    upper_variables: Indices
    is_strict: Floats


def origins_of(model: Constants) -> Floats:
    """Return the origins (N, 3) of the joints' frames in the base frame, at the zero configuration.

    Each is the point of the joint's axis that is nearest to the origin of the parent. For joints that the base carries,
    it is the point nearest to the frame after joint `tip`, which is close to the robot wherever the robot is mounted.
    """
    found = np.empty((len(model.kinds), 3))
    reference = pga3.motor_to_matrix(model.home[model.tip])[:3, 3]
    for joint, (axis, parent) in enumerate(zip(model.axes, model.parents, strict=True)):
        direction, moment = np.array([axis[2], -axis[1], axis[0]]), axis[3:]
        before = found[parent] if parent >= 0 else reference
        # The order of summation must be the same on every machine, which BLAS does not guarantee.
        along = direction[0] * before[0] + direction[1] * before[1] + direction[2] * before[2]
        found[joint] = np.cross(direction, moment) + along * direction
    return found


def joints_of(model: Constants) -> Joints:
    """Return the table of all joints."""
    origins = origins_of(model)
    places, screws = origins.copy(), np.zeros((len(model.kinds), 6))
    for joint, (axis, parent) in enumerate(zip(model.axes, model.parents, strict=True)):
        if parent >= 0:
            places[joint] -= origins[parent]
        if model.kinds[joint] is Joint.REVOLUTE:
            screws[joint, :3] = axis[:3]
        else:
            screws[joint, 3:] = axis[2], -axis[1], axis[0]
    turns = np.array([float(kind is Joint.REVOLUTE) for kind in model.kinds])
    return Joints(np.array(model.parents, np.int64), *followed(model), places, screws, turns)


def followed(model: Constants) -> tuple[Indices, Floats, Floats]:
    """Return the variable that each joint follows, the ratio, and the offset."""
    count = len(model.kinds)
    if not model.coupling.size:
        return np.arange(count), np.ones(count), np.zeros(count)
    ratios = model.coupling[:, :-1]
    variables = np.abs(ratios).argmax(axis=1)
    return variables, np.ascontiguousarray(ratios[np.arange(count), variables]), model.coupling[:, -1].copy()


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
    pairs = [(joint, carrier) for joint in range(len(model.kinds)) for carrier in path_to(model, joint)]
    lower, upper = zip(*pairs, strict=True)
    below, above = np.array(lower), np.array(upper)
    variables = followed(model)[0]
    return Pairs(below, above, variables[below], variables[above], (below != above).astype(float))


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


def pushes_of(model: Constants) -> Pushes:
    """Return the pairs of each pushed joint with its ancestors, and with the joints of its tree up to its own index."""
    variables, ratios, _ = followed(model)
    upwards = [(pushed, carrier) for pushed in range(len(model.kinds)) for carrier in reversed(path_to(model, pushed))]
    place = {pair: row for row, pair in enumerate(upwards)}
    below = [-1 if pushed == carrier else row - 1 for row, (pushed, carrier) in enumerate(upwards)]
    roots = [path_to(model, joint)[0] for joint in range(len(model.kinds))]
    moved = [
        (pushed, joint)
        for pushed in range(len(model.kinds))
        for joint in range(pushed + 1)
        if roots[joint] == roots[pushed]
    ]
    after = {pair: row for row, pair in enumerate(moved)}
    pushed, joints = (np.array(side, np.int64) for side in zip(*moved, strict=True))
    columns = variables[pushed]
    return Pushes(
        below=np.array(below, np.int64),
        carriers=np.array([carrier for _, carrier in upwards], np.int64),
        is_own=np.array([float(row < 0) for row in below]),
        before=np.array([after.get((push, model.parents[joint]), -1) for push, joint in moved], np.int64),
        joints=joints,
        pairs=np.array([place.get(pair, 0) for pair in moved], np.int64),
        is_carrier=np.array([float(pair in place) for pair in moved]),
        factors=1 / (ratios[pushed] * ratios[joints]),
        rows=variables[joints],
        columns=columns,
        mirrored=np.where(pushed == joints, -1, columns),
    )
