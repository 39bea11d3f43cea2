"""Grasps by constraints: where points, lines and planes of a gripper come to those of an object.

The book's 11.2.3: flags of the gripper and of the object coincide. A motor M takes ``a`` to ``b`` where ``M a - b M``
is zero, which is linear in M for points, lines and planes alike. All constraints together are one matrix, and the
motors are its null vectors that are motors.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from generated import arms, pga3

from ..arguments import Reals, real_array

_MANY = 12
"""As many lines and planes of which both orientations are tried."""

Pairs = tuple[ArrayLike, ArrayLike]


@dataclass(frozen=True, slots=True, eq=False)
class Grasps:
    """Motions of a gripper that satisfy constraints.

    Attributes
    ----------
    motors : array, (branches, 8)
        One for each choice of orientations that has any, the most exact first. Where there is freedom, the one nearest
        to the motor that was given.
    freedoms : array of int, (branches,)
        How many freedoms the gripper has left.
    residuals : array, (branches,)
        The largest distance or sine of an angle by which a constraint is missed.
    """

    motors: Reals
    freedoms: Reals
    residuals: Reals


def grasp(
    points: Pairs | None = None,
    lines: Pairs | None = None,
    planes: Pairs | None = None,
    near: ArrayLike | None = None,
    oriented: bool = False,
    tolerance: float = 1e-9,
) -> Grasps:
    """The motions that take points, lines and planes of a gripper to those of an object.

    Parameters
    ----------
    points : two array_like, (k, 3)
        Of the gripper, and where each shall be.
    lines : two array_like, (k, 6)
        Normalised.
    planes : two array_like, (k, 4)
        Normalised.
    near : array_like, (8,), optional
        The motor that is wanted if it were free; left out, the identity.
    oriented : bool
        Lines and planes have a sense; else either is tried, for at most twelve of them.
    tolerance : float
        Constraints are met where singular values are below this part of the largest.

    Returns
    -------
    Grasps
        No branches where constraints contradict each other.

    Raises
    ------
    TypeError, ValueError
        Where an argument has another shape, or there is no constraint.
    """
    parts, signs = [], 0
    for name, pair, width, kernel in (
        ("points", points, 3, arms.constraint_of_points),
        ("lines", lines, 6, arms.constraint_of_lines),
        ("planes", planes, 4, arms.constraint_of_planes),
    ):
        if pair is None:
            continue
        own, goal = (real_array(one, f"grasp: {name}", (-1, width), f"{width} coefficients each") for one in pair)
        if own.shape != goal.shape:
            raise ValueError(f"grasp: {name}: {len(own)} of the gripper, {len(goal)} of the object; expected as many")
        signs += len(own) if width != 3 else 0
        parts.append((kernel, own, goal, width != 3))
    if not parts or not any(len(own) for _, own, _, _ in parts):
        raise ValueError("grasp: no constraint; expected points, lines or planes")
    if not oriented and signs > _MANY:
        raise ValueError(f"grasp: {signs} lines and planes of either sense; expected {_MANY} at most, or oriented=True")
    wanted = np.eye(8)[0] if near is None else real_array(near, "grasp: near", (8,), "a motor")
    found = []
    for choice in product((1.0,) if oriented else (1.0, -1.0), repeat=signs):
        senses = iter(choice)
        matrices = []
        for kernel, own, goal, turned in parts:
            sense = np.array([next(senses) for _ in own])[:, None] if turned else 1.0
            matrices.append(kernel(own, sense * goal))
        matrix = np.concatenate(matrices).reshape(-1, 8)
        one = _null_motor(matrix, wanted, tolerance)
        if one is not None:
            motor, freedoms = one
            found.append((float(np.abs(matrix @ motor).max()), freedoms, motor))
    found.sort(key=lambda one: one[0])
    return Grasps(
        np.array([motor for _, _, motor in found]).reshape(-1, 8),
        np.array([freedoms for _, freedoms, _ in found], int),
        np.array([residual for residual, _, _ in found]),
    )


def _null_motor(matrix: Reals, wanted: Reals, tolerance: float) -> tuple[Reals, int] | None:
    """The motor in a null space that is nearest to one that is wanted, and its freedoms; None where there is none."""
    _, values, right = np.linalg.svd(matrix, full_matrices=True)
    values = np.concatenate([values, np.zeros(8 - len(values))])
    null = right[values <= tolerance * max(float(values[0]), 1.0)]
    if not len(null):
        return None
    # Multiples by the pseudoscalar are null vectors too where only directions are constrained to be the same.
    screws = np.zeros((len(null), 8))
    screws[:, 7], screws[:, 6], screws[:, 5], screws[:, 4] = null[:, 0], -null[:, 1], null[:, 2], -null[:, 3]
    closed = np.abs(screws - screws @ null.T @ null).max() < 1e3 * tolerance
    spun = null[:, :4]
    if np.linalg.norm(spun) < 1e3 * tolerance:
        return None
    start = null.T @ (null @ wanted)
    if np.linalg.norm(start[:4]) < 1e-6:
        start = null[int(np.argmax(np.linalg.norm(spun, axis=1)))]
    motor = pga3.normalize_motor(start)
    if not np.abs(matrix @ motor).max() <= 1e3 * tolerance * max(1.0, float(np.abs(motor).max())):
        return None
    return motor, len(null) - (2 if closed else 1)
