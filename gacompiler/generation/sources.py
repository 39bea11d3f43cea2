"""Convert compiled kernels to data for the printers."""

from __future__ import annotations

from collections.abc import Sequence

from ..algebra.operations import BY_NAME, Operation
from ..backends.module import KernelSource, LoopSource
from ..frontend.kernel import Parameter
from ..frontend.rows import IndexOf
from ..passes.accuracy import measured_error
from ..passes.loop_accuracy import measured_loop_error
from ..passes.loops import LoopCompilation
from ..passes.record import Compilation
from ..passes.single_operation import single_operation
from .layouts import plain_layout

_WITH_OPERATORS = {
    1: (Operation.REVERSE, Operation.NEGATE),
    2: (
        Operation.GEOMETRIC_PRODUCT, Operation.OUTER_PRODUCT, Operation.REGRESSIVE_PRODUCT, Operation.ADD,
        Operation.SUBTRACT, Operation.SANDWICH,
    ),
}  # fmt: skip
"""Operations that have an operator on values of generated modules, by number of operands."""


def kernel_source(record: Compilation) -> KernelSource:
    """Return the data that printers need of a compiled kernel."""
    kernel, decision, trace = record.kernel, record.decision, record.trace
    assert decision is not None and trace is not None
    layouts = [(parameter.name, plain_layout(parameter.layout)) for parameter in kernel.parameters]
    layouts += [
        (output.name, plain_layout(layout, proved))
        for output, layout, proved in zip(trace.outputs, decision.layouts, decision.related, strict=True)
    ]
    operation = single_operation(record, _WITH_OPERATORS)
    return KernelSource(
        record.program,
        kernel.summary,
        tuple(layouts),
        record.cost,
        _relations(kernel.parameters),
        record.uniform,
        (_operator(BY_NAME[operation[0]]), operation[1]) if operation else None,
        kernel.result_names,
        _rounding_error(record),
    )


def _operator(operation: Operation) -> str:
    """Return the operator of values for an operation: that of kernels, or ``()`` if kernels have a function for it."""
    return operation.row.operator or operation.row.object_operators[-1]


def loop_source(record: LoopCompilation) -> LoopSource:
    """Return the data that printers need of a compiled kernel with loops."""
    kernel = record.kernel
    with_layouts = [parameter for parameter in kernel.parameters if not isinstance(parameter.type, IndexOf)]
    layouts = [(parameter.name, plain_layout(parameter.layout)) for parameter in with_layouts]
    layouts += [(name, plain_layout(table.leaf.layout)) for name, table in record.trace.results]
    worst, n = measured_loop_error(kernel, record.procedure)
    return LoopSource(
        record.procedure,
        kernel.summary,
        tuple(layouts),
        record.costs,
        _relations(with_layouts),
        f"{worst:.1f} ulp, {n} inputs",
    )


def _relations(parameters: Sequence[Parameter]) -> tuple[str, ...]:
    """Describe the relations assumed of parameters, for documentation."""
    relations = [f"{p.name} ~{p.name} = 1" for p in parameters if p.layout.unit]
    relations += [f"the relations of {p.layout.name} on {p.name}" for p in parameters if p.layout.user_relations]
    return tuple(relations)


def _rounding_error(record: Compilation) -> str:
    """Format the largest error of the program in double precision, in ulp of its largest result, for documentation."""
    worst, n = measured_error(record.program, record.kernel)
    return f"{worst:.1f} ulp, {n} inputs"
