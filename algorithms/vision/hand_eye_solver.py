"""Solvers for the equations of hand-eye calibration, for many problems at once: linear solutions and their refinement.

Arrays have one axis of problems before that of motions or poses, and are in double precision.
"""

from __future__ import annotations

from functools import lru_cache
from math import isqrt
from typing import Literal

import numpy as np

from generated import hand_eye as kernels
from generated import pga3

from ..arguments import Reals
from ..precision import ROOT, SINGLE, TINY
from . import hand_eye_noise as noises
from .hand_eye_noise import called
from .hand_eye_results import HandEyeStatus

Noise = Literal["either", "hand", "camera"]

_HALF_TURN = 0.02
"""The sign of a motion is ambiguous (a half turn) if the cosine of half its angle is below this."""
_OPEN = 0.2
"""Axes count as parallel if noise leaves a rotation of the camera undetermined by more than this, in radians."""
_ABOVE_NOISE = 3.0
"""Angles are small if they are below this multiple of the rotational residual."""
_STEPS = 6
"""Maximum number of Gauss-Newton steps, for motions and for poses."""
_DONE = 1e-4
"""Iteration ends with a step that reduces the sum of squares by less than this fraction."""
_ROUNDING = 1e-30
"""From floating point: sums of squares below this are rounding errors, in square units."""


@lru_cache(64)
def _pairs(n_poses: int) -> tuple[Reals, Reals]:
    """Return the first and the second pose of all pairs, in the order of `numpy.triu_indices`."""
    return np.triu_indices(n_poses, 1)


def between(poses: Reals) -> Reals:
    """Return motions (p, n (n - 1) / 2, 8) between all pairs of poses (p, n, 8), ordered as `numpy.triu_indices`."""
    return np.asarray(called(kernels.motions_between, (poses,), *_pairs(poses.shape[1])))


def of_all_poses(one: Reals, two: Reals, hands: Reals, eyes: Reals, refine: bool, noise: Noise) -> list[Reals]:
    """Return X, status, singular values, residual and Z from poses and the motions between them."""
    motor, status, values, _ = solved(hands, eyes, False)
    motor, world, residual = refined(one, two, motor, status, noise, refine)
    return [motor, status, values, residual, world]


def of_motions(one: Reals, two: Reals, closed: Reals, refine: bool) -> list[Reals]:
    """Return the results of `solved`; those of the problems that are `closed` are refined as for poses."""
    if not closed.any():
        return solved(one, two, refine)
    if closed.all():
        return _of_pairs(one, two)
    some, others = _of_pairs(one[closed], two[closed]), solved(one[~closed], two[~closed], True)
    found = [np.empty((len(one), *each.shape[1:]), each.dtype) for each in some]
    for whole, left, right in zip(found, some, others, strict=True):
        whole[closed], whole[~closed] = left, right
    return found


@lru_cache(64)
def _triples(count: int) -> tuple[Reals, Reals, Reals] | None:
    """Return triples of motions that close if `count` motions are those of all pairs of poses.

    Each triple has the motions from the first pose to two others and the motion between these. None if `count` is not a
    possible number of pairs.
    """
    n_poses = (1 + isqrt(1 + 8 * count)) // 2
    if n_poses < 3 or n_poses * (n_poses - 1) != 2 * count:
        return None
    return *_pairs(n_poses - 1), np.arange(n_poses - 1, count)


def closed(one: Reals, two: Reals) -> Reals | None:
    """Return which problems (p,) have motions of all pairs of poses, as `numpy.triu_indices`; None if none has."""
    triples = _triples(one.shape[1])
    if triples is None:
        return None
    closed = np.ones(len(one), np.bool_)
    for motions in (one, two):
        closed &= called(kernels.motions_close, (motions,), *triples, SINGLE) > 0
        if not closed.any():
            return None
    return closed


def poses(motions: Reals) -> Reals:
    """Return poses (p, k, 8) from motions (p, n, 8) between all pairs; the first pose is the identity."""
    still = np.broadcast_to(np.eye(8)[0], (len(motions), 1, 8))
    return np.concatenate([still, motions[:, : isqrt(2 * motions.shape[1])]], 1)


def _of_pairs(one: Reals, two: Reals) -> list[Reals]:
    """Return the results of `solved` for motions between all pairs of poses."""
    motor, status, values, _ = solved(one, two, False)
    motor, _, _ = refined(poses(one), poses(two), motor, status, None)
    return [motor, status, values, called(kernels.misfit_of_motions, (one, two, motor))]


def refined(
    one: Reals, two: Reals, motor: Reals, status: Reals, noise: Noise | None, refine: bool = True
) -> tuple[Reals, Reals, Reals]:
    """Return X and Z of poses (p, n, 8) and the residuals, from a first X; refined where its status is OK."""
    one, two, x, z, unit, finite = called(kernels.start_of_poses, (one, two, motor))
    moving = (status == HandEyeStatus.OK) & refine
    (x, z), squares = _of_poses(one, two, x, z, moving, noise)
    residual = 2 * np.sqrt(squares / one.shape[1])
    residual[:, 1] *= unit
    residual[finite <= 0] = np.nan
    return *_in_units(x, z, unit, finite), residual


