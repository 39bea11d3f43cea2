"""Covariances of bundle adjustment: dense inverses, errors of random trials, and sparse systems."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bundle_scenes import BundleScene, Oracle, bundle_scene, disturbed, world_to_camera

from algorithms.vision import BundleAdjustment, Camera, Observations, VisionStatus, bundle_adjust
from generated import pga3

Array = np.ndarray[Any, Any]


def ours(scene: BundleScene, start: tuple[list[Camera], Array], **options: Any) -> BundleAdjustment:
    return bundle_adjust(start[0], start[1], scene.table, **options)


def dense_covariance(found: BundleAdjustment, scene: BundleScene, held: Array, step: float = 1e-6) -> Array:
    """The inverse of the normal equations by differences of the oracle, with motions in the frames of cameras."""
    c, m = len(found.cameras), len(found.points)
    cameras = list(found.cameras)

    def residuals(x: Array) -> Array:
        motions = pga3.motor_from_rotation_vector_translation(
            np.ascontiguousarray(x[: 6 * c].reshape(c, 6)[:, :3]), np.ascontiguousarray(x[: 6 * c].reshape(c, 6)[:, 3:])
        )
        views = [
            Camera(each.intrinsics, pga3.motor_product(each.pose, b)) for each, b in zip(cameras, motions, strict=True)
        ]
        moved = found.points + x[6 * c :].reshape(m, 3)
        return Oracle(views, moved, scene.table).residuals(np.zeros((c, 6)), np.zeros((m, 3))).ravel()

    n = 6 * c + 3 * m
    rows = np.stack([(residuals(step * e) - residuals(-step * e)) / (2 * step) for e in np.eye(n)], 1)
    result = np.zeros((n, n))
    result[np.ix_(~held, ~held)] = np.linalg.inv(rows[:, ~held].T @ rows[:, ~held])
    return result


def test_covariances_are_those_of_a_dense_inverse() -> None:
    scene = bundle_scene(4, 15, seed=31, share=1.0)
    found = ours(scene, disturbed(scene), fixed_cameras=[0, 2], fixed_points=[4], covariance="points", noise=2.0)
    held = np.zeros(24 + 45, bool)
    held[:6] = held[12:18] = held[24 + 12 : 24 + 15] = True
    dense = 4.0 * dense_covariance(found, scene, held)
    for i in range(4):
        np.testing.assert_allclose(
            found.camera_covariance[i], dense[6 * i : 6 * i + 6, 6 * i : 6 * i + 6], rtol=1e-4, atol=1e-9
        )
    for j in range(15):
        part = slice(24 + 3 * j, 27 + 3 * j)
        np.testing.assert_allclose(found.point_covariance[j], dense[part, part], rtol=1e-4, atol=1e-9)


def errors_of(found: BundleAdjustment, scene: BundleScene) -> tuple[Array, Array]:
    """The motions (c, 6) and moves (m, 3) from what was found to the truth."""
    motions = pga3.motor_product(pga3.motor_inverse(found.poses), np.array([each.pose for each in scene.cameras]))
    turns, shifts = pga3.motor_to_rotation_vector_translation(motions * np.where(motions[:, :1] < 0, -1, 1))
    return np.concatenate([turns, shifts], 1), scene.points - found.points


@pytest.mark.parametrize("lens_of", [(0, 0, 0), (0, 1, 0, 1)])
def test_covariance_of_a_lens_is_that_of_a_dense_inverse(lens_of: tuple[int, ...]) -> None:
    """Eight numbers of a lens are in two blocks; known points and poses leave only these."""
    n = len(lens_of)
    scene = bundle_scene(n, 30, seed=35, share=1.0)
    cameras = [Camera.from_intrinsics(600.0, (320, 240), each.pose) for each in scene.cameras]
    names = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
    found = bundle_adjust(
        cameras, scene.points, scene.table, distortion="brown", intrinsics=lens_of, estimated=names, noise=20.0,
        fixed_cameras=range(n), fixed_points=np.arange(30),
    )  # fmt: skip
    oracle, zeros = Oracle(cameras, scene.points, scene.table, "brown"), np.zeros((n, 6))
    step = np.where(np.arange(8) < 4, 1e-3, 1e-6)
    for number in set(lens_of):
        first = lens_of.index(number)
        k = found.cameras[first].intrinsics
        lens = np.concatenate([k[[0, 1, 0, 1], [0, 1, 2, 2]], found.distortion[first]])
        own = np.array(lens_of)[scene.table.camera] == number

        def residuals(x: Array, own: Array = own) -> Array:
            return oracle.residuals(zeros, np.zeros((30, 3)), x)[own].ravel()

        rows = np.stack(
            [(residuals(lens + d) - residuals(lens - d)) / (2 * d.max()) for d in np.eye(8, 12) * step[:, None]]
        )
        np.testing.assert_allclose(found.lens_covariance[number], 400 * np.linalg.inv(rows @ rows.T), rtol=1e-4)
    assert not found.camera_covariance.any() and found.status == VisionStatus.OK


@pytest.mark.parametrize("trials", [pytest.param(200, marks=pytest.mark.slow), 20])
def test_errors_agree_with_covariances(trials: int) -> None:
    """Squared errors by the inverse covariance (NEES) are those of chi-square, also with the scale held."""
    scene = bundle_scene(5, 40, seed=32, share=0.8, noise=0.0)
    exact, squares, of_points = scene.table.pixels.copy(), [], []
    rng = np.random.default_rng(33)
    for _ in range(trials):
        table = replace(scene.table, pixels=exact + 0.5 * rng.normal(size=exact.shape))
        found = bundle_adjust(scene.cameras, scene.points, table, noise=0.5, covariance="points")
        motions, moves = errors_of(found, scene)
        far = np.linalg.norm([world for world in centres(scene.cameras) - centres(scene.cameras)[0]], axis=1).argmax()
        for i in range(1, 5):
            covariance = found.camera_covariance[i]
            rank = 5 if i == far else 6
            assert np.linalg.matrix_rank(covariance, tol=1e-12 * np.trace(covariance)) == rank
            squares.append(motions[i] @ np.linalg.pinv(covariance, rcond=1e-9) @ motions[i] / rank)
        of_points += [d @ np.linalg.solve(p, d) / 3 for d, p in zip(moves, found.point_covariance, strict=True)]
    # Errors of one trial are correlated: the means are of `trials` independent numbers of 24 or more freedoms at best.
    assert abs(np.mean(squares) - 1) < 5 * np.sqrt(2 / (6 * trials))
    assert abs(np.mean(of_points) - 1) < 5 * np.sqrt(2 / (6 * trials))


def centres(cameras: list[Camera]) -> Array:
    turns, shifts = world_to_camera(cameras)
    return -(np.swapaxes(turns, 1, 2) @ shifts[:, :, None])[:, :, 0]


def test_many_cameras_are_solved_as_sparse_systems(monkeypatch: pytest.MonkeyPatch) -> None:
    """A dense and a sparse solution of the same scene agree: the limit between them is a limit on work."""
    scene = bundle_scene(12, 60, seed=34, share=0.5)
    start = disturbed(scene)
    options: dict[str, Any] = dict(intrinsics="shared", estimated=("f",), covariance="points")
    cameras = [Camera.from_intrinsics(600.0, (320, 240), each.pose) for each in start[0]]
    dense = bundle_adjust(cameras, start[1], scene.table, **options)
    monkeypatch.setattr("algorithms.vision.bundle_system._DENSE", 0)
    sparse = bundle_adjust(cameras, start[1], scene.table, **options)
    assert sparse.status == dense.status == VisionStatus.OK
    assert sparse.cost == pytest.approx(dense.cost, rel=1e-12)
    for name in ("camera_covariance", "point_covariance", "lens_covariance"):
        np.testing.assert_allclose(getattr(sparse, name), getattr(dense, name), rtol=1e-6, atol=1e-12)
    camera, point = scene.table.camera, scene.table.point
    keep = ((camera < 6) == (point < 30)) | (point < 2)
    part = Observations(camera[keep], point[keep], scene.table.pixels[keep])
    loose = bundle_adjust(cameras, start[1], part)
    assert loose.status == VisionStatus.DEGENERATE and (loose.camera_status[6:] == VisionStatus.DEGENERATE).all()
