"""The compiler, read from top to bottom: a kernel's definition goes in, a program comes out.

Every pass takes the record of what is known so far and returns a new one with its own field filled in; nothing is
changed in place, so each stage can be looked at afterwards (``gac show --stage NAME``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..errors import GacError, KernelError
from ..frontend.kernel import Kernel, trace
from .accuracy import Gate
from .decide import decide
from .prove import prove_program
from .record import Compilation
from .rewrite import rewrite
from .search import Search
from .uniform import uniform_forms


def trace_kernel(record: Compilation) -> Compilation:
    """Call the kernel's function on symbols: a multivector expression for each result."""
    return replace(record, trace=trace(record.kernel))


def rewrite_expressions(record: Compilation) -> Compilation:
    """Find other ways to write the same expressions."""
    assert record.trace is not None
    return replace(record, variants=rewrite(record.trace.expressions))


def decide_results(record: Compilation) -> Compilation:
    """Prove which coefficients vanish or are constant, and choose the layouts of the results."""
    assert record.trace is not None and record.variants is not None
    return replace(record, decision=decide(record.trace, tuple(record.variants.values())))


def find_candidates(record: Compilation) -> Compilation:
    """Lower, factorise, share and schedule the results in many ways."""
    assert record.trace is not None and record.variants is not None and record.decision is not None
    results = []
    for output, layout, slots in zip(record.trace.outputs, record.decision.layouts, record.decision.slots, strict=True):
        shape = output.outer_shape + (() if layout.is_scalar else (layout.size,))
        results.append((output.name, shape, slots))
    search = Search(record.kernel, record.variants, results)
    return replace(record, candidates=tuple(search.candidates()), limits=search.limits)


def choose_program(record: Compilation) -> Compilation:
    """Keep the cheapest candidate whose error is not much larger than that of the first, the author's structure."""
    gate = Gate(record.kernel, record.candidates[0].program)
    by_cost = sorted(record.candidates, key=lambda candidate: candidate.cost.total)
    best = next((candidate for candidate in by_cost if gate.accepts(candidate.program)), record.candidates[0])
    return replace(record, gate=gate, best=best)


def split_uniform(record: Compilation) -> Compilation:
    """Find forms for batches in which some arguments are the same for every element."""
    assert record.trace is not None and record.decision is not None and record.gate is not None
    if record.kernel.result_names:
        return record  # scripts have many numbers as arguments, and a second is all that they may take
    slots = [slot for each in record.decision.slots for slot in each]
    forms = uniform_forms(record.kernel, record.trace.expressions, slots, record.program, record.gate)
    return replace(record, uniform=forms)


PIPELINE: tuple[Callable[[Compilation], Compilation], ...] = (
    trace_kernel,
    rewrite_expressions,
    decide_results,
    find_candidates,
    choose_program,
    split_uniform,
    prove_program,
)


def compile_kernel(kernel: Kernel, forms: bool = True) -> Compilation:
    """Run the pipeline on one kernel. Messages of errors say which kernel.

    Parameters
    ----------
    kernel : Kernel
        Without loops.
    forms : bool
        Whether forms for uniform arguments are looked for.
    """
    record = Compilation(kernel)
    try:
        for stage in PIPELINE:
            if forms or stage is not split_uniform:
                record = stage(record)
    except ZeroDivisionError as error:
        raise KernelError(
            kernel.where, "it divides by an expression that is identically zero", "a divisor that can differ from zero"
        ) from error
    except GacError as error:
        if kernel.name in error.where:
            raise
        raise KernelError(kernel.where, f"{error.where}: {error.found}", error.expected, error.remedy) from error
    return record
