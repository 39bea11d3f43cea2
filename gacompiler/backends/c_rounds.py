"""Steps that NLANES elements repeat until a condition holds for all of them.

An element for which the condition holds must keep its values while others take further steps. Before a step, the tables
that the step changes are copied, and after it, the copies are moved back for the elements that had ended. Both take
place only while some elements have ended and others have not. Tables that the step defines before it reads them, and
that nothing else reads, are not copied.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

from ..ir.procedure import (
    Add,
    Apply,
    Clear,
    Copy,
    Loop,
    Place,
    Procedure,
    Repeat,
    Statement,
    Storage,
    Table,
    statements,
)
from ..ir.rows import further_tables

KEPT = "gac_kept_"
"""The beginning of the names of copies, which no table of a procedure has."""


def kept_tables(procedure: Procedure) -> list[Table]:
    """Return the copies of all tables that are kept, in the order of the iterations in the text."""
    return [copy for pairs in kept_by_rounds(procedure) for _, copy in pairs]


def kept_by_rounds(procedure: Procedure) -> list[list[tuple[Table, Table]]]:
    """Return, for each iteration in the order of the text, the tables to keep and their copies."""
    found, number = [], 0
    accesses = Counter(table for table, _ in _accesses(procedure.body))
    for rounds in statements(procedure.body):
        if not isinstance(rounds, Repeat):
            continue
        pairs = []
        for table in _changed(procedure, rounds, accesses):
            pairs.append((table, replace(table, name=f"{KEPT}{number}", storage=Storage.WORK)))
            number += 1
        found.append(pairs)
    return found


def _changed(procedure: Procedure, rounds: Repeat, accesses: Counter[str]) -> list[Table]:
    """Return the tables that a step changes for later steps or for other statements, except for the count of steps.

    `accesses` counts the accesses to each table in the whole procedure.
    """
    inside = list(_accesses(rounds.body))
    written = {table for table, is_write in inside if is_write} | {rounds.until}
    first: dict[str, bool] = {}
    for table, is_write in inside:
        first.setdefault(table, is_write)
    own = Counter(table for table, _ in _accesses((rounds,)))
    needed = {table for table, is_write in first.items() if not is_write}
    needed |= {table for table, count in accesses.items() if count > own[table]} | {rounds.until}
    needed |= {table.name for table in procedure.results}
    kept = written & needed - {rounds.steps}
    return [table for table in procedure.tables if table.name in kept]


def _accesses(body: Sequence[Statement]) -> Iterator[tuple[str, bool]]:
    """Yield the tables that statements read or write, in the order of the text, and whether they are written."""
    for statement in body:
        match statement:
            case Apply(_, inputs, outputs):
                yield from _of_places(inputs, is_write=False)
                yield from _of_places(outputs, is_write=True)
            case Copy(source, target):
                yield from _of_places((source,), is_write=False)
                yield from _of_places((target,), is_write=True)
            case Add(source, target):
                yield from _of_places((source, target), is_write=False)
                yield target.table, True
            case Clear(table):
                yield table, True
            case Loop():
                yield from _accesses(statement.body)
                yield from ((name, False) for name in statement.controls)
            case Repeat(_, until, steps, inner):
                yield from _accesses(inner)
                yield from ((steps, False), (steps, True), (until, False))


def _of_places(places: Sequence[Place], *, is_write: bool) -> Iterator[tuple[str, bool]]:
    for place in places:
        yield from ((name, False) for name in further_tables(place.row))
        yield place.table, is_write
