"""Localisation in a map of lines: a filter for the pose of a robot, as a motor with a covariance."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import navigation as kernels
from generated import pga2

from ..arguments import Reals, finite, real_array
from ..estimation.matrices import as_definite
from ..evidence.status import RARE
from ..evidence.triangles import from_triangle, to_triangle
from ..precision import HUGE
from . import cells, relocation
from .motions import relative
from .navigation_status import LocalizationStatus
from .scan import Scan
from .segments import segments
from .status import MappingStatus

_UNDETERMINED = 1e-4
"""A direction is undetermined if its information is below this share of that of the best: parallel walls seem to differ
by up to half a degree."""
_LEAST = np.array([np.radians(0.5), 0.03, 0.03]) ** 2
"""Variances that are added to those of a pose that was found without a prediction."""


class Lines(cells.Lines, Protocol):
    """Lines of a map: `Segments`, or the lines of a `LineMap`."""

    @property
    def covariances(self) -> Reals:
        """(k, 2, 2) Of angle and offset."""


class Found(NamedTuple):
    """A pose that was found without a prediction."""

    motor: Reals
    covariance: Reals
    """(3, 3) Of the twist in the frame of the robot."""


Relocate = Callable[[Scan, Lines], Found | None]
"""Function from a scan and a map to the pose, or None if it is not known or ambiguous."""


def relocated(scan: Scan, lines: Lines) -> Found | None:
    """Find a pose without a prediction by `relocation.relocate`; None if it is not found, or ambiguous."""
    found = relocation.relocate(scan, lines)
    if found.status != MappingStatus.OK or not np.isfinite(found.covariance).all():
        return None
    angle = float(pga2.motor_to_angle_translation(found.motor)[0])
    cosine, sine = np.cos(angle), np.sin(angle)
    # From x, y and the angle in the map to the angle and the translation in the frame of the robot.
    turn = np.array([[0.0, 0.0, 1.0], [cosine, sine, 0.0], [-sine, cosine, 0.0]])
    return Found(found.motor, turn @ found.covariance @ turn.T + np.diag(_LEAST))


class Association(NamedTuple):
    """Measured lines and lines of a map that agree."""

    measured: Reals
    """(k,) Rows of measured lines."""
    rows: Reals
    """(k,) Rows of lines of the map."""
    ambiguous: Reals
    """(m,) bool. Measured lines that agree with two different lines of the map; they are not used."""


@dataclass(frozen=True, slots=True)
class LocalizationSettings:
    """Settings of `LineLocalizer`."""

    gate: float = 13.8
    """Lines are associated if their squared innovation, divided by its covariance, is at most this: 99.9 % of them."""
    margin: float = 0.3
    """The middle of a measured segment may be beyond an end of the map's segment by this length, in metres."""
    one_sided: bool = True
    """Whether lines of the map are seen only from the side from which their normals point away, as walls are."""
    map_deviation: float = 0.0
    """The standard deviation of lines of the map in addition to their covariances, in metres."""
    line_deviation: float = 0.0025
    """The standard deviation of the ends of measured segments, in metres, in addition to the covariances of their
    lines: of points that do not belong to the wall, such as those next to corners."""
    tolerance: float = 0.06
    """The largest distance of points from the chord of their segment, in metres; at least five times the noise."""
    min_length: float = 0.3
    min_points: int = 10
    """The fewest points of a segment: from fewer, its noise is not known well enough."""
    window: int = 5
    """The number of scans that decide whether the robot is lost."""
    least_share: float = 0.35
    """The robot is lost if less than this share of the measured length agrees with the map over the window."""


