"""Geometric calculus with symbolic multivectors: coordinates and fields, multivector derivatives, linear functions.

>>> from gacompiler.algebra.catalog import VGA3
>>> from gacompiler.calculus import cartesian
>>> space = cartesian(VGA3, "x y z")
>>> x, y, z = space.parameters
>>> space.derivative(x * y)
VGA3: y*e1 + x*e2
"""

from .coordinates import Chart
from .derivatives import derivative_by, differential
from .kernels import geodesic, geodesic_rates
from .linear import LinearFunction, linear_function
from .operators import FieldOperator
from .spinors import dirac_column, dirac_matrices, dirac_spinor, pauli_column, pauli_matrices, pauli_spinor
from .standard import cartesian, cylindrical, spherical

__all__ = [
    "Chart", "FieldOperator", "LinearFunction", "cartesian", "cylindrical", "derivative_by", "differential",
    "dirac_column", "dirac_matrices", "dirac_spinor", "geodesic", "geodesic_rates", "linear_function", "pauli_column",
    "pauli_matrices", "pauli_spinor", "spherical",
]  # fmt: skip
