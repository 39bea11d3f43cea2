"""Which values of a kernel with loops change with a parameter, and which coefficients their derivatives have.

A fixed point: a value changes if it is computed from one that does. The derivative of a unit motor is no unit motor,
and the constant weight of a moved point changes if the motor stops being one. So the coefficients of derivatives are
found from the expressions for them, and not from the layouts of values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..algebra.layout import SCALAR, SCALARS, Layout
from ..frontend.expression import Expression
from ..frontend.kernel import Kernel, Parameter
from ..frontend.loop_trace import LoopTrace
from ..frontend.recorded import Compute, Record
from ..frontend.recorder import Inference
from ..frontend.traced import Traced
from ..ir.procedure import Add, Copy
from ..passes.decide import layout_of
from .replay import flattened, reads_of, start_of, values_of
from .results import free
from .rules import derivative, is_zero

Key = tuple[str, int]
"""A table, and where in its rows a multivector begins."""


def tangent_layouts(traced: LoopTrace, seeds: Mapping[Key, Layout], inference: Inference) -> dict[Key, Layout]:
    """The layouts of derivatives, of everything in a traced kernel that changes with the seeds.

    Parameters
    ----------
    traced : LoopTrace
    seeds : mapping
        The layouts of the tangents of the parameter to differentiate by.
    inference : Inference
    """
    return _Tangents(traced, seeds, inference).found()


class _Tangents:
    def __init__(self, traced: LoopTrace, seeds: Mapping[Key, Layout], inference: Inference) -> None:
        self._traced, self._inference = traced, inference
        self._records = {record.name: record for record in traced.records}
        self._found = dict(seeds)
        self._known: dict[tuple[str, tuple[Layout | None, ...]], list[Layout | None]] = {}

    def found(self) -> dict[Key, Layout]:
        """Repeat until nothing changes: coefficients are only added."""
        statements = list(flattened(self._traced.statements))
        while True:
            before = dict(self._found)
            for statement in statements:
                if isinstance(statement, Compute):
                    self._compute(statement)
                elif isinstance(statement, (Add, Copy)):
                    self._connect(statement.source.table, statement.target.table, isinstance(statement, Copy))
                for place in reads_of(statement):
                    if start_of(place):
                        self._connect(place.table, start_of(place), True)
            if self._found == before:
                return self._found

    def _compute(self, compute: Compute) -> None:
        keys = [(source.place.table, source.leaf.start) for source in compute.sources]
        layouts = tuple(self._found.get(key) for key in keys)
        if not any(layouts):
            return
        known = compute.kernel.name, layouts
        if known not in self._known:
            self._known[known] = self._slopes(compute, layouts)
        for (place, leaf), layout in zip(compute.targets, self._known[known], strict=True):
            if layout is not None:
                self._join((place.table, leaf.start), leaf.layout, layout)

    def _slopes(self, compute: Compute, layouts: Sequence[Layout | None]) -> list[Layout | None]:
        """Layouts that hold the derivatives of the results of a part; None for those that do not change."""
        symbols: tuple[Expression, ...] = compute.kernel.function.symbols  # type: ignore[attr-defined]
        further, tangents = [], {}
        for k, (symbol, layout) in enumerate(zip(symbols, layouts, strict=True)):
            if layout is not None:
                parameter = Parameter(f"tangent_{k}_of_{symbol.data.name}", layout)
                further.append(parameter)
                tangents[symbol] = parameter.symbols()
        slopes = derivative(values_of(compute), tangents)
        changing = [slope for slope in slopes if not is_zero(slope)]
        if not changing:
            return [None] * len(slopes)
        function = Traced((*symbols, *tangents.values()), tuple(changing))
        kernel = Kernel("tangent", function, (*compute.kernel.parameters, *further), None, "")
        found = iter(self._inference.layouts(kernel))
        return [None if is_zero(slope) else next(found) for slope in slopes]

    def _join(self, key: Key, own: Layout, layout: Layout) -> None:
        """Let the derivative of a multivector of layout `own` have the coefficients of `layout` too."""
        known = self._found.get(key)
        blades = set(layout.support) | set(known.support if known else ())
        if known is not None and blades == set(known.support):
            return
        self._found[key] = _free_layout(own, layout, blades)

    def _connect(self, first: str, second: str, both: bool) -> None:
        """Rows that are copied or added to each other have derivatives of the same coefficients."""
        a, b = self._records[first], self._records[second]
        if [leaf.start for leaf in a.leaves] != [leaf.start for leaf in b.leaves]:
            if both or self._changes(a):
                self._connect_numbers(a, b)
            return
        for source, target, is_needed in ((a, b, True), (b, a, both or self._changes(a))):
            for k, leaf in enumerate(source.leaves):
                layout = self._found.get((source.name, leaf.start))
                if layout is not None and is_needed:
                    other = target.leaves[k]
                    self._join((target.name, other.start), other.layout, layout)

    def _connect_numbers(self, *records: Record) -> None:
        """The same for rows that divide the same numbers in another way: all of them have a derivative."""
        if any(map(self._changes, records)):
            for record in records:
                for leaf in record.leaves:
                    self._join((record.name, leaf.start), leaf.layout, free(leaf.layout))

    def _changes(self, record: Record) -> bool:
        return any((record.name, leaf.start) in self._found for leaf in record.leaves)


def _free_layout(own: Layout, layout: Layout, blades: set[int]) -> Layout:
    algebra = own.algebra if own.algebra != SCALARS else layout.algebra
    if algebra == SCALARS:
        return SCALAR
    if blades == {slot.blade for slot in own.stored} and own.algebra == algebra:
        return free(own)
    return layout_of(algebra, blades, {})
