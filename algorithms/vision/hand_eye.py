"""Hand-eye calibration: the motor X with ``A X = X B`` for all motions A of a hand and B of the camera on it."""

from __future__ import annotations

from math import isqrt, prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import hand_eye as kernels
from generated import pga3

from ..arguments import Reals, leading_axes, real_array
from ..elements import MOTOR, elements
from . import hand_eye_consensus as agreement
from . import hand_eye_noise as noises
from . import hand_eye_solver as solver
from .hand_eye_noise import called
from .hand_eye_results import HandEye, HandEyeOfPoses, HandEyeStatus
from .hand_eye_solver import Noise

_CONTRADICTION = 0.3
"""Data are contradictory if a residual exceeds this value, which is far above the noise of any tracker. The residual
is that of rotations in radians, or of translations relative to the motions, as for mixed units of length."""
_MEANT, _MEANT_SINGLE = 1e-12, 1e-5
"""Translational parts below this, in double and single precision, may be rounding: they need not satisfy the motor
condition."""

_STILL, _STILL_SINGLE = 1e-7, 1e-5
"""Rotation angles below this, in radians, count as zero: far above rounding in double and in single precision."""


@elements({"motor": MOTOR}, a=MOTOR, b=MOTOR)
def hand_eye(a: ArrayLike, b: ArrayLike, refine: bool = True) -> HandEye:
    """Estimate the motor X with ``A X = X B`` by least squares over all motions, rotation and translation at once.

    Each pair gives eight linear equations for the coefficients of X. Without noise their null space is spanned by X and
    X I (Bayro-Corrochano, Daniilidis and Sommer, *JMIV* 13:79, 2000), so that any null vector, projected to the Study
    quadric, is X. Lengths are measured relative to those of the motions, so the result does not depend on units.
    Gauss-Newton steps on the manifold of motors then minimise the residual of ``~(X B) A X``, or that of the inverse
    motions if it is smaller, with rotations and translations weighted by their own noise.

    Motions of all pairs of poses, in the order of `numpy.triu_indices`, are recognised because they close; X is then
    refined as in `hand_eye_from_poses`. Wrong motions are excluded in the same way as wrong poses there.

    Parameters
    ----------
    a, b : array_like, (..., n, 8)
        Unit motors between two poses of the hand, and of the camera, as in `generated.pga3` or `generated.cga3`, which
        have the same coefficients and equations. Signs are irrelevant. Leading axes broadcast. For many poses, the
        motions between all pairs give the best results; `hand_eye_from_poses` uses these.
    refine : bool
        Whether to refine the linear solution.

    Returns
    -------
    HandEye

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type, if it is not a unit motor, or if the numbers of motions differ.

    Notes
    -----
    Without noise, the error of X is about 1e-15 times the ratio of the first to the sixth singular value.
    """
    one, two, leading, dtype, still_below = _two(a, b, "motions")
    if one.shape[1] < 2 or not len(one):
        return _nothing(one, two, leading, dtype)
    closed = solver.closed(one, two)
    pairs = np.zeros(len(one), np.bool_) if closed is None else closed
    screws = _screws(one, two, still_below)
    still = screws.still
    suspect = _suspects_of_motions(screws.misfits, pairs) & ~still
    inliers = np.ones(one.shape[:2], np.bool_)
    found = solver.of_motions(one, two, pairs & refine, refine)
    agreed = np.ones(len(one), np.bool_)
    for p in np.flatnonzero(suspect):
        hand, eye = one[p], two[p]
        some, agreed[p] = _right_motions(hand, eye, bool(pairs[p]))
        inliers[p] = some
        if agreed[p] and not some.all():
            part = solver.of_motions(hand[None, some], eye[None, some], pairs[p : p + 1] & refine, refine)
            _replace(found, p, part)
    found[1] = _tested(found[1], found[3], screws.reach, agreed, still)
    return HandEye(*(_shaped(each, leading, dtype) for each in (*found, inliers)))


