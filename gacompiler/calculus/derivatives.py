"""Derivatives with respect to multivector variables.

For a variable ``X`` that ranges over some blades, ``d_X F = sum e^J dF/dx_J``, where ``X = sum x_J e_J`` and the
reciprocal blades satisfy ``<e^J e_K> = 1`` if ``J = K``, else 0 (Hestenes & Sobczyk 1984, §2-2).
"""

from __future__ import annotations

from functools import cache
from typing import Any

import sympy

from ..algebra.layout import Layout
from ..algebra.multivector import Multivector
from ..errors import AlgebraError
from ..symbolic import reduce
from ..symbolic.multivector import SymbolicMultivector


def derivative_by(variable: SymbolicMultivector, function: Any) -> SymbolicMultivector:
    """Return the derivative ``d_X F`` with respect to a multivector variable.

    Parameters
    ----------
    variable : SymbolicMultivector
        A multivector made by `symbols` or `unknowns`. Its layout must have no implied coefficients and no relations.
        For a vector variable, the result is the vector derivative.
    function : SymbolicMultivector or sympy expression
        A function of the coefficients of `variable`.

    Raises
    ------
    AlgebraError
        When `variable` has no name, is bound by relations, or ranges over blades whose scalar products are degenerate.
    """
    layout = _free_layout(variable)
    lifted = SymbolicMultivector(variable.algebra, {}).lift(function)
    total = SymbolicMultivector(variable.algebra, {})
    for blade, reciprocal in zip(layout.blades, _reciprocal_blades(layout), strict=True):
        total = total + reciprocal * lifted.diff(variable[blade])
    return reduce(total)


def differential(variable: SymbolicMultivector, direction: Any, function: Any) -> SymbolicMultivector:
    """Return ``A * d_X F``, the derivative of ``F(X + t A)`` with respect to ``t`` at 0; it is linear in `A`.

    Raises
    ------
    AlgebraError, LayoutError
        When `variable` has no name, or `direction` has blades that `variable` lacks.
    """
    layout = _free_layout(variable)
    along = variable.lift(direction)
    components = layout.coefficients(Multivector(along.algebra, along.terms))
    lifted = SymbolicMultivector(variable.algebra, {}).lift(function)
    total = SymbolicMultivector(variable.algebra, {})
    for blade, component in zip(layout.blades, components, strict=True):
        total = total + lifted.diff(variable[blade]) * component
    return reduce(total)


def _free_layout(variable: SymbolicMultivector) -> Layout:
    layout: Layout | None = getattr(variable, "layout", None)
    if layout is None:
        raise AlgebraError("derivative", f"the variable {variable}", "a multivector made by symbols() or unknowns()")
    if layout.has_relations or layout.implied or layout.fixed:
        raise AlgebraError(
            "derivative",
            f"a variable of layout {layout}, whose coefficients are not free",
            "a layout without relations, implied or fixed coefficients",
            "differentiate with respect to its parameters, or to a variable of a free layout such as `even`",
        )
    return layout


@cache
def _reciprocal_blades(layout: Layout) -> tuple[SymbolicMultivector, ...]:
    algebra, n = layout.algebra, layout.size
    basis = [Multivector(algebra, {slot.blade: slot.sign}) for slot in layout.stored]
    gram = sympy.Matrix(n, n, lambda i, j: sympy.sympify((basis[i] * basis[j]).scalar))
    if gram.det() == 0:
        raise AlgebraError(
            f"derivative by {layout}", "degenerate scalar products of its blades", "blades with reciprocals"
        )
    inverse = gram.inv()
    zero = SymbolicMultivector(algebra, {})
    return tuple(sum((zero.lift(basis[j]) * inverse[i, j] for j in range(n)), zero) for i in range(n))
