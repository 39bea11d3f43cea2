"""Velocities of a base that floats, and the rates of the six joints that carry it at the origin."""

from __future__ import annotations

import numpy as np

from generated import pga3

from ..arguments import Reals


def times(matrix: Reals, v: Reals) -> Reals:
    """Matrices (..., m, n) times vectors (..., n)."""
    return (matrix @ v[..., None])[..., 0]


def turned(base: Reals, rows: Reals) -> Reals:
    """Angular over linear velocities (..., 6, n) in the directions of the world."""
    turn = pga3.motor_to_matrix(base)[..., :3, :3]
    return np.concatenate([turn @ rows[..., :3, :], turn @ rows[..., 3:, :]], axis=-2)


def crossing(w: Reals) -> Reals:
    """The matrix (..., 3, 3) of the vector product by `w`."""
    found = np.zeros((*w.shape, 3), w.dtype)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[..., i, j], found[..., j, i] = -w[..., k], w[..., k]
    return found


def turning(v: Reals) -> Reals:
    """The rate (..., 6, 6) of the matrix that makes the base's velocities of the rates of its six joints, at home.

    Of slides it is the rotation of the base, transposed; of the turns by yaw, pitch and roll the matrix of textbooks.
    """
    found = np.zeros((*v.shape[:-1], 6, 6), v.dtype)
    found[..., 0, 2], found[..., 1, 2], found[..., 2, 1] = -v[..., 1], v[..., 0], -v[..., 0]
    found[..., 3:, 3:] = -crossing(v[..., :3])
    return found


def turning_slope(v: Reals) -> Reals:
    """The derivative (..., 6, 6) of `turning` times the velocities by the velocities."""
    found = turning(v)
    found[..., 0, 1], found[..., 1, 0], found[..., 2, 0] = -v[..., 2], v[..., 2], -v[..., 1]
    found[..., 3:, :3] = crossing(v[..., 3:6])
    return found
