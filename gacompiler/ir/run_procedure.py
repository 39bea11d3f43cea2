"""Interpretation of procedures, row by row, over any ring."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from .boundaries import row_near
from .interpret import Tape
from .procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Repeat, Statement, Storage
from .rows import Along, Counter, Following, Numbered, Parent, Previous, Shifted, Through, numbers_of, start_of

Rows = list[list[Any]]
"""The rows of a table; rows of several axes are in C order."""


def run_procedure(
    procedure: Procedure,
    lengths: Mapping[str, int],
    arguments: Mapping[str, Sequence[Sequence[Any]]],
    constant: Callable[[Any], Any] = lambda value: value,
    apply: Callable[[Tape, Sequence[Any]], Sequence[Any]] | None = None,
) -> dict[str, Rows]:
    """Run a procedure and return the rows of its results by name.

    Parameters
    ----------
    procedure : Procedure
    lengths : mapping of str to int
    arguments : mapping of str to rows
        The rows of every argument and index table.
    constant : callable
        Lifts exact numbers into the ring.
    apply : callable, optional
        Runs a program on flat inputs. The default is `Tape.run` in the ring.

    Raises
    ------
    IndexError
        When a row is read through an index table whose entry is -1, or a number is used that no statement has written.
    """
    if apply is None:
        apply = lambda tape, inputs: tape.run(inputs, constant)  # noqa: E731
    return _Run(procedure, lengths, arguments, constant, apply).results()


_PREPARED: dict[int, tuple[Procedure, dict[str, Tape]]] = {}
"""The prepared programs of the procedure that was run last, by its identity. The same one is run at many points."""


def _tapes(procedure: Procedure) -> dict[str, Tape]:
    if id(procedure) not in _PREPARED:
        _PREPARED.clear()
        _PREPARED[id(procedure)] = procedure, {program.name: Tape(program) for program in procedure.programs}
    return _PREPARED[id(procedure)][1]


def is_dyadic(procedure: Procedure) -> bool:
    """Return whether binary fractions are mapped to binary fractions (`Tape.is_dyadic`)."""
    return all(tape.is_dyadic for tape in _tapes(procedure).values())


class _Run:
    """The state of a running procedure: the rows of its tables, and the current rows of its loops."""

    def __init__(
        self,
        procedure: Procedure,
        lengths: Mapping[str, int],
        arguments: Mapping[str, Sequence[Sequence[Any]]],
        constant: Callable[[Any], Any],
        apply: Callable[[Tape, Sequence[Any]], Sequence[Any]],
    ) -> None:
        self._procedure, self._lengths, self._constant, self._apply = procedure, lengths, constant, apply
        self._tables: dict[str, Rows] = {name: [list(row) for row in rows] for name, rows in arguments.items()}
        for table in procedure.of(Storage.RESULT, Storage.WORK):
            count = 1
            for name in table.lengths:
                count *= lengths[name]
            self._tables[table.name] = [[None] * table.size for _ in range(count)]
        self._lengths_of = {table.name: tuple(lengths[name] for name in table.lengths) for table in procedure.tables}
        self._counters: dict[str, int] = {}
        self._directions: dict[str, tuple[int, int]] = {}
        self._tapes = _tapes(procedure)

    def results(self) -> dict[str, Rows]:
        """Run the procedure and return its results. Numbers are None until a statement writes them."""
        try:
            self._run(self._procedure.body)
        except TypeError as error:
            raise IndexError(f"{self._procedure.name}: a number is used before it is written") from error
        found = {table.name: self._tables[table.name] for table in self._procedure.results}
        for name, rows in found.items():
            if any(value is None for row in rows for value in row):
                raise IndexError(f"{name}: a row is not written")
        return found

    def _run(self, body: Sequence[Statement]) -> None:
        for statement in body:
            match statement:
                case Apply():
                    given = [value for place in statement.inputs for value in self._row(place)]
                    found = iter(self._apply(self._tapes[statement.program.name], given))
                    for place, result in zip(statement.outputs, statement.program.results, strict=True):
                        self._write(place, [next(found) for _ in result.operands])
                case Add():
                    at, of = self._number(statement.target), statement.source
                    if at is not None and (self._number(of) is not None or start_of(of.row)):
                        row = self._tables[statement.target.table][at]
                        row[:] = [a + b for a, b in zip(row, self._row(of), strict=True)]
                case Copy():
                    self._write(statement.target, list(self._row(statement.source)))
                case Clear():
                    for row in self._tables[statement.table]:
                        row[:] = [self._constant(0)] * len(row)
                case Loop():
                    count = self._lengths[statement.length]
                    rows = range(self._bound(statement.first, 0, count), self._bound(statement.end, count, count))
                    self._directions[statement.counter] = (-1 if statement.reverse else 1, count)
                    for k in reversed(rows) if statement.reverse else rows:
                        self._counters[statement.counter] = k
                        self._run(statement.body)
                        if statement.until and self._tables[statement.until][0][0] != 0:
                            break
                case Repeat():
                    for _ in range(statement.limit):
                        self._run(statement.body)
                        steps = self._tables[statement.steps][0]
                        steps[0] = steps[0] + self._constant(1)
                        if self._tables[statement.until][0][0] != 0:
                            break

    def _bound(self, table: str, otherwise: int, count: int) -> int:
        """Return a bound of a loop over `count` rows: the number in a table, or another one without a table."""
        if not table:
            return otherwise
        value = self._tables[table][0][0]
        return (int(value) if value < count else count) if value > 0 else 0

    def _write(self, place: Place, values: list[Any]) -> None:
        at = self._number(place)
        if at is None:
            raise IndexError(f"{place.table}: no row to write to")
        self._tables[place.table][at][:] = values

    def _row(self, place: Place) -> list[Any]:
        at = self._number(place)
        if at is not None:
            return self._tables[place.table][at]
        start = start_of(place.row)
        if not start:
            raise IndexError(f"{place.table}: an index table has entry -1, where a row is read")
        return self._tables[start][0]

    def _number(self, place: Place) -> int | None:
        """Return the index of a row, or None if the row does not exist."""
        row = place.row
        if row is None:
            return 0
        if type(row) is Counter:
            return self._counters[row.loop]
        position = 0
        for each, length in zip(numbers_of(row), self._lengths_of[place.table], strict=True):
            k = self._along(each, length)
            if k is None:
                return None
            position = position * length + k
        return position

    def _along(self, row: Along, length: int) -> int | None:
        """Return the index of a row along an axis, or None if the row does not exist."""
        match row:
            case Numbered(number, _):
                value = self._tables[number][0][0]
                return int(value) if 0 <= value < length else None
            case Counter(loop):
                return self._counters[loop]
            case Shifted(loop, by, boundary, stride, _):
                return row_near(boundary, stride * self._counters[loop] + by, length)
            case Previous(loop, _):
                direction, count = self._directions[loop]
                k = self._counters[loop] - direction
                return k if 0 <= k < count else None
            case Following(loop):
                direction, count = self._directions[loop]
                k = self._counters[loop] + direction
                return k if 0 <= k < count else None
            case Parent(index, loop, _):
                k = self._tables[index][self._counters[loop]][0]
                return k if k >= 0 else None
            case Through(index, loop, column):
                k = self._tables[index][self._counters[loop]][column]
                return k if k >= 0 else None
