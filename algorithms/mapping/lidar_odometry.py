"""Odometry of a lidar in space: each scan is aligned with the surfaces of the scans before it, on motors."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import lidar as kernels
from generated import motor_graphs, pga3

from ..arguments import Reals, finite_number, real_array
from ..cubes import thinned
from ..evidence.triangles import from_triangle
from .point_cells import PointCells
from .status import MappingStatus
from .surfaces import SETTLED

IDENTITY = np.eye(8)[0]
_FEWEST = 50
"""Points that a scan needs."""
_FINE, _COARSE = 0.25, 0.5
"""Limits on work: the distances of points that are kept, and of those that are aligned, as a share of cells."""
_WIDE = np.array([0.2] * 3 + [2.0] * 3)
"""Standard deviations of the motion to the second scan, rotation and translation: no velocity is known."""
_LEARNT = 10
"""How many scans the errors of predictions are averaged over, and the times between scans are."""
_STEPS = 40
"""A limit on work: the most steps of an alignment."""
_SHARE, _KNOWN = 0.75, 0.15
"""The least mean weight of points near known surfaces, and the least share of them, of a scan that agrees with them: in
simulated streets it is 0.79 or more, and 0.65 or less if the surroundings are others."""
_TILTED = 5.0
"""Scans do not determine a direction if its information is less than this times that by tilts of normals by chance."""
_SLIDES = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
"""Sizes of cells by which other starts are moved, where the prediction is not known."""


class _Prediction(NamedTuple):
    """Where the motion before leads, and how much of it is known.

    `motor` is the pose, `variances` are those of its error, `late` is the part of the motion that continues it beyond
    the usual time, and `unmeasured` has the variances of the motion if nothing measures it.
    """

    motor: Reals
    variances: Reals
    late: Reals
    unmeasured: Reals


class _Descent(NamedTuple):
    """A pose, the normal equations there, the sums over points, and directions: undetermined ones, and the loosest."""

    pose: Reals
    matrix: Reals
    prior: Reals
    numbers: Reals
    loose: Reals
    loosest: Reals


def _explained(found: _Descent) -> float:
    return float(found.numbers[1])


def _agrees(found: _Descent, points: Reals) -> bool:
    count, weight = found.numbers[:2]
    return bool(count >= _KNOWN * len(points) and weight >= _SHARE * count)


class LidarOdometry:
    """Poses of a lidar from its scans, one at a time.

    Points are aligned with the planes of cells around the lidar, by Gauss-Newton steps for the motor. The motion is
    predicted to be the last one again; along directions that the scan does not determine, such as that along a tunnel,
    the prediction decides. The velocity is that over the usual time between scans. After a longer time the lidar may
    have stopped: the deviation of the prediction is then all of the further motion, and the last pose is tried as well.

    Parameters
    ----------
    voxel : float, optional
        The size of cells in metres.
    max_range : float, optional
        Points and cells farther away, in metres, are left out.
    noise : float, optional
        The standard deviation of readings in metres, with the roughness of surfaces.

    Raises
    ------
    TypeError, ValueError
        If a parameter is no positive number.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> box = rng.uniform(-1, 1, (6000, 3)) * [8, 6, 3]
    >>> side = rng.integers(3, size=6000)
    >>> box[range(6000), side] = np.sign(box[range(6000), side]) * np.array([8, 6, 3])[side]
    >>> odometry = LidarOdometry()
    >>> for k in range(5):
    ...     seen = box[rng.integers(6000, size=3000)] - [0.3 * k, 0, 0]
    ...     status = odometry.add(seen)
    >>> status.name, pga3.motor_to_rotation_vector_translation(odometry.pose)[1].round(2)[:2].tolist()
    ('OK', [1.2, 0.0])
    """

    def __init__(self, *, voxel: float = 1.0, max_range: float = 100.0, noise: float = 0.02) -> None:
        for value, name in ((voxel, "voxel"), (max_range, "max_range"), (noise, "noise")):
            if finite_number(value, name) <= 0:
                raise ValueError(f"{name}: {value}; expected a positive length in metres")
        self._voxel, self._max_range, self._noise = float(voxel), float(max_range), float(noise)
        self._map = PointCells(self._voxel, self._noise)
        self._pose: Reals = IDENTITY
        self._covariance: Reals = np.zeros((6, 6))
        self._status: MappingStatus | None = None
        self._velocity = np.zeros(6)
        """The last motion, as a perturbation, in a second, or between two scans while no times are known."""
        self._time: float | None = None
        """The time of the last scan; if it was not stated, the usual time after the one before."""
        self._stated: float | None = None
        """The last time that was stated."""
        self._is_stated = False
        self._passed: deque[float] = deque(maxlen=_LEARNT)
        """The last times between two scans with times."""
        self._known: Reals = IDENTITY
        """The pose of the last scan that agreed with the map."""
        self._spread = _WIDE**2
        """The variances of predictions."""
        self._n_errors = 0
        self._unknown = 0
        """How many scans in sequence have not determined all directions, or were not matched."""

    @property
    def pose(self) -> Reals:
        """(8,) The pose of the last scan: the unit motor of `generated.pga3` from its frame to that of the first."""
        return self._pose

    @property
    def covariance(self) -> Reals:
        """(6, 6) Of the error of the pose in the frame of the scan: a rotation vector and a translation."""
        return self._covariance

    @property
    def status(self) -> MappingStatus | None:
        """The status of the last scan; None before the first one with planes."""
        return self._status

    @property
    def n_cells(self) -> int:
        """The number of cells with planes around the lidar."""
        return len(self._map)

    def add(self, points: ArrayLike, time: float | None = None) -> MappingStatus:
        """Take the next scan.

        Parameters
        ----------
        points : array_like, (n, 3)
            In the frame of the lidar. Points that are not finite, at the origin, or beyond the range are left out.
        time : float, optional
            In seconds. Motions are predicted for the time between two scans; without it, it is the usual one.

        Returns
        -------
        MappingStatus
            OK if the scan determines the motion. DEGENERATE if it does not determine all directions, in which the
            prediction decides. NOT_MATCHED if it does not agree with the map, and TOO_FEW_READINGS: the pose is the
            prediction, and the map remains as it was. Scans before the first one with planes are TOO_FEW_READINGS, and
            the frame of the map is that of the first one with them.

        Raises
        ------
        TypeError, ValueError
            If the points are not real numbers (n, 3), or the time is no number later than the previous one.
        """
        cloud = np.zeros((0, 3)) if np.shape(points) == (0,) else real_array(points, "points", (-1, 3)).astype(float)
        if cloud.ndim != 2 or cloud.shape[1] != 3:
            raise ValueError(f"points: shape {cloud.shape}; expected (n, 3)")
        elapsed = self._elapsed(time)
        # Squares of huge coordinates would overflow.
        cloud = cloud[np.abs(cloud).max(1, initial=0) < self._max_range]
        ranges = np.sqrt((cloud**2).sum(1))
        cloud = thinned(cloud[(ranges > 0) & (ranges < self._max_range)], self._voxel * _FINE)
        if self._status is None:
            return self._begun(cloud)
        self._status = self._move(cloud, elapsed)
        return self._status

    def _begun(self, points: Reals) -> MappingStatus:
        """Start the map with a scan, if it has enough points on planes to agree with itself."""
        if len(points) >= _FEWEST:
            self._extend(points)
            if (self._map.nearest(points) >= 0).mean() >= _KNOWN:
                self._status = MappingStatus.OK
                return self._status
            self._map = PointCells(self._voxel, self._noise)
        return MappingStatus.TOO_FEW_READINGS

    def _elapsed(self, time: float | None) -> float:
        """Return the time since the last scan; the usual one if it is not known."""
        now = None if time is None else finite_number(time, "time")
        if now is not None and self._stated is not None and not now > self._stated:
            raise ValueError(f"time: {now}; expected later than {self._stated}, that of the previous scan")
        before, was_stated, self._is_stated = self._time, self._is_stated, now is not None
        if now is None or before is None:
            elapsed = self._usual()
            self._time = now if now is not None or before is None else before + elapsed
        else:
            elapsed = max(now - before, 0.0)
            self._time = now
            if was_stated and not self._passed:
                # The velocity has been that between two scans.
                self._velocity = self._velocity / elapsed
            if was_stated:
                self._passed.append(elapsed)
        self._stated = self._stated if now is None else now
        return elapsed

    def _usual(self) -> float:
        return float(np.median(self._passed)) if self._passed else 1.0

    def _extend(self, points: Reals) -> None:
        self._map.add(np.asarray(pga3.move_point(self._pose, points)))
        place = np.asarray(pga3.move_point(self._pose, np.zeros(3)))
        self._map.keep_near(place, self._max_range)

    def _predicted(self, elapsed: float) -> _Prediction:
        """Return the pose that the motion before leads to.

        A velocity holds for the usual time between scans; after it, the lidar may stop or be twice as fast.
        """
        usual = self._usual()
        motor = np.asarray(motor_graphs.moved_motor(self._pose, elapsed * self._velocity))
        late = max(elapsed - usual, 0.0) * self._velocity
        longer = max(elapsed / usual, 1.0) ** 2
        variances = np.maximum(self._spread * (elapsed / usual) ** 2, self._floor()) + late**2
        # As the velocity is unknown after a motion that is not measured, errors add up.
        unmeasured = (2 * self._unknown + 1) * (_WIDE**2 * longer + late**2)
        return _Prediction(motor, variances, late, unmeasured)

    def _floor(self) -> Reals:
        """Return the variances of the noise of a motion."""
        return np.asarray(np.repeat([self._noise / self._voxel, self._noise], 3) ** 2)

    def _move(self, points: Reals, elapsed: float) -> MappingStatus:
        before, predicted = self._pose, self._predicted(elapsed)
        if len(points) < _FEWEST:
            status, pose, spread = MappingStatus.TOO_FEW_READINGS, predicted.motor, np.diag(predicted.unmeasured)
        else:
            status, pose, spread = self._aligned(thinned(points, self._voxel * _COARSE), predicted)
        step = pga3.motor_product(pga3.motor_inverse(before), pose)
        _, by_last, by_next = motor_graphs.relative_motion(IDENTITY, step, step)
        back = np.linalg.inv(by_next)
        self._covariance = np.asarray(back @ (by_last @ self._covariance @ by_last.T + spread) @ back.T)
        self._pose = np.asarray(pga3.normalize_motor(pose))
        self._unknown = 0 if status == MappingStatus.OK else self._unknown + 1
        if status in (MappingStatus.OK, MappingStatus.DEGENERATE):
            # The mean over the usual time: that over a shorter one would be noise.
            change = np.asarray(motor_graphs.twist_of_motor(step)) - elapsed * self._velocity
            self._velocity = self._velocity + change / max(elapsed, self._usual())
            self._known = self._pose
            self._extend(points)
        if status == MappingStatus.OK:
            error = np.asarray(motor_graphs.difference_of_motors(pose, predicted.motor)[0])
            self._learn(error**2 * self._spread / predicted.variances)
        return status

    def _learn(self, squares: Reals) -> None:
        """Average squared errors of predictions over the usual time; the first one, without a velocity, says nothing of
        the others."""
        self._n_errors += 1
        if self._n_errors == 1:
            self._spread = (_WIDE / 4) ** 2
            return
        part = 1 / min(self._n_errors, _LEARNT)
        self._spread = np.maximum((1 - part) * self._spread + part * squares, self._floor())

    def _aligned(self, points: Reals, predicted: _Prediction) -> tuple[MappingStatus, Reals, Reals]:
        """Return the status of a scan, its pose, and the covariance of its motion."""
        found = self._descended(points, predicted.motor, predicted)
        turned = np.linalg.norm(predicted.late[:3]) * np.sqrt((points**2).sum(1).mean())
        is_late = np.linalg.norm(predicted.late[3:]) + turned > self._voxel / 2
        if self._unknown or not self._n_errors or is_late or not _agrees(found, points):
            # The prediction may be off by more than planes are looked for.
            steps = np.outer(_SLIDES * self._voxel, found.loosest)
            starts = [np.asarray(motor_graphs.moved_motor(found.pose, step)) for step in steps]
            starts.append(self._known)
            found = max([found, *(self._descended(points, start, predicted) for start in starts)], key=_explained)
        if not _agrees(found, points):
            return MappingStatus.NOT_MATCHED, predicted.motor, np.diag(predicted.unmeasured)
        _, weight, squares, _ = found.numbers
        # The mean of a cell is as noisy as a reading, at most.
        variance = max(2 * self._noise**2, float(squares / weight))
        covariance = np.linalg.inv(found.matrix / variance + found.prior)
        for direction in found.loose:
            covariance += np.outer(direction, direction) * predicted.unmeasured[3:].max()
        return MappingStatus.DEGENERATE if len(found.loose) else MappingStatus.OK, found.pose, covariance

    def _descended(self, points: Reals, start: Reals, predicted: _Prediction) -> _Descent:
        """Return the pose after Gauss-Newton steps from a start, with the prediction as a prior."""
        allowed = np.minimum(predicted.variances * 4.0 ** min(self._unknown, _LEARNT), predicted.unmeasured)
        pose, prior = start, np.diag(1 / allowed)
        variance, scale, least = 2 * self._noise**2, self._voxel, 3 * self._noise
        # Angles count by the size of the scene, which makes the coordinates comparable.
        unit = np.repeat([1 / np.sqrt((points**2).sum(1).mean()), 1.0], 3)
        for _ in range(_STEPS):
            rows = self._map.nearest(np.asarray(pga3.move_point(pose, points)))
            triangle, gradient, numbers = kernels.sums_at_planes(pose, points, rows, self._map.surfaces, scale)
            matrix = from_triangle(np.asarray(triangle), 6)
            values, vectors = np.linalg.eigh(matrix * np.outer(unit, unit))
            is_loose = values < _TILTED * numbers[3]
            # What tilts of normals by chance say is left out.
            kept = vectors[:, ~is_loose]
            project = (kept @ kept.T) * np.outer(1 / unit, unit)
            matrix = project @ matrix @ project.T
            off = np.asarray(motor_graphs.difference_of_motors(pose, predicted.motor)[0])
            change = -np.linalg.solve(matrix / variance + prior, project @ gradient / variance + prior @ off)
            pose = np.asarray(motor_graphs.moved_motor(pose, change))
            if scale == least and np.abs(change).max() < SETTLED:
                break
            scale = max(scale / 2, least)
        return _Descent(
            pose, matrix, prior, np.asarray(numbers), (vectors[:, is_loose] * unit[:, None]).T, vectors[:, 0] * unit
        )
