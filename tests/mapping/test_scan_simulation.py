"""Simulated scans: ranges, noise, outliers, people, odometry and unusable poses."""

import numpy as np
import pytest

from algorithms.mapping.floor_plans import FloorPlan
from algorithms.mapping.navigation_status import PlanStatus
from algorithms.mapping.scan_simulation import (
    NO_WALL,
    OUTLIER,
    PERSON,
    Odometry,
    Scanner,
    error_of_motor,
    motor_of_error,
    simulate_log,
    simulate_scan,
)
from generated import pga2

ROOM = FloorPlan.from_walls([[[0, 0], [6, 0]], [[6, 0], [6, 4]], [[6, 4], [0, 4]], [[0, 4], [0, 0]]], solid=True)


def pose(x: float, y: float, angle: float = 0.0) -> np.ndarray:
    return np.asarray(pga2.motor_from_angle_translation(angle, np.array([x, y])))


def test_ranges_without_noise() -> None:
    found = simulate_scan(ROOM, pose(2, 2), Scanner(n_beams=3, noise=0.0))
    np.testing.assert_allclose(found.scan.ranges, [2, 4, 2])
    np.testing.assert_allclose(found.scan.points(), [[0, -2], [4, 0], [0, 2]], atol=1e-12)
    assert found.walls.tolist() == [0, 1, 2] and found.status == PlanStatus.OK


def test_noise_has_its_deviation_and_seeds_repeat() -> None:
    device = Scanner(n_beams=2001, noise=0.02)
    one, two, other = (simulate_scan(ROOM, pose(2, 2), device, seed=seed).scan.ranges for seed in (1, 1, 2))
    assert np.array_equal(one, two) and not np.array_equal(one, other)
    exact = simulate_scan(ROOM, pose(2, 2), Scanner(n_beams=2001, noise=0.0)).scan.ranges
    assert 0.018 < np.std(one - exact) < 0.022


def test_maximum_ranges_outliers_and_missing_beams() -> None:
    device = Scanner(n_beams=1001, max_range=3.0, outliers=0.2, missing=0.1, noise=0.0)
    found = simulate_scan(ROOM, pose(2, 2), device, seed=3)
    far = found.walls == NO_WALL
    assert (found.scan.ranges[far] == 3.0).all() and (found.scan.ranges[~far] < 3.0).all()
    assert len(found.scan.points()) == (~far).sum()
    assert 0.15 < (found.walls == OUTLIER).mean() < 0.25
    open_plan = FloorPlan.from_walls(np.zeros((0, 2, 2)))
    nothing = simulate_scan(open_plan, pose(0, 0))
    assert nothing.status == PlanStatus.EMPTY and not len(nothing.scan.points())


def test_a_person_hides_the_wall() -> None:
    found = simulate_scan(ROOM, pose(1, 2), Scanner(n_beams=181, noise=0.0), people=[[3.0, 2.0]])
    hit = found.walls == PERSON
    # The circle of radius 0.2 at 2 m covers asin(0.1) to each side; beams are a degree apart.
    assert hit.sum() == 2 * int(np.degrees(np.arcsin(0.1))) + 1 and hit[90]
    np.testing.assert_allclose(found.scan.ranges[90], 1.8)


def test_poses_that_cannot_be_simulated() -> None:
    block = FloorPlan.from_grid(np.pad(np.ones((3, 3)), 3), 1.0)
    within = simulate_scan(block, pose(4.5, 4.5))
    assert within.status == PlanStatus.WITHIN_WALL and np.isnan(within.scan.ranges).all()
    unknown = simulate_scan(block, np.full(4, np.nan))
    assert unknown.status == PlanStatus.NOT_FINITE and not len(unknown.scan.points())
    with pytest.raises(ValueError, match="n_beams"):
        Scanner(n_beams=1)


def test_log() -> None:
    turn = np.linspace(0, 2 * np.pi, 60)
    place = np.array([3.0, 2.0]) + np.stack([np.cos(turn), np.sin(turn)], 1)
    truth = np.asarray(pga2.motor_from_angle_translation(turn + np.pi / 2, place))
    log = simulate_log(ROOM, truth, Scanner(noise=0.0), n_people=2, seed=5)
    assert len(log) == 60 and log.ranges.shape == (60, 181) and (log.walls == PERSON).any()
    assert len(list(log)) == 60 and log.people.shape == (60, 2, 2)
    assert (log.status == PlanStatus.OK).all()
    inside = (log.people > 0) & (log.people < [6, 4])
    assert inside.all() and np.linalg.norm(np.diff(log.people, axis=0), axis=-1).max() > 0.1
    # Points that met walls are on walls.
    border = np.minimum(np.abs(log.hits), np.abs(log.hits - [6, 4])).min(1)
    assert border.max() < 1e-9
    drift = np.linalg.norm(pga2.motor_to_angle_translation(log.odometry[-1])[1] - place[-1])
    assert 0.001 < drift < 1.0


def test_errors_of_odometry_have_their_covariance() -> None:
    truth = np.tile(pose(1, 1), (3001, 1))
    truth[1::2] = pga2.motor_product(truth[1::2], pose(0.5, 0, 0.3))
    log = simulate_log(ROOM, truth, Scanner(n_beams=2), Odometry(), seed=1)
    exact = pga2.motor_product(pga2.motor_inverse(truth[:-1]), truth[1:])
    errors = error_of_motor(np.asarray(pga2.motor_product(pga2.motor_inverse(exact), log.motions[1:])))
    squares = (errors**2 / np.diagonal(log.covariances[1:], axis1=1, axis2=2)).mean(0)
    assert (np.abs(squares - 1) < 0.1).all()


def test_motors_of_errors() -> None:
    x = np.array([[0.3, 0.5, -0.2], [0.0, 1.0, 2.0]])
    np.testing.assert_allclose(error_of_motor(motor_of_error(x)), x, atol=1e-14)
    np.testing.assert_allclose(motor_of_error(x[1]), pose(1, 2), atol=1e-15)
