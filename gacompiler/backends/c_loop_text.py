"""The statements of kernels with loops in C: calls of parts and sums of rows, in loops; rows as pointers."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..errors import BackendError
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
    Table,
    Through,
)
from ..ir.program import Program
from .c_functions import has_turns
from .printers import Names


def is_number(table: Table) -> bool:
    """Whether the plain function has it by value: a single number."""
    return not table.lengths and not table.shape and table.storage in (Storage.ARGUMENT, Storage.WORK)


def is_shared(procedure: Procedure, place: Place) -> bool:
    """Whether all elements share the row.

    Raises
    ------
    BackendError
        When a row is that of a shared table, or else that of another table.
    """
    table = procedure.table(place.table)
    start = getattr(place.row, "start", None)
    shared = table.storage is Storage.ARGUMENT and table.shared
    if start is not None and shared != (
        procedure.table(start).storage is Storage.ARGUMENT and procedure.table(start).shared
    ):
        raise BackendError(
            f"C text of {procedure.name}", f"{table.name} and {start}, of which one is shared", "both, or none"
        )
    return shared


def product(*factors: int | str) -> str:
    """A product without factors that are 1; what is no name or number is in parentheses."""
    texts = [f"({factor})" if " " in str(factor) else str(factor) for factor in factors if factor != 1]
    return " * ".join(texts) or "1"


class PlainText:
    """The statements of the plain function."""

    lanes = ""
    """What stands between the size of a row and its number."""

    def __init__(self, named: Procedure, names: Names) -> None:
        self._procedure, self._names = named, names
        self._loops: dict[str, Loop] = {}

    def lines(self, body: Sequence[Statement]) -> list[str]:
        """The text of statements, without the indentation of a function."""
        return [line for statement in body for line in self._statement(statement)]

    def _statement(self, statement: Statement) -> list[str]:
        match statement:
            case Apply():
                return [self._apply(statement)]
            case Add(source, target):
                return self._add(source, target)
            case Copy(source, target):
                self._check_target(target)
                return [self._moved("COPY", "SPREAD", source, target)]
            case Clear(name):
                table = self._procedure.table(name)
                return [f"CLEAR({product(table.size, self._lanes_of(table), *table.lengths)}, {self._start(table)});"]
            case Loop(counter, length, reverse, body):
                self._loops[counter] = statement
                order = f"{length}; {counter}-- > 0;" if reverse else f"0; {counter} < {length}; {counter}++"
                return _block(f"for (intptr_t {counter} = {order})", self.lines(body))
            case Repeat():
                return self._repeat(statement)

    def _apply(self, statement: Apply) -> str:
        for place in statement.outputs:
            self._check_target(place)
        for place in statement.inputs:
            if isinstance(place.row, Following):
                raise self._refused(f"a row of {place.table} is read at {place.row}")
        program = statement.program
        passed = [
            self._pointer(place) if argument.shape else self._value(place)
            for argument, place in zip(program.arguments, statement.inputs, strict=True)
        ]
        passed += map(self._pointer, statement.outputs)
        return self._call(program, passed)

    def _call(self, program: Program, passed: list[str]) -> str:
        return f"NAME({program.name})({', '.join([*passed, *['NULL'] * has_turns(program)])});"

    def _repeat(self, statement: Repeat) -> list[str]:
        counter = self._names.fresh("repeats")
        until, steps = (self._value(Place(name)) for name in (statement.until, statement.steps))
        inner = [*self.lines(statement.body), f"{steps} += 1;", f"if ({until} != 0)", "    break;"]
        return _block(f"for (int {counter} = 0; {counter} < {statement.limit}; {counter}++)", inner)

    def _add(self, source: Place, target: Place) -> list[str]:
        added = self._moved("ADD", "ADD_SPREAD", source, target)
        if isinstance(target.row, (Previous, Parent)):
            raise self._refused(f"a sum in {target.table} at {target.row}")
        conditions = [self._condition(target.row)]
        conditions += [self._condition(source.row)] if isinstance(source.row, (Following, Through)) else []
        condition = " && ".join(dict.fromkeys(each for each in conditions if each))
        return [f"if ({condition})", f"    {added}"] if condition else [added]

    def _moved(self, each: str, spread: str, source: Place, target: Place) -> str:
        """A statement that moves a row, from a shared table to those of NLANES elements by `spread`."""
        size = self._procedure.table(target.table).size
        passed = f"{self._pointer(source)}, {self._pointer(target)});"
        if self.lanes and is_shared(self._procedure, source):
            return f"{spread}({size}, {passed}"
        return f"{each}({product(size, self.lanes or 1)}, {passed}"

    def _check_target(self, place: Place) -> None:
        if not isinstance(place.row, (Counter, Through, type(None))):
            raise self._refused(f"a row of {place.table} is written at {place.row}")

    def _refused(self, found: str) -> BackendError:
        return BackendError(f"C text of {self._procedure.name}", found, "a row that is always there")

    # Rows.

    def _lanes_of(self, table: Table) -> int | str:
        return 1

    def _start(self, table: Table) -> str:
        """The first row of a table as a pointer."""
        return f"&{table.name}" if is_number(table) else table.name

    def _pointer(self, place: Place) -> str:
        """A row as a pointer."""
        return self._chosen(place, self._offset, self._start)

    def _value(self, place: Place) -> str:
        """A row that is one number."""
        return self._chosen(place, self._element, self._only)

    def _chosen(self, place: Place, row: Callable[[Table, str], str], only: Callable[[Table], str]) -> str:
        """The row of a place, or the only row of another table where it has none."""
        table = self._procedure.table(place.table)
        if place.row is None:
            return only(table)
        text = row(table, self._number(table, place.row))
        if isinstance(place.row, (Previous, Parent)):
            start = only(self._procedure.table(place.row.start))
            return f"{self._condition(place.row)} ? {text} : {start}"
        return text

    def _offset(self, table: Table, number: str) -> str:
        return f"{table.name} + {product(table.size, self._lanes_of(table), number)}"

    def _element(self, table: Table, number: str) -> str:
        return f"{table.name}[{number}]"

    def _only(self, table: Table) -> str:
        return table.name if is_number(table) else f"{table.name}[0]"

    def _step(self, loop: str, step: int) -> str:
        """The counter of a loop a step further, or a step back."""
        forward = step > 0
        return f"{loop} {'-' if self._loops[loop].reverse == forward else '+'} 1"

    def _number(self, table: Table, row: Row) -> str:
        match row:
            case Counter(loop):
                return loop
            case Previous(loop, _):
                return self._step(loop, -1)
            case Following(loop):
                return self._step(loop, 1)
            case Parent(index, loop, _):
                return f"{index}[{loop}]"
            case Through(indices, loop):
                text = f"{indices[0]}[{loop}]"
                for index, length in zip(indices[1:], table.lengths[1:], strict=True):
                    text = f"{f'({text})' if ' ' in text else text} * {length} + {index}[{loop}]"
                return text
        raise AssertionError(row)

    def _condition(self, row: Row) -> str:
        """When a row is there; empty where it always is."""
        match row:
            case Previous(loop, _) | Following(loop):
                step = 1 if isinstance(row, Following) else -1
                after = self._step(loop, step)
                return f"{loop} > 0" if after.endswith("- 1") else f"{after} < {self._loops[loop].length}"
            case Parent(index, loop, _):
                return f"{index}[{loop}] >= 0"
            case Through(indices, loop):
                return " && ".join(f"{index}[{loop}] >= 0" for index in indices)
        return ""


class LaneText(PlainText):
    """The statements of the function of NLANES elements."""

    lanes = "NLANES"

    def _call(self, program: Program, passed: list[str]) -> str:
        return f"{'far |= ' if has_turns(program) else ''}NAME({program.name}_lanes)({', '.join(passed)});"

    def _lanes_of(self, table: Table) -> int | str:
        return 1 if table.storage is Storage.ARGUMENT and table.shared else "NLANES"

    def _start(self, table: Table) -> str:
        return table.name

    def _value(self, place: Place) -> str:
        return self._pointer(place)


def _block(head: str, body: list[str]) -> list[str]:
    """A statement with others in it, in braces unless that is one line."""
    inner = [f"    {line}" for line in body]
    return [head, *inner] if len(body) == 1 else [f"{head} {{", *inner, "}"]
