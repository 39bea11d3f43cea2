"""Scenes of several views for the page of evidence: relative poses, lenses and bundle adjustment."""

from __future__ import annotations

import numpy as np

from algorithms.vision import (
    Camera,
    Distortion,
    RelativePose,
    bundle_adjust,
    calibrate_from_planes,
    calibrate_stereo,
    localize_rig,
    relative_pose,
)
from generated import pga3

from .evidence_scenes import BOUND, Trial, is_within, rotation, row

_K = np.array([[950.0, 0, 600], [0, 930.0, 410], [0, 0, 1]])
"""A camera that no test uses."""
_SIZE = np.array([1200.0, 820.0])


def _seen(points: np.ndarray) -> np.ndarray:
    pixels = points @ _K.T
    return pixels[:, :2] / pixels[:, 2:]


def _board() -> np.ndarray:
    """Return 70 points of a plane."""
    return np.stack(np.meshgrid(np.arange(10.0) - 4.5, np.arange(7.0) - 3), -1).reshape(-1, 2) / 4


def _pairs(rng: np.random.Generator, points: np.ndarray, shift: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixels of points in two views with noise of half a pixel, and the true motion as a motor."""
    turn = rotation(rng, np.radians(15))
    way = rng.normal(size=3) * [1, 1, 0.5]
    way *= shift / np.linalg.norm(way)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, way
    noise = rng.normal(0, 0.5, (2, len(points), 2))
    return _seen(points) + noise[0], _seen(points @ turn.T + way) + noise[1], np.asarray(pga3.motor_from_matrix(matrix))


def _space(rng: np.random.Generator, n: int, near: float = 5, far: float = 12) -> np.ndarray:
    z = rng.uniform(near, far, n)
    return np.stack([rng.uniform(-0.5, 0.5, n) * z, rng.uniform(-0.35, 0.35, n) * z, z], 1)


def _is_right(found: RelativePose, motor: np.ndarray, limit: float = 3.0) -> Trial:
    """Right if rotation and direction are within a limit in degrees, or within what the covariance says."""
    if found.status != 0:
        return Trial(False, False)
    own, true = (pga3.motor_to_matrix(each) for each in (found.motor, motor))
    way = true[:3, 3] / np.linalg.norm(true[:3, 3])
    cosines = (np.trace(own[:3, :3].T @ true[:3, :3]) - 1) / 2, own[:3, 3] @ way
    off = np.degrees(np.arccos(np.clip(cosines, -1, 1))).max()
    return Trial(True, bool(off < max(limit, np.degrees(BOUND * np.sqrt(np.linalg.eigvalsh(found.covariance)[-1])))))


@row("`relative_pose`", "60 to 200 points in space, a third of the partners wrong", good=True, slow=True)
def relative_space(rng: np.random.Generator) -> Trial:
    one, two, motor = _pairs(rng, _space(rng, int(rng.integers(60, 201))), 1.0)
    wrong = rng.random(len(one)) < 1 / 3
    two[wrong] = rng.uniform(0, 1, (int(wrong.sum()), 2)) * _SIZE
    return _is_right(relative_pose(one, two, _K, threshold=1.5), motor)


@row("`relative_pose`", "a rotation only; none to a third of the partners wrong", slow=True)
def rotation_only(rng: np.random.Generator) -> Trial:
    one, two, _ = _pairs(rng, _space(rng, int(rng.integers(60, 201))), 1e-9)
    wrong = rng.random(len(one)) < rng.uniform(0, 1 / 3)
    two[wrong] = rng.uniform(0, 1, (int(wrong.sum()), 2)) * _SIZE
    return Trial(relative_pose(one, two, _K, threshold=1.5).status == 0, False)


@row("`relative_pose`", "a plane; a fifth of the partners wrong; wrong: 3 degrees off and more than stated", slow=True)
def relative_plane(rng: np.random.Generator) -> Trial:
    points = _space(rng, int(rng.integers(60, 201)))
    normal = np.array([*rng.uniform(-0.4, 0.4, 2), 1.0])
    points *= (rng.uniform(6, 10) / (points @ normal))[:, None]
    one, two, motor = _pairs(rng, points, 1.0)
    wrong = rng.random(len(one)) < 0.2
    two[wrong] = rng.uniform(0, 1, (int(wrong.sum()), 2)) * _SIZE
    return _is_right(relative_pose(one, two, _K, threshold=1.5), motor)


@row("`relative_pose`", "20 to 100 pairs at random, or partners 10 to 20 pixels from the first pixel", slow=True)
def random_pairs(rng: np.random.Generator) -> Trial:
    one = rng.uniform(0, 1, (int(rng.integers(20, 101)), 2)) * _SIZE
    near = one + rng.normal(0, rng.uniform(10, 20), one.shape)
    two = near if rng.random() < 0.5 else rng.uniform(0, 1, one.shape) * _SIZE
    return Trial(relative_pose(one, two, _K, threshold=1.5).status == 0, False)


@row("`relative_pose`", "10 to 40 pairs at random, each given three to eight times up to 0.4 pixels", slow=True)
def repeated_pairs(rng: np.random.Generator) -> Trial:
    one, two = (rng.uniform(0, 1, (int(rng.integers(10, 41)), 2)) * _SIZE for _ in range(2))
    n, repeats = min(len(one), len(two)), int(rng.integers(3, 9))
    one, two = (np.repeat(each[:n], repeats, axis=0) for each in (one, two))
    one, two = (each + rng.normal(0, rng.uniform(0.1, 0.4), each.shape) for each in (one, two))
    return Trial(relative_pose(one, two, _K, threshold=1.5).status == 0, False)


@row("`relative_pose`", "100 to 200 points in space, a noise from half the threshold to all of it", slow=True)
def noise_above_threshold(rng: np.random.Generator) -> Trial:
    one, two, motor = _pairs(rng, _space(rng, int(rng.integers(100, 201))), rng.uniform(0.3, 1.0))
    more = np.sqrt(rng.uniform(0.75, 1.5) ** 2 - 0.5**2)
    one, two = (each + rng.normal(0, more, each.shape) for each in (one, two))
    return _is_right(relative_pose(one, two, _K, threshold=1.5), motor)


@row(
    "`calibrate_from_planes`",
    "8 to 15 views of 70 points through a lens with k1 of -0.3 to 0.2; wrong: a parameter off by 4.9 deviations",
    good=True, slow=True,
)  # fmt: skip
def bent_views(rng: np.random.Generator) -> Trial:
    board = _board()
    lens = Distortion("brown", (rng.uniform(-0.3, 0.2), rng.uniform(-0.05, 0.1)))
    boards, views = [], []
    for _ in range(int(rng.integers(8, 16))):
        place = np.array([*rng.uniform(-0.4, 0.4, 2), -4])
        pose = pga3.motor_from_rotation_vector_translation(rng.uniform(-0.5, 0.5, 3), place)
        pixels = Camera(_K, pose, lens).project(np.insert(board, 2, 0, axis=1)) + rng.normal(0, 0.3, (70, 2))
        shown = np.isfinite(pixels).all(1)  # others are beyond the range of the lens
        boards.append(board[shown])
        views.append(pixels[shown])
    found = calibrate_from_planes(boards, views, distortion="brown")
    ok = found.status == 0
    if not ok:
        return Trial(False, False)
    truth = np.array([950, 930, 600, 410, *lens.coefficients[:2]])
    own = np.array([*found.intrinsics[[0, 1, 0, 1], [0, 1, 2, 2]], *found.distortion.coefficients[:2]])  # type: ignore[union-attr]
    # 4.9 deviations are exceeded by one of six numbers with a probability of a millionth each.
    return Trial(True, bool((np.abs(own - truth) < 4.9 * np.sqrt(np.diag(found.covariance)[:6])).all()))


@row("`bundle_adjust`", "4 to 8 cameras, 40 points, starts off by 0.05, noise of 0.4 pixels", good=True, slow=True)
def adjusted_views(rng: np.random.Generator) -> Trial:
    return _adjusted(rng, wrong=False)


@row("`bundle_adjust`", "the same, 2 % of the pixels 20 to 60 off, without a robust loss", slow=True)
def adjusted_wrong_pixels(rng: np.random.Generator) -> Trial:
    return _adjusted(rng, wrong=True)


def _adjusted(rng: np.random.Generator, wrong: bool) -> Trial:
    points = rng.normal(size=(40, 3)) * 0.6
    cameras, starts = [], []
    for angle in np.linspace(-0.7, 0.7, int(rng.integers(4, 9))):
        place = 6 * np.array([-np.sin(angle), rng.uniform(-0.1, 0.1), -np.cos(angle)])
        pose = pga3.motor_from_rotation_vector_translation(np.array([0, angle, 0]) + rng.normal(0, 0.02, 3), place)
        cameras.append(Camera(_K, np.asarray(pose)))
        step = pga3.motor_from_rotation_vector_translation(rng.normal(0, 0.02, 3), rng.normal(0, 0.05, 3))
        starts.append(Camera(_K, np.asarray(pga3.normalize_motor(pga3.motor_product(pose, step)))))
    starts[0] = cameras[0]
    camera, point = (table.ravel() for table in np.indices((len(cameras), 40)))
    pixels = np.concatenate([each.project(points) for each in cameras]) + rng.normal(0, 0.4, (len(camera), 2))
    if wrong:
        some = rng.choice(len(camera), max(len(camera) // 50, 1), replace=False)
        pixels[some] += rng.choice([-1, 1], (len(some), 2)) * rng.uniform(20, 60, (len(some), 2))
    found = bundle_adjust(starts, points + rng.normal(0, 0.05, points.shape), (camera, point, pixels))
    if found.status != 0:
        return Trial(False, False)
    # Both are compared in the frame of the first camera, in units of the distance to the last.
    own, true = (_shape(each) for each in ((found.cameras, found.points), (cameras, points)))
    return Trial(True, bool(np.abs(own - true).max() < 0.05))


def _shape(scene: tuple[list[Camera], np.ndarray]) -> np.ndarray:
    cameras, points = scene
    own = np.asarray(pga3.move_point_back(cameras[0].pose, points))
    last = pga3.move_point_back(cameras[0].pose, pga3.motor_to_matrix(cameras[-1].pose)[:3, 3])
    return own / np.linalg.norm(last)


@row(
    "`calibrate_stereo`",
    "2 to 8 views of 70 points, up to a quarter wrong, noise of 0.1 to 0.5 pixels; wrong: beyond the covariance",
    good=True, slow=True,
)  # fmt: skip
def stereo_boards(rng: np.random.Generator) -> Trial:
    board = _board()
    eyes = Camera(_K, np.eye(8)[0], Distortion("brown", (-0.2, 0.03))), Camera(_K, np.eye(8)[0])
    motion = pga3.motor_from_rotation_vector_translation(
        rng.normal(0, 0.1, 3), np.array([-0.5, *rng.normal(0, 0.1, 2)])
    )
    first, second, deviation = [], [], rng.uniform(0.1, 0.5)
    for _ in range(int(rng.integers(2, 9))):
        place = np.array([*rng.uniform(-0.4, 0.4, 2), rng.uniform(4, 6)])
        pose = pga3.motor_from_rotation_vector_translation(rng.uniform(-0.5, 0.5, 3), place)
        points = pga3.move_point(pose, np.insert(board, 2, 0, axis=1))
        first.append(eyes[0].project(points) + rng.normal(0, deviation, (70, 2)))
        second.append(eyes[1].project(pga3.move_point(motion, points)) + rng.normal(0, deviation, (70, 2)))
    for k in range(len(first) // 4):
        second[k] = second[k][::-1] if rng.random() < 0.5 else second[k] + rng.uniform(8, 60, 2)
    found = calibrate_stereo(board, first, second, *eyes)
    if found.status != 0:
        return Trial(False, False)
    own, true = (pga3.motor_to_matrix(each) for each in (found.motor, motion))
    turn = pga3.rotor_to_rotation_vector(pga3.rotor_from_matrix(own[:3, :3] @ true[:3, :3].T))
    off = np.concatenate([turn, own[:3, 3] - true[:3, 3]])
    # Chi-square of six numbers exceeds 38 with a probability of a millionth.
    return Trial(True, bool(off @ np.linalg.solve(found.covariance, off) < 38))


@row("`localize_rig`", "three cameras, 60 points, a third of the pixels wrong; wrong: beyond 5 deviations", good=True)
def rig_of_three(rng: np.random.Generator) -> Trial:
    return _rig(rng, 60, 1 / 3)


@row("`localize_rig`", "the same with random pixels")
def rig_random(rng: np.random.Generator) -> Trial:
    return _rig(rng, int(rng.integers(10, 61)), 1.0)


def _rig(rng: np.random.Generator, n: int, share: float) -> Trial:
    cameras = [
        Camera(_K, np.asarray(pga3.motor_from_rotation_vector_translation(np.array([0, a, 0]), rng.normal(0, 0.3, 3))))
        for a in (-0.8, 0.0, 0.8)
    ]
    pose = pga3.motor_from_rotation_vector_translation(rng.normal(size=3), rng.normal(size=3))
    which, pixels = np.arange(n) % 3, rng.uniform(0, 1, (n, 2)) * _SIZE
    sights = np.array([cameras[k].directions(p) for k, p in zip(which, pixels, strict=True)])
    inside = [
        pga3.move_point(cameras[k].pose, rng.uniform(3, 9) * sight) for k, sight in zip(which, sights, strict=True)
    ]
    pixels += rng.normal(0, 0.5, pixels.shape)
    wrong = rng.random(n) < share
    pixels[wrong] = rng.uniform(0, 1, (int(wrong.sum()), 2)) * _SIZE
    found = localize_rig(pga3.move_point(pose, np.array(inside)), pixels, cameras, which, threshold=1.5)
    if found.status != 0:
        return Trial(False, False)
    return Trial(True, is_within(found.pose, pose, found.deviation, 5.0))
