"""Tasks of robots: what a point, a direction or a frame of a link is to do. `Robot.reach` fulfils several at once.

Most lines describe the parameters of nine functions of a few lines each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite, finite_number, real_array
from ..elements import DIRECTION, LINE, MOTOR, PLANE, POINT, elements
from .inverse.solve import unit_motors

ORIGIN = (0.0, 0.0, 0.0)
"""The origin of the frame of a link."""
FORWARD = (0.0, 0.0, 1.0)
"""The z axis of a tool."""
EYE = np.eye(3)
"""All directions of space."""


class Kind(IntEnum):
    """What is to be zero; the numbers are those of `gacompiler.specs.tasks`."""

    PLACE = 0
    DIRECTION = 1
    SPHERE = 2
    LOOK = 3


class Part(NamedTuple):
    """Three numbers that are to be zero: `rows` times the vector of `kind`.

    `point` and `direction` are in the frame of the link, `target` is (..., 3).
    """

    kind: Kind
    target: Reals
    rows: Reals = EYE
    point: Reals = np.zeros(3)
    direction: Reals = np.zeros(3)
    radius: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """One task, as the functions of this module return it.

    Attributes
    ----------
    name : str
        The name of the function.
    parts : tuple of Part
    link : str or None
        The link that carries the point or direction; None for the end effector with its tool.
    weight : float
    measure : function
        Converts the norm of all numbers of the parts to metres or radians.
    is_angle : bool
        Whether the task is fulfilled by a direction rather than by a place.
    """

    name: str
    parts: tuple[Part, ...]
    link: str | None
    weight: float
    measure: Callable[[Reals], Reals]
    is_angle: bool


@elements(target=POINT, point=POINT)
def position(target: ArrayLike, *, link: str | None = None, point: ArrayLike = ORIGIN, weight: float = 1.0) -> Task:
    """Return the task that a point of a link is at a target.

    Parameters
    ----------
    target : array_like, (..., 3)
        Coordinates in the base frame, one point or one for each configuration.
    link : str, optional
        The name of a link of a URDF file. The default is the end effector.
    point : array_like, (3,)
        Coordinates in the frame of the link. The default is its origin.
    weight : float
        Weight of the distance relative to those of other tasks, for tasks that cannot all be fulfilled. Angles are
        multiplied by the size of the robot.

    Returns
    -------
    Task
        Its distance is in metres.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape, is not finite (targets may be), or a weight is not positive.
    """
    part = Part(Kind.PLACE, _vectors(target, "target"), point=_vector(point, "point"))
    return _task("position", [part], link, weight, _length)


@elements(line=LINE, point=POINT)
def on_line(line: ArrayLike, *, link: str | None = None, point: ArrayLike = ORIGIN, weight: float = 1.0) -> Task:
    """Return the task that a point of a link is on a line.

    Parameters
    ----------
    line : array_like, (..., 6)
        A unit line of PGA3 in the base frame, as `pga3.join_points` normalized.
    link, point, weight
        As in `position`.

    Returns
    -------
    Task
        Its distance is in metres.

    Raises
    ------
    TypeError, ValueError
        As in `position`, and if lines differ in direction. The direction of a line is the same for all configurations.
    """
    array = real_array(line, "line", (6,), "coefficients of a line")
    along = np.stack([array[..., 2], -array[..., 1], array[..., 0]], -1).reshape(-1, 3)
    unit = _common_unit(along, "line")
    part = Part(Kind.PLACE, pga3.line_support(array), EYE - np.outer(unit, unit), _vector(point, "point"))
    return _task("on_line", [part], link, weight, _length)


@elements(plane=PLANE, point=POINT)
def on_plane(plane: ArrayLike, *, link: str | None = None, point: ArrayLike = ORIGIN, weight: float = 1.0) -> Task:
    """Return the task that a point of a link is on a plane.

    Parameters
    ----------
    plane : array_like, (..., 4)
        A plane of PGA3 in the base frame: ``a x + b y + c z + d = 0``.
    link, point, weight
        As in `position`.

    Returns
    -------
    Task
        Its distance is in metres.

    Raises
    ------
    TypeError, ValueError
        As in `position`, and if planes differ in direction. The normal is the same for all configurations.
    """
    array = real_array(plane, "plane", (4,), "coefficients of a plane")
    normal = _common_unit(array[..., :3].reshape(-1, 3), "plane")
    sizes = array[..., :3] @ normal
    place = -(array[..., 3] / sizes)[..., None] * normal
    part = Part(Kind.PLACE, place, _rows_along(normal), _vector(point, "point"))
    return _task("on_plane", [part], link, weight, _length)


@elements(centre=POINT, point=POINT)
def on_sphere(
    centre: ArrayLike, radius: float, *, link: str | None = None, point: ArrayLike = ORIGIN, weight: float = 1.0
) -> Task:
    """Return the task that a point of a link has a given distance from a centre.

    Parameters
    ----------
    centre : array_like, (..., 3)
    radius : float
        In metres.
    link, point, weight
        As in `position`.

    Returns
    -------
    Task
        Its distance is in metres.

    Raises
    ------
    TypeError, ValueError
        As in `position`, and if the radius is negative.
    """
    size = finite_number(radius, "radius")
    if size < 0:
        raise ValueError(f"radius: {size}; expected 0 or more")
    part = Part(Kind.SPHERE, _vectors(centre, "centre"), point=_vector(point, "point"), radius=size)
    return _task("on_sphere", [part], link, weight, _length)


@elements(target=DIRECTION, axis=DIRECTION)
def direction(target: ArrayLike, *, link: str | None = None, axis: ArrayLike = FORWARD, weight: float = 1.0) -> Task:
    """Return the task that an axis of a link has a given direction, with the sign.

    Parameters
    ----------
    target : array_like, (..., 3)
        Directions in the base frame, of any length.
    link : str, optional
        As in `position`.
    axis : array_like, (3,)
        A direction in the frame of the link. The default is its z axis.
    weight : float
        As in `position`.

    Returns
    -------
    Task
        Its distance is the angle in radians.

    Raises
    ------
    TypeError, ValueError
        As in `position`, and if a direction is zero.
    """
    part = Part(Kind.DIRECTION, _units(target, "target"), direction=_unit(axis, "axis"))
    return _task("direction", [part], link, weight, _chord, True)


@elements(normal=DIRECTION, axis=DIRECTION)
def across(normal: ArrayLike, *, link: str | None = None, axis: ArrayLike = FORWARD, weight: float = 1.0) -> Task:
    """Return the task that an axis of a link is perpendicular to a direction: level, for example, if that is vertical.

    Parameters
    ----------
    normal : array_like, (3,)
        A direction in the base frame.
    link, axis, weight
        As in `direction`.

    Returns
    -------
    Task
        Its distance is the angle in radians between the axis and the plane perpendicular to `normal`.

    Raises
    ------
    TypeError, ValueError
        As in `direction`.
    """
    rows = _rows_along(_unit(normal, "normal"))
    return _task(
        "across", [Part(Kind.DIRECTION, np.zeros(3), rows, direction=_unit(axis, "axis"))], link, weight, _sine, True
    )


@elements(target=POINT, axis=DIRECTION, point=POINT)
def look_at(
    target: ArrayLike,
    *,
    link: str | None = None,
    axis: ArrayLike = FORWARD,
    point: ArrayLike = ORIGIN,
    weight: float = 1.0,
) -> Task:
    """Return the task that an axis of a link points from a point of the link to a target, like the axis of a camera.

    Parameters
    ----------
    target : array_like, (..., 3)
        Coordinates in the base frame.
    link, weight
        As in `position`.
    axis, point : array_like, (3,)
        In the frame of the link. The default is its z axis, from its origin.

    Returns
    -------
    Task
        Its distance is the angle in radians.

    Raises
    ------
    TypeError, ValueError
        As in `direction`.
    """
    part = Part(Kind.LOOK, _vectors(target, "target"), EYE, _vector(point, "point"), _unit(axis, "axis"))
    return _task("look_at", [part], link, weight, _chord, True)


@elements(target=MOTOR)
def orientation(target: ArrayLike, *, link: str | None = None, weight: float = 1.0) -> Task:
    """Return the task that the frame of a link has the orientation of a pose.

    Parameters
    ----------
    target : array_like, (..., 8) or (..., 4, 4)
        Motors or matrices, as in `Robot.inverse`; their translation has no influence.
    link, weight
        As in `position`.

    Returns
    -------
    Task
        Its distance is the angle of the remaining rotation in radians.

    Raises
    ------
    TypeError, ValueError
        As in `position`. Where a matrix is no rigid motion, the status of the result is NOT_FINITE.
    """
    turned = _matrices(target)[..., :3, :3]
    parts = [Part(Kind.DIRECTION, turned[..., k], direction=EYE[k]) for k in range(3)]
    return _task("orientation", parts, link, weight, _rotation, True)


@elements(target=MOTOR)
def pose(target: ArrayLike, *, link: str | None = None, weight: float = 1.0) -> tuple[Task, Task]:
    """Return the two tasks that the frame of a link has the position and the orientation of a pose.

    Parameters
    ----------
    target : array_like, (..., 8) or (..., 4, 4)
        Motors of either sign, or matrices, as in `Robot.inverse`.
    link, weight
        As in `position`.

    Returns
    -------
    tuple of Task
        `position` and `orientation`.

    Raises
    ------
    TypeError, ValueError
        As in `orientation`.
    """
    place = _matrices(target)[..., :3, 3]
    return position(place, link=link, weight=weight), orientation(target, link=link, weight=weight)


def _task(
    name: str,
    parts: Sequence[Part],
    link: str | None,
    weight: float,
    measure: Callable[[Reals], Reals],
    is_angle: bool = False,
) -> Task:
    if link is not None and not isinstance(link, str):
        raise TypeError(f"link: {type(link).__name__}; expected the name of a link, or None for the end effector")
    size = finite_number(weight, "weight")
    if size <= 0:
        raise ValueError(f"weight: {size}; expected a positive number; leave a task out instead of giving it weight 0")
    return Task(name, tuple(parts), link, size, measure, is_angle)


def _vectors(value: ArrayLike, name: str) -> Reals:
    return real_array(value, name, (3,), "coordinates x, y, z").copy()


def _vector(value: ArrayLike, name: str) -> Reals:
    found = finite(_vectors(value, name), name)
    if found.ndim != 1:
        raise ValueError(f"{name}: shape {found.shape}; expected (3,), since it is fixed to the link")
    return found


def _units(value: ArrayLike, name: str) -> Reals:
    array = _vectors(value, name)
    lengths = np.linalg.norm(array, axis=-1, keepdims=True)
    if (lengths == 0).any():
        raise ValueError(f"{name}: a direction of length 0; expected a vector that is not zero")
    return np.asarray(array / lengths)


def _unit(value: ArrayLike, name: str) -> Reals:
    return _units(_vector(value, name), name)


def _common_unit(directions: Reals, name: str) -> Reals:
    """Return the unit vector of parallel directions (N, 3), in double precision."""
    if not len(directions):
        return np.array(FORWARD)
    units = _units(finite(directions, name).astype(float), name)
    # Directions of computed elements agree to some rounding errors of their precision.
    if not np.allclose(np.cross(units, units[0]), 0, atol=4096 * np.finfo(directions.dtype).eps):
        raise ValueError(f"{name}: several directions; expected parallel ones, one problem for each direction")
    return np.asarray(units[0])


def _matrices(target: ArrayLike) -> Reals:
    """Return poses as matrices; those that are no rigid motions are NaN."""
    return np.asarray(pga3.motor_to_matrix(unit_motors(target, "target")))


def _rows_along(normal: Reals) -> Reals:
    """Return rows of which the first one measures along a normal, and the others nothing."""
    return np.stack([normal, np.zeros(3), np.zeros(3)])


def _length(norm: Reals) -> Reals:
    return norm


def _chord(norm: Reals) -> Reals:
    """Convert the distance of two unit vectors to the angle between them."""
    return np.asarray(2 * np.arcsin(np.minimum(norm / 2, 1)))


def _rotation(norm: Reals) -> Reals:
    """Convert the Frobenius norm of the difference of two rotations to the angle between them."""
    return np.asarray(2 * np.arcsin(np.minimum(norm / np.sqrt(8), 1)))


def _sine(norm: Reals) -> Reals:
    return np.asarray(np.arcsin(np.minimum(norm, 1)))
