"""Constructors of the plane and of space on expressions, so that kernels use them as programs do.

``PGA3.motor(p & q, angle)`` has the same forms of arguments and the same result for the parameters of a kernel as for
objects. Degenerate arguments cannot be refused, since they are known only when the kernel runs: the line through a
point and itself has coefficients 0, and its normalization is NaN.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..algebra.layout import Layout
from ..errors import LayoutError
from ..frontend.expression import Expression
from ..frontend.functions import sqrt
from ..frontend.operations import assemble
from .layouts import layout_of


def is_symbolic(x: Any) -> bool:
    """Whether a value is an expression, or coordinates with at least one."""
    if type(x) is float or type(x) is int:
        return False
    if isinstance(x, (list, tuple)):
        return any(map(is_symbolic, x))
    return isinstance(x, Expression) or (isinstance(x, np.ndarray) and x.dtype == object and is_symbolic(list(x)))


def layout_in(x: Any) -> Layout:
    """Return the layout of an element, or one of the blades that can occur in an expression."""
    return layout_of(x.algebra, x.blades) if isinstance(x, Expression) else x.layout


def coordinates(x: Any) -> np.ndarray[Any, Any]:
    """Return numbers and expressions as an array of objects."""
    found = np.empty(len(x), object)
    found[:] = list(x)
    return found


def assembled(layout: Layout, given: tuple[Any, ...]) -> Any:
    """Return the element of a layout with these stored coefficients; an expression that is an element is one already.

    Raises
    ------
    LayoutError
        If the number of coefficients is not that of the layout, or an element may have other blades.
    """
    if len(given) == 1 and isinstance(given[0], Expression) and not given[0].is_scalar:
        if not given[0].blades <= layout.support:
            names = " ".join(layout.algebra.spelling(blade)[1] for blade in sorted(given[0].blades - layout.support))
            raise LayoutError(str(layout), f"an element with {names}", f"only {' '.join(layout.blades)}")
        return given[0]
    parts = tuple(given[0]) if len(given) == 1 and isinstance(given[0], (list, tuple, np.ndarray)) else given
    if len(parts) != layout.size:
        raise LayoutError(str(layout), f"{len(parts)} coefficients", f"{layout.size}: {' '.join(layout.blades)}")
    return by_blade(layout.algebra, layout.element(list(parts)).terms)


def by_blade(algebra: Any, terms: Mapping[int, Any]) -> Any:
    """Return the multivector with these coefficients by bitmap."""
    spelled = {blade: algebra.spelling(blade) for blade in terms}
    return assemble(algebra, {name: terms[blade] * sign for blade, (sign, name) in spelled.items()})


def unit(x: Expression) -> Any:
    """Return a direction divided by its length."""
    return x / sqrt(sum(x.coefficient_at(blade) * x.coefficient_at(blade) for blade in sorted(x.blades)))


def built(space: Any, name: str, builder: str, parts: list[Any]) -> Any:
    """Return the expression of an object from arguments that are converted to the roles of a form."""
    match builder:
        case "_flat":
            return space._spanned(*parts)
        case "_round":
            return space._wedge(*parts)
        case "_line_of" | "_plane_of":
            return space._of_equation(name, list(parts[0]))
        case "_plane_with":
            line, point = parts
            return point ^ line if hasattr(space, "_wedge") else line & point
    return getattr(space, builder)(name, *parts)
