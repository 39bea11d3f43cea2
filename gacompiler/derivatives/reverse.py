"""Reverse mode through loops: the statements are recorded, followed by their transposes in reverse order.

Every table that depends on the parameter has a table of cotangents (`cotangents`). The transpose of a part reads the
cotangents of the values that the part writes, and adds to the cotangents of the values that it reads. The transpose of
an addition of rows is an addition in the opposite direction. The transpose of a loop runs the transposes of its
statements over the rows in reverse order.

Values that are overwritten are stored for each row of their loop (`stored`). If a loop contains loops, one value is
stored for each row of the outer loop, and the transposed outer loop runs the inner loops again before it runs their
transposes. The number of operations is therefore proportional to that of the kernel.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..algebra.layout import SCALAR
from ..errors import KernelError
from ..frontend.expression import Expression, lift
from ..frontend.loop_trace import LoopTrace
from ..frontend.recorded import Compute, Record, Recorded
from ..frontend.recorder import Recorder
from ..frontend.rows import Leaf
from ..frontend.traced import substituted
from ..ir.procedure import Add, Clear, Copy, Loop, Place, Repeat
from ..ir.rows import Counter, computed_numbers, goes_through, is_shifted, numbers_of
from .adjoints import Adjoint, adjoint, grouped
from .copies import Copies
from .replay import written
from .rules import added, is_zero
from .stored import Position, has_loops, is_fixed, only_added, reads_within, tables_to_store

Backward = Callable[[], None]
"""A function that records the transpose of a statement."""


class Reverse(Copies):
    """A traced kernel that is recorded with its transposed derivative; for the parameters see `Cotangents`."""

    def __init__(self, recorder: Recorder, traced: LoopTrace, *arguments: Any) -> None:
        super().__init__(recorder, traced, *arguments)
        self._saved, self._passed, self._numbers_in = {}, set(), {}
        self._parts: dict[str, Adjoint] = {}
        self._skipped: set[str] = set()
        backward = self._sweep(traced.statements, None, ())
        self._results = {name: self._kept_result(record) for name, record in traced.results}
        self._begin()
        for run in reversed(backward):
            run()

    def values(self) -> list[Any]:
        """Return the results of the kernel from before loops were run again."""
        return [self.value(record, self._results[name]) for name, record in self.traced.results]

    def _kept_result(self, record: Record) -> Record:
        """Return the table of a result, or a copy of a single row or an array that loops carry."""
        table = self.tables[record.name]
        changes = record.name in self._passed if record.lengths else record.name not in self._set_once
        if not changes:
            return table
        kept = self.new_table(f"{record.name}_kept", table.lengths, record.leaves, record.shape)
        if table.lengths:
            self.recorder.store(table.arrays, kept.arrays)
        else:
            self.copy(Place(table.name), Place(kept.name))
        return kept

    # Forward sweep, which stores the values that the reverse sweep needs.

    def primal(self, statement: Recorded) -> None:
        """Record an old statement, except for additions to sums that outlive a loop that is run again."""
        if not (isinstance(statement, Add) and statement.target.table in self._skipped):
            super().primal(statement)

    def _sweep(self, body: Sequence[Any], loop: Loop | None, after: Sequence[Any]) -> list[Backward]:
        """Record statements, and return their transposes in the order of the statements."""
        found: list[Backward] = []
        for number, statement in enumerate(body):
            position = Position(body, number, loop, after)
            self._keep_numbers(statement, position)
            if isinstance(statement, Compute):
                kept = self._kept(statement, position)
                self.primal(statement)
                found.append(self._transposed(statement, kept, position))
            elif isinstance(statement, Loop):
                found.append(self._loop(statement, body[number + 1 :]))
            else:
                self.primal(statement)
                if isinstance(statement, Add):
                    found.append(self._transposed_add(statement))
                elif isinstance(statement, Copy):
                    found.append(self._transposed_copy(statement))
                elif isinstance(statement, Clear):
                    found.append(self._zero(Place(statement.table), position))
                elif isinstance(statement, Repeat):
                    self._check_repeat(statement)
        return found

    def _check_repeat(self, statement: Repeat) -> None:
        changing = {table for table, _ in self._layouts}
        if written(statement.body) & changing:
            raise KernelError(
                self.traced.kernel.where, f"the reverse mode through iterate(), which depends on {self._wrt}",
                "loops over arrays, whose number of steps is the length", "use jvp(), or fold() over an array",
            )  # fmt: skip

    def _part(self, compute: Compute) -> Adjoint:
        name = compute.kernel.name
        if name not in self._parts:
            self._parts[name] = adjoint(compute, self._layouts, self._count)
        return self._parts[name]

    def _kept(self, compute: Compute, position: Position) -> dict[Place, tuple[Record, str]]:
        """Return copies of the values that the transpose of a part needs and that are overwritten before it runs."""
        found: dict[Place, tuple[Record, str]] = {}
        for k in sorted(self._part(compute).used):
            place = compute.sources[k].place
            is_changed = position.sets(place) if place in self._saved else position.changes(place)
            if place not in found and is_changed:
                loop = position.loop
                found[place] = (self._copied(place, loop), loop.counter if loop is not None else "")
        return found

    def _loop(self, loop: Loop, after: Sequence[Any]) -> Backward:
        changing = {table for table, _ in self._layouts}
        if not written([loop]) & changing:
            self.primal(loop)
            return lambda: None
        if loop.until and loop.reverse:
            raise KernelError(
                self.traced.kernel.where, f"the reverse mode through a loop from the last row that ends early, which "
                f"depends on {self._wrt}", "a loop from the first row", "use jvp(), or reverse the arrays",
            )  # fmt: skip
        return self._outer_loop(loop, after) if has_loops(loop.body) else self._inner_loop(loop, after)

    def _inner_loop(self, loop: Loop, after: Sequence[Any]) -> Backward:
        """Record a loop that contains no loops. Values are stored for each row."""
        with self._forward_loop(loop) as ended:
            inner = self._sweep(loop.body, loop, after)

        def backward() -> None:
            with self._backward_loop(loop, ended):
                for kept, single in self._numbers_in.get(loop.counter, ()):
                    self.copy(Place(kept.name, Counter(self.counters[loop.counter])), Place(single.name))
                for run in reversed(inner):
                    run()

        return backward

    def _outer_loop(self, loop: Loop, after: Sequence[Any]) -> Backward:
        """Record a loop that contains loops. The transposed loop runs each row again from stored initial values."""
        saved: dict[Place, tuple[Record, str]] = {}
        kinds = tables_to_store(loop, after)
        before = {table: self._stored(table) for table in kinds.once}
        with self._forward_loop(loop) as ended:
            passed = {table: self._stored(table, loop) for table in kinds.each}
            for number, statement in enumerate(loop.body):
                position = Position(loop.body, number, loop, after)
                for place in reads_within(statement):
                    if place not in saved and is_fixed(place, loop) and position.changes(place):
                        saved[place] = (self._copied(place, loop), loop.counter)
                self.primal(statement)  # type: ignore[arg-type]

        def backward() -> None:
            for table, kept in before.items():
                self._restore(table, kept)
            with self._backward_loop(loop, ended):
                outer, skipped = self._saved, self._skipped
                self._saved, self._skipped = {**outer, **saved}, skipped | only_added(loop.body)
                for table, kept in passed.items():
                    self._restore(table, kept, loop)
                inner = self._sweep(loop.body, None, ())
                for run in reversed(inner):
                    run()
                self._saved, self._skipped = outer, skipped

        return backward

    # Reverse sweep.

    def _transposed(self, compute: Compute, kept: Mapping[Place, tuple[Record, str]], position: Position) -> Backward:
        part, places = self._part(compute), grouped(compute, self._part(compute))
        targets = [place for place, _ in compute.targets]
        zeros = [] if self._is_first(position) else list(dict.fromkeys(targets))
        zeros = [p for p in zeros if p.table in self._adjoints and p not in places and p.table not in self._set_once]

        def backward() -> None:
            by = self._values(compute, part, kept) | self._weights(compute, part)
            values = dict(zip(part.entries, substituted([entry.value for entry in part.entries], by), strict=True))
            results: list[Expression] = []
            written_to: list[tuple[Place, Leaf]] = []
            further: list[tuple[Place, Place]] = []
            for place, entries in places.items():
                sums: dict[int, list[Expression]] = {}
                for entry, start in entries:
                    at = self._starts[place.table, start, entry.seed] + entry.slot
                    sums.setdefault(at, []).append(values[entry])
                is_set = place in targets or self._is_sole(place)
                if not is_set and all(is_zero(value) for given in sums.values() for value in given):
                    continue
                row, target = self._target(place, is_set, further)
                own = self._adjoints[place.table].leaves
                for leaf in own:
                    given = list(sums.get(leaf.start, []))
                    if row is not None:
                        given.insert(0, self._symbol(place.table, row, leaf))
                    results.append(added(given))
                    written_to.append((target, leaf))
            for place in zeros:
                for leaf in self._adjoints[place.table].leaves:
                    results.append(lift(0))
                    written_to.append((self.place(place, self._adjoints), leaf))
            if results:
                self.recorder.compute(results, written_to)
            for source, old in further:
                self._add(source, old)

        return backward

    def _is_first(self, position: Position) -> bool:
        """Return whether no preceding statement uses the tables that the statement writes."""
        return (
            position.loop is None
            and len(self.recorder.scopes) == self.base + 1
            and not (
                written([position.body[position.number]])
                & {
                    t
                    for s in position.body[: position.number]
                    for t in (*written([s]), *(p.table for p in reads_within(s)))
                }
            )
        )

    def _target(self, place: Place, is_set: bool, further: list[tuple[Place, Place]]) -> tuple[Place | None, Place]:
        """Return the place to add to (or None) and the place to write, for a contribution to the cotangent of a row.

        A contribution that cannot be added directly is written to a new single row and appended to `further`.
        """
        is_inner = len(self._edges) > 1 and not is_set  # Sums that outlive a loop are not accumulated inside it.
        # Other iterations add to rows addressed by index tables or at a distance, so they are not accumulated directly.
        others = (p.row for p in self._reads if p.table == place.table)
        is_scattered = not is_set and any(
            goes_through(row) or is_shifted(row) or computed_numbers(row) for row in others
        )
        if all(isinstance(each, Counter) for each in numbers_of(place.row)) and not is_inner and not is_scattered:
            own = self.place(place, self._adjoints)
            return (None if is_set else own), own
        own_record = self._adjoints[place.table]
        single = self.new_table(f"{place.table}_part", (), own_record.leaves, own_record.shape)
        further.append((Place(single.name), place))
        return None, Place(single.name)

    def _values(
        self, compute: Compute, part: Adjoint, kept: Mapping[Place, tuple[Record, str]]
    ) -> dict[Expression, Expression]:
        """Return the symbols for the values that a transpose reads."""
        found: dict[Expression, Expression] = {}
        symbols: tuple[Expression, ...] = compute.kernel.function.symbols  # type: ignore[attr-defined]
        for k in sorted(part.used):
            symbol, source = symbols[k], compute.sources[k]
            if source.place in kept:
                record, loop = kept[source.place]
                place = Place(record.name, Counter(self.counters[loop]) if loop else None)
                found[symbol] = self.recorder.symbol(symbol.data.name, place, source.leaf)
            else:
                found[symbol] = self.symbol(symbol, source)
        return found

    def _weights(self, compute: Compute, part: Adjoint) -> dict[Expression, Expression]:
        """Return the cotangents of the values that a part writes, by the symbols that represent them."""
        found: dict[Expression, Expression] = {}
        given: dict[int, list[list[Expression]]] = {}
        for weight in part.weights:
            place, leaf = compute.targets[weight.target]
            if self._is_direct(place.table):
                if weight.target not in given:
                    number = self.old[place.table].leaves.index(leaf)
                    layout = self._layouts[place.table, leaf.start]
                    row = self.row(place.row, self.tables)
                    given[weight.target] = self._seeds[place.table].numbers(number, layout, row)
                found[weight.symbol] = given[weight.target][weight.seed][weight.slot]
            else:
                at = self._starts[place.table, leaf.start, weight.seed] + weight.slot
                own = self.place(place, self._adjoints)
                found[weight.symbol] = self._symbol(place.table, own, Leaf(SCALAR, at))
        return found

    def _transposed_add(self, statement: Add) -> Backward:
        source, target = statement.source, statement.target

        def backward() -> None:
            if source.table in self._adjoints and target.table in self._adjoints:
                self._add(self._cotangent(target), source)

        return backward

    def _transposed_copy(self, statement: Copy) -> Backward:
        def backward() -> None:
            source, target = statement.source, statement.target
            if target.table not in self._adjoints:
                return
            own = self.place(target, self._adjoints)
            if source.table in self._adjoints:
                self._add(own, source)
            if target.table not in self._set_once:
                values = {leaf.start: lift(0) for leaf in self._adjoints[target.table].leaves}
                self._write(values, own)

        return backward

    def _zero(self, place: Place, position: Position) -> Backward:
        """Return the transpose of clearing a table, which sets its cotangent to zero."""
        is_first = self._is_first(position)

        def backward() -> None:
            if place.table in self._adjoints and not is_first and not self._is_direct(place.table):
                self.clear(self._adjoints[place.table])

        return backward
