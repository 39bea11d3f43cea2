"""Numpydoc docstrings of kernels, generated on request from their definitions."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .definition import Definition, Shape

if TYPE_CHECKING:
    from .layout import Layout

_WIDTH = 110


@dataclass(frozen=True, slots=True)
class Facts:
    """The documented facts about a kernel besides its shapes and layouts."""

    cost: str
    """``21 mul, 18 add``"""
    assumes: tuple[str, ...] = ()
    """Relations of the arguments: ``m ~m = 1``."""
    error: str = ""
    """The measured error, ``1.5 ulp, 29 inputs`` or ``1.5 ulp`` for 64 inputs; empty if it was not measured."""


def docstring(definition: Definition, layouts: Mapping[str, Layout], facts: Facts) -> str:
    """Return the docstring of a kernel: summary, arguments, results, cost and error."""
    lines = [*_summary(definition), "", "Parameters", "----------"]
    for name, shape in definition.inputs:
        lines += [f"{name} : array_like, {shape_text(shape)}", *_described(layouts.get(name))]
    kind = "tuple of arrays" if len(definition.outputs) > 1 else "array"
    lines += [f"out : {kind}, optional", "    Array for the result; may be an argument.", "", "Returns", "-------"]
    for name, shape in definition.outputs:
        lines += [f"{name} : array, {shape_text(shape)}", *_described(layouts.get(name))]
    lines += ["", "Notes", "-----"]
    forms = [(form.same, form.least, form.once, form.each) for form in definition.forms]
    for sentence in sentences(facts, forms):
        lines += textwrap.wrap(sentence, _WIDTH, break_on_hyphens=False)
    names = ", ".join(name for name, _ in definition.inputs)
    return "\n".join([*lines, f"Call within numba: ``{definition.name}.jit({names})``, with arrays or tuples.", ""])


def _summary(definition: Definition) -> list[str]:
    return inspect.cleandoc(definition.function.__doc__ or definition.name).splitlines()


def sentences(facts: Facts, forms: Iterable[tuple[Sequence[str], int, str, str]]) -> list[str]:
    """Return one sentence each for the assumptions, the cost, the cost of each form, and the error.

    Forms are given by the fields `same`, `least`, `once` and `each` of `Form`.
    """
    found = []
    if facts.assumes:
        found.append(f"Assumes {', '.join(f'``{relation}``' for relation in facts.assumes)}.")
    found += [f"Costs {facts.cost}.", *(_form_sentence(*form) for form in forms)]
    if facts.error:
        ulp, _, inputs = facts.error.partition(", ")
        found.append(f"Error: {ulp} of the largest coefficient, {(inputs or '64 inputs').replace(' ', ' random ')}.")
    return found


def _form_sentence(same: Sequence[str], least: int, once: str, each: str) -> str:
    """Return a sentence for the cost of a form."""
    names = " and ".join(f"`{name}`" for name in same)
    verb = "is" if len(same) == 1 else "are"
    return f"If {names} {verb} the same for {least} or more elements: {once} once, then {each} for each element."


def shape_text(shape: Shape) -> str:
    """Return the shape of an argument or result as it is documented, ``(..., 8)``."""
    return f"({', '.join(['...', *map(str, shape)])})"


def layout_text(name: str, blades: Sequence[str], fixed: Sequence[tuple[str, str]], unit: bool) -> str:
    """Describe a layout in one sentence; the arguments are fields of `Layout`."""
    if not blades:
        return f"{name}."
    text = f"{name}: {', '.join(blades)}"
    if fixed:
        text += f"; with {', '.join(f'{blade} = {value}' for blade, value in fixed)}"
    if unit:
        text += "; unit"
    return f"{text}."


def _described(layout: Layout | None) -> list[str]:
    if layout is None:
        return []
    return textwrap.wrap(
        layout_text(*layout[:4]), _WIDTH, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False
    )
