"""Poses by odometry, and their noise, which is learnt while scans are matched."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import ArrayLike

from generated import pga2

from ..arguments import Reals, real_array
from .motions import unit_motor

_REMEMBERED, _CAUTION, _LEAST_FACTOR = 40, 2.0, 0.1
"""The errors of odometry are judged by this number of motions; their standard deviations are multiplied by a factor for
caution, and are at least this share of what is assumed at first."""


class OdometryNoise:
    """How large the errors of odometry are, compared with what is assumed at first."""

    def __init__(self) -> None:
        self._ratios: deque[tuple[float, float]] = deque(maxlen=_REMEMBERED)
        self._factors = np.ones(3)

    def add(self, deviation: Reals, variances: Reals) -> None:
        """Take the difference of a matched motion and that by odometry: angle, x, y."""
        ratio = np.abs(deviation) / np.sqrt(variances)
        self._ratios.append((float(ratio[0]), float(np.hypot(*ratio[1:]))))
        if len(self._ratios) >= _REMEMBERED // 2:
            # Medians of the absolute values of one and of two normal errors.
            turn, shift = np.median(np.array(self._ratios), axis=0) / (0.67, 1.18)
            self._factors = np.clip(np.array([turn, shift, shift]) * _CAUTION, _LEAST_FACTOR, 1.0)

    def learnt(self, variances: Reals) -> Reals:
        """Return variances with what was learnt."""
        return np.asarray(variances * self._factors**2)


def pose_of(odometry: ArrayLike | None) -> Reals | None:
    """Return odometry as x, y and angle; None if it is not finite.

    Raises
    ------
    TypeError, ValueError
        If it is no array of three real numbers, or of the four of a unit motor.
    """
    if odometry is None:
        return None
    pose = real_array(odometry, "odometry").astype(float)
    if pose.shape not in ((3,), (4,)):
        raise ValueError(f"odometry: shape {pose.shape}; expected (3,), x, y and angle, or (4,), a motor")
    if not np.isfinite(pose).all():
        return None
    if pose.shape == (4,):
        angle, shift = pga2.motor_to_angle_translation(unit_motor(pose, "odometry"))
        pose = np.array([*shift, angle])
    return pose
