"""The record of a pose of an object, and how large its errors may be."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, sqrt

import numpy as np

from generated import pga3

from ...arguments import Reals
from .pose_status import PoseStatus

_QUANTILE = 3.09
"""The standard normal number that is exceeded with a probability of one in a thousand."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseEstimate:
    """Result of `estimate_pose`."""

    motor: Reals
    """(8,) The unit motor from the frame of the object to that of the world; NaN if the status
    is another one than OK, SYMMETRIC, AMBIGUOUS, UNCERTAIN and UNEXPLAINED."""
    status: PoseStatus
    residual: float
    """The root mean square distance of the measurements that agree with the pose, in pixels."""
    covariance: Reals
    """(6, 6) Of the rotation vector and of the displacement of the centre of the model, in the frame of the object;
    infinite along `freedoms`."""
    freedoms: Reals
    """(k, 6) Bivectors B such that the poses ``motor exp(t B)`` have the same images."""
    alternatives: Reals
    """(k, 8) Other poses that explain the images as well."""
    inliers: dict[str, Reals]
    """For each kind of element, whether its pixels agree with the pose, in the order of the views."""
    determined: Reals
    """(6, 6) The same covariance without the motions along `freedoms`: that of the error from the nearest pose with the
    same images. Of an object without symmetries it is `covariance`."""

    @property
    def is_found(self) -> bool:
        """Whether the pose is known, at least up to a symmetry."""
        return self.status in (PoseStatus.OK, PoseStatus.SYMMETRIC)

    @property
    def deviations(self) -> tuple[float, float]:
        """The standard deviations of the rotation, in radians, and of the displacement of the centre."""
        return deviations_of(self.covariance)

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the errors of the rotation, in radians, and of the displacement of the centre.

        By the covariance, an error exceeds its bound with a probability of one in a thousand.
        """
        return bounds_of(self.covariance)


def twist_between(pose: Reals, other: Reals, size: float, freedoms: Reals) -> Reals:
    """Return the motion (6,) from another pose to a pose, without the part along freedoms, as a bivector.

    Translations are in multiples of a size.
    """
    units = np.array([1, 1, 1, size, size, size])
    between = pga3.motor_product(pga3.motor_inverse(other), pose)
    twist = pga3.motor_logarithm(between if between[0] >= 0 else -between) / units
    free = np.linalg.qr((freedoms / units).T)[0]
    return np.asarray(twist - free @ (free.T @ twist))


def deviations_of(covariance: Reals) -> tuple[float, float]:
    """Return the standard deviations of rotation and displacement."""
    a, b, c, d, e, f = covariance.diagonal().tolist()
    return sqrt(a + b + c), sqrt(d + e + f)


def bounds_of(covariance: Reals) -> tuple[float, float]:
    """Return the bounds of the errors of rotation and displacement."""
    return bound_of(covariance[:3, :3]), bound_of(covariance[3:, 3:])


def bound_of(covariance: Reals) -> float:
    """Return the length that an error with a covariance (3, 3) exceeds with a probability of one in a thousand.

    The squared length is approximated by a multiple of a chi-square number with the same mean and variance, and that
    by the cube of a normal number (Wilson and Hilferty); the result is at most 2 % too large, and not too small.
    """
    (a, d, e), (_, b, f), (_, _, c) = covariance.tolist()
    mean = a + b + c
    if not isfinite(mean):
        return inf
    squares = a * a + b * b + c * c + 2 * (d * d + e * e + f * f)
    part = 2 * squares / (9 * mean * mean) if mean > 0 else 0.0
    return sqrt(mean * (1 - part + _QUANTILE * sqrt(part)) ** 3)
