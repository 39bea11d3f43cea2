"""Contours, surfaces, segments of volumes, and models of spheres."""

from .contour_status import ContourStatus
from .contours import Contour, adapted, contour, trace_contour
from .flow import gradient_vector_flow, streamline_samples
from .segmentation import segment

__all__ = [
    "Contour",
    "ContourStatus",
    "adapted",
    "contour",
    "gradient_vector_flow",
    "segment",
    "streamline_samples",
    "trace_contour",
]
