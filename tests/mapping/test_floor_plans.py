"""Floor plans: walls of grids, rays against closed forms, and the measure of found walls."""

from pathlib import Path

import numpy as np
import pytest

from algorithms.mapping.floor_plans import FloorPlan, load_floor_plan, wall_recall_precision
from generated import pga2

HOUSE = Path(__file__).parents[1] / "data" / "maps" / "house.mat"
ROOM = [[[0, 0], [6, 0]], [[6, 0], [6, 4]], [[6, 4], [0, 4]], [[0, 4], [0, 0]]]


def pose(x: float, y: float, angle: float = 0.0) -> np.ndarray:
    return np.asarray(pga2.motor_from_angle_translation(angle, np.array([x, y])))


def distance_in_room(x: float, y: float, angle: float) -> float:
    """The distance to the border of the room along a ray from within it."""
    c, s = np.cos(angle), np.sin(angle)
    across = (6 - x) / c if c > 0 else -x / c
    along = (4 - y) / s if s > 0 else -y / s
    return min(across, along)


def test_rays_in_a_room() -> None:
    plan = FloorPlan.from_walls(ROOM)
    rng = np.random.default_rng(0)
    beams = np.linspace(-3, 3, 50)
    for x, y, angle in rng.uniform([0.1, 0.1, -3], [5.9, 3.9, 3], (20, 3)):
        distances, walls = plan.cast(pose(x, y, angle), beams)
        expected = [distance_in_room(x, y, angle + beam) for beam in beams]
        np.testing.assert_allclose(distances, expected, rtol=1e-12)
        ends = np.array([x, y]) + distances[:, None] * np.stack([np.cos(angle + beams), np.sin(angle + beams)], 1)
        starts, along = plan.starts[walls], plan.ends[walls] - plan.starts[walls]
        off = (ends - starts)[:, 0] * along[:, 1] - (ends - starts)[:, 1] * along[:, 0]
        np.testing.assert_allclose(off, 0, atol=1e-10)


def test_a_ray_through_a_corner_meets_a_wall() -> None:
    plan = FloorPlan.from_walls(ROOM)
    # Directions that are exactly those to corners, and others next to them.
    angle = np.arctan2(2.0, 3.0)
    beams = angle + np.array([-1e-16, 0.0, 1e-16, 1e-15, -1e-15])
    distances, walls = plan.cast(pose(3, 2), beams)
    np.testing.assert_allclose(distances, np.hypot(3, 2), rtol=1e-12)
    assert (walls >= 0).all()


def test_poses_and_beams_are_batches_and_walls_behind_are_not_met() -> None:
    plan = FloorPlan.from_walls([[[1, -1], [1, 1]]])
    poses = np.stack([pose(0, 0), pose(2, 0), pose(0, 5)])
    distances, walls = plan.cast(poses, [0.0, np.pi / 4])
    np.testing.assert_allclose(distances, [[1, np.sqrt(2)], [np.inf, np.inf], [np.inf, np.inf]])
    assert walls.tolist() == [[0, 0], [-1, -1], [-1, -1]]


def test_grid_of_a_block() -> None:
    grid = np.zeros((6, 8))
    grid[2:4, 3:7] = 1
    plan = FloorPlan.from_grid(grid, 0.5)
    assert len(plan) == 4 and plan.solid
    corners = {tuple(corner) for corner in plan.starts.tolist()}
    assert corners == {(1.5, 1.0), (3.5, 1.0), (3.5, 2.0), (1.5, 2.0)}
    assert np.asarray(plan.is_within_wall(np.stack([pose(2.5, 1.5), pose(0.5, 0.5), pose(3.0, 2.2)]))).tolist() == [
        True, False, False,
    ]  # fmt: skip
    # The free side is on the left: the normals of the lines point into the block.
    middle = (plan.starts + plan.ends) / 2
    inner = middle + 0.1 * plan.segments.normals
    assert ((inner > [1.5, 1.0]) & (inner < [3.5, 2.0])).all()


