"""Which moments of inertia a rigid body can have."""

from __future__ import annotations

from collections.abc import Sequence

_ROUNDING = 1e-6
"""What decimals of a file may do to a tensor, as a part of its trace."""


def fault_of(tensor: Sequence[float]) -> str:
    """Why no rigid body has this tensor of inertia; empty where one may have it.

    A body has a matrix of second moments ``S = (trace(T) / 2) E - T``, the integral of ``x xᵀ``, which is not negative.
    Then the principal moments are not negative, and none is larger than the sum of the two others.

    Parameters
    ----------
    tensor : 6 floats
        xx, xy, xz, yy, yz, zz.
    """
    xx, xy, xz, yy, yz, zz = map(float, tensor)
    slack = _ROUNDING * max(map(abs, (xx, xy, xz, yy, yz, zz)))
    if slack == 0:
        return ""
    if not _positive((xx + slack, xy, xz, yy + slack, yz, zz + slack)):
        return "a principal moment of inertia is negative"
    half = (xx + yy + zz) / 2 + slack
    if not _positive((half - xx, -xy, -xz, half - yy, -yz, half - zz)):
        return "a principal moment of inertia is larger than the sum of the two others"
    return ""


def _positive(matrix: Sequence[float]) -> bool:
    """Whether a symmetric matrix xx, xy, xz, yy, yz, zz is positive definite, by its leading minors."""
    largest = max(map(abs, matrix))
    xx, xy, xz, yy, yz, zz = (x / largest for x in matrix)
    minor = xx * yy - xy * xy
    return xx > 0 and minor > 0 and xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz) > 0
