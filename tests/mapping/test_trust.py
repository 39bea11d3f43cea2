"""The status OK of matched scans is a promise: among people in offices, and where little determines the motion."""

from __future__ import annotations

import numpy as np
import pytest
from laser_scenes import box, pair, room, scan_at
from office_scenes import office_pair

from algorithms.mapping import MappingStatus, Scan, match_scans
from algorithms.mapping.narrow_objects import narrow_objects
from algorithms.mapping.outlines import outline_of
from algorithms.mapping.support import support
from generated import pga2

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def statuses(seed: int, n: int, share: float) -> tuple[int, int]:
    """How many of n pairs of scans are OK, and how many of these are wrong by more than 20 cm or 2 degrees."""
    rng = np.random.default_rng(seed)
    certain = wrong = 0
    for _ in range(n):
        a, b, truth = office_pair(rng, share)
        found = match_scans(a, b)
        if found.status is MappingStatus.OK:
            angle, shift = pga2.motor_to_angle_translation(found.motor)
            turn = (angle - truth[2] + np.pi) % (2 * np.pi) - np.pi
            certain += 1
            wrong += bool(np.linalg.norm(shift - truth[:2]) > 0.2 or abs(turn) > np.radians(2))
    return certain, wrong


@pytest.mark.slow
def test_offices_with_people() -> None:
    """With a fifth of the beams on people, two fifths of the motions are certain, and these are right."""
    certain, wrong = statuses(5, 100, 0.2)
    assert certain >= 40 and wrong <= 1


@pytest.mark.slow
@pytest.mark.parametrize(("share", "least"), [(0.0, 0.7), (0.3, 0.35)])
def test_shares_of_people(share: float, least: float) -> None:
    """At most 1 % of the motions called OK are wrong, with up to 30 % of the beams on people at most 2.5 %."""
    certain, wrong = statuses(6, 150, share)
    assert certain >= 150 * least
    assert wrong <= (0.025 if share == 0.3 else 0.01) * certain


def test_a_person_in_front_of_a_wall_is_narrow() -> None:
    """Readings of a person are found; those of the wall behind, and of an object at the edge of a scan, are not."""
    angles = np.linspace(-1, 1, 101)
    ranges = 4 / np.cos(angles)
    ranges[40:46] = 2.0
    ranges[:4] = 1.0
    scan = Scan(ranges, -1, 0.02, 30)
    assert np.flatnonzero(narrow_objects(scan)).tolist() == list(range(40, 46))
    ranges[40:80] = 2.0
    assert not narrow_objects(Scan(ranges, -1, 0.02, 30)).any()
    assert narrow_objects(Scan(ranges[:2], -1, 0.02, 30)).tolist() == [False, False]


def test_support_of_a_corridor_and_a_room() -> None:
    """Two parallel walls determine one direction only; walls around determine both, by many readings."""
    rng = np.random.default_rng(2)
    corridor = outline_of(scan_at(rng, np.array([[-500.0, 1, 500, 1], [-500.0, -1, 500, -1]]), np.zeros(3)))
    around = outline_of(scan_at(rng, box(0, 0, 8, 6), np.array([0.3, 0.2, 0.1])))
    assert support(corridor, corridor, IDENTITY, 0.15).readings < 0.5
    assert support(around, around, IDENTITY, 0.15).readings > 15
    # Moved by more than a wall's tolerance in both directions, nothing agrees.
    moved = pga2.motor_from_angle_translation(0.0, np.array([0.5, 0.5]))
    assert support(around, around, moved, 0.15).readings < 1


def test_few_common_walls_are_weak() -> None:
    """A scan of a room and its short part in one direction agree, but the part determines one direction weakly."""
    rng = np.random.default_rng(4)
    walls = room(rng, 12)
    a, _ = pair(rng, walls)
    whole = scan_at(rng, walls, a)
    assert match_scans(whole, whole).status is MappingStatus.OK
    ranges = whole.ranges.copy()
    ranges[:60] = ranges[75:] = 60.0
    few = Scan(ranges, whole.angle_min, whole.angle_step, whole.max_range)
    assert match_scans(few, few).status is not MappingStatus.OK


def test_readings_that_see_through_walls_outvote_a_motion() -> None:
    """A scan that sees through most of what the other one shows contradicts the motion, and one from there does not."""
    rng = np.random.default_rng(5)
    walls = box(0, 0, 8, 6)
    behind = np.array([[-0.5, -1, 2.5, -1], [2.5, -1, 2.5, 1], [2.5, 1, -0.5, 1]])
    open_room, closed_room = (
        outline_of(scan_at(rng, w, np.zeros(3))) for w in (walls, np.concatenate([walls, behind]))
    )
    alike, different = support(open_room, open_room, IDENTITY, 0.15), support(open_room, closed_room, IDENTITY, 0.15)
    assert alike.contradicting == alike.share == 0 and not alike.is_outvoted
    assert different.share > 0.3 and different.is_outvoted
    assert different == support(closed_room, open_room, IDENTITY, 0.15)
