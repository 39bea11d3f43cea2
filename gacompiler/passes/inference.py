"""Inference of the layouts of values in loops: the coefficients that can occur, and the relations in every row.

A relation holds for a carry if it holds for the first value and the body preserves it. Relations are checked at exact
points of the variety of the inputs (Schwartz 1980, Zippel 1979).
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from random import Random

from ..algebra.layout import SCALAR, SCALARS, Layout
from ..algebra.multivector import Multivector
from ..errors import LayoutError
from ..frontend.expression import Expression, evaluate
from ..frontend.kernel import Kernel, Trace, trace
from ..frontend.loop_trace import LoopTrace, trace_loops
from .decide import POINTS, decide, has_implied, layout_of, satisfies
from .rewrite import rewrite
from .samples import samples

TRACES = 64
"""Number of traces of kernels with loops that are kept in memory: the largest modules have about forty."""


@lru_cache(maxsize=TRACES)
def traced_loops(kernel: Kernel) -> LoopTrace:
    """Return the trace of a kernel with loops. The same trace describes the kernel in the cache and is compiled."""
    return trace_loops(kernel, LayoutInference())


class LayoutInference:
    """The implementation of layout inference for `frontend.recorder`."""

    def __init__(self) -> None:
        self._known: dict[tuple[Expression, ...], tuple[Layout, ...]] = {}

    def layouts(self, kernel: Kernel) -> tuple[Layout, ...]:
        """Return the layouts of the results of a kernel, with every relation that the results satisfy."""
        traced = trace(kernel)
        if traced.expressions not in self._known:
            self._known[traced.expressions] = self._layouts(kernel, traced)
        return self._known[traced.expressions]

    def _layouts(self, kernel: Kernel, traced: Trace) -> tuple[Layout, ...]:
        found = decide(traced, tuple(rewrite(traced.expressions).values())).layouts
        points = [values for _, values in samples(kernel, traced.expressions, Random(7), POINTS)]
        return tuple(_related(layout, [values[k] for values in points]) for k, layout in enumerate(found))

    def joined(self, known: Layout, found: Layout) -> Layout:
        """Return the smallest layout that holds elements of both layouts."""
        if known == found:
            return known
        algebra = found.algebra if known.algebra == SCALARS else known.algebra
        fixed = dict(_fixed(known).items() & _fixed(found).items())
        stored = (known.support | found.support) - fixed.keys()
        if stored <= {0} and not fixed:
            return SCALAR
        plain = layout_of(algebra, set(stored), fixed)
        if known.unit and found.unit:
            return next((each for each in _with_relations(plain) if each.unit), plain)
        return plain

    def joined_with_constant(self, layout: Layout, constant: Expression) -> Layout:
        """Return the smallest layout that holds the elements of a layout and a constant."""
        (value,) = evaluate([constant], {})
        if _holds(layout, value):
            return layout
        algebra = value.algebra if layout.algebra == SCALARS else layout.algebra
        fixed = {blade: number for blade, number in _fixed(layout).items() if value.terms.get(blade, 0) == number}
        stored = {*layout.support, *value.terms} - fixed.keys()
        return SCALAR if stored <= {0} and not fixed else layout_of(algebra, stored, fixed)

    def sum_of(self, layout: Layout) -> Layout:
        """Return the layout that holds zero and sums of elements of a layout."""
        return SCALAR if layout.is_scalar else layout_of(layout.algebra, set(layout.support), {})

    def layout_of_constant(self, constant: Expression) -> Layout:
        """Return a layout that holds a constant and stores all its coefficients."""
        (value,) = evaluate([constant], {})
        blades = set(value.terms) or {0}
        if value.algebra == SCALARS:
            return SCALAR
        plain = layout_of(value.algebra, blades, {})
        return _related(plain, [value])


def _holds(layout: Layout, value: Multivector) -> bool:
    """Return whether a constant is an element of a layout."""
    lifted = value if value.algebra == layout.algebra else Multivector(layout.algebra, value.terms)
    try:
        layout.coefficients(lifted)
    except LayoutError:
        return False
    return all(relation == 0 for relation in layout.relations(lifted))


def _fixed(layout: Layout) -> dict[int, Fraction]:
    return {slot.blade: Fraction(slot.sign * value) for slot, value in layout.fixed if value}


def _with_relations(plain: Layout) -> list[Layout]:
    """Return the named layouts with the same blades and fixed coefficients that have additional relations."""
    if plain.algebra == SCALARS:
        return []
    return [
        each
        for each in plain.algebra.layouts.values()
        if (each.has_relations or each.implied) and each.support == plain.support and _fixed(each) == _fixed(plain)
    ]


def _related(plain: Layout, values: list[Multivector]) -> Layout:
    """Return the smallest named layout with relations that hold at all points, or `plain` if there is none."""
    fitting = [each for each in _with_relations(plain) if values and all(_fits(each, value) for value in values)]
    return min(fitting, key=lambda each: each.size, default=plain)


def _fits(layout: Layout, value: Multivector) -> bool:
    return has_implied(layout, value) and satisfies(layout, value)
