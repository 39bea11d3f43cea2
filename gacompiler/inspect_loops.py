"""Inspection of the compilation of a kernel with loops: the loops as text, and the stages of straight-line parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from .backends import c_source, python_source
from .backends.module import ModuleSource
from .errors import KernelError
from .frontend.kernel import Parameter
from .frontend.recorded import computes
from .frontend.traced import Traced, substituted
from .generation.sources import loop_source
from .inspect import STAGES, described, stage_text
from .inspect import why as part_why
from .ir.procedure_cost import costs_text
from .ir.procedure_text import place_text, procedure_text
from .passes.loops import LoopCompilation


def traced(record: LoopCompilation) -> str:
    """Return the layout of each table, and the expressions of the straight-line parts."""
    lines = [f"{each.name}: {described(each.leaf.layout)}" for each in record.trace.records]
    for part, compute in zip(record.parts, computes(record.trace.statements), strict=True):
        assert part.trace is not None and isinstance(compute.kernel.function, Traced)
        named = [Parameter(n, s.leaf.layout).symbols() for n, s in zip(compute.names, compute.sources, strict=True)]
        by = dict(zip(compute.kernel.function.symbols, named, strict=True))
        for (place, _), expression in zip(compute.targets, substituted(part.trace.expressions, by), strict=True):
            lines.append(f"{part.kernel.name}: {place_text(place)} = {expression}")
    return "\n".join(lines)


def procedure(record: LoopCompilation) -> str:
    """Return the loops, and how often each part runs."""
    return f"{procedure_text(record.procedure)}\n{costs_text(record.costs)}"


def programs(record: LoopCompilation) -> str:
    """Return the programs of the parts, which read and write rows of tables."""
    return "\n".join(map(str, record.procedure.programs))


def why(record: LoopCompilation) -> str:
    """Explain the selected candidate of each part by the saving of each of its steps."""
    return "\n\n".join(f"{part.kernel.name}\n{part_why(part)}" for part in record.parts)


def _module(record: LoopCompilation) -> ModuleSource:
    return ModuleSource(record.kernel.name, record.kernel.summary, "gac show", "", (), (loop_source(record),))


_OWN: Mapping[str, Callable[[LoopCompilation], str]] = {
    "trace": traced,
    "procedure": procedure,
    "program": programs,
    "c": lambda record: c_source(_module(record)),
    "python": lambda record: python_source(_module(record)),
}

LOOP_STAGES = ("trace", "procedure", *(stage for stage in STAGES if stage not in ("trace", "uniform")))
"""The stages of ``gac show --stage`` for kernels with loops; stages of the parts are printed for one part at a time."""

SHOWN_OF_LOOPS = ("trace", "procedure", "program")
"""The stages that ``gac show`` prints by default for kernels with loops."""


def loop_stage_text(record: LoopCompilation, stage: str) -> str:
    """Return one stage of a compiled kernel with loops as text.

    Raises
    ------
    KernelError
        If there is no stage of this name.
    """
    if stage in _OWN:
        return _OWN[stage](record)
    if stage not in LOOP_STAGES:
        raise KernelError("gac show", f"no stage {stage!r} of kernels with loops", "one of " + ", ".join(LOOP_STAGES))
    return "\n".join(f"{part.kernel.name}\n{stage_text(part, stage)}" for part in record.parts)


def refuse_latex(record: LoopCompilation) -> None:
    """Raise the error that loops cannot be printed as LaTeX.

    Raises
    ------
    KernelError
        Always.
    """
    raise KernelError(
        record.kernel.where, "it contains loops, which cannot be printed as LaTeX", "a kernel without loops",
        "use --stage procedure to print its loops",
    )  # fmt: skip
