"""Analysis of the values that the reverse mode stores, because they are overwritten before the reverse sweep."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from ..ir.procedure import Add, Clear, Loop, Place
from ..ir.rows import Counter, Parent, Previous, axis_of, computed_numbers, loops_of, numbers_of, start_of
from .replay import flattened, reads_of, writes_of, written


@dataclass(frozen=True, slots=True)
class Position:
    """The position of a statement.

    Attributes
    ----------
    body : sequence of statements
        The statements of the innermost loop, or of the kernel.
    number : int
        The index of the statement in `body`.
    loop : Loop or None
        The loop with this body, if values can be stored for each of its rows.
    after : sequence of statements
        The statements between that loop and the reverse sweep.
    """

    body: Sequence[Any]
    number: int
    loop: Loop | None = None
    after: Sequence[Any] = ()

    def changes(self, place: Place) -> bool:
        """Return whether a place that the statement reads may be overwritten or inaccessible in the reverse sweep."""
        tables = {place.table, start_of(place.row), *computed_numbers(place.row)} - {""}
        if self.loop is None:
            return bool(tables & written(self.body[self.number :]))
        if isinstance(place.row, Previous) or tables & written(self.after):
            return True
        if not tables & written(self.body):
            return False
        if isinstance(place.row, (Counter, Parent)) and start_of(place.row) not in written(self.body):
            return not self._is_written_once(place)
        return True

    def sets(self, place: Place) -> bool:
        """Return whether the statement, or a subsequent one in the body, writes exactly this place."""
        return any(place in writes_of(each) for each in flattened(self.body[self.number :]))

    def _is_written_once(self, place: Place) -> bool:
        """Return whether each row is written only in its own iteration, and before the statement reads it."""
        assert self.loop is not None
        for k, statement in enumerate(self.body):
            for each in flattened([statement]):
                for target in writes_of(each):
                    if target.table != place.table:
                        continue
                    if isinstance(each, (Add, Clear)) or target.row != Counter(self.loop.counter):
                        return False
                    if isinstance(place.row, Counter) and k >= self.number:
                        return False
        return True


def has_loops(body: Sequence[Any]) -> bool:
    """Return whether some of the statements are loops."""
    return any(isinstance(statement, Loop) for statement in body)


def reads_within(statement: Any) -> Iterator[Place]:
    """Yield the places that a statement and the statements in its body read."""
    for each in flattened([statement]):
        yield from reads_of(each)


def is_fixed(place: Place, loop: Loop) -> bool:
    """Return whether the counter of a loop selects a row, and its body neither runs loops for it nor computes it."""
    own = set(loops_of(place.row))
    inner = {each.counter for each in flattened(loop.body) if isinstance(each, Loop)}
    return loop.counter in own and not own & inner and not set(computed_numbers(place.row)) & written(loop.body)


@dataclass(frozen=True, slots=True)
class Stored:
    """The tables that are stored because a loop, which contains loops, runs again in the reverse sweep.

    Attributes
    ----------
    once : list of str
        The tables that are stored before the loop, and restored before its reverse.
    each : list of str
        The tables that are stored and restored in every iteration.
    """

    once: list[str]
    each: list[str]


def tables_to_store(loop: Loop, after: Sequence[Any]) -> Stored:
    """Return the tables to store for a loop that contains loops, except for rows that `is_fixed` describes."""
    read = [place for statement in loop.body for place in reads_within(statement)]
    wide = {place.table for place in read if not is_fixed(place, loop)}
    once = (wide & written(after)) - written(loop.body)
    each = []
    for table, place in carried(loop.body).items():
        places = [place, *(p for s in flattened(loop.body) for p in (*reads_of(s), *writes_of(s)) if p.table == table)]
        if all(axis_of(other.row, loop.counter) is not None for other in places):  # Iterations use rows of their own.
            once |= {table} & wide
        elif not all(is_fixed(other, loop) for other in places):
            each.append(table)
    return Stored(sorted(once), each)


def carried(body: Sequence[Any]) -> dict[str, Place]:
    """Return the tables that carry values between iterations: those read before they are written in a loop body.

    An addition reads its target, unless the body only adds to the table, because such sums outlive the body.
    """
    seen: dict[str, Place | None] = {}
    writes, sums = written(body), only_added(body)
    for each in flattened(body):
        is_changed = isinstance(each, Add) and each.target.table not in sums
        for place in (*reads_of(each), *([each.target] if is_changed else [])):
            start = start_of(place.row)
            found = Place(start) if start else place  # The same loop has written the preceding rows.
            if found.table in writes:
                seen.setdefault(found.table, found)
        for place in writes_of(each):
            seen.setdefault(place.table, None)
    return {table: place for table, place in seen.items() if place is not None}


def only_added(body: Sequence[Any]) -> set[str]:
    """Return the tables that statements add to but do not set, so that the sums outlive them."""
    adds, sets = set[str](), set[str]()
    for each in flattened(body):
        (adds if isinstance(each, Add) else sets).update(place.table for place in writes_of(each))
    return adds - sets


def set_once(statements: Sequence[Any]) -> set[str]:
    """Return the tables in which every row is set exactly once, by a single statement."""
    found: dict[str, list[bool]] = {}

    def visit(body: Sequence[Any], loops: tuple[str, ...]) -> None:
        for statement in body:
            if isinstance(statement, Loop):
                visit(statement.body, (*loops, statement.counter))
            else:
                for place in (p for each in flattened([statement]) for p in writes_of(each)):
                    is_set = not isinstance(statement, (Add, Clear)) and sorted(loops_of(place.row)) == sorted(loops)
                    plain = all(isinstance(each, Counter) for each in numbers_of(place.row))
                    found.setdefault(place.table, []).append(is_set and plain)

    visit(statements, ())
    return {table for table, sets in found.items() if sets == [True]}
