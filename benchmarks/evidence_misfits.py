"""Scenes of cameras, boards and objects that are not what they are taken for, for the page of evidence."""

from __future__ import annotations

import numpy as np

from algorithms.vision import Camera, Distortion, bundle_adjust, calibrate_from_planes, localize, localize_rig
from generated import pga3

from .evidence_scenes import Trial, is_within, row

_K = np.array([[1100.0, 0, 660], [0, 1120.0, 470], [0, 0, 1]])
"""A camera that no test uses."""
_SIZE = np.array([1300.0, 950.0])


def _motor(turn: np.ndarray, place: np.ndarray) -> np.ndarray:
    return np.asarray(pga3.motor_from_rotation_vector_translation(turn, place))


def _cloud(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points of a room, and the pose of a camera in it."""
    pixels = rng.uniform(0.05, 0.95, (int(rng.integers(30, 100)), 2)) * _SIZE
    rays = np.insert((pixels - _K[:2, 2]) / _K[[0, 1], [0, 1]], 2, 1, axis=1)
    pose = _motor(rng.normal(size=3), rng.normal(size=3) * 3)
    return np.asarray(pga3.move_point(pose, rays * rng.uniform(3, 9, len(pixels))[:, None])), pose


def _located(rng: np.random.Generator, points: np.ndarray, pose: np.ndarray, seen: np.ndarray) -> Trial:
    found = localize(points, seen + rng.normal(0, rng.uniform(0.2, 0.7), seen.shape), _K)
    if found.status != 0:
        return Trial(False, False)
    return Trial(True, is_within(found.pose, pose, found.deviation))


def _with_moved(rng: np.random.Generator, is_compact: bool) -> Trial:
    points, pose = _cloud(rng)
    n = int(rng.uniform(0.25, 0.42) * len(points))
    centre = points[rng.integers(len(points))]
    order = np.argsort(np.linalg.norm(points - centre, axis=1)) if is_compact else rng.permutation(len(points))
    there, part = points.copy(), order[:n]
    there[part] += rng.normal(size=3) * np.exp(rng.uniform(np.log(0.01), np.log(0.6)))
    return _located(rng, points, pose, Camera(_K, pose).project(there))


@row("`localize`", "30 to 100 points, a compact object with 25 to 42 % of them moved by 1 to 60 cm, no threshold")
def moved_object(rng: np.random.Generator) -> Trial:
    return _with_moved(rng, True)


@row("`localize`", "the same, with the moved points anywhere")
def moved_points(rng: np.random.Generator) -> Trial:
    return _with_moved(rng, False)


@row("`localize`", "30 to 100 points, k1 of 0.03 to 0.3 without distortion, no threshold")
def bent_pixels(rng: np.random.Generator) -> Trial:
    points, pose = _cloud(rng)
    lens = Distortion("brown", (rng.choice([-1, 1]) * rng.uniform(0.03, 0.3),))
    seen = Camera(_K, pose, lens).project(points)
    shown = np.isfinite(seen).all(1)
    return _located(rng, points[shown], pose, seen[shown])


def _rig_trial(rng: np.random.Generator, is_wrong: bool) -> Trial:
    turns = rng.normal(0, 0.15, (4, 3)) + np.array([[0, a, 0] for a in (-1.5, 0, 1.5, 3.0)])
    cameras = [Camera(_K, _motor(turn, rng.normal(0, 0.3, 3))) for turn in turns]
    pose, n = _motor(rng.normal(size=3), rng.normal(size=3)), int(rng.integers(40, 120))
    which, pixels = rng.integers(0, 4, n), rng.uniform(0, 1, (n, 2)) * _SIZE
    inside = [
        pga3.move_point(cameras[k].pose, rng.uniform(2, 7) * cameras[k].directions(pixel))
        for k, pixel in zip(which, pixels, strict=True)
    ]
    if is_wrong:
        size = np.exp(rng.uniform(np.log(0.3), np.log(3)))
        step = _motor(size * rng.normal(0, 0.01, 3), size * rng.normal(0, 0.03, 3))
        k = int(rng.integers(4))
        cameras[k] = Camera(_K, np.asarray(pga3.motor_product(cameras[k].pose, step)))
    pixels += rng.normal(0, 0.4, pixels.shape)
    found = localize_rig(pga3.move_point(pose, np.array(inside)), pixels, cameras, which)
    if found.status != 0:
        return Trial(False, False)
    return Trial(True, is_within(found.pose, pose, found.deviation))


@row("`localize_rig`", "four cameras, 40 to 120 points, no threshold", good=True)
def rig_of_four(rng: np.random.Generator) -> Trial:
    return _rig_trial(rng, False)


@row("`localize_rig`", "the same, one camera 0.2 to 2 degrees and 1 to 10 cm off")
def rig_of_wrong(rng: np.random.Generator) -> Trial:
    return _rig_trial(rng, True)


def _bundle(rng: np.random.Generator, factor: float, k1: float, share: float, n_lines: int = 0) -> Trial:
    """Right if all rotations are within their bounds, and those of the covariance. Points are less than lines."""
    n_points = int(rng.integers(5, 15) if n_lines else rng.integers(40, 90))
    points, cameras, n = rng.uniform(-1, 1, (n_points, 3)), [], int(rng.integers(4, 9))
    for angle in np.linspace(-0.7, 0.7, n):
        place = rng.uniform(4, 5) * np.array([-np.sin(angle), rng.uniform(-0.1, 0.1), -np.cos(angle)])
        cameras.append(Camera(_K, _motor(np.array([0, angle, 0]) + rng.normal(0, 0.03, 3), place)))
    own, part = _K * [[factor, 1, 1], [1, factor, 1], [1, 1, 1]], points @ rng.normal(size=3) > 0
    part &= rng.random(len(points)) < 2 * share
    size, pixels = np.exp(rng.uniform(np.log(0.01), np.log(0.15))), []
    for camera in cameras:
        there = points + np.where(part[:, None], rng.normal(0, size, 3), 0)
        lens = Distortion("brown", (k1,)) if k1 else None
        pixels.append(Camera(own, camera.pose, lens).project(there) + rng.normal(0, 0.4, points.shape)[:, :2])
    table = *(each.ravel() for each in np.indices((n, len(points)))), np.concatenate(pixels)
    start, ends = points + rng.normal(0, 0.02, points.shape), rng.uniform(-1, 1, (n_lines, 2, 3))
    seen = np.concatenate([Camera(own, camera.pose).project(ends) for camera in cameras])
    image_lines = *(each.ravel() for each in np.indices((n, n_lines))), seen + rng.normal(0, 0.4, seen.shape)
    lines = ends + rng.normal(0, 0.02, ends.shape)
    found = bundle_adjust(cameras, start, table, lines=lines, image_lines=image_lines)
    if found.status != 0:
        return Trial(False, False)
    for one, other, covariance in zip(found.cameras[1:], cameras[1:], found.camera_covariance[1:], strict=True):
        turn = pga3.motor_to_matrix(pga3.motor_product(pga3.motor_inverse(other.pose), one.pose))[:3, :3]
        off = np.asarray(pga3.rotor_to_rotation_vector(pga3.rotor_from_matrix(np.ascontiguousarray(turn))))
        # 4.9 deviations are exceeded with a probability of a millionth.
        if not (np.abs(off) < 4.9 * np.sqrt(np.diag(covariance)[:3])).all():
            return Trial(True, False)
    return Trial(True, True)


@row(
    "`bundle_adjust`",
    "4 to 8 cameras, 40 to 90 points; wrong: a rotation is off by 4.9 deviations",
    good=True,
    slow=True,
)
def right_bundles(rng: np.random.Generator) -> Trial:
    return _bundle(rng, 1.0, 0.0, 0.0)


@row("`bundle_adjust`", "the same, a focal length that is wrong by 3 to 30 % and held", slow=True)
def bundles_of_wrong_focal(rng: np.random.Generator) -> Trial:
    return _bundle(rng, rng.uniform(1.03, 1.3) ** rng.choice([-1, 1]), 0.0, 0.0)


@row("`bundle_adjust`", "the same, k1 of 0.03 to 0.15 without distortion", slow=True)
def bundles_of_bent_lenses(rng: np.random.Generator) -> Trial:
    return _bundle(rng, 1.0, rng.choice([-1, 1]) * rng.uniform(0.03, 0.15), 0.0)


@row("`bundle_adjust`", "the same, 30 to 50 % of the points move by 1 to 15 cm between views", slow=True)
def bundles_of_two_parts(rng: np.random.Generator) -> Trial:
    return _bundle(rng, 1.0, 0.0, rng.uniform(0.3, 0.5))


@row(
    "`bundle_adjust`",
    "5 to 14 points and 15 to 39 lines; wrong: a rotation is off by 4.9 deviations",
    good=True,
    slow=True,
)
def right_bundles_of_lines(rng: np.random.Generator) -> Trial:
    return _bundle(rng, 1.0, 0.0, 0.0, int(rng.integers(15, 40)))


@row("`bundle_adjust`", "the same points and lines, a focal length that is wrong by 3 to 30 % and held", slow=True)
def bundles_of_lines_and_wrong_focal(rng: np.random.Generator) -> Trial:
    factor = rng.uniform(1.03, 1.3) ** rng.choice([-1, 1])
    return _bundle(rng, factor, 0.0, 0.0, int(rng.integers(15, 40)))


def _boards(rng: np.random.Generator, points: np.ndarray, board: np.ndarray, speed: float) -> Trial:
    views = []
    for _ in range(int(rng.integers(8, 15))):
        turn, place = rng.uniform(-0.5, 0.5, 3), np.array([*rng.uniform(-0.3, 0.3, 2), rng.uniform(1.6, 2.6)])
        rate, rows = speed * rng.normal(size=6), np.zeros(len(points))
        for _ in range(4):
            pose = _motor(turn + rows[:, None] * rate[:3], place + rows[:, None] * rate[3:])
            seen = pga3.move_point(pose, points)
            pixels = seen[:, :2] / seen[:, 2:] @ _K[:2, :2].T + _K[:2, 2]
            rows = pixels[:, 1] / _SIZE[1]
        views.append(pixels + rng.normal(0, 0.3, pixels.shape))
    found = calibrate_from_planes(board, views)
    if found.status != 0:
        return Trial(False, False)
    off = np.abs(found.intrinsics[[0, 1, 0, 1], [0, 1, 2, 2]] - _K[[0, 1, 0, 1], [0, 1, 2, 2]])
    return Trial(True, bool((off < 4.4 * np.sqrt(np.diag(found.covariance)[:4])).all()))


def _board() -> tuple[np.ndarray, np.ndarray]:
    board = np.stack(np.meshgrid(np.arange(11.0) - 5, np.arange(8.0) - 3.5), -1).reshape(-1, 2) / 8
    return board, np.insert(board, 2, 0, axis=1)


@row(
    "`calibrate_from_planes`", "8 to 14 boards whose squares are 0.4 to 4 % too long, or uneven by 1 to 4 %", slow=True
)
def uneven_boards(rng: np.random.Generator) -> Trial:
    board, points = _board()
    if rng.random() < 0.5:
        points[:, 0] *= rng.uniform(1.004, 1.04)
    else:
        sides = np.cumsum(1 + rng.uniform(0.01, 0.04) * rng.normal(size=11)) / 8
        points[:, 0] = np.tile(sides - sides.mean(), 8)
    return _boards(rng, points, board, 0.0)


@row("`calibrate_from_planes`", "8 to 14 boards that are bent by 0.3 to 6 % of their width", slow=True)
def bent_boards(rng: np.random.Generator) -> Trial:
    board, points = _board()
    points[:, 2] = rng.choice([-1, 1]) * rng.uniform(0.004, 0.08) * (points[:, 0] / 0.6) ** 2
    return _boards(rng, points, board, 0.0)


@row("`calibrate_from_planes`", "8 to 14 boards that move by 1 to 20 mm and 0.1 to 1 degree between rows", slow=True)
def moving_boards(rng: np.random.Generator) -> Trial:
    board, points = _board()
    return _boards(rng, points, board, rng.uniform(0.001, 0.02))
