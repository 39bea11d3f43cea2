"""Rigid motions by homogeneous matrices of numpy and scipy: exponentials, logarithms, and motors that they move."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from algorithms.arguments import Reals
from generated import pga3


def moved(motors: Reals, turns: Reals) -> Reals:
    """Move motors by rotation vectors and translations in their frames, by scipy and numpy."""
    return of_matrices(matrices(motors) @ matrix_exponential(turns))


def matrices(motors: Reals) -> Reals:
    return np.asarray(pga3.motor_to_matrix(motors))


def of_matrices(rows: Reals) -> Reals:
    return np.asarray(pga3.motor_from_matrix(rows))


def hat(vector: Reals) -> Reals:
    x, y, z = np.moveaxis(vector, -1, 0)
    o = np.zeros_like(x)
    return np.stack([np.stack(row, -1) for row in ((o, -z, y), (z, o, -x), (-y, x, o))], -2)


def left_jacobian(turn: Reals) -> Reals:
    """The integral of rotations by t times the vector for t from 0 to 1."""
    angle = np.maximum(np.linalg.norm(turn, axis=-1), 1e-9)[..., None, None]
    k = hat(turn)
    return np.eye(3) + (1 - np.cos(angle)) / angle**2 * k + (angle - np.sin(angle)) / angle**3 * k @ k


def matrix_exponential(turns: Reals) -> Reals:
    turns = np.asarray(turns)
    found = np.zeros((*turns.shape[:-1], 4, 4))
    found[..., :3, :3] = (
        Rotation.from_rotvec(turns[..., :3].reshape(-1, 3)).as_matrix().reshape(*turns.shape[:-1], 3, 3)
    )
    found[..., :3, 3] = (left_jacobian(turns[..., :3]) @ turns[..., 3:, None])[..., 0]
    found[..., 3, 3] = 1
    return found


def matrix_logarithm(rows: Reals) -> Reals:
    turn = Rotation.from_matrix(rows[..., :3, :3].reshape(-1, 3, 3)).as_rotvec().reshape(*rows.shape[:-2], 3)
    return np.concatenate([turn, np.linalg.solve(left_jacobian(turn), rows[..., :3, 3:])[..., 0]], -1)
