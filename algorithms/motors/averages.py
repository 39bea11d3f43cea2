"""Means of rigid motions. Motors ``m`` and ``-m`` are the same motion, whatever signs they come with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite, real_array


@dataclass(frozen=True, slots=True, eq=False)
class MotorMean:
    """An intrinsic mean, and how well it was found."""

    motor: Reals
    """(8) The mean."""
    converged: bool
    """Whether the last step was as small as rounding."""
    iterations: int
    """How many steps were taken."""
    residual: float
    """The length of the last step, the larger of radians and units of the coordinates."""


def average_motors(motors: ArrayLike, weights: ArrayLike | None = None) -> Reals:
    """The weighted linear average of motors, put back onto the Study quadric: the mean of DLB.

    Signs are those that agree with the eigenvector of ``sum w r r^T`` of the rotors r (Markley et al., *J. Guidance*
    30:1193, 2007), so that they do not matter. Exact for two motors with equal weights; else near `mean_motor` (Kavan
    et al., *Dual Quaternions for Rigid Transformation Blending*, 2006).

    Parameters
    ----------
    motors : array_like, (..., n, 8)
        Unit motors.
    weights : array_like, (..., n), optional
        Not negative, with a positive sum. By default all are equal.

    Returns
    -------
    array, (..., 8)

    Raises
    ------
    TypeError, ValueError
        Where an argument has another shape or type, there is no motor or one that is not finite, or a weight is
        negative or all are 0.
    """
    given, share = _weighted(motors, weights)
    rotors = given[..., :4]
    moments = np.einsum("...n,...ni,...nj->...ij", share, rotors, rotors)
    axis = np.linalg.eigh(moments)[1][..., -1]
    signs = np.where(np.einsum("...ni,...i->...n", rotors, axis) < 0, -1, 1)
    total = np.einsum("...n,...ni->...i", share * signs, given)
    return np.asarray(pga3.normalize_motor(total))


def mean_motor(motors: ArrayLike, weights: ArrayLike | None = None, max_iterations: int = 100) -> MotorMean:
    """The intrinsic mean of motors: the motion from which the weighted sum of twists to all of them is 0.

    The exponential barycenter of Pennec and Arsigny (*Matrix Information Geometry*, 2013): it goes along when all
    motors are moved, from the left or from the right. For rotations it is Karcher's mean. Fixed-point steps from
    `average_motors`; it is unique where all rotations are within a quarter turn of one.

    Parameters
    ----------
    motors : array_like, (n, 8)
        Unit motors.
    weights : array_like, (n), optional
        Not negative, with a positive sum. By default all are equal.
    max_iterations : int, optional
        At least 1.

    Returns
    -------
    MotorMean
        `converged` is false where rotations are spread so far that there may be no mean, or several.

    Raises
    ------
    TypeError, ValueError
        As `average_motors` does.
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
    """Motors and weights of sum 1."""
    given = finite(real_array(motors, "motors", (-1, 8), "unit motors"), "motors")
    count = given.shape[-2]
    if not count:
        raise ValueError("motors: none; expected at least one")
    share = real_array(np.ones(count) if weights is None else weights, "weights", (count,), "a weight for each motor")
    total = share.sum(-1, keepdims=True)
    if np.any(share < 0) or np.any(total <= 0) or not np.all(np.isfinite(total)):
        raise ValueError("weights: expected finite numbers, none negative, with a positive sum")
    return given, (share / total).astype(given.dtype)
