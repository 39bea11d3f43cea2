"""Landmarks with hidden points, and localisation in a corridor by landmarks on its walls."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from selection import some_slow
from test_vision_invariants import CAMERA, landmarks, seen

from algorithms.vision import LandmarkMap, OmnidirectionalCamera, VisionStatus, localize_by_landmarks
from algorithms.vision.camera import Camera
from generated import pga3

Array = np.ndarray[Any, Any]
PIXEL = 1 / 400
"""One pixel of the camera of the tests, in radians."""


VIEWS = [(2, 0.88, 15), (0, 0.95, 50), (2, 0.88, 50)]


@pytest.mark.parametrize(("n_hidden", "least", "count"), some_slow(VIEWS, *VIEWS[1:]))
@pytest.mark.slow
def test_landmarks_are_recognised_with_points_hidden(n_hidden: int, least: float, count: int) -> None:
    """With one pixel of noise, given as such; the earlier method recognised 46 % with two of ten points hidden."""
    right = wrong = unknown = 0
    rng = np.random.default_rng(9)
    shapes = landmarks(rng, 50)
    learned = LandmarkMap.learn([np.stack([seen(rng, shape, 1.0) for _ in range(5)]) for shape in shapes])
    for k, shape in enumerate(shapes[:count]):
        order = rng.permutation(10)[: 10 - n_hidden]
        found = learned.recognize(seen(rng, shape, 1.0)[order], PIXEL)
        right += found.landmark == k
        wrong += found.landmark not in (k, -1)
        if found.landmark == k:
            matched = found.matches >= 0
            assert matched.sum() >= 8 and np.array_equal(found.matches[matched], order[matched])
    for shape in landmarks(rng, 15 if count == 50 else 5):
        unknown += learned.recognize(seen(rng, shape, 1.0)[n_hidden:], PIXEL).status == VisionStatus.OK
    assert right >= least * count and wrong == 0 and unknown == 0


def corridor(rng: np.random.Generator) -> tuple[list[Array], list[Array]]:
    """Planar shapes (10, 2) of landmarks, and positions (10, 3) of their points on both walls of a corridor."""
    shapes = landmarks(rng, 20)
    places = []
    for k, shape in enumerate(shapes):
        side = 1 if k % 2 else -1
        along = side * shape[:, 0] + 1 + 2 * (k // 2)
        places.append(np.stack([along, np.full(10, 1.5 * side), 1.2 + shape[:, 1]], 1))
    return shapes, places


def directions(rng: np.random.Generator, pose: Array, place: Array, noise: float) -> Array:
    """Directions of points in the frame of a camera at this pose, with noise in pixels."""
    camera = OmnidirectionalCamera(Camera(CAMERA.camera.intrinsics, pose), CAMERA.mirror)
    pixels = camera.project(place)
    return np.asarray(CAMERA.directions(pixels + noise * rng.normal(size=pixels.shape)))


@pytest.mark.parametrize("count", some_slow([4, 12], 12))
def test_a_camera_is_localised_in_a_corridor(count: int) -> None:
    """Test positions and headings, with the three nearest landmarks."""
    rng = np.random.default_rng(1)
    shapes, places = corridor(rng)
    learned = LandmarkMap.learn([np.stack([seen(rng, shape, 1.0) for _ in range(5)]) for shape in shapes])
    found_all, off, turned = 0, [], []
    for x in np.linspace(1, 19, count):
        matrix = np.eye(4)
        # The axis of the mirror is approximately vertical.
        turn = Rotation.from_rotvec([0, 0, rng.uniform(-np.pi, np.pi)]) * Rotation.from_rotvec(0.1 * rng.normal(size=3))
        matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), [x, rng.uniform(-0.5, 0.5), 1.0]
        nearest = np.argsort([np.linalg.norm(place.mean(0) - matrix[:3, 3]) for place in places])[:3]
        groups = [
            directions(rng, pga3.motor_from_matrix(matrix), places[k][order], 1.0)
            for k in nearest
            for order in [rng.permutation(10)]
        ]
        found = localize_by_landmarks(learned, places, groups, PIXEL)
        if found.status != VisionStatus.OK:
            continue
        found_all += 1
        assert all(k in (-1, right) for k, right in zip(found.landmarks, nearest, strict=True))
        there = pga3.motor_to_matrix(found.pose)
        off.append(np.linalg.norm((there - matrix)[:3, 3]))
        turned.append(Rotation.from_matrix(there[:3, :3].T @ matrix[:3, :3]).magnitude())
    assert found_all >= 0.9 * count
    assert np.median(off) < 0.02 and max(off) < 0.1
    assert np.median(turned) < np.radians(0.3) and max(turned) < np.radians(2)


def test_exact_directions_give_the_exact_pose() -> None:
    rng = np.random.default_rng(2)
    shapes, places = corridor(rng)
    learned = LandmarkMap.learn([seen(rng, shape, 0.0)[None] for shape in shapes])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_rotvec([0.1, 0.05, 2.0]).as_matrix(), [7.3, 0.2, 1.0]
    pose = pga3.motor_from_matrix(matrix)
    groups = [directions(rng, pose, places[k][::-1], 0.0) for k in (6, 7)]
    found = localize_by_landmarks(learned, places, groups, PIXEL)
    assert found.status == VisionStatus.OK and list(found.landmarks) == [6, 7]
    np.testing.assert_allclose(pga3.motor_to_matrix(found.pose), matrix, atol=1e-8)


def test_landmarks_of_another_size_contradict_each_other() -> None:
    """Three landmarks that are 15 % larger than stated; with the stated size the same scene is OK."""
    rng = np.random.default_rng(6)
    shapes, places = corridor(rng)
    learned = LandmarkMap.learn([np.stack([seen(rng, shape, 1.0) for _ in range(5)]) for shape in shapes])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_rotvec([0.05, 0.1, 1.0]).as_matrix(), [8.0, 0.3, 1.0]
    groups = [directions(rng, pga3.motor_from_matrix(matrix), places[k], 0.5) for k in (6, 7, 8)]
    for size, status in ((1.0, VisionStatus.OK), (1 / 1.15, VisionStatus.NO_CONSENSUS)):
        stated = [place.mean(0) + size * (place - place.mean(0)) for place in places]
        assert localize_by_landmarks(learned, stated, groups, PIXEL).status == status


def test_invalid_places_of_landmarks_are_rejected() -> None:
    rng = np.random.default_rng(3)
    shapes, places = corridor(rng)
    learned = LandmarkMap.learn([seen(rng, shape, 0.0)[None] for shape in shapes])
    unknown = [seen(rng, shape, 1.0) for shape in landmarks(rng, 2)]
    assert localize_by_landmarks(learned, places, unknown, PIXEL).status == VisionStatus.NO_CONSENSUS
    assert localize_by_landmarks(learned, places, [], PIXEL).status == VisionStatus.TOO_FEW
    with pytest.raises(ValueError, match="places: "):
        localize_by_landmarks(learned, places[:-1], unknown, PIXEL)
    # Two exchanged landmarks contradict each other: no pose agrees with more than half of them.
    exchanged = [*places[:6], places[7], places[6], *places[8:]]
    pose = pga3.motor_from_matrix(np.array([[0.0, -1, 0, 7], [1, 0, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]]))
    groups = [directions(rng, pose, places[k], 0.0) for k in (6, 7)]
    assert localize_by_landmarks(learned, exchanged, groups, PIXEL).status == VisionStatus.NO_CONSENSUS
