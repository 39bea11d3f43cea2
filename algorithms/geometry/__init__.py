"""Geometry of points, lines, planes, circles and spheres: distances, angles, intersections, projections, fits."""

from .circles import NearestOnCircles, nearest_on_circles
from .fit_evidence import FitStatus
from .fits import Fit, fit_circle, fit_line, fit_plane, fit_sphere
from .kinds import KINDS
from .meshes import MeshHit, hit_mesh
from .pairs import Meet, angle, distance, meet, project
from .round_fits import ConeFit, CylinderFit, fit_cone, fit_cylinder
from .stereographic import inverse_stereographic_projection, stereographic_projection
from .surfaces import (
    cone,
    cone_over,
    conic,
    conic_type,
    conoid,
    cycloidal_curve,
    ellipsoid,
    helicoid,
    hyperboloid,
    sphere_cone_curve,
)
from .versors import similarity_between, versor_between

__all__ = [
    "KINDS",
    "ConeFit",
    "CylinderFit",
    "Fit",
    "FitStatus",
    "Meet",
    "MeshHit",
    "NearestOnCircles",
    "angle",
    "cone",
    "cone_over",
    "conic",
    "conic_type",
    "conoid",
    "cycloidal_curve",
    "distance",
    "ellipsoid",
    "fit_circle",
    "fit_cone",
    "fit_cylinder",
    "fit_line",
    "fit_plane",
    "fit_sphere",
    "helicoid",
    "hit_mesh",
    "hyperboloid",
    "inverse_stereographic_projection",
    "meet",
    "nearest_on_circles",
    "project",
    "similarity_between",
    "sphere_cone_curve",
    "stereographic_projection",
    "versor_between",
]
