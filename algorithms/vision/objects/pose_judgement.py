"""What justifies a pose: its residuals, its covariance, symmetries, and other poses that are as good."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi, sqrt
from typing import Any

import numpy as np

from generated import object_poses as kernels
from generated import pga3

from ...arguments import Reals
from ...evidence import WRONG, Freedom, Noise, largest_ratio, log_false_alarms
from ...evidence.noise import USUAL_WEIGHT
from ...evidence.status import RARE
from ...evidence.triangles import from_triangle
from ...precision import ROOT, ROUNDING, SINGLE, TINY
from .pose_doubts import doubts
from .pose_images import with_rims_turned, without_thin_images
from .pose_minima import (
    NONE,
    REJECTED,
    Minima,
    PoseTask,
    limited_costs,
    minima,
    near_minima,
    polished,
    pose_by_consensus,
    thorough_minima,
)
from .pose_models import KINDS, Measurements
from .pose_record import PoseEstimate, bounds_of, deviations_of, twist_between
from .pose_starts import reversals
from .pose_status import PoseStatus

_FEW_WRONG = 3
"""More rejected pixels of an edge, a silhouette or one of several cameras than those that agree, by more than this
number, refute a pose."""
_LEAST_FREEDOM = 4
"""If measurements are rejected, the least number of redundant equations apart from one for each that is rejected: few
may agree with a wrong pose by chance."""
_OF_POINTS = Freedom(sample_size=3, parameters=6, codimension=2, solutions=4, false_alarms=WRONG)
_FEW, _SURE = 8, 20
"""The numbers of redundant equations below which other minima are searched from many poses, the second if measurements
are rejected."""
_NEARLY_ALL = 0.97
"""The fraction of pixels of edges and silhouettes that must agree; otherwise, too, other minima are searched."""
_RULED_OUT = 2.0
"""Thin images rule a pose out if they increase the cost, with distances limited, by more than this factor."""
_AS_GOOD = 30.0
"""Another pose is as good if its sum of squares is larger by less than this, in squared standard deviations."""
_SAME = 2e-3
"""Poses are the same if they move samples by less than this fraction of the size of the model."""
_APART = 0.05
"""Poses are different, even if they are uncertain, if they move samples by this fraction of the size of the model."""
_TURN = 0.4
"""The rotation in radians by which symmetries are verified."""
_MOTIONS = np.diag([-2.0, 2, -2, -2, -2, -2])[:, [2, 1, 0, 3, 4, 5]]
"""Rotation vectors and displacements of the origin by unit bivectors, as rows."""
_NO_INLIERS = {kind: np.zeros(0, bool) for kind in KINDS}


def judged(found: Minima, task: PoseTask) -> PoseEstimate:
    """Return the best of several minima with the status that its residuals and its neighbourhood justify."""
    best = int(found.costs.argmin())
    if not found.costs[best] < NONE:
        return no_pose(PoseStatus.NOT_CONVERGED, task.seen)
    whole = task
    clear = without_thin_images(task.model, found.poses[best], task.seen, task.noise)
    if clear is not None:
        used = task._replace(seen=clear)
        again = near_minima(found.poses, used)
        # Thin images are used if without them more motions are free.
        if again.costs.min() < NONE and len(_of_least(again, used)[0].freedoms) <= len(
            _of_least(found, task)[0].freedoms
        ):
            task, found = used, again
    while True:
        result, cost, count, freedom = _of_least(found, task)
        if result.status == PoseStatus.BEHIND_CAMERA:
            front = [k for k in np.flatnonzero(found.costs < NONE) if _is_in_front(found.poses[k], task)]
            if front:
                found = Minima(found.poses[front], found.costs[front])
                continue
        if result.status not in (PoseStatus.OK, PoseStatus.SYMMETRIC):
            return result
        found = _joined([found, *_neighbours(result, count, task)])
        better = np.flatnonzero(found.costs < cost - _likely_difference(result, task))
        better = np.array([k for k in better if _is_in_front(found.poses[k], task)], int) if len(better) else better
        if not len(better):
            return _compared(result, cost, found, task, whole, freedom)
        found = Minima(found.poses[better], found.costs[better])


def _of_least(found: Minima, task: PoseTask) -> tuple[PoseEstimate, float, float, int]:
    """Return the pose of least cost with the status that its residuals justify, its cost, its pixels and freedom."""
    seen, noise = task.seen, task.noise
    best = int(found.costs.argmin())
    motor = found.poses[best] if found.poses[best, 0] >= 0 else -found.poses[best]
    motor, table, cost = polished(motor, task)
    far, covariance, count, equations, squares, behind, condition = _verified(motor, table, task)
    inliers = _NO_INLIERS.copy()
    for kind in seen.kinds:
        inliers[kind] = far[kind] <= REJECTED * noise
    free = np.zeros((0, 6))
    if not condition * ROOT < 1:
        covariance, free = _covariance(table, task)
    freedom = int(equations) - 6 + len(free)
    covariance *= _variance(noise, squares, freedom)
    cause = PoseStatus.OK
    is_whole = count == seen.n_pixels
    if (
        (is_whole and freedom < 0)
        or not (is_whole or _are_enough(far["points"], inliers, freedom, seen.n_equations - equations, task))
        or not squares <= noise * noise * max(freedom, 1) * largest_ratio(max(freedom, 1), probability=RARE)
    ):
        cause = PoseStatus.INCONSISTENT
    elif behind:
        cause = PoseStatus.BEHIND_CAMERA
    elif len(free):
        cause = PoseStatus.SYMMETRIC if _are_symmetries(motor, free, table, task) else PoseStatus.UNDETERMINED
    if cause not in (PoseStatus.OK, PoseStatus.SYMMETRIC):
        motor = np.full(8, np.nan)
    residual = sqrt(squares / max(count, 1))
    determined = covariance
    if len(free):
        unlimited = np.abs(_displacements(free, task)).max(0) > SINGLE
        covariance = covariance + np.diag(np.where(unlimited, np.inf, 0))
    return (
        PoseEstimate(motor, cause, residual, covariance, free, np.zeros((0, 8)), inliers, determined),
        min(cost, float(found.costs[best])),
        count,
        freedom,
    )


def _are_enough(far: Reals, inliers: dict[str, Reals], freedom: int, rejected: float, task: PoseTask) -> bool:
    """Return whether the measurements that agree with a pose prove it, though others are rejected.

    Either most agree, and rejected equations are fewer than redundant ones; or all are points, and wrong ones, which
    are as dense as the nearer half of the rejected ones and nowhere less than in all of the image that points cover,
    would rarely agree with any pose as well.
    """
    seen = task.seen
    if task.is_independent and _is_against(inliers, seen):
        return False
    if freedom >= _LEAST_FREEDOM + rejected and _most_agree(inliers, seen):
        return True
    if seen.kinds != ("points",):
        return False
    one = seen.of["points"]
    area = min(float(np.prod(np.ptp(one.pixels[one.cameras == k], axis=0))) for k in np.unique(one.cameras))
    middle = float(np.median(far[~inliers["points"]]))
    most = (REJECTED * task.noise) ** 2
    share = min(max(pi * most / max(area, TINY), most / (2 * middle**2)), 1.0)
    chance = log_false_alarms(len(one.rows), inliers["points"].sum(), np.asarray(share), _OF_POINTS)
    return bool(chance < np.log(_OF_POINTS.false_alarms))


def _most_agree(inliers: dict[str, Reals], seen: Measurements) -> bool:
    """Return whether most pixels of each kind agree with a pose, and not clearly fewer of any edge or silhouette."""
    for kind in seen.kinds:
        one = seen.of[kind]
        signs = one.weights * np.where(inliers[kind], 1.0, -1.0)
        if signs.sum() < 0 or (kind != "points" and np.bincount(one.rows, signs).min() < -_FEW_WRONG):
            return False
    return True


def _is_against(inliers: dict[str, Reals], seen: Measurements) -> bool:
    """Return whether clearly fewer pixels of one of several cameras agree with a pose than do not."""
    if len(seen.cameras) == 1:
        return False
    signs = np.concatenate([seen.of[kind].weights * np.where(inliers[kind], 1.0, -1.0) for kind in seen.kinds])
    return bool(np.bincount(np.concatenate([seen.of[kind].cameras for kind in seen.kinds]), signs).min() < -_FEW_WRONG)


def _neighbours(found: PoseEstimate, count: float, task: PoseTask) -> list[Minima]:
    """Return minima that may be as good: from reversed and turned poses, and if little is certain, from many."""
    seen = task.seen
    turned = reversals(task.model, found.motor, seen)
    groups = [minima(turned, task)]
    if "rims" in seen.kinds:
        over = with_rims_turned(task.model, found.motor, seen, task.noise)
        groups += [near_minima(over, task)] if len(over) else []
    if count < seen.n_pixels:
        # Rejected pixels lead plain least squares away from poses that agree with the others.
        groups.append(near_minima(turned, task))
        again = pose_by_consensus(task) if 2 * count <= seen.n_pixels else None
        groups += [] if again is None else [near_minima(again, task)]
    freedom = seen.n_equations - 6 + len(found.freedoms)
    if seen.kinds == ("points",):
        is_sure = freedom >= (_FEW if count == seen.n_pixels else _SURE)
    else:
        is_sure = count > _NEARLY_ALL * seen.n_pixels
    return groups if is_sure else [*groups, *thorough_minima(task)]


def _joined(groups: list[Minima]) -> Minima:
    poses, costs = zip(*groups, strict=True)
    return Minima(np.concatenate(poses), np.concatenate(costs))


def _is_in_front(pose: Reals, task: PoseTask) -> bool:
    return not _verified(pose, np.zeros(21), task)[5]


def _compared(
    result: PoseEstimate, cost: float, found: Minima, task: PoseTask, whole: PoseTask, freedom: int
) -> PoseEstimate:
    """Return a pose with the final status, after the comparison with other minima."""
    others = _others(result, cost, found, task)
    if len(others) and whole.seen is not task.seen:
        # Thin images do not determine the pose, but they may rule others out.
        costs = limited_costs(np.concatenate([result.motor[None], others]), whole)
        others = others[costs[1:] <= _RULED_OUT * costs[0] + _likely_difference(result, task)]
    result = replace(result, alternatives=others)
    if len(others):
        return replace(result, status=PoseStatus.AMBIGUOUS)
    found_doubts = doubts(result, task, freedom) if task.is_independent else []
    uncertain = [doubt.more for doubt in found_doubts if doubt.more is not None]
    if uncertain:
        size = task.model.size
        motions = _displacements(np.diag([1.0, 1, 1, size, size, size]), task)
        more = motions.T @ sum(uncertain) @ motions
        result = replace(result, covariance=result.covariance + more, determined=result.determined + more)
    if any(doubt.contradicts for doubt in found_doubts):
        return replace(result, status=PoseStatus.UNEXPLAINED)
    if any(a > b for a, b in zip(bounds_of(result.determined), task.limits, strict=True)):
        return replace(result, status=PoseStatus.UNCERTAIN)
    return result


def _likely_difference(found: PoseEstimate, task: PoseTask) -> float:
    """Return how much larger the sum of squares of another pose may be that is as good, for noise that is found."""
    return _AS_GOOD * max(task.noise, found.residual) ** 2


def _variance(noise: float, squares: float, freedom: int) -> float:
    """Return a variance of pixels with which normal numbers have the bounds of errors.

    Residuals raise the stated one, which is only as certain as `USUAL_WEIGHT` of them; it is less if they prove that.
    As the quantiles of Fisher's distribution exceed those of chi-square, few residuals prove little.
    """
    freedom = max(freedom, 0)
    raised = max(noise * noise, float(Noise(noise * noise, USUAL_WEIGHT).raised(np.asarray(squares), freedom)))
    raised *= largest_ratio(3, USUAL_WEIGHT + freedom) / largest_ratio(3)
    if not freedom:
        return raised
    least = freedom * largest_ratio(freedom, probability=1 - WRONG)
    return min(raised, max(squares / least, ROUNDING * noise * noise))


def _verified(
    motor: Reals, table: Reals, task: PoseTask, limit: float | None = None
) -> tuple[dict[str, Reals], Reals, float, float, float, float, float]:
    """Return distances by kind, the covariance for a noise of one pixel, and the numbers of the kernel `judge_pose`."""
    most = REJECTED * task.noise if limit is None else limit
    judge: Any = kernels.judge_pose  # mypy takes seconds to find that unpacked arguments fit no overload
    *far, covariance, numbers = judge(motor, *task.seen.arguments, table, task.model.size, task.model.centre, most)
    count, equations, squares, behind, condition = numbers.tolist()
    return dict(zip(KINDS, far, strict=True)), covariance, count, equations, squares, behind, condition


def _covariance(table: Reals, task: PoseTask) -> tuple[Reals, Reals]:
    """Return the covariance for a noise of one pixel without undetermined bivectors, and these (k, 6)."""
    values, vectors = np.linalg.eigh(from_triangle(table, 6), UPLO="U")
    open_ones = values <= ROOT * max(float(values[-1]), TINY)
    size = np.array([1, 1, 1, *[task.model.size] * 3])
    bivectors = (size[:, None] * vectors).T
    motions = _displacements(bivectors, task)
    spread = np.where(open_ones, 0, 1 / np.where(open_ones, 1, values))
    return (motions.T * spread) @ motions, bivectors[open_ones]


def _displacements(bivectors: Reals, task: PoseTask) -> Reals:
    """Return the rotation vectors and displacements of the centre (k, 6) by bivectors."""
    motions = bivectors @ _MOTIONS
    motions[:, 3:] += motions[:, :3] @ task.model.lever
    return np.asarray(motions)


def _are_symmetries(motor: Reals, free: Reals, table: Reals, task: PoseTask) -> bool:
    """Return whether undetermined motions change no image, not to first order only."""

    def squares(pose: Reals) -> float:
        return _verified(pose, table, task, inf)[4]

    most = squares(motor) * (1 + 1e-3) + _AS_GOOD * task.noise**2
    for bivector in free:
        by = 0.5 * _TURN * bivector / max(float(np.abs(bivector).max()), TINY)
        if not all(squares(pga3.motor_product(motor, pga3.motor_exponential(s * by))) <= most for s in (1, -1)):
            return False
    return True


def _others(found: PoseEstimate, cost: float, near: Minima, task: PoseTask) -> Reals:
    """Return the minima (k, 8) in front of the cameras that explain the images as well as the pose that was found."""
    as_good = near.costs <= cost + _likely_difference(found, task)
    if not len(found.freedoms):
        as_good &= _away(near.poses, found.motor, found, task)
    if not as_good.any():
        return np.zeros((0, 8))
    kept: list[Reals] = []
    for pose in near.poses[as_good]:
        differs = all(_differ(pose, other, found, task) for other in (found.motor, *kept))
        if differs and _is_in_front(pose, task):
            kept.append(pose)
    return np.array(kept).reshape(-1, 8) if kept else np.zeros((0, 8))


def _away(poses: Reals, motor: Reals, found: PoseEstimate, task: PoseTask) -> Reals:
    """Return for each pose whether it moves the samples of the model away from where another motor moves them."""
    size = task.model.size
    turn, shift = deviations_of(found.covariance)
    least = _SAME * size + min(2 * (turn * size + shift), _APART * size)
    return np.asarray(kernels.distance_of_poses(poses, motor, task.model.samples) > least * least)


def _differ(pose: Reals, other: Reals, found: PoseEstimate, task: PoseTask) -> bool:
    """Return whether two poses differ by more than their uncertainty and undetermined motions."""
    if not len(found.freedoms):
        return bool(_away(pose[None], other, found, task)[0])
    twist = twist_between(pose, other, task.model.size, found.freedoms)
    return bool(np.sqrt(twist @ twist) > 10 * _SAME)


def no_pose(status: PoseStatus, seen: Measurements) -> PoseEstimate:
    """Return the record of a pose that was not found."""
    rejected = {kind: np.zeros(len(seen.of[kind].pixels), bool) for kind in KINDS}
    unknown = np.full((6, 6), np.inf)
    return PoseEstimate(
        np.full(8, np.nan), status, np.nan, unknown, np.zeros((0, 6)), np.zeros((0, 8)), rejected, unknown
    )
