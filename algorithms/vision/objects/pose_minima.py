"""Minima of the distances in pixels between measurements and the images of an object."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from generated import object_poses as kernels

from ...arguments import Reals
from ...precision import NEGLIGIBLE
from ..localization import localize
from ..status import VisionStatus
from .pose_models import EXACT, Measurements, ObjectModel, SharedErrors, fullest_camera, points_of_camera
from .pose_starts import pose_seen_by, quick_starts, thorough_starts

SCALE, REJECTED = 4.0, 5.0
"""The scale of robust weights, and the distance from which a measurement is rejected, in standard deviations."""
_PLAIN = 1e6
"""A scale of robust weights that is larger than any image, in pixels."""
_SILHOUETTES, _PIXELS, ROBUST = 0.0, 1.0, 2.0
"""The first stage of descents: distances at the object, distances in pixels, or those with robust weights."""
_ENDED, _DAMPING, _CALLS = 3.0, 1e-4, 12
"""The stage of descents that ended, their first damping, and the largest number of further calls of the kernel; in the
second half of them, weights are robust."""
_WIDE = 10.0
"""The factor of the scale of robust weights with which descents begin if plain least squares lead to no pose."""
_FAR = 50.0
"""The distance in pixels from which measurements count equally in the choice of initial poses."""
_CHOSEN = 16
"""Number of initial poses from which descents begin."""
NONE = 1e30
"""The cost of poses that are not minima."""


class PoseTask(NamedTuple):
    """What is known, and what is accepted."""

    model: ObjectModel
    seen: Measurements
    noise: float
    limits: tuple[float, float]
    """The largest bounds of the errors of rotation and displacement."""
    is_independent: bool = False
    """Whether errors of pixels are independent, so that what they have in common contradicts the cameras or the model.
    Those of an edge in an image are not: the tracker compares edges and cameras with each other."""
    shared: SharedErrors = EXACT
    """How well the cameras and the model are known."""


class Minima(NamedTuple):
    """Local minima of the sum of robust squares."""

    poses: Reals
    """(b, 8)"""
    costs: Reals
    """(b) Sums of robust squares; `NONE` if the iterations ended early."""


def minima(first: Reals, task: PoseTask) -> Minima:
    """Return the minima at which descents from initial poses (b, 8) end.

    Descents begin with plain least squares, whose basin is wider, and those from several poses to silhouettes with
    distances at the object.
    """
    seen, size = task.seen, task.model.size
    if len(first) == 1 or seen.kinds == ("points",):
        return _descended(first, task, _PIXELS, 0.0)
    every = np.concatenate([seen.of[kind].pixels for kind in seen.kinds])
    return _descended(first, task, _SILHOUETTES, float(every.std()) / size)


def groups_of_minima(task: PoseTask) -> Iterator[Minima]:
    """Yield minima from groups of initial poses; each is computed only if those before it led to no pose."""
    first = quick_starts(task.seen)
    if first is not None:
        # The descent from the best one is enough: the reversal of its depth is compared afterwards.
        yield minima(first[limited_costs(first, task).argmin()][None], task)
        again = pose_by_consensus(task)
        if again is not None:
            yield near_minima(again, task)
    yield from thorough_minima(task)


def thorough_minima(task: PoseTask) -> Iterator[Minima]:
    """Yield minima from many initial poses: by plain least squares first, and by robust ones with a wide scale."""
    chosen = _nearest(thorough_starts(task.model, task.seen), task)
    yield minima(chosen, task)
    wide = _descend(chosen, task, _WIDE * SCALE * task.noise, 1e-2 * task.noise * task.noise, ROBUST, 0.0).poses
    yield near_minima(wide, task)


def near_minima(first: Reals, task: PoseTask) -> Minima:
    """Return the minima nearest to poses (b, 8), by robust descents alone."""
    return _descended(first, task, ROBUST, 0.0)


def _descend(first: Reals, task: PoseTask, scale: float, tolerance: float, stage: float, metric: float) -> Minima:
    """Return where descents from poses (b, 8) end.

    The parameters are those of the kernel, whose calls take a few steps each.
    """
    given = (*task.seen.arguments, task.model.size, scale, _PLAIN, tolerance, metric)
    refine: Any = kernels.refine_pose  # mypy takes seconds to find that unpacked arguments fit no overload
    poses, _, numbers = refine(first, *given, stage, _DAMPING)
    for k in range(_CALLS):
        if numbers[:, 1].min() >= _ENDED:
            break
        left = np.flatnonzero(numbers[:, 1] < _ENDED)
        stages = numbers[left, 1] if k < _CALLS // 2 else ROBUST
        poses[left], _, numbers[left] = refine(poses[left], *given, stages, numbers[left, 2])
    return Minima(poses, numbers[:, 0])


def polished(motor: Reals, task: PoseTask) -> tuple[Reals, Reals, float]:
    """Return a minimum (8) to rounding, its normal equations (21), and its cost, from a motor near it."""
    given = task.seen.arguments
    refine: Any = kernels.refine_pose
    pose, table, numbers = refine(
        motor, *given, task.model.size, SCALE * task.noise, _PLAIN, 1e-12, 0.0, ROBUST, _DAMPING
    )
    return pose, table, float(numbers[0])


def _descended(first: Reals, task: PoseTask, stage: float, metric: float) -> Minima:
    return _descend(first, task, SCALE * task.noise, 1e-6 * task.noise * task.noise, stage, metric)


def limited_costs(poses: Reals, task: PoseTask) -> Reals:
    """Return the sums of squared distances of poses (b, 8), in which large distances count equally."""
    given, model = task.seen.arguments, task.model
    judge: Any = kernels.judge_pose
    numbers = judge(poses, *given, np.zeros(21), model.size, model.centre, _FAR)[-1]
    return np.asarray(numbers[:, 2] + _FAR**2 * (task.seen.n_pixels - numbers[:, 0]))


def _nearest(first: Reals, task: PoseTask) -> Reals:
    """Return the initial poses with the least limited costs."""
    costs = limited_costs(first, task)
    order = np.argsort(costs, kind="stable")
    # Poses that differ by a symmetry of the object have equal costs, and one of them is enough.
    ahead = np.diff(costs[order], prepend=-np.inf) > NEGLIGIBLE * np.maximum(costs[order], 1)
    return np.asarray(first[order[ahead][:_CHOSEN]])


def pose_by_consensus(task: PoseTask) -> Reals | None:
    """Return a pose (1, 8) from random samples of the points of the camera that sees most of them."""
    seen = task.seen
    if len(seen.of["points"].rows) < 6:
        return None
    k = fullest_camera(seen, ("points",))
    found = localize(*points_of_camera(seen, k), seen.cameras[k], threshold=REJECTED * task.noise)
    return pose_seen_by(seen.cameras[k], found.pose)[None] if found.status == VisionStatus.OK else None
