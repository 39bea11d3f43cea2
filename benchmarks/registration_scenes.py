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


def damaged(points: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Cut off 30 % of the points by a plane, and add as many uniform outliers as remain."""
    direction = rng.normal(size=3)
    place = points @ direction
    left = points[place <= np.quantile(place, 0.7)]
    low, high = left.min(0), left.max(0)
    both = np.concatenate([left, low + (high - low) * rng.random((len(left), 3))])
    order = rng.permutation(len(both))
    return both[order], order < len(left)


def scene(name: str, seed: int, angle: float | None = None) -> tuple[Array, Array, Array, Array]:
    """Return a damaged source, whether its points are true, the whole target, and the true matrix between them."""
    rng = np.random.default_rng(seed)
    cloud = clouds()[name]
    source, target = (cloud, cloud) if cloud.ndim == 2 else cloud
    source, true = damaged(source, rng)
    axis = rng.normal(size=3)
    turn = Rotation.random(random_state=seed) if angle is None else Rotation.from_rotvec(
        angle * axis / np.linalg.norm(axis)
    )  # fmt: skip
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), rng.normal(size=3) * np.ptp(target)
    return (source - matrix[:3, 3]) @ matrix[:3, :3], true, target, matrix


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
