"""Compiled kernels as data for the printers."""

from __future__ import annotations

from collections.abc import Sequence

from ..algebra.layout import Layout
from ..backends.module import KernelSource, LayoutText, ModuleSource
from ..backends.operators import OPERATORS, python_operator
from ..passes.record import Compilation
from ..passes.single_operation import single_operation
from ..prove import rounding_error
from ..rings.polynomial import PolynomialRing
from .spec_files import Spec


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
    relations = [f"{p.name} ~{p.name} = 1" for p in kernel.parameters if p.layout.unit]
    relations += [f"the relations of {p.layout.name} on {p.name}" for p in kernel.parameters if p.layout.user_relations]
    operation = single_operation(record, OPERATORS)
    return KernelSource(
        record.program,
        kernel.summary,
        tuple(layouts),
        record.cost,
        tuple(relations),
        record.uniform,
        python_operator(*operation) if operation else None,
        kernel.result_names,
        rounding_error(record),
    )


def source_of(spec: Spec, records: Sequence[Compilation]) -> ModuleSource:
    """What is printed of a spec, from its compiled kernels."""
    return ModuleSource(spec.name, spec.summary, spec.command, spec.digest, tuple(map(kernel_source, records)))
