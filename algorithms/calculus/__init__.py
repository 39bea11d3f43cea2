"""Numerical geometric calculus: linear functions, integrals over meshes, electromagnetic fields, spinors."""

from .frames import ReciprocalFrame, reciprocal_frame
from .functions import FUNCTIONS, multivector_function
from .grids import grid_derivative
from .integrals import cauchy_integral, circulation, directed_integral, flux, integral
from .linear_functions import Inverse, LinearFunction, LinearStatus
from .maxwell import field_seen_by, plane_wave, stress_energy
from .meshes import SimplicialMesh, box_mesh
from .plane import cauchy_in_plane, residues_in_plane
from .products import embed, product_of
from .quadrature import simplex_rule
from .simplexes import Facets, barycentric_coordinates, facets
from .spectra import Eigenblades, Polar, SkewPlanes, eigenblades, polar, skew_planes, symmetric_spectrum
from .spinors import dirac_columns, dirac_spinors, free_dirac, precess
from .yee import Fields, YeeBox

__all__ = [
    "FUNCTIONS",
    "Eigenblades",
    "Facets",
    "Fields",
    "Inverse",
    "LinearFunction",
    "LinearStatus",
    "Polar",
    "ReciprocalFrame",
    "SimplicialMesh",
    "SkewPlanes",
    "YeeBox",
    "barycentric_coordinates",
    "box_mesh",
    "cauchy_in_plane",
    "cauchy_integral",
    "circulation",
    "dirac_columns",
    "dirac_spinors",
    "directed_integral",
    "eigenblades",
    "embed",
    "facets",
    "field_seen_by",
    "flux",
    "free_dirac",
    "grid_derivative",
    "integral",
    "multivector_function",
    "plane_wave",
    "polar",
    "precess",
    "product_of",
    "reciprocal_frame",
    "residues_in_plane",
    "simplex_rule",
    "skew_planes",
    "stress_energy",
    "symmetric_spectrum",
]
