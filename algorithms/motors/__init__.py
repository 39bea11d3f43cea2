"""Motors from data: means, interpolation and splines, fits to points and directions, Euler angles."""

from .averages import MotorMean, average_motors, mean_motor
from .euler import (
    SEQUENCES,
    matrix_from_euler,
    matrix_to_euler,
    rotor_from_euler,
    rotor_to_euler,
)
from .interpolation import bezier, nlerp, sclerp, slerp
from .recovery import (
    MotorFit,
    RotorFit,
    SimilarityFit,
    motor_from_objects,
    motor_from_points,
    rotor_from_frames,
    rotor_from_vectors,
    similarity_from_points,
)
from .splines import MotorSpline

__all__ = [
    "SEQUENCES",
    "MotorFit",
    "MotorMean",
    "MotorSpline",
    "RotorFit",
    "SimilarityFit",
    "average_motors",
    "bezier",
    "matrix_from_euler",
    "matrix_to_euler",
    "mean_motor",
    "motor_from_objects",
    "motor_from_points",
    "nlerp",
    "rotor_from_euler",
    "rotor_from_frames",
    "rotor_from_vectors",
    "rotor_to_euler",
    "sclerp",
    "similarity_from_points",
    "slerp",
]
