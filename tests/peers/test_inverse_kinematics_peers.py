"""Inverse kinematics against the closed form of the Robotics Toolbox for Python, which gives one branch at a time."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.kinematics import Robot

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
