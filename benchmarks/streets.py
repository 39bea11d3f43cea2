"""A street in space with known truth: houses, a square, parked cars and poles, seen by a lidar with rings of beams."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from algorithms.arguments import Reals
from generated import pga3


@dataclass(frozen=True, eq=False)
class Street:
    """Boxes along the axes on the ground z = 0.

    Attributes
    ----------
    low, high : array, (k, 3)
        Opposite corners of boxes.
    """

    low: Reals
    high: Reals


def street(rng: np.random.Generator, length: float = 120.0) -> Street:
    """Return houses with gaps and different fronts, cars and poles on both sides of a road along x."""
    boxes = []
    for side in (-1, 1):
        x = -30.0
        while x < length + 30:
            width, depth = rng.uniform(8, 18), rng.uniform(6, 12)
            front = side * rng.uniform(7, 10)
            boxes.append([x, min(front, front + side * depth), 0, x + width, max(front, front + side * depth), 12])
            x += width + rng.choice([0.0, rng.uniform(2, 5)])
        for _ in range(int(length / 12)):
            x, y = rng.uniform(-20, length + 20), side * rng.uniform(4.2, 4.8)
            boxes.append([x - 2.1, y - 0.9, 0.2, x + 2.1, y + 0.9, 1.5])
        for x in np.arange(-20, length + 20, 17.0) + rng.uniform(0, 5):
            boxes.append([x - 0.1, side * 6 - 0.1, 0, x + 0.1, side * 6 + 0.1, 6])
    table = np.array(boxes)
    return Street(table[:, :3], table[:, 3:])


def tunnel() -> Street:
    """Return a road between two walls without ends under a roof."""
    low = np.array([[-500.0, 4, 0], [-500, -5, 0], [-500, -5, 6]])
    return Street(low, np.array([[500.0, 5, 6], [500, -4, 6], [500, 5, 7]]))


def beams(n_rings: int = 24, n_columns: int = 240) -> Reals:
    """Return unit directions of rings from 25 degrees below to 15 degrees above the horizon."""
    up, around = np.meshgrid(np.radians(np.linspace(-25, 15, n_rings)), np.arange(n_columns) * 2 * np.pi / n_columns)
    return np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], -1).reshape(-1, 3)


def cloud(rng: np.random.Generator, world: Street, pose: Reals, directions: Reals, noise: float = 0.02) -> Reals:
    """Return the points that a lidar at a pose, a motor of `pga3`, sees up to 80 m, in its own frame."""
    place = np.asarray(pga3.move_point(pose, np.zeros(3)))
    rays = np.asarray(pga3.move_direction(pose, directions))
    with np.errstate(divide="ignore", invalid="ignore"):
        ranges = np.where(rays[:, 2] < 0, -place[2] / rays[:, 2], np.inf)
        one, two = ((corner[:, None] - place) / rays for corner in (world.low, world.high))
        enter, leave = np.minimum(one, two).max(-1), np.maximum(one, two).min(-1)
    hit = np.where((enter < leave) & (enter > 0), enter, np.inf).min(0)
    ranges = np.minimum(ranges, hit) + noise * rng.normal(size=len(rays))
    seen = ranges < 80
    return np.asarray(ranges[seen, None] * directions[seen])


def drive(rng: np.random.Generator, count: int, step: float = 1.0) -> Reals:
    """Return poses (count, 8) of a vehicle that weaves along a street at up to a step in a scan."""
    poses, phase = [], rng.uniform(0, 2 * np.pi, 3)
    x = 0.0
    for k in range(count):
        x += step * (0.7 + 0.3 * np.sin(0.15 * k + phase[0]))
        y, heading = 1.5 * np.sin(x / 15 + phase[1]), np.arctan(0.1 * np.cos(x / 15 + phase[1]))
        tilt = 0.01 * np.sin(0.5 * k + phase[2])
        level = pga3.motor_from_rotation_vector_translation([0, 0, heading], [x, y, 1.8])
        poses.append(pga3.motor_product(level, pga3.motor_from_rotation_vector_translation([tilt, tilt, 0], [0, 0, 0])))
    return np.array(poses)
