"""Cameras, two views and depth."""

from .calibrations import MOTORCYCLE
from .camera import Camera
from .hand_eye import HandEye, HandEyeStatus, hand_eye
from .stereo import RectifiedPair
from .two_views import epipolar_distance, epipolar_lines, fundamental_matrix, triangulate

__all__ = [
    "MOTORCYCLE",
    "Camera",
    "HandEye",
    "HandEyeStatus",
    "RectifiedPair",
    "epipolar_distance",
    "epipolar_lines",
    "fundamental_matrix",
    "hand_eye",
    "triangulate",
]
