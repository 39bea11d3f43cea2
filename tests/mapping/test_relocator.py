"""Relocation over several scans: hypotheses are carried with odometry until the readings decide."""

from __future__ import annotations

import numpy as np
import pytest
from laser_scenes import box, motion, room, scan_at
from test_relocation import exact_map

from algorithms.arguments import Reals
from algorithms.mapping import MappingStatus, Relocation, Relocator, Scan
from generated import pga2


def motor(pose: Reals) -> Reals:
    return np.asarray(pga2.motor_from_angle_translation(pose[2], pose[:2]))


def is_close(found: Relocation, pose: Reals) -> bool:
    angle, shift = pga2.motor_to_angle_translation(found.motor)
    turn = (angle - pose[2] + np.pi) % (2 * np.pi) - np.pi
    return bool(np.linalg.norm(shift - pose[:2]) < 0.1 and abs(turn) < np.radians(1))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def twins() -> Reals:
    """Two equal rooms beside each other, with doors in the wall between them and a post in the right one."""
    shared = [[6.0, 0, 6, 1.5], [6, 2.5, 6, 4]]
    return np.concatenate([box(3, 2, 6, 4), box(9, 2, 6, 4), np.array(shared), box(11.3, 3.4, 0.5, 0.5)])


def test_equal_rooms_are_ambiguous_until_a_difference_is_seen(rng: np.random.Generator) -> None:
    """A robot in one of two equal rooms does not know which, until it turns to the corner in which they differ."""
    walls = twins()
    finder = Relocator(exact_map(walls))
    poses = [np.array([9.5, 1.5, heading]) for heading in (-2.0, -1.5, -0.9, 0.3, 0.9)]
    found, before = [], None
    for pose in poses:
        step = None if before is None else motor(motion(before, pose))
        found.append(finder.add(scan_at(rng, walls, pose), step))
        before = pose
    statuses = [each.status for each in found]
    assert statuses[:2] == [MappingStatus.AMBIGUOUS] * 2 and len(found[0].hypotheses) > 1
    assert statuses[-1] is MappingStatus.OK and is_close(found[-1], poses[-1])
    assert all(is_close(each, pose) for each, pose in zip(found, poses, strict=True) if each.status == 0)


def test_rooms_within_three_scans(rng: np.random.Generator) -> None:
    right = 0
    for _ in range(8):
        walls = room(rng, 8)
        pose, before = np.array([6.0, 1.0, rng.uniform(-3, 3)]), None
        finder = Relocator(exact_map(walls))
        for _ in range(3):
            step = None if before is None else motor(motion(before, pose) + 0.01 * rng.normal(size=3))
            found = finder.add(scan_at(rng, walls, pose, people=0.1), step)
            if found.status == 0:
                right += 1
                assert is_close(found, pose)
                break
            before, pose = pose, pose + np.array([0.1, 0.1, 0.5])
    assert right >= 7


def test_a_robot_that_stands_does_not_become_certain(rng: np.random.Generator) -> None:
    walls = box(0, 0, 8, 5)
    finder, pose = Relocator(exact_map(walls)), np.array([1.0, 0.7, 0.4])
    for k in range(5):
        found = finder.add(scan_at(rng, walls, pose), None if k == 0 else motor(np.zeros(3)))
        assert found.status is MappingStatus.AMBIGUOUS and finder.n_views == 1


def test_without_odometry_the_search_begins_again(rng: np.random.Generator) -> None:
    walls = room(rng, 10)
    finder = Relocator(exact_map(walls))
    for _ in range(3):
        finder.add(scan_at(rng, walls, np.array([6.0, 1.0, 0.5])))
    assert finder.n_views == 1
    nothing = Scan([np.nan] * 90, 0, 0.01, 5)
    assert finder.add(nothing, motor(np.zeros(3))).status is MappingStatus.TOO_FEW_READINGS
    found = finder.add(
        scan_at(rng, walls, np.array([6.6, 1.0, 0.5])), motor(np.array([0.6 * np.cos(0.5), -0.6 * np.sin(0.5), 0]))
    )
    assert finder.n_views == 2 and (found.status != 0 or is_close(found, np.array([6.6, 1.0, 0.5])))


def test_wrong_arguments(rng: np.random.Generator) -> None:
    with pytest.raises(ValueError, match="n_hypotheses"):
        Relocator(exact_map(twins()), n_hypotheses=0)
    finder, scan = Relocator(exact_map(twins())), scan_at(rng, twins(), np.array([9.5, 1.5, 0.0]))
    with pytest.raises(TypeError, match="scan: ndarray; expected a Scan"):
        finder.add(scan.points())
    for wrong in (np.zeros(4), np.full(4, np.nan), np.zeros((2, 4))):
        with pytest.raises(ValueError, match="motion"):
            finder.add(scan, wrong)
    assert Relocator(exact_map(np.zeros((0, 4)))).add(scan).status is MappingStatus.TOO_FEW_READINGS
