"""Analysis of the values of a kernel with loops that depend on a parameter, and of the layouts of their derivatives.

A value depends on the parameter if it is computed from a value that does; the analysis iterates to a fixed point. The
derivative of a unit motor is not a unit motor, and the constant weight of a moved point can have a nonzero derivative
if the motor is varied freely. The coefficients of derivatives are therefore determined from their expressions, and not
from the layouts of values.
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
from ..ir.rows import start_of
from ..passes.decide import layout_of
from .replay import flattened, reads_of, values_of
from .results import free
from .rules import derivative, is_zero

Key = tuple[str, int]
"""A table, and the position of the first number of a multivector in its rows."""


def tangent_layouts(traced: LoopTrace, seeds: Mapping[Key, Layout], inference: Inference) -> dict[Key, Layout]:
    """Return the layouts of the derivatives of all values in a traced kernel that depend on the parameter.

    Parameters
    ----------
    traced : LoopTrace
    seeds : mapping
        The layouts of the tangents of the parameter.
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
        """Iterate to the fixed point. Coefficients are only added, so the iteration terminates."""
        statements = list(flattened(self._traced.statements))
        while True:
            before = dict(self._found)
            for statement in statements:
                if isinstance(statement, Compute):
                    self._compute(statement)
                elif isinstance(statement, (Add, Copy)):
                    self._connect(statement.source.table, statement.target.table, isinstance(statement, Copy))
                for place in reads_of(statement):
                    if start_of(place.row):
                        self._connect(place.table, start_of(place.row), True)
            if self._found == before:
                return self._found

    def _compute(self, compute: Compute) -> None:
        keys = [(source.place.table, source.leaf.start) for source in compute.sources]
        layouts = tuple(self._found.get(key) for key in keys)
        if not any(layouts):
            return
        known = compute.kernel.name, layouts
        if known not in self._known:
            self._known[known] = self._derivatives(compute, layouts)
        for (place, leaf), layout in zip(compute.targets, self._known[known], strict=True):
            if layout is not None:
                self._join((place.table, leaf.start), leaf.layout, layout)

    def _derivatives(self, compute: Compute, layouts: Sequence[Layout | None]) -> list[Layout | None]:
        """Return the layouts of the derivatives of the results of a part; None for constant results."""
        symbols: tuple[Expression, ...] = compute.kernel.function.symbols  # type: ignore[attr-defined]
        further, tangents = [], {}
        for k, (symbol, layout) in enumerate(zip(symbols, layouts, strict=True)):
            if layout is not None:
                parameter = Parameter(f"tangent_{k}_of_{symbol.data.name}", layout)
                further.append(parameter)
                tangents[symbol] = parameter.symbols()
        derivatives = derivative(values_of(compute), tangents)
        changing = [partial for partial in derivatives if not is_zero(partial)]
        if not changing:
            return [None] * len(derivatives)
        function = Traced((*symbols, *tangents.values()), tuple(changing))
        kernel = Kernel("tangent", function, (*compute.kernel.parameters, *further), None, "")
        found = iter(self._inference.layouts(kernel))
        return [None if is_zero(partial) else next(found) for partial in derivatives]

    def _join(self, key: Key, own: Layout, layout: Layout) -> None:
        """Add the coefficients of `layout` to the derivative of a multivector of layout `own`."""
        known = self._found.get(key)
        blades = set(layout.support) | set(known.support if known else ())
        if known is not None and blades == set(known.support):
            return
        self._found[key] = _free_layout(own, layout, blades)

    def _connect(self, first: str, second: str, both: bool) -> None:
        """Give the derivatives of rows that are copied or added to each other the same coefficients."""
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
        """Give all multivectors derivatives if rows that are copied or added divide the same numbers differently."""
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
