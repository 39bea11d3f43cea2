"""Forward mode through loops: each table that depends on the parameter gets a table of derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..algebra.layout import Layout
from ..frontend.expression import Expression
from ..frontend.loop_trace import LoopTrace
from ..frontend.recorded import Compute, Record, Recorded, Source
from ..frontend.recorder import Recorder
from ..frontend.rows import Leaf
from ..frontend.traced import substituted
from ..ir.procedure import Add, Clear, Copy, Place, Storage
from .replay import Replay, values_of
from .results import multivector, numbers
from .rules import derivative
from .tangents import Key

Directions = Callable[[Expression], Sequence[Expression]]
"""A function that returns the tangents of a multivector parameter as expressions in it."""


class Forward(Replay):
    """A traced kernel that is recorded with its derivatives along several directions.

    Parameters
    ----------
    recorder : Recorder
    traced : LoopTrace
    arguments : sequence
        The arguments of the traced kernel.
    layouts : mapping
        The layouts of derivatives, see `tangents.tangent_layouts`.
    wrt : str
        The parameter with respect to which the kernel is differentiated.
    tangents : Record or callable
        The table of tangents of the parameter, or a function that returns them as expressions.
    count : int
        The number of directions.
    """

    def __init__(
        self,
        recorder: Recorder,
        traced: LoopTrace,
        arguments: Sequence[Any],
        layouts: Mapping[Key, Layout],
        wrt: str,
        tangents: Record | Directions,
        count: int = 1,
    ) -> None:
        super().__init__(recorder, traced, arguments)
        self._layouts, self._wrt, self._count = layouts, wrt, count
        self._directions = None if isinstance(tangents, Record) else tangents
        self._tangents: dict[str, Record] = {}
        self._leaves: dict[tuple[str, int, int], Leaf] = {}
        for record in traced.records:
            if record.name == wrt and isinstance(tangents, Record):
                self._tangents[wrt] = tangents
                for own, leaf in zip(record.leaves, tangents.leaves, strict=True):
                    self._leaves[wrt, own.start, 0] = leaf
            elif record.name != wrt:
                self._add_table(record)
        for record in traced.records:
            if record.storage is Storage.ARGUMENT and record.name != wrt and record.name in self._tangents:
                self.clear(self._tangents[record.name])
        for statement in traced.statements:
            self.primal(statement)

    def _add_table(self, record: Record) -> None:
        """Add a table for the derivatives of a table, if the table depends on the parameter."""
        leaves: list[Leaf] = []
        for direction in range(self._count):
            for own in record.leaves:
                layout = self._layouts.get((record.name, own.start))
                if layout is not None:
                    start = leaves[-1].start + leaves[-1].layout.size if leaves else 0
                    leaves.append(Leaf(layout, start))
                    self._leaves[record.name, own.start, direction] = leaves[-1]
        if leaves:
            shape = shape_of(record, sum(leaf.layout.size for leaf in leaves))
            self._tangents[record.name] = self.table_like(record, f"{record.name}_tangent", leaves, shape)

    def compute(self, compute: Compute) -> None:
        """Record a part together with the derivatives of its results."""
        symbols = self.symbols(compute)
        values = substituted(values_of(compute), symbols)
        results = list(values)
        targets = [(self.place(place), leaf) for place, leaf in compute.targets]
        along = [
            {
                symbol: tangent
                for symbol, source in zip(symbols.values(), compute.sources, strict=True)
                if (tangent := self._tangent(symbol, source, direction)) is not None
            }
            for direction in range(self._count)
        ]
        for direction, tangents in enumerate(along):
            for (place, leaf), partial in zip(compute.targets, derivative(values, tangents), strict=True):
                layout = self._layouts.get((place.table, leaf.start))
                if layout is not None:
                    results.append(multivector(numbers(partial, layout), layout))
                    own = self._leaves[place.table, leaf.start, direction]
                    targets.append((self.place(place, self._tangents), own))
        self.recorder.compute(results, targets)

    def _tangent(self, symbol: Expression, source: Source, direction: int) -> Expression | None:
        """Return the derivative of the value of a symbol, or None if the value does not depend on the parameter."""
        table = source.place.table
        if table == self._wrt and self._directions is not None:
            return self._directions(symbol)[direction]
        leaf = self._leaves.get((table, source.leaf.start, direction))
        if leaf is None:
            return None
        place = self.place(source.place, self._tangents)
        return self.recorder.symbol(f"{symbol.data.name}_tangent", place, leaf, self.base + source.depth)

    def primal(self, statement: Recorded) -> None:
        """Record a statement together with the corresponding statement for derivatives."""
        super().primal(statement)
        tangents = self._tangents
        match statement:
            case Add(source, target) | Copy(source, target) if (
                self._directions is not None and source.table == self._wrt
            ):
                self._move_directions(statement)
            case Add(source, target) if {source.table, target.table} <= tangents.keys():
                self.record(Add(self.place(source, tangents), self.place(target, tangents)))
            case Copy(source, target) if {source.table, target.table} <= tangents.keys():
                self.copy(self.place(source, tangents), self.place(target, tangents))
            case Clear(table) if table in tangents:
                self.clear(tangents[table])

    def _move_directions(self, statement: Add | Copy) -> None:
        """Record copying or addition of the tangents of the parameter, which are not stored in a table."""
        source, target = statement.source, statement.target
        own = self._tangents[target.table]
        place = self.place(target, self._tangents)
        if isinstance(statement, Add):
            place = Place(self.new_table("direction", (), own.leaves, own.shape).name)
        values: list[Expression] = []
        targets: list[tuple[Place, Leaf]] = []
        pairs = list(zip(self.old[source.table].leaves, self.old[target.table].leaves, strict=True))
        for direction in range(self._count):
            for given, leaf in pairs:
                symbol = self.recorder.symbol(source.table, self.place(source), given)
                layout = self._layouts[target.table, leaf.start]
                assert self._directions is not None
                values.append(multivector(numbers(self._directions(symbol)[direction], layout), layout))
                targets.append((place, self._leaves[target.table, leaf.start, direction]))
        self.recorder.compute(values, targets)
        if isinstance(statement, Add):
            self.record(Add(place, self.place(target, self._tangents)))

    def derivatives(self) -> list[list[list[Any]]]:
        """Return the derivatives of the multivectors of each result along each direction; None for constants."""
        return [
            [self._derivatives(name, record, direction) for direction in range(self._count)]
            for name, record in self.traced.results
        ]

    def _derivatives(self, name: str, record: Record, direction: int) -> list[Any]:
        if name not in self._tangents:
            return [None] * len(record.leaves)
        own = self._tangents[name]
        held = dict(zip(own.leaves, self.held(own), strict=True))
        leaves = [self._leaves.get((name, leaf.start, direction)) for leaf in record.leaves]
        return [None if leaf is None else held[leaf] for leaf in leaves]


def shape_of(record: Record, size: int) -> tuple[int, ...]:
    """Return the shape of rows of derivatives: that of the table if the size is the same, else flat."""
    if size == record.table.size:
        return record.shape
    return () if size == 1 else (size,)
