"""Contours, surfaces, segments of volumes, and models of spheres."""

from .marching_cubes import CubeMesh, marching_cubes
from .marching_spheres import MarchedModel, march, marching_spheres
from .maximal_balls import BallModel, fit_balls, maximal_balls
from .rasterising import filled
from .sphere_matching import SphereRegistration, register_spheres
from .sphere_status import BallStatus, RegistrationStatus
from .union_of_spheres import union_of_spheres

__all__ = [
    "BallModel",
    "BallStatus",
    "CubeMesh",
    "MarchedModel",
    "RegistrationStatus",
    "SphereRegistration",
    "filled",
    "fit_balls",
    "march",
    "marching_cubes",
    "marching_spheres",
    "maximal_balls",
    "register_spheres",
    "union_of_spheres",
]
