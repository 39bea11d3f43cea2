"""Relation between the velocities of a floating base and the rates of the six joints that carry it at the origin."""

from __future__ import annotations

import numpy as np

from generated import pga3

from ..arguments import Reals


def times(matrix: Reals, v: Reals) -> Reals:
    """Return the products of matrices (..., m, n) and vectors (..., n)."""
    return (matrix @ v[..., None])[..., 0]


def rotated(base: Reals, rows: Reals) -> Reals:
    """Rotate angular over linear velocities (..., 6, n) from the base frame to the world frame."""
    rotation = pga3.motor_to_matrix(base)[..., :3, :3]
    return np.concatenate([rotation @ rows[..., :3, :], rotation @ rows[..., 3:, :]], axis=-2)


def cross_matrix(w: Reals) -> Reals:
    """Return the matrix (..., 3, 3) of the cross product with `w`."""
    found = np.zeros((*w.shape, 3), w.dtype)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[..., i, j], found[..., j, i] = -w[..., k], w[..., k]
    return found


def velocity_map_rate(v: Reals) -> Reals:
    """Return the time derivative (..., 6, 6), at home, of the matrix from the base's joint rates to its velocities.

    The block of the prismatic joints is the transposed rotation of the base; that of the revolute joints is the
    textbook matrix for yaw, pitch and roll rates.
    """
    found = np.zeros((*v.shape[:-1], 6, 6), v.dtype)
    found[..., 0, 2], found[..., 1, 2], found[..., 2, 1] = -v[..., 1], v[..., 0], -v[..., 0]
    found[..., 3:, 3:] = -cross_matrix(v[..., :3])
    return found


def velocity_map_rate_derivative(v: Reals) -> Reals:
    """Return the derivative (..., 6, 6) of ``velocity_map_rate(v) @ v`` with respect to `v`."""
    found = velocity_map_rate(v)
    found[..., 0, 1], found[..., 1, 0], found[..., 2, 0] = -v[..., 2], v[..., 2], -v[..., 1]
    found[..., 3:, :3] = cross_matrix(v[..., 3:6])
    return found