@elements({"motor": MOTOR, "world": MOTOR}, a=MOTOR, b=MOTOR)
def hand_eye_from_poses(a: ArrayLike, b: ArrayLike, refine: bool = True, noise: Noise = "either") -> HandEyeOfPoses:
    """Estimate the motors X and Z with ``A X = Z B`` for all poses: those of the camera on the hand and of its target.

    X is the linear solution of `hand_eye` for all pairs of poses, and Z the mean of ``A X ~B``. Gauss-Newton steps for
    both then minimise the residual of ``~(Z B) A X``, weighted by the variances of three kinds of noise: of the
    rotation of the hand, of the rotation of the camera, and of translations. These are estimated at the same time, by
    restricted maximum likelihood.

    Poses that contradict the others, such as those of a pattern that was detected wrongly, are left out. They are
    suspected if the screws of the motions between poses of the hand and of the camera differ by far more than usual for
    the problem. The solution with which most poses agree is then found by least median of squares over sets of three
    poses, and X and Z are estimated from all poses that agree with it. Fewer than half of the poses may be wrong,
    and chance must not explain the others: three often have some solution, so at least four must agree.

    Poses that are not finite, as those of images without a target, are left out too, if three others remain. Exact
    copies of a pair of poses, such as those of a recording that was read twice, count once. The order of poses is
    taken for that of the recording: residuals that successive poses have in common show that the camera moved on the
    hand, or the target on the base.

    If all poses are inverted, X and Z are exchanged; if `a` and `b` are swapped, both are inverted. The data satisfy
    the equation in either convention and cannot tell which one was meant: the status is OK.

    Parameters
    ----------
    a : array_like, (..., n, 8)
        Unit motors from the frame of the hand to that of its base.
    b : array_like, (..., n, 8)
        Unit motors from the frame of the camera to that of its target, as returned by `localize`. Signs are irrelevant.
        Leading axes broadcast.
    refine : bool
        Whether to refine the linear solution.
    noise : {"either", "hand", "camera"}
        The poses with rotational noise: those of the hand, about its origin, those of the camera, about its target, or
        both, with the variances that maximise the likelihood.

    Returns
    -------
    HandEyeOfPoses
        Status and singular values refer to the motions.

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type, if it is not a unit motor, if the numbers of poses differ, or if
        `noise` is unknown.
    """
    if noise not in ("either", "hand", "camera"):
        raise ValueError(f"noise: {noise!r}; expected 'either', 'hand' or 'camera'")
    one, two, leading, dtype, still_below = _two(a, b, "poses")
    n_poses = one.shape[1]
    if n_poses < 3 or not len(one):
        none = _nothing(one, two, leading, dtype)
        parts = none.motor, none.status, none.singular_values, none.residual, none.inliers
        return HandEyeOfPoses(*parts, none.motor.copy(), np.full((*leading, 2), np.inf))
    found = _of_different_poses(one, two, refine, noise, still_below)
    known = np.isfinite(np.concatenate([one, two], -1)).all(-1)
    for p in map(int, np.flatnonzero(~known.all(1) & (known.sum(1) > 2))):
        part = _of_different_poses(one[p : p + 1, known[p]], two[p : p + 1, known[p]], refine, noise, still_below)
        inliers, part[4] = part[4], known[p : p + 1].copy()
        part[4][:, known[p]] = inliers
        _replace(found, p, part)
    return HandEyeOfPoses(*(_shaped(each, leading, dtype) for each in found))


def _of_different_poses(one: Reals, two: Reals, refine: bool, noise: Noise, still_below: float) -> list[Reals]:
    """Return what `_from_poses` does, with copies of poses counted once."""
    found = _from_poses(one, two, refine, noise, still_below)
    for p, first, copied in agreement.copies(one, two):
        part = _from_poses(one[p : p + 1, first], two[p : p + 1, first], refine, noise, still_below)
        part[4] = part[4][:, copied]
        _replace(found, p, part)
    return found


