"""Copies of values that are overwritten before the reverse sweep needs them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from ..algebra.layout import SCALAR, Layout
from ..frontend.expression import lift
from ..frontend.loop_trace import LoopTrace
from ..frontend.operations import select
from ..frontend.recorded import Record
from ..frontend.recorder import Recorder
from ..frontend.rows import Leaf
from ..ir.procedure import Add, Loop, Place
from ..ir.rows import Counter, computed_numbers
from .cotangents import Cotangents, Seed
from .replay import reads_of
from .stored import Position
from .tangents import Key


class Copies(Cotangents):
    """Cotangents, and copies of values of the traced kernel; for the parameters see `Cotangents`."""

    def __init__(
        self,
        recorder: Recorder,
        traced: LoopTrace,
        arguments: Sequence[Any],
        layouts: Mapping[Key, Layout],
        wrt: str,
        seeds: Mapping[str, Seed],
        count: int = 1,
    ) -> None:
        super().__init__(recorder, traced, arguments, layouts, wrt, seeds, count)
        self._saved: dict[Place, tuple[Record, str]] = {}
        self._passed: set[str] = set()
        self._numbers_in: dict[str, list[tuple[Record, Record]]] = {}
        """For each loop, the stored numbers of rows, and the tables to which its reverse copies them."""

    def place(self, place: Place, tables: Mapping[str, Record] | None = None) -> Place:
        """Return the new place for an old one, or the place of its stored copy if there is one."""
        if tables is None and place in self._saved:
            kept, loop = self._saved[place]
            return Place(kept.name, Counter(self.counters[loop]))
        return super().place(place, tables)

    def _copied(self, place: Place, loop: Loop | None) -> Record:
        """Store a copy of a row, or one copy for each row of a loop if a loop is given."""
        old = self.old[place.table]
        lengths = self.lengths([loop.length]) if loop is not None else ()
        kept = self.new_table(f"{place.table}_kept", lengths, old.leaves, old.shape)
        row = Counter(self.counters[loop.counter]) if loop is not None else None
        self.copy(self.place(place), Place(kept.name, row))
        return kept

    def _copied_array(self, table: str, loop: Loop) -> Record:
        """Store a copy of a single row, or of an array, for each row of a loop."""
        own = self.tables[table]
        if not own.lengths:
            return self._copied(Place(table), loop)
        kept = self.new_table(f"{table}_kept", (*self.lengths([loop.length]), *own.lengths), own.leaves, own.shape)
        row = Counter(self.counters[loop.counter])
        self.recorder.store(own.arrays, [rows.at(row) for rows in kept.arrays])
        return kept

    def _copy_of(self, table: str) -> Record:
        """Store a copy of a single row, or of an array."""
        own = self.tables[table]
        kept = self.new_table(f"{table}_kept", own.lengths, own.leaves, own.shape)
        self._passed.add(table)
        self._restore(own, kept)
        return kept

    def _restore(self, kept: Record, own: Record) -> None:
        """Copy a single row, or an array, to another table."""
        if own.lengths:
            self.recorder.store(kept.arrays, own.arrays)
        else:
            self.copy(Place(kept.name), Place(own.name))

    def _keep_numbers(self, statement: Any, position: Position) -> None:
        """Store the numbers of rows that a statement uses if they are overwritten before its transpose runs."""
        places = [*reads_of(statement), *([statement.target] if isinstance(statement, Add) else [])]
        rows = [place.row for place in places if place.table in self._adjoints]
        for number in dict.fromkeys(name for row in rows for name in computed_numbers(row)):
            place, own = Place(number), self.tables[number].name
            if own in self._restored or not position.changes(place):
                continue
            kept, loop = self._copied(place, position.loop), position.loop
            if loop is None:
                self._restored[own] = kept.name
                continue
            single = self.new_table(number, (), kept.leaves, kept.shape)
            self._restored[own] = single.name
            self._numbers_in.setdefault(loop.counter, []).append((kept, single))

    @contextmanager
    def _forward_loop(self, loop: Loop) -> Iterator[str]:
        """Record a loop, and yield the table with the number of the row before which it ends early, or nothing."""
        ended = self.new_table("ended", (), (Leaf(SCALAR, 0),), ()) if loop.until else None
        targets = [(Place(ended.name), ended.leaves[0])] if ended is not None else []
        if ended is not None:
            first = self.held(self.tables[loop.first])[0] if loop.first else lift(0)
            self.recorder.compute([lift(select(first > 0, first, 0))], targets)
        with self.loop(loop, loop.reverse, self.controls(loop)):
            yield ended.name if ended is not None else ""
            if ended is not None:
                self.recorder.compute([self.held(ended)[0] + 1], targets)
