"""Odometry of a lidar beside the scan-to-model registration of small_gicp (VGICP), in simulated streets."""

from __future__ import annotations

import numpy as np
import pytest
from street import beams, cloud, drive, street

from algorithms.arguments import Reals
from algorithms.mapping import LidarOdometry, MappingStatus
from generated import motor_graphs, pga3

small_gicp = pytest.importorskip("small_gicp")

pytestmark = pytest.mark.peers


def by_gicp(clouds: list[Reals]) -> Reals:
    """The last pose (4, 4): each scan is aligned with a map of Gaussian cells of a metre, at constant velocity."""
    pose, step = np.eye(4), np.eye(4)
    cells = small_gicp.GaussianVoxelMap(1.0)
    for k, points in enumerate(clouds):
        few, _ = small_gicp.preprocess_points(points, downsampling_resolution=0.25)
        if k:
            found = small_gicp.align(cells, few, pose @ step).T_target_source
            step, pose = np.linalg.inv(pose) @ found, found
        cells.insert(few, pose)
    return pose


@pytest.mark.slow
def test_drift() -> None:
    """Along 40 m, the mean error of the last place is at most that of VGICP, on the same scans."""
    ours, theirs = [], []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        world, poses = street(rng), drive(rng, 60)
        clouds = [cloud(rng, world, pose, beams()) for pose in poses]
        odometry = LidarOdometry()
        assert all(odometry.add(points) is MappingStatus.OK for points in clouds)
        truth = pga3.motor_product(pga3.motor_inverse(poses[0]), poses[-1])
        place = np.asarray(pga3.move_point(truth, np.zeros(3)))
        ours.append(np.linalg.norm(motor_graphs.difference_of_motors(odometry.pose, truth)[0][3:]))
        theirs.append(np.linalg.norm(by_gicp(clouds)[:3, 3] - place))
    assert np.mean(ours) < 0.015 and np.mean(ours) < np.mean(theirs)
