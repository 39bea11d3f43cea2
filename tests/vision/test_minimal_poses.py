"""All poses of a camera that sees three points."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.vision import Camera, DegenerateError, Distortion, poses_of_three_points
from generated import pga3

Array = np.ndarray[Any, Any]
K = np.array([[700.0, 3, 320], [0, 690, 240], [0, 0, 1]])
PLACES = np.array([[0.3, 0.1, 4], [-0.5, 0.6, 5], [0.8, -0.4, 6]])


def pixels(pose: Array, places: Array) -> tuple[Array, Array]:
    """The pixels of points in a pose, and their depths."""
    there = pga3.move_point_back(pose, places)
    return (there / there[:, 2:] @ K.T)[:, :2], there[:, 2]


def test_every_pose_shows_the_pixels_and_the_true_one_is_among_them() -> None:
    rng, counts = np.random.default_rng(1), np.zeros(5, int)
    for k in range(150):
        pose = pga3.motor_from_rotation_vector_translation(0.4 * rng.normal(size=3), rng.normal(size=3))
        places = np.asarray(pga3.move_point(pose, rng.normal((0, 0, 5), size=(3, 3)))) + 1e4 * (k % 2)
        pose = pga3.motor_product(
            pga3.motor_from_rotation_vector_translation(np.zeros(3), np.full(3, 1e4 * (k % 2))), pose
        )
        image, depths = pixels(pose, places)
        if (depths < 0.1).any():
            continue
        found = poses_of_three_points(places, image, K)
        counts[len(found)] += 1
        assert min(np.abs(each * np.sign(each @ pose) - pose).max() / (1 + 1e4 * (k % 2)) for each in found) < 1e-6
        for each in found:
            again, depths = pixels(each, places)
            assert np.abs(again - image).max() < 1e-3 and (depths > 0).all()
            assert abs(each @ pga3.normalize_motor(each) - each @ each) < 1e-9 * (each @ each)
    assert not counts[0] and counts[2] > 50 and counts[4] > 2


def test_lenses_and_invalid_input() -> None:
    image, _ = pixels(np.eye(8)[0], PLACES)
    lens = Camera(K, np.eye(8)[0], distortion=Distortion("brown", [-0.2, 0.05]))
    plain = poses_of_three_points(PLACES, image, K)
    assert np.abs(poses_of_three_points(PLACES, lens.distort(image), lens) - plain).max() < 1e-9
    assert len(poses_of_three_points(PLACES.astype(np.float32), image.tolist(), K)) == len(plain)
    for wrong in (np.array([[0.0, 0, 4], [0, 0, 5], [0, 0, 6]]), PLACES * np.nan):
        with pytest.raises(DegenerateError, match="three"):
            poses_of_three_points(wrong, image, K)
    with pytest.raises(ValueError, match="three points"):
        poses_of_three_points(np.empty((0, 3)), np.empty((0, 2)), K)
    with pytest.raises(ValueError, match="intrinsics"):
        poses_of_three_points(PLACES, image, np.ones((3, 3)))
