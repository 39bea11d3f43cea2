"""Multivectors with sympy coefficients: derive a formula in a notebook, then compile it.

>>> from gacompiler.algebra.catalog import VGA3
>>> from gacompiler.symbolic import symbols
>>> a, b = symbols("a b", layout=VGA3.VECTOR)
>>> a ^ b
VGA3: (a_e1*b_e2 - a_e2*b_e1)*e12 + (a_e1*b_e3 - a_e3*b_e1)*e13 + (a_e2*b_e3 - a_e3*b_e2)*e23
"""

from .construct import multivector, symbols, unknowns
from .functions import (
    anticommutator,
    clifford_conjugate,
    commutator,
    determinant,
    dual,
    exp,
    geometric_product,
    grade,
    grade_involution,
    hestenes_product,
    inner_product,
    inverse,
    left_contraction,
    norm,
    norm_squared,
    normalize,
    outer_product,
    polarity,
    regressive_product,
    reverse,
    right_contraction,
    sandwich,
    scalar_product,
    undual,
)
from .kernels import DerivedProgram, from_kernel, program_of, to_kernel
from .multivector import SymbolicMultivector
from .relations import equal, reduce, relations
from .solve import solve

__all__ = [
    "DerivedProgram", "SymbolicMultivector", "anticommutator", "clifford_conjugate", "commutator", "determinant",
    "dual", "equal", "exp", "from_kernel", "geometric_product", "grade", "grade_involution", "hestenes_product",
    "inner_product", "inverse", "left_contraction", "multivector", "norm", "norm_squared", "normalize",
    "outer_product", "polarity", "program_of", "reduce", "regressive_product", "relations", "reverse",
    "right_contraction", "sandwich", "scalar_product", "solve", "symbols", "to_kernel", "undual", "unknowns",
]  # fmt: skip
