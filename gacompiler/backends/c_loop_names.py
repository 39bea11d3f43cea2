"""Choose legal and distinct names in C for a kernel with loops, as close to its own names as possible."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..ir.procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Repeat, Statement, Table, statements
from ..ir.rows import with_tables
from .printers import Names


def named_in_c(procedure: Procedure) -> tuple[Procedure, Names]:
    """Rename lengths, tables and counters of a procedure for C, and return it with all names in use.

    If all names are legal and distinct, the procedure is not changed.
    """
    names = Names()

    def fresh(wanted: str) -> str:
        # Names that begin with `gac_` are reserved for the runtime.
        return names.fresh(f"v{wanted}" if wanted.startswith("gac_") else wanted)

    return renamed(procedure, fresh), names


def renamed(procedure: Procedure, fresh: Callable[[str], str]) -> Procedure:
    """Rename lengths, tables and counters of a procedure, in this order, with names returned by a function."""
    lengths = {length: fresh(length) for length in procedure.lengths}
    tables = {table.name: fresh(table.name) for table in procedure.tables}
    used = dict.fromkeys(s.counter for s in statements(procedure.body) if isinstance(s, Loop))
    counters = {counter: fresh(counter) for counter in used}
    return _Renaming(lengths, tables, counters).procedure(procedure)


class _Renaming:
    """A mapping of lengths, tables and counters to new names."""

    def __init__(self, lengths: dict[str, str], tables: dict[str, str], counters: dict[str, str]) -> None:
        self._lengths, self._tables, self._counters = lengths, tables, counters

    def procedure(self, procedure: Procedure) -> Procedure:
        """Return a procedure with the new names."""
        tables = tuple(map(self._table, procedure.tables))
        return Procedure(procedure.name, tables, tuple(map(self._statement, procedure.body)))

    def _table(self, table: Table) -> Table:
        lengths = tuple(self._lengths[length] for length in table.lengths)
        into = self._lengths.get(table.into, "")
        return replace(table, name=self._tables[table.name], lengths=lengths, into=into)

    def _statement(self, statement: Statement) -> Statement:
        match statement:
            case Apply(program, inputs, outputs):
                return Apply(program, tuple(map(self._place, inputs)), tuple(map(self._place, outputs)))
            case Add(source, target):
                return Add(self._place(source), self._place(target))
            case Copy(source, target):
                return Copy(self._place(source), self._place(target))
            case Clear(table):
                return Clear(self._tables[table])
            case Loop(counter, length, reverse, body):
                inner = tuple(map(self._statement, body))
                controls = (self._tables.get(name, "") for name in (statement.until, statement.first, statement.end))
                return Loop(self._counters[counter], self._lengths[length], reverse, inner, *controls)
            case Repeat(limit, until, steps, body):
                inner = tuple(map(self._statement, body))
                return Repeat(limit, self._tables[until], self._tables[steps], inner)

    def _place(self, place: Place) -> Place:
        row = with_tables(place.row, self._tables.__getitem__, self._counters.__getitem__)
        return Place(self._tables[place.table], row)
