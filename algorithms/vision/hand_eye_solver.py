"""Solutions of the equations of hand-eye calibration, for many problems at once: linear ones, and steps from them.

Arrays have one axis of problems before that of motions or poses, and are in double precision.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import isqrt
from typing import Any, Literal

import numpy as np

from generated import hand_eye as kernels
from generated import pga3

from ..arguments import Reals
from . import hand_eye_loops as loops
from . import hand_eye_noise as noises
from .hand_eye_results import HandEyeStatus

Noise = Literal["either", "hand", "camera"]

_HALF_TURN = 0.02
"""A motion is a half turn, for its sign, where the cosine of half its angle is below this."""
_PARALLEL = 1e-7
"""Axes are parallel where they spread by less than this part, or the sixth singular value is below it of the first,"""
_OPEN = 0.2
"""or noise leaves a rotation of the camera open by more radians than this."""
_ABOVE_NOISE = 3.0
"""Angles are small that are below so many times what remains of rotations."""
_STEPS = 6
"""So many steps of Gauss and Newton are taken at most, of motions and of poses."""
_CLOSED = 1e-6
"""Motions are those of all pairs of poses where they differ by no more than this; translations, of the largest."""
_BLOCK = 64
"""So many problems are solved at once: their equations stay in the cache."""
_DONE = 1e-4
"""Steps end with one that lessens the sum of squares by less than this part: those behind it are far less."""
_ROUNDING = 1e-30


def between(poses: Reals) -> Reals:
    """Motions (p, n (n - 1) / 2, 8) between all pairs of poses (p, n, 8), in the order of `numpy.triu_indices`."""
    i, j = np.triu_indices(poses.shape[1], 1)
    return np.asarray(pga3.motor_product(pga3.motor_inverse(poses[:, i]), poses[:, j]))


def of_all_poses(one: Reals, two: Reals, hands: Reals, eyes: Reals, refine: bool, noise: Noise) -> list[Reals]:
    """X, status, singular values, residual and Z of poses and the motions between them, which are overwritten."""
    motor, status, values, _ = by_blocks(hands, eyes, False)
    motor, world, residual = refined(one, two, motor, status if refine else None, noise)
    return [motor, status, values, residual, world]


def of_motions(one: Reals, two: Reals, closed: Reals, refine: bool) -> list[Reals]:
    """As `_solved`, where those of the problems that are `closed` are refined as poses are."""
    if not closed.any():
        return by_blocks(one, two, refine)
    if closed.all():
        return _of_pairs(one, two)
    some, others = _of_pairs(one[closed], two[closed]), by_blocks(one[~closed], two[~closed], True)
    found = [np.empty((len(one), *each.shape[1:]), each.dtype) for each in some]
    for whole, left, right in zip(found, some, others, strict=True):
        whole[closed], whole[~closed] = left, right
    return found


@lru_cache(64)
def _pairs_behind_the_first(count: int) -> tuple[Reals, Reals] | None:
    """All pairs of poses but the first, from 0, where so many motions may be those of all pairs; else None."""
    n_poses = (1 + isqrt(1 + 8 * count)) // 2
    if n_poses < 3 or n_poses * (n_poses - 1) != 2 * count:
        return None
    i, j = np.triu_indices(n_poses - 1, 1)
    return i, j


def closed(one: Reals, two: Reals) -> Reals | None:
    """Which problems (p,) have motions of all pairs of poses, in the order of `numpy.triu_indices`; None where none."""
    pairs = _pairs_behind_the_first(one.shape[1])
    if pairs is None:
        return None
    i, j = pairs
    closed = np.ones(len(one), np.bool_)
    for motions in (one, two):
        # Poses but the first are the first motions.
        between = called(pga3.motor_product, called(pga3.motor_inverse, motions[:, i]), motions[:, j])
        if not loops.same_motions(between, motions, _CLOSED, closed):
            return None
    return closed


def poses(motions: Reals) -> Reals:
    """Poses (p, k, 8) of motions (p, n, 8) between all pairs: the first does not move."""
    still = np.broadcast_to(np.eye(8)[0], (len(motions), 1, 8))
    return np.concatenate([still, motions[:, : isqrt(2 * motions.shape[1])]], 1)


def _of_pairs(one: Reals, two: Reals) -> list[Reals]:
    """As `_solved`, of motions between all pairs of poses."""
    motor, status, values, _ = by_blocks(one.copy(), two.copy(), False)
    motor, _, _ = refined(poses(one), poses(two), motor, status, None)
    return [motor, status, values, _remains(one, two, motor)]


def refined(
    one: Reals, two: Reals, motor: Reals, status: Reals | None, noise: Noise | None
) -> tuple[Reals, Reals, Reals]:
    """X and Z of poses (p, n, 8), and what they leave, from a first X; refined where its status is OK."""
    clear, unit, finite = np.empty(one.shape[:2], np.bool_), np.empty(len(one)), np.empty(len(one), np.bool_)
    spread, parallel = np.empty(len(one)), np.empty(len(one), np.bool_)
    loops.in_own_lengths(one, two, _HALF_TURN, _PARALLEL, clear, unit, finite, spread, parallel)
    x = np.where(finite[:, None], motor, np.eye(8)[0])
    x[:, 4:] /= unit[:, None]
    each = pga3.motor_product(pga3.motor_product(one, x[:, None]), pga3.motor_inverse(two))
    same = np.where(np.einsum("pni,pi->pn", each[..., :4], each[:, 0, :4]) < 0, -1.0, 1.0)[..., None]
    z, two = pga3.normalize_motor((same * each).mean(-2)), same * two
    moving = np.zeros(len(one), np.bool_) if status is None else status == HandEyeStatus.OK
    (x, z), squares = _of_poses(one, two, x, z, moving, noise)
    residual = np.asarray(loops.root_mean_squares(squares, one.shape[1], unit, finite))
    for found in (x, z):
        loops.back_in_lengths(found, unit, finite)
    return x, z, residual


def _remains(one: Reals, two: Reals, motor: Reals) -> Reals:
    """The residual (p, 2) of `HandEye`."""
    rest, before, back = _at_both_ends(one, two, motor)
    rest = rest if back is None else np.where(back[:, None, None], before, rest)
    return np.asarray(2 * np.sqrt(np.mean(np.sum(rest.reshape(*rest.shape[:2], 2, 3) ** 2, -1), 1)))


def _at_both_ends(one: Reals, two: Reals, motor: Reals) -> tuple[Reals, Reals, Reals | None]:
    """Misfits (p, n, 6) of motions and of their inverses, and which problems (p,) these translate less in, or None."""
    rest = called(kernels.misfit, one, two, motor)
    before = called(pga3.move_line, two, rest)
    back = np.empty(len(one), np.bool_)
    return rest, before, back if loops.less_before(rest, before, back) else None


def by_blocks(one: Reals, two: Reals, refine: bool) -> list[Reals]:
    """As `_solved`."""
    parts = [_solved(one[k : k + _BLOCK], two[k : k + _BLOCK], refine) for k in range(0, len(one), _BLOCK)]
    return list(parts[0]) if len(parts) == 1 else [np.concatenate(each) for each in zip(*parts, strict=True)]


def _solved(one: Reals, two: Reals, refine: bool) -> tuple[Reals, Reals, Reals, Reals]:
    """Motors, status, singular values and residuals of problems (p, n, 8), which are overwritten."""
    count = len(one)
    clear, unit, finite = np.empty(one.shape[:2], np.bool_), np.empty(count), np.empty(count, np.bool_)
    (first, second, values), parallel, spread = np.empty((3, count, 8)), np.empty(count, np.bool_), np.empty(count)
    all_clear, all_finite = loops.in_own_lengths(one, two, _HALF_TURN, _PARALLEL, clear, unit, finite, spread, parallel)
    loops.null_space(called(pga3.motor_equation, one, two), clear, _PARALLEL, first, second, values, parallel)
    motor = called(kernels.null_motor, first, second)
    if not all_clear:
        # Where scalar and pseudoscalar part vanish the sign is that of the X of the others.
        loops.choose_signs(one, two, motor, clear)
    one, two = _from_better_end(one, two, motor)
    squares = np.empty((count, 2))
    limits = _DONE, _ROUNDING * one.shape[1], _OPEN
    any_parallel = loops.descend(one, two, motor, _STEPS if refine else 0, limits, spread, parallel, squares)
    residual = loops.root_mean_squares(squares, one.shape[1], unit, finite)
    status = _why(parallel, one, residual) if any_parallel else np.zeros(count, np.int_)
    if not all_clear:
        status[clear.sum(-1) < 2] = HandEyeStatus.AMBIGUOUS_SIGNS
    loops.back_in_lengths(motor, unit, finite)
    if not all_finite:
        status[~finite] = HandEyeStatus.NOT_FINITE
    return motor, status, values, residual


def _of_poses(
    one: Reals, two: Reals, x: Reals, z: Reals, moving: Reals, noise: Noise | None
) -> tuple[tuple[Reals, Reals], Reals]:
    """X and Z near a start, and the sums of squares of what they leave at the origin of the camera.

    Noise turns a hand about its origin, and a camera about that of what it looks at, which is where encoders and
    images measure; how much it does is found with them. Without `noise` it is that of either, and the place looked at
    is unknown.
    """
    count = len(one)
    camera = np.broadcast_to(np.eye(8)[0], two.shape).copy()
    to_camera, place = pga3.motor_inverse(two), np.zeros((count, 3))
    seen = pga3.move_point(to_camera, np.zeros(3))
    variances = np.tile([float(noise != "camera"), float(noise != "hand"), 1.0], (count, 1))
    used, cost, worse = np.empty((count, 3)), np.empty(count), np.empty(count, np.bool_)
    step, squares = np.empty((count, 12)), np.empty((count, 2))
    before = x, z
    frame = place, seen
    for turn in range(_STEPS + 1):
        turns, shifts = called(kernels.misfit_of_poses_equations, one, two, x, z, camera)
        hand = pga3.move_point(pga3.motor_inverse(x), np.zeros(3))
        if noise is None:
            # Motions of the camera do not say where what it looks at is: where what remains moves least.
            noises.still_points(kernels.misfit_of_poses(one, two, x[:, None], z[:, None], to_camera), place)
            seen = pga3.move_point(to_camera, place[:, None])
        if turn and noises.grown(turns, shifts, *frame, used, cost, moving, worse):
            x, z = (np.where(worse[:, None], old, new) for old, new in zip(before, (x, z), strict=True))
        before, frame = (x, z), (hand, seen)
        done = noises.likely_steps(turns, shifts, hand, seen, moving, turn == 0, variances, used, cost, step, squares)
        if turn == _STEPS:
            break
        x, z = _moved(x, step[:, :6]), _moved(z, step[:, 6:])
        if done:
            break
    return (x, z), squares


def _moved(motor: Reals, step: Reals) -> Reals:
    """Motors (p, 8) moved by exponentials of steps (p, 6)."""
    if len(motor) == 1:
        return np.asarray(pga3.motor_product(motor[0], pga3.motor_exponential(step[0]))[None])
    return np.asarray(pga3.motor_product(motor, pga3.motor_exponential(step)))


def called(kernel: Callable[..., Any], *arrays: Reals) -> Any:
    """A kernel on motions (p, n, k), and motors (p, k) that are the same for all motions of a problem.

    One problem has no axis of its own: calls on arrays with one axis cost least.
    """
    if len(arrays[0]) == 1:
        found = kernel(*[each[0] for each in arrays])
        return [part[None] for part in found] if type(found) is tuple else found[None]
    shapes = [each.shape for each in arrays if each.ndim == 3]
    if not shapes:
        return kernel(*arrays)
    count = shapes[0][1]
    flat = [each.reshape(-1, each.shape[-1]) if each.ndim == 3 else np.repeat(each, count, 0) for each in arrays]
    found = kernel(*flat)
    parts = found if isinstance(found, tuple) else (found,)
    folded = tuple(part.reshape(-1, count, *part.shape[1:]) for part in parts)
    return folded if isinstance(found, tuple) else folded[0]


def _from_better_end(one: Reals, two: Reals, motor: Reals) -> tuple[Reals, Reals]:
    """Motions, or their inverses where these leave less of translations: noise is of the end where it is least."""
    _, _, back = _at_both_ends(one, two, motor)
    if back is None:
        return one, two
    turned = [np.where(back[:, None, None], pga3.motor_inverse(each), each) for each in (one, two)]
    return turned[0], turned[1]


def _why(parallel: Reals, a: Reals, residual: Reals) -> Reals:
    """PARALLEL_AXES or SMALL_ANGLES where motions leave the place open."""
    turn = 2 * np.linalg.norm(a[..., 1:4], axis=-1).max(-1)
    small = turn <= np.maximum(_ABOVE_NOISE * residual[:, 0], _PARALLEL)
    return np.where(parallel, np.where(small, HandEyeStatus.SMALL_ANGLES, HandEyeStatus.PARALLEL_AXES), 0)
