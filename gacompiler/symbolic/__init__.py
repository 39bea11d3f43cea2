"""Multivectors with sympy coefficients, for deriving formulas and compiling them.

>>> from gacompiler.algebra.catalog import VGA3
>>> from gacompiler.symbolic import symbols
>>> a, b = symbols("a b", layout=VGA3.VECTOR)
>>> a ^ b
VGA3: (a_e1*b_e2 - a_e2*b_e1)*e12 + (a_e1*b_e3 - a_e3*b_e1)*e13 + (a_e2*b_e3 - a_e3*b_e2)*e23
"""

from typing import TYPE_CHECKING

from ..frontend.functions import even_part as even_part
from ..frontend.functions import odd_part as odd_part
from ..frontend.functions import outer_cos as outer_cos
from ..frontend.functions import outer_exp as outer_exp
from ..frontend.functions import outer_sin as outer_sin
from ..frontend.functions import outer_tan as outer_tan
from . import functions
from .construct import multivector as multivector
from .construct import symbols as symbols
from .construct import unknowns as unknowns
from .conversion import DerivedProgram as DerivedProgram
from .conversion import from_kernel as from_kernel
from .conversion import program_of as program_of
from .conversion import to_kernel as to_kernel
from .factors import factorize_blade as factorize_blade
from .factors import factorize_versor as factorize_versor
from .functions import *  # noqa: F403
from .multivector import SymbolicMultivector as SymbolicMultivector
from .predicates import is_blade as is_blade
from .predicates import is_null as is_null
from .predicates import is_versor as is_versor
from .relations import equal as equal
from .relations import reduce as reduce
from .relations import relations as relations
from .solve import solve as solve
from .waves import cos as cos
from .waves import cosh as cosh
from .waves import sin as sin
from .waves import sinh as sinh
from .waves import tan as tan
from .waves import tanh as tanh

if not TYPE_CHECKING:
    # Type checkers cannot evaluate a computed list; for them, `as` and `*` above declare the exported names.
    __all__ = sorted([
        "DerivedProgram", "SymbolicMultivector", "cos", "cosh", "equal", "even_part", "factorize_blade",
        "factorize_versor", "from_kernel", "is_blade", "is_null", "is_versor", "multivector", "odd_part", "outer_cos",
        "outer_exp", "outer_sin", "outer_tan", "program_of", "reduce", "relations", "sin", "sinh", "solve", "symbols",
        "tan", "tanh", "to_kernel", "unknowns", *functions.__all__,
    ])  # fmt: skip
