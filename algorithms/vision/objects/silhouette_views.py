"""Views of an object measured in raster images: segmentation by colour, contours, and parts of the model's outline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...arguments import Reals, finite_number
from ...elements import MOTOR, elements
from .image_arguments import checked_images, checked_mesh
from .image_status import ImageStatus
from .pose_estimation import PoseEstimate
from .pose_models import ObjectModel, View
from .predicted_curves import Mesh
from .scene import SceneCamera
from .silhouette_fits import FEWEST, differ, fits_of_silhouettes
from .silhouettes import Silhouette, expected_region, silhouette_of_image

_LEAST_SHOWN = 0.55
"""Least part of the outline that is seen in an image."""
_LEAST_SCORE, _CERTAIN = 0.5, 0.85
"""Least product of the parts of outlines and contours that agree, without a start, and the least at which components
of the colour are not joined."""
_AS_GOOD = 0.03
"""Other poses are as good if these parts are smaller by less than this."""
_TRACED = (ImageStatus.OK, ImageStatus.TOUCHES_BORDER, ImageStatus.SEVERAL)


@dataclass(frozen=True, eq=False)
class MeasuredSilhouettes:
    """Result of `measure_silhouettes`."""

    status: ImageStatus
    """That of the best image; if there are no views, the cause."""
    statuses: tuple[ImageStatus, ...]
    """For each image."""
    views: tuple[View, ...]
    """For each image in which the contour agrees with the outline of the model, its pixels with the elements."""
    estimate: PoseEstimate | None
    """The pose by which the pixels were assigned to elements; None without measurements."""
    alternatives: Reals
    """(k, 8) Other poses with the same outlines, such as those of symmetric objects of one colour."""
    shown: tuple[float, ...]
    """For each image, the part of the outline, within the image, that is seen."""
    silhouettes: tuple[Silhouette, ...]
    """For each image."""


@elements(start=MOTOR)
def measure_silhouettes(
    model: ObjectModel,
    cameras: SceneCamera | Sequence[SceneCamera],
    images: ArrayLike | Sequence[ArrayLike],
    start: ArrayLike | None = None,
    *,
    colour: ArrayLike,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
    noise: float = 0.3,
) -> MeasuredSilhouettes:
    """Measure the outline of an object of one colour in raster images.

    In each image, the object is segmented by its colour, and its contour is traced between pixels. The points of the
    contour are assigned to the nearest elements of the model's outline at the pose, which is refined by
    `estimate_pose` in turn. Points far from the outline, which belong to an object in front, and points at corners and
    at the border of the image are left out.

    Parameters
    ----------
    model : ObjectModel
        With edges, spheres or cylinders.
    cameras : SceneCamera or sequence of SceneCamera
        With their poses in the world: `Scene.placed_camera`.
    images : array_like, (h, w, 3), or a sequence of such
        Of any real type, one for each camera.
    start : array_like, (8,), optional
        A pose near the true one. It distinguishes the object from others of the same colour, and lets the status name
        why it is not seen. Without it, the pose is searched from all directions (a second or less for each image).
    colour : array_like, (3,) or (n, 3)
        As for `segment_colour`.
    mesh : (array_like, (n, 3), array_like, (m, 3)), optional
        Vertices and faces in the frame of the object. By default the convex hull of edges and points.
    noise : float
        The standard deviation of a pixel's coordinate.

    Returns
    -------
    MeasuredSilhouettes
        Elements are those of the best pose. If the object is symmetric, other poses have the same outline: see
        `alternatives`.

    Raises
    ------
    TypeError, ValueError
        If shapes or types disagree, the numbers of cameras and images differ, a camera is mounted, or the model
        consists of points only.

    Notes
    -----
    The pixels of rendered images differ from the exact outlines by 0.1 pixels (root mean square) or less, with noise
    of 1 % and a blur of 0.6 pixels.
    """
    every, pictures, first = checked_images(model, cameras, images, start)
    if not finite_number(noise, "noise") > 0:
        raise ValueError(f"noise: {noise}; expected a positive number of pixels")
    surface = checked_mesh(model, mesh)
    task = _Task(model, every, pictures, colour, first, surface, noise)
    found, score = _measured(task, False)
    if first is not None:
        return found
    if score < _CERTAIN and ImageStatus.SEVERAL in found.statuses:
        # Components of the colour may be parts of one object behind another one.
        joined, other = _measured(task, True)
        found = joined if other > score else found
    if not found.views and len(every) > 1:
        return _from_one_image(task, found)
    return found


class _Task(NamedTuple):
    model: ObjectModel
    cameras: tuple[SceneCamera, ...]
    images: tuple[Any, ...]
    colour: ArrayLike
    start: Reals | None
    mesh: Mesh
    noise: float


def _measured(task: _Task, is_joined: bool) -> tuple[MeasuredSilhouettes, float]:
    """Return the measurements, and the parts of outlines and contours that agree; all components may be joined."""
    silhouettes = tuple(
        _silhouette(task, camera, image, is_joined) for camera, image in zip(task.cameras, task.images, strict=True)
    )
    usable = [one for one in silhouettes if _is_usable(one)]
    statuses = tuple(
        ImageStatus.OCCLUDED if one.status in _TRACED and one not in usable else one.status for one in silhouettes
    )
    none = (0.0,) * len(statuses)
    nothing = MeasuredSilhouettes(max(statuses), statuses, (), None, np.zeros((0, 8)), none, silhouettes)
    if not usable:
        return nothing, 0.0
    fits = fits_of_silhouettes(task.model, usable, task.start, task.mesh, task.noise)
    if not fits or (task.start is None and fits[0].score < _LEAST_SCORE):
        statuses = tuple(ImageStatus.INCONSISTENT if one == ImageStatus.OK else one for one in statuses)
        return replace(nothing, status=_cause(statuses), statuses=statuses), 0.0
    best = fits[0]
    shown = dict(zip(map(id, usable), best.shown, strict=True))
    seen = tuple(shown.get(id(one), 0.0) for one in silhouettes)
    statuses = tuple(
        ImageStatus.OCCLUDED if one in usable and part < _LEAST_SHOWN else status
        for one, part, status in zip(silhouettes, seen, statuses, strict=True)
    )
    views = tuple(view for view, part in zip(best.views, best.shown, strict=True) if part >= _LEAST_SHOWN)
    status = min(statuses) if views else ImageStatus.OCCLUDED
    others = [one.estimate.motor for one in fits[1:] if one.score >= best.score - _AS_GOOD]
    motors = np.array(others).reshape(-1, 8)
    return MeasuredSilhouettes(status, statuses, views, best.estimate, motors, seen, silhouettes), best.score


def _is_usable(one: Silhouette) -> bool:
    return one.status in _TRACED and len(one.pixels) >= FEWEST and one.size > 0


def _cause(statuses: tuple[ImageStatus, ...]) -> ImageStatus:
    """Return why nothing is measured: what is special about an image, or else that no pose fits."""
    found = [one for one in statuses if one in _TRACED]
    return min(found) if found else max(statuses)


def _from_one_image(task: _Task, failed: MeasuredSilhouettes) -> MeasuredSilhouettes:
    """Measure all images at poses that one of them gives, as others may show only a part, or another object."""
    usable = [one for one in failed.silhouettes if _is_usable(one)]
    tried: list[MeasuredSilhouettes] = []
    for one in sorted(usable, key=lambda one: (one.status, -one.size)):
        fits = fits_of_silhouettes(task.model, [one], None, task.mesh, task.noise)
        for fit in fits if fits and fits[0].score >= _LEAST_SCORE else ():
            found, _ = _measured(task._replace(start=fit.estimate.motor), False)
            if found.views:
                tried.append(found)
        if any(len(found.views) == len(task.cameras) for found in tried):
            break
    if not tried:
        return failed
    best = max(tried, key=lambda found: sum(found.shown))
    kept: list[PoseEstimate] = []
    for found in tried:
        pose = found.estimate
        is_as_good = found is not best and sum(found.shown) > sum(best.shown) - _AS_GOOD
        others = [other for other in (best.estimate, *kept) if other is not None]
        if is_as_good and pose is not None and all(differ(task.model, pose, other) for other in others):
            kept.append(pose)
    statuses = tuple(
        ImageStatus.SEVERAL if one.status == ImageStatus.SEVERAL and status == ImageStatus.OK else status
        for one, status in zip(failed.silhouettes, best.statuses, strict=True)
    )
    motors = np.array([one.motor for one in kept]).reshape(-1, 8)
    return replace(best, status=min(statuses), statuses=statuses, alternatives=motors)


def _silhouette(task: _Task, camera: SceneCamera, image: ArrayLike, is_joined: bool) -> Silhouette:
    everywhere = np.ones(camera.size[::-1], bool)
    if task.start is None:
        return silhouette_of_image(camera, image, task.colour, everywhere if is_joined else None)
    status, region = expected_region(task.model, task.start, camera, task.mesh)
    found = silhouette_of_image(camera, image, task.colour, ~everywhere if region is None else region)
    if region is None and found.status != ImageStatus.NOT_FINITE:
        return Silhouette(camera, status, np.zeros((0, 2)), np.zeros((0, 2)), None)
    return found
