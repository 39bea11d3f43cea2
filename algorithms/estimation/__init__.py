"""Kalman filters, filters for rotors and motors, calibration of moving cameras, and visual tracking."""

from .end_effector import EndEffectorTrack, track_end_effector
from .extended import ExtendedKalmanFilter
from .kalman import Filtered, KalmanFilter, Smoothed
from .motor_filter import LinearMotorFilter, MotorFilter, Observability, filter_lines, observability
from .orientation import Orientation, OrientationSettings, estimate_orientation, orientation
from .rotor_filter import LinearRotorFilter, RotorFilter
from .status import EstimationStatus

__all__ = [
    "EndEffectorTrack",
    "EstimationStatus",
    "ExtendedKalmanFilter",
    "Filtered",
    "KalmanFilter",
    "LinearMotorFilter",
    "LinearRotorFilter",
    "MotorFilter",
    "Observability",
    "Orientation",
    "OrientationSettings",
    "RotorFilter",
    "Smoothed",
    "estimate_orientation",
    "filter_lines",
    "observability",
    "orientation",
    "track_end_effector",
]
