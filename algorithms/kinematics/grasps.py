"""Grasps by constraints: where points, lines and planes of a gripper come to those of an object.

The book's 11.2.3: flags of the gripper and of the object coincide. A motor M takes ``a`` to ``b`` where ``M a - b M``
is zero, which is linear in M for points, lines and planes alike. All constraints together are one matrix, and the
motors are its null vectors that are motors.

Where freedom is left, the motors are those of one grasp times a group: turns about a point or an axis, slides along a
line or in a plane, and both. Their rotors are all unit vectors of a linear space, and the squared distance to a pose,
with the best slide for each rotor, is a quadratic form on it. So the nearest pose is an eigenvector, and no other
minimum is in the way.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from generated import arms, pga3

from ..arguments import Reals, finite, finite_number, real_array

_MANY = 12
"""As many lines and planes of which both orientations are tried."""
_FLAT = 1e-6
"""Motors whose rotors are smaller than this part of them are translations only."""

Pairs = tuple[ArrayLike, ArrayLike]


@dataclass(frozen=True, slots=True, eq=False)
class Grasps:
    """Motions of a gripper that satisfy constraints.

    Attributes
    ----------
    motors : array, (branches, 8)
        One for each choice of orientations that has any, the nearest to `near` first. Where there is freedom, the
        nearest of all that satisfy the constraints.
    freedoms : array of int, (branches,)
        How many freedoms the gripper has left.
    residuals : array, (branches,)
        The largest distance or sine of an angle by which a constraint is missed.
    distances : array, (branches,)
        How far each pose is from `near`, as `grasp` measures it.
    """

    motors: Reals
    freedoms: Reals
    residuals: Reals
    distances: Reals


def grasp(
    points: Pairs | None = None,
    lines: Pairs | None = None,
    planes: Pairs | None = None,
    near: ArrayLike | None = None,
    oriented: bool = False,
    tolerance: float = 1e-9,
    length: float = 1.0,
) -> Grasps:
    """The motions that take points, lines and planes of a gripper to those of an object.

    Where they leave freedom, the motion with the smallest distance ``d`` to `near` is taken,

        ``d**2 = |t - t_near|**2 + (2 length sin(angle / 2))**2``,

    where ``t - t_near`` is the way between the two places of the gripper's origin, and `angle` that of the turn between
    the two attitudes. It is the root mean square of the ways of the points of a gripper that spread evenly about its
    origin, where `length` is that of their distances from an axis through it.

    Parameters
    ----------
    points : two array_like, (k, 3)
        Of the gripper, and where each shall be.
    lines : two array_like, (k, 6)
        Normalised.
    planes : two array_like, (k, 4)
        Normalised.
    near : array_like, (8,), optional
        The pose that is wanted, such as the current one of the gripper, of either sign; left out, the identity.
    oriented : bool
        Lines and planes have a sense; else either is tried, for at most twelve of them.
    tolerance : float
        Constraints are met where singular values are below this part of the largest.
    length : float
        By how much of a way a turn by a radian counts, in the units of the points.

    Returns
    -------
    Grasps
        No branches where constraints contradict each other.

    Raises
    ------
    TypeError, ValueError
        Where an argument has another shape or is not finite, `near` is no motor, `length` is not positive, or there is
        no constraint.
    """
    parts, signs = [], 0
    for name, pair, width, kernel in (
        ("points", points, 3, arms.constraint_of_points),
        ("lines", lines, 6, arms.constraint_of_lines),
        ("planes", planes, 4, arms.constraint_of_planes),
    ):
        if pair is None:
            continue
        shape, meaning = (-1, width), f"{width} coefficients each"
        own, goal = (finite(real_array(one, f"grasp: {name}", shape, meaning), f"grasp: {name}") for one in pair)
        if own.shape != goal.shape:
            raise ValueError(f"grasp: {name}: {len(own)} of the gripper, {len(goal)} of the object; expected as many")
        signs += len(own) if width != 3 else 0
        parts.append((kernel, own, goal, width != 3))
    if not parts or not any(len(own) for _, own, _, _ in parts):
        raise ValueError("grasp: no constraint; expected points, lines or planes")
    if not oriented and signs > _MANY:
        raise ValueError(f"grasp: {signs} lines and planes of either sense; expected {_MANY} at most, or oriented=True")
    wanted = np.eye(8)[0]
    if near is not None:
        given = finite(real_array(near, "grasp: near", (8,), "a motor"), "grasp: near").astype(float)
        if not np.linalg.norm(given[:4]) > _FLAT * np.linalg.norm(given):
            raise ValueError(f"grasp: near: {near}; expected a motor")
        wanted = pga3.normalize_motor(given)
    if not finite_number(length, "grasp: length") > 0:
        raise ValueError(f"grasp: length: {length}; expected a positive number")
    found = []
    for choice in product((1.0,) if oriented else (1.0, -1.0), repeat=signs):
        senses = iter(choice)
        matrices = []
        for kernel, own, goal, turned in parts:
            sense = np.array([next(senses) for _ in own])[:, None] if turned else 1.0
            matrices.append(kernel(own, sense * goal))
        matrix = np.concatenate(matrices).reshape(-1, 8)
        one = _nearest(matrix, wanted, length, tolerance)
        if one is not None:
            motor, freedoms, away = one
            found.append((away, float(np.abs(matrix @ motor).max()), freedoms, motor))
    found.sort(key=lambda one: one[0])
    return Grasps(
        np.array([motor for *_, motor in found]).reshape(-1, 8),
        np.array([freedoms for _, _, freedoms, _ in found], int),
        np.array([residual for _, residual, _, _ in found]),
        np.array([away for away, *_ in found]),
    )


def _nearest(matrix: Reals, near: Reals, length: float, tolerance: float) -> tuple[Reals, int, float] | None:
    """The motor in a null space that is nearest to a unit motor, its freedoms and distance; None if there is none."""
    _, values, right = np.linalg.svd(matrix, full_matrices=True)
    values = np.concatenate([values, np.zeros(8 - len(values))])
    null = right[values <= tolerance * max(float(values[0]), 1.0)]
    left, sizes, rotors = np.linalg.svd(null[:, :4], full_matrices=True)
    many = int((sizes > _FLAT).sum())
    if not many:
        return None
    # null vectors with the rotors of a basis, and those that only slide
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
    if not np.abs(matrix @ motor).max() <= 1e3 * tolerance * max(1.0, float(np.abs(motor).max())):
        return None
    return motor, many - 1 + slides, float(np.sqrt(square))


def _shift(rotor: Reals, dual: Reals, free: Reals, place: Reals) -> tuple[Reals, int]:
    """The translation, nearest to a place, of motors of a unit rotor, and how many slides are free.

    The part with e0 of these motors is `dual`, (4,), plus any sum of `free`, (K, 4). Of a motor it is half a
    translation times the rotor; what has a part along the rotor times the pseudoscalar is none.
    """
    halves = pga3.motor_from_rotor_translation(rotor, np.eye(3))[:, 4:]
    parts = np.concatenate([4 * halves, [[-rotor[3], rotor[2], -rotor[1], rotor[0]]]])
    start, ways = parts @ dual, parts @ free.T
    if not free.size:
        return start[:3], 0
    _, sizes, right = np.linalg.svd(ways[3:], full_matrices=True)
    if sizes[0] > _FLAT:
        start = start - ways @ right[0] * (start[3] / (ways[3] @ right[0]))
        right = right[1:]
    slides = ways[:3] @ right.T
    amounts = np.linalg.lstsq(slides, place - start[:3], rcond=None)[0]
    return start[:3] + slides @ amounts, len(right)
