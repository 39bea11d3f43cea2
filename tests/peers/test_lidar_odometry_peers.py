"""Odometry of a lidar beside VGICP of small_gicp and KISS-ICP: simulated streets, and a pair of real scans."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from algorithms.mapping import LidarOdometry, MappingStatus
from benchmarks.lidar import a_drive, by_gicp, by_kiss, by_planes
from generated import pga3

pytestmark = pytest.mark.peers

PAIR = Path(__file__).parents[1] / "data" / "registration" / "rigid.npz"


@pytest.mark.slow
def test_drift() -> None:
    """Along 40 m, the mean error of the last place is at most that of VGICP, on the same scans."""
    pytest.importorskip("small_gicp")
    errors = []
    for seed in range(3):
        clouds, place = a_drive(seed, 60)
        errors.append([np.linalg.norm(method(clouds)[:3, 3] - place) for method in (by_planes, by_gicp)])
    ours, theirs = np.mean(errors, 0)
    assert ours < 0.015 and ours < theirs


@pytest.mark.slow
def test_drift_of_kiss_icp() -> None:
    """The error of the last place is at most that of KISS-ICP, on the same scans of 40 rings."""
    pytest.importorskip("kiss_icp.kiss_icp")
    clouds, place = a_drive(3, 40, 40, 360)
    ours, theirs = (np.linalg.norm(method(clouds)[:3, 3] - place) for method in (by_planes, by_kiss))
    assert ours < 0.015 and ours < theirs


def test_real_scans() -> None:
    """Of two outdoor scans, thinned to means of cells, the motion is as near to the published one as KISS-ICP's.

    The published motion is itself uncertain by 7 to 33 mm.
    """
    pytest.importorskip("kiss_icp.kiss_icp")
    with np.load(PAIR) as data:
        source, target, motion = (np.asarray(data[f"outdoor_{k}"], float) for k in ("source", "target", "motion"))
    odometry = LidarOdometry(noise=0.05)
    assert odometry.add(target) is MappingStatus.OK
    assert odometry.add(source) in (MappingStatus.OK, MappingStatus.DEGENERATE)
    ours = np.linalg.norm(np.asarray(pga3.motor_to_matrix(odometry.pose))[:3, 3] - motion[:3, 3])
    theirs = np.linalg.norm(by_kiss([target, source])[:3, 3] - motion[:3, 3])
    assert ours < 0.035 and ours < theirs
