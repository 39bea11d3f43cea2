"""Means of rigid motions. The signs of motors do not matter, since ``m`` and ``-m`` are the same motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite, real_array
from ..elements import MOTOR, Coefficients, E, Some, elements


@dataclass(frozen=True, slots=True, eq=False)
class MotorMean:
    """An intrinsic mean, and the convergence of its computation."""

    motor: Coefficients
    """(8) The mean."""
    converged: bool
    """Whether the last step was of the size of rounding errors."""
    iterations: int
    """The number of steps."""
    residual: float
    """The length of the last step, the larger of radians and units of the coordinates."""


@overload
def average_motors(motors: Some[E], weights: ArrayLike | None = None) -> E: ...
@overload
def average_motors(motors: ArrayLike, weights: ArrayLike | None = None) -> Reals: ...
@elements(MOTOR, motors=MOTOR)
def average_motors(motors: Any, weights: ArrayLike | None = None) -> Any:
    """Return the weighted linear average of motors, projected onto the Study quadric (dual quaternion linear blending).

    The signs of the motors are chosen by the dominant eigenvector of ``sum w r r^T`` of the rotors r (Markley et al.,
    *J. Guidance* 30:1193, 2007), so that the given signs do not matter. The result equals `mean_motor` for two motors
    with equal weights and approximates it otherwise (Kavan et al., *Dual Quaternions for Rigid Transformation
    Blending*, 2006).

    Parameters
    ----------
    motors : array_like, (..., n, 8)
        Unit motors.
    weights : array_like, (..., n), optional
        Nonnegative weights with a positive sum. By default all are equal.

    Returns
    -------
    array, (..., 8)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, there is no motor, a motor is not finite, a weight is negative or all
        weights are 0.
    """
    given, share = _weighted(motors, weights)
    rotors = given[..., :4]
    moments = np.einsum("...n,...ni,...nj->...ij", share, rotors, rotors)
    axis = np.linalg.eigh(moments)[1][..., -1]
    signs = np.where(np.einsum("...ni,...i->...n", rotors, axis) < 0, -1, 1)
    total = np.einsum("...n,...ni->...i", share * signs, given)
    return np.asarray(pga3.normalize_motor(total))


@elements({"motor": MOTOR}, motors=MOTOR)
def mean_motor(motors: ArrayLike, weights: ArrayLike | None = None, max_iterations: int = 100) -> MotorMean:
    """Return the intrinsic mean of motors: the motion from which the weighted sum of the twists to all motors is 0.

    This is the exponential barycenter of Pennec and Arsigny (*Matrix Information Geometry*, 2013). It is equivariant
    under multiplication of all motors from the left or from the right. For rotations it is the Karcher mean. It is
    computed by fixed-point iteration starting from `average_motors`, and it is unique if all rotations are within
    90 degrees of one rotation.

    Parameters
    ----------
    motors : array_like, (n, 8)
        Unit motors.
    weights : array_like, (n), optional
        Nonnegative weights with a positive sum. By default all are equal.
    max_iterations : int, optional
        At least 1.

    Returns
    -------
    MotorMean
        `converged` is false if the rotations are spread so widely that there may be no mean or several.

    Raises
    ------
    TypeError, ValueError
        As in `average_motors`.
    """
    given, share = _weighted(motors, weights)
    if given.ndim != 2:
        raise ValueError(f"motors: shape {given.shape}; expected (any, 8), one set of motors")
    if max_iterations < 1:
        raise ValueError(f"max_iterations: {max_iterations}; expected at least 1")
    mean = average_motors(given, share)
    size = 1 + float(np.abs(given[:, 4:]).max())
    residual = np.inf
    for iteration in range(1, max_iterations + 1):
        step = share @ pga3.motor_logarithm(pga3.motor_relative(mean, given))
        mean = pga3.normalize_motor(pga3.motor_product(mean, pga3.motor_exponential(step)))
        previous, residual = residual, 2 * float(np.abs(step).max())
        rounding = 16 * float(np.finfo(given.dtype).eps) * size
        if residual <= rounding:
            return MotorMean(np.asarray(mean), True, iteration, residual)
        if residual >= previous and residual <= 16 * rounding:
            return MotorMean(np.asarray(mean), True, iteration, residual)
    return MotorMean(np.asarray(mean), False, max_iterations, residual)


def _weighted(motors: ArrayLike, weights: ArrayLike | None) -> tuple[Reals, Reals]:
    """Return validated motors and weights with sum 1."""
    given = finite(real_array(motors, "motors", (-1, 8), "unit motors"), "motors")
    count = given.shape[-2]
    if not count:
        raise ValueError("motors: none; expected at least one")
    share = real_array(np.ones(count) if weights is None else weights, "weights", (count,), "a weight for each motor")
    total = share.sum(-1, keepdims=True)
    if np.any(share < 0) or np.any(total <= 0) or not np.all(np.isfinite(total)):
        raise ValueError("weights: expected finite nonnegative numbers with a positive sum")
    return given, (share / total).astype(given.dtype)
