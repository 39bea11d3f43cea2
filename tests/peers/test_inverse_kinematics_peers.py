"""Inverse kinematics against the Robotics Toolbox for Python, one branch at a time, and against EAIK and ssik."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.kinematics import Robot
from benchmarks.inverse import prebuilt
from generated import pga3

pytestmark = pytest.mark.peers


def test_every_branch_that_the_toolbox_finds_for_the_puma_is_among_ours() -> None:
    peer = pytest.importorskip("roboticstoolbox").models.DH.Puma560()
    arm = Robot.named("puma560")
    q = np.random.default_rng(5).uniform(-np.pi, np.pi, (200, 6))
    poses = peer.fkine(q)
    found = arm.inverse(poses.A)
    compared = 0
    for k in range(len(q)):
        for branch in ("lun", "luf", "ldn", "ldf", "run", "ruf", "rdn", "rdf"):
            theirs = peer.ikine_a(poses[k], branch)
            # Theirs are not all right: those that do not reach the pose are left out.
            if not theirs.success or np.abs(peer.fkine(theirs.q).A - poses[k].A).max() > 1e-6:
                continue
            away = np.abs((found.q[k] - theirs.q + np.pi) % (2 * np.pi) - np.pi).max(-1)
            assert np.nanmin(away) < 1e-7
            compared += 1
    assert compared > 400


@pytest.mark.parametrize("name", ["ur5", "puma560", "irb140"])
def test_branches_of_eaik_and_ours_are_the_same(name: str) -> None:
    peer_of = pytest.importorskip("eaik.IK_HP").HPRobot
    arm = Robot.named(name)
    tool = pga3.motor_to_matrix(arm.tool)
    points = np.vstack([np.zeros(3), pga3.line_support(arm.axes), tool[:3, 3]])
    peer = peer_of(pga3.line_to_direction_moment(arm.axes)[0], np.diff(points, axis=0))
    poses = arm.pose(np.random.default_rng(6).uniform(-np.pi, np.pi, (200, 6)))
    found = arm.inverse(poses)
    for k, pose in enumerate(poses):
        turned = pose.copy()
        turned[:3, :3] = pose[:3, :3] @ tool[:3, :3].T
        theirs = np.array(peer.IK(np.asfortranarray(turned)).Q)
        ours, theirs = found.q[k][found.valid[k]], theirs[np.abs(arm.pose(theirs) - pose).max((-2, -1)) < 1e-6]
        assert are_among(ours, theirs) and are_among(theirs, ours)


@pytest.mark.parametrize("posture", ["random", "fourth joint", "15 degrees"])
@pytest.mark.parametrize("path", ["ufactory.xarm6_ik", "agilex.piper_ik", "doosan.m0609_ik", "yaskawa.hc10_ik"])
def test_regular_branches_of_ssik_are_among_ours(path: str, posture: str) -> None:
    pytest.importorskip("ssik")
    solver, arm = prebuilt(path)
    rng = np.random.default_rng(8)
    q = rng.uniform(-np.pi, np.pi, (60, 6))
    if posture == "fourth joint":
        q[:, 3] = 0.0
    elif posture == "15 degrees":
        q = rng.integers(-11, 13, (60, 6)) * (np.pi / 12)
    poses = arm.pose(q)
    found = arm.inverse(poses)
    compared = 0
    for k, pose in enumerate(poses):
        theirs = np.array([solution.q for solution in solver(pose, respect_limits=False)]).reshape(-1, 6)
        theirs = theirs[np.abs(arm.pose(theirs) - pose).max((-2, -1)) < 1e-6]
        # Of a pose that is singular, both return some configurations of infinitely many.
        theirs = theirs[np.linalg.svd(arm.jacobian(theirs), compute_uv=False)[:, -1] > 0.01]
        assert are_among(theirs, found.q[k][found.valid[k]])
        compared += len(theirs)
    assert compared > 200


def are_among(some: np.ndarray, all_of_them: np.ndarray) -> bool:
    """Whether configurations are among others, up to whole turns."""
    away = np.abs((all_of_them[:, None] - some + np.pi) % (2 * np.pi) - np.pi).max(-1)
    return bool(away.min(0, initial=np.inf).max(initial=0.0) < 1e-4)
