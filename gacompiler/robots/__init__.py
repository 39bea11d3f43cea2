"""Kinematics and dynamics of one robot as expressions, for specs of robots with their constants folded."""

from .chains import Chain, signed
from .dynamics import energies, inverse_dynamics, lagrange_equations, mass_matrix
from .inertias import regrouped
from .kinematics import forward, jacobian, row_motor

__all__ = [
    "Chain",
    "energies",
    "forward",
    "inverse_dynamics",
    "jacobian",
    "lagrange_equations",
    "mass_matrix",
    "regrouped",
    "row_motor",
    "signed",
]
