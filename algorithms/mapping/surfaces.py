"""Alignment of a scan with points of earlier scans, by distances from the lines through them, and with odometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from generated import line_maps, pga2

from ..arguments import Reals
from ..precision import ROUNDING
from .motions import relative
from .narrow_objects import JOINED, joined_points, narrow_objects
from .scan import Scan

_SQUARE = np.array([0, 1, 2, 1, 3, 4, 2, 4, 5])
_REACHES = (1.0, 0.6, 0.4, 0.3, 0.3, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2)
"""How far targets of points are looked for in each step, in metres."""
_FINAL = 5
"""The first step after which small steps end the iteration."""
_SCALE = 0.08
"""The distance at which points lose three quarters of their weight."""
_SAME_SIDE = 0.6
"""The smallest cosine of the angle between normals of a point and its target."""
_SIGMA = 0.03
"""The standard deviation of readings, with the roughness of walls."""
_INDEPENDENT = 0.3
"""The share of readings that count as independent."""
SETTLED = 1e-4
"""Steps of radians and metres at which an alignment is complete: far below the noise of readings."""
_WINDOW = 2
"""Readings on each side of a reading, with which its normal is computed."""
INLIER = 0.1
"""The distance up to which a reading agrees with a map."""
_NEAR = 0.6
"""The distance up to which readings and points of a map are compared."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Points with the normals of the surface there, on the side of the scanner."""

    points: Reals
    """(n, 2)"""
    normals: Reals
    """(n, 2)"""

    def moved(self, motor: Reals) -> Surface:
        """Return the surface, moved by a motor."""
        return Surface(
            np.asarray(pga2.move_point(motor, self.points)), np.asarray(pga2.move_direction(motor, self.normals))
        )


def surface(scan: Scan) -> Surface:
    """Return the points of a scan with neighbours on a smooth surface, with normals fitted to up to five points."""
    points = scan.points()
    n = len(points)
    if n < 2:
        return Surface(np.zeros((0, 2)), np.zeros((0, 2)))
    # Neighbours count while no step between two of them is long.
    joined = joined_points(scan)
    total, count = points.copy(), np.ones(n)
    squares = points[:, :, None] * points[:, None, :]
    moments = squares.copy()
    right, left = np.ones(n, bool), np.ones(n, bool)
    for k in range(1, _WINDOW + 1):
        right = right[:-1] & joined[k - 1 :] if k > 1 else joined.copy()
        left = left[1:] & joined[: n - k] if k > 1 else joined.copy()
        if not len(right):
            break
        # `right` belongs to the points 0 to n - k - 1, `left` to the points k to n - 1.
        total[: n - k] += np.where(right[:, None], points[k:], 0)
        total[k:] += np.where(left[:, None], points[: n - k], 0)
        moments[: n - k] += np.where(right[:, None, None], squares[k:], 0)
        moments[k:] += np.where(left[:, None, None], squares[: n - k], 0)
        count[: n - k] += right
        count[k:] += left
    mean = total / count[:, None]
    xx, xy, yy = (moments[:, i, j] / count - mean[:, i] * mean[:, j] for i, j in ((0, 0), (0, 1), (1, 1)))
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    normals = np.stack([-np.sin(angle), np.cos(angle)], 1)
    root = np.sqrt((xx - yy) ** 2 / 4 + xy**2)
    thin, long = (xx + yy) / 2 - root, (xx + yy) / 2 + root
    smooth = (count >= 3) & (thin < 0.1 * long) & ~narrow_objects(scan)
    normals *= -np.sign((normals * points).sum(1))[:, None]
    return Surface(points[smooth], normals[smooth])


class Reference:
    """Points of earlier scans in one frame, in which nearest points are looked for."""

    def __init__(self, parts: list[Surface]) -> None:
        self.points = np.concatenate([part.points for part in parts]) if parts else np.zeros((0, 2))
        self.normals = np.concatenate([part.normals for part in parts]) if parts else np.zeros((0, 2))
        self._tree = (
            scipy.spatial.cKDTree(self.points, balanced_tree=False, compact_nodes=False) if len(self.points) else None
        )

    def nearest(self, points: Reals, reach: float) -> tuple[Reals, Reals]:
        """Return distances and indices of nearest points; infinite, and 0, beyond the reach."""
        if self._tree is None:
            return np.full(len(points), np.inf), np.zeros(len(points), int)
        distances, rows = self._tree.query(points, distance_upper_bound=reach)
        return distances, np.where(np.isfinite(distances), rows, 0)


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """Result of `align`."""

    motor: Reals
    """(4,) The pose."""
    information: Reals
    """(3, 3) The inverse covariance of a perturbation in its own frame by the readings alone: angle, x, y."""
    share: float
    """The share of points that are within 10 cm of the surface of the reference, from 0 to 1."""
    agreement: float
    """The share among points that have points of the reference near by: those elsewhere were not seen before."""
    rms: float
    """The root mean square of the distances of points on the surface, in metres."""
    steps: int


