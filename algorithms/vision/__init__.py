"""Cameras, two views and depth."""

from .calibrations import MOTORCYCLE
from .camera import Camera
from .stereo import RectifiedPair
from .two_views import epipolar_distance, epipolar_lines, fundamental_matrix, triangulate

__all__ = [
    "MOTORCYCLE",
    "Camera",
    "RectifiedPair",
    "epipolar_distance",
    "epipolar_lines",
    "fundamental_matrix",
    "triangulate",
]
