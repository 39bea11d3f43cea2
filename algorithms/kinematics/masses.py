"""Moving and merging rigid bodies about their own centres, and physical consistency of inertia tensors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from generated import pga3

from ..precision import SINGLE
from .bodies import moved

_IDENTITY = np.eye(8)[0]


def placed(motor: NDArray[np.float64], body: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a body (10,) moved by a motor, as `moved`, but without cancellation far from the origin."""
    about_itself = body.copy()
    about_itself[1:4] = 0.0
    rotor, _ = pga3.motor_to_rotor_translation(motor)
    found = moved(pga3.motor_from_rotor_translation(rotor, np.zeros(3)), [about_itself])
    found[1:4] = pga3.move_point(motor, body[1:4])
    return found


def joined(bodies: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Merge several bodies into one body (10,), summed about the centre of the first."""
    if not bodies:
        return np.zeros(10)
    shift = np.zeros(10)
    shift[1:4] = bodies[0][1:4]
    return moved(_IDENTITY, [body - shift for body in bodies]) + shift


def fault_of(tensor: Sequence[float]) -> str:
    """Return why an inertia tensor is not physically consistent, or an empty string if it is.

    The matrix of second moments ``S = (trace(T) / 2) E - T``, the integral of ``x xᵀ``, must be positive semidefinite.
    Then the principal moments are not negative, and none is larger than the sum of the other two.

    Parameters
    ----------
    tensor : 6 floats
        xx, xy, xz, yy, yz, zz.
    """
    xx, xy, xz, yy, yz, zz = map(float, tensor)
    slack = SINGLE * max(map(abs, (xx, xy, xz, yy, yz, zz)))
    if slack == 0:
        return ""
    if not _positive((xx + slack, xy, xz, yy + slack, yz, zz + slack)):
        return "a principal moment of inertia is negative"
    half = (xx + yy + zz) / 2 + slack
    if not _positive((half - xx, -xy, -xz, half - yy, -yz, half - zz)):
        return "a principal moment of inertia is larger than the sum of the two others"
    return ""


def _positive(matrix: Sequence[float]) -> bool:
    """Return whether a symmetric matrix xx, xy, xz, yy, yz, zz is positive definite, by its leading minors."""
    largest = max(map(abs, matrix))
    xx, xy, xz, yy, yz, zz = (x / largest for x in matrix)
    minor = xx * yy - xy * xy
    return xx > 0 and minor > 0 and xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz) > 0
