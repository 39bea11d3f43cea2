"""The compilation pipeline, from the definition of a kernel to a program.

Every pass takes the compilation record and returns a new record with its own field set. Nothing is modified in place,
so that each stage can be inspected afterwards (``gac show --stage NAME``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

from ..errors import GacError, KernelError, ProofError
from ..frontend.kernel import Kernel, trace
from ..ir.cost import Cost
from ..ir.cost_models import COUNTS, cost_model
from .candidate import Candidate
from .collection import rare_collection
from .compose import Composer, composable
from .decide import decide
from .effort import DEFAULT, LEVELS, effort_of
from .interruption import is_interrupted
from .model_candidates import candidates_for
from .prove import prove_program
from .record import Compilation
from .rewrite import rewrite
from .saturate import saturate
from .search import Search
from .uniform import uniform_forms


def trace_kernel(record: Compilation) -> Compilation:
    """Call the kernel's function on symbols to obtain a multivector expression for each result."""
    return replace(record, trace=trace(record.kernel))


def rewrite_expressions(record: Compilation) -> Compilation:
    """Find equivalent forms of the expressions; without a search, the rewriting to saturation is omitted."""
    assert record.trace is not None
    variants = rewrite(record.trace.expressions)
    if record.effort.level:
        saturated = saturate(record.trace.expressions)
        if saturated not in variants.values():
            variants["rewritten to saturation"] = saturated
    return replace(record, variants=variants)


def decide_results(record: Compilation) -> Compilation:
    """Prove which coefficients vanish or are constant, and choose the layouts of the results."""
    assert record.trace is not None and record.variants is not None
    return replace(record, decision=decide(record.trace, tuple(record.variants.values())))


def find_candidates(record: Compilation) -> Compilation:
    """Generate candidate programs by lowering, factorising, composing and scheduling the results."""
    return _candidates(record, is_part=False)


def _candidates(record: Compilation, is_part: bool) -> Compilation:
    assert record.trace is not None and record.variants is not None and record.decision is not None
    author, decision = record.decision.author, replace(record.decision, author=None)
    results = []
    for output, layout, slots in zip(record.trace.outputs, record.decision.layouts, record.decision.slots, strict=True):
        shape = output.outer_shape + (() if layout.is_scalar else (layout.size,))
        results.append((output.name, shape, slots))
    if record.effort.level == 0:
        candidate = Search(record.kernel, record.variants, results, record.effort, author).author()
        return replace(record, decision=decision, candidates=(candidate,), limits=(NO_SEARCH,))
    found: dict[tuple[tuple[str, ...], Cost], Candidate] = {}
    for effort in LEVELS[1 : record.effort.level + 1]:
        search = Search(record.kernel, record.variants, results, effort, author)
        candidates = search.candidates()
        if not is_part and not is_interrupted():
            by_cost = sorted(candidates, key=lambda candidate: candidate.cost.total)
            best = next(filter(search.is_accurate, by_cost), candidates[0]).cost.total
            composer = Composer(record.trace, search, candidates[0].program, _optimiser_of_parts(effort.level))
            candidates += composer.candidates(composable(record.variants), best)
        candidates += search.divided_once(candidates)
        for candidate in (*candidates, *candidates_for(record.model, search, candidates)):
            found.setdefault((candidate.steps, candidate.cost), candidate)
        limits = search.limits
        if is_interrupted():
            limits = (*limits, INTERRUPTED)
            break
        if not limits:
            break  # A higher level would try the same candidates.
    return replace(record, decision=decision, candidates=tuple(found.values()), limits=limits, gate=search.gate)


NO_SEARCH = "effort 0: nothing but the author's structure; cheaper forms may exist"
INTERRUPTED = "the search was interrupted; cheaper forms may exist"


@cache
def _optimiser_of_parts(level: int) -> Callable[[Kernel], Compilation]:
    return partial(optimise_part, level=level)


def optimise_part(kernel: Kernel, level: int = DEFAULT) -> Compilation:
    """Optimise a part of a kernel; the whole kernel is proved."""
    start = Compilation(kernel, effort=effort_of(level))
    record = decide_results(rewrite_expressions(trace_kernel(start)))
    assert record.trace is not None
    return choose_program(_candidates(record, is_part=not record.trace.calls))


def choose_program(record: Compilation) -> Compilation:
    """Select the cheapest candidate whose error is not much larger than that of the first, the author's structure.

    Candidates that cost the same in another cost model than the default are compared by the default.
    """
    if record.gate is None:
        return replace(record, best=record.candidates[0])
    by_cost = sorted(record.candidates, key=lambda candidate: (record.value(candidate), candidate.cost.total))
    best = next((candidate for candidate in by_cost if candidate.is_accurate(record.gate)), record.candidates[0])
    return replace(record, best=best)


def split_uniform(record: Compilation) -> Compilation:
    """Find forms for batches in which some arguments are the same for every element."""
    assert record.trace is not None and record.decision is not None
    if record.kernel.result_names or record.gate is None:
        return record  # Scripts have many scalar arguments, and their compilation must take less than a second.
    slots = [slot for each in record.decision.slots for slot in each]
    forms = uniform_forms(record.kernel, record.trace.expressions, slots, record.program, record.gate)
    return replace(record, uniform=forms)


def prove_best(record: Compilation) -> Compilation:
    """Prove the selected program. If it is a composition and cannot be proved, select and prove another one.

    Compositions may rely on relations that called kernels declare and that do not hold for all arguments, for example
    those of another branch of a function.
    """
    try:
        return prove_program(record)
    except ProofError:
        others = tuple(candidate for candidate in record.candidates if not candidate.is_composed)
        if record.best is None or not record.best.is_composed:
            raise
    again = choose_program(replace(record, candidates=others))
    return prove_program(split_uniform(again) if record.uniform else again)


PIPELINE: tuple[Callable[[Compilation], Compilation], ...] = (
    trace_kernel,
    rewrite_expressions,
    decide_results,
    find_candidates,
    choose_program,
    split_uniform,
    prove_best,
)


@rare_collection()
def compile_kernel(kernel: Kernel, forms: bool = True, effort: int = DEFAULT, cost: str = COUNTS.name) -> Compilation:
    """Run the pipeline on one kernel. Error messages name the kernel.

    Parameters
    ----------
    kernel : Kernel
        A kernel without loops.
    forms : bool
        Whether to search for forms for uniform arguments.
    effort : int
        The level of effort, from 0 to 3 (`gacompiler.passes.effort`).
    cost : str
        The name of the cost model (`gacompiler.ir.cost_models`).
    """
    record = Compilation(kernel, effort=effort_of(effort), model=cost_model(cost))
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
