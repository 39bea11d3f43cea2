"""Print the statements of kernels with loops, for languages with loops, conditions and the operators of C.

`LoopWords` defines the notation of loops and conditions in a language. Classes derived from `StatementText` define how
it refers to rows of tables and calls parts.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ..errors import BackendError
from ..ir.procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Repeat, Statement, Storage, Table
from ..ir.procedure_text import at_text
from ..ir.rows import (
    Along,
    At,
    Counter,
    Following,
    Numbered,
    Parent,
    Previous,
    Row,
    Shifted,
    Through,
    goes_through,
    numbers_of,
    start_of,
)
from .printers import Names


class Bound(NamedTuple):
    """A bound of a loop in a text: the length that limits it, and the table with the number, if there is one."""

    length: str
    table: str = ""


@dataclass(frozen=True, slots=True)
class LoopWords:
    """Notation of loops and conditions in a language.

    Attributes
    ----------
    language : str
        The name of the language, for error messages.
    forward, backward : str
        The head of a loop of {counter} from the row {first} to that before {end}, or in the opposite direction.
    bound : str
        A computed number {value} as {first} or {end} of a loop over {length} rows.
    repeat : str
        The head of a loop that runs at most {limit} times.
    condition : str
        The head of a statement that is executed if {condition} holds.
    choice : str
        A conditional expression: {row} if {condition} holds, else {start}.
    index : str
        The entry {counter} of the index table {index}, as the number of a row.
    row, has_row : str
        The computed number {value} as the number of a row, and the condition that this is one of {length} rows.
    near, is_inside : str
        The row that a boundary mode puts at the number {at} of an axis of {length} rows, and the condition that there
        is such a row in the axis.
    at : str
        The current row of a loop, before numbers are added to it.
    count, is_set : str
        The statement that adds 1 to a number, and the condition that a number is not zero.
    has_braces : bool
        Whether a single statement in a loop needs braces.
    indent : str
    """

    language: str
    forward: str
    backward: str
    repeat: str
    bound: str = "({value} > 0 ? {value} < {length} ? (intptr_t){value} : {length} : 0)"
    condition: str = "if ({condition})"
    choice: str = "{condition} ? {row} : {start}"
    index: str = "{index}[{counter}]"
    row: str = "(intptr_t){value}"
    has_row: str = "{value} >= 0 && {value} < {length}"
    near: str = "gac_{boundary}({at}, {length})"
    is_inside: str = "gac_is_inside({at}, {length})"
    at: str = "{counter}"
    count: str = "{} += 1;"
    is_set: str = "{} != 0"
    has_braces: bool = False
    indent: str = "    "


def is_number(table: Table) -> bool:
    """Whether an argument or a work table is a single number instead of an array, which is passed by value."""
    return not table.lengths and not table.shape and table.storage in (Storage.ARGUMENT, Storage.WORK)


def product(*factors: int | str) -> str:
    """Return the text of a product, without factors of 1 and with compound factors in parentheses."""
    texts = [f"({factor})" if " " in str(factor) else str(factor) for factor in factors if factor != 1]
    return " * ".join(texts) or "1"


class StatementText(ABC):
    """Prints the statements of a procedure whose lengths, tables and counters have legal names in the language."""

    words: LoopWords

    def __init__(self, named: Procedure, names: Names) -> None:
        self._procedure, self._names = named, names
        self._loops: dict[str, Loop] = {}

    def lines(self, body: Sequence[Statement]) -> list[str]:
        """Return the lines of statements, without the indentation of a function."""
        return [line for statement in body for line in self._statement(statement)]

    def _statement(self, statement: Statement) -> list[str]:
        match statement:
            case Apply():
                return self._apply(statement)
            case Add(source, target):
                return self._add(source, target)
            case Copy(source, target):
                self._check_target(target)
                return self._copied(source, target)
            case Clear(name):
                return self._cleared(self._procedure.table(name))
            case Loop():
                return self._loop(statement)
            case Repeat():
                return self._repeat(statement)

    def _loop(self, loop: Loop) -> list[str]:
        self._loops[loop.counter] = loop
        first = self._bound(loop, loop.first) if loop.first else "0"
        end = self._bound(loop, loop.end) if loop.end else loop.length
        head = (self.words.backward if loop.reverse else self.words.forward).format(
            counter=loop.counter, first=first, end=end
        )
        return self._block(head, [*self.lines(loop.body), *(self._end(loop.until) if loop.until else [])])

    def _bound(self, loop: Loop, table: str) -> str:
        return self.words.bound.format(value=self._value(Place(table)), length=loop.length)

    def _apply(self, statement: Apply) -> list[str]:
        for place in statement.outputs:
            self._check_target(place)
        for place in statement.inputs:
            if isinstance(place.row, Following):
                raise self._refused(f"a row of {place.table} is read at {place.row}")
        return self._called(statement)

    def _repeat(self, statement: Repeat) -> list[str]:
        words, counter = self.words, self._names.fresh("repeats")
        steps = self._value(Place(statement.steps))
        inner = [*self.lines(statement.body), words.count.format(steps), *self._end(statement.until)]
        return self._block(words.repeat.format(counter=counter, limit=statement.limit), inner)

    def _end(self, until: str) -> list[str]:
        """Return the lines that end a loop if the number in a table is not zero."""
        condition = self.words.is_set.format(self._value(Place(until)))
        return self._block(self.words.condition.format(condition=condition), ["break;"])

    def _add(self, source: Place, target: Place) -> list[str]:
        added = self._summed(source, target)
        if isinstance(target.row, (Previous, Parent)):
            raise self._refused(f"a sum in {target.table} at {target.row}")
        conditions = [self._condition(target)]
        conditions += [self._condition(source)] if isinstance(source.row, Following) or goes_through(source.row) else []
        condition = " && ".join(dict.fromkeys(each for each in conditions if each))
        return self._block(self.words.condition.format(condition=condition), added) if condition else added

    def _block(self, head: str, body: list[str]) -> list[str]:
        """Return a statement with a body, in braces unless it is a single line."""
        inner = [f"{self.words.indent}{line}" for line in body]
        return [head, *inner] if len(body) == 1 and not self.words.has_braces else [f"{head} {{", *inner, "}"]

    def _check_target(self, place: Place) -> None:
        if not all(isinstance(each, (Counter, Through)) for each in numbers_of(place.row)):
            raise self._refused(f"a row of {place.table} is written at {place.row}")

    def _refused(self, found: str) -> BackendError:
        where = f"{self.words.language} text of {self._procedure.name}"
        return BackendError(where, found, "a row that always exists")

    # Parts that depend on the language.

    @abstractmethod
    def _called(self, statement: Apply) -> list[str]:
        """Return the lines that call a part."""

    @abstractmethod
    def _copied(self, source: Place, target: Place) -> list[str]:
        """Return the lines that copy a row to another one."""

    @abstractmethod
    def _summed(self, source: Place, target: Place) -> list[str]:
        """Return the lines that add a row to another one."""

    @abstractmethod
    def _cleared(self, table: Table) -> list[str]:
        """Return the lines that set a table to zero."""

    @abstractmethod
    def _value(self, place: Place) -> str:
        """Return the text of a row that is a single number."""

    # Rows.

    def _chosen(self, place: Place, row: Callable[[Table, str], str], only: Callable[[Table], str]) -> str:
        """Return the text of the row of a place, or of the only row of another table if this row may not exist."""
        table = self._procedure.table(place.table)
        if place.row is None:
            return only(table)
        text = row(table, self._number(table, place.row))
        if start_of(place.row):
            start = only(self._procedure.table(start_of(place.row)))
            return self.words.choice.format(condition=self._condition(place), row=text, start=start)
        return text

    def _step(self, loop: str, step: int) -> str:
        """Return the text of the counter of a loop, one step forward or back."""
        forward = step > 0
        return f"{loop} {'-' if self._loops[loop].reverse == forward else '+'} 1"

    def _near(self, row: Shifted, length: str) -> str:
        """Return the text of the number of a shifted row along an axis."""
        return self.words.near.format(boundary=row.boundary, at=self._at(row), length=length)

    def _at(self, row: Shifted) -> str:
        return at_text(row.stride, self.words.at.format(counter=row.loop), row.by)

    def _number(self, table: Table, row: Row, axis: int = 0) -> str:
        """Return the text of the number of an existing row, along an axis if it is a number along one axis."""
        match row:
            case Shifted():
                return self._near(row, table.lengths[axis])
            case Counter(loop):
                return loop
            case Previous(loop, _):
                return self._step(loop, -1)
            case Following(loop):
                return self._step(loop, 1)
            case Parent(index, loop, _):
                return self.words.index.format(index=index, counter=loop)
            case Through():
                return self.words.index.format(index=row.index, counter=self._entry_of(row))
            case Numbered(number, _):
                return self.words.row.format(value=self._value(Place(number)))
            case At((first, *others)):
                text = self._number(table, first)
                for k, (each, length) in enumerate(zip(others, table.lengths[1:], strict=True), start=1):
                    is_sum = " " in text and not (k == 1 and isinstance(first, Shifted))
                    text = f"{f'({text})' if is_sum else text} * {length} + {self._number(table, each, k)}"
                return text
        raise AssertionError(row)

    def _entry_of(self, row: Through) -> str:
        """Return the text of the place of an entry in an index table."""
        first = product(self._procedure.table(row.index).size, row.loop)
        return f"{first} + {row.column}" if row.column else first

    def _exists(self, row: Shifted, length: str) -> str:
        """Return the condition that an axis has a shifted row that it may lack."""
        is_inside = row.boundary == "constant"
        return self.words.is_inside.format(at=self._at(row), length=length) if is_inside else f"{length} > 0"

    def _condition(self, place: Place) -> str:
        """Return the condition that a row exists, or an empty text if it always exists."""
        lengths = self._procedure.table(place.table).lengths
        each = map(self._condition_along, numbers_of(place.row), lengths)
        return " && ".join(dict.fromkeys(filter(None, each)))

    def _condition_along(self, row: Along, length: str) -> str:
        match row:
            case Shifted() if row.may_miss(self._loops[row.loop].length, length):
                return self._exists(row, length)
            case Numbered(number, _):
                return self.words.has_row.format(value=self._value(Place(number)), length=length)
            case Previous(loop, _) | Following(loop):
                step = 1 if isinstance(row, Following) else -1
                after = self._step(loop, step)
                return f"{loop} > 0" if after.endswith("- 1") else f"{after} < {self._loops[loop].length}"
            case Parent(index, loop, _):
                return f"{index}[{loop}] >= 0"
            case Through():
                return f"{row.index}[{self._entry_of(row)}] >= 0"
        return ""
