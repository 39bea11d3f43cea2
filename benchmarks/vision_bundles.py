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
    """Return two scenes, with the calls of gtsam and pycolmap if they are installed."""
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
    if installed("pycolmap"):
        calls["pycolmap"] = pycolmaps(views, start, table)
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


def pycolmaps(cameras: list[Camera], points: Any, table: Observations, tolerance: float = 1e-10) -> Callable[[], Any]:
    """Return a call of COLMAP's adjustment by Ceres on one thread, from the same start to the same minimum.

    It changes and returns a copy of the scene, which takes less than a hundredth of the time.
    """
    pycolmap: Any = __import__("pycolmap")
    scene, k, tracks = pycolmap.Reconstruction(), cameras[0].intrinsics, [pycolmap.Track() for _ in points]
    lens = [k[0, 0], k[1, 1], k[0, 2], k[1, 2]]
    scene.add_camera_with_trivial_rig(pycolmap.Camera(model="PINHOLE", width=640, height=480, params=lens, camera_id=1))
    which = pycolmap.BundleAdjustmentConfig()
    for i, view in enumerate(cameras):
        rows = np.flatnonzero(table.camera == i)
        pose = pycolmap.Rigid3d(pga3.motor_to_matrix(pga3.motor_inverse(view.pose))[:3])
        image = pycolmap.Image(name=str(i), keypoints=table.pixels[rows], camera_id=1, image_id=i + 1)
        scene.add_image_with_trivial_frame(image, pose)
        which.add_image(i + 1)
        for row, j in enumerate(table.point[rows].tolist()):
            tracks[j].add_element(i + 1, row)
    for place, track in zip(points, tracks, strict=True):
        scene.add_point3D(place, track, np.zeros(3, np.uint8))
    which.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_focal_length = options.refine_extra_params = options.refine_sensor_from_rig = False
    options.print_summary = False
    solver = options.ceres.solver_options
    solver.num_threads, solver.function_tolerance, solver.gradient_tolerance = 1, tolerance, tolerance

    def call() -> Any:
        copy = pycolmap.Reconstruction(scene)  # the adjuster does not keep it alive
        pycolmap.create_default_bundle_adjuster(options, which, copy).solve()
        return copy

    return call
