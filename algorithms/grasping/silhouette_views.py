"""Views of an object measured in raster images: segmentation by colour, contours, and parts of the model's outline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite_number
from .image_arguments import checked_images, checked_mesh
from .image_status import ImageStatus
from .pose_estimation import PoseEstimate, estimate_pose
from .pose_models import ObjectModel, View
from .pose_status import PoseStatus
from .predicted_curves import Mesh, predicted_curves
from .scene import SceneCamera
from .silhouette_starts import starts_of_silhouette
from .silhouettes import Assignment, Silhouette, assigned, expected_region, silhouette_of_image

_GATES = (0.3, 0.15, 0.08)
"""Largest distances of a contour from the outline in the first rounds, as parts of the size of the silhouette."""
_LAST_GATES = (4.0, 2.0, 1.5, 1.5)
"""The same in the last rounds, in pixels."""
_COARSE_AGREE = 0.6
_STARTS, _JOINT = 10, 3
"""Starts from each silhouette, and of these, how many are refined to the end."""
_FEWEST = 12
"""Fewest points of a silhouette."""
_LEAST_SHOWN, _LEAST_AGREEING = 0.55, 0.5
"""Least part of the outline that is seen, and of the contour that belongs to the outline."""
_AS_GOOD = 0.03
"""Other poses are as good if these parts are smaller by less than this."""
_SAME = 0.05
"""Poses are the same if the twist between them, in multiples of the size of the model, is less than this."""
_TRACED = (ImageStatus.OK, ImageStatus.TOUCHES_BORDER, ImageStatus.SEVERAL)
_FOUND = (PoseStatus.OK, PoseStatus.SYMMETRIC, PoseStatus.AMBIGUOUS, PoseStatus.UNCERTAIN)


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


class _Fit(NamedTuple):
    estimate: PoseEstimate
    views: tuple[View, ...]
    shown: tuple[float, ...]
    agreeing: float

    @property
    def score(self) -> float:
        """The product of the parts of the outlines and of the contours that agree."""
        return float(np.mean(self.shown)) * self.agreeing


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
        A pose near the true one. It tells the object from others of the same colour, and lets the status name why it
        is not seen. Without it, the pose is searched from all directions (a second or less for each image).
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
    silhouettes = tuple(
        _silhouette(model, camera, image, colour, first, surface) for camera, image in zip(every, pictures, strict=True)
    )
    usable = [one for one in silhouettes if one.status in _TRACED and len(one.pixels) >= _FEWEST and one.size > 0]
    statuses = tuple(
        ImageStatus.OCCLUDED if one.status in _TRACED and one not in usable else one.status for one in silhouettes
    )
    nothing = MeasuredSilhouettes(
        max(statuses), statuses, (), None, np.zeros((0, 8)), (0.0,) * len(statuses), silhouettes
    )  # fmt: skip
    if not usable:
        return nothing
    fits = _fits(model, usable, first, surface, noise)
    if not fits and first is None:
        again = _from_one_image(model, every, pictures, usable, colour, surface, noise)
        if again is not None:
            return again
    if not fits:
        statuses = tuple(
            ImageStatus.INCONSISTENT if status == ImageStatus.OK else status for status in statuses
        )  # fmt: skip
        return replace(nothing, status=_cause(statuses), statuses=statuses)
    best = fits[0]
    shown = dict(zip(map(id, usable), best.shown, strict=True))
    seen = tuple(shown.get(id(one), 0.0) for one in silhouettes)
    statuses = tuple(
        ImageStatus.OCCLUDED if one in usable and part < _LEAST_SHOWN else status
        for one, part, status in zip(silhouettes, seen, statuses, strict=True)
    )
    views = tuple(
        view for view, part in zip(best.views, best.shown, strict=True) if part >= _LEAST_SHOWN
    )  # fmt: skip
    status = min(statuses) if views else ImageStatus.OCCLUDED
    if views and best.agreeing < _LEAST_AGREEING and first is None:
        status, views = ImageStatus.INCONSISTENT, ()
    others = [one.estimate.motor for one in fits[1:] if one.score >= best.score - _AS_GOOD]
    return MeasuredSilhouettes(
        status, statuses, views, best.estimate, np.array(others).reshape(-1, 8), seen, silhouettes
    )  # fmt: skip


def _cause(statuses: tuple[ImageStatus, ...]) -> ImageStatus:
    """Return why nothing is measured: what is special about an image, or else that no pose fits."""
    found = [one for one in statuses if one in _TRACED]
    return min(found) if found else max(statuses)


def _from_one_image(
    model: ObjectModel, cameras: tuple[SceneCamera, ...], images: tuple[ArrayLike, ...], usable: list[Silhouette],
    colour: ArrayLike, mesh: Mesh, noise: float,
) -> MeasuredSilhouettes | None:  # fmt: skip
    """Measure all images at poses that one of them gives, as others may show only a part, or another object."""
    tried = []
    for one in sorted(usable, key=lambda one: (one.status, -one.size)) if len(cameras) > 1 else ():
        for fit in _fits(model, [one], None, mesh, noise):
            found = measure_silhouettes(
                model, cameras, images, fit.estimate.motor, colour=colour, mesh=mesh, noise=noise
            )  # fmt: skip
            if found.views and found.estimate is not None:
                tried.append(found)
        if any(len(found.views) == len(cameras) for found in tried):
            break
    if not tried:
        return None
    best = max(tried, key=lambda found: sum(found.shown))
    kept: list[PoseEstimate] = []
    for found in tried:
        one_pose = found.estimate
        is_as_good = found is not best and sum(found.shown) > sum(best.shown) - _AS_GOOD
        others = [pose for pose in (best.estimate, *kept) if pose is not None]
        if is_as_good and one_pose is not None and all(_differ(model, one_pose, other) for other in others):
            kept.append(one_pose)
    several = {id(one.camera) for one in usable if one.status == ImageStatus.SEVERAL}
    statuses = tuple(
        ImageStatus.SEVERAL if id(camera) in several and status == ImageStatus.OK else status
        for camera, status in zip(cameras, best.statuses, strict=True)
    )
    motors = np.array([one.motor for one in kept]).reshape(-1, 8)
    return replace(best, status=min(statuses), statuses=statuses, alternatives=motors)


def _silhouette(
    model: ObjectModel, camera: SceneCamera, image: ArrayLike, colour: ArrayLike, start: Reals | None, mesh: Mesh
) -> Silhouette:
    region = None
    if start is not None:
        status, region = expected_region(model, start, camera, mesh)
        if region is None:
            found = silhouette_of_image(camera, image, colour, np.zeros(camera.size[::-1], bool))
            status = found.status if found.status == ImageStatus.NOT_FINITE else status
            return Silhouette(camera, status, np.zeros((0, 2)), np.zeros((0, 2)), None)
    return silhouette_of_image(camera, image, colour, region)


def _fits(model: ObjectModel, usable: list[Silhouette], start: Reals | None, mesh: Mesh, noise: float) -> list[_Fit]:
    """Return the poses that fit the silhouettes, the best first, without poses that are the same."""
    if start is not None:
        found = _fit(model, usable, start, mesh, noise, 0)
        return [] if found is None else [found]
    largest = max(usable, key=lambda one: one.size)
    poses = starts_of_silhouette(model, largest, mesh, _STARTS)
    if len(usable) > 1:
        poses = _triangulated(model, poses, usable)
    rough = [(pose, _fit(model, usable, pose, mesh, noise, len(_LAST_GATES))) for pose in poses]
    good = sorted((one for one in rough if one[1] is not None), key=lambda one: -one[1].score)  # type: ignore[union-attr]
    fine = [_fit(model, usable, one.estimate.motor, mesh, noise, 0) for _, one in good[:_JOINT] if one is not None]
    fitted = sorted((one for one in fine if one is not None), key=lambda one: -one.score)
    # Half turns about the principal axes are symmetries of most symmetric objects.
    for turn in model.half_turns if fitted else ():
        fine.append(_fit(model, usable, pga3.motor_product(fitted[0].estimate.motor, turn), mesh, noise, 0))
    kept: list[_Fit] = []
    for one in sorted((one for one in fine if one is not None), key=lambda one: -one.score):
        if all(_differ(model, one.estimate, other.estimate) for other in kept):
            kept.append(one)
    return kept


def _triangulated(model: ObjectModel, poses: Reals, usable: list[Silhouette]) -> Reals:
    """Return poses moved so that the centre of the model is nearest to the lines of sight of all silhouettes."""
    sums, right = np.zeros((3, 3)), np.zeros(3)
    for one in usable:
        camera = one.camera.camera
        sight = np.linalg.solve(camera.intrinsics, np.array([*_middle(one.pixels), 1.0]))
        direction = np.asarray(pga3.move_direction(camera.pose, sight / np.linalg.norm(sight)))
        across = np.eye(3) - np.outer(direction, direction)
        sums += across
        right += across @ pga3.move_point(camera.pose, np.zeros(3))
    if np.linalg.eigvalsh(sums)[0] < 1e-3:
        return poses
    place = np.linalg.solve(sums, right)
    still = np.array([1.0, 0, 0, 0])
    moved = [
        pga3.motor_product(pga3.motor_from_rotor_translation(still, place - pga3.move_point(p, model.centre)), p)
        for p in poses
    ]
    return np.array(moved).reshape(-1, 8)


def _middle(pixels: Reals) -> Reals:
    return np.asarray((pixels.min(0) + pixels.max(0)) / 2)


def _fit(
    model: ObjectModel, usable: list[Silhouette], start: Reals, mesh: Mesh, noise: float, left_out: int
) -> _Fit | None:
    """Assign and estimate in turn, with gates that become narrower; the last ones may be left out."""
    size = max(one.size for one in usable)
    coarse = [gate * size for gate in _GATES if gate * size > _LAST_GATES[0]]
    gates = [*coarse, *_LAST_GATES][: len(coarse) + len(_LAST_GATES) - left_out]
    pose, estimate = start, None
    for gate in gates:
        parts = _assignments(model, usable, pose, mesh, gate)
        if parts is None:
            return None
        views = tuple(a.view(one.camera.camera, one.pixels) for a, one in zip(parts, usable, strict=True))
        if sum(len(a.rows) for a in parts) < _FEWEST:
            return None
        estimate = estimate_pose(model, views, pose, max(noise, gate / 3))
        if estimate.status not in _FOUND:
            return None
        pose = estimate.motor
    final = _assignments(model, usable, pose, mesh, max(gates[-1], _LAST_GATES[-1]))
    if final is None or estimate is None:
        return None
    views = tuple(a.view(one.camera.camera, one.pixels) for a, one in zip(final, usable, strict=True))
    if not left_out:
        estimate = estimate_pose(model, views, pose, noise)
        if estimate.status not in _FOUND:
            return None
    counts = np.array([len(one.pixels) for one in usable])
    agreeing = float(counts @ [a.agreeing for a in final] / counts.sum())
    return _Fit(estimate, views, tuple(a.shown(one.camera) for a, one in zip(final, usable, strict=True)), agreeing)


def _assignments(
    model: ObjectModel, usable: list[Silhouette], pose: Reals, mesh: Mesh, gate: float
) -> list[Assignment] | None:
    found = []
    for one in usable:
        curves = predicted_curves(model, pose, one.camera.camera, mesh)
        if curves is None:
            return None
        found.append(assigned(one, curves, gate, _COARSE_AGREE if gate > _LAST_GATES[0] else 0.85))
    return found


def _differ(model: ObjectModel, a: PoseEstimate, b: PoseEstimate) -> bool:
    """Return whether two poses differ by more than motions that change no image."""
    between = pga3.motor_product(pga3.motor_inverse(b.motor), a.motor)
    scaled = pga3.motor_logarithm(between if between[0] >= 0 else -between) / [1, 1, 1, *[model.size] * 3]
    if len(b.freedoms):
        free = np.linalg.qr((b.freedoms / [1, 1, 1, *[model.size] * 3]).T)[0]
        scaled = scaled - free @ (free.T @ scaled)
    return bool(np.linalg.norm(scaled) > _SAME)
