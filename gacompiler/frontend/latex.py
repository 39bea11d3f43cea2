"""Expressions as LaTeX, in the notation of geometric algebra texts."""

from __future__ import annotations

from typing import Any, Protocol

from ..algebra.algebra import Algebra
from ..algebra.multivector import Multivector


class Node(Protocol):
    """What is printed of an expression: `gacompiler.frontend.expression.Expression`, which uses this module."""

    @property
    def operation(self) -> str:
        """Its name."""

    @property
    def arguments(self) -> tuple[Node, ...]:
        """What the operation is applied to."""

    @property
    def data(self) -> Any:
        """What the operation needs besides."""

    @property
    def algebra(self) -> Algebra:
        """The algebra of the result."""


_BINARY = {
    "geometric_product": r"{0}\,{1}", "outer_product": r"{0} \wedge {1}", "regressive_product": r"{0} \vee {1}",
    "left_contraction": r"{0} \rfloor {1}", "right_contraction": r"{0} \lfloor {1}", "inner_product": r"{0} \cdot {1}",
    "hestenes_product": r"{0} \cdot {1}", "scalar_product": r"{0} * {1}", "commutator": r"{0} \times {1}",
    "anticommutator": r"{0} \bullet {1}", "less": "{0} < {1}", "less_equal": r"{0} \le {1}", "equal": "{0} = {1}",
}  # fmt: skip
_UNARY = {
    "reverse": r"\widetilde{{{0}}}", "grade_involution": r"\widehat{{{0}}}", "clifford_conjugate": r"\overline{{{0}}}",
    "dual": r"{{{0}}}^{{\star}}", "undual": r"{{{0}}}_{{\star}}", "polarity": r"{{{0}}}\,I^{{-1}}",
    "determinant": r"\det({0})",
    "inverse": r"{{{0}}}^{{-1}}", "norm": r"\lVert {0} \rVert", "norm_squared": r"\lVert {0} \rVert^2",
    "normalize": r"\frac{{{0}}}{{\lVert {0} \rVert}}", "sqrt": r"\sqrt{{{0}}}", "abs": r"\lvert {0} \rvert",
}  # fmt: skip
_CLOSED = (
    "input",
    "constant",
    "coefficient",
    "sqrt",
    "norm",
    "norm_squared",
    "abs",
    "reverse",
    "divide",
    "normalize",
    "grade",
)


def latex_of(expression: Node) -> str:
    """The expression in LaTeX, without dollar signs."""
    plain = [latex_of(argument) for argument in expression.arguments]
    inner = [
        text if argument.operation in _CLOSED else rf"\left({text}\right)"
        for argument, text in zip(expression.arguments, plain, strict=True)
    ]
    match expression.operation:
        case "input":
            return symbol(expression.data.components[0] if expression.data.layout.is_scalar else expression.data.name)
        case "constant":
            return constant(expression.data)
        case "add":
            return " + ".join(plain)
        case "subtract":
            return f"{plain[0]} - {inner[1]}"
        case "negate":
            return f"-{inner[0]}"
        case "divide":
            return rf"\frac{{{plain[0]}}}{{{plain[1]}}}"
        case "sandwich":
            return rf"{inner[0]}\,{inner[1]}\,\widetilde{{{plain[0]}}}"
        case "grade":
            return rf"\left\langle {plain[0]} \right\rangle_{{{','.join(map(str, expression.data))}}}"
        case "coefficient":
            sign, blade = expression.data
            name = blade_latex(expression.arguments[0].algebra.spelling(blade)[1])
            return rf"{'-' if sign < 0 else ''}\left[{plain[0]}\right]_{{{name}}}"
        case "select":
            return rf"\begin{{cases}} {plain[1]} & {plain[0]} \\ {plain[2]} & \text{{otherwise}} \end{{cases}}"
        case "assemble":
            names = [
                ("" if s > 0 else "-") + blade_latex(expression.algebra.spelling(b)[1]) for s, b in expression.data
            ]
            return " + ".join(f"{value}\\,{name}" for value, name in zip(inner, names, strict=True))
        case operation if operation in _BINARY:
            return _BINARY[operation].format(*inner)
        case operation if operation in _UNARY:
            wrapped = plain if operation in ("sqrt", "norm", "norm_squared", "abs", "reverse", "normalize") else inner
            return _UNARY[operation].format(*wrapped)
        case operation:
            return rf"\operatorname{{{operation}}}\left({', '.join(plain)}\right)"


def constant(value: Multivector) -> str:
    """A multivector with numeric coefficients."""
    if not value.terms:
        return "0"
    parts = []
    for blade, number in value.terms.items():
        sign, name = value.algebra.spelling(blade)
        signed = number if sign > 0 else -number
        text = (
            str(signed)
            if blade == 0
            else ("" if signed == 1 else "-" if signed == -1 else str(signed)) + blade_latex(name)
        )
        parts.append(text)
    return " + ".join(parts).replace("+ -", "- ")


def blade_latex(name: str) -> str:
    """``e12`` as ``e_{12}``, ``e0inf`` as ``e_{0\\infty}``."""
    if name == "1":
        return "1"
    return " ".join(rf"{part[0]}_{{{part[1:].replace('inf', chr(92) + 'infty ')}}}" for part in name.split("^"))


def symbol(name: str) -> str:
    """A variable's name: what follows the first underscore is a subscript."""
    head, _, tail = name.partition("_")
    if not tail:
        return head if len(head) == 1 else rf"\mathit{{{head}}}"
    body = blade_latex(tail) if tail[0].isalpha() and tail[1:2].isdigit() else tail.replace("_", ",")
    return rf"{symbol(head)}_{{{body}}}"
