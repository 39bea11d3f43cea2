"""The public names of `gacompiler` for definitions, which it loads from here when one of them is first used."""

from typing import TYPE_CHECKING

from . import frontend
from .algebra.algebra import Algebra as Algebra
from .algebra.layout import SCALAR as SCALAR
from .algebra.layout import Layout as Layout
from .algebra.multivector import Multivector as Multivector
from .derivatives import hessian_vector as hessian_vector
from .derivatives import jacobian as jacobian
from .derivatives import jvp as jvp
from .derivatives import matrix_of as matrix_of
from .derivatives import vjp as vjp
from .frontend.eigen import eigenvalues_symmetric as eigenvalues_symmetric
from .frontend.eigen import eigenvectors_symmetric as eigenvectors_symmetric
from .frontend.equations import inverse_matrix as inverse_matrix
from .frontend.equations import matrix_determinant as matrix_determinant
from .frontend.equations import solve_linear as solve_linear
from .frontend.equations import solve_symmetric as solve_symmetric
from .frontend.family import Family as Family
from .frontend.functions import even_part as even_part
from .frontend.functions import exp as exp
from .frontend.functions import interpolate as interpolate
from .frontend.functions import log as log
from .frontend.functions import odd_part as odd_part
from .frontend.functions import outer_cos as outer_cos
from .frontend.functions import outer_exp as outer_exp
from .frontend.functions import outer_sin as outer_sin
from .frontend.functions import outer_tan as outer_tan
from .frontend.functions import power as power
from .frontend.functions import sqrt as sqrt
from .frontend.kernel import Kernel as Kernel
from .frontend.kernel import array as array
from .frontend.kernel import index as index
from .frontend.kernel import kernel as kernel
from .frontend.loops import accumulate as accumulate
from .frontend.loops import each as each
from .frontend.loops import fold as fold
from .frontend.loops import gather as gather
from .frontend.loops import iterate as iterate
from .frontend.loops import scan as scan
from .frontend.loops import scatter as scatter
from .frontend.loops import total as total
from .frontend.loops import transpose as transpose
from .frontend.operations import *  # noqa: F403
from .frontend.random_numbers import random_integer as random_integer
from .frontend.random_numbers import uniform as uniform
from .frontend.roots import cubic_roots as cubic_roots
from .frontend.roots import quadratic_roots as quadratic_roots
from .frontend.roots import quartic_roots as quartic_roots
from .frontend.searches import all_rows as all_rows
from .frontend.searches import any_row as any_row
from .frontend.searches import count_rows as count_rows
from .frontend.searches import first_row as first_row
from .frontend.searches import least as least
from .frontend.searches import pick as pick
from .frontend.searches import row_numbers as row_numbers
from .frontend.waves import cos as cos
from .frontend.waves import cosh as cosh
from .frontend.waves import sin as sin
from .frontend.waves import sinh as sinh
from .frontend.waves import tan as tan
from .frontend.waves import tanh as tanh
from .frontend.windows import window as window

if not TYPE_CHECKING:
    # Type checkers cannot read a computed list; for them, `as` and `*` above declare what is exported.
    __all__ = sorted([
        "Algebra", "Cl", "Family", "Kernel", "Layout", "Multivector", "SCALAR", "Space", "accumulate", "all_rows",
        "any_row", "array", "compile", "cos", "cosh", "count_rows", "cubic_roots", "each", "eigenvalues_symmetric",
        "eigenvectors_symmetric", "even_part", "exp", "first_row", "fold", "gather", "hessian_vector", "index",
        "interpolate", "inverse_matrix", "iterate", "jacobian", "jvp", "kernel", "least", "log",
        "matrix_determinant", "matrix_of", "odd_part", "outer_cos", "outer_exp", "outer_sin", "outer_tan", "pick",
        "power", "quadratic_roots", "quartic_roots", "random_integer", "read_cluscript", "robots", "row_numbers",
        "scan", "scatter", "sin", "sinh", "solve_linear", "solve_symmetric", "sqrt", "tan", "tanh", "total",
        "transpose", "uniform", "vjp", "window",
        *frontend.operations.__all__,
    ])  # fmt: skip
