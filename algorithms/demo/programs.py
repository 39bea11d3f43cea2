"""Three programs on generated kernels: the reach of two arms, a stereo pair, the spectrum of an image."""

from __future__ import annotations

from math import log, pi
from pathlib import Path

import numpy as np

from generated import pga3, quaternion

from ..arguments import Reals
from ..kinematics import Robot
from ..kinematics.named import TABLES
from ..vision import MOTORCYCLE, epipolar_distance, epipolar_lines, fundamental_matrix, triangulate
from ..wavelets import iqft, qft
from .figures import draw_arms, draw_spectrum, draw_stereo
from .timing import N_ELEMENTS, median_time

Facts = list[tuple[str, str]]
"""Results of a program: quantities, and their values with units."""

_TITLES = {"puma560": "PUMA 560", "ur5": "UR5"}
_POSE_NAMES = {"puma560": "at its nominal pose qn", "ur5": "in the pose drawn"}
_POSES = {"puma560": (0, pi / 4, pi, 0, pi / 4, 0), "ur5": (0, -pi / 3, pi / 2, -2 * pi / 3, -pi / 2, 0)}
"""The pose in which each arm is drawn; that of the PUMA 560 is `qn` of the Robotics Toolbox."""


def arms(path: Path) -> Facts:
    """Compute forward kinematics of two arms from their Denavit-Hartenberg tables, for random joint vectors."""
    rng = np.random.default_rng(560)
    origin = np.zeros(3)
    facts: Facts = []
    drawn: dict[str, tuple[Reals, Reals]] = {}
    for name, title in _TITLES.items():
        arm, pose = Robot.named(name), np.array(_POSES[name])
        q = rng.uniform(-pi, pi, (N_ELEMENTS, arm.n_joints))
        motors = arm.forward(q)
        cloud = pga3.move_point(motors, origin)
        corners = np.vstack([origin, pga3.move_point(arm.forward_all(pose), origin)])
        drawn[title] = cloud, corners
        error = np.abs(pga3.motor_to_matrix(motors[:1000]) - _pose_by_matrices(name, q[:1000])).max()
        x, y, z = arm.pose(pose)[:3, 3]
        facts += [
            (f"{title}, end effector {_POSE_NAMES[name]}", f"({x:.6f}, {y:.6f}, {z:.6f}) m"),
            (f"{title}, largest distance from the base", f"{np.linalg.norm(cloud, axis=-1).max():.3f} m"),
            (f"{title}, difference to products of 4 x 4 matrices", f"{error:.1e}"),
            (f"{title}, time per configuration of {len(q):,}", f"{_nanoseconds(arm, q):.0f} ns"),
        ]
    draw_arms(drawn, path)
    return facts


def stereo(path: Path) -> Facts:
    """Process two views of a motorcycle: fundamental matrix of the cameras, and depth from the true disparities."""
    from skimage.data import stereo_motorcycle

    left, right, disparity = stereo_motorcycle()  # type: ignore[no-untyped-call]
    disparity = disparity.astype(np.float64)
    cameras = MOTORCYCLE.cameras()
    matrix = fundamental_matrix(*cameras)
    pixels, partners = MOTORCYCLE.correspondences(disparity)
    depth = MOTORCYCLE.depth(disparity)
    known = np.isfinite(depth)
    points = triangulate(cameras, (pixels, partners))
    seconds = median_time(lambda: triangulate(cameras, (pixels, partners)), 3)
    chosen = np.linspace(0, len(pixels) - 1, 14).astype(int)[1:-1]
    chosen = chosen[np.argsort(pixels[chosen, 1])]
    off_line = epipolar_distance(matrix, pixels, partners)
    draw_stereo(
        (left, right), (pixels[chosen], partners[chosen]), epipolar_lines(matrix, pixels[chosen]), depth / 1e3, path
    )
    return [
        ("Pixels with a true disparity", f"{known.sum():,} of {known.size:,} ({known.mean():.1%})"),
        ("Smallest and largest depth", f"{depth[known].min() / 1e3:.3f} m, {depth[known].max() / 1e3:.3f} m"),
        (
            "Distance of true correspondences to epipolar lines",
            f"at most {_largest(off_line)} px",
        ),
        ("Depth by triangulation and by disparity", f"differ by at most {_largest(points[:, 2] - depth[known])} mm"),
        ("Time per triangulated point", f"{seconds / len(pixels) * 1e9:.0f} ns"),
    ]


def spectrum(path: Path) -> Facts:
    """Compute the two-sided quaternion Fourier transform of the camera image, and its inverse."""
    from skimage.data import camera

    image = camera().astype(np.float64)  # type: ignore[no-untyped-call]
    transform = qft(image)
    back = iqft(transform)
    error = np.abs(back - np.stack([image, *np.zeros((3, *image.shape))], -1)).max(-1)
    logarithm = quaternion.logarithm(transform)
    energy = np.square(transform).sum() / image.size / np.square(image).sum() - 1
    seconds = median_time(lambda: qft(image), 3), median_time(lambda: iqft(transform), 3)
    draw_spectrum(image, logarithm[..., 0] / log(10), iqft(quaternion.normalize(transform))[..., 0], error, path)
    return [
        ("Image", f"{image.shape[0]} x {image.shape[1]}, grey levels {image.min():.0f} to {image.max():.0f}"),
        ("Error of the inverse transform", f"at most {_largest(error)} grey levels"),
        ("Energy compared with that of the image (Plancherel)", f"relative error {abs(energy):.1e}"),
        ("Time of the transform, and of its inverse", f"{seconds[0] * 1e3:.1f} ms, {seconds[1] * 1e3:.1f} ms"),
    ]


def _pose_by_matrices(name: str, q: Reals) -> Reals:
    """Return the product of the matrices of a standard table, computed without generated kernels."""
    pose = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for row, angle in zip(TABLES[name].rows, q.T, strict=True):
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(row.alpha), np.sin(row.alpha)
        nil, one = np.zeros_like(c), np.ones_like(c)
        link = [
            [c, -s * ca, s * sa, row.a * c],
            [s, c * ca, -c * sa, row.a * s],
            [nil, sa * one, ca * one, row.d * one],
            [nil, nil, nil, one],
        ]
        pose = pose @ np.moveaxis(np.array(link), -1, 0)
    return pose


def _nanoseconds(arm: Robot, q: Reals) -> float:
    return median_time(lambda: arm.forward(q), 3) / len(q) * 1e9


def _largest(values: Reals) -> str:
    return f"{np.abs(values).max():.1e}"
