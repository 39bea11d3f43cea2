"""Graphs of poses compared with gtsam."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from algorithms.mapping.g2o import read_g2o
from algorithms.mapping.pose_graph import GraphStatus, optimise_poses
from generated import pga2

pytestmark = pytest.mark.peers
KILLIAN = Path(__file__).parents[1] / "data" / "maps" / "killian_start.g2o.gz"


def test_poses_are_those_of_gtsam() -> None:
    """The graph of Killian Court, from its vertices: the costs agree to 1e-4, places to 2 cm.

    gtsam measures misfits in another chart, which agrees to first order.
    """
    gtsam = pytest.importorskip("gtsam")
    file = read_g2o(KILLIAN)
    information = file.information[:, [2, 0, 1]][:, :, [2, 0, 1]]
    motions = pga2.motor_from_angle_translation(file.motions[:, 2], file.motions[:, :2])
    start = pga2.motor_from_angle_translation(file.poses[:, 2], file.poses[:, :2])
    found = optimise_poses(start, file.edges, motions, information)
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    fixed = gtsam.noiseModel.Diagonal.Sigmas(np.full(3, 1e-6))
    graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(*file.poses[0]), fixed))
    for (a, b), motion, matrix in zip(file.edges.tolist(), file.motions, file.information, strict=True):
        graph.add(gtsam.BetweenFactorPose2(a, b, gtsam.Pose2(*motion), gtsam.noiseModel.Gaussian.Information(matrix)))
    for k, pose in enumerate(file.poses):
        values.insert(k, gtsam.Pose2(*pose))
    theirs = gtsam.GaussNewtonOptimizer(graph, values).optimize()
    places = np.array([theirs.atPose2(k).translation() for k in range(len(file.poses))])
    assert found.status == GraphStatus.OK
    assert found.cost == pytest.approx(graph.error(theirs), rel=1e-4)
    assert np.abs(pga2.motor_to_angle_translation(found.motors)[1] - places).max() < 0.02
