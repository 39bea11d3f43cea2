"""Compiled kernels as data for the printers."""

from __future__ import annotations

from collections.abc import Sequence

from ..algebra.layout import Layout
from ..algebra.operations import BY_NAME, Operation
from ..backends.module import KernelSource, LayoutText, LoopSource
from ..frontend.kernel import Parameter
from ..frontend.rows import IndexOf
from ..passes.accuracy import measured_error
from ..passes.loop_accuracy import measured_loop_error
from ..passes.loops import LoopCompilation
from ..passes.record import Compilation
from ..passes.single_operation import single_operation
from ..rings.polynomial import PolynomialRing

_WITH_OPERATORS = {
    1: (Operation.REVERSE, Operation.NEGATE),
    2: (
        Operation.GEOMETRIC_PRODUCT, Operation.OUTER_PRODUCT, Operation.REGRESSIVE_PRODUCT, Operation.ADD,
        Operation.SUBTRACT, Operation.SANDWICH,
    ),
}  # fmt: skip
"""By number of operands: the operations that values of generated modules have an operator for."""


def layout_text(layout: Layout, proved: bool = True) -> LayoutText:
    """A layout as generated modules carry it; not `unit` where a result is that only for arguments of more meaning."""
    fixed = tuple((slot.name, str(value)) for slot, value in layout.fixed)
    implied = tuple((slot.name, "implied") for slot, _ in layout.implied)
    name = layout.name if layout.is_scalar else str(layout)
    return LayoutText(
        name,
        () if layout.is_scalar else layout.blades,
        (*fixed, *implied),
        layout.unit and proved,
        layout.user_relations is not None and proved,
        _implied(layout),
    )


def _implied(layout: Layout) -> tuple[tuple[str, str], ...]:
    """Coefficients that follow from the stored ones, and the sums of products that they are."""
    ring = PolynomialRing()
    stored = {name: ring.variable(name) for name in layout.blades}
    found = []
    for slot, function in layout.implied:
        polynomial = ring.lift(function(stored))
        terms = ["*".join([str(factor), *(ring.names[k] for k in m)]) for m, factor in polynomial.terms.items()]
        found.append((slot.name, " + ".join(terms) or "0"))
    return tuple(found)


def kernel_source(record: Compilation) -> KernelSource:
    """A compiled kernel, ready to print."""
    kernel, decision, trace = record.kernel, record.decision, record.trace
    assert decision is not None and trace is not None
    layouts = [(parameter.name, layout_text(parameter.layout)) for parameter in kernel.parameters]
    layouts += [
        (output.name, layout_text(layout, proved))
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
    """How values write it: as kernels do, or by a call where these have a function for it."""
    return operation.row.operator or operation.row.object_operators[-1]


def loop_source(record: LoopCompilation) -> LoopSource:
    """A compiled kernel with loops, ready to print."""
    kernel = record.kernel
    with_layouts = [parameter for parameter in kernel.parameters if not isinstance(parameter.type, IndexOf)]
    layouts = [(parameter.name, layout_text(parameter.layout)) for parameter in with_layouts]
    layouts += [(name, layout_text(table.leaf.layout)) for name, table in record.trace.results]
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
    """What is assumed of parameters, for readers."""
    relations = [f"{p.name} ~{p.name} = 1" for p in parameters if p.layout.unit]
    relations += [f"the relations of {p.layout.name} on {p.name}" for p in parameters if p.layout.user_relations]
    return tuple(relations)


def _rounding_error(record: Compilation) -> str:
    """The largest error of the program in double precision, in ulp of its largest result, for readers."""
    worst, n = measured_error(record.program, record.kernel)
    return f"{worst:.1f} ulp, {n} inputs"
