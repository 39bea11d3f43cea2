"""Inspection of a compilation: every stage as text, and the program as LaTeX."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction

from .algebra.layout import Layout
from .backends import c_source, python_source
from .backends.module import ModuleSource
from .errors import KernelError
from .frontend.latex import latex_of, symbol
from .generation.sources import kernel_source
from .ir.cost import WEIGHTS
from .ir.cost_models import COUNTS
from .ir.program import Line, Operand
from .ir.scalar import Op
from .passes.candidate import Candidate
from .passes.lower import Lowering, Reduction
from .passes.minimal import proved_minimum
from .passes.record import Compilation


def traced(record: Compilation) -> str:
    """Return the multivector expression of each result."""
    assert record.trace is not None
    return "\n".join(f"{output.name} = {', '.join(map(str, output.expressions))}" for output in record.trace.outputs)


def rewritten(record: Compilation) -> str:
    """Return the equivalent forms of the definition that were found."""
    assert record.variants is not None
    return "\n".join(f"{name}: {', '.join(map(str, variant))}" for name, variant in record.variants.items())


def decided(record: Compilation) -> str:
    """Return the layout of each result, and the coefficients that are proved to be constant."""
    assert record.decision is not None and record.trace is not None
    layouts = zip(record.trace.outputs, record.decision.layouts, strict=True)
    return "\n".join([*(f"{output.name}: {described(layout)}" for output, layout in layouts), *_constants(record)])


def _constants(record: Compilation) -> list[str]:
    """Return the coefficients that are proved to be zero or constant, one line for each kind and result."""
    assert record.decision is not None and record.trace is not None
    lines = []
    for number, expression in enumerate(record.trace.expressions):
        constants = {blade: value for (k, blade), value in record.decision.constants.items() if k == number}
        zero = [expression.algebra.spelling(blade)[1] for blade, value in constants.items() if value == 0]
        lines += [f"proved zero in result {number}: {' '.join(zero)}"] if zero else []
        for blade, value in constants.items():
            sign, name = expression.algebra.spelling(blade)
            lines += [f"proved constant in result {number}: {name} = {sign * value}"] if value else []
    return lines


def described(layout: Layout) -> str:
    """Describe a layout in one line."""
    fixed = "".join(f", {slot.name} = {value}" for slot, value in layout.fixed)
    implied = "".join(f", {slot.name} implied" for slot, _ in layout.implied)
    return f"{layout} stores {' '.join(layout.blades)}{fixed}{implied}{', x ~x = 1' if layout.unit else ''}"


def lowered(record: Compilation) -> str:
    """Return the results as polynomials in the inputs, modulo the relations."""
    assert record.trace is not None and record.decision is not None
    slots = [slot for each in record.decision.slots for slot in each]
    return str(Lowering(record.kernel, record.trace.expressions).system(slots))


def compared(record: Compilation) -> str:
    """Return every candidate with its cost, with the selected one marked, and the limits that the search reached."""
    width = max(len(candidate.origin) for candidate in record.candidates)
    lines = [
        f"{'->' if candidate is record.best else '  '} {candidate.origin:{width}}  {_cost(record, candidate)}"
        for candidate in record.candidates
    ]
    return "\n".join([*lines, *_limits(record)])


def _cost(record: Compilation, candidate: Candidate) -> str:
    """Format the counts of a candidate, and its cost in another cost model."""
    if record.model is COUNTS:
        return str(candidate.cost)
    return f"{candidate.cost}: {record.value(candidate)} {record.model.unit}"


def _limits(record: Compilation) -> list[str]:
    return [f"not tried: {limit}" for limit in record.limits]


def why(record: Compilation) -> str:
    """Explain the selected candidate by the saving of each of its steps.

    The saving of a step is the additional cost of the cheapest accurate candidate without that step. If every candidate
    without it also lacks other steps of the selected one, the saving is that of these steps together. Savings are in
    units of the cost model, by default in units of one addition.
    """
    assert record.best is not None
    first, best = record.candidates[0], record.best
    notes = [*_model(record), *_minimal(record), *_constants(record), *_rejected(record), *_limits(record)]
    author = "author's structure" if len(first.steps) == 1 else "first candidate"
    if best is first:
        tried = f"no accurate one of {len(record.candidates)} candidates is cheaper"
        return "\n".join([f"{author} taken, {_cost(record, best)}: {tried}", *([""] if notes else []), *notes])
    alike = sorted(
        _Accurate(record).candidates(record.value(best)), key=lambda candidate: len(_done(record, candidate))
    )
    rows = [(author, _cost(record, first), first.origin), ("taken", _cost(record, best), best.origin)]
    if len(_done(record, alike[0])) < len(_done(record, best)):
        rows.append(("as cheap, with less", _cost(record, alike[0]), alike[0].origin))
    lines = _aligned(rows)
    before = record.value(first)
    lines.append(f"saved: {before - record.value(best)} of {before}{_weights(record)}")
    savings = _savings(record)
    lines += ["", *_aligned([("step", "cheapest without it", "saves"), *savings])] if savings else []
    return "\n".join([*lines, *([""] if notes else []), *notes])


class _Accurate:
    """The candidates that are accurate enough to be selected. Each is measured on demand."""

    def __init__(self, record: Compilation) -> None:
        self._record = record

    def candidates(self, at_most: int | None = None) -> Iterator[Candidate]:
        """Yield the candidates in order of cost, from that of the selected one to `at_most`."""
        assert self._record.best is not None
        least = self._record.value(self._record.best)
        for candidate in sorted(self._record.candidates, key=self._record.value):
            total = self._record.value(candidate)
            if least <= total <= (total if at_most is None else at_most) and self._accepts(candidate):
                yield candidate

    def _accepts(self, candidate: Candidate) -> bool:
        record = self._record
        assert record.gate is not None
        taken = candidate is record.best or candidate is record.candidates[0]
        return taken or candidate.is_accurate(record.gate)


def _done(record: Compilation, candidate: Candidate) -> dict[str, str]:
    """Return the steps of a candidate by kind. The author's own form and zero stages are not steps."""
    rewriting, *steps = candidate.steps
    assert record.variants is not None
    done = {} if rewriting == next(iter(record.variants)) else {"rewriting": rewriting}
    for step in steps:
        if step.endswith(" stages"):
            done |= {} if step == "0 stages" else {"stages": step}
        elif step.endswith(" parts"):
            done["parts"] = step
        elif step in (Reduction.NORMAL.value, Reduction.SPARSE.value):
            done["reduction"] = step
        elif step != Reduction.NONE.value:
            done[step] = step
    return done


