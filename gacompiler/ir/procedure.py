"""Procedures: straight-line programs in loops over the rows of tables. Backends print them for kernels with loops.

A table is an array of numbers. It is a single row of `size` numbers, or has such a row for each index of its leading
axes, whose lengths are named. A procedure specifies which rows each program reads and writes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from .program import Program
from .rows import Parent, Row, computed_numbers, goes_through, indices_of
from .scalar import Op


class Storage(Enum):
    """The purpose of a table."""

    ARGUMENT = "argument"
    RESULT = "result"
    WORK = "work"
    INDEX = "index"


@dataclass(frozen=True, slots=True)
class Table:
    """An array of numbers.

    Attributes
    ----------
    name : str
    lengths : tuple of str
        The names of the lengths of the leading axes. A table without them is a single row.
    shape : tuple of int
        The shape of a row.
    storage : Storage
    shared : bool
        Whether all elements of a batch share this table.
    into : str
        For an index table, the name of the length of the axis that it indexes.
    """

    name: str
    lengths: tuple[str, ...]
    shape: tuple[int, ...]
    storage: Storage
    shared: bool = False
    into: str = ""

    @property
    def size(self) -> int:
        """The number of entries in a row."""
        size = 1
        for n in self.shape:
            size *= n
        return size


@dataclass(frozen=True, slots=True)
class Place:
    """A row of a table."""

    table: str
    row: Row = None


@dataclass(frozen=True, slots=True)
class Apply:
    """Run a program with one row of `inputs` for each argument and one row of `outputs` for each result."""

    program: Program
    inputs: tuple[Place, ...]
    outputs: tuple[Place, ...]


@dataclass(frozen=True, slots=True)
class Add:
    """Add a row to another row.

    The statement has no effect if either row does not exist, because an index is -1 or beyond the last row.
    """

    source: Place
    target: Place


@dataclass(frozen=True, slots=True)
class Copy:
    """Copy a row to another row."""

    source: Place
    target: Place


@dataclass(frozen=True, slots=True)
class Clear:
    """Set all numbers of a table to zero."""

    table: str


@dataclass(frozen=True, slots=True)
class Loop:
    """Run statements for each row of a length, in reverse order if `reverse` is true.

    If `until` is not empty, the loop ends after the iteration in which the number in the only row of that table is
    nonzero. If `first` or `end` is not empty, rows before the number in the only row of `first`, and rows from that of
    `end` on, are left out. Fractional parts of these numbers are ignored, and NaN is 0.
    """

    counter: str
    length: str
    reverse: bool
    body: tuple[Statement, ...]
    until: str = ""
    first: str = ""
    end: str = ""

    @property
    def controls(self) -> tuple[str, ...]:
        """The tables with the numbers that determine which iterations run."""
        return tuple(filter(None, (self.first, self.end, self.until)))


@dataclass(frozen=True, slots=True)
class Repeat:
    """Run statements until the number in the only row of the table `until` is nonzero, at most `limit` times.

    The only row of the table `steps` counts the iterations.
    """

    limit: int
    until: str
    steps: str
    body: tuple[Statement, ...]


Statement = Apply | Add | Copy | Clear | Loop | Repeat


@dataclass(frozen=True, slots=True)
class Procedure:
    """A kernel with loops.

    Attributes
    ----------
    name : str
    tables : tuple of Table
        Arguments and index tables in the order of the parameters, then results in order, then work tables.
    body : tuple of Statement
    """

    name: str
    tables: tuple[Table, ...]
    body: tuple[Statement, ...]

    def table(self, name: str) -> Table:
        """Return the table with a name."""
        return next(table for table in self.tables if table.name == name)

    def of(self, *storages: Storage) -> tuple[Table, ...]:
        """Return the tables with the given kinds of storage, in order."""
        return tuple(table for table in self.tables if table.storage in storages)

    @property
    def parameters(self) -> tuple[Table, ...]:
        """The tables that a caller passes."""
        return self.of(Storage.ARGUMENT, Storage.INDEX)

    @property
    def results(self) -> tuple[Table, ...]:
        """The tables that a call returns."""
        return self.of(Storage.RESULT)

    @property
    def lengths(self) -> tuple[str, ...]:
        """The names of lengths, in the order of their occurrence in the parameters."""
        return tuple(dict.fromkeys(name for table in self.parameters for name in table.lengths))

    @property
    def programs(self) -> tuple[Program, ...]:
        """The distinct programs, in the order of the text."""
        found = {s.program.name: s.program for s in statements(self.body) if isinstance(s, Apply)}
        return tuple(found.values())

    @property
    def read_through(self) -> frozenset[str]:
        """The index tables through which rows are read, except by `Add`. Their entries cannot be -1."""
        found = set[str]()
        for statement in statements(self.body):
            for place in () if isinstance(statement, Add) else _sources(statement):
                if goes_through(place.row):
                    found |= set(indices_of(place.row))
        return frozenset(found)

    @property
    def parent_tables(self) -> frozenset[str]:
        """The index tables of parents. Each entry is an earlier row, or -1."""
        rows = [place.row for statement in statements(self.body) for place in _sources(statement)]
        return frozenset(row.index for row in rows if isinstance(row, Parent))

    @property
    def repeats(self) -> bool:
        """Whether the number of iterations, or the rows that are read, depend on computed values."""
        return self.selects or any(isinstance(s, Repeat) for s in statements(self.body))

    @property
    def selects(self) -> bool:
        """Whether the rows that are read or added to depend on computed values."""
        return any(
            (isinstance(s, Loop) and bool(s.controls))
            or any(computed_numbers(place.row) for place in (*_sources(s), *([s.target] if isinstance(s, Add) else [])))
            for s in statements(self.body)
        )

    @property
    def has_branches(self) -> bool:
        """Whether rounding can change which of several results is chosen, or the number of iterations."""
        choices = {Op.LESS, Op.LESS_EQUAL, Op.EQUAL, Op.SELECT, Op.MINIMUM, Op.MAXIMUM, Op.FLOOR}
        return any(line.op in choices for program in self.programs for line in program.lines)

    @property
    def signature(self) -> str:
        """The shapes in the notation of generalised ufuncs in numpy: ``(n),(n,6),(8)->(8)``."""

        def shapes(tables: tuple[Table, ...]) -> str:
            return ",".join("(" + ",".join([*table.lengths, *map(str, table.shape)]) + ")" for table in tables)

        return f"{shapes(self.parameters)}->{shapes(self.results)}"


def _sources(statement: Statement) -> tuple[Place, ...]:
    """Return the rows that a statement reads, not including those in the body of a loop."""
    match statement:
        case Apply():
            return statement.inputs
        case Add() | Copy():
            return (statement.source,)
        case _:
            return ()


def statements(body: tuple[Statement, ...]) -> Iterator[Statement]:
    """Yield all statements recursively; the body of a loop follows the loop."""
    for statement in body:
        yield statement
        if isinstance(statement, (Loop, Repeat)):
            yield from statements(statement.body)
