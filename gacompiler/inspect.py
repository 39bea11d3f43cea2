"""Looking at how a kernel was made: every stage as text, and the program as LaTeX."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction

from .algebra.layout import Layout
from .backends import c_source, python_source
from .backends.module import ModuleSource
from .errors import KernelError
from .frontend.latex import latex_of, symbol
from .generate import kernel_source
from .ir.program import Line, Operand
from .ir.scalar import Op
from .passes.lower import Lowering
from .passes.record import Compilation


def traced(record: Compilation) -> str:
    """The multivector expression of each result."""
    assert record.trace is not None
    return "\n".join(f"{output.name} = {', '.join(map(str, output.expressions))}" for output in record.trace.outputs)


def rewritten(record: Compilation) -> str:
    """The other ways to write it that were found."""
    assert record.variants is not None
    return "\n".join(f"{name}: {', '.join(map(str, variant))}" for name, variant in record.variants.items())


def decided(record: Compilation) -> str:
    """The layout of each result, and the coefficients that are proved to be constant."""
    assert record.decision is not None and record.trace is not None
    lines = [
        f"{output.name}: {described(layout)}"
        for output, layout in zip(record.trace.outputs, record.decision.layouts, strict=True)
    ]
    for number, expression in enumerate(record.trace.expressions):
        constants = {blade: value for (k, blade), value in record.decision.constants.items() if k == number}
        zero = [expression.algebra.spelling(blade)[1] for blade, value in constants.items() if value == 0]
        lines += [f"proved zero in result {number}: {' '.join(zero)}"] if zero else []
        for blade, value in constants.items():
            sign, name = expression.algebra.spelling(blade)
            lines += [f"proved constant in result {number}: {name} = {sign * value}"] if value else []
    return "\n".join(lines)


def described(layout: Layout) -> str:
    """A layout in one line."""
    fixed = "".join(f", {slot.name} = {value}" for slot, value in layout.fixed)
    implied = "".join(f", {slot.name} implied" for slot, _ in layout.implied)
    return f"{layout} stores {' '.join(layout.blades)}{fixed}{implied}{', x ~x = 1' if layout.unit else ''}"


def lowered(record: Compilation) -> str:
    """The results as polynomials in the inputs, modulo the relations."""
    assert record.trace is not None and record.decision is not None
    slots = [slot for each in record.decision.slots for slot in each]
    return str(Lowering(record.kernel, record.trace.expressions).system(slots))


def compared(record: Compilation) -> str:
    """Every candidate with its cost, the one taken marked."""
    width = max(len(candidate.origin) for candidate in record.candidates)
    return "\n".join(
        f"{'->' if candidate is record.best else '  '} {candidate.origin:{width}}  {candidate.cost}"
        for candidate in record.candidates
    )


def scheduled(record: Compilation) -> str:
    """The program."""
    return f"{record.program}\n{record.cost}"


def _module(record: Compilation) -> ModuleSource:
    return ModuleSource(record.kernel.name, record.kernel.summary, "gac show", "", (kernel_source(record),))


STAGES: Mapping[str, Callable[[Compilation], str]] = {
    "trace": traced,
    "rewrite": rewritten,
    "decide": decided,
    "lower": lowered,
    "candidates": compared,
    "program": scheduled,
    "c": lambda record: c_source(_module(record)),
    "python": lambda record: python_source(_module(record)),
}
"""What ``gac show --stage`` knows, in the order of the pipeline."""

SHOWN = ("trace", "rewrite", "decide", "candidates", "program")
"""What ``gac show`` prints when no stage is asked for."""


def stage_text(record: Compilation, stage: str) -> str:
    """One stage of a compiled kernel as text."""
    if stage not in STAGES:
        raise KernelError("gac show", f"no stage {stage!r}", "one of " + ", ".join(STAGES))
    return STAGES[stage](record)


def latex(record: Compilation) -> str:
    """The definition and the program as LaTeX, one aligned block."""
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
    Op.NEGATE: "-{0}", Op.SQRT: r"\sqrt{{{0}}}", Op.ABS: r"\lvert {0} \rvert", Op.LESS: "[{0} < {1}]",
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
