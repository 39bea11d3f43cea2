"""Dynamics in the book's form: matrices of inner products of mass centres with joint axes.

Bayro-Corrochano, *Geometric Computing* (2010), chapter 12: with ``V_ij = x_i . l_j``, the velocity of the centre of
mass of link i by joint j, the mass matrix is ``Vᵀ m V + δ I``, Coriolis forces ``Vᵀ m V' qd`` and gravity ``Vᵀ m a``.
Each link turns with a scalar inertia at the sum of all joint rates before it. That is exact where all axes are parallel
and wrong elsewhere: use `Robot.mass_matrix` and its kin, which know the whole tensor, for anything but comparison.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from .robot import Robot


def scalar_inertia_dynamics(
    robot: Robot, inertias: ArrayLike, q: ArrayLike, qd: ArrayLike
) -> tuple[Reals, Reals, Reals]:
    """Mass matrix, Coriolis forces and gravity with scalar inertias, for a chain of turning joints.

    Parameters
    ----------
    robot : Robot
        With masses; its tensors are not used.
    inertias : array_like, (n,)
        One number for each link, kg m².
    q, qd : array_like, (..., n)

    Returns
    -------
    mass : array, (..., n, n)
    coriolis, gravity : array, (..., n)

    Raises
    ------
    MissingInertiaError
    TypeError, ValueError
        Where an argument has another shape.
    """
    robot._need_inertia()
    n = len(robot.kinds)
    scalars = real_array(inertias, f"{robot.name}: inertias", (n,), "one for each link")
    shape, (flat, speeds) = robot._together((q, "q"), (qd, "qd"))
    moved = np.moveaxis(pga3.motor_product(robot.forward_all(flat), pga3.motor_inverse(robot.home)), -2, 0)
    axes = np.moveaxis(robot.twists_of_joints(flat), -2, 0)
    velocity = np.zeros((len(flat), n, n, 3))
    rate = np.zeros_like(velocity)
    for i in range(n):
        centre = pga3.move_point(moved[i], robot.bodies[i, 1:4])
        twist = np.zeros_like(axes[0])
        carried = []
        for j in range(i + 1):
            carried.append(twist)
            twist = twist + speeds[:, j, None] * axes[j]
        moving = pga3.twist_on_point(twist, centre)
        for j in range(i + 1):
            velocity[:, i, j] = pga3.twist_on_point(axes[j], centre)
            drag = pga3.twist_on_line(carried[j], axes[j])
            # the axis changes as it is dragged along, and the centre moves
            rate[:, i, j] = pga3.twist_on_point(drag, centre)
            rate[:, i, j] += pga3.twist_on_point(axes[j], moving) - pga3.twist_on_point(axes[j], np.zeros(3))
    masses = robot.bodies[:, 0]
    mass = np.einsum("bikx,i,bijx->bkj", velocity, masses, velocity)
    later = np.maximum.outer(np.arange(n), np.arange(n))
    mass += np.cumsum(scalars[::-1])[::-1][later]
    coriolis = np.einsum("bikx,i,bijx,bj->bk", velocity, masses, rate, speeds)
    gravity = -np.einsum("bikx,i,x->bk", velocity, masses, robot.free_fall)
    return mass.reshape(*shape, n, n), coriolis.reshape(*shape, n), gravity.reshape(*shape, n)
