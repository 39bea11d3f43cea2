"""Rows of tables: the current row of a loop, rows that are given by index tables or numbers, and neighbours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Counter:
    """The current row of a loop."""

    loop: str


@dataclass(frozen=True, slots=True)
class Through:
    """The row given by an entry of an index table in the current row of a loop, the only one or that in a column."""

    index: str
    loop: str
    column: int = 0


@dataclass(frozen=True, slots=True)
class Previous:
    """The row of the previous iteration of a loop, or the only row of the table `start` in the first iteration."""

    loop: str
    start: str


@dataclass(frozen=True, slots=True)
class Parent:
    """The row given by the entry of an index table, or the only row of the table `start` if the entry is -1."""

    index: str
    loop: str
    start: str


@dataclass(frozen=True, slots=True)
class Following:
    """The row of the next iteration of a loop, if there is one."""

    loop: str


@dataclass(frozen=True, slots=True)
class Numbered:
    """The row whose number is computed, or the only row of the table `start` if there is no such row.

    The number is the only one in the table `number`, without its fractional part. The target of an addition has no
    `start`, since nothing is added to a row that does not exist.
    """

    number: str
    start: str


@dataclass(frozen=True, slots=True)
class Shifted:
    """The row ``stride * i + by`` for the current row i of a loop, at the place that a boundary mode gives it.

    `boundary` is one of `boundaries.BOUNDARIES`. The only row of the table `start` stands for a row that is missing.
    """

    loop: str
    by: int
    boundary: str
    stride: int = 1
    start: str = ""

    def may_miss(self, loop_length: str, length: str) -> bool:
        """Return whether an axis of a given length may lack the row, if the loop runs over another given length."""
        return self.boundary == "constant" or self.stride != 1 or loop_length != length


@dataclass(frozen=True, slots=True)
class At:
    """A row of a table with several leading axes, by one number for each axis."""

    rows: tuple[Counter | Through | Numbered | Shifted, ...]


Along = Counter | Through | Previous | Parent | Following | Numbered | Shifted
"""A row along one axis."""

Row = Along | At | None
"""A row of a table; None is the only row of a table without leading axes."""


def numbers_of(row: Row) -> tuple[Along, ...]:
    """Return the numbers that determine a row, one for each leading axis of its table."""
    return row.rows if isinstance(row, At) else () if row is None else (row,)


def row_at(numbers: tuple[Along, ...]) -> Row:
    """Return the row that is determined by one number for each leading axis."""
    return At(numbers) if len(numbers) > 1 else numbers[0] if numbers else None  # type: ignore[arg-type]


def axis_of(row: Row, loop: str) -> int | None:
    """Return the axis along which a loop selects rows one by one, or None if there is none."""
    return next((k for k, each in enumerate(numbers_of(row)) if each == Counter(loop)), None)


def loops_of(row: Row) -> tuple[str, ...]:
    """Return the loops on whose current rows a row depends, in the order of the axes."""
    return tuple(each.loop for each in numbers_of(row) if not isinstance(each, Numbered))


def indices_of(row: Row) -> tuple[str, ...]:
    """Return the index tables that determine a row."""
    return tuple(each.index for each in numbers_of(row) if isinstance(each, (Through, Parent)))


def computed_numbers(row: Row) -> tuple[str, ...]:
    """Return the tables with the computed numbers of a row, in the order of the axes."""
    return tuple(each.number for each in numbers_of(row) if isinstance(each, Numbered))


def start_of(row: Row) -> str:
    """Return the table whose only row stands for a row that does not exist, or an empty string."""
    return next(filter(None, (getattr(each, "start", "") for each in numbers_of(row))), "")


def further_tables(row: Row) -> tuple[str, ...]:
    """Return the tables from which a row is determined, or that replace it."""
    return (*indices_of(row), *computed_numbers(row), *filter(None, [start_of(row)]))


def with_tables(row: Row, change: Callable[[str], str], loops: Callable[[str], str] = lambda loop: loop) -> Row:
    """Return a row that is determined by other tables and loops."""

    def changed(each: Along) -> Along:
        match each:
            case Through(index, loop, column):
                return Through(change(index), loops(loop), column)
            case Previous(loop, start):
                return Previous(loops(loop), change(start))
            case Parent(index, loop, start):
                return Parent(change(index), loops(loop), change(start))
            case Numbered(number, start):
                return Numbered(change(number), change(start) if start else "")
            case Shifted():
                start = change(each.start) if each.start else ""
                return replace(each, loop=loops(each.loop), start=start)
            case Counter() | Following():
                return replace(each, loop=loops(each.loop))

    return row_at(tuple(map(changed, numbers_of(row))))


def with_numbers(row: Row, change: Callable[[Numbered], Numbered]) -> Row:
    """Return a row with other computed numbers."""
    return row_at(tuple(change(each) if isinstance(each, Numbered) else each for each in numbers_of(row)))


def goes_through(row: Row) -> bool:
    """Return whether a row is given by index tables, whose entries may be -1."""
    return any(isinstance(each, Through) for each in numbers_of(row))


def is_shifted(row: Row) -> bool:
    """Return whether a row lies at a distance from the current row of a loop."""
    return any(isinstance(each, Shifted) for each in numbers_of(row))


def with_loop(row: Row, old: str, new: str) -> Row:
    """Return a row that depends on the loop `new` instead of the loop `old`."""
    return with_tables(row, lambda table: table, lambda loop: new if loop == old else loop)
