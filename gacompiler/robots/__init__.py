"""Kinematics and dynamics of one robot as expressions, for specs of robots with folded constants."""

import warnings
from typing import Any

from .chains import Chain, signed
from .dynamics import (
    centre_of_mass,
    centroidal_momentum_matrix,
    coriolis,
    coriolis_matrix,
    forward_dynamics,
    gravity,
    inverse_dynamics,
    inverse_dynamics_derivatives,
    kinetic_energy,
    mass_matrix,
    potential_energy,
)
from .formulas import lagrange_equations, row_motor
from .inertias import base_parameters
from .inverse import elbow_circle, spherical_wrist, three_parallel_axes
from .kinematics import forward, forward_all, jacobian, jacobian_rate

__all__ = [
    "Chain",
    "base_parameters",
    "centre_of_mass",
    "centroidal_momentum_matrix",
    "coriolis",
    "coriolis_matrix",
    "elbow_circle",
    "forward",
    "forward_all",
    "forward_dynamics",
    "gravity",
    "inverse_dynamics",
    "inverse_dynamics_derivatives",
    "jacobian",
    "jacobian_rate",
    "kinetic_energy",
    "lagrange_equations",
    "mass_matrix",
    "potential_energy",
    "row_motor",
    "signed",
    "spherical_wrist",
    "three_parallel_axes",
]


def __getattr__(name: str) -> Any:
    if name == "regrouped":
        message = "gacompiler.robots.regrouped is now base_parameters; the old name will be removed in version 0.3"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return base_parameters
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
