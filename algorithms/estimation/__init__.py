"""Filters for systems, rotors and motors, smoothing, calibration of moving cameras, clocks, and visual tracking."""

from .body_eye import BodyEye, body_eye
from .circles_of_points import BodyEyeStatus, JointAxis, stereo_information
from .clocks import ClockOffset, ClockStatus, clock_offset, poses_at
from .end_effector import EndEffectorTrack, track_end_effector
from .image_jacobians import Image, image_of_line, image_of_plane, image_of_point
from .inertial import InertialSum, preintegrate
from .joint_axes import joint_axis
from .kalman import Filtered, KalmanFilter, Smoothed
from .line_recordings import filter_lines
from .linear_motor_filter import LinearMotorFilter
from .motor_filter import MotorFilter
from .motor_graph import MotorGraph
from .motor_objects import Observability, observability
from .motor_problem import SmoothingStatus
from .motor_smoother import MotorSmoother
from .nonlinear import ExtendedKalmanFilter, UnscentedKalmanFilter
from .orientation import Orientation, estimate_orientation, orientation
from .orientation_filter import OrientationFilter
from .orientation_starts import OrientationSettings
from .pan_tilt import Aim, aim, calibrated_head, gaze_rates, pan_tilt_head
from .rotor_filter import LinearRotorFilter, RotorFilter
from .smoothing import SmoothedMotors, smooth_motors
from .status import EstimationStatus
from .tracking import ForceStep, Tracker, TrackingStatus, VelocityStep
from .tracking_simulation import Prediction, Recording, Sensor, simulate_tracking

__all__ = [
    "Aim",
    "BodyEye",
    "BodyEyeStatus",
    "ClockOffset",
    "ClockStatus",
    "EndEffectorTrack",
    "EstimationStatus",
    "ExtendedKalmanFilter",
    "Filtered",
    "ForceStep",
    "Image",
    "InertialSum",
    "JointAxis",
    "KalmanFilter",
    "LinearMotorFilter",
    "LinearRotorFilter",
    "MotorFilter",
    "MotorGraph",
    "MotorSmoother",
    "Observability",
    "Orientation",
    "OrientationFilter",
    "OrientationSettings",
    "Prediction",
    "Recording",
    "RotorFilter",
    "Sensor",
    "Smoothed",
    "SmoothedMotors",
    "SmoothingStatus",
    "Tracker",
    "TrackingStatus",
    "UnscentedKalmanFilter",
    "VelocityStep",
    "aim",
    "body_eye",
    "calibrated_head",
    "clock_offset",
    "estimate_orientation",
    "filter_lines",
    "gaze_rates",
    "image_of_line",
    "image_of_plane",
    "image_of_point",
    "joint_axis",
    "observability",
    "orientation",
    "pan_tilt_head",
    "poses_at",
    "preintegrate",
    "simulate_tracking",
    "smooth_motors",
    "stereo_information",
    "track_end_effector",
]
