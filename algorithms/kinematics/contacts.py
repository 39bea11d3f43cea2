"""Constraints of links: contacts with the ground, and closed loops. `Constrained` computes the dynamics under them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite, real_array
from ..elements import DIRECTION, MOTOR, POINT, elements
from .changes import rigid_motor
from .tasks import EYE, ORIGIN

IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""The motor that moves nothing."""
_NONE = np.zeros(3)
"""The zero vector."""


class Row(NamedTuple):
    """One number that is held: a force along an axis of the other link, or a torque about it.

    `mark` is a direction of the first link that is to be perpendicular to `bearing`, a direction of the other.
    """

    force: Reals
    torque: Reals
    mark: Reals
    bearing: Reals


@dataclass(frozen=True, slots=True, eq=False)
class Constraint:
    """A constraint, as the functions of this module return it.

    Attributes
    ----------
    name : str
        The name of the function.
    link : str or None
        The first link, to which the force is applied; None for the end effector with its tool.
    other : str or None
        The link that applies the force; None for the ground.
    place : array, (3,)
        The point of the constraint, in the frame of `link`.
    target : array, (3,), or None
        Where the point is to be, in the frame of `other`; None if that does not matter.
    rows : tuple of Row
        One for each number of the force.
    """

    name: str
    link: str | None
    other: str | None
    place: Reals
    target: Reals | None
    rows: tuple[Row, ...]


@elements(place=POINT, target=POINT)
def point(
    link: str | None = None,
    place: ArrayLike = ORIGIN,
    *,
    other: str | None = None,
    target: ArrayLike | None = None,
    directions: ArrayLike = EYE,
) -> Constraint:
    """Return the constraint that a point of a link does not move relative to another link, or to the ground.

    Parameters
    ----------
    link : str, optional
        A link that joints move. The default is the end effector.
    place : array_like, (3,)
        The point in the frame of the link. The default is its origin.
    other : str, optional
        The link that holds the point. The default is the ground, whose frame is that of the world.
    target : array_like, (3,), optional
        Where the point is held, in the frame of `other`; needed to correct errors of position.
    directions : array_like, (k, 3)
        Directions in the frame of `other` in which the point is held. The default is all three axes; the normal of the
        ground alone is a contact without friction.

    Returns
    -------
    Constraint
        Its forces are those along the directions, N.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or is not finite, or a direction is zero.
    """
    along = finite(real_array(directions, "directions", (-1, 3), "vectors"), "directions")
    sizes = np.linalg.norm(along, axis=-1)
    if along.ndim != 2 or not len(along) or not (sizes > 0).all():
        raise ValueError(f"directions: shape {along.shape} and lengths {sizes}; expected one to three nonzero vectors")
    rows = tuple(Row(unit, _NONE, _NONE, _NONE) for unit in along / sizes[:, None])
    return Constraint("point", link, other, _vector(place, "place"), _optional(target), rows)


@elements(place=POINT, target=POINT, axis=DIRECTION, other_axis=DIRECTION)
def hinge(
    link: str | None = None,
    place: ArrayLike = ORIGIN,
    *,
    axis: ArrayLike,
    other_axis: ArrayLike,
    other: str | None = None,
    target: ArrayLike | None = None,
) -> Constraint:
    """Return the constraint that a link only turns about an axis of another link, or of the ground.

    Parameters
    ----------
    link, place, other, target
        As in `point`.
    axis, other_axis : array_like, (3,)
        The direction of the axis in the frame of `link`, and the same direction in that of `other`.

    Returns
    -------
    Constraint
        Its forces are three along the axes of `other`, N, and two torques perpendicular to the axis, N m. An axis that
        points the other way is no error (`Constrained.errors`).

    Raises
    ------
    TypeError, ValueError
        As in `point`.
    """
    along, mark = _unit(other_axis, "other_axis"), _unit(axis, "axis")
    first = np.cross(along, EYE[np.abs(along).argmin()])
    first /= np.linalg.norm(first)
    second = np.cross(along, first)
    turns = (Row(_NONE, second, mark, first), Row(_NONE, -first, mark, second))
    rows = (*(Row(unit, _NONE, _NONE, _NONE) for unit in EYE), *turns)
    return Constraint("hinge", link, other, _vector(place, "place"), _optional(target), rows)


@elements(frame=MOTOR, target=MOTOR)
def weld(
    link: str | None = None,
    frame: ArrayLike = IDENTITY,
    *,
    other: str | None = None,
    target: ArrayLike | None = None,
) -> Constraint:
    """Return the constraint that a frame of a link does not move relative to another link, or to the ground: a sole.

    Parameters
    ----------
    link, other
        As in `point`.
    frame : array_like, (8,) or (4, 4)
        The frame in that of the link, as a motor or a matrix. The default is the frame of the link.
    target : array_like, (8,) or (4, 4), optional
        Where it is held, in the frame of `other`; needed to correct errors of the pose.

    Returns
    -------
    Constraint
        Its forces are three along the axes of `other`, N, and three torques, N m, at the origin of `frame`: about the
        axes of `target`, whose errors are those of small turns about them, or without it about the axes of `other`.
        Half a turn about one of these axes is no error (`Constrained.errors`).

    Raises
    ------
    TypeError, ValueError
        If a frame is not a rigid motion.
    """
    own, place = _frame(frame, "frame")
    held, there = (EYE, None) if target is None else _frame(target, "target")
    rows = [Row(unit, _NONE, _NONE, _NONE) for unit in EYE]
    # A small turn about the first of three axes moves the second towards the third.
    rows += [Row(_NONE, held[:, k], own[:, (k + 1) % 3], held[:, (k + 2) % 3]) for k in range(3)]
    return Constraint("weld", link, other, place, there, tuple(rows))


def _frame(pose: ArrayLike, name: str) -> tuple[Reals, Reals]:
    """Return the axes of a frame as columns, and its origin."""
    matrix = pga3.motor_to_matrix(rigid_motor(pose, name))
    return matrix[:3, :3], matrix[:3, 3]


def _vector(value: ArrayLike, name: str) -> Reals:
    found = finite(real_array(value, name, (3,), "a vector"), name)
    if found.ndim != 1:
        raise ValueError(f"{name}: shape {found.shape}; expected (3,)")
    return found.astype(float)


def _optional(target: ArrayLike | None) -> Reals | None:
    return None if target is None else _vector(target, "target")


def _unit(value: ArrayLike, name: str) -> Reals:
    found = _vector(value, name)
    size = float(np.linalg.norm(found))
    if size == 0:
        raise ValueError(f"{name}: {found}; expected a direction that is not zero")
    return found / size
