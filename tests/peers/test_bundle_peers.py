"""Bundle adjustment against gtsam and scipy on the same scenes, and problems in BAL's format from gtsam's wheel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy
from bundle_scenes import BundleScene, bundle_scene, disturbed

from algorithms.vision import BundleAdjustment, Camera, Observations, VisionStatus, bundle_adjust, read_bal, write_bal
from benchmarks.vision_bundles import pycolmaps
from generated import bundles, pga3

pytestmark = pytest.mark.peers

Array = np.ndarray[Any, Any]


def gtsams(cameras: list[Camera], points: Array, table: Observations, steps: int = 100) -> float:
    """The cost of gtsam's minimum with the first camera held."""
    gtsam = pytest.importorskip("gtsam")
    graph, start, noise = gtsam.NonlinearFactorGraph(), gtsam.Values(), gtsam.noiseModel.Isotropic.Sigma(2, 1.0)
    k = cameras[0].intrinsics
    lens = gtsam.Cal3_S2(k[0, 0], k[1, 1], 0.0, k[0, 2], k[1, 2])
    first = 10**6
    for i, j, pixel in zip(table.camera.tolist(), table.point.tolist(), table.pixels, strict=True):
        graph.add(gtsam.GenericProjectionFactorCal3_S2(pixel, noise, first + i, j, lens))
    poses = [gtsam.Pose3(pga3.motor_to_matrix(each.pose)) for each in cameras]
    # A constraint would be eliminated by QR, which is 80 times slower; the prior is exact at the minimum.
    graph.add(gtsam.PriorFactorPose3(first, poses[0], gtsam.noiseModel.Isotropic.Sigma(6, 1e-4)))
    for i, pose in enumerate(poses):
        start.insert(first + i, pose)
    for j in np.unique(table.point).tolist():
        start.insert(j, gtsam.Point3(points[j]))
    options = gtsam.LevenbergMarquardtParams()
    options.setRelativeErrorTol(1e-10)
    options.setAbsoluteErrorTol(0)
    options.setlambdaInitial(1e-4)
    options.setMaxIterations(steps)
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, start, options)
    optimizer.optimize()
    return float(optimizer.error())


def scipys(cameras: list[Camera], points: Array, table: Observations) -> float:
    """The cost of scipy's minimum with the first camera held, with the Jacobian of our kernels."""
    c, m, k = len(cameras), len(points), len(table.camera)
    motors = np.array([each.pose for each in cameras])
    lens = np.tile(cameras[0].intrinsics[[0, 1, 0, 1, 0], [0, 1, 2, 2, 1]], (k, 1))
    rows = np.arange(2 * k).reshape(k, 2, 1)
    by_camera = np.broadcast_to(6 * (table.camera - 1)[:, None, None] + np.arange(6), (k, 2, 6))
    by_point = np.broadcast_to(6 * (c - 1) + 3 * table.point[:, None, None] + np.arange(3), (k, 2, 3))
    free = np.broadcast_to((table.camera > 0)[:, None, None], (k, 2, 6))
    places = (
        np.concatenate([np.broadcast_to(rows, (k, 2, 6))[free], np.broadcast_to(rows, (k, 2, 3)).ravel()]),
        np.concatenate([by_camera[free], by_point.ravel()]),
    )

    def equations(x: Array) -> Any:
        motions = np.concatenate([np.zeros((1, 6)), x[: 6 * (c - 1)].reshape(-1, 6)])
        moved = pga3.motor_product(
            motors,
            pga3.motor_from_rotation_vector_translation(
                np.ascontiguousarray(motions[:, :3]), np.ascontiguousarray(motions[:, 3:])
            ),
        )
        at = points + x[6 * (c - 1) :].reshape(m, 3)
        seen = moved[table.camera], at[table.point], lens, table.pixels
        return bundles.pinhole_equations(*seen, np.ones(k), np.ones(k), 0.0, 1.0, 0.0)

    def jacobian(x: Array) -> Any:
        _, of_camera, of_point, _ = equations(x)
        # Motions are composed with a start, so the derivatives by them are those at it, up to the size of the motion.
        values = np.concatenate([of_camera[free], of_point.ravel()])
        return scipy.sparse.csr_matrix((values, places), shape=(2 * k, 6 * (c - 1) + 3 * m))

    found = scipy.optimize.least_squares(
        lambda x: equations(x)[0].ravel(), np.zeros(6 * (c - 1) + 3 * m), jacobian, x_scale="jac", method="trf",
        tr_solver="lsmr", xtol=1e-12, ftol=1e-10, gtol=1e-12, max_nfev=200,
    )  # fmt: skip
    return float(found.cost)


