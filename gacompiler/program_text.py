"""Comparison of a program that was read from a text with the author's definition."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from .backends import as_printed
from .ir.program import Program
from .passes.prove import Truth, disagreement, program_reader, read


def without_names(programs: Iterable[Program]) -> list[Program]:
    """Return programs without the names of results, in which the texts of two languages differ."""
    return [replace(each, results=tuple(replace(result, name="") for result in each.results)) for each in programs]


def difference_of_program(text: Program, program: Program, known: Sequence[Truth]) -> str:
    """Describe how a text differs from the definition at the given points.

    If the text cannot hold the exact numbers of its program, the program is compared with the definition, and the text
    with the program whose numbers are rounded once.
    """
    printed = as_printed(program)
    if printed == program:
        return disagreement(program_reader(text), known)
    difference = disagreement(program_reader(program), known)
    if difference:
        return difference
    reader = program_reader(printed)
    return disagreement(
        program_reader(text), [replace(truth, results=(tuple(read(reader, truth)),), again=None) for truth in known]
    )
