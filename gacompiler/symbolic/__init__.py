"""Multivectors with sympy coefficients, for deriving formulas and compiling them.

>>> from gacompiler.algebra.catalog import VGA3
>>> from gacompiler.symbolic import symbols
>>> a, b = symbols("a b", layout=VGA3.VECTOR)
>>> a ^ b
VGA3: (a_e1*b_e2 - a_e2*b_e1)*e12 + (a_e1*b_e3 - a_e3*b_e1)*e13 + (a_e2*b_e3 - a_e3*b_e2)*e23
"""

from typing import TYPE_CHECKING

from . import functions
from .construct import multivector as multivector
from .construct import symbols as symbols
from .construct import unknowns as unknowns
from .conversion import DerivedProgram as DerivedProgram
from .conversion import from_kernel as from_kernel
from .conversion import program_of as program_of
from .conversion import to_kernel as to_kernel
from .functions import *  # noqa: F403
from .multivector import SymbolicMultivector as SymbolicMultivector
from .relations import equal as equal
from .relations import reduce as reduce
from .relations import relations as relations
from .solve import solve as solve

if not TYPE_CHECKING:
    # Type checkers cannot evaluate a computed list; for them, `as` and `*` above declare the exported names.
    __all__ = sorted([
        "DerivedProgram", "SymbolicMultivector", "equal", "from_kernel", "multivector", "program_of", "reduce",
        "relations", "solve", "symbols", "to_kernel", "unknowns", *functions.__all__,
    ])  # fmt: skip
