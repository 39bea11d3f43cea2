"""Track the pose of an object through sequences of images: predict, measure edges, estimate, and verify."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite_number
from .edge_measurement import MeasuredEdges, edges_near
from .image_arguments import check_outline, checked_mesh, checked_start, real_image
from .image_status import ImageStatus
from .pose_estimation import PoseEstimate, estimate_pose
from .pose_models import KINDS, ObjectModel
from .pose_status import PoseStatus
from .predicted_curves import Mesh
from .scene import SceneCamera
from .silhouette_views import measure_silhouettes

_ROUNDS = (1.0, 0.5, 0.3, 0.3)
"""How far edges are searched in the rounds of one image, as parts of the reach."""
_LEAST_REACH, _GROWTH, _LARGEST_REACH = 3.0, 1.5, 40.0
"""Least reach of a round in pixels, growth of the reach with each image that is missed, and its bound."""
_LEAST_INLIERS, _LEAST_SEEN = 0.75, 0.4
"""Least part of the edges that agree with the pose, and of the visible curves that have an edge which agrees."""
_LARGEST_RESIDUAL = 0.85
"""Largest root mean square residual, as a part of the bound of the noise."""
_MOST_MISSED = 5
"""Images without a pose up to which motion is extrapolated."""
_FOUND = (PoseStatus.OK, PoseStatus.SYMMETRIC)
_USABLE = (*_FOUND, PoseStatus.AMBIGUOUS, PoseStatus.UNCERTAIN)


class TrackStatus(IntEnum):
    """Whether a pose was measured in the images of one time, or why not."""

    OK = 0
    RECOVERED = 1
    """As OK; the object was found by its colour, without a prediction."""
    OCCLUDED = 2
    """Too few edges of the object are seen. The pose is predicted."""
    OUTSIDE = 3
    """The object is predicted to be outside all images, or behind the cameras. The pose is predicted."""
    UNCERTAIN = 4
    """The edges do not determine the pose, or their standard deviations are too large. The pose is predicted."""
    INCONSISTENT = 5
    """Edges disagree with the model. The pose is predicted."""
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
    """(8,) The measured pose if the status is OK or RECOVERED; NaN if it is LOST; otherwise the predicted pose."""
    estimate: PoseEstimate | None
    """None if there are too few measurements."""
    seen: float
    """The part of the visible curves, in all images, with an edge that agrees with the pose."""
    statuses: tuple[ImageStatus, ...]
    """For each image."""


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

    Yields
    ------
    TrackedPose
        One for each time, as soon as its images are measured.

    Raises
    ------
    TypeError, ValueError
        If shapes or types disagree, a camera is mounted, `noise` is not positive, or `reach` is less than 3.
    """
    every = tuple(cameras)
    check_outline(model)
    pose = checked_start(start)
    if not every or any(one.is_mounted for one in every):
        raise ValueError(f"cameras: {len(every)}; expected at least one, and poses in the world: Scene.placed_camera")
    if not finite_number(noise, "noise") > 0 or finite_number(reach, "reach") < _LEAST_REACH:
        raise ValueError(f"noise {noise}, reach {reach}; expected positive noise and a reach of at least 3 pixels")
    return _tracked(_Task(model, every, checked_mesh(model, mesh), noise, reach, colour), images, pose)


@dataclass(frozen=True, eq=False)
class _Task:
    model: ObjectModel
    cameras: tuple[SceneCamera, ...]
    mesh: Mesh
    noise: float
    reach: float
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
        if not found.status.is_measured and task.colour is not None:
            found = _found_again(task, pictures, predicted, found)
        if found.status.is_measured:
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
        estimate = estimate_pose(model, views, pose, task.noise if part == _ROUNDS[-1] else max(task.noise, far / 4))
        if estimate.status not in _USABLE:
            cause = TrackStatus.INCONSISTENT if estimate.status == PoseStatus.INCONSISTENT else TrackStatus.UNCERTAIN
            return _predicted(cause if _shown(parts) >= _LEAST_SEEN else TrackStatus.OCCLUDED, predicted, None, parts)
        pose = estimate.motor
    assert estimate is not None
    return _verified(parts, estimate, predicted, task.noise)


def _verified(parts: list[MeasuredEdges], estimate: PoseEstimate, predicted: Reals, noise: float) -> TrackedPose:
    inliers = np.concatenate([estimate.inliers[kind] for kind in KINDS])
    seen = float(inliers.sum()) / max(sum(one.n_predicted for one in parts), 1)
    statuses = tuple(one.status for one in parts)
    if seen < _LEAST_SEEN:
        return TrackedPose(TrackStatus.OCCLUDED, predicted, estimate, seen, statuses)
    # Edges of other things near a wrong pose have larger residuals than those of the object.
    if inliers.mean() < _LEAST_INLIERS or estimate.residual > _LARGEST_RESIDUAL * noise:
        return TrackedPose(TrackStatus.INCONSISTENT, predicted, estimate, seen, statuses)
    if estimate.status not in _FOUND:
        return TrackedPose(TrackStatus.UNCERTAIN, predicted, estimate, seen, statuses)
    return TrackedPose(TrackStatus.OK, estimate.motor, estimate, seen, statuses)


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
