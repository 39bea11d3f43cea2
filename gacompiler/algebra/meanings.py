"""The definition of every operation, as a function of multivectors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from ..errors import OperandError
from . import duality, involutions, versors
from .coefficients import Coefficient, scalar_function
from .multivector import Multivector
from .operations import SCALAR_FUNCTIONS, Operation

Meaning = Callable[..., Multivector]


def _product(operation: Operation, a: Multivector, b: Multivector) -> Multivector:
    return a.product(operation, b)


def _involution(signs: Callable[[int], int], a: Multivector) -> Multivector:
    return a.with_signs(signs)


def _scalar(operation: Operation, *arguments: Multivector) -> Multivector:
    first = arguments[0]
    if any(any(argument.terms) for argument in arguments):
        found = ", ".join(str(argument) for argument in arguments)
        remedy = "take coefficients such as x.e12; exp, log, sqrt and power take multivectors"
        raise OperandError(f"{operation}()", found, "scalars", remedy)
    return first.lift(scalar_function(operation.value, *(argument.scalar for argument in arguments)))


ARITHMETIC: Mapping[Operation, Callable[..., Coefficient | None]] = {
    Operation.GEOMETRIC_PRODUCT: lambda x, y: None if x is None or y is None else x * y,
    Operation.ADD: lambda x, y: y if x is None else x if y is None else x + y,
    Operation.SUBTRACT: lambda x, y: x if y is None else -y if x is None else x + -y,
    Operation.NEGATE: lambda x: None if x is None else -x,
}
"""Operations on scalars, as functions of their coefficients; None is an exact zero, which has no term.

A difference is the sum with a negated term, as for multivectors, so that both give the same text.
"""


def arithmetic(operation: Operation, scalars: Sequence[Multivector]) -> Multivector:
    """Return a product, sum, difference or negative of scalars, as the general operation does, but many times faster.

    Kernels on matrices of numbers consist of hundreds of these.
    """
    found = ARITHMETIC[operation](*[each.terms.get(0) for each in scalars])
    return Multivector(scalars[0].algebra, {} if found is None else {0: found})


def _by_table() -> dict[Operation, Meaning]:
    """Return the operations that are defined by their rows in the table."""
    found: dict[Operation, Meaning] = {each: partial(_scalar, each) for each in SCALAR_FUNCTIONS}
    for each in Operation:
        if each.row.grades is not None or each.row.bracket:
            found[each] = partial(_product, each)
        elif each.row.signs is not None:
            found[each] = partial(_involution, each.row.signs)
    return found


MEANINGS: Mapping[Operation, Meaning] = {
    **_by_table(),
    Operation.ADD: lambda a, b: a + b,
    Operation.SUBTRACT: lambda a, b: a - b,
    Operation.NEGATE: lambda a: -a,
    Operation.DIVIDE: lambda a, b: a / b,
    Operation.REGRESSIVE_PRODUCT: duality.regressive_product,
    Operation.DUAL: duality.dual,
    Operation.UNDUAL: duality.undual,
    Operation.POLARITY: duality.polarity,
    Operation.REVERSE: involutions.reverse,
    Operation.SANDWICH: versors.sandwich,
    Operation.INVERSE: versors.inverse,
    Operation.DETERMINANT: versors.determinant,
    Operation.NORM_SQUARED: versors.norm_squared,
    Operation.NORM: versors.norm,
    Operation.NORMALIZE: versors.normalize,
}
"""The definitions of all operations except those that carry data."""
