"""Scenes of cameras with an unknown focal length, and of points with lines, for the page of evidence."""

from __future__ import annotations

import numpy as np

from algorithms.vision import FocalMotion, localize, localize_unknown_focal, relative_pose_unknown_focal
from generated import pga3

from .evidence_scenes import Trial, rotation, row

_SIZE = np.array([1000.0, 760.0])
_CENTRE = np.array([490.0, 385.0])
"""A camera that no test uses."""
_LIMIT = 5.0
"""Standard deviations: seven numbers exceed this with a probability of less than a thousandth."""


def _off(own: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return the rotation vector and the translation between two poses, along the axes of the first."""
    turn = pga3.rotor_to_rotation_vector(pga3.rotor_from_matrix(np.ascontiguousarray(own[:3, :3].T @ true[:3, :3])))
    return np.concatenate([turn, true[:3, 3] - own[:3, 3]])


def _within(covariance: np.ndarray, off: np.ndarray, focal: float) -> bool:
    parts = ((covariance[:3, :3], off[:3]), (covariance[3:6, 3:6], off[3:]), (covariance[6:, 6:], np.array([focal])))
    return all(np.linalg.norm(each) < _LIMIT * np.sqrt(np.linalg.eigvalsh(part)[-1]) for part, each in parts)


def _focal_pose(rng: np.random.Generator, n: int, share: float, tilt: float | None, threshold: float | None) -> Trial:
    focal, pixels = np.exp(rng.uniform(6.2, 7.4)), rng.uniform(0, 1, (n, 2)) * _SIZE
    rays = np.insert((pixels - _CENTRE) / focal, 2, 1, axis=1)
    points = rays * rng.uniform(2, 7, n)[:, None]
    if tilt is not None:
        angle = rng.uniform(0, 2 * np.pi)
        normal = np.array([np.sin(tilt) * np.cos(angle), np.sin(tilt) * np.sin(angle), np.cos(tilt)])
        points = rays * (4 / np.maximum(rays @ normal, 0.2))[:, None]
    true = np.eye(4)
    true[:3, :3], true[:3, 3] = rotation(rng, np.pi), rng.normal(size=3) * 10
    pixels += rng.normal(0, 0.6, pixels.shape)
    wrong = rng.random(n) < share
    pixels[wrong] = rng.uniform(0, 1, (int(wrong.sum()), 2)) * _SIZE
    found = localize_unknown_focal(points @ true[:3, :3].T + true[:3, 3], pixels, _CENTRE, threshold=threshold)
    if found.status != 0:
        return Trial(False, False)
    own = pga3.motor_to_matrix(found.pose)
    off = _off(own, true)
    off[3:] = own[:3, :3].T @ off[3:]
    return Trial(True, _within(found.covariance, off, focal - found.focal))


@row("`localize_unknown_focal`", "12 to 60 points in space; wrong: beyond 5 deviations", good=True)
def focal_space(rng: np.random.Generator) -> Trial:
    return _focal_pose(rng, int(rng.integers(12, 61)), 0.0, None, None)


@row("`localize_unknown_focal`", "80 points, a plane in every other scene, 0 to 60 % of the pixels wrong", good=True)
def focal_wrong(rng: np.random.Generator) -> Trial:
    return _focal_pose(rng, 80, rng.uniform(0, 0.6), rng.uniform(0.4, 0.9) if rng.random() < 0.5 else None, 2.0)


@row("`localize_unknown_focal`", "5 to 40 points of a plane within 10 degrees of the image")
def focal_parallel(rng: np.random.Generator) -> Trial:
    return _focal_pose(rng, int(rng.integers(5, 41)), 0.0, rng.uniform(0, 0.17), None)


@row("`localize_unknown_focal`", "10 to 60 points with random pixels")
def focal_random(rng: np.random.Generator) -> Trial:
    return _focal_pose(rng, int(rng.integers(10, 61)), 1.0, None, 2.0)


def _focal_motion(rng: np.random.Generator, n: int, share: float, kind: str) -> Trial:
    focal, true = np.exp(rng.uniform(6.2, 7.4)), np.eye(4)
    while True:
        rays = np.insert((rng.uniform(0, 1, (n, 2)) * _SIZE - _CENTRE) / focal, 2, 1, axis=1)
        points = rays * rng.uniform(4, 11, n)[:, None]
        if kind == "plane":
            normal = np.array([*rng.uniform(-0.5, 0.5, 2), 1.0])
            points = rays * (7 / (rays @ normal))[:, None]
        true[:3, :3] = rotation(rng, np.radians(20))
        way = rng.normal(size=3)
        if kind == "parallel":
            angle = rng.uniform(-0.3, 0.3)
            true[:2, :3] = [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0]]
            true[2, :3] = 0, 0, 1
        if kind == "fixation":
            fixed = np.array([0, 0, rng.uniform(4, 9)])
            way = fixed - true[:3, :3] @ fixed
        true[:3, 3] = way / np.linalg.norm(way) if kind != "fixation" else way
        there = points @ true[:3, :3].T + true[:3, 3]
        turned = np.degrees(np.arccos(np.clip(true[2, 2], -1, 1)))
        if min(there[:, 2].min(), points[:, 2].min()) > 1 and (kind != "space" or turned > 5):
            break
    one, two = (focal * p[:, :2] / p[:, 2:] + _CENTRE + rng.normal(0, 0.5, (n, 2)) for p in (points, there))
    wrong = rng.random(n) < share
    two[wrong] = rng.uniform(0, 1, (int(wrong.sum()), 2)) * _SIZE
    return _is_near(relative_pose_unknown_focal(one, two, _CENTRE, threshold=1.5), true, focal)


def _is_near(found: FocalMotion, true: np.ndarray, focal: float) -> Trial:
    if found.status != 0:
        return Trial(False, False)
    true[:3, 3] /= np.linalg.norm(true[:3, 3])
    return Trial(True, _within(found.covariance, _off(pga3.motor_to_matrix(found.motor), true), focal - found.focal))


@row(
    "`relative_pose_unknown_focal`",
    "100 points in space, axes turned by 5 to 20 degrees, up to a half wrong; wrong: beyond 5 deviations",
    good=True, slow=True,
)  # fmt: skip
def focal_pairs(rng: np.random.Generator) -> Trial:
    return _focal_motion(rng, 100, rng.uniform(0, 0.5), "space")


@row("`relative_pose_unknown_focal`", "parallel axes, or both at the same distance from what they look at", slow=True)
def focal_axes(rng: np.random.Generator) -> Trial:
    return _focal_motion(rng, int(rng.integers(20, 101)), rng.uniform(0, 0.4), rng.choice(["parallel", "fixation"]))


@row("`relative_pose_unknown_focal`", "20 to 100 points of a plane, up to 40 % wrong", slow=True)
def focal_plane(rng: np.random.Generator) -> Trial:
    return _focal_motion(rng, int(rng.integers(20, 101)), rng.uniform(0, 0.4), "plane")


_K = np.array([[870.0, 0, 490], [0, 850.0, 385], [0, 0, 1]])


def _sights(rng: np.random.Generator, n_points: int, n_lines: int, share: float, threshold: float | None) -> Trial:
    pixels = rng.uniform(0, 1, (n_points + 2 * n_lines, 2)) * _SIZE
    ones = np.insert(pixels, 2, 1, axis=1) @ np.linalg.inv(_K).T
    places = ones * rng.uniform(2, 7, len(pixels))[:, None]
    points, lines = places[:n_points], places[n_points:].reshape(-1, 2, 3)
    ends = np.sort(rng.uniform(0, 1, (n_lines, 2, 1)), axis=1) * 0.3 + [[0.0], [0.7]]
    seen = (lines[:, :1] + ends * (lines[:, 1:] - lines[:, :1])) @ _K.T
    image = seen[..., :2] / seen[..., 2:] + rng.normal(0, 0.5, (n_lines, 2, 2))
    pixels = pixels[:n_points] + rng.normal(0, 0.5, (n_points, 2))
    for each in (pixels, image):
        wrong = rng.random(len(each)) < share
        each[wrong] = rng.uniform(0, 1, each[wrong].shape) * _SIZE
    true = np.eye(4)
    true[:3, :3], true[:3, 3] = rotation(rng, np.pi), rng.normal(size=3) * 10
    moved, others = (each @ true[:3, :3].T + true[:3, 3] for each in (points, lines))
    found = localize(moved, pixels, _K, threshold=threshold, lines=others, image_lines=image)
    if found.status != 0:
        return Trial(False, False)
    off = _off(pga3.motor_to_matrix(found.pose), true).reshape(2, 3)
    return Trial(True, bool((np.linalg.norm(off, axis=1) < _LIMIT * found.deviation).all()))


@row("`localize`", "10 to 30 points and 10 to 30 lines, up to a half wrong; wrong: beyond 5 deviations", good=True)
def points_and_lines(rng: np.random.Generator) -> Trial:
    return _sights(rng, int(rng.integers(10, 31)), int(rng.integers(10, 31)), rng.uniform(0, 0.5), 1.8)


@row("`localize`", "4 to 8 points and lines in all, at least one line; wrong: beyond 5 deviations", good=True)
def few_lines(rng: np.random.Generator) -> Trial:
    n = int(rng.integers(4, 9))
    m = int(rng.integers(1, n + 1))
    return _sights(rng, n - m, m, 0.0, None)


@row("`localize`", "5 to 30 points and 5 to 30 lines with random pixels")
def random_lines(rng: np.random.Generator) -> Trial:
    threshold = 1.8 if rng.random() < 0.5 else None
    return _sights(rng, int(rng.integers(5, 31)), int(rng.integers(5, 31)), 1.0, threshold)
