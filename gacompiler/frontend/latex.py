"""Expressions as LaTeX, in the notation of geometric algebra texts."""

from __future__ import annotations

from typing import Any, Protocol

from ..algebra.algebra import Algebra
from ..algebra.latex import blade_latex, constant
from ..algebra.operations import Operation


class Node(Protocol):
    """The interface of `gacompiler.frontend.expression.Expression`, which uses this module."""

    @property
    def operation(self) -> Operation:
        """The operation of the node."""

    @property
    def arguments(self) -> tuple[Node, ...]:
        """The arguments of the operation."""

    @property
    def data(self) -> Any:
        """Additional data of the operation."""

    @property
    def algebra(self) -> Algebra:
        """The algebra of the result."""


def latex_of(expression: Node) -> str:
    """Return the expression in LaTeX, without dollar signs."""
    plain = [latex_of(argument) for argument in expression.arguments]
    inner = [
        text if argument.operation.row.is_closed else rf"\left({text}\right)"
        for argument, text in zip(expression.arguments, plain, strict=True)
    ]
    match expression.operation:
        case Operation.INPUT:
            return symbol(expression.data.components[0] if expression.data.layout.is_scalar else expression.data.name)
        case Operation.CONSTANT:
            return constant(expression.data)
        case Operation.GRADE:
            return rf"\left\langle {plain[0]} \right\rangle_{{{','.join(map(str, expression.data))}}}"
        case Operation.COEFFICIENT:
            sign, blade = expression.data
            name = blade_latex(expression.arguments[0].algebra.spelling(blade)[1])
            return rf"{'-' if sign < 0 else ''}\left[{plain[0]}\right]_{{{name}}}"
        case Operation.ASSEMBLE:
            names = [
                ("" if s > 0 else "-") + blade_latex(expression.algebra.spelling(b)[1]) for s, b in expression.data
            ]
            return " + ".join(f"{value}\\,{name}" for value, name in zip(inner, names, strict=True))
        case operation if operation.row.latex:
            return operation.row.latex.format(*inner, plain=plain)
        case operation:
            return rf"\operatorname{{{operation}}}\left({', '.join(plain)}\right)"


def symbol(name: str) -> str:
    """Return the name of a variable in LaTeX; the part after the first underscore is a subscript."""
    head, _, tail = name.partition("_")
    if not tail:
        return head if len(head) == 1 else rf"\mathit{{{head}}}"
    body = blade_latex(tail) if tail[0].isalpha() and tail[1:2].isdigit() else tail.replace("_", ",")
    return rf"{symbol(head)}_{{{body}}}"
