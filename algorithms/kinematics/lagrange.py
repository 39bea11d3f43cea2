"""Lagrangian dynamics in the form of the book: matrices of inner products of mass centres with joint axes.

Bayro-Corrochano, *Geometric Computing* (2010), chapter 12: with ``V_ij = x_i . l_j``, the velocity of the centre of
mass of link i caused by joint j, the mass matrix is ``Vᵀ m V + δ I``, the Coriolis forces are ``Vᵀ m V' qd`` and the
gravity forces ``Vᵀ m a``. Each link has a scalar moment of inertia and rotates at the sum of the preceding joint rates.
This is exact only if all axes are parallel. Except for comparison, use `Robot.mass_matrix` and the related methods,
which use the full inertia tensors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from .robot import Robot
from .tables import need_inertia


def scalar_inertia_dynamics(
    robot: Robot, inertias: ArrayLike, q: ArrayLike, qd: ArrayLike
) -> tuple[Reals, Reals, Reals]:
    """Return mass matrix, Coriolis forces and gravity forces with scalar inertias, for a chain of revolute joints.

    Parameters
    ----------
    robot : Robot
        A robot with known masses. Its inertia tensors are not used.
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
        If an argument has a wrong shape.
    """
    need_inertia(robot)
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