def _savings(record: Compilation) -> list[tuple[str, str, str]]:
    """Return, for each step of the selected candidate, the step, the cheapest candidate without it, and the saving."""
    assert record.best is not None
    accurate, own, rows = _Accurate(record), _done(record, record.best), []
    for kind, step in own.items():
        cheapest, lacking = None, list[list[str]]()
        for candidate in accurate.candidates():
            missing = _missing(own, _done(record, candidate))
            if step in missing:
                cheapest = cheapest or candidate
                lacking.append([other for other in missing if other != step])
        name = _NAMES.get(kind, "{0}").format(step)
        if cheapest is None:
            rows.append((name, "none was tried", "unknown"))
            continue
        saved = record.value(cheapest) - record.value(record.best)
        together = f", together with {_listed(lacking[0], len(own))}" if saved and [] not in lacking else ""
        rows.append((name, _cost(record, cheapest), f"{saved}{together}"))
    return rows


def _listed(others: list[str], n: int) -> str:
    return "the others" if len(others) == n - 1 > 1 else ", ".join(others)


_NAMES = {"stages": "results named in {0}", "parts": "composed of {0}", "reduction": "{0} modulo the relations"}


def _missing(own: Mapping[str, str], other: Mapping[str, str]) -> list[str]:
    """Return the steps of one candidate that another lacks; the number of named results is ignored."""
    return [
        step for kind, step in own.items() if (other.get(kind) != step if kind == "rewriting" else kind not in other)
    ]


def _model(record: Compilation) -> list[str]:
    return [] if record.model is COUNTS else [f"cost model {record.model.name}: {record.model.counted}"]


def _minimal(record: Compilation) -> list[str]:
    """Return whether the number of operations is proved to be minimal."""
    least = proved_minimum(record.kernel, record.program) if record.model is COUNTS else None
    if least is None:
        return []
    programs = "no program of sums, differences and products of the inputs and small numbers"
    if least == record.cost.mul + record.cost.add:
        return [f"minimal, proved: {programs} has fewer operations"]
    return [f"at least {least} operations, proved: {programs} has fewer"]


