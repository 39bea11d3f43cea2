"""The Python text of a kernel: a pure function of one element that numba compiles, arrays run, and a proof reads.

``move_point(m, p)`` takes numbers, tuples of numbers and tuples of rows, and returns such: under numba numbers, and
whole arrays of any namespace where each component of a batch is an array. Functions are free names (``sqrt``,
``select``): whoever runs the text binds them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import prod

from ..ir.program import Program
from ..ir.uniform import Uniform
from .c_batch import named_parts
from .nesting import Nested, Shape, Tree, expression, nested
from .printers import PYTHON

_WIDTH = 120
_SHORT = 40
"""Longer entries of a tuple that does not fit on one line have a line of their own."""

Items = str | list["Items"]
"""Texts in nested tuples."""


def function_text(program: Program, forms: Sequence[Uniform] = ()) -> list[list[str]]:
    """The lines of a kernel, and then of both functions of each of its forms."""
    parts = [part for form in forms for part in named_parts(program, form)]
    return [_one_function(program, program.name), *(_one_function(part, f"_{part.name}") for part in parts)]


def _one_function(program: Program, name: str) -> list[str]:
    """The lines of one function: components, statements, results."""
    text = nested(program)
    lines = [f"def {name}({', '.join(text.parameters)}):"]
    for argument, parameter, components in zip(program.arguments, text.parameters, text.components, strict=True):
        if argument.shape and any(components):
            items = _shaped(["_" if name is None else name for name in components], argument.shape)
            lines += _tuple_lines(items, "    ", "", f" = {parameter}", bare=len(items) > 1)
    lines += [f"    {name} = {_written(tree)}" for name, tree in text.statements]
    return lines + _returned(program, text)


def _written(tree: Tree) -> str:
    return expression(tree, PYTHON).text


def _returned(program: Program, text: Nested) -> list[str]:
    """The last statement; several results are a tuple of them."""
    results = [
        _shaped([_written(tree) for tree in trees], result.shape)
        for result, trees in zip(program.results, text.results, strict=True)
    ]
    items = results if len(results) > 1 else results[0]
    return [f"    return {items}"] if isinstance(items, str) else _tuple_lines(items, "    ", "return ", "")


def _shaped(texts: Sequence[str], shape: Shape) -> Items:
    """Texts in C order in nested tuples of that shape; one text alone if it has no axes."""
    if not shape:
        return texts[0]
    size = prod(shape[1:])
    return [_shaped(texts[k * size : (k + 1) * size], shape[1:]) for k in range(shape[0])]


def _on_one_line(items: Items) -> str:
    if isinstance(items, str):
        return items
    return f"({', '.join(map(_on_one_line, items))}{',' if len(items) == 1 else ''})"


def _tuple_lines(items: Sequence[Items], indent: str, head: str, tail: str, bare: bool = False) -> list[str]:
    """A tuple on one line if it fits, `bare` without parentheses; else on as few as hold its items."""
    line = _on_one_line(list(items))
    line = f"{indent}{head}{line[1:-1] if bare else line}{tail}"
    if len(line) <= _WIDTH:
        return [line]
    return [f"{indent}{head}(", *_filled(items, f"{indent}    "), f"{indent}){tail}"]


def _filled(items: Sequence[Items], indent: str) -> Iterator[str]:
    """Items with commas behind them: neighbours that are short on one line as far as they fit, others alone."""
    line: list[str] = []
    for item in items:
        text = f"{_on_one_line(item)},"
        if line and (max(len(text), len(line[-1])) > _SHORT or len(indent + " ".join([*line, text])) > _WIDTH):
            yield indent + " ".join(line)
            line = []
        if isinstance(item, str) or len(indent + text) <= _WIDTH:
            line.append(text)
        else:
            yield from _tuple_lines(item, indent, "", ",")
    if line:
        yield indent + " ".join(line)
