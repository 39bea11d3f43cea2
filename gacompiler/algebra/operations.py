"""Every operation by name, as a function on multivectors: what each name means, in one table."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from . import duality, involutions, versors
from .coefficients import scalar_function
from .multivector import Multivector
from .products import GRADE_RULES

Meaning = Callable[..., Multivector]

SCALAR_FUNCTIONS: tuple[str, ...] = (
    "sqrt", "sin", "cos", "atan2", "acos", "exp", "log", "abs", "minimum", "maximum",
    "less", "less_equal", "equal", "select",
)  # fmt: skip


def _product(name: str, a: Multivector, b: Multivector) -> Multivector:
    return a.product(name, b)


def _scalar(name: str, *arguments: Multivector) -> Multivector:
    first = arguments[0]
    return first.lift(scalar_function(name, *(argument.scalar for argument in arguments)))


OPERATIONS: Mapping[str, Meaning] = {
    **{name: partial(_product, name) for name in GRADE_RULES},
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "negate": lambda a: -a,
    "divide": lambda a, b: a / b,
    "regressive_product": duality.regressive_product,
    "commutator": versors.commutator,
    "anticommutator": versors.anticommutator,
    "reverse": involutions.reverse,
    "grade_involution": involutions.grade_involution,
    "clifford_conjugate": involutions.clifford_conjugate,
    "dual": duality.dual,
    "undual": duality.undual,
    "polarity": duality.polarity,
    "sandwich": versors.sandwich,
    "inverse": versors.inverse,
    "determinant": versors.determinant,
    "norm_squared": versors.norm_squared,
    "norm": versors.norm,
    "normalize": versors.normalize,
    **{name: partial(_scalar, name) for name in SCALAR_FUNCTIONS},
}
