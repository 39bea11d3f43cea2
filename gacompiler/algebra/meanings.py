"""The definition of every operation, as a function of multivectors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from . import duality, versors
from .coefficients import scalar_function
from .multivector import Multivector
from .operations import SCALAR_FUNCTIONS, Operation

Meaning = Callable[..., Multivector]


def _product(operation: Operation, a: Multivector, b: Multivector) -> Multivector:
    return a.product(operation, b)


def _involution(signs: Callable[[int], int], a: Multivector) -> Multivector:
    return a.with_signs(signs)


def _scalar(operation: Operation, *arguments: Multivector) -> Multivector:
    first = arguments[0]
    return first.lift(scalar_function(operation.value, *(argument.scalar for argument in arguments)))


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
    Operation.SANDWICH: versors.sandwich,
    Operation.INVERSE: versors.inverse,
    Operation.DETERMINANT: versors.determinant,
    Operation.NORM_SQUARED: versors.norm_squared,
    Operation.NORM: versors.norm,
    Operation.NORMALIZE: versors.normalize,
}
"""The definitions of all operations except those that carry data."""
