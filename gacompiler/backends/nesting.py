"""Convert programs to statements of nested expressions, the form that the printers of C and Python write and read back.

A value is assigned to a variable if it is used more than once, if the expression that contains it would not fit on one
line, or if an operation reads its operand more than once. Every other value is written where it is used. The operations
and their operands are those of the program, so that every result is rounded in the same way.

The length of a line is measured in C, whose text is longer, so that both languages have the same statements.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ..ir.program import Argument, Line, Operand, Program, Result
from ..ir.scalar import Op
from ..ir.verify import verify
from .printers import C, Names, Notation, Written

WIDTH = 92
"""The longest expression: with the declaration of a constant around it, a line of C has at most 116 characters."""

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


def nested(program: Program) -> Nested:
    """Return the statements as which a program is printed, in the order of its lines."""
    names = Names(program)
    parameters = tuple(names.parameters(program))
    used = used_variables(program)
    components = tuple(
        tuple(names.define(component) if component in used else None for component in argument.components)
        if argument.shape
        else (parameter if argument.components[0] in used else None,)
        for argument, parameter in zip(program.arguments, parameters, strict=True)
    )
    named = _named(program, names)
    trees: dict[str, Tree] = {}
    statements: list[tuple[str, Node]] = []

    def tree(operand: Operand) -> Tree:
        if not isinstance(operand, str):
            return operand
        return trees[operand] if operand in trees else names.variable(operand)

    for line in program.lines:
        node = Node(line.op, tuple(map(tree, line.operands)))
        if line.target in named:
            statements.append((names.define(line.target, f"t{len(statements)}"), node))
        else:
            trees[line.target] = node
    results = tuple(tuple(map(tree, result.operands)) for result in program.results)
    # Results are named last, since their names do not occur in Python.
    outputs = tuple(names.fresh(result.name) for result in program.results)
    return Nested(parameters, outputs, components, tuple(statements), results)


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


def _named(program: Program, names: Names) -> frozenset[str]:
    """Return the targets of the lines that are separate statements."""
    uses = Counter(operand for operand in _read(program) if isinstance(operand, str))
    name = C.variable("t" * len(f"t{len(program.lines)}"))
    named = {line.target for line in program.lines if uses[line.target] > 1}
    inner: dict[str, Written] = {}

    def text(operand: Operand) -> Written:
        if not isinstance(operand, str):
            return C.number(operand)
        if operand in named:
            return name
        return inner.get(operand) or C.variable(names.variable(operand))

    for line in program.lines:
        named.update(o for k, o in enumerate(line.operands) if k in _BY_NAME.get(line.op, ()) and o in inner)  # type: ignore[misc]
        written = C.operation(line.op, [text(operand) for operand in line.operands])
        while len(written.text) > WIDTH:
            nodes = [o for o in line.operands if isinstance(o, str) and o in inner and o not in named]
            if not nodes:
                break
            named.add(max(nodes, key=lambda node: len(inner[node].text)))
            written = C.operation(line.op, [text(operand) for operand in line.operands])
        if line.target not in named:
            inner[line.target] = written
    return frozenset(named)


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
