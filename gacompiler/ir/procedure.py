"""Procedures: straight-line programs in loops over the rows of tables. What backends print of a kernel with loops.

A table is an array of numbers: rows of `size` numbers over axes whose lengths have names, or a single row. A procedure
states for each program from which rows it reads and to which it writes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from .program import Program
from .scalar import Op


class Storage(Enum):
    """Whose a table is."""

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
        The names of the lengths of its leading axes; without any it is one row.
    shape : tuple of int
        The shape of a row.
    storage : Storage
    shared : bool
        Whether all elements of a batch have one such table.
    into : str
        For an index table, the length of what it refers to.
    """

    name: str
    lengths: tuple[str, ...]
    shape: tuple[int, ...]
    storage: Storage
    shared: bool = False
    into: str = ""

    @property
    def size(self) -> int:
        """How many numbers a row has."""
        size = 1
        for n in self.shape:
            size *= n
        return size


@dataclass(frozen=True, slots=True)
class Counter:
    """The row that a loop has come to."""

    loop: str


@dataclass(frozen=True, slots=True)
class Through:
    """The row that index tables name in the row that a loop has come to: one index table for each axis."""

    indices: tuple[str, ...]
    loop: str


@dataclass(frozen=True, slots=True)
class Previous:
    """The row that a loop came to before, or the only row of the table `start` where there was none."""

    loop: str
    start: str


@dataclass(frozen=True, slots=True)
class Parent:
    """The row that an index table names, or the only row of the table `start` where it names none."""

    index: str
    loop: str
    start: str


@dataclass(frozen=True, slots=True)
class Following:
    """The row that a loop comes to next, if there is one."""

    loop: str


Row = Counter | Through | Previous | Parent | Following | None
"""Which row of a table; None is its only row."""


@dataclass(frozen=True, slots=True)
class Place:
    """A row of a table."""

    table: str
    row: Row = None


@dataclass(frozen=True, slots=True)
class Apply:
    """Run a program: its arguments are `inputs`, one row each, and its results are `outputs`."""

    program: Program
    inputs: tuple[Place, ...]
    outputs: tuple[Place, ...]


@dataclass(frozen=True, slots=True)
class Add:
    """Add a row to another one.

    Nothing happens where one of them is not there: where an index table says -1, or behind the last row.
    """

    source: Place
    target: Place


@dataclass(frozen=True, slots=True)
class Copy:
    """Copy a row to another one."""

    source: Place
    target: Place


@dataclass(frozen=True, slots=True)
class Clear:
    """Set all numbers of a table to zero."""

    table: str


@dataclass(frozen=True, slots=True)
class Loop:
    """Run statements for each row of a length, the last one first where `reverse` holds."""

    counter: str
    length: str
    reverse: bool
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Repeat:
    """Run statements until the number in the only row of the table `until` is not zero, at most `limit` times.

    The only row of the table `steps` counts how often they ran.
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
        Arguments and index tables in the order of the parameters, then results in their order, then work.
    body : tuple of Statement
    """

    name: str
    tables: tuple[Table, ...]
    body: tuple[Statement, ...]

    def table(self, name: str) -> Table:
        """The table of that name."""
        return next(table for table in self.tables if table.name == name)

    def of(self, *storages: Storage) -> tuple[Table, ...]:
        """The tables of some kinds, in their order."""
        return tuple(table for table in self.tables if table.storage in storages)

    @property
    def parameters(self) -> tuple[Table, ...]:
        """What a call gives."""
        return self.of(Storage.ARGUMENT, Storage.INDEX)

    @property
    def results(self) -> tuple[Table, ...]:
        """What a call gets."""
        return self.of(Storage.RESULT)

    @property
    def lengths(self) -> tuple[str, ...]:
        """The names of lengths, in the order in which the parameters have them."""
        return tuple(dict.fromkeys(name for table in self.parameters for name in table.lengths))

    @property
    def programs(self) -> tuple[Program, ...]:
        """The programs in it, each once, in the order of the text."""
        found = {s.program.name: s.program for s in statements(self.body) if isinstance(s, Apply)}
        return tuple(found.values())

    @property
    def read_through(self) -> frozenset[str]:
        """The index tables that name rows which are read, other than to be added: none of their rows can be -1."""
        found = set[str]()
        for statement in statements(self.body):
            for place in () if isinstance(statement, Add) else _sources(statement):
                if isinstance(place.row, Through):
                    found |= set(place.row.indices)
        return frozenset(found)

    @property
    def parent_tables(self) -> frozenset[str]:
        """The index tables that name parents: those of each row are earlier rows, or -1."""
        rows = [place.row for statement in statements(self.body) for place in _sources(statement)]
        return frozenset(row.index for row in rows if isinstance(row, Parent))

    @property
    def has_branches(self) -> bool:
        """Whether rounding can change which of several results is chosen, or how often statements run."""
        choices = {Op.LESS, Op.LESS_EQUAL, Op.EQUAL, Op.SELECT, Op.MINIMUM, Op.MAXIMUM}
        return any(line.op in choices for program in self.programs for line in program.lines)

    @property
    def signature(self) -> str:
        """The shapes as numpy writes a generalised ufunc: ``(n),(n,6),(8)->(8)``."""

        def shapes(tables: tuple[Table, ...]) -> str:
            return ",".join("(" + ",".join([*table.lengths, *map(str, table.shape)]) + ")" for table in tables)

        return f"{shapes(self.parameters)}->{shapes(self.results)}"


def _sources(statement: Statement) -> tuple[Place, ...]:
    """The rows that a statement reads, those of its loops left out."""
    match statement:
        case Apply():
            return statement.inputs
        case Add() | Copy():
            return (statement.source,)
        case _:
            return ()


def statements(body: tuple[Statement, ...]) -> Iterator[Statement]:
    """All statements, those in loops after the loop."""
    for statement in body:
        yield statement
        if isinstance(statement, (Loop, Repeat)):
            yield from statements(statement.body)
