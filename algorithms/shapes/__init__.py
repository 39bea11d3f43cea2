"""Contours, surfaces, segments of volumes, and models of spheres."""

from .contour_status import ContourStatus
from .contours import Contour, adapted, contour, trace_contour
from .flow import gradient_vector_flow, streamline_samples
from .segmentation import segment
from .surface_status import SurfaceStatus
from .surfaces import Surface, surface

__all__ = [
    "Contour",
    "ContourStatus",
    "Surface",
    "SurfaceStatus",
    "adapted",
    "contour",
    "gradient_vector_flow",
    "segment",
    "streamline_samples",
    "surface",
    "trace_contour",
]
