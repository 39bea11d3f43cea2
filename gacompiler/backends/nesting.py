"""Convert programs to statements of nested expressions, the form that the printers of C and Python write and read back.

A value is assigned to a variable if it is used more than once, if the expression that contains it would not fit on one
line, or if an operation reads its operand more than once. Every other value is written where it is used. The operations
and their operands are those of the program, so that every result is rounded in the same way.

The length of a line is measured in the language that is printed. In Python, components are named after the initials of
their argument, ``m_e12`` for ``motor_e12``, and a value that only divides an expression precedes the statement that
uses it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from ..ir.program import Argument, Line, Operand, Program, Result
from ..ir.scalar import Op
from ..ir.verify import verify
from .printers import PYTHON, C, Names, Notation, Written

WIDTHS: Mapping[Notation, int] = {C: 92, PYTHON: 105}
"""The longest expressions: with the declaration or the tuple around it, a line has at most 120 characters."""

_BY_NAME = {Op.MINIMUM: (0, 1), Op.MAXIMUM: (0, 1), Op.SELECT: (1, 2)}
"""Operands that must be names or numbers: macros evaluate them more than once, or only if they are selected."""


@dataclass(frozen=True, slots=True)
class Node:
    """An operation on trees."""

    op: Op
    operands: tuple[Tree, ...]


Tree = Operand | Node
"""A variable by name, an exact constant, or an operation on trees."""

Shape = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Nested:
    """A program in the form in which it is printed, with legal and distinct names.

    Attributes
    ----------
    parameters, outputs : tuple of str
        The names of arguments and results; a scalar argument is its only component.
    components : tuple of tuples of (str or None)
        The names of the components of each argument, or None for components that are not used.
    statements : tuple of (str, Node)
        The named values in order.
    results : tuple of tuples of Tree
        The entries of each result.
    """

    parameters: tuple[str, ...]
    outputs: tuple[str, ...]
    components: tuple[tuple[str | None, ...], ...]
    statements: tuple[tuple[str, Node], ...]
    results: tuple[tuple[Tree, ...], ...]


def nested(program: Program, notation: Notation = C) -> Nested:
    """Return the statements as which a program is printed, in the order of its lines."""
    names = Names(program)
    parameters = tuple(names.parameters(program))
    used = used_variables(program)
    wanted = _short_names(program.arguments, parameters) if notation == PYTHON else {}
    components = tuple(
        tuple(names.define(each, wanted.get(each, "")) if each in used else None for each in argument.components)
        if argument.shape
        else (parameter if argument.components[0] in used else None,)
        for argument, parameter in zip(program.arguments, parameters, strict=True)
    )
    kept, divided = _named(program, names, notation)
    lines = {line.target: line for line in program.lines}
    trees: dict[str, Tree] = {}
    statements: list[tuple[str, Node]] = []

    def tree(operand: Operand) -> Tree:
        if not isinstance(operand, str):
            return operand
        return trees[operand] if operand in trees else names.variable(operand)

    def write(target: str) -> None:
        line = lines[target]
        node = Node(line.op, tuple(map(tree, line.operands)))
        if target in kept or target in divided:
            statements.append((names.define(target, f"t{len(statements)}"), node))
        else:
            trees[target] = node

    if notation == PYTHON:
        ends = [operand for result in program.results for operand in result.operands if operand in lines]
        written: set[Operand] = set()
        for end in (*(line.target for line in program.lines if line.target in kept), *ends):
            for target in _before(str(end), lines, written):
                write(target)
    else:
        for line in program.lines:
            write(line.target)
    results = tuple(tuple(map(tree, result.operands)) for result in program.results)
    # Results are named last, since their names do not occur in Python.
    outputs = tuple(names.fresh(result.name) for result in program.results)
    return Nested(parameters, outputs, components, tuple(statements), results)


def _before(end: str, lines: Mapping[str, Line], written: set[Operand]) -> Iterator[str]:
    """Yield the values that `end` is computed from and that are not written yet, operands first, and then itself."""
    stack = [(end, False)]
    while stack:
        target, is_ready = stack.pop()
        if is_ready:
            yield target
        elif target not in written:
            written.add(target)
            stack.append((target, True))
            stack += [(o, False) for o in reversed(lines[target].operands) if isinstance(o, str) and o in lines]


def expression(tree: Tree, notation: Notation) -> Written:
    """Return the text of a tree."""
    if isinstance(tree, Node):
        return notation.operation(tree.op, [expression(operand, notation) for operand in tree.operands])
    return notation.variable(tree) if isinstance(tree, str) else notation.number(tree)


def used_variables(program: Program) -> frozenset[str]:
    """Return the variables that are read by a line or a result."""
    return frozenset(operand for operand in _read(program) if isinstance(operand, str))


def _read(program: Program) -> Iterator[Operand]:
    """Yield the operands of all lines and results."""
    for line in program.lines:
        yield from line.operands
    for result in program.results:
        yield from result.operands


def _short_names(arguments: Sequence[Argument], parameters: Sequence[str]) -> dict[str, str]:
    """Return names of components with the initials of their arguments, or with more letters if these are not distinct.

    The components of a program that was read from a text have these names already.
    """
    arrays = [pair for pair in zip(arguments, parameters, strict=True) if pair[0].shape]
    words = [re.findall(r"[A-Za-z]+|\d+", parameter) for _, parameter in arrays]
    initials = [parameter for _, parameter in arrays]
    for n_letters in range(max((len(word) for each in words for word in each), default=0), 0, -1):
        found = ["".join(word[:n_letters] if word.isalpha() else word for word in each) for each in words]
        if len(set(found)) == len(found) and all(found):
            initials = found
    short = {}
    for (argument, _), letters in zip(arrays, initials, strict=True):
        for component in argument.components:
            start = next((s for s in (f"{argument.name}_", f"{letters}_") if component.startswith(s)), None)
            if start is not None:
                short[component] = f"{letters}_{component[len(start) :]}"
    return short


def _named(program: Program, names: Names, notation: Notation) -> tuple[set[str], set[str]]:
    """Return the targets of the lines that are separate statements: those of any text, and those that divide a line."""
    uses = Counter(operand for operand in _read(program) if isinstance(operand, str))
    name, width = notation.variable("t" * len(f"t{len(program.lines)}")), WIDTHS[notation]
    kept = {line.target for line in program.lines if uses[line.target] > 1}
    divided: set[str] = set()
    inner: dict[str, Written] = {}

    def text(operand: Operand) -> Written:
        if not isinstance(operand, str):
            return notation.number(operand)
        if operand in kept or operand in divided:
            return name
        return inner.get(operand) or notation.variable(names.variable(operand))

    for line in program.lines:
        kept.update(o for k, o in enumerate(line.operands) if k in _BY_NAME.get(line.op, ()) and o in inner)  # type: ignore[misc]
        written = notation.operation(line.op, [text(operand) for operand in line.operands])
        while len(written.text) > width:
            whole = [o for o in line.operands if isinstance(o, str) and o not in kept and o not in divided]
            nodes = [o for o in whole if o in inner]
            if not nodes:
                break
            divided.add(max(nodes, key=lambda node: len(inner[node].text)))
            written = notation.operation(line.op, [text(operand) for operand in line.operands])
        if line.target not in kept:
            inner[line.target] = written
    return kept, divided - kept


def with_coefficients(program: Program) -> Program:
    """Rename the components of the first argument, the prepared coefficients, to ``c0``, ``c1`` and so on."""
    prepared, *rest = program.arguments
    others, letter = used_variables(program).difference(prepared.components), "c"
    while any(other.startswith(letter) and other[len(letter) :].isdigit() for other in others):
        letter += "c"
    names: dict[Operand, Operand] = {old: f"{letter}{k}" for k, old in enumerate(prepared.components)}

    def renamed(operands: Sequence[Operand]) -> tuple[Operand, ...]:
        return tuple(names.get(operand, operand) for operand in operands)

    return Program(
        program.name,
        (Argument(prepared.name, prepared.shape, tuple(map(str, names.values()))), *rest),
        tuple(Line(line.target, line.op, renamed(line.operands)) for line in program.lines),
        tuple(Result(result.name, result.shape, renamed(result.operands)) for result in program.results),
    )


def flattened(name: str, shapes: Sequence[Shape], out_shapes: Sequence[Shape], text: Nested) -> Program:
    """Convert nested statements to a program with one operation per line and arguments and results of these shapes."""
    lines: list[Line] = []

    def operand(tree: Tree) -> Operand:
        return computed(tree) if isinstance(tree, Node) else tree

    def computed(node: Node, target: str = "") -> str:
        operands = tuple(map(operand, node.operands))
        # Names in emitted text never contain this character.
        lines.append(Line(target or f"#{len(lines)}", node.op, operands))
        return lines[-1].target

    arguments = tuple(
        Argument(parameter, shape, tuple(known or f"{parameter}[{k}]" for k, known in enumerate(components)))
        if shape
        else Argument(parameter, shape, (parameter,))
        for parameter, shape, components in zip(text.parameters, shapes, text.components, strict=True)
    )
    for target, tree in text.statements:
        computed(tree, target)
    results = tuple(
        Result(output, shape, tuple(map(operand, trees)))
        for output, shape, trees in zip(text.outputs, out_shapes, text.results, strict=True)
    )
    return verify(Program(name, arguments, tuple(lines), results))
