"""A geometric-algebra compiler: multivector definitions in, specialised and proved kernels out."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import robots
from .algebra.algebra import Algebra
from .algebra.layout import SCALAR, Layout
from .algebra.multivector import Multivector
from .derivatives import hessian_vector, jacobian, jvp, matrix_of, vjp
from .frontend.eigen import eigenvalues_symmetric, eigenvectors_symmetric
from .frontend.equations import inverse_matrix, matrix_determinant, solve_linear, solve_symmetric
from .frontend.functions import exp, interpolate, log, power, sqrt
from .frontend.kernel import Kernel, array, kernel
from .frontend.operations import (
    absolute,
    acos,
    anticommutator,
    assemble,
    atan2,
    clifford_conjugate,
    coefficient,
    commutator,
    cos,
    determinant,
    dual,
    equal,
    geometric_product,
    grade,
    grade_involution,
    hestenes_product,
    inner_product,
    inverse,
    join,
    left_contraction,
    maximum,
    meet,
    minimum,
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
    select,
    sin,
    undual,
)
from .frontend.roots import cubic_roots, quadratic_roots, quartic_roots

__version__ = "0.1.0"

if TYPE_CHECKING:
    from .runtime import compile
    from .scripts import read_cluscript

_LOADED_LATER = {"compile": "runtime", "read_cluscript": "scripts"}


def __getattr__(name: str) -> Any:
    """`compile`, its backends, scripts and what needs sympy are loaded when they are first asked for."""
    if name in _LOADED_LATER:
        globals()[name] = found = getattr(import_module(f"{__name__}.{_LOADED_LATER[name]}"), name)
        return found
    if name in ("symbolic", "calculus"):
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = [
    "SCALAR", "Algebra", "Kernel", "Layout", "Multivector", "absolute", "acos", "anticommutator", "array", "assemble",
    "atan2", "clifford_conjugate", "coefficient", "commutator", "compile", "cos", "cubic_roots", "determinant", "dual",
    "eigenvalues_symmetric", "eigenvectors_symmetric", "equal", "exp", "geometric_product", "grade", "grade_involution",
    "hessian_vector", "hestenes_product", "inner_product", "interpolate", "inverse", "inverse_matrix", "jacobian",
    "join", "jvp", "kernel", "left_contraction", "log", "matrix_determinant", "matrix_of", "maximum", "meet", "minimum",
    "norm", "norm_squared", "normalize", "outer_product", "polarity", "power", "quadratic_roots", "quartic_roots",
    "read_cluscript", "regressive_product", "reverse", "right_contraction", "robots", "sandwich", "scalar_product",
    "select", "sin", "solve_linear", "solve_symmetric", "sqrt", "undual", "vjp",
]  # fmt: skip
