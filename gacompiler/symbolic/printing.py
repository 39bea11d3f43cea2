"""Printing of symbolic multivectors as text and LaTeX: in one line, by grade, by blade, or with a common factor."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import sympy

from ..algebra.algebra import Algebra
from ..algebra.latex import blade_latex
from ..errors import AlgebraError
from ..frontend.latex import symbol

STYLES = ("line", "grade", "blade", "factored")
_COMPONENT = re.compile(r".*_[a-zA-Z](\d|inf|o)")
"""Symbols that are named after a blade: ``m_e12``."""


class Element(Protocol):
    """The part of the interface of `SymbolicMultivector` that printing uses (that module imports this one)."""

    @property
    def algebra(self) -> Algebra:
        """Its algebra."""

    @property
    def expressions(self) -> Mapping[int, Any]:
        """Coefficients by the bitmap of their blade."""

    @property
    def coefficients(self) -> dict[str, Any]:
        """Coefficients by the name of their blade."""


@dataclass(frozen=True)
class Printed:
    """A multivector with a printing style. It is for display only.

    Attributes
    ----------
    element : SymbolicMultivector
    style : {"line", "grade", "blade", "factored"}
    """

    element: Element
    style: str

    def __post_init__(self) -> None:
        if self.style not in STYLES:
            raise AlgebraError("printing", f"style {self.style!r}", "one of " + ", ".join(STYLES))

    def __str__(self) -> str:
        rows = _rows(self.element, self.style)
        if self.style == "factored":
            factor, rest = common_factor(self.element)
            inside = " + ".join(_text(rest)).replace("+ -", "- ")
            return inside if factor == 1 else f"{_bracketed(factor)}*({inside})"
        return "\n".join(" + ".join(_text(row)).replace("+ -", "- ") for row in rows) or "0"

    def __repr__(self) -> str:
        return f"{self.element.algebra.name}: {self}"

    def _latex(self, printer: object = None) -> str:
        """Return LaTeX without dollar signs, for `sympy.latex`."""
        return self._repr_latex_().strip("$")

    def _repr_latex_(self) -> str:
        if not self.element.expressions:
            return "$0$"
        if self.style == "factored":
            factor, rest = common_factor(self.element)
            inside = _sum(_latex(rest))
            return f"${inside}$" if factor == 1 else rf"${_wrapped(factor)}\left({inside}\right)$"
        rows = [_sum(_latex(row)) for row in _rows(self.element, self.style)]
        if len(rows) == 1:
            return f"${rows[0]}$"
        lines = [f"& {rows[0]}"] + [f"& {row}" if row.startswith("-") else f"& +{row}" for row in rows[1:]]
        return "$\\begin{aligned}\n" + " \\\\\n".join(lines) + "\n\\end{aligned}$"


def plain_text(element: Element) -> str:
    """Return the text of a multivector in one line, in the format of `Multivector`."""
    return str(Printed(element, "line"))


def latex(expression: Any) -> str:
    """Return the LaTeX of a sympy expression, with symbols named after blades as in `gacompiler.frontend.latex`."""
    symbols = {s: symbol(s.name) for s in getattr(expression, "free_symbols", ()) if _COMPONENT.match(s.name)}
    return str(sympy.latex(expression, symbol_names=symbols))


def common_factor(element: Element) -> tuple[Any, Mapping[str, Any]]:
    """Return a common factor of all coefficients, and the remaining factor of each by name of its blade."""
    named = element.coefficients
    if not named:
        return sympy.Integer(1), {}
    fractions = [sympy.fraction(sympy.together(value)) for value in named.values()]
    factor = sympy.gcd_list([n for n, _ in fractions]) / sympy.lcm_list([d for _, d in fractions])
    if factor.is_number and not factor.is_Rational:
        factor = sympy.Integer(1)
    return sympy.factor(factor), {name: sympy.factor(sympy.cancel(value / factor)) for name, value in named.items()}


def _rows(element: Element, style: str) -> list[dict[str, Any]]:
    named = element.coefficients
    if style == "blade":
        return [{name: value} for name, value in named.items()]
    if style == "grade":
        grades = [blade.bit_count() for blade in element.expressions]
        return [
            {name: value for (name, value), k in zip(named.items(), grades, strict=True) if k == wanted}
            for wanted in sorted(set(grades))
        ]
    return [named] if named else []


def _text(row: Mapping[str, Any]) -> list[str]:
    signs = {1: "", -1: "-"}
    return [
        str(value) if name == "1" else f"{signs[value]}{name}" if value in signs else f"{_bracketed(value)}*{name}"
        for name, value in row.items()
    ]


def _bracketed(value: Any) -> str:
    return f"({value})" if value.is_Add else str(value)


def _latex(row: Mapping[str, Any]) -> list[str]:
    return [
        latex(value)
        if name == "1"
        else ("" if value == 1 else "-" if value == -1 else _wrapped(value)) + blade_latex(name)
        for name, value in row.items()
    ]


def _wrapped(value: Any) -> str:
    return rf"\left({latex(value)}\right)" if value.is_Add else latex(value) + r"\,"


def _sum(parts: list[str]) -> str:
    return " + ".join(parts).replace("+ -", "- ")