def test_cells_that_touch_in_a_corner_have_one_outline_and_staircases_are_oblique() -> None:
    assert len(FloorPlan.from_grid(np.eye(12), 1.0, tolerance=0.0)) == 48
    plan = FloorPlan.from_grid(np.eye(12), 1.0)
    along = np.abs(plan.ends - plan.starts)
    longest = along[np.argsort(-along.sum(1))[:2]]
    np.testing.assert_allclose(longest[:, 0], longest[:, 1], atol=1)
    distances, walls = plan.cast(pose(8.0, 4.0, 3 * np.pi / 4), [0.0])
    assert walls[0] >= 0 and abs(distances[0] - np.sqrt(8)) < 1


def test_a_hole_is_an_outline_of_its_own() -> None:
    grid = np.ones((5, 5))
    grid[2, 2] = 0
    plan = FloorPlan.from_grid(grid, 1.0, tolerance=0.5)
    assert len(plan) == 8
    distances, _ = plan.cast(pose(2.5, 2.5), np.arange(4) * np.pi / 2)
    np.testing.assert_allclose(distances, 0.5)
    assert not plan.is_within_wall(pose(2.5, 2.5)) and plan.is_within_wall(pose(1.5, 2.5))


def test_house() -> None:
    plan = load_floor_plan(HOUSE, 0.045)
    size = np.ptp(plan.starts, axis=0)
    assert 25 < size[0] < 27 and 16 < size[1] < 18
    # The garage, whose walls are drawn 176 cells apart, and 230 cells high.
    distances, walls = plan.cast(pose(22.0, 5.0), np.arange(4) * np.pi / 2)
    assert (walls >= 0).all()
    assert distances[0] + distances[2] > 7 and distances[1] + distances[3] > 9
    with pytest.raises(KeyError, match="expected plan"):
        load_floor_plan(HOUSE, 0.045, name="plan")


def test_bad_plans() -> None:
    empty = FloorPlan.from_grid(np.zeros((4, 4)), 0.1)
    assert len(empty) == 0 and not empty.is_within_wall(pose(0.1, 0.1))
    distances, walls = empty.cast(pose(0, 0), [0.0])
    assert np.isinf(distances).all() and walls.tolist() == [-1]
    assert len(FloorPlan.from_walls(np.zeros((2, 2, 2)))) == 0
    with pytest.raises(ValueError, match="cell"):
        FloorPlan.from_grid(np.zeros((4, 4)), 0.0)
    with pytest.raises(ValueError, match="finite"):
        FloorPlan.from_walls([[[0, 0], [np.nan, 1]]])


def test_recall_and_precision_of_known_segments() -> None:
    walls = np.array(ROOM, float)
    assert wall_recall_precision(walls, walls) == (1.0, 1.0, 1000)
    # Half of one wall of six metres is missing; a segment of two metres is no wall; one is 5 cm off.
    found = np.array([[[0, 0], [3, 0]], [[6.05, 0], [6.05, 4]], [[6, 4], [0, 4]], [[0, 4], [0, 0]], [[2, 1], [4, 1]]])
    score = wall_recall_precision(walls, found)
    assert abs(score.recall - 17 / 20) < 0.01 and abs(score.precision - 17 / 19) < 0.01
    assert wall_recall_precision(walls, found, distance=0.04).recall < 0.7
    # A wall that is crossed at a right angle is not found.
    assert wall_recall_precision(walls[:1], [[[3, -1], [3, 1]]]).recall == 0
    seen = np.stack([np.linspace(0, 3, 300), np.zeros(300)], 1)
    assert wall_recall_precision(walls, found, seen).recall == 1.0
    nothing = wall_recall_precision(walls, np.zeros((0, 2, 2)))
    assert nothing.recall == 0 and np.isnan(nothing.precision)
