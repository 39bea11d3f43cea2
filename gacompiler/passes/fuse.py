"""Fusion of the loops of a procedure, so that intermediate values are kept in registers.

Loops over the same length are fused if no row is used before it is computed. If the rows of a table are then used only
in the iteration that computes them, the table is replaced by a single row (`_contracted`).

Loops that compute transcendental functions of independent rows are not fused with loops that carry values from row to
row. In a separate loop, processors compute several of these functions at once; in the fused loop, each iteration would
wait for its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ..ir.cost import cost
from ..ir.procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Repeat, Statement, Storage, statements
from ..ir.rows import (
    Counter,
    Following,
    Parent,
    Previous,
    Row,
    axis_of,
    further_tables,
    goes_through,
    is_shifted,
    numbers_of,
    with_loop,
)


def fuse(procedure: Procedure) -> Procedure:
    """Return an equivalent procedure with fewer loops and smaller tables."""
    procedure = _without_unread(procedure)
    return _contracted(replace(procedure, body=_fused(procedure.body)))


def _without_unread(procedure: Procedure) -> Procedure:
    """Return the procedure without copies into work tables that are not read, such as the carries of some `scan`.

    Compilers keep the empty loops, with one iteration for each number.
    """
    read = {place.table for place in _uses(procedure.body).reads}
    unread = {table.name for table in procedure.of(Storage.WORK)} - read

    def kept(body: Sequence[Statement]) -> tuple[Statement, ...]:
        found: list[Statement] = []
        for statement in body:
            if isinstance(statement, (Loop, Repeat)):
                statement = replace(statement, body=kept(statement.body))
            is_empty = isinstance(statement, Loop) and not statement.body
            if not is_empty and not (isinstance(statement, Copy) and statement.target.table in unread):
                found.append(statement)
        return tuple(found)

    body = kept(procedure.body)
    if body == procedure.body:
        return procedure
    used = _uses(body).tables
    tables = tuple(table for table in procedure.tables if table.storage is not Storage.WORK or table.name in used)
    return _without_unread(Procedure(procedure.name, tables, body))


@dataclass(frozen=True, slots=True)
class _Uses:
    """The places that statements read and write."""

    reads: tuple[Place, ...]
    writes: tuple[Place, ...]

    @property
    def tables(self) -> set[str]:
        """The tables that are read or written."""
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
                else:
                    reads += map(Place, statement.controls)
    reads += [Place(name) for place in (*reads, *writes) for name in further_tables(place.row)]
    return _Uses(tuple(reads), tuple(writes))


def _fused(body: Sequence[Statement]) -> tuple[Statement, ...]:
    """Fuse each loop with the last preceding loop that permits it."""
    found: list[Statement] = []
    for statement in body:
        if isinstance(statement, (Loop, Repeat)):
            statement = replace(statement, body=_fused(statement.body))
        if isinstance(statement, Loop):
            place = _partner(found, statement)
            if place is not None:
                partner = found[place]
                assert isinstance(partner, Loop)
                found[place] = _merged(partner, statement)
                continue
        found.append(statement)
    return tuple(found)


def _partner(found: list[Statement], loop: Loop) -> int | None:
    """Return the position of a preceding loop to fuse with, after moving the statements between both before it."""
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
            moved.append(place)  # The other statements can follow the fused loop.
    return None


def _independent(a: Statement, b: Statement) -> bool:
    """Return whether two statements can run in either order."""
    first, second = _uses([a]), _uses([b])
    written = {place.table for place in first.writes}, {place.table for place in second.writes}
    return not (written[0] & second.tables) and not (written[1] & first.tables)


def _can_join(first: Loop, second: Loop) -> bool:
    """Return whether two loops can be fused, with the body of the first one before that of the second."""
    if first.length != second.length or first.controls or second.controls:
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
            axis = axis_of(place.row, first.counter)
            if axis is None or axis != axis_of(row, second.counter):
                return False
    return True


def _by_table(places: Sequence[Place]) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for place in places:
        found.setdefault(place.table, []).append(place.row)
    return found


def _is_ready(written: Row, first: str, used: Row, second: str, reverse: bool) -> bool:
    """Return whether a row that the first loop writes is available when the second uses it in the same iteration."""
    axis = axis_of(written, first)
    if axis is None:
        return False
    if isinstance(used, Previous):
        return used.loop == second
    if isinstance(used, Parent):
        return used.loop == second and not reverse
    return axis == axis_of(used, second)


def _is_free(loop: Loop) -> bool:
    """Return whether the rows of a loop can be computed in any order, with the same rounding."""
    if loop.controls:
        return False
    uses = _uses(loop.body)
    written = {place.table for place in uses.writes}
    in_order = any(
        isinstance(place.row, (Previous, Following, Parent))
        or ((goes_through(place.row) or is_shifted(place.row)) and place.table in written)
        for place in (*uses.reads, *uses.writes)
    )
    return not in_order and all(axis_of(place.row, loop.counter) is not None for place in uses.writes)


def _has_calls(loop: Loop) -> bool:
    """Return whether a loop computes transcendental functions."""
    return any(isinstance(each, Apply) and cost(each.program).call for each in statements(loop.body))


def _merged(first: Loop, second: Loop) -> Loop:
    reverse = first.reverse if not _is_free(first) else second.reverse
    body = tuple(_with_rows(statement, _renamed(second.counter, first.counter)) for statement in second.body)
    return Loop(first.counter, first.length, reverse, (*first.body, *body))


def _renamed(old: str, new: str) -> Callable[[Place], Place]:
    def change(place: Place) -> Place:
        return Place(place.table, with_loop(place.row, old, new))

    return change


def _with_rows(statement: Statement, change: Callable[[Place], Place]) -> Statement:
    """Return a statement with its places replaced by `change`."""
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
    """Replace work tables by single rows if every iteration of a single loop uses only its own row of them."""
    loops: dict[str, set[tuple[int, Row] | None]] = {}

    def note(body: Sequence[Statement], loop: Loop | None, outer: frozenset[str]) -> None:
        for k, statement in enumerate(body):
            if isinstance(statement, Loop):
                note(statement.body, statement, outer | {statement.counter})
                continue
            if isinstance(statement, Repeat):
                note(statement.body, None, frozenset())
                continue
            uses = _uses([statement])
            may_be_single = loop is not None and not _changes_later(statement, body[k + 1 :])
            for place in (*uses.reads, *uses.writes):
                is_own = may_be_single and loop is not None and axis_of(place.row, loop.counter) is not None
                is_own &= all(isinstance(each, Counter) and each.loop in outer for each in numbers_of(place.row))
                loops.setdefault(place.table, set()).add((id(loop), place.row) if is_own else None)

    note(procedure.body, None, frozenset())
    single = {
        table.name
        for table in procedure.of(Storage.WORK)
        if table.lengths and len(found := loops.get(table.name, {None})) == 1 and None not in found
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
    """Return whether a statement copies a row that subsequent statements write.

    In emitted text, a copy into a single row can be an alias of the original row.
    """
    return isinstance(statement, Copy) and statement.source.table in {place.table for place in _uses(after).writes}
