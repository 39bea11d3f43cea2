"""Scenes of vision for the page of evidence: each trial says whether a result is OK, and whether it is right."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from algorithms import vision
from algorithms.vision import (
    Camera,
    LandmarkMap,
    OmnidirectionalCamera,
    calibrate_endoscope,
    calibrate_from_planes,
    localize,
    localize_by_landmarks,
    robust_fundamental_matrix,
    robust_homography,
)
from generated import pga3, projective2

from .evidence_scenes import BOUND, Trial, rotation, row

_K = np.array([[1100.0, 0, 700], [0, 1080.0, 520], [0, 0, 1]])
"""A camera that no test uses."""


def _view(
    rng: np.random.Generator, points: np.ndarray, distance: float, tilt: float, noise: float
) -> tuple[np.ndarray, ...]:
    """Pixels of points about the origin from a camera at a distance, and its rotation and centre."""
    turn = rotation(rng, tilt)
    shift = np.array([*rng.uniform(-0.2, 0.2, 2) * distance, distance])
    there = points @ turn.T + shift
    pixels = there @ _K.T
    return pixels[:, :2] / pixels[:, 2:] + rng.normal(0, noise, (len(points), 2)), turn, -turn.T @ shift


def _angle(pose: np.ndarray, turn: np.ndarray) -> float:
    """Degrees between a pose from the camera to the world and the true rotation."""
    found = pga3.motor_to_matrix(pose)[:3, :3].T
    return float(np.degrees(np.arccos(np.clip((np.trace(found @ turn.T) - 1) / 2, -1, 1))))


def _localized(points: np.ndarray, pixels: np.ndarray, turn: np.ndarray, limit: float) -> Trial:
    found = localize(points, pixels, _K)
    ok = found.status == 0
    bound = np.degrees(BOUND * getattr(found, "deviation", [0])[0])
    return Trial(ok, ok and _angle(found.pose, turn) < max(limit, bound))


@row("`localize`", "four corners of a marker of 25 to 60 pixels, noise of 0.3 pixels; wrong: more than 15 degrees off")
def small_marker(rng: np.random.Generator) -> Trial:
    side = rng.uniform(0.04, 0.1)
    points = side / 2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
    pixels, turn, _ = _view(rng, points, side * 1090 / rng.uniform(25, 60), np.radians(60), 0.3)
    return _localized(points, pixels, turn, 15)


@row(
    "`localize`",
    "four corners of a marker of 200 to 400 pixels, turned by 20 to 60 degrees, noise of 0.3 pixels",
    good=True,
)
def large_marker(rng: np.random.Generator) -> Trial:
    side = rng.uniform(0.04, 0.1)
    points = side / 2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
    while True:
        pixels, turn, _ = _view(rng, points, side * 1090 / rng.uniform(200, 400), np.radians(60), 0.3)
        if turn[2, 2] < np.cos(np.radians(20)):
            return _localized(points, pixels, turn, 15)


@row("`localize`", "8 to 20 points, one 25 to 80 pixels off, no threshold; wrong: more than 2 degrees off")
def wrong_pixel(rng: np.random.Generator) -> Trial:
    n = int(rng.integers(8, 21))
    points = rng.normal(size=(n, 3)) * [1, 1, rng.uniform(0.3, 1)]
    pixels, turn, _ = _view(rng, points, rng.uniform(6, 15), np.pi, 0.4)
    angle = rng.uniform(0, 2 * np.pi)
    pixels[rng.integers(n)] += rng.uniform(25, 80) * np.array([np.cos(angle), np.sin(angle)])
    return _localized(points, pixels, turn, 2)


@row("`localize`", "6 to 30 points in space, noise of 0.2 to 2 pixels", good=True)
def points_in_space(rng: np.random.Generator) -> Trial:
    points = rng.normal(size=(int(rng.integers(6, 31)), 3))
    pixels, turn, _ = _view(rng, points, rng.uniform(6, 15), np.pi, rng.uniform(0.2, 2))
    return _localized(points, pixels, turn, 4)


@row("`localize`", "boards of 5 x 4 points, noise of 0.2 to 1 pixel", good=True)
def boards(rng: np.random.Generator) -> Trial:
    points = np.stack([*np.meshgrid(np.arange(5) - 2.0, np.arange(4) - 1.5), np.zeros((4, 5))], -1).reshape(-1, 3)
    pixels, turn, _ = _view(rng, points, rng.uniform(8, 20), np.radians(60), rng.uniform(0.2, 1))
    return _localized(points, pixels, turn, 10)


def _triangulated(rng: np.random.Generator, place: np.ndarray, baseline: float) -> Trial:
    """A point at a place in the frame of the first of two cameras, which are turned a little."""
    shift = pga3.motor_from_rotor_translation(np.eye(4)[0], np.array([baseline, 0, 0]))
    turn = pga3.motor_from_rotor_translation(pga3.rotor_from_matrix(rotation(rng, 0.1)), np.zeros(3))
    cameras = Camera(_K, np.eye(8)[0]), Camera(_K, pga3.motor_product(shift, turn))
    pixels = []
    for camera in cameras:
        there = camera.matrix @ np.append(place, 1)
        pixels.append(there[:2] / there[2] + rng.normal(0, 0.3, 2))
    call: Any = getattr(vision, "triangulation", None)
    if call is None:
        found = vision.triangulate(cameras, pixels)
        return Trial(bool(np.isfinite(found).all()), bool(np.linalg.norm(found - place) < 0.3 * np.linalg.norm(place)))
    result = call(cameras, pixels, 0.3)
    distance = float(np.linalg.norm(result.points))
    off = abs(1 / distance - 1 / np.linalg.norm(place)) * distance**2
    return Trial(bool(result.status == 0), bool(off < max(BOUND * float(result.deviation), 1e-3)) and place[2] > 0)


@row("`localize`", "20 to 60 points in space whose pixels have y upwards, a threshold of 2 pixels")
def mirrored_pixels(rng: np.random.Generator) -> Trial:
    points = rng.uniform(-1, 1, (int(rng.integers(20, 61)), 3)) * rng.uniform(0.5, 1, 3)
    pixels, _, _ = _view(rng, points, rng.uniform(4, 9), np.pi, 0.5)
    return Trial(localize(points, pixels * [1, -1] + [0, 1040], _K, threshold=2.0).status == 0, False)


@row("`localize`", "5 to 10 points with random pixels, each measured three to eight times, no threshold")
def repeated_points(rng: np.random.Generator) -> Trial:
    n, repeats = int(rng.integers(5, 11)), int(rng.integers(3, 9))
    points = np.repeat(rng.uniform(-1, 1, (n, 3)), repeats, axis=0) + rng.normal(0, 1e-3, (n * repeats, 3))
    pixels = np.repeat(rng.uniform([0, 0], [1400, 1040], (n, 2)), repeats, axis=0)
    return Trial(localize(points, pixels + rng.normal(0, 0.3, pixels.shape), _K).status == 0, False)


@row("`triangulate`", "points behind the cameras, or 500 to 5,000 baselines away; wrong: beyond the bound, or behind")
def undetermined_points(rng: np.random.Generator) -> Trial:
    depth = rng.choice([-1, 1]) * rng.uniform(2, 8) if rng.random() < 0.5 else rng.uniform(50, 500)
    return _triangulated(rng, depth * np.array([*rng.uniform(-0.3, 0.3, 2), 1]), 0.1)


@row("`triangulate`", "points 5 to 30 baselines away, noise of 0.3 pixels", good=True)
def near_points(rng: np.random.Generator) -> Trial:
    return _triangulated(rng, rng.uniform(1, 6) * np.array([*rng.uniform(-0.3, 0.3, 2), 1]), 0.2)


def _motor(rng: np.random.Generator, angle: float, length: float) -> np.ndarray:
    """A random motion by angles and lengths of these deviations."""
    turn = pga3.rotor_from_rotation_vector(rng.normal(0, angle, 3))
    return np.asarray(pga3.motor_from_rotor_translation(turn, rng.normal(0, length, 3)))


def _endoscope(rng: np.random.Generator, angle: float, lost: bool) -> Trial:
    """Twenty images of a pattern of 7 x 5 points of 4 mm, by a camera on a tracked body; lengths in mm."""
    x, z, n = _motor(rng, 1.0, 30), _motor(rng, 1.0, 300), 20
    board = 4.0 * np.stack([*np.meshgrid(np.arange(7) - 3.0, np.arange(5) - 2.0), np.zeros((5, 7))], -1).reshape(-1, 3)
    ahead = pga3.motor_from_rotor_translation(pga3.rotor_from_matrix(np.diag([1.0, -1, -1])), np.array([0, 0, 70.0]))
    eyes = np.array([pga3.motor_product(ahead, _motor(rng, angle, 6)) for _ in range(n)])
    there = pga3.move_point_back(eyes[:, None], board) @ _K.T
    views = there[..., :2] / there[..., 2:] + rng.normal(0, 0.3, (n, len(board), 2))
    bodies = pga3.motor_product(pga3.motor_product(z, eyes), pga3.motor_inverse(x))
    bodies = np.array([pga3.motor_product(body, _motor(rng, 0.0025, 0.25)) for body in bodies])
    if lost:
        views[3], views[5, :4], bodies[8] = np.nan, np.nan, np.nan
    found = calibrate_endoscope(bodies, board, views, _K)
    off = np.linalg.norm((pga3.motor_to_matrix(found.motor) - pga3.motor_to_matrix(x))[:3, 3])
    stated = getattr(found, "deviation", np.zeros(2))[1]
    return Trial(bool(found.status == 0), bool(off < max(BOUND * stated, 2.0)))


@row(
    "`calibrate_endoscope`",
    "20 images with rotations of 0.02 to 0.05; wrong: 2 mm and the bound off",
    slow=True,
)
def small_rotations(rng: np.random.Generator) -> Trial:
    return _endoscope(rng, rng.uniform(0.02, 0.05), False)


@row(
    "`calibrate_endoscope`",
    "20 images, one and four points of another not seen, one pose lost",
    good=True,
    slow=True,
)
def lost_images(rng: np.random.Generator) -> Trial:
    return _endoscope(rng, 0.3, True)


@row("`calibrate_endoscope`", "20 images", good=True, slow=True)
def complete_images(rng: np.random.Generator) -> Trial:
    return _endoscope(rng, 0.3, False)


def _boards(rng: np.random.Generator, distortion: float) -> Trial:
    """Eight views of a board of 8 x 6 points by a camera whose lens has a radial distortion."""
    board = np.stack([*np.meshgrid(np.arange(8) - 3.5, np.arange(6) - 2.5), np.zeros((6, 8))], -1).reshape(-1, 3)
    views = []
    for _ in range(8):
        turn = rotation(rng, 0.7)
        there = board @ turn.T + [*rng.uniform(-1.5, 1.5, 2), rng.uniform(9, 14)]
        ray = there[:, :2] / there[:, 2:]
        ray = ray * (1 + distortion * (ray**2).sum(1, keepdims=True))
        views.append(ray @ _K[:2, :2].T + _K[:2, 2] + rng.normal(0, 0.3, ray.shape))
    found = calibrate_from_planes(board[:, :2], views)
    return Trial(bool(found.status == 0), bool(abs(found.intrinsics[0, 0] / _K[0, 0] - 1) < 0.02))


@row("`calibrate_from_planes`", "eight boards, lens with k1 from -0.4 to -0.1; wrong: focal length off by 2 %")
def bent_lens(rng: np.random.Generator) -> Trial:
    return _boards(rng, rng.uniform(-0.4, -0.1))


@row("`calibrate_from_planes`", "eight boards without distortion, noise of 0.3 pixels", good=True)
def straight_lens(rng: np.random.Generator) -> Trial:
    return _boards(rng, 0.0)


_OMNI = OmnidirectionalCamera.from_intrinsics(420.0, (640, 480), 1.0)


def _shape(rng: np.random.Generator) -> np.ndarray:
    """Ten points of a plane, 1.4 wide, of which no two are close to each other."""
    while True:
        points = rng.uniform(-0.7, 0.7, (10, 2))
        if (np.linalg.norm(points[:, None] - points, axis=-1) + np.eye(10)).min() > 0.2:
            return points


def _rays(rng: np.random.Generator, points: np.ndarray) -> np.ndarray:
    """Directions of points of a plane that approximately faces an omnidirectional camera, with noise of a pixel."""
    turn = rng.uniform(0, 2 * np.pi)
    centre = rng.uniform(1.4, 2.8) * np.array([np.cos(turn), np.sin(turn), rng.uniform(-0.1, 0.5)])
    normal = -centre / np.linalg.norm(centre) + rng.normal(0, 0.3, 3)
    one = np.cross(normal, [0, 0, 1])
    axes = np.stack([one / np.linalg.norm(one), (two := np.cross(normal, one)) / np.linalg.norm(two)])
    pixels = _OMNI.project(centre + points @ axes)
    return np.asarray(_OMNI.directions(pixels + rng.normal(size=pixels.shape)))


@cache
def _landmarks() -> tuple[list[np.ndarray], LandmarkMap]:
    """Forty landmarks, learned from five views each."""
    rng = np.random.default_rng(77)
    shapes = [_shape(rng) for _ in range(40)]
    return shapes, LandmarkMap.learn([np.stack([_rays(rng, shape) for _ in range(5)]) for shape in shapes])


def _recognized(rng: np.random.Generator, known: int, others: int) -> Trial:
    shapes, learned = _landmarks()
    k = int(rng.integers(len(shapes)))
    points = np.concatenate([rng.permutation(shapes[k])[:known], rng.uniform(-0.7, 0.7, (others, 2))])
    found = learned.recognize(_rays(rng, rng.permutation(points)), 1 / 420)
    return Trial(found.status == 0, found.landmark == k)


@row("`LandmarkMap.recognize`", "eight to ten points of one of 40 landmarks among three others, noise of a pixel")
def points_among_others(rng: np.random.Generator) -> Trial:
    return _recognized(rng, int(rng.integers(8, 11)), 3)


@row("`LandmarkMap.recognize`", "nine or ten points of one of 40 landmarks, noise of a pixel", good=True)
def whole_landmarks(rng: np.random.Generator) -> Trial:
    return _recognized(rng, int(rng.integers(9, 11)), 0)


def _corridor(rng: np.random.Generator, hidden: int, others: int) -> Trial:
    """A camera between 16 landmarks on two walls, of which it sees the four nearest ones; wrong: off by 0.5 degrees."""
    shapes, learned = _landmarks()
    places = []
    for k, shape in enumerate(shapes):
        side = 1 if k % 2 else -1
        places.append(np.stack([side * shape[:, 0] + 2 * (k // 2), np.full(10, 1.4 * side), 1.1 + shape[:, 1]], 1))
    turn = rotation(rng, 0.15)
    centre = np.array([rng.uniform(4, 32), rng.uniform(-0.4, 0.4), 1.0])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, centre
    camera = OmnidirectionalCamera(Camera(_OMNI.camera.intrinsics, pga3.motor_from_matrix(matrix)), _OMNI.mirror)
    groups = []
    for k in np.argsort([np.linalg.norm(place.mean(0) - centre) for place in places])[:4]:
        kept = rng.permutation(10)[hidden:]
        aside = places[k].mean(0) + rng.uniform(-0.6, 0.6, (others, 3)) * [1, 0, 1]
        pixels = camera.project(rng.permutation(np.concatenate([places[k][kept], aside])))
        groups.append(_OMNI.directions(pixels + rng.normal(size=pixels.shape)))
    found = localize_by_landmarks(learned, places, groups, 1 / 420)
    return Trial(found.status == 0, found.status == 0 and _angle(found.pose, turn.T) < 1.0)


@row("`localize_by_landmarks`", "the four nearest of 40 landmarks, noise of a pixel", good=True, slow=True)
def four_landmarks(rng: np.random.Generator) -> Trial:
    return _corridor(rng, 0, 0)


@row(
    "`localize_by_landmarks`",
    "the same, one of ten points hidden and two others; wrong: 1 degree off",
    slow=True,
)
def four_landmarks_among_others(rng: np.random.Generator) -> Trial:
    return _corridor(rng, 1, 2)


def _two_views(rng: np.random.Generator, points: np.ndarray, share: float, near: float) -> Trial:
    """Two views of points; a share of partners are the first pixel and noise. Wrong: 2 pixels off in space."""
    shift = np.array([*rng.normal(0, 0.7, 2), rng.normal(0, 0.4)])
    turn = pga3.rotor_to_matrix(pga3.rotor_from_rotation_vector(rng.normal(0, 0.08, 3)))
    images = []
    for r, t in ((np.eye(3), np.zeros(3)), (turn, shift)):
        there = (points @ r.T + t) @ _K.T
        images.append(there[:, :2] / there[:, 2:])
    one, two = (image + rng.normal(0, 0.4, image.shape) for image in images)
    wrong = rng.random(len(points)) < share
    two[wrong] = one[wrong] + rng.normal(0, near, (int(wrong.sum()), 2))
    found = robust_fundamental_matrix(one, two, threshold=1.0, seed=1)
    if found.status != 0:
        return Trial(False, False)
    space = np.stack([*rng.uniform(-2, 2, (2, 100)), rng.uniform(5, 12, 100)], -1)
    first = space @ _K.T
    second = (space @ turn.T + shift) @ _K.T
    first, second = first[:, :2] / first[:, 2:], second[:, :2] / second[:, 2:]
    return Trial(True, bool(np.median(np.abs(vision.epipolar_distance(found.model, first, second))) < 2))


@row(
    "`robust_fundamental_matrix`",
    "a plane; 10 to 40 % of the partners are 8 or 20 pixels from the first pixel",
    slow=True,
)
def plane_with_near_partners(rng: np.random.Generator) -> Trial:
    normal = np.array([*rng.normal(0, 0.4, 2), 1])
    points = np.stack([*rng.uniform(-3, 3, (2, 120)), np.zeros(120)], -1)
    points[:, 2] = 8 - points[:, :2] @ normal[:2]
    return _two_views(rng, points, rng.uniform(0.1, 0.4), rng.choice([8, 20]))


@row(
    "`robust_fundamental_matrix`",
    "120 points in space, a fifth of the partners wrong",
    good=True,
    slow=True,
)
def space_with_near_partners(rng: np.random.Generator) -> Trial:
    points = np.stack([*rng.uniform(-3, 3, (2, 120)), rng.uniform(5, 12, 120)], -1)
    return _two_views(rng, points, 0.2, rng.choice([8, 20]))


@row("`robust_fundamental_matrix`", "10 to 40 pairs at random, each given three to eight times up to 0.4 pixels")
def repeated_random_pairs(rng: np.random.Generator) -> Trial:
    n, repeats = int(rng.integers(10, 41)), int(rng.integers(3, 9))
    pairs = np.repeat(rng.uniform([0, 0] * 2, [1400, 1040] * 2, (n, 4)), repeats, axis=0)
    pairs += rng.normal(0, rng.uniform(0.1, 0.4), pairs.shape)
    return Trial(robust_fundamental_matrix(pairs[:, :2], pairs[:, 2:], threshold=1.5).status == 0, False)


def _plane_pairs(rng: np.random.Generator, n: int, share: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two views of a plane with a noise of 0.5 pixels, a share of partners anywhere, and the homography."""
    normal = np.array([*rng.normal(0, 0.3, 2), 1]) / 8
    shift = np.array([*rng.normal(0, 1, 2), rng.normal(0, 0.5)])
    turn = pga3.rotor_to_matrix(pga3.rotor_from_rotation_vector(rng.normal(0, 0.1, 3)))
    matrix = _K @ (turn + np.outer(shift, normal)) @ np.linalg.inv(_K)
    one = rng.uniform([0, 0], [640, 480], (n, 2))
    two = np.asarray(projective2.transform_point(matrix, one))
    wrong = rng.random(n) < share
    two[wrong] = rng.uniform([0, 0], [640, 480], (int(wrong.sum()), 2))
    return one + rng.normal(0, 0.5, one.shape), two + rng.normal(0, 0.5, two.shape), matrix


