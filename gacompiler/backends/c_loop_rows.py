"""Read the rows of tables to which the pointers and the numbers in the C text of kernels with loops refer."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from ..ir.boundaries import BOUNDARIES
from ..ir.procedure import Place, Storage, Table
from ..ir.rows import (
    Along,
    Counter,
    Following,
    Numbered,
    Parent,
    Previous,
    Row,
    Shifted,
    Through,
    computed_numbers,
    is_shifted,
    numbers_of,
    row_at,
    with_numbers,
)
from .c_loop_tokens import Tokens, Tree, factors_of


class RowReader(Tokens):
    """Reads rows, given the tables and the loops around a statement."""

    def __init__(self, name: str, in_lanes: bool) -> None:
        super().__init__(name)
        self._in_lanes = in_lanes
        self._tables: dict[str, Table] = {}
        self._loops: dict[str, tuple[str, bool]] = {}

    def _place(self, pointer: Tree, condition: Tree | None = None) -> Place:
        """Read the row to which a pointer refers, or to which a number belongs."""
        match pointer:
            case ("?", ("()", "GAC_EXISTS", chosen), row, start) if not is_shifted(self._place(row, chosen).row):
                return self._place_or(row, chosen, self._place(start).table)
            case ("?", chosen, row, start):
                return self._place_or(row, chosen, self._place(start).table)
            case ("&", str(name)) | ("[]", str(name), 0) | str(name) if not self._known(name).lengths:
                return Place(name)
            case str(name) if condition is None:
                return Place(name)
            case (("+" | "[]") as kind, str(name), offset):
                return Place(name, self._row(self._known(name), offset, kind == "+", condition))
        raise self._wrong(f"the row {pointer!r}")

    def _place_or(self, pointer: Tree, condition: Tree, start: str) -> Place:
        """Read a row that is replaced by another one if a condition does not hold."""
        place = self._place(pointer, condition)
        if is_shifted(place.row):
            along = zip(numbers_of(place.row), self._known(place.table).lengths, strict=True)
            return Place(place.table, row_at(tuple(self._or_start(row, length, start) for row, length in along)))
        if computed_numbers(place.row):
            along = zip(numbers_of(place.row), self._known(place.table).lengths, strict=True)
            wanted = [(Place(row.number), length) for row, length in along if isinstance(row, Numbered)]
            if self._ranges(condition) == list(dict.fromkeys(wanted)):
                return Place(place.table, with_numbers(place.row, lambda each: replace(each, start=start)))
        match place.row:
            case Through(index, loop) if condition == (">=", ("[]", index, loop), 0):
                return Place(place.table, Parent(index, loop, start))
            case _Step(loop, -1):
                return Place(place.table, Previous(loop, start))
        raise self._wrong(f"the row {pointer!r} where {condition!r}")

    def _ranges(self, condition: Tree) -> list[tuple[Place, str]]:
        """Read the condition that numbers are those of rows; return each number with the length of its axis."""
        terms = _terms(condition)
        found: list[tuple[Place, str]] = []
        if len(terms) % 2:
            return found
        for lower, upper in zip(terms[::2], terms[1::2], strict=True):
            match lower, upper:
                case (">=", first, 0), ("<", second, str(end)) if first == second:
                    found.append((self._place(first), end))
                case _:
                    return []
        return found

    def _row(self, table: Table, offset: Tree, is_pointer: bool, condition: Tree | None) -> Row:
        factors = factors_of(offset)
        if is_pointer:
            expected: list[Tree] = [table.size] if table.size > 1 else []
            if self._in_lanes and not (table.shared and table.storage is Storage.ARGUMENT):
                expected.append("NLANES")
            if factors[: len(expected)] != expected:
                raise self._wrong(f"{table.name} + {offset!r}")
            factors = factors[len(expected) :]
        if len(factors) != 1:
            raise self._wrong(f"{table.name} + {offset!r}")
        match factors[0]:
            case (("+" | "-") as sign, str(counter), 1) if counter in self._loops:
                return self._stepped(counter, sign, condition)
        return self._number(table, factors[0])

    def _stepped(self, counter: str, sign: str, condition: Tree | None) -> Row:
        """Read the row before or after that of a counter, if a condition ensures that it exists."""
        length, reverse = self._loops[counter]
        there = (">", counter, 0) if sign == "-" else ("<", ("+", counter, 1), length)
        if there not in _terms(condition):
            raise self._wrong(f"the row {counter} {sign} 1 where {condition!r}")
        return Following(counter) if (sign == "-") == reverse else _Step(counter, -1)  # type: ignore[return-value]

    def _number(self, table: Table, number: Tree) -> Row:
        """Read the row given by counters and index tables, in C order."""
        found: list[Along] = []
        for length in reversed(table.lengths[1:]):
            match number:
                case ("+", ("*", outer, str(by)), last) if by == length:
                    found.insert(0, self._along_axis(table, last))
                    number = outer
                case _:
                    raise self._wrong(f"the row {number!r} of {table.name}")
        return row_at((self._along_axis(table, number), *found))

    def _or_start(self, row: Along, length: str, start: str) -> Along:
        """Return a row with the table that replaces it if an axis may lack it."""
        if isinstance(row, Shifted) and row.may_miss(self._loops[row.loop][0], length):
            return replace(row, start=start)
        return row

    def _shifted(self, number: Tree) -> Shifted | None:
        """Read a row at a distance, or return None if it is another row."""
        match number:
            case ("()", "GAC_ROW_AT", str(boundary), at, _):
                pass
            case ("()", str(function), at, _):
                boundary = function.removeprefix("gac_")
            case _:
                return None
        by, stride = 0, 1
        match at:
            case (("+" | "-") as sign, first, int(distance)):
                at, by = first, distance if sign == "+" else -distance
        match at:
            case ("*", int(stride), first):
                at = first
        if boundary not in BOUNDARIES or not isinstance(at, str) or at not in self._loops:
            raise self._wrong(f"the row {number!r}")
        return Shifted(at, by, boundary, stride)

    def _along_axis(self, table: Table, number: Tree) -> Counter | Through | Numbered | Shifted:
        if found := self._shifted(number):
            return found
        match number:
            case ("row", value):
                return Numbered(self._place(value).table, "")
            case str(counter) if counter in self._loops:
                return Counter(counter)
            case ("[]", str(index), entry) if self._known(index).storage is Storage.INDEX:
                column, size = 0, self._known(index).size
                match entry:
                    case ("+", first, int(column)):
                        entry = first
                match entry:
                    case ("*", by, str(counter)) if by == size > 1:
                        entry = counter
                if isinstance(entry, str) and entry in self._loops and column < size:
                    return Through(index, entry, column)
        raise self._wrong(f"the row {number!r} of {table.name}")

    def _known(self, name: str) -> Table:
        if name not in self._tables:
            raise self._wrong(f"the table {name!r}")
        return self._tables[name]


def _terms(condition: Tree | None) -> list[Tree | None]:
    """Return the terms of a conjunction."""
    match condition:
        case ("&&", first, second):
            return [*_terms(first), *_terms(second)]
    return [condition]


class _Step(NamedTuple):
    """The row before that of a counter, until the row that replaces it in the first iteration is known."""

    loop: str
    step: int
