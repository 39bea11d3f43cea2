"""Relocation of scans in maps of lines, without a prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from laser_scenes import box, pair, room, scan_at

from algorithms.arguments import Reals
from algorithms.mapping import MappingStatus, Scan, relocate
from generated import mapping as kernels
from generated import pga2


@dataclass
class Walls:
    """Exact walls as a map, seen from both sides."""

    normals: Reals
    offsets: Reals
    ends: Reals


def exact_map(walls: Reals) -> Walls:
    along = walls[:, 2:] - walls[:, :2]
    normals = np.stack([-along[:, 1], along[:, 0]], 1) / np.linalg.norm(along, axis=1)[:, None]
    normals = np.concatenate([normals, -normals])
    ends = np.tile(walls.reshape(-1, 2, 2), (2, 1, 1))
    return Walls(normals, np.einsum("ij,ij->i", normals, ends[:, 0]), ends)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(11)


def test_rooms_with_boxes(rng: np.random.Generator) -> None:
    good, wrong = 0, 0
    for _ in range(10):
        walls = room(rng, 12)
        a, _ = pair(rng, walls)
        found = relocate(scan_at(rng, walls, a), exact_map(walls))
        angle, shift = pga2.motor_to_angle_translation(found.motor)
        turn = (angle - a[2] + np.pi) % (2 * np.pi) - np.pi
        close = np.linalg.norm(shift - a[:2]) < 0.1 and abs(turn) < np.radians(1)
        good += bool(close)
        wrong += bool(found.status is MappingStatus.OK and not close)
    assert good >= 9 and wrong == 0


def test_a_symmetric_room_is_ambiguous(rng: np.random.Generator) -> None:
    """In a rectangle, two poses explain a scan: both are among the best hypotheses."""
    walls = box(0, 0, 8, 5)
    a = np.array([1.0, 0.7, 0.4])
    found = relocate(scan_at(rng, walls, a), exact_map(walls))
    assert found.status is MappingStatus.AMBIGUOUS
    places = np.array([pga2.motor_to_angle_translation(h.motor)[1] for h in found.hypotheses[:2]])
    assert (
        min(np.abs(places - [[1, 0.7], [-1, -0.7]]).max(), np.abs(places[::-1] - [[1, 0.7], [-1, -0.7]]).max()) < 0.05
    )


def test_corridors(rng: np.random.Generator) -> None:
    """Where all lines are parallel, hypotheses along them are returned, and the status is not OK."""
    walls = np.array([[-40.0, 1, 40, 1], [-40.0, -1, 40, -1]])
    scan = scan_at(rng, walls, np.array([0.0, 0.3, 0.2]))
    short = Scan(np.where(scan.ranges < 8, scan.ranges, 50), scan.angle_min, scan.angle_step, 50)
    found = relocate(short, exact_map(walls))
    assert found.status in (MappingStatus.AMBIGUOUS, MappingStatus.DEGENERATE) and len(found.hypotheses)


def test_a_corridor_with_one_frame_is_weak(rng: np.random.Generator) -> None:
    """If only a frame of 6 cm shows where along a corridor a scan was taken, the status is not OK."""
    walls = np.concatenate([np.array([[-40.0, 1, 40, 1], [-40.0, -1, 40, -1]]), box(2.0, 1.0, 0.06, 0.06)])
    found = relocate(scan_at(rng, walls, np.array([0.0, 0.1, 0.0])), exact_map(walls))
    assert found.status is not MappingStatus.OK


def test_other_rooms_do_not_match(rng: np.random.Generator) -> None:
    walls = room(rng, 10)
    a, _ = pair(rng, walls)
    found = relocate(scan_at(rng, walls, a), exact_map(box(100, 100, 2, 1.5, 0.2)))
    assert found.status is not MappingStatus.OK


def test_bad_input(rng: np.random.Generator) -> None:
    walls = box(0, 0, 8, 5)
    nothing = exact_map(np.zeros((0, 4)))
    scan = scan_at(rng, walls, np.zeros(3))
    for s, m in (
        (Scan([], 0, 1, 5), exact_map(walls)),
        (Scan([np.nan] * 90, 0, 0.01, 5), exact_map(walls)),
        (scan, nothing),
    ):
        found = relocate(s, m)
        assert found.status is MappingStatus.TOO_FEW_READINGS and not found.hypotheses
    with pytest.raises(ValueError, match="n_hypotheses"):
        relocate(scan, exact_map(walls), n_hypotheses=0)


def test_expected_ranges(rng: np.random.Generator) -> None:
    """Ranges expected from segments agree with those of the ray caster of the tests."""
    from laser_scenes import ranges

    walls = room(rng, 12)
    m = exact_map(walls)
    half = np.linalg.norm(m.ends[:, 1] - m.ends[:, 0], axis=1) / 2
    table = np.column_stack([m.ends.mean(1), m.normals, half])
    angles = np.linspace(-3, 3, 50)
    directions = np.stack([np.cos(angles), np.sin(angles)], 1)
    place = np.array([6.0, 8.2])
    expected = kernels.expected_range(place, directions, table)
    assert np.abs(expected - ranges(walls, np.array([*place, 0.0]), angles)).max() < 1e-9
