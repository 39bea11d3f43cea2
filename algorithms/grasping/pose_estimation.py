"""Poses of objects from points, straight edges and silhouettes in one or more images, verified before they are OK."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import radians
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri

from generated import object_poses as kernels
from generated import pga3

from ..arguments import Reals, finite_number, real_array
from ..vision.localization import localize
from ..vision.status import VisionStatus
from .pose_models import KINDS, Measurements, ObjectModel, View, measurements
from .pose_starts import camera_axes, reversals, starts
from .pose_status import PoseStatus

_EXACT = 1e6
"""A scale of robust weights that is larger than any image, in pixels."""
_SCALE, _REJECTED = 6.0, 5.0
"""The scale of robust weights, and the distance from which a measurement is rejected, in standard deviations."""
_LEAST_SHARE = 0.5
"""Least fraction of measurements that agree with a pose."""
_FREE = 1e-7
"""Motions are undetermined if they move pixels by less than this fraction of what other motions do."""
_AS_GOOD = 30.0
"""Another pose is as good if its sum of squares is larger by less than this, in squared standard deviations."""
_IMPROBABLE = 1e-6
_SAME = 2e-3
"""Poses are the same if they move samples by less than this fraction of the size of the model."""
_TURN_LIMIT, _SHIFT_LIMIT = radians(1), 0.05
_TURN = 0.4
"""The rotation in radians by which symmetries are verified."""
_RETRIED = (PoseStatus.INCONSISTENT, PoseStatus.NOT_CONVERGED, PoseStatus.BEHIND_CAMERA)
_UPPER = np.triu_indices(6)
_MOTIONS = np.zeros((6, 6))
"""Rotation vectors and displacements of the origin by unit bivectors, as rows."""
_MOTIONS[range(6), (2, 1, 0, 3, 4, 5)] = -2, 2, -2, -2, -2, -2


@dataclass(frozen=True, slots=True, eq=False)
class PoseEstimate:
    """Result of `estimate_pose`."""

    motor: Reals
    """(8,) The unit motor from the frame of the object to that of the world; NaN if the status
    is another one than OK, SYMMETRIC, AMBIGUOUS and UNCERTAIN."""
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

    @property
    def is_found(self) -> bool:
        """Whether the pose is known, at least up to a symmetry."""
        return self.status in (PoseStatus.OK, PoseStatus.SYMMETRIC)

    @property
    def deviations(self) -> tuple[float, float]:
        """The standard deviations of the rotation, in radians, and of the displacement of the centre."""
        variances = self.covariance.diagonal()
        return float(variances[:3].sum()) ** 0.5, float(variances[3:].sum()) ** 0.5


def estimate_pose(
    model: ObjectModel,
    views: View | Sequence[View],
    start: ArrayLike | None = None,
    noise: float = 0.3,
    tolerance: tuple[float, float] | None = None,
) -> PoseEstimate:
    """Estimate the pose of an object from one or more images of it.

    Levenberg-Marquardt steps on motors minimise the distances in pixels between measurements and the images of the
    elements of the model, with robust weights (Geman and McClure). Without `start`, they begin at two poses from four
    or more points, or at 24 rotations. Other minima are searched from turned and reversed poses.

    Parameters
    ----------
    model : ObjectModel
    views : View or sequence of View
        The cameras, and the pixels at which they see the elements.
    start : array_like, (8,), optional
        A pose near the true one, such as that of the preceding image.
    noise : float
        The standard deviation of a pixel's coordinate.
    tolerance : (float, float), optional
        The largest standard deviations of the rotation, in radians, and of the displacement of the model's centre. By
        default one degree, and a twentieth of the size of the model.

    Returns
    -------
    PoseEstimate
        The status OK guarantees a minimum with residuals that the noise explains, all elements in front of the cameras,
        no motion that leaves the images as they are, and no second pose that was found to be as good. For every other
        status, `PoseStatus` states the cause.

    Raises
    ------
    TypeError, ValueError
        If shapes or types disagree, there is no view, `noise` is not positive, or `start` is not a motor.
    """
    seen = measurements(model, (views,) if isinstance(views, View) else tuple(views))
    if not finite_number(noise, "noise") > 0:
        raise ValueError(f"noise: {noise}; expected a positive number of pixels")
    guess = None if start is None else _start(start)
    if not all(np.isfinite(seen.pixels[kind]).all() for kind in KINDS):
        return _nothing(PoseStatus.NOT_FINITE, seen)
    if seen.n_equations < 6:
        return _nothing(_why_too_few(model, seen, guess), seen)
    task = _Task(model, seen, noise)
    poses, costs = _minima(starts(model, seen) if guess is None else guess[None], task)
    found = _judged(poses, costs, task)
    if found.status in _RETRIED:
        again = _by_consensus(task)
        if again is not None:
            poses, costs = _minima(again[None], task)
            found = _judged(poses, costs, task)
    limits = (_TURN_LIMIT, _SHIFT_LIMIT * model.size) if tolerance is None else tolerance
    if found.status == PoseStatus.OK and any(a > b for a, b in zip(found.deviations, limits, strict=True)):
        return replace(found, status=PoseStatus.UNCERTAIN)
    return found


class _Task(NamedTuple):
    model: ObjectModel
    seen: Measurements
    noise: float


def _start(start: ArrayLike) -> Reals:
    given = real_array(start, "start", (8,), "a motor").astype(np.float64)
    if given.ndim != 1 or not np.abs(given - pga3.normalize_motor(given)).max() < 1e-6:
        raise ValueError(f"start: {given}; expected one unit motor of generated.pga3")
    return given


def _why_too_few(model: ObjectModel, seen: Measurements, guess: Reals | None) -> PoseStatus:
    """Return why there are too few measurements."""
    if guess is not None:
        there = pga3.move_point(guess, model.centre)
        if not (seen.cameras[:, 2, :3] @ there + seen.cameras[:, 2, 3] > 0).all():
            return PoseStatus.BEHIND_CAMERA
    return PoseStatus.OCCLUDED if seen.n_equations + 2 * seen.n_missing >= 6 else PoseStatus.TOO_FEW


def _minima(first: Reals, task: _Task) -> tuple[Reals, Reals]:
    """Return minima (b, 8) and their sums of robust squares, infinite if the iterations ended early.

    Descents begin with plain least squares, whose basin is wider.
    """
    given, size, rough = task.seen.arguments, task.model.size, 1e-6 * task.noise * task.noise
    poses = first
    if len(first) > 1 and task.seen.n_equations > 2 * len(task.seen.pixels["points"]):
        every = np.concatenate([task.seen.pixels[kind] for kind in KINDS])
        poses = kernels.refine_pose(poses, *given, size, _EXACT, rough, float(every.std()) / size)[0]
    poses = kernels.refine_pose(poses, *given, size, _EXACT, rough, 0.0)[0]
    poses, _, _, numbers = kernels.refine_pose(poses, *given, size, _SCALE * task.noise, rough, 0.0)
    return poses, np.where((numbers[:, 1] > 0) & np.isfinite(numbers[:, 0]), numbers[:, 0], np.inf)


def _judged(poses: Reals, costs: Reals, task: _Task) -> PoseEstimate:
    """Return the best of several minima with the status that its residuals and its neighbourhood justify."""
    model, seen, noise = task
    best = int(np.argmin(costs))
    if not np.isfinite(costs[best]):
        return _nothing(PoseStatus.NOT_CONVERGED, seen)
    motor = poses[best] if poses[best, 0] >= 0 else -poses[best]
    motor, table, _, numbers = kernels.refine_pose(motor, *seen.arguments, model.size, _SCALE * noise, 1e-12, 0.0)
    far, in_front = _residuals(motor, seen)
    inliers = {kind: far[kind] <= _REJECTED * noise for kind in KINDS}
    agreeing = np.concatenate([far[kind][inliers[kind]] for kind in KINDS])
    squares, n = float(agreeing @ agreeing), sum(map(len, far.values()))
    residual = float(np.sqrt(squares / max(len(agreeing), 1)))
    covariance, free = _covariance(table, task)
    result = PoseEstimate(motor, PoseStatus.OK, residual, covariance, free, np.zeros((0, 8)), inliers)
    freedom = seen.n_equations - (n - len(agreeing)) * (2 if len(far["points"]) == n else 1) - 6 + len(free)
    cause = PoseStatus.OK
    if len(agreeing) < _LEAST_SHARE * n or freedom < 0 or squares > noise * noise * _most(freedom):
        cause = PoseStatus.INCONSISTENT
    elif not in_front:
        cause = PoseStatus.BEHIND_CAMERA
    elif len(free):
        cause = PoseStatus.SYMMETRIC if _are_symmetries(motor, free, task) else PoseStatus.UNDETERMINED
    if cause not in (PoseStatus.OK, PoseStatus.SYMMETRIC):
        return replace(result, motor=np.full(8, np.nan), status=cause)
    others = _others(result, float(numbers[0]), poses, costs, task)
    return replace(result, alternatives=others, status=PoseStatus.AMBIGUOUS if len(others) else cause)


def _most(freedom: int) -> float:
    """Return the sum of squared standard deviations that noise exceeds with a small probability only."""
    return float(chdtri(max(freedom, 1), _IMPROBABLE))


def _residuals(motor: Reals, seen: Measurements) -> tuple[dict[str, Reals], bool]:
    """Return the distances of pixels by kind, and whether all elements are in front of the cameras."""
    found = kernels.residuals_of_pose(motor, *seen.arguments)
    far = {kind: np.where(np.isfinite(part[:, 0]), part[:, 0], np.inf) for kind, part in zip(KINDS, found, strict=True)}
    return far, all((part[:, 1] > 0).all() for part in found)


def _covariance(table: Reals, task: _Task) -> tuple[Reals, Reals]:
    """Return the covariance of rotation and displacement of the centre, and the undetermined bivectors (k, 6)."""
    matrix = np.zeros((6, 6))
    matrix[_UPPER] = table
    values, vectors = np.linalg.eigh(matrix, UPLO="U")
    open_ones = values <= _FREE * max(float(values[-1]), 1e-300)
    size = np.array([1, 1, 1, *[task.model.size] * 3])
    bivectors = (size[:, None] * vectors).T
    motions = bivectors @ _MOTIONS
    motions[:, 3:] += motions[:, :3] @ task.model.lever
    spread = np.where(open_ones, 0, task.noise**2 / np.where(open_ones, 1, values))
    covariance = (motions.T * spread) @ motions
    if open_ones.any():
        covariance[np.diag_indices(6)] += np.where(np.abs(motions[open_ones]).max(0) > 1e-6, np.inf, 0)
    return covariance, bivectors[open_ones]


def _are_symmetries(motor: Reals, free: Reals, task: _Task) -> bool:
    """Return whether undetermined motions change no image, not to first order only."""

    def squares(pose: Reals) -> float:
        every = np.concatenate(list(_residuals(pose, task.seen)[0].values()))
        return float(every @ every)

    most = squares(motor) * (1 + 1e-3) + _AS_GOOD * task.noise**2
    for bivector in free:
        by = 0.5 * _TURN * bivector / max(float(np.abs(bivector).max()), 1e-300)
        if not all(squares(pga3.motor_product(motor, pga3.motor_exponential(s * by))) <= most for s in (1, -1)):
            return False
    return True


def _others(found: PoseEstimate, cost: float, poses: Reals, costs: Reals, task: _Task) -> Reals:
    """Return other minima (k, 8) in front of the cameras that explain the images as well."""
    more, more_costs = _minima(reversals(task.model, found.motor, task.seen.cameras[0]), task)
    every = np.concatenate([poses, more])[np.concatenate([costs, more_costs]) <= cost + _AS_GOOD * task.noise**2]
    if not len(found.freedoms):
        every = every[_away(every, found.motor, found, task)]
    kept: list[Reals] = []
    for pose in every:
        if all(_differ(pose, other, found, task) for other in (found.motor, *kept)) and _residuals(pose, task.seen)[1]:
            kept.append(pose)
    return np.array(kept).reshape(-1, 8)


def _away(poses: Reals, motor: Reals, found: PoseEstimate, task: _Task) -> Reals:
    """Return for each pose whether it moves the samples of the model away from where another motor moves them."""
    samples = task.model.samples
    off = pga3.move_point(poses[:, None], samples) - pga3.move_point(motor, samples)
    least = _SAME * task.model.size + 2 * (found.deviations[0] * task.model.size + found.deviations[1])
    return np.asarray(np.einsum("ijk,ijk->i", off, off) > len(samples) * least * least)


def _differ(pose: Reals, other: Reals, found: PoseEstimate, task: _Task) -> bool:
    """Return whether two poses differ by more than their uncertainty and undetermined motions."""
    if not len(found.freedoms):
        return bool(_away(pose[None], other, found, task)[0])
    between = pga3.motor_product(pga3.motor_inverse(other), pose)
    twist = pga3.motor_logarithm(between if between[0] >= 0 else -between)
    size = np.array([1, 1, 1, *[task.model.size] * 3])
    free = np.linalg.qr((found.freedoms / size).T)[0]
    scaled = twist / size
    scaled = scaled - free @ (free.T @ scaled)
    return bool(np.sqrt(scaled @ scaled) > 10 * _SAME)


def _by_consensus(task: _Task) -> Reals | None:
    """Return a pose from random samples of the points of the camera that sees most of them."""
    seen = task.seen
    if len(seen.of_camera["points"]) < 6:
        return None
    camera = int(np.bincount(seen.of_camera["points"]).argmax())
    own = seen.of_camera["points"] == camera
    axes, k = camera_axes(seen.cameras[camera])
    found = localize(seen.elements["points"][own], seen.pixels["points"][own], k, threshold=_REJECTED * task.noise)
    if found.status != VisionStatus.OK:
        return None
    back = np.eye(4)
    back[:3, :3] = axes.T
    back[:3, 3] = -np.linalg.solve(seen.cameras[camera, :, :3], seen.cameras[camera, :, 3])
    return np.asarray(pga3.motor_product(pga3.motor_from_matrix(back), pga3.motor_inverse(found.pose)))


def _nothing(status: PoseStatus, seen: Measurements) -> PoseEstimate:
    rejected = {kind: np.zeros(len(seen.pixels[kind]), bool) for kind in KINDS}
    return PoseEstimate(
        np.full(8, np.nan), status, np.nan, np.full((6, 6), np.inf), np.zeros((0, 6)), np.zeros((0, 8)), rejected
    )