def _from_poses(one: Reals, two: Reals, refine: bool, noise: Noise, still_below: float) -> list[Reals]:
    """Return the arrays of `HandEyeOfPoses` for problems (p, n, 8) of at least three poses."""
    n_poses = one.shape[1]
    hands, eyes = solver.between(one), solver.between(two)
    screws = _screws(hands, eyes, still_below)
    still = screws.still
    suspect = agreement.suspect_poses(screws.misfits, n_poses) & ~still
    inliers, agreed = np.ones((len(one), n_poses), np.bool_), np.ones(len(one), np.bool_)
    found = solver.of_all_poses(one, two, hands, eyes, refine, noise)
    for p in np.flatnonzero(suspect):
        hand, eye = one[p], two[p]
        some, agreed[p] = _right_poses(hand, eye)
        inliers[p] = some
        if agreed[p] and not some.all():
            right, seen = hand[None, some], eye[None, some]
            part = solver.of_all_poses(right, seen, solver.between(right), solver.between(seen), refine, noise)
            _replace(found, p, part)
    floors = np.full(len(one), still_below), still_below * screws.reach
    deviation, contradicted = noises.deviations(one, two, found[0], found[4], inliers, floors)
    found[1] = _tested(found[1], found[3], screws.reach, agreed & ~contradicted, still)
    return [*found[:4], inliers, found[4], deviation]


def _replace(found: list[Reals], p: int | np.integer[Any], part: list[Reals]) -> None:
    """Set the arrays of a problem to those of a single one."""
    for whole, left in zip(found, part, strict=True):
        whole[p] = left[0]


class _Screws(NamedTuple):
    """Properties of motions that are determined before the solution, so that rounding of axes has no influence."""

    misfits: Reals
    """(p, n, 2) Differences of the motions of hand and camera as screws."""
    still: Reals
    """(p,) bool. Whether no motion rotates."""
    reach: Reals
    """(p,) The root mean square of the lengths of translations."""


def _screws(one: Reals, two: Reals, rounding: float) -> _Screws:
    misfits, still, square = called(kernels.screws, (one, two), rounding)
    return _Screws(misfits, still > 0, np.sqrt(square))


