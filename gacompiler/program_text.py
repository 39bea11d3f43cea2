"""Comparison of a program that was read from a text with the author's definition."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

from .backends import as_printed
from .ir.cost import cost
from .ir.program import Operand, Program
from .passes.prove import disagreement, program_reader, read
from .passes.truth import Truth


def without_names(programs: Iterable[Program]) -> list[Program]:
    """Return programs without the names of results, in which the texts of two languages differ."""
    return [replace(each, results=tuple(replace(result, name="") for result in each.results)) for each in programs]


def same_formulas(one: Sequence[Program], other: Sequence[Program]) -> bool:
    """Return whether programs compute each result by the same operations on the same inputs, in any order.

    Names and the order of lines may differ, as they do between a program and the program that is read from its text.
    """
    numbers: dict[Any, int] = {}
    return list(map(_numbered(numbers), one)) == list(map(_numbered(numbers), other))


def has_formulas(text: Sequence[Program], programs: Sequence[Program]) -> bool:
    """Return whether a text has the formulas of programs whose numbers are rounded once."""
    return same_formulas(text, list(map(as_printed, programs)))


def _numbered(numbers: dict[Any, int]) -> Callable[[Program], Any]:
    """Return a function that gives the shapes of a program and the numbers of its results, equal for equal formulas."""

    def formulas(program: Program) -> Any:
        inputs = [name for argument in program.arguments for name in argument.components]
        known: dict[Operand, Any] = {name: ("input", k) for k, name in enumerate(inputs)}
        for line in program.lines:
            formula = (line.op, *(known.get(operand, operand) for operand in line.operands))
            known[line.target] = numbers.setdefault(formula, len(numbers)), "line"
        results = [(result.shape, [known.get(each, each) for each in result.operands]) for result in program.results]
        return [argument.shape for argument in program.arguments], results

    return formulas


def difference_of_program(text: Program, program: Program, known: Sequence[Truth]) -> str:
    """Describe how a text differs from the definition at the given points.

    If the text cannot hold the exact numbers of its program, the program is compared with the definition, and the text
    with the program whose numbers are rounded once. Texts with the formulas of the rounded program are not evaluated.
    A text with branches must have these formulas, since random points do not meet every condition, such as an equality.
    """
    printed = as_printed(program)
    is_same, is_exact = same_formulas([text], [printed]), printed == program
    difference = disagreement(program_reader(text if is_exact else program), known)
    if difference or is_same:
        return difference
    if not is_exact:
        reader = program_reader(printed)
        difference = disagreement(
            program_reader(text), [replace(truth, results=(tuple(read(reader, truth)),), again=None) for truth in known]
        )
    if not difference and (cost(text).choice or cost(printed).choice):
        return "has branches, and other formulas than the compiled program"
    return difference
