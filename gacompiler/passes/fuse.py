"""Fusing loops of a procedure: what is computed in one row stays in registers until it is used.

Neighbouring loops over the same length become one where no row is used before it is computed. Tables whose rows are
then used in the same round only need no memory for each row: they become a single row (`_contracted`).

Sines and the like of rows that do not depend on each other stay apart from loops that carry something from row to row.
In a loop of their own processors compute several of them at once; in the other one each round would wait for its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ..ir.cost import cost
from ..ir.procedure import (
    Add,
    Apply,
    Clear,
    Copy,
    Counter,
    Following,
    Loop,
    Parent,
    Place,
    Previous,
    Procedure,
    Repeat,
    Row,
    Statement,
    Storage,
    Through,
    statements,
)


def fuse(procedure: Procedure) -> Procedure:
    """The procedure with fewer loops and smaller tables, which computes the same."""
    return _contracted(replace(procedure, body=_fused(procedure.body)))


@dataclass(frozen=True, slots=True)
class _Uses:
    """The places that statements read and write, and the tables that they touch as a whole."""

    reads: tuple[Place, ...]
    writes: tuple[Place, ...]

    @property
    def tables(self) -> set[str]:
        """All tables."""
        return {place.table for place in (*self.reads, *self.writes)}


def _uses(body: Sequence[Statement]) -> _Uses:
    reads: list[Place] = []
    writes: list[Place] = []
    for statement in body:
        match statement:
            case Apply():
                reads += statement.inputs
                writes += statement.outputs
            case Add():
                reads += [statement.source, statement.target]
                writes.append(statement.target)
            case Copy():
                reads.append(statement.source)
                writes.append(statement.target)
            case Clear():
                writes.append(Place(statement.table))
            case Loop() | Repeat():
                inner = _uses(statement.body)
                reads += inner.reads
                writes += inner.writes
                if isinstance(statement, Repeat):
                    single = [Place(statement.until), Place(statement.steps)]
                    reads += single
                    writes += single
    reads += [Place(row.start) for place in reads if isinstance(row := place.row, (Previous, Parent))]
    reads += [Place(name) for place in (*reads, *writes) for name in _indices(place.row)]
    return _Uses(tuple(reads), tuple(writes))


def _indices(row: Row) -> tuple[str, ...]:
    if isinstance(row, Through):
        return row.indices
    return (row.index,) if isinstance(row, Parent) else ()


def _fused(body: Sequence[Statement]) -> tuple[Statement, ...]:
    """Statements with loops fused: each loop joins the last one before it that it can join."""
    found: list[Statement] = []
    for statement in body:
        if isinstance(statement, (Loop, Repeat)):
            statement = replace(statement, body=_fused(statement.body))
        if isinstance(statement, Loop):
            place = _partner(found, statement)
            if place is not None:
                partner = found[place]
                assert isinstance(partner, Loop)
                found[place] = _together(partner, statement)
                continue
        found.append(statement)
    return tuple(found)


def _partner(found: list[Statement], loop: Loop) -> int | None:
    """The place of a loop that another one can join; what lies between them is moved in front of it."""
    moved: list[int] = []
    for place in range(len(found) - 1, -1, -1):
        before = found[place]
        if isinstance(before, Loop) and _can_join(before, loop):
            if all(_independent(found[k], before) for k in moved):
                between = [found[k] for k in reversed(moved)]
                rest = [statement for k, statement in enumerate(found) if k > place and k not in moved]
                found[place:] = [*between, before, *rest]
                return place + len(between)
            return None
        if not all(_independent(before, each) for each in (loop, *(found[k] for k in moved))):
            moved.append(place)  # the others may stay behind the fused loop
    return None


def _independent(a: Statement, b: Statement) -> bool:
    """Whether two statements may run in either order."""
    first, second = _uses([a]), _uses([b])
    written = {place.table for place in first.writes}, {place.table for place in second.writes}
    return not (written[0] & second.tables) and not (written[1] & first.tables)


def _can_join(first: Loop, second: Loop) -> bool:
    """Whether the rows of two loops may be computed in one loop, first those of the first one."""
    if first.length != second.length:
        return False
    both = (first, second), (second, first)
    if first.reverse != second.reverse and not (_is_free(first) or _is_free(second)):
        return False
    if any(_has_calls(each) and _is_free(each) and not _is_free(other) for each, other in both):
        return False
    reverse = first.reverse if not _is_free(first) else second.reverse
    earlier, later = _uses(first.body), _uses(second.body)
    written, rewritten = _by_table(earlier.writes), _by_table(later.writes)
    for place in (*later.reads, *later.writes):
        rows = written.get(place.table, ())
        if not all(_is_ready(row, first.counter, place.row, second.counter, reverse) for row in rows):
            return False
    for place in earlier.reads:
        for row in rewritten.get(place.table, ()):
            if not (place.row == Counter(first.counter) and row == Counter(second.counter)):
                return False
    return True


def _by_table(places: Sequence[Place]) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for place in places:
        found.setdefault(place.table, []).append(place.row)
    return found


def _is_ready(written: Row, first: str, used: Row, second: str, reverse: bool) -> bool:
    """Whether a row that the first loop writes is there when the second one uses it in the same round."""
    if written != Counter(first):
        return False
    if isinstance(used, Counter):
        return used.loop == second
    if isinstance(used, Previous):
        return used.loop == second
    return isinstance(used, Parent) and used.loop == second and not reverse


def _is_free(loop: Loop) -> bool:
    """Whether the rows of a loop may be computed in any order, which changes no rounding either."""
    uses = _uses(loop.body)
    written = {place.table for place in uses.writes}
    in_order = any(
        isinstance(place.row, (Previous, Following, Parent))
        or (isinstance(place.row, Through) and place.table in written)
        for place in (*uses.reads, *uses.writes)
    )
    return not in_order and all(place.row == Counter(loop.counter) for place in uses.writes)


def _has_calls(loop: Loop) -> bool:
    """Whether it computes transcendental functions."""
    return any(isinstance(each, Apply) and cost(each.program).call for each in statements(loop.body))


def _together(first: Loop, second: Loop) -> Loop:
    reverse = first.reverse if not _is_free(first) else second.reverse
    body = tuple(_with_rows(statement, _renamed(second.counter, first.counter)) for statement in second.body)
    return Loop(first.counter, first.length, reverse, (*first.body, *body))


def _renamed(old: str, new: str) -> Callable[[Place], Place]:
    def change(place: Place) -> Place:
        row = place.row
        return Place(place.table, replace(row, loop=new)) if row is not None and row.loop == old else place

    return change


def _with_rows(statement: Statement, change: Callable[[Place], Place]) -> Statement:
    """A statement with other places."""
    match statement:
        case Apply():
            return replace(
                statement,
                inputs=tuple(map(change, statement.inputs)),
                outputs=tuple(map(change, statement.outputs)),
            )
        case Add() | Copy():
            return replace(statement, source=change(statement.source), target=change(statement.target))
        case Loop() | Repeat():
            return replace(statement, body=tuple(_with_rows(each, change) for each in statement.body))
        case _:
            return statement


def _contracted(procedure: Procedure) -> Procedure:
    """Tables of which every round of one loop uses its own row only, as single rows."""
    loops: dict[str, set[int | None]] = {}

    def note(body: Sequence[Statement], loop: Loop | None) -> None:
        for k, statement in enumerate(body):
            if isinstance(statement, (Loop, Repeat)):
                note(statement.body, statement if isinstance(statement, Loop) else None)
                continue
            uses = _uses([statement])
            may_be_single = loop is not None and not _changes_later(statement, body[k + 1 :])
            for place in (*uses.reads, *uses.writes):
                is_own = loop is not None and place.row == Counter(loop.counter) and may_be_single
                loops.setdefault(place.table, set()).add(id(loop) if is_own else None)

    note(procedure.body, None)
    single = {
        table.name
        for table in procedure.of(Storage.WORK)
        if len(table.lengths) == 1 and len(found := loops.get(table.name, {None})) == 1 and None not in found
    }
    if not single:
        return procedure

    def change(place: Place) -> Place:
        return Place(place.table) if place.table in single else place

    return Procedure(
        procedure.name,
        tuple(replace(table, lengths=()) if table.name in single else table for table in procedure.tables),
        tuple(_with_rows(statement, change) for statement in procedure.body),
    )


def _changes_later(statement: Statement, after: Sequence[Statement]) -> bool:
    """Whether a row is copied that other statements write then.

    In emitted text a copy that is a single row may be another name of the row that it was copied from.
    """
    return isinstance(statement, Copy) and statement.source.table in {place.table for place in _uses(after).writes}