def _suspects_of_motions(misfits: Reals, closed: Reals) -> Reals:
    """Return which problems (p,) have suspicious motions, or suspicious poses if motions are those of all pairs."""
    n_motions = misfits.shape[1]
    found = agreement.suspect_motions(misfits)
    if closed.any():
        found[closed] = agreement.suspect_poses(misfits[closed], (1 + isqrt(1 + 8 * n_motions)) // 2)
    return found


def _right_motions(one: Reals, two: Reals, closed: bool) -> tuple[Reals, bool]:
    """Return which motions (n, 8) of one problem agree with most others, and whether to trust these.

    If motions are those of all pairs of poses, they are those between poses that agree.
    """
    if closed:
        right, agreed = _right_poses(solver.poses(one[None])[0], solver.poses(two[None])[0])
        i, j = np.triu_indices(len(right), 1)
        return np.asarray(right[i] & right[j]), agreed

    def place(sets: Reals) -> Reals:
        return solver.solved(one[sets], two[sets], False)[0]

    def squares(motors: Reals, one: Reals, two: Reals) -> Reals:
        return _squares(kernels.misfit(one, two, motors[:, None]))

    return agreement.agreeing(one, two, 2, place, squares)


def _right_poses(one: Reals, two: Reals) -> tuple[Reals, bool]:
    """Return which poses (n, 8) of one problem agree with most others, and whether to trust these."""
    still = np.eye(8)[0]

    def place(sets: Reals) -> Reals:
        return np.stack(solver.place(one[sets], two[sets]), 1)

    def squares(places: Reals, one: Reals, two: Reals) -> Reals:
        x, z, from_seen = places[:, :1], places[:, 1:], pga3.motor_inverse(two)
        rest = kernels.misfit_of_poses(one, two, x, z, from_seen)
        point = np.empty((len(places), 3))
        noises.still_points(rest, point)
        shift = pga3.move_point(from_seen, point[:, None])
        at_point = pga3.motor_from_rotor_translation(np.eye(4)[0], shift)
        # Noise rotates hand and camera about points that it does not move, so the least of these translations is noise.
        others = (kernels.misfit_of_poses(one, two, x, z, frame) for frame in (still, pga3.motor_inverse(x), at_point))
        return np.asarray(np.minimum.reduce([_squares(each) for each in (rest, *others)]))

    return agreement.agreeing(one, two, 3, place, squares)


def _squares(misfits: Reals) -> Reals:
    """Return squares (h, n, 2) of rotations and translations of misfits (h, n, 6)."""
    return np.asarray(4 * (misfits.reshape(*misfits.shape[:2], 2, 3) ** 2).sum(-1))


def _tested(status: Reals, residual: Reals, reach: Reals, agreed: Reals, still: Reals) -> Reals:
    """Return the status: INCONSISTENT if no solution agrees with most of the data or if the residual is not noise.

    Motions without rotation have the status SMALL_ANGLES, whatever was solved. With small angles the solution is
    undetermined, and so are the translational residuals.
    """
    far, rotated = residual[:, 1] > _CONTRADICTION * reach, residual[:, 0] > _CONTRADICTION
    if not np.count_nonzero(still | far | rotated | ~agreed):
        return status
    status = np.where(still, HandEyeStatus.SMALL_ANGLES, status)
    large = (rotated | (far & (status != HandEyeStatus.SMALL_ANGLES)) | ~agreed) & ~still
    open_ = np.isin(status, (HandEyeStatus.TOO_FEW, HandEyeStatus.NOT_FINITE, HandEyeStatus.AMBIGUOUS_SIGNS))
    return np.where(~open_ & large, HandEyeStatus.INCONSISTENT, status)


def _two(a: ArrayLike, b: ArrayLike, what: str) -> tuple[Reals, Reals, tuple[int, ...], np.dtype[Any], float]:
    """Return both in double precision with one axis of problems, the input's leading axes and type, and `_STILL`."""
    one, two = real_array(a, "a", (-1, 8), "motors"), real_array(b, "b", (-1, 8), "motors")
    if one.shape[-2] != two.shape[-2]:
        raise ValueError(f"b: {two.shape[-2]} {what}; expected {one.shape[-2]}, as many as a has")
    leading_axes(("a", one.shape[:-2]), ("b", two.shape[:-2]))
    dtype = one.dtype if one.dtype == two.dtype else np.dtype(np.float64)
    double = one.dtype == two.dtype == np.float64
    rounding, still_below = (_MEANT, _STILL) if double else (_MEANT_SINGLE, _STILL_SINGLE)
    if one.shape != two.shape:
        one, two = np.broadcast_arrays(one, two)
    shape = one.shape
    flat = prod(shape[:-2]), *shape[-2:]
    one, two = (np.ascontiguousarray(each, np.float64).reshape(flat) for each in (one, two))
    bad = called(kernels.first_not_unit, (one, two), rounding)
    if np.count_nonzero(bad >= 0):
        problem = int(np.argmax(bad >= 0))
        side, row = divmod(int(bad[problem]), shape[-2])
        place = ", ".join(map(str, (*np.unravel_index(problem, shape[:-2]), row)))
        name = "ab"[side]
        raise ValueError(f"{name}[{place}]: not a unit motor; expected m ~m = 1; use pga3.normalize_motor({name})")
    return one, two, shape[:-2], dtype, still_below


def _shaped(array: Reals, leading: tuple[int, ...], dtype: np.dtype[Any]) -> Reals:
    kind = dtype if array.dtype.kind == "f" else array.dtype
    if not leading and array.ndim > 1 and kind == array.dtype:
        return np.asarray(array[0])
    return array.reshape((*leading, *array.shape[1:])).astype(kind, copy=False)


def _nothing(one: Reals, two: Reals, leading: tuple[int, ...], dtype: np.dtype[Any]) -> HandEye:
    finite = np.isfinite(one).all((1, 2)) & np.isfinite(two).all((1, 2))
    status = np.where(finite, HandEyeStatus.TOO_FEW, HandEyeStatus.NOT_FINITE).reshape(leading)
    none = np.full((*leading, 8), np.nan, dtype)
    return HandEye(none, status, none.copy(), none[..., :2].copy(), np.zeros((*leading, one.shape[1]), np.bool_))
