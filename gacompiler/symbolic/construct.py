"""Making symbolic multivectors: by name and layout, or from coefficients."""

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
    """Symbols by name: multivectors of a layout, or scalars.

    Parameters
    ----------
    names : str
        One or several names, apart by spaces or commas.
    layout : Layout, optional
        What they are: ``PGA3.MOTOR``, ``VGA3.VECTOR``, ``CGA3.full``. The stored coefficients are symbols called after
        the name and the blade, such as ``m_e12``; fixed and implied ones are filled in. Without it, sympy symbols.
    **assumptions
        As `sympy.symbols` takes them; ``real=True`` unless said otherwise.

    Returns
    -------
    SymbolicMultivector, Symbol, or tuple of them
        A tuple where there are several names.

    Raises
    ------
    LayoutError
        When `layout` is no layout, or a name is none that Python takes.
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
    """A multivector with a symbol for each blade of the given grades (of all by default), without relations."""
    blades = " ".join(algebra.spelling(blade)[1] for blade in algebra.blades(*grades))
    return _named(name, algebra.layout(name, blades), {"real": True} | assumptions)


def multivector(algebra: Algebra | Layout, coefficients: Any = 0) -> SymbolicMultivector:
    """A symbolic multivector from its coefficients.

    Parameters
    ----------
    algebra : Algebra or Layout
    coefficients : mapping, sequence, multivector or scalar
        Spelled blades to numbers and sympy expressions; the stored coefficients in order where a layout is given.

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
