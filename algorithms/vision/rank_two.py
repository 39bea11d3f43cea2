"""Matrices of rank 2 as ``U diag(1, s, 0) V'`` with rotations U and V: seven parameters (Bartoli and Sturm 2004)."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals

_GENERATORS = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]]
)


def factors(matrix: Reals) -> tuple[Reals, Reals, Reals]:
    """Return U (..., 3, 3), s (...) and V (..., 3, 3) of the nearest matrices of rank 2, up to scale."""
    u, values, right = np.linalg.svd(matrix)
    v = np.swapaxes(right, -1, -2)
    u = u * np.sign(np.linalg.det(u))[..., None, None]
    v = v * np.sign(np.linalg.det(v))[..., None, None]
    return u, values[..., 1] / values[..., 0], v


def of_factors(u: Reals, ratio: Reals, v: Reals) -> Reals:
    """Return the matrix with these factors, with largest singular value 1."""
    return u @ _middle(ratio) @ np.swapaxes(v, -1, -2)


def directions(u: Reals, ratio: Reals, v: Reals) -> Reals:
    """Return the derivatives (..., 9, 7) of its nine entries with respect to rotations after U and V, and s."""
    middle, right = _middle(ratio), np.swapaxes(v, -1, -2)
    columns = [u @ generator @ middle @ right for generator in _GENERATORS] + [
        -u @ middle @ generator @ right for generator in _GENERATORS
    ]
    columns.append(u[..., :, 1:2] * right[..., 1:2, :])
    return np.stack([column.reshape(*column.shape[:-2], 9) for column in columns], -1)


def _middle(ratio: Reals) -> Reals:
    middle = np.zeros((*np.shape(ratio), 3, 3))
    middle[..., 0, 0], middle[..., 1, 1] = 1, ratio
    return middle
