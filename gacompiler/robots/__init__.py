"""Kinematics and dynamics of one robot as expressions, for specs of robots with folded constants."""

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
from .inertias import regrouped
from .kinematics import forward, forward_all, jacobian, jacobian_rate

__all__ = [
    "Chain",
    "centre_of_mass",
    "centroidal_momentum_matrix",
    "coriolis",
    "coriolis_matrix",
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
    "regrouped",
    "row_motor",
    "signed",
]