@row(
    "`robust_homography`",
    "30 to 200 pairs of a plane, up to half of the partners wrong; wrong: 2 pixels off in the mean of an image",
    good=True,
)
def plane_with_wrong_partners(rng: np.random.Generator) -> Trial:
    return _is_near_plane(*_plane_pairs(rng, int(rng.integers(30, 200)), rng.uniform(0, 0.5)))


def _is_near_plane(one: np.ndarray, two: np.ndarray, truth: np.ndarray) -> Trial:
    found = robust_homography(one, two, threshold=1.5, seed=1)
    if found.status != 0:
        return Trial(False, False)
    grid = np.stack(np.meshgrid([100.0, 320, 540], [80.0, 240, 400]), -1).reshape(-1, 2)
    off = np.linalg.norm(
        projective2.transform_point(found.model, grid) - projective2.transform_point(truth, grid), axis=1
    )
    return Trial(True, bool(off.mean() < 2))


@row("`robust_homography`", "50 to 150 pairs of a plane, noise of 2 to 4 pixels, a threshold of 1.5; wrong: as above")
def plane_with_noise(rng: np.random.Generator) -> Trial:
    one, two, truth = _plane_pairs(rng, int(rng.integers(50, 151)), rng.uniform(0, 0.3))
    return _is_near_plane(one, two + rng.normal(0, rng.uniform(2, 4), two.shape), truth)


@row("`robust_homography`", "10 to 100 pairs at random, or three or four of a plane among them")
def few_pairs_of_a_plane(rng: np.random.Generator) -> Trial:
    n = int(rng.integers(10, 100))
    one, two = rng.uniform([0, 0], [640, 480], (2, n, 2))
    few = int(rng.choice([0, 3, 4]))
    one[:few], two[:few], _ = _plane_pairs(rng, few, 0.0) if few else (one[:0], two[:0], None)
    return Trial(robust_homography(one, two, threshold=1.5, seed=1).status == 0, False)
