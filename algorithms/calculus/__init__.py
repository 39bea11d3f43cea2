"""Geometric calculus in numbers: linear functions, integrals over meshes, electromagnetic fields, spinors."""

from .grids import grid_derivative
from .integrals import cauchy_integral, circulation, directed_integral, flux, integral
from .linear_functions import Inverse, LinearFunction, LinearStatus
from .maxwell import field_seen_by, plane_wave, stress_energy
from .meshes import SimplicialMesh, box_mesh
from .plane import cauchy_in_plane, residues_in_plane
from .products import embed, product_of
from .quadrature import simplex_rule
from .spectra import Eigenblades, Polar, SkewPlanes, eigenblades, polar, skew_planes, symmetric_spectrum
from .spinors import dirac_columns, dirac_spinors, free_dirac, precess
from .yee import Fields, YeeBox

__all__ = [
    "Eigenblades",
    "Fields",
    "Inverse",
    "LinearFunction",
    "LinearStatus",
    "Polar",
    "SimplicialMesh",
    "SkewPlanes",
    "YeeBox",
    "box_mesh",
    "cauchy_in_plane",
    "cauchy_integral",
    "circulation",
    "dirac_columns",
    "dirac_spinors",
    "directed_integral",
    "eigenblades",
    "embed",
    "field_seen_by",
    "flux",
    "free_dirac",
    "grid_derivative",
    "integral",
    "plane_wave",
    "polar",
    "precess",
    "product_of",
    "residues_in_plane",
    "simplex_rule",
    "skew_planes",
    "stress_energy",
    "symmetric_spectrum",
]
