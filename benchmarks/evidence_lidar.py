"""Scenes of a lidar in halls for the page of evidence: vans that drive, jerks, and ranges that are off."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from algorithms.mapping import LidarOdometry
from generated import motor_graphs, pga3

from .evidence_scenes import Trial, row
from .streets import Street, beams, cloud

_COUNT = 8
"""Scans of a drive."""
_BOUND = 4.74
"""Standard deviations that the largest of six errors exceeds with a probability of a thousandth."""


def _hall(rng: np.random.Generator) -> Street:
    """Four walls, a ceiling, pillars and machines; corners of boxes."""
    half, height = rng.uniform([8, 6], [20, 12]), rng.uniform(4, 9)
    boxes = [
        [-half[0], -half[1] - 1, 0, half[0], -half[1], height],
        [-half[0], half[1], 0, half[0], half[1] + 1, height],
        [-half[0] - 1, -half[1], 0, -half[0], half[1], height],
        [half[0], -half[1], 0, half[0] + 1, half[1], height],
        [-half[0], -half[1], height, half[0], half[1], height + 1],
    ]
    for _ in range(rng.integers(4, 14)):
        place, size = rng.uniform(-half + 1, half - 1), rng.uniform(0.3, 2.5, 3)
        if np.abs(place[1]) > 2.5 + size[1]:
            boxes.append([*(place - size[:2] / 2), 0, *(place + size[:2] / 2), size[2] * 1.5])
    table = np.array(boxes)
    return Street(table[:, :3], table[:, 3:])


def _ways(rng: np.random.Generator, shift: float, turn: float) -> list[np.ndarray]:
    """Poses ahead with an even motion, and with motions of up to a length and an angle that differ in each step."""
    pose = np.array([-5.0, rng.uniform(-1, 1), rng.uniform(-0.3, 0.3)])
    speed, found = np.array([rng.uniform(0.1, 0.7), 0, rng.uniform(-0.05, 0.05)]), []
    for _ in range(_COUNT):
        found.append(np.asarray(pga3.motor_from_rotation_vector_translation([0, 0, pose[2]], [*pose[:2], 1.5])))
        step = speed + rng.uniform(-1, 1, 3) * [shift, shift, turn]
        c, s = np.cos(pose[2]), np.sin(pose[2])
        pose = pose + np.array([c * step[0] - s * step[1], s * step[0] + c * step[1], step[2]])
        pose[:2] = np.clip(pose[:2], [-7, -2], [7, 2])
    return found


def _driven(
    rng: np.random.Generator,
    poses: list[np.ndarray],
    world: Callable[[int], Street],
    change: Callable[[np.ndarray], np.ndarray] = lambda points: points,
) -> Trial:
    """Whether the last pose is right to 20 cm and 2 degrees, or within its bound."""
    odometry, directions = LidarOdometry(), beams(32, 240)
    for k, pose in enumerate(poses):
        status = odometry.add(change(cloud(rng, world(k), pose, directions)))
    truth = pga3.motor_product(pga3.motor_inverse(poses[0]), poses[-1])
    error = np.asarray(motor_graphs.difference_of_motors(odometry.pose, truth)[0])
    is_near = np.linalg.norm(error[:3]) < np.radians(2) and np.linalg.norm(error[3:]) < 0.2
    is_within = error @ np.linalg.lstsq(odometry.covariance, error, rcond=None)[0] < _BOUND**2
    return Trial(status == 0, bool(is_near or is_within))


@row("`LidarOdometry`", "eight scans in a hall with pillars and machines, 32 rings", good=True, slow=True)
def drives_in_halls(rng: np.random.Generator) -> Trial:
    hall = _hall(rng)
    return _driven(rng, _ways(rng, 0.05, 0.02), lambda k: hall)


@row("`LidarOdometry`", "the same, each motion up to 1.5 m and 29 degrees other than the last one", slow=True)
def drives_with_jerks(rng: np.random.Generator) -> Trial:
    hall = _hall(rng)
    return _driven(rng, _ways(rng, 1.5, 0.5), lambda k: hall)


@row("`LidarOdometry`", "the same, one to three vans beside the lidar that drive at other speeds", slow=True)
def drives_beside_vans(rng: np.random.Generator) -> Trial:
    hall, count = _hall(rng), int(rng.integers(1, 4))
    start = np.stack([rng.uniform(-8, 4, count), rng.choice([-1, 1], count) * rng.uniform(2.8, 4, count)], 1)
    speed, size = rng.uniform(-1, 1.5), rng.uniform([2, 0.5, 2], [6, 1, 3.5], (count, 3))

    def world(k: int) -> Street:
        place = start + np.array([speed * k, 0])
        low = np.column_stack([place - size[:, :2] / 2, np.zeros(count)])
        high = np.column_stack([place + size[:, :2] / 2, size[:, 2]])
        return Street(np.concatenate([hall.low, low]), np.concatenate([hall.high, high]))

    return _driven(rng, _ways(rng, 0.05, 0.02), world)


@row("`LidarOdometry`", "the same, ranges off by 5 to 30 cm, or by 3 to 15 %", slow=True)
def drives_with_wrong_ranges(rng: np.random.Generator) -> Trial:
    hall, is_offset = _hall(rng), rng.random() < 0.5
    by = rng.choice([-1, 1]) * (rng.uniform(0.05, 0.3) if is_offset else rng.uniform(0.03, 0.15))

    def change(points: np.ndarray) -> np.ndarray:
        distances = np.linalg.norm(points, axis=1, keepdims=True)
        return np.asarray(points * (1 + by / distances) if is_offset else points * (1 + by))

    return _driven(rng, _ways(rng, 0.05, 0.02), lambda k: hall, change)
