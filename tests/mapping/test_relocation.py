"""Relocation of scans in maps of lines, without a prior."""

from __future__ import annotations

import tracemalloc
from dataclasses import dataclass

import numpy as np
import pytest
from laser_scenes import box, pair, room, scan_at

from algorithms.arguments import Reals
from algorithms.mapping import MappingStatus, Scan, relocate
from algorithms.mapping.cells import cells_of
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


def test_scores_in_a_map(rng: np.random.Generator) -> None:
    """Scores by the cells of a map are those by all of its lines, with ranges by the ray caster of the tests."""
    from laser_scenes import ranges

    walls = room(rng, 12)
    m = exact_map(walls)
    near, points = cells_of(m).near, rng.uniform(-6, 6, (60, 2))
    hidden = np.linalg.norm(walls[:, 2:] - walls[:, :2], axis=1) > 1
    for _ in range(10):
        pose = np.array([*rng.uniform(-1, 12, 2), rng.uniform(-3, 3)])
        motor = pga2.motor_from_angle_translation(pose[2], pose[:2])
        squares, _ = kernels.nearest_segment(pga2.move_point(motor, points), near.segments)
        expected = ranges(walls[hidden], pose, np.arctan2(points[:, 1], points[:, 0]))
        behind = np.linalg.norm(points, axis=1) > 1.03 * expected + 0.4
        score = np.maximum(1 - squares / 0.09, 0).sum() - 0.1 * behind.sum()
        assert np.isclose(kernels.sum_of_place_scores(motor, points, *near, 0.3), score, atol=1e-9)
        assert 0 < behind.sum() < 60


def test_steps_in_a_map(rng: np.random.Generator) -> None:
    """With all lines that are in reach, a step is that towards the nearest of all lines."""
    m = exact_map(room(rng, 12))
    far, points = cells_of(m).far, rng.uniform(-4, 4, (60, 2))
    motor = pga2.motor_from_angle_translation(0.4, np.array([5.0, 6.0]))
    squares, row = kernels.nearest_segment(pga2.move_point(motor, points), far.segments)
    rest = np.zeros(len(far.segments)), np.ones(len(far.segments))
    moving = np.column_stack([points, np.zeros((60, 3)), np.ones(60)])
    none = np.zeros((0, 6)), np.zeros(0), np.zeros(0)
    for reach in (1.2, 0.6):
        one = kernels.step_to_map(motor, points, *far, 0.4, reach)
        targets = np.column_stack([far.segments[:, :4], *rest])
        two = kernels.step_between(motor, moving, squares, row, targets, *none, 0.4, reach)
        assert all(np.allclose(a, b, rtol=1e-12) for a, b in zip(one, two, strict=True))


def test_lines_that_are_not_finite() -> None:
    """They are in no cell; a map without others has none."""
    m = exact_map(np.array([[0.0, 0, 4, 0], [0.0, 0, np.nan, 3]]))
    assert set(cells_of(m).near.entries) == {0, 2} and not len(cells_of(exact_map(np.full((2, 4), np.nan))).far.entries)


def test_long_lines_take_the_memory_of_their_cells() -> None:
    """A diagonal is in a few cells of each row; the boxes around these six hold 1.5 million cells, in 400 MB."""
    k = np.arange(6.0)[:, None]
    walls = np.concatenate([0 * k, 10 * k, 500 + 0 * k, 500 + 10 * k], 1)
    tracemalloc.start()
    cells = cells_of(exact_map(walls)).far
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6
    # All lines within the reach of places near a line are listed.
    for x in np.linspace(0, 500, 40):
        column, row = np.floor(([x, x + 11] - cells.grid[:2]) / cells.grid[2])
        first, after = cells.starts[int(row * cells.grid[3] + column) :][:2].astype(int)
        assert {1, 7} <= set(cells.entries[first:after].tolist())


def test_beams_end_at_the_map(rng: np.random.Generator) -> None:
    """Readings far beyond the map neither change the scores of others nor take a step for each metre."""
    cells = cells_of(exact_map(box(0, 0, 8, 5)[:3])).far
    far = rng.normal(size=(4, 2))
    far /= np.linalg.norm(far, axis=1)[:, None]
    sums = [
        float(kernels.sum_of_place_scores(pga2.motor_from_angle_translation(0.0, [2.0, 1]), scale * far, *cells, 0.3))
        for scale in (1e2, 1e14)
    ]
    assert sums[0] == sums[1]
