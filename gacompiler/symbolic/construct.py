"""Construction of symbolic multivectors, from a name and a layout or from coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy

from ..algebra.algebra import Algebra
from ..algebra.layout import Layout
from ..algebra.multivector import Multivector
from ..errors import LayoutError
from ..frontend.kernel import Parameter
from .multivector import SymbolicMultivector, symbolic


def symbols(names: str, layout: Layout | None = None, **assumptions: Any) -> Any:
    """Create symbolic multivectors or scalar symbols by name.

    Parameters
    ----------
    names : str
        One or several names, separated by spaces or commas.
    layout : Layout, optional
        The layout of the multivectors, such as ``PGA3.MOTOR``, ``VGA3.VECTOR`` or ``CGA3.full``. Each stored
        coefficient is a symbol named after the multivector and the blade, such as ``m_e12``. Fixed and implied
        coefficients are filled in. Without a layout, sympy symbols are returned.
    **assumptions
        Assumptions about the symbols, as in `sympy.symbols`. The default is ``real=True``.

    Returns
    -------
    SymbolicMultivector, Symbol, or tuple of them
        A tuple if there are several names.

    Raises
    ------
    LayoutError
        When `layout` is not a layout, or a name is not a valid Python identifier.
    """
    if layout is not None and not isinstance(layout, Layout):
        remedy = f"one of {' '.join([*layout.layouts, 'full', 'even'])}" if isinstance(layout, Algebra) else ""
        raise LayoutError("symbols()", f"layout {layout!r}", "a layout such as VGA3.VECTOR", remedy)
    given = {"real": True} | assumptions
    if assumptions.get("complex") or assumptions.get("imaginary"):
        del given["real"]
    parts = names.replace(",", " ").split()
    if not parts or not all(part.isidentifier() for part in parts):
        raise LayoutError("symbols()", f"names {names!r}", 'names such as "a b"')
    found = [sympy.Symbol(name, **given) if layout is None else _named(name, layout, given) for name in parts]
    return found[0] if len(found) == 1 else tuple(found)


def _named(name: str, layout: Layout, assumptions: Mapping[str, Any]) -> SymbolicMultivector:
    components = [sympy.Symbol(component, **assumptions) for component in Parameter(name, layout).components]
    return SymbolicMultivector(layout.algebra, layout.element(components).terms, name=name, layout=layout)


def unknowns(name: str, algebra: Algebra, *grades: int, **assumptions: Any) -> SymbolicMultivector:
    """Return a multivector without relations, with one symbol for each blade of the given grades (default: all)."""
    blades = " ".join(algebra.spelling(blade)[1] for blade in algebra.blades(*grades))
    return _named(name, algebra.layout(name, blades), {"real": True} | assumptions)


def multivector(algebra: Algebra | Layout, coefficients: Any = 0) -> SymbolicMultivector:
    """Create a symbolic multivector from its coefficients.

    Parameters
    ----------
    algebra : Algebra or Layout
    coefficients : mapping, sequence, multivector or scalar
        A mapping from blade names to numbers or sympy expressions. With a layout, the sequence of the stored
        coefficients in the order of the layout.

    Examples
    --------
    ``multivector(VGA3, {"e1": x, "e23": sin(x)})``, ``multivector(PGA3.POINT, [x, y, z])``
    """
    if isinstance(algebra, Layout):
        if isinstance(coefficients, (str, Mapping)) or not hasattr(coefficients, "__len__"):
            expected = f"{algebra.size} coefficients: {' '.join(algebra.blades)}"
            raise LayoutError(f"multivector({algebra})", f"{coefficients!r}", expected)
        return SymbolicMultivector(algebra.algebra, algebra.element([sympy.sympify(c) for c in coefficients]).terms)
    if isinstance(coefficients, Mapping):
        return symbolic(algebra.multivector({name: sympy.sympify(value) for name, value in coefficients.items()}))
    if isinstance(coefficients, Multivector):
        return SymbolicMultivector(algebra, {}).lift(coefficients)
    return SymbolicMultivector(algebra, {0: coefficients})
