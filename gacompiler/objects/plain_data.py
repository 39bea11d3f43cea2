"""Conversion of layouts and algebras to and from plain data that can be stored in files."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.catalog import CATALOG
from ..algebra.layout import Layout
from ..errors import LayoutError

_KNOWN = ("full", "even", "UNIT_EVEN")


def packed(layout: Layout) -> tuple[Any, Any]:
    """Convert the algebra and the layout to names and numbers.

    Raises
    ------
    LayoutError
        If the layout is defined by functions and has no name in the catalog.
    """
    algebra = layout.algebra
    whole: Any = algebra.name
    if CATALOG.get(algebra.name) != algebra:
        gram = [[str(Fraction(x)) for x in row] for row in algebra.gram]
        spellings = " ".join(algebra.spelling(blade)[1] for blade in algebra.blades() if blade.bit_count() > 1)
        whole = (algebra.name, algebra.vectors, gram, spellings)
    named = algebra.layouts.get(layout.name) or (getattr(algebra, layout.name) if layout.name in _KNOWN else None)
    if named == layout and isinstance(whole, str):
        return whole, layout.name
    if layout.implied or layout.user_relations is not None:
        raise LayoutError(f"saving a {layout}", "a layout with functions", "a layout of the catalog, or plain blades")
    fixed = {slot.name: str(value) for slot, value in layout.fixed}
    return whole, (layout.name, " ".join(layout.blades), fixed, layout.unit)


def unpacked(algebra: Any, layout: Any) -> Layout:
    """Return the layout of the result of `packed`."""
    if isinstance(algebra, str):
        owner = CATALOG[algebra]
    else:
        name, vectors, gram, spellings = algebra
        owner = Algebra(name, vectors, [[Fraction(x) for x in row] for row in gram], spellings)
    if isinstance(layout, str):
        found: Layout = getattr(owner, layout)
        return found
    name, blades, fixed, unit = layout
    return owner.layout(name, blades, fixed={k: Fraction(v) for k, v in fixed.items()}, unit=unit)
