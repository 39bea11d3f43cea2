"""Robots that are carried while they build a map: they are LOST until scans show where they are."""

from __future__ import annotations

import pickle

import numpy as np
from laser_scenes import box, scan_at

from algorithms.arguments import Reals
from algorithms.mapping import Mapper, MapStep, ScanStatus
from algorithms.mapping.parts import Parts
from generated import pga2

WALLS = np.concatenate(
    [box(0, 0, 10, 7), box(-3, 2, 1.2, 0.6, 0.3), box(2.5, -2, 0.5, 1.4, 1.0), box(3.5, 2.2, 0.8, 0.8, 0.5)]
)


def way(start: Reals, step: float, count: int) -> list[Reals]:
    """Poses straight ahead."""
    ahead = np.array([np.cos(start[2]), np.sin(start[2]), 0.0])
    return [np.asarray(start + step * k * ahead) for k in range(count)]


def driven(mapper: Mapper, poses: list[Reals], odometry: Reals, rng: np.random.Generator) -> list[MapStep]:
    """Add scans at poses, with odometry that begins at another pose."""
    steps = []
    first = pga2.motor_from_angle_translation(poses[0][2], poses[0][:2])
    for pose in poses:
        there = pga2.motor_from_angle_translation(pose[2], pose[:2])
        motion = pga2.motor_product(pga2.motor_inverse(first), there)
        steps.append(mapper.add(scan_at(rng, WALLS, pose), pga2.motor_product(odometry, motion)))
    return steps


def error(step: MapStep, pose: Reals, origin: Reals) -> float:
    """How far a pose in the frame of the first scan is off, in metres."""
    first, there = (pga2.motor_from_angle_translation(each[2], each[:2]) for each in (origin, pose))
    truth = pga2.motor_to_angle_translation(pga2.motor_product(pga2.motor_inverse(first), there))[1]
    return float(np.linalg.norm(step.pose[:2] - truth))


def test_carried_robots_are_lost_until_scans_show_where_they_are() -> None:
    """Odometry does not notice that the robot is carried by 4 m and turned; nothing wrong is ADDED."""
    rng = np.random.default_rng(1)
    mapper = Mapper()
    before = way(np.array([-4.0, -1.0, 0.2]), 0.3, 14)
    after = [np.array([-4.4 + 0.3 * k, -2.5 + 0.1 * k, 1.5 - 0.1 * k]) for k in range(14)]
    still = np.array([1.0, 0, 0, 0])
    steps = driven(mapper, before, still, rng)
    assert all(step.status == ScanStatus.ADDED and step.lost_since is None for step in steps)
    here = pga2.motor_from_angle_translation(0.0, np.array([0.3 * 13, 0.0]))
    steps += driven(mapper, after[:4], here, rng)
    assert mapper.status == ScanStatus.LOST and np.sqrt(np.diag(mapper.covariance))[1:].min() > 10
    assert mapper.map().certain.tolist() == [True] * 14 + [False] * (steps[-1].n_added - 14)
    assert steps[-1].lost_since in (14, 15)
    lines = [len(mapper.map(certain=certain).line_map) for certain in (True, False)]
    assert 4 <= lines[0] < lines[1]

    mapper = pickle.loads(pickle.dumps(mapper))
    first, fourth = (pga2.motor_from_angle_translation(each[2], each[:2]) for each in (after[0], after[4]))
    moved = pga2.motor_product(here, pga2.motor_product(pga2.motor_inverse(first), fourth))
    steps += driven(mapper, after[4:], moved, rng)
    assert mapper.status == ScanStatus.ADDED and mapper.map().certain.all()
    for step, pose in zip(steps, [*before, *after], strict=True):
        if step.status == ScanStatus.ADDED:
            assert error(step, pose, before[0]) < 0.1


def test_parts_are_joined_by_closures() -> None:
    parts = Parts()
    assert parts.lost_since is None and parts.certain(3).tolist() == [True] * 3
    parts.begin(3)
    parts.begin(5)
    assert parts.start == 5 and parts.lost_since == 3
    assert parts.certain(7).tolist() == [True] * 3 + [False] * 4
    parts.join(1, 6)
    assert parts.lost_since is None and parts.certain(7).tolist() == [True] * 3 + [False] * 2 + [True] * 2
    parts.begin(7)
    assert parts.lost_since == 7
    parts.join(4, 7)
    assert parts.lost_since == 7
    parts.join(2, 3)
    assert parts.lost_since is None and parts.certain(9).all()
