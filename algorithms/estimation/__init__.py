"""Kalman filters, filters for rotors and motors, calibration of moving cameras, and visual tracking."""

from .motor_filter import LinearMotorFilter, MotorFilter, Observability, filter_lines, observability
from .orientation import Orientation, OrientationSettings, estimate_orientation, orientation
from .status import EstimationStatus

__all__ = [
    "EstimationStatus",
    "LinearMotorFilter",
    "MotorFilter",
    "Observability",
    "Orientation",
    "OrientationSettings",
    "estimate_orientation",
    "filter_lines",
    "observability",
    "orientation",
]
