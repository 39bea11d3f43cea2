"""Poses at which the outline of a model fits silhouettes: points are assigned and poses estimated in turn."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from generated import pga3

from ...arguments import Reals
from .pose_estimation import PoseEstimate, estimated_pose
from .pose_features import on_line, places_of_rotations, poses_of_rotations
from .pose_models import ObjectModel, View
from .pose_record import twist_between
from .pose_status import PoseStatus
from .predicted_curves import Mesh, predicted_curves
from .silhouette_starts import starts_of_silhouette
from .silhouettes import Assignment, Silhouette, assigned

FEWEST = 12
"""Fewest points of silhouettes."""
_GATES = (0.3, 0.15, 0.08)
"""Largest distances of a contour from the outline in the first rounds, as parts of the size of the silhouette."""
_LAST_GATES = (4.0, 2.0, 1.5, 1.5)
"""The same in the last rounds, in pixels."""
_COARSE_AGREE = 0.6
"""The share of a silhouette that must agree while the gate is wide."""
_STARTS, _JOINT = 10, 3
"""Starts from each silhouette, and of these, how many are refined to the end."""
_SAME = 0.05
"""Poses are the same if the twist between them, in multiples of the size of the model, is less than this."""
_FOUND = (PoseStatus.OK, PoseStatus.SYMMETRIC, PoseStatus.AMBIGUOUS, PoseStatus.UNCERTAIN)


class Fit(NamedTuple):
    """A pose with the measurements that it gives."""

    estimate: PoseEstimate
    views: tuple[View, ...]
    shown: tuple[float, ...]
    agreeing: float
    """The part of the contours that is near the outlines."""

    @property
    def score(self) -> float:
        """The product of the parts of the outlines and of the contours that agree."""
        return float(np.mean(self.shown)) * self.agreeing


def fits_of_silhouettes(
    model: ObjectModel, usable: list[Silhouette], start: Reals | None, mesh: Mesh, noise: float
) -> list[Fit]:
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
    kept: list[Fit] = []
    for one in sorted((one for one in fine if one is not None), key=lambda one: -one.score):
        if all(differ(model, one.estimate, other.estimate) for other in kept):
            kept.append(one)
    return kept


def _triangulated(model: ObjectModel, poses: Reals, usable: list[Silhouette]) -> Reals:
    """Return poses moved so that the centre of the model is nearest to the lines of sight of all silhouettes."""
    rotations = np.asarray(pga3.motor_to_matrix(poses))[:, :3, :3]
    cameras, middles = [one.camera.pinhole for one in usable], [_middle(one.pixels) for one in usable]
    sights = [on_line(c.rays(pixel), model.centre, c.centre) for c, pixel in zip(cameras, middles, strict=True)]
    places = places_of_rotations(rotations, sights)
    return poses if places is None else poses_of_rotations(rotations, places)


def _middle(pixels: Reals) -> Reals:
    return np.asarray((pixels.min(0) + pixels.max(0)) / 2)


def _fit(
    model: ObjectModel, usable: list[Silhouette], start: Reals, mesh: Mesh, noise: float, left_out: int
) -> Fit | None:
    """Assign and estimate in turn, with gates that become narrower; the last ones may be left out."""
    size = max(one.size for one in usable)
    coarse = [gate * size for gate in _GATES if gate * size > _LAST_GATES[0]]
    gates = [*coarse, *_LAST_GATES][: len(coarse) + len(_LAST_GATES) - left_out]
    pose, estimate = start, None
    for gate in gates:
        parts = _assignments(model, usable, pose, mesh, gate)
        if parts is None:
            return None
        views = tuple(a.view(one.camera.pinhole, one.pixels) for a, one in zip(parts, usable, strict=True))
        if sum(len(a.rows) for a in parts) < FEWEST:
            return None
        estimate = estimated_pose(model, views, pose, max(noise, gate / 3))
        if estimate.status not in _FOUND:
            return None
        pose = estimate.motor
    final = _assignments(model, usable, pose, mesh, max(gates[-1], _LAST_GATES[-1]))
    if final is None or estimate is None:
        return None
    views = tuple(a.view(one.camera.pinhole, one.pixels) for a, one in zip(final, usable, strict=True))
    if not left_out:
        estimate = estimated_pose(model, views, pose, noise)
        if estimate.status not in _FOUND:
            return None
    counts = np.array([len(one.pixels) for one in usable])
    agreeing = float(counts @ [a.agreeing for a in final] / counts.sum())
    return Fit(estimate, views, tuple(a.shown(one.camera) for a, one in zip(final, usable, strict=True)), agreeing)


def _assignments(
    model: ObjectModel, usable: list[Silhouette], pose: Reals, mesh: Mesh, gate: float
) -> list[Assignment] | None:
    found = []
    for one in usable:
        curves = predicted_curves(model, pose, one.camera.pinhole, mesh)
        if curves is None:
            return None
        found.append(assigned(one, curves, gate, _COARSE_AGREE if gate > _LAST_GATES[0] else 0.85))
    return found


def differ(model: ObjectModel, a: PoseEstimate, b: PoseEstimate) -> bool:
    """Return whether two poses differ by more than motions that change no image."""
    return bool(np.linalg.norm(twist_between(a.motor, b.motor, model.size, b.freedoms)) > _SAME)
