"""Recognition of kernels that consist of one operation on their arguments, based on their definition."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import permutations

from ..algebra.layout import Layout
from ..algebra.operations import BY_NAME
from ..frontend.expression import node
from .record import Compilation


def single_operation(
    record: Compilation, operations: Mapping[int, Iterable[str]]
) -> tuple[str, tuple[str, ...]] | None:
    """Return the operation that a kernel computes, and the names of its arguments in the order of the operands.

    Parameters
    ----------
    record : Compilation
        The record of a kernel after tracing and rewriting.
    operations : mapping of int to iterable of str
        The operations to search, in order, by number of operands.

    Returns
    -------
    tuple or None
        ``("sandwich", ("m", "p"))`` for ``m * p * ~m``, or None if the kernel is none of `operations`.
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
        for operation in operations.get(len(order), ()):
            if node(BY_NAME[operation], *symbols) in forms:
                return operation, tuple(parameter.name for parameter in order)
    return None
