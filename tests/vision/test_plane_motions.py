"""Motions between two images of a plane, from their homography, beside motions that are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.vision import Camera, DegenerateError, Distortion, motions_of_plane
from generated import pga3

Array = np.ndarray[Any, Any]
K = np.array([[700.0, 3, 320], [0, 690, 240], [0, 0, 1]])
OTHER = np.array([[500.0, 0, 300], [0, 510, 200], [0, 0, 1]])


def scene(rng: np.random.Generator) -> tuple[Array, Array, Array, Array]:
    """A motor, a unit normal, the homography of pixels, and pixels of points that both cameras see."""
    while True:
        normal = rng.normal(loc=(0, 0, 2))
        normal /= np.linalg.norm(normal)
        motor = pga3.motor_from_rotation_vector_translation(0.5 * rng.normal(size=3), 0.4 * rng.normal(size=3))
        matrix = pga3.motor_to_matrix(motor)
        rays = np.concatenate([rng.uniform(-0.5, 0.5, (8, 2)), np.ones((8, 1))], 1)
        depths = 1 / (rays @ normal)
        moved = (rays * depths[:, None]) @ matrix[:3, :3].T + matrix[:3, 3]
        if (depths > 0).all() and (moved[:, 2] > 0).all() and normal @ matrix[:3, :3].T @ matrix[:3, 3] > -0.9:
            homography = OTHER @ (matrix[:3, :3] + np.outer(matrix[:3, 3], normal)) @ np.linalg.inv(K)
            return motor, normal, homography * rng.choice([-3.0, 0.1]), (rays @ K.T)[:, :2]


def test_the_motion_is_found_and_the_other_one_has_the_same_homography() -> None:
    rng, counts = np.random.default_rng(1), [0, 0, 0]
    for _ in range(300):
        motor, normal, homography, pixels = scene(rng)
        found = motions_of_plane(homography, K, OTHER, pixels=pixels)
        counts[len(found.motors)] += 1
        errors = [np.abs(each * np.sign(each @ motor) - motor).max() for each in found.motors]
        assert min(errors) < 1e-9 and np.abs(found.normals[np.argmin(errors)] - normal).max() < 1e-9
        for each, n in zip(found.motors, found.normals, strict=True):
            matrix = pga3.motor_to_matrix(each)
            same = OTHER @ (matrix[:3, :3] + np.outer(matrix[:3, 3], n)) @ np.linalg.inv(K)
            assert np.abs(same / np.linalg.norm(same) - homography / np.linalg.norm(homography) * np.sign(
                homography[2, 2] * same[2, 2])).max() < 1e-12  # fmt: skip
    assert counts[1] > 20 and counts[2] > 20


def test_coinciding_motions_are_one() -> None:
    """A rotation, and a translation along the normal of the plane."""
    turn = pga3.motor_from_rotation_vector_translation(np.array([0.1, -0.2, 0.3]), np.zeros(3))
    found = motions_of_plane(K @ pga3.motor_to_matrix(turn)[:3, :3] @ np.linalg.inv(K), K)
    assert found.motors.shape == (1, 8) and np.abs(found.motors[0] - turn).max() < 1e-12
    along = K @ (np.eye(3) + np.outer([0, 0, 0.5], [0, 0, 1])) @ np.linalg.inv(K)
    found = motions_of_plane(along, K)
    assert len(found.motors) == 1 and pga3.motor_to_matrix(found.motors[0])[:3, 3] == pytest.approx([0, 0, 0.5])


def test_lenses_and_invalid_input() -> None:
    _, _, homography, pixels = scene(np.random.default_rng(2))
    lens = Camera(K, np.eye(8)[0], distortion=Distortion("brown", [-0.2, 0.05, 0, 0, 0]))
    seen = lens.distort(pixels)
    one, two = (
        motions_of_plane(homography, K, OTHER, pixels=pixels),
        motions_of_plane(homography, lens, OTHER, pixels=seen),
    )
    assert np.array_equal(one.motors.shape, two.motors.shape) and np.abs(one.motors - two.motors).max() < 1e-12
    assert motions_of_plane(homography.astype(np.float32), K, OTHER).motors.shape[1] == 8
    for wrong in (np.ones((3, 3)), np.full((3, 3), np.nan)):
        with pytest.raises(DegenerateError, match="homography with an inverse"):
            motions_of_plane(wrong, K)
    with pytest.raises(ValueError, match="one homography"):
        motions_of_plane(np.tile(homography, (2, 1, 1)), K)
    for few in (np.empty((0, 2)), [[np.nan, 1.0]]):
        with pytest.raises(DegenerateError, match="at least one"):
            motions_of_plane(homography, K, OTHER, pixels=few)
    with pytest.raises(ValueError, match="homography"):
        motions_of_plane(np.eye(4), K)
