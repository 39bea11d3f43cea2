"""Walks of robots through halls, corridors and round rooms while a map is built, for the page of evidence."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from algorithms.mapping import Mapper, ScanStatus
from generated import pga2

from .evidence_buildings import (
    Building,
    Sight,
    any_beams,
    any_building,
    any_pose,
    crowded,
    exact,
    is_free,
    motion_of,
    offset,
    scan_of,
    stepped,
)  # fmt: skip
from .evidence_mapping import motor
from .evidence_scenes import BOUND, Trial, row

_COUNT = 40
"""Scans of a walk."""


def _walk(rng: np.random.Generator, building: Building) -> list[np.ndarray]:
    """Poses 0.2 to 0.6 m apart, mostly ahead; where there is no way, the robot turns."""
    poses = [any_pose(rng, building)]
    while len(poses) < _COUNT:
        a = poses[-1]
        for _ in range(20):
            turn, length = rng.uniform(-0.4, 0.4), rng.uniform(0.2, 0.6)
            b = a + np.array([length * np.cos(a[2] + turn / 2), length * np.sin(a[2] + turn / 2), turn])
            if is_free(building.all, a[:2] + np.linspace(0, 1, 5)[:, None] * (b - a)[:2]):
                break
        else:
            b = a + np.array([0, 0, rng.choice([-0.6, 0.6])])
        poses.append(b)
    return poses


class Drive(NamedTuple):
    """Poses of a robot, and the motions that its odometry measures; None where it measures none."""

    poses: list[np.ndarray]
    motions: list[np.ndarray | None]


def _drive(rng: np.random.Generator, building: Building) -> Drive:
    """A walk with errors of odometry of a degree and 2 cm a step."""
    poses = _walk(rng, building)
    found: list[np.ndarray | None] = []
    for a, b in pairwise(poses):
        found.append(np.asarray(pga2.motor_product(motion_of(a, b), motor(rng.normal(size=3) * [0.02, 0.02, 0.02]))))
    return Drive(poses, found)


def _mapped(rng: np.random.Generator, building: Building, drive: Drive, sights: Callable[[], Sight]) -> Trial:
    """Whether the last pose of a map is right to 20 cm and 2 degrees, or within its bound."""
    mapper, beams, odometry = Mapper(), any_beams(rng), np.array([1.0, 0, 0, 0])
    for pose, motion in zip(drive.poses, [odometry, *drive.motions], strict=True):
        if motion is not None:
            odometry = np.asarray(pga2.normalize_motor(pga2.motor_product(odometry, motion)))
        scan = scan_of(rng, building.all, pose, beams, sights())
        step = mapper.add(scan, None if motion is None else odometry)
    off = pga2.motor_product(pga2.motor_inverse(step.motor), motion_of(drive.poses[0], drive.poses[-1]))
    angle, shift = pga2.motor_to_angle_translation(off)
    error = np.array([angle, *shift])
    is_near = np.linalg.norm(shift) < 0.2 and abs(angle) < np.radians(2)
    is_within = error @ np.linalg.lstsq(step.covariance, error, rcond=None)[0] < BOUND**2
    return Trial(step.status in (ScanStatus.ADDED, ScanStatus.STANDING), bool(is_near or is_within))


@row("`Mapper`", "40 scans of a walk through a hall, a corridor or an oval room", good=True, slow=True)
def maps_of_buildings(rng: np.random.Generator) -> Trial:
    building, sight = any_building(rng), exact(rng)
    return _mapped(rng, building, _drive(rng, building), lambda: sight)


@row("`Mapper`", "the same, wheels slip by 20 to 60 degrees and up to 0.3 m in three of the steps", slow=True)
def maps_with_slips(rng: np.random.Generator) -> Trial:
    building, sight = any_building(rng), exact(rng)
    drive = _drive(rng, building)
    for k in rng.choice(_COUNT - 1, 3, replace=False):
        slip = motor(np.array([*rng.uniform(-0.3, 0.3, 2), rng.choice([-1, 1]) * rng.uniform(0.35, 1.05)]))
        drive.motions[k] = np.asarray(pga2.motor_product(drive.motions[k], slip))
    return _mapped(rng, building, drive, lambda: sight)


@row("`Mapper`", "the same, carried to another place of the building once, while odometry continues", slow=True)
def maps_of_carried_robots(rng: np.random.Generator) -> Trial:
    building, sight = any_building(rng), exact(rng)
    one, two = _drive(rng, building), _drive(rng, building)
    half, lost = _COUNT // 2, np.array([1.0, 0, 0, 0])
    drive = Drive(one.poses[:half] + two.poses[half:], [*one.motions[: half - 1], lost, *two.motions[half:]])
    return _mapped(rng, building, drive, lambda: sight)


@row("`Mapper`", "the same without odometry", slow=True)
def maps_without_odometry(rng: np.random.Generator) -> Trial:
    building, sight = any_building(rng), exact(rng)
    drive = _drive(rng, building)
    return _mapped(rng, building, Drive(drive.poses, [None] * (_COUNT - 1)), lambda: sight)


@row("`Mapper`", "the same, odometry that measures 20 to 60 % too little or too much", slow=True)
def maps_with_scaled_odometry(rng: np.random.Generator) -> Trial:
    building, sight = any_building(rng), exact(rng)
    drive, factor = _drive(rng, building), 1 + rng.choice([-1, 1]) * rng.uniform(0.2, 0.6)
    for k, motion in enumerate(drive.motions):
        assert motion is not None
        angle, shift = pga2.motor_to_angle_translation(motion)
        drive.motions[k] = motor(np.array([*(factor * np.asarray(shift)), angle]))
    return _mapped(rng, building, drive, lambda: sight)


@row("`Mapper`", "the same, people before a fifth to seven tenths of the beams, others in each scan", slow=True)
def maps_in_crowds(rng: np.random.Generator) -> Trial:
    building = any_building(rng)
    return _mapped(rng, building, _drive(rng, building), lambda: crowded(rng))


@row("`Mapper`", "the same, ranges off by 5 to 30 cm, or a step between beams that is 2 to 15 % too small", slow=True)
def maps_by_faulty_scanners(rng: np.random.Generator) -> Trial:
    building, sight = any_building(rng), (offset, stepped)[rng.integers(2)](rng)
    return _mapped(rng, building, _drive(rng, building), lambda: sight)
