"""Clouds of scanned objects, damaged by missing parts and outliers, with known motions."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from algorithms.registration import Registration
from generated import pga3

OBJECTS = ("bunny", "Banana", "CrackerBox", "FoamBrick", "MustardBottle", "PowerDrill", "TomatoSoupCan")
_FILE = Path(__file__).parents[1] / "tests" / "data" / "registration" / "rigid.npz"
Array = np.ndarray[Any, Any]


@cache
def clouds() -> dict[str, Array]:
    """Return the arrays of the file by name, in float64."""
    with np.load(_FILE) as file:
        return {name: file[name].astype(float) for name in file.files}


def cut(points: Array, rng: np.random.Generator) -> Array:
    """Cut off 30 % of the points by a plane."""
    place = points @ rng.normal(size=3)
    return np.asarray(points[place <= np.quantile(place, 0.7)])


def with_outliers(points: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Add as many uniform outliers as points, and return whether points are true."""
    low, high = points.min(0), points.max(0)
    both = np.concatenate([points, low + (high - low) * rng.random(points.shape)])
    order = rng.permutation(len(both))
    return both[order], order < len(points)


def moved(points: Array, extent: Array, rng: np.random.Generator, turn: Rotation) -> tuple[Array, Array]:
    """Move points by a rotation and a random translation, and return the matrix that takes them back."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), rng.normal(size=3) * np.ptp(extent)
    return (points - matrix[:3, 3]) @ matrix[:3, :3], matrix


def scene(name: str, seed: int, angle: float | None = None) -> tuple[Array, Array, Array, Array]:
    """Return a cut source with outliers, which of its points are true, the whole target, and the true matrix."""
    rng = np.random.default_rng(seed)
    cloud = clouds()[name]
    source, target = (cloud, cloud) if cloud.ndim == 2 else cloud
    source, true = with_outliers(cut(source, rng), rng)
    axis = rng.normal(size=3)
    turn = Rotation.random(random_state=seed) if angle is None else Rotation.from_rotvec(
        angle * axis / np.linalg.norm(axis)
    )  # fmt: skip
    source, matrix = moved(source, target, rng, turn)
    return source, true, target, matrix


def split_scene(name: str, seed: int, outliers_in: str) -> tuple[Array, Array, Array]:
    """Return clouds of which one has outliers and the other one is cut, and the true matrix."""
    rng = np.random.default_rng(seed)
    cloud = clouds()[name]
    source, target = (cloud, cloud) if cloud.ndim == 2 else cloud
    if outliers_in == "source":
        source, target = with_outliers(source, rng)[0], cut(target, rng)
    else:
        source, target = cut(source, rng), with_outliers(target, rng)[0]
    source, matrix = moved(source, target, rng, Rotation.random(random_state=seed))
    return source, target, matrix


def error(found: Array, true: Array, place: Array) -> tuple[float, float]:
    """Return the angle in degrees, and the distance at a place, between two matrices."""
    turn = found[:3, :3].T @ true[:3, :3]
    angle = float(np.degrees(np.linalg.norm(Rotation.from_matrix(turn).as_rotvec())))
    return angle, float(np.linalg.norm((found - true) @ np.append(place, 1)))


def least_error(result: Registration, true: Array, source: Array) -> tuple[float, float]:
    """Return the least angle and distance of the poses, each also moved along the free motion."""
    found = [result.poses.motors]
    for free in result.free:
        turns = np.linspace(-np.pi / 2, np.pi / 2, 721)[:, None] * free / np.linalg.norm(free[:3])
        found.append(pga3.motor_product(pga3.motor_exponential(turns)[:, None], result.poses.motors).reshape(-1, 8))
    middle = source.mean(0)
    errors = [error(matrix, true, middle) for matrix in pga3.motor_to_matrix(np.concatenate(found))]
    return min(errors, key=lambda e: e[0] + 100 * e[1])
