"""Kalman filters, filters for rotors and motors, calibration of moving cameras, and visual tracking."""

from .extended import ExtendedKalmanFilter
from .kalman import Filtered, KalmanFilter, Smoothed
from .motor_filter import LinearMotorFilter, MotorFilter, Observability, filter_lines, observability
from .orientation import Orientation, OrientationSettings, estimate_orientation, orientation
from .status import EstimationStatus

__all__ = [
    "EstimationStatus",
    "ExtendedKalmanFilter",
    "Filtered",
    "KalmanFilter",
    "LinearMotorFilter",
    "MotorFilter",
    "Observability",
    "Orientation",
    "OrientationSettings",
    "Smoothed",
    "estimate_orientation",
    "filter_lines",
    "observability",
    "orientation",
]