def align(
    reference: Reference,
    seen: Surface,
    start: Reals,
    prior: Reals | None = None,
    prior_information: Reals | None = None,
    first: int = 0,
) -> Alignment:
    """Find the pose from which points are on the surface of a reference.

    Parameters
    ----------
    reference : Reference
    seen : Surface
        In the frame of the robot.
    start : array, (4,)
    prior : array, (4,), optional
        The pose by odometry.
    prior_information : array, (3, 3), optional
        The inverse covariance of its angle, x and y.
    first : int, optional
        How many of the first, coarse steps are left out.

    Returns
    -------
    Alignment
    """
    motor = start
    matrix, count = np.zeros((3, 3)), 0
    for count, reach in enumerate(_REACHES[first:], 1):
        targets, normals, weights, _ = _targets(reference, seen, motor, reach)
        sums, gradient, _, _ = line_maps.sums_of_distances(
            motor, seen.points, targets, normals, weights, max(_SCALE, reach / 3)
        )
        matrix = sums[_SQUARE].reshape(3, 3) * (_INDEPENDENT / _SIGMA**2)
        total = matrix + np.diag([1e-3, 1e-3, 1e-3])
        right = gradient * (_INDEPENDENT / _SIGMA**2)
        if prior is not None and prior_information is not None:
            angle, shift = pga2.motor_to_angle_translation(relative(prior, motor))
            total = total + prior_information
            right = right + prior_information @ np.array([angle, *shift])
        change = -np.linalg.solve(total, right)
        motor = pga2.motor_product(motor, pga2.motor_from_angle_translation(change[0], change[1:]))
        if count + first > _FINAL and np.abs(change).max() < SETTLED:
            break
    motor = np.asarray(pga2.normalize_motor(motor))
    return Alignment(motor, *_quality(reference, seen, motor), count)


def _quality(reference: Reference, seen: Surface, motor: Reals) -> tuple[Reals, float, float, float]:
    """Return the information, the share of points on the surface of a reference, that of points near it, and the rms.

    Objects that have moved pull all their readings to one side, so that the variances of the gradient are those of
    whole objects (Liang and Zeger, *Biometrika* 73:13, 1986), beside those of independent readings.
    """
    targets, normals, weights, distances = _targets(reference, seen, motor, _NEAR)
    off = ((pga2.move_point(motor, seen.points) - targets) * normals).sum(1)
    good = (weights > 0) & (np.abs(off) < INLIER) & (distances < 3 * INLIER)
    if not good.any():
        return np.zeros((3, 3)), 0.0, 0.0, float("inf")
    near = (weights > 0) & (distances < _REACHES[-1])
    shares = near / (1 + (off / _SCALE) ** 2) ** 2
    x, y = seen.points.T
    along = np.asarray(pga2.move_direction(pga2.motor_inverse(motor), normals))
    rows = np.column_stack([x * along[:, 1] - y * along[:, 0], along])
    curvature = rows.T @ (shares[:, None] * rows)
    begins = np.concatenate([[0], np.flatnonzero(np.hypot(*np.diff(seen.points, axis=0).T) > JOINED) + 1])
    pulls = np.add.reduceat((shares * off)[:, None] * rows, begins)
    spread = pulls.T @ pulls + (_SIGMA**2 / _INDEPENDENT) * curvature + ROUNDING * np.eye(3)
    information = curvature @ np.linalg.solve(spread, curvature)
    rms = float(np.sqrt(np.mean(off[good] ** 2)))
    return information, float(good.mean()), float(good.sum() / np.isfinite(distances).sum()), rms


def _targets(reference: Reference, seen: Surface, motor: Reals, reach: float) -> tuple[Reals, Reals, Reals, Reals]:
    """Return nearest points with their normals, weights of 1 where normals agree, and the distances."""
    moved = seen.moved(motor)
    distances, rows = reference.nearest(moved.points, reach)
    if not len(reference.points):
        return moved.points, moved.normals, np.zeros(len(moved.points)), distances
    targets, normals = reference.points[rows], reference.normals[rows]
    alike = (normals * moved.normals).sum(1) > _SAME_SIDE
    return targets, normals, (np.isfinite(distances) & alike).astype(float), distances
