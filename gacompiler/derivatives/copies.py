"""Copies of values that are overwritten before the reverse sweep needs them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from ..algebra.layout import SCALAR
from ..frontend.expression import lift
from ..frontend.operations import select
from ..frontend.recorded import Record
from ..frontend.rows import Leaf
from ..ir.procedure import Add, Loop, Place
from ..ir.rows import Counter, computed_numbers
from .cotangents import Cotangents
from .replay import reads_of
from .stored import Position


class Copies(Cotangents):
    """Cotangents, and copies of values of the traced kernel; for the parameters see `Cotangents`."""

    _saved: dict[Place, tuple[Record, str]]
    _passed: set[str]
    _numbers_in: dict[str, list[tuple[Record, Record]]]
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

    def _stored(self, table: str, loop: Loop | None = None) -> Record:
        """Store a copy of a single row, or of an array, or one copy for each row of a loop if a loop is given."""
        own = self.tables[table]
        lengths = self.lengths([loop.length]) if loop is not None else ()
        kept = self.new_table(f"{table}_kept", (*lengths, *own.lengths), own.leaves, own.shape)
        self._passed.add(table)
        row = Counter(self.counters[loop.counter]) if loop is not None else None
        if own.lengths:
            self.recorder.store(own.arrays, _arrays(kept, row))
        else:
            self.copy(Place(own.name), Place(kept.name, row))
        return kept

    def _restore(self, table: str, kept: Record, loop: Loop | None = None) -> None:
        """Copy what `_stored` has stored back to its table, in the current row of a loop if a loop is given."""
        own, row = self.tables[table], Counter(self.counters[loop.counter]) if loop is not None else None
        if own.lengths:
            self.recorder.store(_arrays(kept, row), own.arrays)
        else:
            self.copy(Place(kept.name, row), Place(own.name))

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


def _arrays(record: Record, row: Counter | None) -> list[Any]:
    """Return the arrays in a table, or in one of its rows."""
    return record.arrays if row is None else [rows.at(row) for rows in record.arrays]
