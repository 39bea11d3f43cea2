"""Cameras, boards and scenes that are not what they are taken for: no pose is OK and beyond its bound."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from algorithms.vision import (
    Camera,
    Distortion,
    VisionStatus,
    bundle_adjust,
    calibrate_from_planes,
    localize,
    localize_rig,
)
from generated import pga3

K = np.array([[700.0, 0, 330], [0, 710.0, 250], [0, 0, 1]])


def _pose(rng: np.random.Generator, turn: float, far: float) -> np.ndarray:
    """A camera that looks at the origin, turned by about `turn`."""
    return np.asarray(pga3.motor_from_rotation_vector_translation(rng.normal(0, turn, 3), np.array([0.1, -0.2, -far])))


def _is_right(found: np.ndarray, truth: np.ndarray, deviation: np.ndarray) -> bool:
    off = pga3.motor_to_matrix(pga3.motor_product(pga3.motor_inverse(found), truth))
    angle = np.arccos(np.clip((np.trace(off[:3, :3]) - 1) / 2, -1, 1))
    return bool(angle < 4.5 * deviation[0] and np.linalg.norm(off[:3, 3]) < 4.5 * deviation[1])


def _bent_lens(rng: np.random.Generator, points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    return Camera(K, pose, Distortion("brown", (rng.choice([-0.25, 0.2]),))).project(points)


def _moved_part(rng: np.random.Generator, points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    moved = points.copy()
    moved[points[:, 0] > 0.25] += rng.normal(0, 0.05, 3)
    return Camera(K, pose).project(moved)


def _two_parts(rng: np.random.Generator, points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    moved = points.copy()
    moved[rng.random(len(points)) < 0.4] += rng.normal(0, 0.03, 3)
    return Camera(K, pose).project(moved)


@pytest.mark.parametrize("image", [_bent_lens, _moved_part, _two_parts])
def test_wrong_models_have_no_pose_beyond_the_bound(
    image: Callable[[np.random.Generator, np.ndarray, np.ndarray], np.ndarray],
) -> None:
    wrong = 0
    for k in range(40):
        rng = np.random.default_rng([k, 31])
        points, pose = rng.uniform(-1, 1, (50, 3)), _pose(rng, 0.2, 4.0)
        pixels = image(rng, points, pose) + rng.normal(0, 0.3, (50, 2))
        found = localize(points, pixels, K)
        wrong += found.status == VisionStatus.OK and not _is_right(found.pose, pose, found.deviation)
        right = localize(points, Camera(K, pose).project(points) + rng.normal(0, 0.3, (50, 2)), K)
        assert right.status == VisionStatus.OK and _is_right(right.pose, pose, right.deviation)
    assert wrong == 0


def test_rigs_with_a_camera_elsewhere_are_refused() -> None:
    for k in range(20):
        rng = np.random.default_rng([k, 32])
        cameras = [
            Camera(K, np.asarray(pga3.motor_from_rotation_vector_translation(np.array([0, a, 0]), np.array([a, 0, 0]))))
            for a in (-0.5, 0.5)
        ]
        pose, which = _pose(rng, 1.0, 1.0), np.arange(60) % 2
        sights = np.array([cameras[j].directions(p) for j, p in zip(which, rng.uniform(50, 450, (60, 2)), strict=True)])
        inside = [
            pga3.move_point(cameras[j].pose, rng.uniform(2, 6) * ray) for j, ray in zip(which, sights, strict=True)
        ]
        pixels = np.array([
            cameras[j].project(x[None])[0]
            for j, x in zip(which, inside, strict=True)
        ])  # fmt: skip
        pixels += rng.normal(0, 0.3, pixels.shape)
        points = pga3.move_point(pose, np.array(inside))
        right = localize_rig(points, pixels, cameras, which)
        assert right.status == VisionStatus.OK and _is_right(right.pose, pose, right.deviation)
        step = pga3.motor_from_rotation_vector_translation(rng.normal(0, 0.01, 3), rng.normal(0, 0.05, 3))
        moved = Camera(K, np.asarray(pga3.motor_product(cameras[1].pose, step)))
        assert localize_rig(points, pixels, [cameras[0], moved], which).status != VisionStatus.OK


@pytest.mark.parametrize("kind", ["right", "focal", "radial", "parts", "scattered"])
def test_bundles_of_other_cameras_are_not_beyond_the_bound(kind: str) -> None:
    for k in range(8):
        rng = np.random.default_rng([k, 33])
        points, cameras = rng.uniform(-1, 1, (60, 3)), []
        for angle in np.linspace(-0.5, 0.5, 6):
            place = 4.5 * np.array([-np.sin(angle), 0.1 * rng.normal(), -np.cos(angle)])
            turn = np.array([0, angle, 0]) + rng.normal(0, 0.02, 3)
            cameras.append(Camera(K, np.asarray(pga3.motor_from_rotation_vector_translation(turn, place))))
        lens = Distortion("brown", (0.1,)) if kind == "radial" else None
        own = K * [[1.15, 1, 1], [1, 1.15, 1], [1, 1, 1]] if kind == "focal" else K
        pixels = []
        for camera in cameras:
            there = points.copy()
            if kind == "parts":
                there[points[:, 2] > 0.2] += rng.normal(0, 0.03, 3)
            elif kind == "scattered":
                there[::3] += rng.normal(0, 0.01, 3)
            pixels.append(Camera(own, camera.pose, lens).project(there) + rng.normal(0, 0.3, (60, 2)))
        table = *(each.ravel() for each in np.indices((6, 60))), np.concatenate(pixels)
        found = bundle_adjust(cameras, points + rng.normal(0, 0.01, points.shape), table)
        assert found.status == VisionStatus.OK or kind != "right"
        assert found.status == VisionStatus.NOT_CONVERGED or kind != "scattered"
        if found.status == VisionStatus.OK:
            for camera, truth, covariance in zip(
                found.cameras[1:], cameras[1:], found.camera_covariance[1:], strict=True
            ):
                off = pga3.motor_to_matrix(pga3.motor_product(pga3.motor_inverse(truth.pose), camera.pose))
                turned = pga3.rotor_to_rotation_vector(pga3.rotor_from_matrix(np.ascontiguousarray(off[:3, :3])))
                assert (np.abs(turned) < 5 * np.sqrt(np.diag(covariance)[:3])).all()


@pytest.mark.parametrize("kind", ["right", "bent", "long", "moving"])
def test_wrong_boards_do_not_move_cameras_beyond_the_bound(kind: str) -> None:
    board = np.stack(np.meshgrid(np.arange(8.0) - 3.5, np.arange(6.0) - 2.5), -1).reshape(-1, 2) / 8
    for k in range(6):
        rng, views = np.random.default_rng([k, 34]), []
        points = np.insert(board, 2, 0, axis=1) * ([1.006, 1, 1] if kind == "long" else [1, 1, 1])
        if kind == "bent":
            points[:, 2] = 0.02 * points[:, 0] ** 2
        for _ in range(12):
            turn, place = rng.uniform(-0.5, 0.5, 3), np.array([*rng.uniform(-0.2, 0.2, 2), rng.uniform(1.0, 1.6)])
            speed = rng.normal(0, 0.004, 6) * (kind == "moving")
            rows = np.zeros(len(points))
            for _ in range(4):
                poses = pga3.motor_from_rotation_vector_translation(
                    turn + rows[:, None] * speed[:3], place + rows[:, None] * speed[3:]
                )
                seen = pga3.move_point(np.asarray(poses), points)
                pixels = seen[:, :2] / seen[:, 2:] @ K[:2, :2].T + K[:2, 2]
                rows = pixels[:, 1] / 500
            views.append(pixels + rng.normal(0, 0.2, pixels.shape))
        found = calibrate_from_planes(board, views)
        assert found.status == VisionStatus.OK or kind != "right"
        if found.status == VisionStatus.OK:
            off = np.abs(found.intrinsics[[0, 1, 0, 1], [0, 1, 2, 2]] - [700, 710, 330, 250])
            assert (off < 4.5 * np.sqrt(np.diag(found.covariance)[:4])).all()
