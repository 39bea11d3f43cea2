"""Track the pose of an object through sequences of images: predict, measure edges, estimate, and verify."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import radians

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ...arguments import Reals, finite_number
from ...elements import MOTOR, elements
from ...evidence import Status, deviation_of_most
from .edge_measurement import MeasuredEdges, edges_near
from .image_arguments import check_outline, checked_mesh, checked_start, real_image
from .image_status import ImageStatus
from .pose_estimation import PoseEstimate, estimated_pose, pose_limits
from .pose_models import KINDS, ObjectModel
from .pose_status import PoseStatus
from .predicted_curves import Mesh
from .scene import SceneCamera
from .silhouette_views import measure_silhouettes
from .tracked_errors import disagreeing, exceeds, with_common_errors, without_refuted_curves

_ROUNDS = (1.0, 0.5, 0.3, 0.3)
"""How far edges are searched in the rounds of one image, as parts of the reach."""
_LEAST_REACH, _GROWTH, _LARGEST_REACH = 3.0, 1.5, 40.0
"""Least reach of a round in pixels, growth of the reach with each image that is missed, and its bound."""
_LEAST_INLIERS, _LEAST_SEEN = 0.75, 0.4
"""Least part of the edges that agree with the pose, and of the visible curves that have an edge which agrees."""
_LARGEST_RESIDUAL = 0.85
"""Largest root mean square residual, as a part of the bound of the noise."""
_TURN_LIMIT, _SHIFT_LIMIT = radians(0.5), 2 / 125
"""The default tolerance: in radians, and in sizes of the model."""
_MOST_MISSED = 5
"""Images without a pose up to which motion is extrapolated."""
_FOUND = (PoseStatus.OK, PoseStatus.SYMMETRIC)
_ESTIMATED = (*_FOUND, PoseStatus.UNCERTAIN)
_USABLE = (*_ESTIMATED, PoseStatus.AMBIGUOUS)


class TrackStatus(Status):
    """Whether a pose was measured in the images of one time, or why not."""

    OK = 0
    RECOVERED = 1
    """As OK; the object was found by its colour, without a prediction."""
    OCCLUDED = 2
    """Too few edges of the object are seen. The pose is predicted."""
    OUTSIDE = 3
    """The object is predicted to be outside all images, or behind the cameras. The pose is predicted."""
    UNCERTAIN = 4
    """The bounds of the errors exceed the tolerance, or other poses are as good. In the first case, the pose is the
    best one all the same: see `TrackedPose.is_estimated`."""
    INCONSISTENT = 5
    """Edges disagree with the model, or an image with the pose from all images. The pose is predicted."""
    NOT_FINITE = 6
    """Values of all images are infinite or NaN. The pose is predicted."""
    LOST = 7
    """More images without a pose than motion is extrapolated for."""

    @property
    def is_measured(self) -> bool:
        """Whether the pose was measured."""
        return self <= TrackStatus.RECOVERED


@dataclass(frozen=True, eq=False)
class TrackedPose:
    """The result of `track_pose` for the images of one time."""

    status: TrackStatus
    motor: Reals
    """(8,) The measured pose if `is_estimated`; NaN if the status is LOST; otherwise the predicted pose."""
    estimate: PoseEstimate | None
    """None if there are too few measurements. Its covariance includes errors that points of a curve have in common."""
    seen: float
    """The part of the visible curves, in all images, with an edge that agrees with the pose."""
    statuses: tuple[ImageStatus, ...]
    """For each image."""

    @property
    def is_estimated(self) -> bool:
        """Whether the motor is the best pose for the images: measured, or with bounds that exceed the tolerance."""
        is_best = self.estimate is not None and self.estimate.status in _ESTIMATED
        return self.status.is_measured or (self.status == TrackStatus.UNCERTAIN and is_best)


@elements(start=MOTOR)
def track_pose(
    model: ObjectModel,
    cameras: Sequence[SceneCamera],
    images: Iterable[Sequence[ArrayLike]],
    start: ArrayLike,
    *,
    colour: ArrayLike | None = None,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
    noise: float = 0.3,
    reach: float = 12.0,
    tolerance: tuple[float, float] | None = None,
) -> Iterator[TrackedPose]:
    """Track an object through images that cameras take at equal intervals.

    The twist between the last two poses predicts the next one. Edges are measured along the normals of the visible
    curves in several rounds, each near the pose that the previous one estimated with robust weights.

    Parameters
    ----------
    model : ObjectModel
        With edges, spheres or cylinders.
    cameras : sequence of SceneCamera
        With their poses in the world: `Scene.placed_camera`.
    images : iterable of sequences of array_like, (h, w, 3)
        For each time, an image of each camera.
    start : array_like, (8,)
        The pose at the first time, up to `reach` pixels.
    colour : array_like, (3,) or (n, 3), optional
        The colour by which `measure_silhouettes` finds the object again when it is lost. Of several equal poses of a
        symmetric object, the one nearest to the prediction is taken.
    mesh : (array_like, (n, 3), array_like, (m, 3)), optional
        As for `measure_edges`.
    noise : float
        An upper bound of the root mean square distance of edges from the true curves, in pixels. The default is three
        times that in rendered images with noise of 1 % and a blur of 0.6 pixels.
    reach : float
        How far edges are searched, in pixels. It grows while no pose is found.
    tolerance : (float, float), optional
        The largest bounds of the errors for which a pose is measured, as for `estimate_pose`: of the rotation, in
        radians, and of the displacement of the model's centre. By default 0.5 degrees, and the size of the model
        divided by 62.5, which is 1 mm for a box of 5 x 7 x 9 centimetres. Motions that change no image are disregarded.

    Yields
    ------
    TrackedPose
        One for each time, as soon as its images are measured. The status OK guarantees what it does in
        `estimate_pose`, also for symmetric objects, with bounds for errors that the edge points of a curve have in
        common. In addition, enough of the visible curves are seen, at least three quarters of the edges of each image
        agree with the pose, and so does the pose from each image alone, as far as it determines one.

    Raises
    ------
    TypeError, ValueError
        If shapes or types disagree, a camera is mounted, `noise` is not positive, `reach` is less than 3, or
        `tolerance` is not two positive numbers.
    """
    every = tuple(cameras)
    check_outline(model)
    pose = checked_start(start)
    if not every or any(one.is_mounted for one in every):
        raise ValueError(f"cameras: {len(every)}; expected at least one, and poses in the world: Scene.placed_camera")
    if not finite_number(noise, "noise") > 0 or finite_number(reach, "reach") < _LEAST_REACH:
        raise ValueError(f"noise {noise}, reach {reach}; expected positive noise and a reach of at least 3 pixels")
    limits = pose_limits(model, (_TURN_LIMIT, _SHIFT_LIMIT * model.size) if tolerance is None else tolerance)
    return _tracked(_Task(model, every, checked_mesh(model, mesh), noise, reach, limits, colour), images, pose)


@dataclass(frozen=True, eq=False)
class _Task:
    model: ObjectModel
    cameras: tuple[SceneCamera, ...]
    mesh: Mesh
    noise: float
    reach: float
    limits: tuple[float, float]
    colour: ArrayLike | None


def _tracked(task: _Task, images: Iterable[Sequence[ArrayLike]], pose: Reals) -> Iterator[TrackedPose]:
    # The pose was last measured `missed` images ago; before the second pose, motion is unknown.
    twist, missed, is_first = np.zeros(6), 0, True
    for taken in images:
        if len(taken) != len(task.cameras):
            raise ValueError(f"images: {len(taken)} for {len(task.cameras)} cameras; expected one for each")
        pictures = tuple(real_image(camera, image) for camera, image in zip(task.cameras, taken, strict=True))
        # Motion is extrapolated for a few images only; then the object is expected to rest.
        steps = 0 if is_first else min(missed + 1, _MOST_MISSED + 1)
        predicted = np.asarray(pga3.motor_product(pose, pga3.motor_exponential(steps * twist)))
        found = _measured(task, pictures, predicted, min(task.reach * _GROWTH**missed, _LARGEST_REACH))
        if not found.is_estimated and task.colour is not None:
            found = _found_again(task, pictures, predicted, found)
        if found.is_estimated:
            between = pga3.motor_product(pga3.motor_inverse(pose), found.motor)
            step = np.asarray(pga3.motor_logarithm(between if between[0] >= 0 else -between)) / (missed + 1)
            twist = np.zeros(6) if is_first or found.status == TrackStatus.RECOVERED else step
            pose, missed, is_first = found.motor, 0, False
        else:
            missed += 1
            if missed > _MOST_MISSED:
                found = replace(found, status=TrackStatus.LOST, motor=np.full(8, np.nan))
        yield found


def _measured(task: _Task, pictures: tuple[Reals, ...], predicted: Reals, reach: float) -> TrackedPose:
    """Return the pose that the edges near a prediction give."""
    pose, model = predicted, task.model
    parts: list[MeasuredEdges] = []
    estimate = None
    for part in _ROUNDS:
        far = max(part * reach, _LEAST_REACH)
        parts = [
            edges_near(model, camera, image, pose, far, task.mesh)
            for camera, image in zip(task.cameras, pictures, strict=True)
        ]
        views = [one.view for one in parts if len(one.offsets)]
        if not views:
            return _predicted(_why(parts), predicted, estimate, parts)
        noise = task.noise if part == _ROUNDS[-1] else max(task.noise, far / 4)
        estimate = estimated_pose(model, views, pose, noise, task.limits)
        if estimate.status == PoseStatus.INCONSISTENT:
            clear = without_refuted_curves(parts, estimate)
            if clear is not None:
                parts = clear
                views = [one.view for one in parts if len(one.offsets)]
                estimate = estimated_pose(model, views, pose, noise, task.limits)
        if estimate.status not in _USABLE:
            cause = TrackStatus.INCONSISTENT if estimate.status == PoseStatus.INCONSISTENT else TrackStatus.UNCERTAIN
            return _predicted(cause if _shown(parts) >= _LEAST_SEEN else TrackStatus.OCCLUDED, predicted, None, parts)
        pose = estimate.motor
    # If most edges prove that the noise is smaller than its bound, those of other things are rejected more surely.
    noise = _proved_noise(parts, task.noise)
    surer = estimated_pose(model, [one.view for one in parts if len(one.offsets)], pose, noise, task.limits)
    if surer.status in _ESTIMATED:
        return _verified(parts, surer, predicted, noise, task)
    assert estimate is not None
    return _verified(parts, estimate, predicted, task.noise, task)


def _verified(
    parts: list[MeasuredEdges], estimate: PoseEstimate, predicted: Reals, noise: float, task: _Task
) -> TrackedPose:
    inliers = np.concatenate([estimate.inliers[kind] for kind in KINDS])
    seen = float(inliers.sum()) / max(sum(one.n_predicted for one in parts), 1)
    statuses = tuple(one.status for one in parts)
    used = [one for one in parts if len(one.offsets)]
    estimate = with_common_errors(estimate, used)
    status = TrackStatus.OK
    if seen < _LEAST_SEEN:
        status = TrackStatus.OCCLUDED
    # Edges of other things near a wrong pose have larger residuals than those of the object.
    elif (
        inliers.mean() < _LEAST_INLIERS
        or estimate.residual > _LARGEST_RESIDUAL * noise
        or disagreeing(task.model, used, estimate, noise, task.limits)
    ):
        status = TrackStatus.INCONSISTENT
    elif estimate.status not in _FOUND or exceeds(estimate, task.limits):
        status = TrackStatus.UNCERTAIN
    found = TrackedPose(status, estimate.motor, estimate, seen, statuses)
    return found if found.is_estimated else replace(found, motor=predicted)


def _proved_noise(parts: list[MeasuredEdges], noise: float) -> float:
    """Return twice the standard deviation of offsets by their median, within the bound of the noise and a third."""
    deviation = deviation_of_most(np.concatenate([one.offsets for one in parts]))
    return min(max(2 * deviation, noise / 3), noise)


def _shown(parts: list[MeasuredEdges]) -> float:
    return sum(len(one.offsets) for one in parts) / max(sum(one.n_predicted for one in parts), 1)


def _predicted(
    status: TrackStatus, motor: Reals, estimate: PoseEstimate | None, parts: list[MeasuredEdges]
) -> TrackedPose:
    return TrackedPose(status, motor, estimate, 0.0, tuple(one.status for one in parts))


def _why(parts: list[MeasuredEdges]) -> TrackStatus:
    """Return why no image has edges."""
    found = {one.status for one in parts}
    if found == {ImageStatus.NOT_FINITE}:
        return TrackStatus.NOT_FINITE
    if found <= {ImageStatus.BEHIND_CAMERA, ImageStatus.OUTSIDE_IMAGE, ImageStatus.NOT_FINITE}:
        return TrackStatus.OUTSIDE
    return TrackStatus.OCCLUDED


def _found_again(task: _Task, pictures: tuple[Reals, ...], predicted: Reals, found: TrackedPose) -> TrackedPose:
    """Find the object by its colour, verify its edges, and choose the nearest of equal poses."""
    assert task.colour is not None
    again = measure_silhouettes(task.model, task.cameras, pictures, colour=task.colour, mesh=task.mesh,
                                noise=task.noise)  # fmt: skip
    if again.estimate is None or not again.views:
        return found
    poses = np.concatenate([again.estimate.motor[None], again.alternatives])
    samples = task.model.samples
    off = pga3.move_point(poses[:, None], samples) - pga3.move_point(predicted, samples)
    nearest = poses[int(np.square(off).sum((1, 2)).argmin())]
    verified = _measured(task, pictures, nearest, _LEAST_REACH)
    if verified.status != TrackStatus.OK:
        return found
    return TrackedPose(TrackStatus.RECOVERED, verified.motor, verified.estimate, verified.seen, verified.statuses)
