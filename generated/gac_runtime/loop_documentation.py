"""Numpydoc docstrings and signatures of kernels with loops, generated on request."""

from __future__ import annotations

import inspect
import keyword
import textwrap
from typing import Any

from .documentation import Facts, layout_text, sentences
from .loop_definition import LoopDefinition, Table

_WIDTH = 110


class Described:
    """Descriptor for ``__doc__`` of a class and of each of its kernels."""

    def __init__(self, text: str) -> None:
        self._text = text

    def __get__(self, kernel: Any, owner: type) -> str:
        return self._text if kernel is None else kernel.describe()


class LoopSignature:
    """Descriptor for the signature of a kernel, as `inspect` reads it."""

    def __get__(self, kernel: Any, owner: type) -> inspect.Signature:
        if kernel is None:
            raise AttributeError("__signature__ is defined for kernels only, not for their class")
        kinds = inspect.Parameter
        names = kernel.argument_names
        is_bound = hasattr(kernel, "kernel")
        reserved = is_bound or any(map(keyword.iskeyword, names))
        kind = kinds.POSITIONAL_ONLY if reserved else kinds.POSITIONAL_OR_KEYWORD
        named = [kinds(name, kinds.KEYWORD_ONLY, default=None) for name in ("out", "num_threads")]
        return inspect.Signature([*(kinds(name, kind) for name in names), *named])


def docstring(definition: LoopDefinition, facts: Facts) -> str:
    """Return the docstring of a kernel with loops: summary, arguments, results, cost and error."""
    lines = [*inspect.cleandoc(definition.function.__doc__ or definition.name).splitlines(), ""]
    lines += ["Parameters", "----------"]
    for table in definition.parameters:
        kind = "array_like of int" if table.is_index else "array_like"
        lines += [f"{table.name} : {kind}, {table.shape_text}", *_described(definition, table)]
    kind = "tuple of arrays" if len(definition.results) > 1 else "array"
    lines += [f"out : {kind}, optional", "    Array for the result; may be an argument.", "", "Returns", "-------"]
    for table in definition.results:
        lines += [f"{table.name} : array, {table.shape_text}", *_described(definition, table)]
    lines += ["", "Notes", "-----"]
    for sentence in sentences(facts, ()):
        lines += textwrap.wrap(sentence, _WIDTH, break_on_hyphens=False)
    return "\n".join([*lines, ""])


def _described(definition: LoopDefinition, table: Table) -> list[str]:
    if table.is_index:
        return [f"    Each entry is the index of {table.rule} of {table.into}."]
    layout = definition.layouts.get(table.name)
    text = layout_text(*layout[:4]) if layout is not None else ""
    text += " Fastest if one array is shared by all elements of a batch." if table.shared else ""
    indent = "    "
    return textwrap.wrap(text.strip(), _WIDTH, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)