class LineLocalizer:
    """Error-state Kalman filter for the pose M of a robot in a map of lines.

    The true pose is ``M exp(-x/2)`` with the twist x in the frame of the robot: the angle, and the translation ahead
    and to the left. Covariances are those of x. Odometry predicts, lines of scans update; each line is associated with
    the line of the map of the smallest innovation, and left out if two lines of the map agree with it. Methods return
    the status.

    Parameters
    ----------
    lines : Lines
        The map, for example `Segments` in its coordinates.
    motor : array_like, (4,)
        Pose as a motor of `generated.pga2`, from the frame of the robot to that of the map.
    covariance : array_like, (3, 3) or (3,)
        Of its error, or the diagonal.
    settings : LocalizationSettings, optional
    relocate : callable, optional
        Function that finds the pose if the robot is lost, such as `relocated`.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or is not finite.
    """

    def __init__(
        self,
        lines: Lines,
        motor: ArrayLike,
        covariance: ArrayLike,
        settings: LocalizationSettings | None = None,
        relocate: Relocate | None = None,
    ) -> None:
        self._lines = lines
        self._settings = settings or LocalizationSettings()
        self._relocate = relocate
        self._model = np.concatenate([lines.normals, -lines.offsets[:, None]], 1)
        own = lines.covariances.copy()
        own[:, 1, 1] += self._settings.map_deviation**2
        self._spread = to_triangle(own)
        along = np.stack([lines.normals[:, 1], -lines.normals[:, 0]], 1)
        position = np.einsum("kij,kj->ki", lines.ends, along)
        self._extent = np.sort(position, axis=1)
        self._motor = _unit_motor(motor)
        self._covariance = as_definite(_matrix(covariance, "covariance"))[0]
        self._information = np.zeros((3, 3))
        self._status = LocalizationStatus.UNOBSERVED
        self._innovation = (0.0, 0)
        self._association = _none(0)
        self._recent: deque[tuple[float, float]] = deque(maxlen=self._settings.window)

    @property
    def motor(self) -> Reals:
        """(4,) The estimate."""
        return self._motor

    @property
    def covariance(self) -> Reals:
        """(3, 3) The covariance of the error of the motor in the frame of the robot."""
        return self._covariance

    @property
    def status(self) -> LocalizationStatus:
        """The status of the last call."""
        return self._status

    @property
    def innovation(self) -> tuple[float, int]:
        """The squared innovation of the last update, divided by its covariance, and its degrees of freedom."""
        return self._innovation

    @property
    def association(self) -> Association:
        """The lines that the last update used."""
        return self._association

    def move(self, motion: ArrayLike, covariance: ArrayLike) -> LocalizationStatus:
        """Predict the pose after a motion D in the frame of the robot, ``M D``, with the covariance of its error.

        Parameters
        ----------
        motion : array_like, (4,)
            Motor of `generated.pga2`. If it is not finite, nothing changes.
        covariance : array_like, (3, 3) or (3,)
            Or its diagonal.

        Raises
        ------
        TypeError, ValueError
            If an argument has another shape or type.
        """
        step = real_array(motion, "motion", (4,), "a motor").astype(float)
        given = real_array(covariance, "covariance")
        if not (np.isfinite(step).all() and np.isfinite(given).all()):
            self._status = LocalizationStatus.NOT_FINITE
            return self._status
        spread = as_definite(_matrix(given, "covariance"))[0]
        motor, triangle = kernels.predict_pose(self._motor, to_triangle(self._covariance), step, to_triangle(spread))
        self._motor, self._covariance = np.asarray(motor), from_triangle(triangle, 3)
        turning = np.asarray(pga2.motor_to_adjoint(pga2.motor_inverse(step)))
        self._information = _moved(turning, self._information)
        self._status = self._observed()
        return self._status

    def update(self, scan: Scan) -> LocalizationStatus:
        """Update the pose by the lines of a scan, and find it again by `relocate` if the robot is lost."""
        own = self._settings
        measured = segments(scan, tolerance=own.tolerance, min_length=own.min_length, min_points=own.min_points)
        status = self.update_lines(measured)
        if status == LocalizationStatus.LOST and self._relocate is not None:
            found = self._relocate(scan, self._lines)
            if found is not None:
                self._motor = _unit_motor(found.motor)
                self._covariance = as_definite(_matrix(found.covariance, "covariance"))[0]
                self._recent.clear()
                self._information = np.linalg.pinv(self._covariance)
                self._status = LocalizationStatus.RELOCATED
        return self._status

    def update_lines(self, measured: Lines) -> LocalizationStatus:
        """Update the pose by measured lines in the frame of the robot."""
        pairs = self._association = self.associate(measured)
        lengths = np.linalg.norm(measured.ends[:, 1] - measured.ends[:, 0], axis=1)
        agrees = np.zeros(len(lengths), bool)
        agrees[pairs.measured] = True
        lost = self._is_lost(float(lengths[agrees | pairs.ambiguous].sum()), float(np.nansum(lengths)))
        self._innovation = (0.0, 0)
        if not len(pairs.rows):
            self._status = LocalizationStatus.LOST if lost else LocalizationStatus.PREDICTED
            return self._status
        seen = _coefficients(measured)[pairs.measured]
        noise = to_triangle(self._enlarged(measured))[pairs.measured]
        motor, triangle, numbers = kernels.update_pose(
            self._motor, to_triangle(self._covariance), self._model[pairs.rows], self._spread[pairs.rows], seen, noise,
            HUGE,
        )  # fmt: skip
        if not (np.isfinite(motor).all() and np.isfinite(triangle).all() and numbers[1] > 0):
            self._status = LocalizationStatus.LOST if lost else LocalizationStatus.PREDICTED
            return self._status
        self._motor, self._covariance = np.asarray(motor), from_triangle(triangle, 3)
        used = int(numbers[1])
        self._innovation = (float(numbers[0]), 2 * used)
        self._information += _information(seen, noise)
        if lost:
            self._status = LocalizationStatus.LOST
        elif self._innovation[0] > scipy.special.chdtri(2 * used, RARE):
            self._status = LocalizationStatus.INCONSISTENT
        else:
            self._status = self._observed()
        return self._status

    def associate(self, measured: Lines) -> Association:
        """Return the lines of the map with which measured lines agree at the current pose."""
        n = len(measured.offsets)
        if not n or not len(self._model):
            return _none(n)
        seen, noise = _coefficients(measured), to_triangle(self._enlarged(measured))
        own = self._settings
        rows, best, following = kernels.associate_line(
            self._motor, to_triangle(self._covariance), seen, noise, measured.ends[:, 0], measured.ends[:, 1],
            self._model, self._spread, self._extent, own.margin, float(own.one_sided),
        )  # fmt: skip
        near = (rows >= 0) & (best <= own.gate)
        # Pieces of the same wall are several lines of the map with equal innovations.
        ambiguous = near & (following <= own.gate) & (following > best + 1e-3)
        ambiguous &= following < best + 6.0
        chosen = np.flatnonzero(near & ~ambiguous)
        return Association(chosen, np.asarray(rows)[chosen].astype(int), ambiguous)

    def _enlarged(self, measured: Lines) -> Reals:
        """Return the covariances of measured lines whose ends have further independent errors."""
        variance = self._settings.line_deviation**2
        along = np.stack([-measured.normals[:, 1], measured.normals[:, 0]], 1)
        first, last = np.einsum("kij,kj->ik", measured.ends, along)
        length = np.maximum(np.abs(last - first), 1e-6)
        lever = (first + last) / 2
        found = measured.covariances.copy()
        angle = 2 * variance / length**2
        found[:, 0, 0] += angle
        found[:, 0, 1] += lever * angle
        found[:, 1, 0] += lever * angle
        found[:, 1, 1] += variance / 2 + lever**2 * angle
        return found

    def _is_lost(self, agreeing: float, measured: float) -> bool:
        self._recent.append((agreeing, measured))
        totals = np.sum(self._recent, axis=0)
        full = len(self._recent) == self._settings.window
        return bool(full and totals[1] > 0 and totals[0] < self._settings.least_share * totals[1])

    def _observed(self) -> LocalizationStatus:
        whole = self._information
        if not whole[0, 0] > 0:
            return LocalizationStatus.UNOBSERVED
        # Of the translation, for any angle.
        translation = whole[1:, 1:] - np.outer(whole[1:, 0], whole[0, 1:]) / whole[0, 0]
        low, high = np.linalg.eigvalsh(translation)
        return LocalizationStatus.OK if low > _UNDETERMINED * high else LocalizationStatus.UNOBSERVED


