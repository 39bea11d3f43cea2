"""Print kernels as Python: pure functions of one element, for compilation by numba, for arrays, and for proofs.

``move_point(m, p)`` takes and returns numbers, tuples of numbers and tuples of rows. Under numba, the components are
numbers; with an array namespace, each component is an array over the batch. Functions such as ``sqrt`` and ``select``
are free names, which must be bound to run the text.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

from ..ir.program import Program
from ..ir.uniform import Uniform, split
from .c_batch import named_parts
from .nesting import Nested, Shape, Tree, expression, nested
from .printers import PYTHON

_WIDTH = 120
_SHORT = 40
"""Longer statements have lines of their own."""

Items = str | list["Items"]
"""Texts in nested tuples."""


def function_text(program: Program) -> list[str]:
    """Return the lines of the function of a program."""
    return _one_function(program, program.name)


def form_functions(program: Program, form: Uniform) -> list[list[str]]:
    """Return the lines of the two functions of a uniform variant.

    There are none if the variant performs the operations of the program, because the runtime separates them itself.
    """
    if form == split(program, form.same):
        return []
    return [_one_function(part, f"_{part.name}") for part in named_parts(program, form)]


def _one_function(program: Program, name: str) -> list[str]:
    """Return the lines of one function: components, statements and results."""
    text = nested(program, PYTHON)
    statements = []
    for argument, parameter, components in zip(program.arguments, text.parameters, text.components, strict=True):
        if argument.shape and any(components):
            items = _shaped(["_" if name is None else name for name in components], argument.shape)
            statements.append(_tuple_lines(items, "    ", "", f" = {parameter}", bare=len(items) > 1))
    statements += [[f"    {name} = {_written(tree)}"] for name, tree in text.statements]
    head = f"def {name}({', '.join(text.parameters)}):"
    return [head, *_statement_lines(statements), *_returned(program, text)]


def _statement_lines(statements: Sequence[list[str]]) -> list[str]:
    """Return the lines of statements; short neighbouring statements share a line as far as they fit."""
    lines: list[str] = []
    is_short = False
    for statement in statements:
        text = statement[0].strip()
        was_short, is_short = is_short, len(statement) == 1 and len(text) <= _SHORT
        if was_short and is_short and len(f"{lines[-1]}; {text}") <= _WIDTH:
            lines[-1] += f"; {text}"
        else:
            lines += statement
    return lines


def _written(tree: Tree) -> str:
    return expression(tree, PYTHON).text


def _returned(program: Program, text: Nested) -> list[str]:
    """Return the lines of the last statement, which returns the result or a tuple of results."""
    results = [
        _shaped([_written(tree) for tree in trees], result.shape)
        for result, trees in zip(program.results, text.results, strict=True)
    ]
    items = results if len(results) > 1 else results[0]
    return [f"    return {items}"] if isinstance(items, str) else _tuple_lines(items, "    ", "return ", "")


def _shaped(texts: Sequence[str], shape: Shape) -> Items:
    """Arrange texts in C order in nested tuples of a shape; without axes, return the single text."""
    if not shape:
        return texts[0]
    size = prod(shape[1:])
    return [_shaped(texts[k * size : (k + 1) * size], shape[1:]) for k in range(shape[0])]


def _on_one_line(items: Items) -> str:
    if isinstance(items, str):
        return items
    return f"({', '.join(map(_on_one_line, items))}{',' if len(items) == 1 else ''})"


def _tuple_lines(items: Sequence[Items], indent: str, head: str, tail: str, bare: bool = False) -> list[str]:
    """Format a tuple on one line if it fits (without parentheses if `bare`), else on as few lines as possible.

    Lines are aligned below the first item. A nested tuple is divided only if it is longer than a line.
    """
    line = _on_one_line(list(items))
    line = f"{indent}{head}{line[1:-1] if bare else line}{tail}"
    if len(line) <= _WIDTH:
        return [line]
    lines, inner = [f"{indent}{head}("], " " * len(f"{indent}{head}(")
    for k, item in enumerate(items):
        after = f"){tail}" if k == len(items) - 1 else ","
        text = f"{_on_one_line(item)}{after}"
        parts = [f"{inner}{text}"]
        if not isinstance(item, str) and len(parts[0]) > _WIDTH:
            parts = _tuple_lines(item, inner, "", after)
        elif k and len(f"{lines[-1]} {text}") <= _WIDTH:
            parts = [f"{lines.pop()} {text}"]
        if not k:
            parts[0] = lines.pop() + parts[0].strip()
        lines += parts
    return lines
