"""Graphs of poses compared with gtsam."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from algorithms.arguments import Reals
from algorithms.estimation import MotorGraph, SmoothingStatus, smooth_motors
from algorithms.mapping.g2o import read_g2o
from algorithms.mapping.g2o_space import SpaceGraphFile, read_g2o_space, write_g2o
from algorithms.mapping.pose_graph import GraphStatus, optimise_poses
from generated import motor_graphs, pga2, pga3

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


def test_poses_in_space_are_those_of_gtsam(tmp_path: Path) -> None:
    """A helix with noise, which gtsam reads from our file: costs agree to 1e-6, places to a millimetre."""
    gtsam = pytest.importorskip("gtsam")
    rng = np.random.default_rng(0)
    step = pga3.motor_from_rotation_vector_translation([0, 0, np.pi / 10], [1.0, 0, 0.1])
    chain = [np.eye(8)[0]]
    for _ in range(99):
        chain.append(np.asarray(pga3.motor_product(chain[-1], step)))
    motors = np.array(chain)
    edges = np.array([(k, k + 1) for k in range(99)] + [(k, k + 20) for k in range(80)])
    between = pga3.motor_product(pga3.motor_inverse(motors[edges[:, 0]]), motors[edges[:, 1]])
    noise = rng.normal(size=(179, 6)) * ([0.02] * 3 + [0.05] * 3)
    motions = motor_graphs.moved_motor(between, noise)
    rows = [np.column_stack([place, turn[:, [1, 2, 3, 0]]]) for turn, place in (
        map(np.asarray, pga3.motor_to_quaternion_translation(each)) for each in (motors, motions))]  # fmt: skip
    information = np.tile(np.diag([400.0] * 3 + [2500] * 3), (179, 1, 1))
    write_g2o(
        tmp_path / "a.g2o", SpaceGraphFile(np.arange(100), rows[0], edges, rows[1], information, np.zeros(0, int))
    )
    file = read_g2o_space(tmp_path / "a.g2o")
    found = optimise_poses(file.motors, file.edges, file.motion_motors, file.turns_first)
    graph, values = gtsam.readG2o(str(tmp_path / "a.g2o"), True)
    graph.add(gtsam.PriorFactorPose3(0, values.atPose3(0), gtsam.noiseModel.Isotropic.Sigma(6, 1e-6)))
    parameters = gtsam.GaussNewtonParams()
    parameters.setRelativeErrorTol(1e-12)
    theirs = gtsam.GaussNewtonOptimizer(graph, values, parameters).optimize()
    places = np.array([theirs.atPose3(k).translation() for k in range(100)])
    assert found.status == GraphStatus.OK
    assert found.cost == pytest.approx(graph.error(theirs), rel=1e-6)
    assert np.abs(np.asarray(pga3.motor_to_matrix(found.motors))[:, :3, 3] - places).max() < 1e-3


def test_places_and_covariances_are_those_of_gtsam() -> None:
    """Motions, places of an antenna's lever, and a prior: costs agree to 1e-6, covariances of poses to 1e-4."""
    gtsam = pytest.importorskip("gtsam")
    rng = np.random.default_rng(1)
    deviations = np.array([0.02] * 3 + [0.05] * 3)
    step = pga3.motor_from_rotation_vector_translation([0.05, 0, 0.3], [1.0, 0, 0.1])
    chain = [np.eye(8)[0]]
    for _ in range(19):
        chain.append(np.asarray(pga3.motor_product(chain[-1], step)))
    motors = np.array(chain)
    motions = motor_graphs.moved_motor(np.tile(step, (19, 1)), deviations * rng.normal(size=(19, 6)))
    places = np.asarray(pga3.motor_to_matrix(motors))[:, :3, 3] + 0.1 * rng.normal(size=(20, 3))
    ours = MotorGraph()
    ours.add_priors(0, motors[0], deviations**2)
    ours.add_motions(np.arange(19), np.arange(1, 20), motions, deviations**2)
    ours.add_positions(np.arange(20), places, np.full(3, 0.01))
    found = smooth_motors(ours, motors, marginals=[0, 10, 19])

    def pose(motor: Reals) -> Any:
        return gtsam.Pose3(np.asarray(pga3.motor_to_matrix(motor)))

    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    noise = gtsam.noiseModel.Diagonal.Sigmas(deviations)
    graph.add(gtsam.PriorFactorPose3(0, pose(motors[0]), noise))
    for k, motion in enumerate(motions):
        graph.add(gtsam.BetweenFactorPose3(k, k + 1, pose(motion), noise))
    for k, place in enumerate(places):
        graph.add(gtsam.GPSFactor(k, place, gtsam.noiseModel.Isotropic.Sigma(3, 0.1)))
        values.insert(k, pose(motors[k]))
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setRelativeErrorTol(1e-14)
    theirs = gtsam.LevenbergMarquardtOptimizer(graph, values, parameters).optimize()
    spreads = gtsam.Marginals(graph, theirs)
    assert found.status == SmoothingStatus.OK
    assert found.cost == pytest.approx(graph.error(theirs), rel=1e-6)
    for covariance, k in zip(found.covariances, (0, 10, 19), strict=True):
        want = spreads.marginalCovariance(k)
        assert np.abs(covariance - want).max() < 1e-4 * np.abs(want).max()
