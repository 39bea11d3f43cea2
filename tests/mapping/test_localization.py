"""Localisation by lines: consistency, association, degenerate maps, and robots that are lost."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from algorithms.mapping.floor_plans import FloorPlan, load_floor_plan
from algorithms.mapping.localization import (
    Found,
    LineLocalizer,
    LocalizationSettings,
    normalized_error,
    relocated,
)
from algorithms.mapping.navigation_status import LocalizationStatus
from algorithms.mapping.scan import Scan
from algorithms.mapping.scan_simulation import Odometry, Scanner, motor_of_error, simulate_log, simulate_scan
from algorithms.mapping.segments import Segments, segments
from generated import navigation as kernels
from generated import pga2
from tests.support.selection import some_slow

HOUSE = Path(__file__).parents[1] / "data" / "maps" / "house.mat"
ROOM = FloorPlan.from_walls([[[0, 0], [6, 0]], [[6, 0], [6, 4]], [[6, 4], [0, 4]], [[0, 4], [0, 0]]], solid=True)
BEGIN = np.array([0.03, 0.1, 0.1]) ** 2
"""Variances of first poses."""


def pose(x: float, y: float, angle: float = 0.0) -> np.ndarray:
    return np.asarray(pga2.motor_from_angle_translation(angle, np.array([x, y])))


def moved(motor: np.ndarray, error: np.ndarray) -> np.ndarray:
    return np.asarray(pga2.motor_product(motor, motor_of_error(np.asarray(error, float))))


def circle_of_poses(n: int = 40) -> np.ndarray:
    turn = np.linspace(0, np.pi, n)
    place = np.array([9.5, 8.8]) + 1.2 * np.stack([np.cos(turn), np.sin(turn)], 1)
    return np.asarray(pga2.motor_from_angle_translation(turn + np.pi / 2, place))


def seen_lines(truth: np.ndarray, spread: np.ndarray, rng: np.random.Generator) -> Segments:
    """The walls of the room as measured lines whose errors have exactly the covariance."""
    lines = np.asarray(pga2.move_line(pga2.motor_inverse(truth), np.column_stack(
        [ROOM.segments.normals, -ROOM.segments.offsets])))  # fmt: skip
    errors = rng.multivariate_normal(np.zeros(2), spread, len(lines))
    angles = np.arctan2(lines[:, 1], lines[:, 0]) + errors[:, 0]
    ends = np.asarray(pga2.move_point_back(truth, ROOM.segments.ends))
    n = len(lines)
    return Segments(np.stack([np.cos(angles), np.sin(angles)], 1), -lines[:, 2] + errors[:, 1], ends,
                    np.tile(spread, (n, 1, 1)), np.full(n, 50), np.zeros(n), np.zeros(n, int))  # fmt: skip


def test_update_is_the_least_squares_solution() -> None:
    rng = np.random.default_rng(0)
    truth, spread = pose(2.0, 1.5, 0.4), np.array([[1e-6, 4e-7], [4e-7, 1e-6]])
    seen = seen_lines(truth, spread, rng)
    model = np.column_stack([ROOM.segments.normals, -ROOM.segments.offsets])
    start = moved(truth, [0.01, -0.02, 0.03])
    measured = np.column_stack([seen.normals, -seen.offsets])
    triangles = np.tile(spread[np.triu_indices(2)], (4, 1))
    motor, covariance, numbers = kernels.update_pose(
        start, [1e6, 0, 0, 1e6, 0, 1e6], model, np.zeros((4, 3)), measured, triangles, 1e30
    )
    rows = np.zeros((4, 2, 3))
    rows[:, 0, 0], rows[:, 1, 1:] = -1, -seen.normals
    weights = np.linalg.inv(spread)
    information = np.einsum("kia,ij,kjb->ab", rows, weights, rows)
    expected = np.linalg.inv(information)
    np.testing.assert_allclose(covariance, expected[np.triu_indices(3)], rtol=2e-3, atol=1e-9)
    # At the solution, the weighted residuals have no part along the derivatives.
    predicted = np.asarray(pga2.move_line(pga2.motor_inverse(motor), model))
    angle = pga2.angle_between_lines(predicted, measured)
    residual = np.stack([angle, seen.offsets + predicted[:, 2]], 1)
    gradient = np.einsum("kia,ij,kj->a", rows, weights, residual)
    assert (np.abs(expected @ gradient) < 1e-3 * np.sqrt(np.diag(expected))).all()
    assert numbers[1] == 4 and numbers[2] == 1


def test_normals_may_be_opposite_and_lines_of_the_map_have_covariances() -> None:
    rng = np.random.default_rng(1)
    truth, spread = pose(2.0, 1.5, 0.4), np.diag([1e-6, 1e-6])
    seen = seen_lines(truth, spread, rng)
    measured = np.column_stack([seen.normals, -seen.offsets])
    model = np.column_stack([ROOM.segments.normals, -ROOM.segments.offsets])
    own = np.tile([1e-6, -5e-7, 2e-6], (4, 1))
    noise = np.tile([1e-6, 0, 1e-6], (4, 1))
    one = kernels.update_pose(truth, [1, 0, 0, 1, 0, 1], model, own, measured, noise, 1e30)
    # For the opposite line the angle has the same error, and the offset the opposite one.
    flipped = own * [1, -1, 1]
    two = kernels.update_pose(truth, [1, 0, 0, 1, 0, 1], -model, flipped, measured, noise, 1e30)
    for a, b in zip(one, two, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-15)
    exact = kernels.update_pose(truth, [1, 0, 0, 1, 0, 1], model, 0 * own, measured, noise, 1e30)
    assert (np.asarray(one[1])[[0, 3, 5]] > np.asarray(exact[1])[[0, 3, 5]]).all()


@pytest.mark.parametrize("n_runs", some_slow([15, 120], 120))
def test_errors_are_consistent_with_covariances(n_runs: int) -> None:
    """Mean squares of all runs are within the band that contains 95 % of such means."""
    spread = np.array([[4e-6, 2e-6], [2e-6, 4e-5]])
    settings = LocalizationSettings(line_deviation=0.0, gate=50.0)
    turn = np.linspace(0, 2, 15)
    truth = np.asarray(pga2.motor_from_angle_translation(turn, np.stack([2 + turn, 2 + 0.3 * np.sin(turn)], 1)))
    motions = np.asarray(pga2.motor_product(pga2.motor_inverse(truth[:-1]), truth[1:]))
    wheels = Odometry().covariances(motions)
    errors, squares, n_numbers = [], 0.0, 0
    for run in range(n_runs):
        rng = np.random.default_rng(run)
        robot = LineLocalizer(ROOM.segments, moved(truth[0], -rng.normal(size=3) * np.sqrt(BEGIN)), BEGIN, settings)
        for k in range(len(truth)):
            if k:
                error = rng.normal(size=3) * np.sqrt(np.diag(wheels[k - 1]))
                robot.move(moved(motions[k - 1], error), wheels[k - 1])
            assert robot.update_lines(seen_lines(truth[k], spread, rng)) == LocalizationStatus.OK
            squares, n_numbers = squares + robot.innovation[0], n_numbers + robot.innovation[1]
        errors.append(normalized_error(robot.motor, robot.covariance, truth[-1]))
    low, high = chi2.ppf([0.025, 0.975], 3 * len(errors)) / len(errors)
    assert low < np.mean(errors) < high
    low, high = chi2.ppf([0.0005, 0.9995], n_numbers) / n_numbers
    assert low < squares / n_numbers < high


def test_scans_of_the_house() -> None:
    plan = load_floor_plan(HOUSE, 0.045)
    truth = circle_of_poses()
    errors, away = [], []
    for seed in range(2):
        log = simulate_log(plan, truth, seed=seed)
        rng = np.random.default_rng(seed)
        robot = LineLocalizer(plan.segments, moved(truth[0], -rng.normal(size=3) * np.sqrt(BEGIN)), BEGIN)
        for k, scan in enumerate(log):
            if k:
                robot.move(log.motions[k], log.covariances[k])
            assert robot.update(scan) in (LocalizationStatus.OK, LocalizationStatus.INCONSISTENT)
            errors.append(normalized_error(robot.motor, robot.covariance, truth[k]))
            away.append(pga2.motor_to_angle_translation(pga2.motor_product(pga2.motor_inverse(robot.motor), truth[k])))
    # Corners and furniture disturb some lines; without them the mean is 3.
    assert 2.0 < np.mean(errors) < 4.0
    assert max(np.linalg.norm(shift) for _, shift in away) < 0.03
    assert max(abs(angle) for angle, _ in away) < np.radians(0.7)


@pytest.mark.slow
def test_scans_of_the_house_are_consistent_in_60_runs() -> None:
    plan = load_floor_plan(HOUSE, 0.045)
    truth = circle_of_poses(12)
    inside = []
    for seed in range(60):
        log = simulate_log(plan, truth, seed=seed)
        rng = np.random.default_rng(seed)
        robot = LineLocalizer(plan.segments, moved(truth[0], -rng.normal(size=3) * np.sqrt(BEGIN)), BEGIN)
        for k, scan in enumerate(log):
            if k:
                robot.move(log.motions[k], log.covariances[k])
            robot.update(scan)
        inside.append(normalized_error(robot.motor, robot.covariance, truth[-1]) < chi2.ppf(0.95, 3))
    assert np.mean(inside) > 0.9


def test_people_and_outliers_do_not_disturb() -> None:
    plan = load_floor_plan(HOUSE, 0.045)
    truth = circle_of_poses()
    log = simulate_log(plan, truth, Scanner(outliers=0.05, missing=0.05), n_people=3, seed=1)
    robot = LineLocalizer(plan.segments, truth[0], BEGIN)
    for k, scan in enumerate(log):
        robot.move(log.motions[k], log.covariances[k])
        assert robot.update(scan) != LocalizationStatus.LOST
        off = pga2.motor_to_angle_translation(pga2.motor_product(pga2.motor_inverse(robot.motor), truth[k]))
        assert np.linalg.norm(off[1]) < 0.1


def test_corridor_leaves_a_direction_undetermined() -> None:
    corridor = FloorPlan.from_walls([[[0, 0], [50, 0]], [[50, 2], [0, 2]]], solid=True)
    truth = pose(25, 1)
    robot = LineLocalizer(corridor.segments, truth, BEGIN)
    scan = simulate_scan(corridor, truth, Scanner(max_range=8.0), seed=0).scan
    assert robot.update(scan) == LocalizationStatus.UNOBSERVED
    deviation = np.sqrt(np.diag(robot.covariance))
    assert deviation[1] > 0.09 and deviation[2] < 0.01
    # The information turns with the robot: after a quarter turn the side is undetermined.
    assert robot.move(pose(0, 0, np.pi / 2), 1e-8) == LocalizationStatus.UNOBSERVED
    deviation = np.sqrt(np.diag(robot.covariance))
    assert deviation[2] > 0.09 and deviation[1] < 0.01
    assert robot.update(simulate_scan(corridor, pose(25, 1, np.pi / 2), Scanner(max_range=8.0, field_of_view=6.0)).scan
                        ) == LocalizationStatus.UNOBSERVED  # fmt: skip


def test_sides_of_thin_walls_are_told_apart() -> None:
    """Of both sides of a wall of 4 cm, the robot sees the one that faces it."""
    wall = FloorPlan.from_grid(np.pad(np.ones((1, 100)), 5), 0.04)
    truth = pose(2.0, 3.0, -np.pi / 2)
    scan = simulate_scan(wall, truth, seed=0).scan
    robot = LineLocalizer(wall.segments, truth, np.array([0.05, 0.1, 0.1]) ** 2)
    robot.update(scan)
    assert len(robot.association.rows) == 1
    upper = wall.segments.offsets[robot.association.rows[0]]
    np.testing.assert_allclose(abs(upper), 6 * 0.04)


def test_lost_robot_is_reported_and_found_again() -> None:
    plan = load_floor_plan(HOUSE, 0.045)
    truth, wrong = pose(8.5, 8.8, 2.0), pose(22.0, 5.0, 0.0)
    scan = simulate_scan(plan, truth, seed=0).scan
    robot = LineLocalizer(plan.segments, wrong, [1e-4, 1e-3, 1e-3])
    statuses = [robot.update(scan) for _ in range(8)]
    assert LocalizationStatus.LOST in statuses
    known = LineLocalizer(
        plan.segments, wrong, [1e-4, 1e-3, 1e-3], relocate=lambda scan, lines: Found(truth, np.diag([1e-4, 1e-2, 1e-2]))
    )
    statuses = [known.update(scan) for _ in range(8)]
    assert LocalizationStatus.RELOCATED in statuses and statuses[-1] == LocalizationStatus.OK
    unknown = LineLocalizer(plan.segments, wrong, [1e-4, 1e-3, 1e-3], relocate=lambda scan, lines: None)
    assert [unknown.update(scan) for _ in range(8)][-1] == LocalizationStatus.LOST


def test_kidnapped_robots_find_their_pose_by_relocation() -> None:
    plan = load_floor_plan(HOUSE, 0.045, smallest=3.0)
    for place in (pose(9.5, 8.8, 2.0), pose(22.0, 5.0, 0.5), pose(2.0, 9.5, 1.0)):
        robot = LineLocalizer(plan.segments, pose(5.0, 11.4), [1e-4, 1e-3, 1e-3], relocate=relocated)
        device = Scanner(n_beams=361, field_of_view=1.5 * np.pi)
        statuses = [robot.update(simulate_scan(plan, place, device, seed=seed).scan) for seed in range(8)]
        off = pga2.motor_to_angle_translation(pga2.motor_product(pga2.motor_inverse(robot.motor), place))
        assert LocalizationStatus.RELOCATED in statuses and statuses[-1] == LocalizationStatus.OK
        assert np.linalg.norm(off[1]) < 0.03 and abs(off[0]) < 0.01
    nothing = Scan(np.full(181, np.nan), -1.5, 0.01, 30.0)
    assert relocated(nothing, plan.segments) is None


def test_covariances_of_relocated_poses_are_in_the_frame_of_the_robot() -> None:
    found = relocated(simulate_scan(ROOM, pose(2.0, 1.5, 0.7), Scanner(field_of_view=6.2)).scan, ROOM.segments)
    assert found is None  # A room without furniture looks the same after half a turn.
    walls = [[[0, 0], [6, 0]], [[6, 0], [6, 4]], [[6, 4], [1, 4]], [[1, 4], [0, 3]], [[0, 3], [0, 0]]]
    room = FloorPlan.from_walls(walls, solid=True)
    found = relocated(
        simulate_scan(room, pose(2.0, 1.5, 0.7), Scanner(n_beams=361, field_of_view=6.2)).scan, room.segments
    )
    assert found is not None
    assert normalized_error(found.motor, found.covariance, pose(2.0, 1.5, 0.7)) < chi2.ppf(0.999, 3)


def test_bad_input() -> None:
    robot = LineLocalizer(ROOM.segments, pose(2, 2), BEGIN)
    before = robot.motor, robot.covariance
    nothing = Scan(np.full(181, np.nan), -1.5, 0.01, 30.0)
    assert robot.update(nothing) == LocalizationStatus.PREDICTED
    assert robot.update(Scan([], 0.0, 0.01, 30.0)) == LocalizationStatus.PREDICTED
    assert robot.move(np.full(4, np.nan), 1e-4) == LocalizationStatus.NOT_FINITE
    assert robot.move(pose(0, 0), np.full(3, np.inf)) == LocalizationStatus.NOT_FINITE
    assert np.array_equal(robot.motor, before[0]) and np.array_equal(robot.covariance, before[1])
    empty = LineLocalizer(FloorPlan.from_walls(np.zeros((0, 2, 2))).segments, pose(2, 2), BEGIN)
    scan = simulate_scan(ROOM, pose(2, 2)).scan
    assert empty.update(scan) == LocalizationStatus.PREDICTED and len(segments(scan)) == 3
    with pytest.raises(ValueError, match="unit motor"):
        LineLocalizer(ROOM.segments, np.zeros(4), BEGIN)
    with pytest.raises(ValueError, match="covariance"):
        LineLocalizer(ROOM.segments, pose(0, 0), np.ones((2, 2)))
