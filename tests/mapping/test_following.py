"""Following of paths: control laws, obstacles, and the closed loop on localisation."""

from pathlib import Path

import numpy as np
import pytest

from algorithms.mapping.floor_plans import load_floor_plan
from algorithms.mapping.following import FollowSettings, follow
from algorithms.mapping.localization import LineLocalizer
from algorithms.mapping.navigation_run import NavigationRun, simulate_following
from algorithms.mapping.navigation_status import FollowStatus, LocalizationStatus
from algorithms.mapping.paths import PlanarPath
from algorithms.mapping.scan_simulation import motor_of_error
from generated import navigation as kernels
from generated import pga2
from tests.support.all_cases import all_cases
from tests.support.selection import some_slow

HOUSE = Path(__file__).parents[1] / "data" / "maps" / "house.mat"
POINTS = [[2, 9], [3.4, 9.2], [3.4, 11.0], [7.2, 11.2], [8.7, 8], [10.5, 6.8], [11.2, 8.5]]


def pose(x: float, y: float, angle: float = 0.0) -> np.ndarray:
    return np.asarray(pga2.motor_from_angle_translation(angle, np.array([x, y])))


def drive(path: PlanarPath, start: np.ndarray, settings: FollowSettings, step: float = 0.02) -> list[tuple[float, ...]]:
    """Distances, angles and positions of a robot that knows its pose."""
    motor, position, rows = start, 0.0, []
    for _ in range(5000):
        command = follow(path, motor, position, settings=settings)
        position = command.position
        rows.append((command.distance, command.angle, position, command.status))
        if command.status >= FollowStatus.BLOCKED:
            break
        motor = np.asarray(pga2.motor_product(motor, motor_of_error(step * np.array([command.turn, command.speed, 0]))))
    return rows


def test_lyapunov_function_decreases() -> None:
    """The derivative of k1 e**2 + a**2 is -2 k2 v a**2, by a difference quotient of the motion itself."""
    rng = np.random.default_rng(0)
    gains, speed, dt = np.array([4.0, 3.0]), 0.5, 1e-6
    for radius in (np.inf, 2.0, -1.5):
        path = PlanarPath.from_pieces(pose(0, 0), [4.0], [radius])
        for e, angle in rng.uniform([-0.5, -2.5], [0.5, 2.5], (20, 2)):
            start = np.asarray(pga2.motor_product(path.pose(2.0), pose(0, e, angle)))
            turn, wanted = kernels.lyapunov_turn(e, angle, path.curvature(2.0), speed, gains, 1e9)
            assert turn == wanted
            values = []
            for motor in (start, pga2.motor_product(start, motor_of_error(dt * np.array([turn, speed, 0])))):
                heading, place = pga2.motor_to_angle_translation(motor)
                found = path.locate(place)
                off = heading - pga2.motor_to_angle_translation(path.pose(found.position))[0]
                off = (off + np.pi) % (2 * np.pi) - np.pi
                values.append(gains[0] * float(found.distance) ** 2 + off**2)
            assert abs((values[1] - values[0]) / dt + 2 * gains[1] * speed * angle**2) < 1e-3


@pytest.mark.parametrize("law", ["lyapunov", "pursuit"])
def test_robot_reaches_the_path_and_its_end(law: str) -> None:
    path = PlanarPath.through([[0, 0], [4, 0], [4, 4], [8, 4]], 1.0)
    rows = np.array(drive(path, pose(0, 0.4, 0.5), FollowSettings(law=law)))
    assert rows[-1, 3] == FollowStatus.ARRIVED
    settled = rows[rows[:, 2] > 3.0]
    limit = 0.01 if law == "lyapunov" else 0.06
    assert np.abs(settled[:, 0]).max() < limit


def test_pursuit_is_the_arc_through_the_target() -> None:
    robot, target = pose(1, 2, 0.4), np.array([2.0, 3.0])
    curvature = float(kernels.pursuit_curvature(robot, target))
    arc = PlanarPath.from_pieces(robot, [3.0], [1 / curvature])
    assert abs(float(arc.locate(target).distance)) < 1e-12


def test_obstacles_slow_down_and_stop() -> None:
    path = PlanarPath.through([[0, 0], [10, 0]], 1.0)
    settings = FollowSettings(speed=1.0)
    far = follow(path, pose(0, 0), 0.0, [[2.5, 0.1]], settings)
    assert far.status == FollowStatus.OK and abs(far.clearance - 2.5) < 1e-9
    near = follow(path, pose(1.5, 0), 1.5, [[2.5, 0.1]], settings)
    assert near.status == FollowStatus.SLOWED and abs(near.speed - np.sqrt(2 * 0.5 * 0.5)) < 1e-9
    at = follow(path, pose(2.0, 0), 2.0, [[2.5, 0.1], [np.nan, 0]], settings)
    assert at.status == FollowStatus.BLOCKED and at.speed == 0 and at.turn == 0
    # Beside the path, behind the robot, or beyond the horizon.
    free = follow(path, pose(2.0, 0), 2.0, [[2.5, 0.3], [1.9, 0.0], [8.0, 0.0]], settings)
    assert free.status == FollowStatus.OK and np.isinf(free.clearance)