def place(one: Reals, two: Reals) -> tuple[Reals, Reals]:
    """Return the linear solutions X and Z of poses (p, n, 8)."""
    motor = solved(between(one), between(two), False)[0]
    _, _, x, z, unit, finite = called(kernels.start_of_poses, (one, two, motor))
    return _in_units(x, z, unit, finite)


def _in_units(x: Reals, z: Reals, unit: Reals, finite: Reals) -> tuple[Reals, Reals]:
    """Return motors (p, 8), changed in place, in units of length (p,) and with nonnegative scalar parts."""
    for found in (x, z):
        found[found[:, 0] < 0] *= -1.0
        found[:, 4:] *= unit[:, None]
        found[finite <= 0] = np.nan
    return x, z


def solved(one: Reals, two: Reals, refine: bool) -> list[Reals]:
    """Return motors, status, singular values and residuals of problems (p, n, 8)."""
    found = called(kernels.equations_of_motions, (one, two), _HALF_TURN, ROOT)
    one, two, clear, unit, finite, axes, parallel, regular, equations = found
    squares, vectors = np.linalg.eigh(equations)
    values = np.sqrt(np.maximum(squares[:, ::-1], 0.0))
    first, second = (np.ascontiguousarray(vectors[..., k]) for k in (0, 1))
    many = (parallel > 0) | (values[:, 5] <= ROOT * values[:, 0])
    if np.count_nonzero(many):
        # More than two singular values then vanish, and the last vector is arbitrary.
        first[many], second[many] = _least_translated(equations[many]), 0.0
    motions = one, two, clear, first, second, unit, axes, many.astype(float)
    limits = float(_STEPS if refine else 0), _DONE, _ROUNDING, _OPEN
    motor, residual, parallel, largest = called(kernels.fitted_to_motions, motions, *limits)
    status = np.zeros(len(one), np.int_)
    if np.count_nonzero(regular > parallel) == len(one):
        return [motor, status, values, residual]
    small = 2 * largest <= np.maximum(_ABOVE_NOISE * residual[:, 0], ROOT)
    status[parallel > 0] = HandEyeStatus.PARALLEL_AXES
    status[(parallel > 0) & small] = HandEyeStatus.SMALL_ANGLES
    status[clear.sum(-1) < 2] = HandEyeStatus.AMBIGUOUS_SIGNS
    wrong = finite <= 0
    motor[wrong], residual[wrong], status[wrong] = np.nan, np.nan, HandEyeStatus.NOT_FINITE
    return [motor, status, values, residual]


def _least_translated(table: Reals) -> Reals:
    """Return least-squares vectors (p, 8) with a unit rotational part, for normal equations `table` (p, 8, 8).

    Among equivalent vectors, damping selects one with a small translational part.
    """
    across = table[:, 4:, 4:].copy()
    across[:, range(4), range(4)] += (noises.DAMPING * np.trace(table, axis1=1, axis2=2) + TINY)[:, None]
    back = np.linalg.solve(across, table[:, 4:, :4])
    rotation = np.linalg.eigh(table[:, :4, :4] - table[:, :4, 4:] @ back)[1][..., 0]
    return np.concatenate([rotation, -(back @ rotation[..., None])[..., 0]], -1)


def _of_poses(
    one: Reals, two: Reals, x: Reals, z: Reals, moving: Reals, noise: Noise | None
) -> tuple[tuple[Reals, Reals], Reals]:
    """Return X and Z near a start, and the sums of squared residuals at the origin of the camera.

    Noise rotates a hand about its origin and a camera about the origin of its target, where encoders and images
    measure; its variance is estimated too. If `noise` is None, both poses have noise and the position of the target is
    unknown.
    """
    count = len(one)
    place, to_camera = np.zeros((count, 3)), pga3.motor_inverse(two)
    variances = np.tile([float(noise != "camera"), float(noise != "hand"), 1.0], (count, 1))
    used, cost = np.empty((count, 3)), np.empty(count)
    step, squares = np.empty((count, 12)), np.empty((count, 2))
    before, hand, seen = (x, z), place, place
    for step_number in range(_STEPS + 1):
        if noise is None:
            # Motions of the camera do not determine the position of its target: use the point with the least residual.
            noises.still_points(kernels.misfit_of_poses(one, two, x[:, None], z[:, None], to_camera), place)
        rotations, shifts, new_hand, new_seen = called(kernels.rows_of_poses, (one, two, x, z, place))
        if step_number:
            worse = noises.increased(rotations, shifts, hand, seen, used, cost, moving)
            if np.count_nonzero(worse):
                x, z = (np.where(worse[:, None], old, new) for old, new in zip(before, (x, z), strict=True))
        before, hand, seen = (x, z), new_hand, new_seen
        done = noises.likely_steps(
            rotations, shifts, hand, seen, moving, step_number == 0, variances, used, cost, step, squares
        )
        if step_number == _STEPS:
            break
        x, z = called(kernels.moved, (x, z, step.reshape(-1, 2, 6)))
        if done:
            break
    return (x, z), squares
