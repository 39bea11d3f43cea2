"""The numpydoc text of a kernel, made from its record when somebody asks for it."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from .definition import Definition, Shape
from .layout import Layout

_WIDTH = 110


@dataclass(frozen=True, slots=True)
class Facts:
    """What readers are told about a kernel besides its shapes and layouts."""

    cost: str
    """``21 mul, 18 add``"""
    assumes: tuple[str, ...] = ()
    """Relations of the arguments: ``m ~m = 1``."""
    error: str = ""
    """The measured error, ``1.5 ulp, 64 inputs``; empty where none was measured."""


def docstring(definition: Definition, layouts: Mapping[str, Layout], facts: Facts) -> str:
    """The text of a kernel: what it does, its arguments and results, its cost and its error."""
    lines = [*_summary(definition), "", "Parameters", "----------"]
    for name, shape in definition.inputs:
        lines += [f"{name} : array_like, {shape_text(shape)}", *_described(layouts.get(name))]
    kind = "tuple of arrays" if len(definition.outputs) > 1 else "array"
    lines += [f"out : {kind}, optional", "    Where to write; may be an argument.", "", "Returns", "-------"]
    for name, shape in definition.outputs:
        lines += [f"{name} : array, {shape_text(shape)}", *_described(layouts.get(name))]
    lines += ["", "Notes", "-----"]
    forms = [(form.same, form.least, form.once, form.each) for form in definition.forms]
    for sentence in sentences(facts, forms):
        lines += textwrap.wrap(sentence, _WIDTH, break_on_hyphens=False)
    names = ", ".join(name for name, _ in definition.inputs)
    return "\n".join([*lines, f"Inside numba: ``{definition.name}.jit({names})``, of arrays and tuples.", ""])


def _summary(definition: Definition) -> list[str]:
    return inspect.cleandoc(definition.function.__doc__ or definition.name).splitlines()


def sentences(facts: Facts, forms: Iterable[tuple[Sequence[str], int, str, str]]) -> list[str]:
    """What is assumed, what it costs, also in its forms, and how accurate it is, a sentence each.

    Forms are by the fields `same`, `least`, `once` and `each` of `Form`.
    """
    found = []
    if facts.assumes:
        found.append(f"Assumes {', '.join(f'``{relation}``' for relation in facts.assumes)}.")
    found += [f"Costs {facts.cost}.", *(_form_sentence(*form) for form in forms)]
    if facts.error:
        ulp, _, inputs = facts.error.partition(", ")
        found.append(f"Error: {ulp} of the largest coefficient, {inputs.replace(' ', ' random ')}.")
    return found


def _form_sentence(same: Sequence[str], least: int, once: str, each: str) -> str:
    """What a form costs."""
    names = " and ".join(f"`{name}`" for name in same)
    verb = "is" if len(same) == 1 else "are"
    return f"Where {names} {verb} the same for {least} elements or more: {once} once, then {each} for each element."


def shape_text(shape: Shape) -> str:
    """The shape of a part of a batch as readers know it: ``(..., 8)``."""
    return f"({', '.join(['...', *map(str, shape)])})"


def layout_text(name: str, blades: Sequence[str], fixed: Sequence[tuple[str, str]], unit: bool) -> str:
    """A layout as a sentence; the arguments are fields of `Layout`."""
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
