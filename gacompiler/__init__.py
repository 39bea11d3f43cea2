"""A geometric-algebra compiler: multivector definitions in, specialised and proved kernels out."""

from typing import Any

from .algebra.algebra import Algebra
from .algebra.layout import SCALAR, Layout
from .algebra.multivector import Multivector
from .derivatives import jacobian, jvp, matrix_of, vjp
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
    dual,
    equal,
    exp,
    geometric_product,
    grade,
    grade_involution,
    hestenes_product,
    inner_product,
    inverse,
    join,
    left_contraction,
    log,
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
    sqrt,
    undual,
)


def __getattr__(name: str) -> Any:
    """`compile` and its backends are loaded when they are first asked for: deriving formulas needs neither."""
    if name == "compile":
        from .runtime import compile

        globals()["compile"] = compile
        return compile
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = [
    "SCALAR", "Algebra", "Kernel", "Layout", "Multivector", "absolute", "acos", "anticommutator", "array",
    "assemble", "atan2", "clifford_conjugate", "coefficient", "commutator", "compile", "cos", "dual", "equal",
    "exp", "geometric_product", "grade", "grade_involution", "hestenes_product", "inner_product", "inverse",
    "jacobian", "join", "jvp", "kernel", "left_contraction", "log", "matrix_of", "maximum", "meet", "minimum",
    "norm", "norm_squared", "normalize", "outer_product", "polarity", "regressive_product", "reverse",
    "right_contraction", "sandwich", "scalar_product", "select", "sin", "sqrt", "undual", "vjp",
]  # fmt: skip
