"""Layouts of results, those of unit elements and with names where there are any, and layouts of generated modules."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

from ..algebra import catalog
from ..algebra.algebra import Algebra
from ..algebra.layout import SCALAR, SCALARS, Layout
from ..gac_runtime.layout import Layout as PlainLayout
from ..generation import layouts
from .caches import cached_by_name

plain_layout = cached_by_name(layouts.plain_layout)


def chosen_layout(layout: Layout, unit: bool) -> Layout:
    """Return the layout for a result: one of unit elements if it is known to be one, else a named one if possible.

    Coefficients that are constant for this operation are stored unless they are fixed in a named layout. Otherwise
    sums of points would have a new layout after every summand.
    """
    if layout.is_scalar or layout.algebra == SCALARS:
        return layout
    named = list(layout.algebra.layouts.values())
    if unit:
        units = [each for each in (*named, layout.algebra.UNIT_EVEN) if each.unit and not each.implied]
        same = next((each for each in units if _same(each, layout)), None)
        wider = [each for each in units if layout.support <= each.support and not each.fixed]
        if same is not None or wider:
            return same or min(wider, key=lambda each: each.size)
    if layout in named:
        return layout
    blades = {slot.blade for slot in (*layout.stored, *(slot for slot, _ in layout.fixed))}
    return layout_of(layout.algebra, blades)


@cached_by_name
def _layout_of(algebra: Any, blades: frozenset[int]) -> Layout:
    if blades == {0}:
        return SCALAR
    for each in (*algebra.layouts.values(), algebra.even, algebra.full):
        if {s.blade for s in each.stored} == blades and not (each.fixed or each.implied or each.has_relations):
            return each
    order = sorted(blades, key=lambda blade: (blade.bit_count(), blade))
    names = " ".join(algebra.spelling(blade)[1] for blade in order)
    return algebra.layout(f"({names})", names)


def layout_of(algebra: Any, blades: Iterable[int]) -> Layout:
    """Return the unconstrained layout that stores these blades, a named one if the algebra has it."""
    return _layout_of(algebra, frozenset(blades))


@cached_by_name
def layout_from_plain(plain: PlainLayout, own: Algebra) -> Layout | None:
    """Return the layout of a generated module in an algebra or in the catalog; None if its algebra is in neither."""
    algebra = own if layouts.algebra_name(own) == plain.algebra else vars(catalog).get(plain.algebra)
    if not isinstance(algebra, Algebra):
        return None
    for each in (*algebra.layouts.values(), algebra.full, algebra.even, algebra.UNIT_EVEN):
        if plain_layout(each)[1:] == plain[1:]:
            return each
    if plain.implied:
        return None
    fixed = {blade: Fraction(value) for blade, value in plain.fixed}
    return algebra.layout(f"({' '.join(plain.blades)})", " ".join(plain.blades), fixed=fixed, unit=plain.unit)


def _same(a: Layout, b: Layout) -> bool:
    def content(layout: Layout) -> tuple[Any, ...]:
        return {slot.blade for slot in layout.stored}, {slot.blade: slot.sign * x for slot, x in layout.fixed}

    return content(a) == content(b)
