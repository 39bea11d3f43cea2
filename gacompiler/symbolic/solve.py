"""Solution of multivector equations for symbols and for whole multivectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy

from ..algebra.multivector import Multivector
from ..errors import AlgebraError
from .multivector import SymbolicMultivector, symbolic


def solve(equations: Any, unknown: Any) -> list[Any]:
    """Solve ``equation = 0`` for every coefficient.

    Parameters
    ----------
    equations : SymbolicMultivector, sympy expression, or sequence of them
        Expressions that vanish: write ``a * x - b`` for ``a x = b``. The relations of layouts are not added; use
        `relations` to obtain them.
    unknown : SymbolicMultivector, Symbol, or sequence of symbols
        A multivector made by `symbols` or `unknowns`, or scalar symbols.

    Returns
    -------
    list
        The solutions: multivectors if `unknown` is a multivector, otherwise dictionaries from symbol to expression.
        The list is empty if there is no solution. Free symbols appear in the solutions.

    Examples
    --------
    ``x = unknowns("x", VGA3); solve(a * x - b, x)``
    """
    many = equations if isinstance(equations, Sequence) else [equations]
    system = [each for equation in many for each in _coefficients(equation)]
    if isinstance(unknown, SymbolicMultivector):
        if unknown.layout is None:
            raise AlgebraError("solve()", f"the unknown {unknown}", "a multivector made by symbols() or unknowns()")
        variables = [unknown[blade] for blade in unknown.layout.blades]
    else:
        variables = [unknown] if isinstance(unknown, sympy.Symbol) else list(unknown)
    found = sympy.solve(system, variables, dict=True) if system else [{}]
    if isinstance(unknown, SymbolicMultivector):
        return [unknown.subs(solution) for solution in found]
    return list(found)


def _coefficients(equation: Any) -> list[Any]:
    if isinstance(equation, Multivector):
        return list(symbolic(equation).expressions.values())
    return [sympy.sympify(equation)]