def _rejected(record: Compilation) -> list[str]:
    if not record.refused:
        return []
    least = record.refused[0]
    found = f"rejected, because they lose digits: {len(record.refused)}, the cheapest {_cost(record, least)}"
    return [f"{found}: {least.origin}", *([f"it has {record.refusal}"] if record.refusal else [])]


def _weights(record: Compilation) -> str:
    """Return the weights of the operations that occur and cost more than an addition, for the default cost model."""
    if record.model is not COUNTS:
        return ""
    costs = [candidate.cost.as_dict() for candidate in record.candidates]
    heavy = [f"{name} {weight}" for name, weight in WEIGHTS.items() if weight > 1 and any(c[name] for c in costs)]
    return f" (weights: {', '.join(heavy)})" if heavy else ""


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def scheduled(record: Compilation) -> str:
    """Return the program and its cost."""
    return f"{record.program}\n{record.cost}"


def _module(record: Compilation) -> ModuleSource:
    return ModuleSource(record.kernel.name, record.kernel.summary, "gac show", "", (kernel_source(record),))


def uniform(record: Compilation) -> str:
    """Return the forms for batches in which some arguments are shared by all elements."""
    texts = []
    for form in record.uniform:
        once, each = form.costs
        head = f"the same {', '.join(form.same)} for {form.least(record.program)} elements or more: "
        texts.append(f"{head}{once} once, {each} each\n{form.apply}")
    return "\n".join(texts) or "none pays"


STAGES: Mapping[str, Callable[[Compilation], str]] = {
    "trace": traced,
    "rewrite": rewritten,
    "decide": decided,
    "lower": lowered,
    "candidates": compared,
    "program": scheduled,
    "uniform": uniform,
    "c": lambda record: c_source(_module(record)),
    "python": lambda record: python_source(_module(record)),
}
"""The stages of ``gac show --stage``, in the order of the pipeline."""

SHOWN = ("trace", "rewrite", "decide", "candidates", "program")
"""The stages that ``gac show`` prints by default."""


def stage_text(record: Compilation, stage: str) -> str:
    """Return one stage of a compiled kernel as text.

    Raises
    ------
    KernelError
        If there is no stage of this name.
    """
    if stage not in STAGES:
        raise KernelError("gac show", f"no stage {stage!r}", "one of " + ", ".join(STAGES))
    return STAGES[stage](record)


def latex(record: Compilation) -> str:
    """Return the definition and the program as one aligned block of LaTeX."""
    assert record.trace is not None
    rows = [
        rf"\mathrm{{{output.name.replace('_', chr(92) + '_')}}} &= {latex_of(expression)}"
        for output in record.trace.outputs
        for expression in output.expressions
    ]
    rows += [f"{_operand(line.target)} &= {_line(line)}" for line in record.program.lines]
    for result in record.program.results:
        for k, operand in enumerate(result.operands):
            rows.append(rf"\mathrm{{{result.name.replace('_', chr(92) + '_')}}}_{{{k}}} &= {_operand(operand)}")
    return "\\begin{align*}\n" + " \\\\\n".join(rows) + "\n\\end{align*}"


_LATEX = {
    Op.ADD: "{0} + {1}", Op.SUBTRACT: "{0} - {1}", Op.MULTIPLY: r"{0}\,{1}", Op.DIVIDE: r"\frac{{{0}}}{{{1}}}",
    Op.NEGATE: "-{0}", Op.SQRT: r"\sqrt{{{0}}}", Op.ABS: r"\lvert {0} \rvert", Op.FLOOR: r"\lfloor {0} \rfloor",
    Op.LESS: "[{0} < {1}]",
    Op.LESS_EQUAL: r"[{0} \le {1}]", Op.EQUAL: "[{0} = {1}]", Op.SELECT: r"({0}\,?\,{1} : {2})",
}  # fmt: skip


def _line(line: Line) -> str:
    operands = [_operand(operand) for operand in line.operands]
    if line.op in _LATEX:
        return _LATEX[line.op].format(*operands)
    return rf"\operatorname{{{line.op.value}}}({', '.join(operands)})"


def _operand(operand: Operand) -> str:
    if isinstance(operand, Fraction):
        return str(operand) if operand.denominator == 1 else rf"\tfrac{{{operand.numerator}}}{{{operand.denominator}}}"
    if operand[0] == "t" and operand[1:].isdigit():
        return f"t_{{{operand[1:]}}}"
    return symbol(operand)