def normalized_error(motor: ArrayLike, covariance: ArrayLike, truth: ArrayLike) -> Reals:
    """Return squared errors of poses divided by their covariances, chi-square distributed with 3 degrees of freedom.

    Parameters
    ----------
    motor, truth : array_like, (..., 4)
    covariance : array_like, (..., 3, 3)
        Of errors in the frame of the robot.
    """
    one, other = (real_array(x, name, (4,), "a motor") for x, name in ((motor, "motor"), (truth, "truth")))
    spread = real_array(covariance, "covariance", (3, 3))
    turn, shift = pga2.twist_to_velocities(pga2.motor_to_twist(relative(one, other)))
    error = np.concatenate([np.asarray(turn)[..., None], shift], -1)
    return np.asarray((error * np.linalg.solve(spread, error[..., None])[..., 0]).sum(-1))


def _coefficients(lines: Lines) -> Reals:
    return np.concatenate([lines.normals, -lines.offsets[:, None]], 1)


def _information(seen: Reals, noise: Reals) -> Reals:
    """Return the information about the pose in measured lines, an inverse covariance."""
    rows = np.zeros((len(seen), 2, 3))
    rows[:, 0, 0] = 1
    rows[:, 1, 1:] = seen[:, :2]
    weights = np.linalg.inv(from_triangle(noise, 2))
    return np.asarray(np.einsum("kia,kij,kjb->ab", rows, weights, rows))


def _moved(turning: Reals, information: Reals) -> Reals:
    """Return the information of twists after a motion, for its matrix on the coefficients e12 e20 e01."""
    # A twist (w, v) has the coefficients w, -v[1], v[0].
    order = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    matrix = order.T @ turning @ order
    back = np.linalg.inv(matrix)
    return np.asarray(back.T @ information @ back)


def _none(n: int) -> Association:
    return Association(np.zeros(0, int), np.zeros(0, int), np.zeros(n, bool))


def _unit_motor(value: ArrayLike) -> Reals:
    motor = finite(real_array(value, "motor", (4,), "a motor").astype(float), "motor")
    if motor.ndim != 1 or abs(np.hypot(motor[0], motor[1]) - 1) > 1e-3:
        raise ValueError(f"motor: {motor}; expected (4,), one unit motor of generated.pga2")
    return np.asarray(pga2.normalize_motor(motor))


def _matrix(value: ArrayLike, name: str) -> Reals:
    array = finite(real_array(value, name).astype(float), name)
    if array.ndim < 2:
        array = np.diag(np.broadcast_to(array, (3,)))
    if array.shape != (3, 3):
        raise ValueError(f"{name}: shape {array.shape}; expected (3, 3), (3,) or a number")
    return array
