"""The walls of a floor plan in a map that is built from simulated scans and noisy odometry."""

from pathlib import Path

import numpy as np
import pytest

from algorithms.mapping.building import build_map
from algorithms.mapping.floor_plans import load_floor_plan, wall_recall_precision
from algorithms.mapping.localization import LineLocalizer
from algorithms.mapping.navigation_status import LocalizationStatus
from algorithms.mapping.paths import PlanarPath
from algorithms.mapping.scan_simulation import Scanner, simulate_log
from generated import pga2
from tests.support.selection import some_slow

HOUSE = Path(__file__).parents[1] / "data" / "maps" / "house.mat"
POINTS = [[2, 9], [3.4, 9.2], [3.4, 11.0], [7.2, 11.2], [8.7, 8], [10.5, 6.8], [11.2, 8.5], [10.9, 10.8], [14.0, 11.2],
          [15.0, 10.5], [15.1, 9.0], [15.2, 6.7]]  # fmt: skip


@pytest.mark.parametrize(("seed", "n"), some_slow([(1, 60), (2, 120)], (2, 120)))
@pytest.mark.slow
def test_recall_precision_and_localisation(seed: int, n: int) -> None:
    plan = load_floor_plan(HOUSE, 0.045, smallest=3.0)
    path = PlanarPath.through(POINTS, 0.4)
    truth = path.pose(np.linspace(0, path.length, n))
    log = simulate_log(plan, truth, Scanner(n_beams=361), seed=seed)
    angles, places = pga2.motor_to_angle_translation(log.odometry)
    odometry = np.column_stack([places, angles])
    built = build_map((scan, pose, None) for scan, pose in zip(log, odometry, strict=True))
    found = np.asarray(pga2.move_point(truth[0], built.line_map.ends))
    walls = np.stack([plan.starts, plan.ends], 1)
    long = walls[np.linalg.norm(walls[:, 1] - walls[:, 0], axis=1) > 0.5]
    options = {"distance": 0.15, "angle": np.radians(20.0)}
    assert wall_recall_precision(long, found, log.hits, n_hits=5, **options).recall >= 0.95
    assert wall_recall_precision(walls, found, log.hits, **options).precision >= 0.95
    # A robot on a second pass knows its pose in the map that was built.
    again = simulate_log(plan, truth, Scanner(n_beams=361), seed=seed + 100)
    robot = LineLocalizer(built.line_map, built.motors[0], [1e-4, 1e-3, 1e-3])
    off = []
    for k, scan in enumerate(again):
        robot.move(again.motions[k], again.covariances[k])
        assert robot.update(scan) != LocalizationStatus.LOST
        off.append(
            pga2.motor_to_angle_translation(pga2.motor_product(pga2.motor_inverse(built.motors[k]), robot.motor))
        )
    assert np.median([np.linalg.norm(shift) for _, shift in off]) < 0.05
