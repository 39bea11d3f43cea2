"""Problems of bundle adjustment for the page of vision."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from algorithms.vision import Camera, Observations, bundle_adjust
from generated import pga3

from .libraries import installed
from .tasks import OURS, Task


def tasks(rng: np.random.Generator, quick: bool) -> list[Task]:
    """Return two scenes, with the calls of gtsam if it is installed."""
    sizes = ((5, 40), (6, 50)) if quick else ((10, 500), (50, 10_000))
    return [_task(rng, c, m) for c, m in sizes]


def _task(rng: np.random.Generator, c: int, m: int) -> Task:
    points = rng.uniform(-1, 1, (m, 3))
    angles, shifts = rng.uniform(-1, 1, c), rng.uniform(-0.5, 0.5, (c, 3))
    turns = np.stack([np.zeros(c), angles, np.zeros(c)], 1) + 0.02 * rng.normal(size=(c, 3))
    centres = 6 * np.stack([-np.sin(angles), np.zeros(c), -np.cos(angles)], 1) + shifts
    poses = pga3.motor_from_rotation_vector_translation(turns, centres)
    camera, point = np.nonzero(rng.random((c, m)) < max(0.12, 4 / c))
    keep = np.bincount(point, minlength=m)[point] >= 2
    camera, point = camera[keep], point[keep]
    present = np.unique(point)
    points, point = points[present], np.searchsorted(present, point)
    cameras = [Camera.from_intrinsics(700.0, (320, 240), pose) for pose in poses]
    pixels = np.concatenate([view.project(points[point[camera == i]]) for i, view in enumerate(cameras)])
    table = Observations(camera, point, pixels + 0.5 * rng.normal(size=pixels.shape))
    motions = 0.02 * rng.normal(size=(2, c, 3))
    motions[:, 0] = 0
    moved = pga3.motor_product(poses, pga3.motor_from_rotation_vector_translation(*motions))
    views = [Camera(view.intrinsics, motor) for view, motor in zip(cameras, moved, strict=True)]
    start = points + 0.02 * rng.normal(size=points.shape)
    calls: dict[str, Callable[[], object]] = {OURS: lambda: bundle_adjust(views, start, table, covariance=None)}
    if installed("gtsam"):
        calls["gtsam"] = _gtsams(views, start, table)
    return Task(f"bundle adjustment of {c} cameras and {len(points):,} points in {len(camera):,} pixels", 1, calls)


def _gtsams(cameras: list[Camera], points: Any, table: Observations) -> Callable[[], object]:
    """Return a call of gtsam's method of Levenberg and Marquardt, from the same start to the same minimum."""
    gtsam: Any = __import__("gtsam")
    graph, start, noise = gtsam.NonlinearFactorGraph(), gtsam.Values(), gtsam.noiseModel.Isotropic.Sigma(2, 1.0)
    k, first = cameras[0].intrinsics, len(points)
    lens = gtsam.Cal3_S2(k[0, 0], k[1, 1], 0.0, k[0, 2], k[1, 2])
    for i, j, pixel in zip(table.camera.tolist(), table.point.tolist(), table.pixels, strict=True):
        graph.add(gtsam.GenericProjectionFactorCal3_S2(pixel, noise, first + i, j, lens))
    poses = [gtsam.Pose3(pga3.motor_to_matrix(view.pose)) for view in cameras]
    # A prior instead of a constraint, for which gtsam would use the slower QR factorization.
    graph.add(gtsam.PriorFactorPose3(first, poses[0], gtsam.noiseModel.Isotropic.Sigma(6, 1e-4)))
    for i, pose in enumerate(poses):
        start.insert(first + i, pose)
    for j, place in enumerate(points):
        start.insert(j, gtsam.Point3(place))
    options = gtsam.LevenbergMarquardtParams()
    options.setRelativeErrorTol(1e-10)
    options.setAbsoluteErrorTol(0)
    options.setlambdaInitial(1e-4)
    return lambda: gtsam.LevenbergMarquardtOptimizer(graph, start, options).optimize()