def seen_twice(scene: BundleScene) -> Observations:
    table = scene.table
    keep = np.bincount(table.point, minlength=len(scene.points))[table.point] >= 2
    return Observations(table.camera[keep], table.point[keep], table.pixels[keep])


@pytest.mark.parametrize(("c", "m", "share"), [(8, 100, 0.6), (20, 400, 0.3)])
def test_minimum_is_gtsams(c: int, m: int, share: float) -> None:
    scene = bundle_scene(c, m, seed=51, share=share)
    cameras, points = disturbed(scene)
    table = seen_twice(scene)
    found = bundle_adjust(cameras, points, table)
    assert found.status == VisionStatus.OK
    assert found.cost == pytest.approx(gtsams(cameras, points, table), rel=1e-9)


def test_minimum_is_pycolmaps() -> None:
    """Ceres, from the same start."""
    pytest.importorskip("pycolmap")
    scene = bundle_scene(8, 100, seed=53)
    cameras, points = disturbed(scene)
    table = seen_twice(scene)
    present = np.unique(table.point)
    table = Observations(table.camera, np.searchsorted(present, table.point), table.pixels)
    found = bundle_adjust(cameras, points[present], table)
    theirs = pycolmaps(cameras, points[present], table, 1e-14)()
    theirs.update_point_3d_errors()
    assert found.status == VisionStatus.OK
    # Errors of points are means over the images that show them.
    expected = sum(p.error * p.track.length() for p in theirs.points3D.values()) / len(table.camera)
    assert found.residuals.mean() == pytest.approx(expected, rel=1e-6)


def test_minimum_is_scipys_with_the_same_jacobian() -> None:
    scene = bundle_scene(8, 100, seed=52)
    cameras, points = disturbed(scene, 0.001)
    table = seen_twice(scene)
    present = np.unique(table.point)
    table = Observations(table.camera, np.searchsorted(present, table.point), table.pixels)
    found = bundle_adjust(cameras, points[present], table)
    assert found.cost == pytest.approx(scipys(cameras, points[present], table), rel=1e-6)


def bal_files() -> list[Path]:
    gtsam = pytest.importorskip("gtsam")
    return [Path(gtsam.__file__).parent / "Data" / f"dubrovnik-{name}.txt" for name in ("3-7-pre", "3-7-18-pre")]


def gtsams_of_bal(path: Path) -> float:
    """The cost of gtsam's minimum over poses and points with the lenses of the file; it is the same in every gauge."""
    gtsam = pytest.importorskip("gtsam")
    data = gtsam.SfmData.FromBalFile(str(path))
    graph, noise = gtsam.NonlinearFactorGraph(), gtsam.noiseModel.Isotropic.Sigma(2, 1.0)
    start = gtsam.Values()
    for j in range(data.numberTracks()):
        track = data.track(j)
        start.insert(j, track.point3())
        for n in range(track.numberMeasurements()):
            i, pixel = track.measurement(n)
            graph.add(gtsam.GeneralSFMFactor2Cal3Bundler(pixel, noise, 1000 + i, j, 2000 + i))
    for i in range(data.numberCameras()):
        lens = data.camera(i).calibration()
        start.insert(2000 + i, lens)
        graph.add(gtsam.PriorFactorCal3Bundler(2000 + i, lens, gtsam.noiseModel.Constrained.All(3)))
        start.insert(1000 + i, data.camera(i).pose())
    graph.add(gtsam.NonlinearEqualityPose3(1000, data.camera(0).pose()))
    options = gtsam.LevenbergMarquardtParams()
    options.setRelativeErrorTol(1e-12)
    options.setAbsoluteErrorTol(0)
    options.setMaxIterations(500)
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, start, options)
    optimizer.optimize()
    return float(optimizer.error())


def test_problems_in_the_format_of_bal(tmp_path: Path) -> None:
    """Both programs read the same file; the minima over poses and points agree, and so does what is written."""
    for path in bal_files():
        problem = read_bal(path)
        found: BundleAdjustment = problem.problem.adjust()
        assert found.status == VisionStatus.OK
        assert found.cost == pytest.approx(gtsams_of_bal(path), rel=1e-6)
        write_bal(tmp_path / "a.txt", problem.adjusted(found))
        assert gtsams_of_bal(tmp_path / "a.txt") == pytest.approx(found.cost, rel=1e-6)
