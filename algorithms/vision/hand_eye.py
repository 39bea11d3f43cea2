"""Hand-eye calibration: the motor X with ``A X = X B`` for all motions A of a hand and B of the camera on it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array


class HandEyeStatus(IntEnum):
    """Whether motions determine the place of the camera."""

    OK = 0
    TOO_FEW = 1
    """Fewer than two motions."""
    PARALLEL_AXES = 2
    """The axes of all motions are parallel, or they do not turn: the camera may be moved along the axes."""
    AMBIGUOUS_SIGNS = 3
    """Fewer than two motions that are not half turns: ``A X = X B`` and ``A X = -X B`` cannot be told apart."""
    NOT_FINITE = 4
    """A coefficient is infinite or not a number."""


@dataclass(frozen=True, slots=True, eq=False)
class HandEye:
    """The place of a camera on a hand, and how well motions determine it."""

    motor: Reals
    """(..., 8) X, with scalar part not negative; NaN where the status is TOO_FEW or NOT_FINITE."""
    status: Reals
    """(...) int, a `HandEyeStatus` each. The motor is one of the solutions where axes are parallel."""
    singular_values: Reals
    """(..., 8) Of all equations, descending. The last two are what noise leaves; the sixth says how far from parallel
    the axes are."""
    rotation_residual: Reals
    """(...) The root of the mean square of the angles between ``A X`` and ``X B``, in radians."""
    translation_residual: Reals
    """(...) The root of the mean square of the distances between where ``A X`` and ``X B`` take the origin."""


_HALF_TURN = 0.02
"""A motion is a half turn, for its sign, where the cosine of half its angle is below this."""
_PARALLEL = 1e-7
"""Axes are parallel where the sixth singular value is below this part of the first,"""
_ABOVE_NOISE = 3.0
"""or below this many times the seventh."""


def hand_eye(a: ArrayLike, b: ArrayLike) -> HandEye:
    """The motor X with ``A X = X B`` in the least squares over all motions, rotation and translation at once.

    Each pair gives eight linear equations for the coefficients of X. Without noise their null space is spanned by X and
    X I (Bayro-Corrochano, Daniilidis and Sommer, *JMIV* 13:79, 2000), so that any null vector, put back onto the Study
    quadric, is X. Lengths are measured in those of the motions: the result does not depend on units.

    Parameters
    ----------
    a, b : array_like, (..., n, 8)
        Unit motors between two poses of the hand, and of the camera. Signs do not matter. Leading axes broadcast.

    Returns
    -------
    HandEye

    Raises
    ------
    TypeError, ValueError
        Where an argument has another shape or type, or the numbers of motions differ.

    Notes
    -----
    Without noise the error of X is about 1e-15 times the first singular value over the sixth.
    """
    one, two = real_array(a, "a", (-1, 8), "motors"), real_array(b, "b", (-1, 8), "motors")
    if one.shape[-2] != two.shape[-2]:
        raise ValueError(f"b: {two.shape[-2]} motions; expected {one.shape[-2]}, as many as a has")
    one, two = (np.array(each) for each in np.broadcast_arrays(one, two))
    leading, n_motions = one.shape[:-2], one.shape[-2]
    finite = np.asarray(np.isfinite(one).all((-1, -2)) & np.isfinite(two).all((-1, -2)))
    if n_motions < 2 or not finite.any():
        code = np.where(finite, HandEyeStatus.TOO_FEW, HandEyeStatus.NOT_FINITE)
        none = np.full((*leading, 8), np.nan, one.dtype)
        return HandEye(none, code, none.copy(), none[..., 0].copy(), none[..., 0].copy())
    # Problems with numbers that are not finite are solved as another, and then marked.
    identity = np.eye(8, dtype=one.dtype)[0]
    one, two = (np.where(finite[..., None, None], each, identity) for each in (one, two))

    # Lengths: coefficients with e0 are half of them.
    unit = np.sqrt(np.mean(one[..., 4:] ** 2 + two[..., 4:] ** 2, axis=(-1, -2)))
    unit = np.asarray(np.where(unit > 0, unit, 1))[..., None]
    scale = np.concatenate([np.ones((*leading, 4)), np.repeat(unit, 4, -1)], -1).astype(one.dtype)
    one, two = one / scale[..., None, :], two / scale[..., None, :]

    # A X = X B leaves the scalar and the pseudoscalar part alone; where they vanish the sign is that of a first X.
    agreement = one[..., 0] * two[..., 0] + one[..., 7] * two[..., 7]
    clear = np.asarray(np.abs(one[..., 0]) >= _HALF_TURN)
    two = two * np.where(agreement < 0, -1, 1)[..., None].astype(two.dtype)
    motor, values = _null_motor(one, two, clear)
    if not clear.all():
        left, right = pga3.motor_product(one, motor[..., None, :]), pga3.motor_product(motor[..., None, :], two)
        opposite = ~clear & (np.einsum("...i,...i->...", left[..., :4], right[..., :4]) < 0)
        two = np.where(opposite[..., None], -two, two)
        motor, values = _null_motor(one, two, np.ones_like(clear))

    parallel = (values[..., 5] <= _PARALLEL * values[..., 0]) | (values[..., 5] <= _ABOVE_NOISE * values[..., 6])
    status = np.where(parallel, HandEyeStatus.PARALLEL_AXES, HandEyeStatus.OK)
    status = np.where(clear.sum(-1) < 2, HandEyeStatus.AMBIGUOUS_SIGNS, status)
    status = np.where(finite, status, HandEyeStatus.NOT_FINITE)
    angle, distance = _residuals(one, two, motor)
    motor = np.where(finite[..., None], motor * scale, np.nan)
    return HandEye(motor, status, values, angle, distance * unit[..., 0])


def _null_motor(a: Reals, b: Reals, used: Reals) -> tuple[Reals, Reals]:
    """The motor nearest to solving all equations, and the singular values of these."""
    equations = np.where(used[..., None, None], pga3.motor_equation(a, b), 0)
    rows = equations.reshape(*equations.shape[:-3], -1, 8)
    _, values, right = np.linalg.svd(rows, full_matrices=False)
    plane = np.swapaxes(right[..., 6:, :], -1, -2)
    # Of the plane of X and X I, the direction that turns most: X I has no rotor.
    direction = np.linalg.svd(plane[..., :4, :])[2][..., 0, :]
    motor = pga3.normalize_motor((plane @ direction[..., None])[..., 0])
    return motor * np.where(motor[..., :1] < 0, -1, 1).astype(motor.dtype), values


def _residuals(a: Reals, b: Reals, motor: Reals) -> tuple[Reals, Reals]:
    left, right = pga3.motor_product(a, motor[..., None, :]), pga3.motor_product(motor[..., None, :], b)
    between = pga3.motor_product(left, pga3.motor_inverse(right))
    angle = 2 * np.arctan2(np.linalg.norm(between[..., 1:4], axis=-1), np.abs(between[..., 0]))
    apart = pga3.motor_to_rotor_translation(left)[1] - pga3.motor_to_rotor_translation(right)[1]
    return np.sqrt(np.mean(angle**2, -1)), np.sqrt(np.mean(np.sum(apart**2, -1), -1))
