"""Contours, surfaces, segments of volumes, and models of spheres."""

from .colour_segmentation import ColourSegment, segment_colour
from .colour_status import ColourStatus
from .contour_status import ContourStatus
from .contours import Contour, adapted, contour, trace_contour
from .flow import gradient_vector_flow, streamline_samples
from .gas_status import GasStatus
from .growing_gas import NeuralGas, neural_gas, neural_gas_of_image
from .marching_cubes import CubeMesh, marching_cubes
from .marching_spheres import MarchedModel, march, marching_spheres
from .maximal_balls import BallModel, fit_balls, maximal_balls
from .rasterising import filled
from .segment_status import SegmentStatus
from .segmentation import Segment, segment
from .sphere_matching import SphereRegistration, register_spheres
from .sphere_status import BallStatus, SphereMatchStatus
from .surface_status import SurfaceStatus
from .surfaces import Surface, surface
from .union_of_spheres import union_of_spheres
from .volume_warps import warp_volume

__all__ = [
    "BallModel",
    "BallStatus",
    "ColourSegment",
    "ColourStatus",
    "Contour",
    "ContourStatus",
    "CubeMesh",
    "GasStatus",
    "MarchedModel",
    "NeuralGas",
    "Segment",
    "SegmentStatus",
    "SphereMatchStatus",
    "SphereRegistration",
    "Surface",
    "SurfaceStatus",
    "adapted",
    "contour",
    "filled",
    "fit_balls",
    "gradient_vector_flow",
    "march",
    "marching_cubes",
    "marching_spheres",
    "maximal_balls",
    "neural_gas",
    "neural_gas_of_image",
    "register_spheres",
    "segment",
    "segment_colour",
    "streamline_samples",
    "surface",
    "trace_contour",
    "union_of_spheres",
    "warp_volume",
]