def test_statuses_of_unusable_input() -> None:
    path = PlanarPath.through([[0, 0], [10, 0]], 1.0)
    assert follow(path, pose(1, 2)).status == FollowStatus.OFF_PATH
    assert follow(path, np.full(4, np.nan)).status == FollowStatus.NOT_FINITE
    assert follow(PlanarPath.through([[0, 0]], 1.0), pose(0, 0)).status == FollowStatus.NO_PATH
    assert follow(path, pose(10, 0), 10.0).status == FollowStatus.ARRIVED
    tight = follow(path, pose(1, 0.5, 1.5), 1.0, settings=FollowSettings(largest_curvature=0.5))
    assert tight.status == FollowStatus.SATURATED and abs(tight.turn) <= 0.25 + 1e-12


def run_in_house(seed: int, **options: object) -> NavigationRun:
    plan = load_floor_plan(HOUSE, 0.045)
    path = PlanarPath.through(POINTS, 0.5)
    begin = path.pose(0.0)
    rng = np.random.default_rng(seed)
    error = rng.normal(size=3) * [0.02, 0.02, 0.02]
    robot = LineLocalizer(plan.segments, pga2.motor_product(begin, motor_of_error(error)), [4e-4] * 3)
    settings = FollowSettings(width=0.2)
    return simulate_following(plan, path, robot, begin, settings=settings, seed=seed, **options)


@pytest.mark.parametrize("seed", some_slow([0, 1], 1))
@pytest.mark.slow
def test_closed_loop_on_localisation(seed: int) -> None:
    run = run_in_house(seed)
    assert run.following[-1] == FollowStatus.ARRIVED
    # Cross-track error after the first metre, in which the error of the first pose decays: at most 2 cm.
    later = run.times > 2.0
    assert np.sqrt(np.mean(run.distances[later] ** 2)) < 0.01 and np.abs(run.distances[later]).max() < 0.02
    end = pga2.motor_to_angle_translation(run.truth[-1])[1]
    assert np.linalg.norm(end - POINTS[-1]) < 0.03
    assert not (run.localization == LocalizationStatus.LOST).any()
    assert 1.5 < run.normalized_errors.mean() < 4.5


def test_closed_loop_stops_in_front_of_a_person() -> None:
    person = [5.5, 11.1]
    run = run_in_house(0, obstacles=[person])
    assert run.following[-1] == FollowStatus.BLOCKED
    gap = np.linalg.norm(pga2.motor_to_angle_translation(run.truth[-1])[1] - person) - 0.2
    assert 0.4 < gap < 0.6


@pytest.mark.parametrize("law", ["lyapunov", "pursuit"])
def test_obstacles_beside_the_path_stop_a_robot_that_returns_to_it(law: str) -> None:
    """A robot 0.9 m beside the path stands before it touches an obstacle on its way back, and not for one elsewhere."""
    path = PlanarPath.through([[0, 0], [10, 0]], 1.0)
    settings = FollowSettings(law=law)
    motor, obstacle = pose(0.2, 0.9, -0.3), np.array([1.0, 0.45])
    nearest, status = np.inf, FollowStatus.OK
    for _ in range(400):
        command = follow(path, motor, 0.2, [obstacle], settings)
        status = command.status
        nearest = min(nearest, float(np.linalg.norm(pga2.motor_to_angle_translation(motor)[1] - obstacle)))
        if status == FollowStatus.BLOCKED:
            break
        motor = np.asarray(pga2.motor_product(motor, motor_of_error(0.02 * np.array([command.turn, command.speed, 0]))))
    assert status == FollowStatus.BLOCKED and nearest > settings.width / 2
    # On the other side of the path, or at the robot and left behind, nothing is touched.
    free = follow(path, pose(0.2, 0.9, -0.3), 0.2, [[1.0, -0.4], [0.1, 0.9]], settings)
    assert free.status < FollowStatus.SLOWED and np.isinf(free.clearance)


@all_cases("option", [{"speed": -1.0}, {"deceleration": 0.0}, {"law": "x"}, {"gains": (1.0, -1.0)}, {"width": np.nan}])
def test_settings_are_checked(option: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=next(iter(option))):
        FollowSettings(**option)
