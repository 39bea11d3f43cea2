"""Grasps by constraints: points, lines and planes of a gripper are made to coincide with those of an object.

The method follows section 11.2.3 of the book, in which flags of the gripper and of the object coincide. A motor M takes
``a`` to ``b`` if ``M a - b M`` is zero. This is linear in M for points, lines and planes alike. All constraints
together form one matrix, and the solutions are the motors in its null space.

If degrees of freedom remain, the solutions are one grasp multiplied by a group: rotations about a point or an axis,
translations along a line or in a plane, or both. Their rotors are the unit vectors of a linear space. The squared
distance to a pose, with the best translation for each rotor, is a quadratic form on this space. Therefore the nearest
pose is an eigenvector, and there are no other local minima.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import arms, pga3

from ..arguments import Reals, finite, finite_number, real_array
from ..elements import MOTOR, elements
from ..precision import SINGLE

_MANY = 12
"""Maximum number of lines and planes whose two orientations are both tried."""

Pairs = tuple[ArrayLike, ArrayLike]


@dataclass(frozen=True, slots=True, eq=False)
class Grasps:
    """Motions of a gripper that satisfy constraints.

    Attributes
    ----------
    motors : array, (branches, 8)
        One for each feasible choice of orientations, sorted by distance to `near`. If degrees of freedom remain, the
        solution closest to `near`.
    freedoms : array of int, (branches,)
        The number of remaining degrees of freedom.
    residuals : array, (branches,)
        The largest violation of a constraint: a distance or the sine of an angle.
    distances : array, (branches,)
        The distance of each pose to `near`, as defined in `grasp`.
    """

    motors: Reals
    freedoms: Reals
    residuals: Reals
    distances: Reals


@elements(near=MOTOR)
def grasp(
    points: Pairs | None = None,
    lines: Pairs | None = None,
    planes: Pairs | None = None,
    near: ArrayLike | None = None,
    oriented: bool = False,
    tolerance: float = 1e-9,
    length: float = 1.0,
) -> Grasps:
    """Return the motions that take points, lines and planes of a gripper to those of an object.

    If the constraints leave degrees of freedom, the motion with the smallest distance ``d`` to `near` is chosen,

        ``d**2 = |t - t_near|**2 + (2 length sin(angle / 2))**2``,

    where ``t - t_near`` is the displacement of the gripper's origin, and `angle` the angle of the relative rotation.
    For a gripper with points distributed evenly about its origin, ``d`` is the root mean square of their displacements
    if `length` is the root mean square of their distances from an axis through the origin.

    Parameters
    ----------
    points : two array_like, (k, 3)
        Points of the gripper, and their target positions.
    lines : two array_like, (k, 6)
        Normalised lines of the gripper and of the object.
    planes : two array_like, (k, 4)
        Normalised planes of the gripper and of the object.
    near : array_like, (8,), optional
        The preferred pose, such as the current pose of the gripper, of either sign. The identity by default.
    oriented : bool
        Whether the orientations of lines and planes must match. Otherwise both are tried, for at most twelve lines and
        planes in total.
    tolerance : float
        Constraints are satisfied where singular values are below this fraction of the largest.
    length : float
        The length that corresponds to a rotation by one radian, in the units of the points.

    Returns
    -------
    Grasps
        Without branches if the constraints contradict each other.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or is not finite, `near` is not a motor, `length` is not positive, or there is
        no constraint.
    """
    pairs = _pairs(points, lines, planes)
    if not any(len(pair.own) for pair in pairs):
        raise ValueError("grasp: no constraint; expected points, lines or planes")
    signs = sum(len(pair.own) for pair in pairs if pair.is_turned)
    if not oriented and signs > _MANY:
        raise ValueError(
            f"grasp: {signs} lines and planes of unknown orientation; expected at most {_MANY}, or oriented=True"
        )
    wanted = _preferred(near)
    if not finite_number(length, "grasp: length") > 0:
        raise ValueError(f"grasp: length: {length}; expected a positive number")
    found = []
    for choice in product((1.0,) if oriented else (1.0, -1.0), repeat=signs):
        senses = iter(choice)
        matrix = np.concatenate([pair.matrices(senses) for pair in pairs]).reshape(-1, 8)
        solution = _nearest(matrix, wanted, length, tolerance)
        if solution is not None:
            found.append(solution)
    found.sort(key=lambda one: one.distance)
    return Grasps(
        np.array([one.motor for one in found]).reshape(-1, 8),
        np.array([one.freedoms for one in found], int),
        np.array([one.residual for one in found]),
        np.array([one.distance for one in found]),
    )


class _Pair(NamedTuple):
    """Elements of one kind, (k, w), of the gripper and of the object; `is_turned` if both orientations are tried."""

    constraint: Callable[..., Any]
    own: Reals
    goal: Reals
    is_turned: bool

    def matrices(self, senses: Iterator[float]) -> Reals:
        """Return the matrices of the constraints; the orientations of lines and planes are the next ones."""
        sense = np.array([next(senses) for _ in self.own])[:, None] if self.is_turned else 1.0
        return np.asarray(self.constraint(self.own, sense * self.goal))


def _pairs(points: Pairs | None, lines: Pairs | None, planes: Pairs | None) -> list[_Pair]:
    """Return the given pairs, if they are valid."""
    found = []
    for name, pair, width, constraint in (
        ("grasp: points", points, 3, arms.constraint_of_points),
        ("grasp: lines", lines, 6, arms.constraint_of_lines),
        ("grasp: planes", planes, 4, arms.constraint_of_planes),
    ):
        if pair is None:
            continue
        own, goal = (finite(real_array(one, name, (-1, width), f"{width} coefficients each"), name) for one in pair)
        if own.shape != goal.shape:
            raise ValueError(f"{name}: {len(own)} of the gripper, {len(goal)} of the object; expected equal numbers")
        found.append(_Pair(constraint, own, goal, width != 3))
    return found


def _preferred(near: ArrayLike | None) -> Reals:
    """Return the unit motor of the preferred pose."""
    if near is None:
        return np.asarray(np.eye(8)[0])
    given = finite(real_array(near, "grasp: near", (8,), "a motor"), "grasp: near").astype(float)
    if not np.linalg.norm(given[:4]) > SINGLE * np.linalg.norm(given):
        raise ValueError(f"grasp: near: {near}; expected a motor")
    return np.asarray(pga3.normalize_motor(given))


class _Solution(NamedTuple):
    """One motion; see `Grasps`."""

    motor: Reals
    freedoms: int
    residual: float
    distance: float


def _nearest(matrix: Reals, near: Reals, length: float, tolerance: float) -> _Solution | None:
    """Return the motor of a null space that is nearest to a unit motor; None if the null space contains no motor."""
    _, values, right = np.linalg.svd(matrix, full_matrices=True)
    values = np.concatenate([values, np.zeros(8 - len(values))])
    null = right[values <= tolerance * max(float(values[0]), 1.0)]
    left, sizes, rotors = np.linalg.svd(null[:, :4], full_matrices=True)
    many = int((sizes > SINGLE).sum())
    if not many:
        return None
    # null vectors with the rotors of a basis, and pure translations
    turned, free = left[:, :many].T @ null / sizes[:many, None], left[:, many:].T @ null
    rotors = rotors[:many]
    place = pga3.motor_to_matrix(near)[:3, 3]

    def at(weights: Reals) -> tuple[Reals, int, float]:
        rotor = weights @ rotors
        shift, slides = _shift(rotor, weights @ turned[:, 4:], free[:, 4:], place)
        turn = max(1.0 - float(rotor @ near[:4]) ** 2, 0.0)
        motor = pga3.motor_from_rotor_translation(rotor, shift)
        return motor, slides, float(np.square(shift - place).sum() + 4 * length**2 * turn)

    basis = np.eye(many)
    form = np.diag([at(one)[2] for one in basis])
    for i in range(many):
        for j in range(i):
            both = at((basis[i] + basis[j]) / np.sqrt(2))[2]
            form[i, j] = form[j, i] = both - (form[i, i] + form[j, j]) / 2
    best = np.linalg.eigh(form)[1][:, 0]
    motor, slides, square = at(best if (best @ rotors) @ near[:4] >= 0 else -best)
    residual = float(np.abs(matrix @ motor).max())
    if not residual <= 1e3 * tolerance * max(1.0, float(np.abs(motor).max())):
        return None
    return _Solution(motor, many - 1 + slides, residual, float(np.sqrt(square)))


def _shift(rotor: Reals, dual: Reals, free: Reals, place: Reals) -> tuple[Reals, int]:
    """Return the translation nearest to `place` of motors with a unit rotor, and the number of free translations.

    The part of these motors with e0 is `dual`, (4,), plus any linear combination of `free`, (K, 4). For a motor this
    part is half a translation times the rotor. It must have no component along the rotor times the pseudoscalar.
    """
    halves = pga3.motor_from_rotor_translation(rotor, np.eye(3))[:, 4:]
    parts = np.concatenate([4 * halves, [[-rotor[3], rotor[2], -rotor[1], rotor[0]]]])
    start, directions = parts @ dual, parts @ free.T
    if not free.size:
        return start[:3], 0
    _, sizes, right = np.linalg.svd(directions[3:], full_matrices=True)
    if sizes[0] > SINGLE:
        start = start - directions @ right[0] * (start[3] / (directions[3] @ right[0]))
        right = right[1:]
    slides = directions[:3] @ right.T
    amounts = np.linalg.lstsq(slides, place - start[:3], rcond=None)[0]
    return start[:3] + slides @ amounts, len(right)
