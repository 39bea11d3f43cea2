"""Scenes of vision for the page of evidence: each trial says whether a result is OK, and whether it is right."""

from __future__ import annotations

import numpy as np

from algorithms.vision import localize
from generated import pga3

from .evidence_scenes import BOUND, Trial, rotation, row

_K = np.array([[1100.0, 0, 700], [0, 1080.0, 520], [0, 0, 1]])
"""A camera that no test uses."""


def _view(rng: np.random.Generator, points: np.ndarray, distance: float, tilt: float, noise: float) -> tuple:
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
