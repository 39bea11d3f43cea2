"""Odometry of a lidar beside VGICP of small_gicp and KISS-ICP, on the same scans."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from time import process_time

import numpy as np

from algorithms.arguments import Reals
from algorithms.mapping import LidarOdometry, MappingStatus
from generated import pga3

from .libraries import installed
from .streets import beams, cloud, drive, street

PEERS = "small_gicp", "kiss_icp"


def by_planes(clouds: list[Reals]) -> Reals:
    """The last pose (4, 4) by `LidarOdometry`, all of whose scans are to be OK."""
    odometry = LidarOdometry()
    statuses = [odometry.add(points) for points in clouds]
    if any(status is not MappingStatus.OK for status in statuses):
        raise ValueError(f"scans of the street: {[status.name for status in statuses]}; expected OK")
    return np.asarray(pga3.motor_to_matrix(odometry.pose))


def by_gicp(clouds: list[Reals]) -> Reals:
    """The last pose (4, 4): each scan is aligned with a map of Gaussian cells of a metre, at constant velocity."""
    small_gicp = importlib.import_module("small_gicp")
    pose, step = np.eye(4), np.eye(4)
    cells = small_gicp.GaussianVoxelMap(1.0)
    for k, points in enumerate(clouds):
        few, _ = small_gicp.preprocess_points(points, downsampling_resolution=0.25)
        if k:
            found = small_gicp.align(cells, few, pose @ step).T_target_source
            step, pose = np.linalg.inv(pose) @ found, found
        cells.insert(few, pose)
    return pose


def by_kiss(clouds: list[Reals], size: float = 1.0) -> Reals:
    """The last pose (4, 4) by KISS-ICP with cells of a size and one thread, for scans without motion during a scan."""
    config = importlib.import_module("kiss_icp.config").KISSConfig()
    config.data.deskew, config.data.max_range, config.data.min_range = False, 100.0, 0.0
    config.mapping.voxel_size, config.registration.max_num_threads = size, 1
    odometry = importlib.import_module("kiss_icp.kiss_icp").KissICP(config)
    for points in clouds:
        odometry.register_frame(np.asarray(points, float), np.zeros(len(points)))
    return np.asarray(odometry.last_pose)


METHODS: dict[str, tuple[str, Callable[[list[Reals]], Reals]]] = {
    "`LidarOdometry`": ("", by_planes),
    "VGICP of small_gicp": ("small_gicp", by_gicp),
    "KISS-ICP": ("kiss_icp", by_kiss),
}


def a_drive(seed: int, count: int, rings: int = 24, columns: int = 240) -> tuple[list[Reals], Reals]:
    """The scans of a drive along a street, and the last place (3,) in the frame of the first one."""
    rng = np.random.default_rng(seed)
    world, poses = street(rng), drive(rng, count)
    clouds = [cloud(rng, world, pose, beams(rings, columns)) for pose in poses]
    truth = pga3.motor_product(pga3.motor_inverse(poses[0]), poses[-1])
    return clouds, np.asarray(pga3.move_point(truth, np.zeros(3)))


def rows(n_drives: int, count: int, rings: int = 24, columns: int = 240) -> list[str]:
    """The rows of a table: the errors of the last places, and the CPU time of a scan; methods alternate."""
    found: dict[str, list[tuple[float, float]]] = {}
    for seed in range(n_drives):
        clouds, place = a_drive(seed, count, rings, columns)
        for name, (peer, method) in METHODS.items():
            if peer and not installed(peer):
                continue
            start = process_time()
            pose = method(clouds)
            spent = process_time() - start
            found.setdefault(name, []).append((float(np.linalg.norm(pose[:3, 3] - place)), spent / count))
    return [
        f"| {name} | {rings} x {columns} | {', '.join(f'{1e3 * off:.0f}' for off, _ in each)} "
        f"| {1e3 * np.median([spent for _, spent in each]):.0f} |"
        for name, each in found.items()
    ]
