"""Which kernels are operators on values, read from what they are defined as and not from their names."""

from __future__ import annotations

from itertools import permutations

from ..algebra.layout import Layout
from ..frontend.expression import node
from .record import Compilation

SYMBOLS = {
    1: {"reverse": "~", "negate": "-"},
    2: {
        "geometric_product": "*", "outer_product": "^", "regressive_product": "&", "add": "+", "subtract": "-",
        "sandwich": "()",
    },
}  # fmt: skip
"""By number of operands: operation -> Python's operator; ``()`` is the call ``m(x)``."""


def operator_of(record: Compilation) -> tuple[str, tuple[str, ...]] | None:
    """The operator that a kernel is, and the names of its arguments in the order of the operands.

    Parameters
    ----------
    record : Compilation
        A kernel whose expressions have been traced and rewritten.

    Returns
    -------
    tuple or None
        ``("()", ("m", "p"))`` for ``m * p * ~m``; None where the kernel is no single operation on its arguments.
    """
    assert record.trace is not None and record.variants is not None
    parameters = record.kernel.parameters
    (output, *others) = record.trace.outputs
    single = all(isinstance(each.type, Layout) and not each.layout.is_scalar for each in parameters)
    if others or output.outer_shape or not single:
        return None
    forms = {record.trace.expressions[0], *(variant[0] for variant in record.variants.values())}
    for order in permutations(parameters):
        symbols = [parameter.symbols() for parameter in order]
        if len({symbol.algebra for symbol in symbols}) > 1:
            return None
        for operation, symbol in SYMBOLS.get(len(order), {}).items():
            if node(operation, *symbols) in forms:
                return symbol, tuple(parameter.name for parameter in order)
    return None
