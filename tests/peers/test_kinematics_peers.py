"""Forward kinematics against the Robotics Toolbox for Python."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.kinematics import Robot
from generated import pga3

pytestmark = pytest.mark.peers


PEERS = {
    "puma560": "Puma560", "ur5": "UR5", "ur3": "UR3", "ur10": "UR10", "irb140": "IRB140", "kr5": "KR5",
    "cobra600": "Cobra600", "sawyer": "Sawyer", "jaco": "Jaco", "mico": "Mico",
}  # fmt: skip


@pytest.mark.parametrize("name", PEERS)
def test_named_robots_equal_those_of_the_toolbox(name: str) -> None:
    """To 1e-6 for the arms of Kinova, whose table the toolbox computes from angles; their first joint is reversed."""
    peer = getattr(pytest.importorskip("roboticstoolbox").models.DH, PEERS[name])()
    arm = Robot.named(name)
    q = np.random.default_rng(7).uniform(-np.pi, np.pi, (1000, arm.n_joints))
    kinova = name in ("jaco", "mico")
    theirs = q * np.where(np.arange(arm.n_joints) == 0, -1, 1) if kinova else q
    assert np.abs(arm.pose(q) - peer.fkine(theirs).A).max() < (1e-6 if kinova else 1e-13)
    if not kinova:
        frames = pga3.motor_to_matrix(arm.forward_all(q[:20]))
        for mine, one in zip(frames, q[:20], strict=True):
            assert np.abs(mine - np.array([frame.A for frame in peer.fkine_all(one)][1:])).max() < 1e-13


def test_puma_at_the_poses_that_the_toolbox_names() -> None:
    peer = pytest.importorskip("roboticstoolbox").models.DH.Puma560()
    arm = Robot.named("puma560")
    for q in (peer.qz, peer.qr, peer.qs, peer.qn):
        assert np.abs(arm.pose(q) - peer.fkine(q).A).max() < 1e-14


@pytest.mark.parametrize("name", ["Stanford", "Panda", "Puma560"])
def test_tables_read_from_the_toolbox(name: str) -> None:
    """Prismatic joints, offsets and the modified convention, by the rows that the toolbox itself holds."""
    peer = getattr(pytest.importorskip("roboticstoolbox").models.DH, name)()
    rows = [
        {
            "d": link.d,
            "a": link.a,
            "alpha": link.alpha,
            "theta": link.theta if link.isprismatic else link.offset,
            "kind": "prismatic" if link.isprismatic else "revolute",
        }
        for link in peer.links
    ]
    q = np.random.default_rng(8).uniform(-1, 1, (200, len(rows)))
    arm = Robot.from_dh(rows, "modified" if peer.mdh else "standard")
    tool = np.linalg.inv(peer.base.A) @ peer.fkine(q).A @ np.linalg.inv(peer.tool.A)
    assert np.abs(arm.pose(q) - tool).max() < 1e-13
