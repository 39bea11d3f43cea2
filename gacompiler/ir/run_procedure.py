"""Interpretation of procedures, row by row, over any ring."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import accumulate
from typing import Any

from .boundaries import row_near
from .interpret import Tape
from .procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Repeat, Statement, Storage
from .rows import Along, Counter, Following, Numbered, Parent, Previous, Shifted, Through, numbers_of, start_of

Rows = list[list[Any]]
"""The rows of a table; rows of several axes are in C order."""

Step = Callable[[], None]
Number = Callable[[], int | None]


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
        lifted = {name: list(map(constant, tape.constants)) for name, tape in _tapes(procedure).items()}
        apply = lambda tape, inputs: tape.run_with(inputs, lifted[tape.program.name])  # noqa: E731
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
    """A procedure prepared for one run: each statement is a function of no arguments, which changes the tables.

    Places are resolved when the run is prepared, since a statement in nested loops runs hundreds of times. The lists of
    rows and the rows themselves are changed in place and never replaced.
    """

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
        steps = self._steps(self._procedure.body)
        try:
            for step in steps:
                step()
        except TypeError as error:
            raise IndexError(f"{self._procedure.name}: a number is used before it is written") from error
        found = {table.name: self._tables[table.name] for table in self._procedure.results}
        for name, rows in found.items():
            if any(value is None for row in rows for value in row):
                raise IndexError(f"{name}: a row is not written")
        return found

    def _steps(self, body: Sequence[Statement]) -> list[Step]:
        return [self._step(statement) for statement in body]

    def _step(self, statement: Statement) -> Step:
        match statement:
            case Apply():
                return self._call(statement)
            case Add():
                return self._addition(statement)
            case Copy():
                row, write = self._row(statement.source), self._target(statement.target)

                def step() -> None:
                    write()[:] = row()

            case Clear():
                rows, constant = self._tables[statement.table], self._constant

                def step() -> None:
                    for each in rows:
                        each[:] = [constant(0)] * len(each)

            case Loop():
                return self._loop(statement)
            case Repeat():
                return self._repetition(statement)
        return step

    def _call(self, statement: Apply) -> Step:
        tape, apply = self._tapes[statement.program.name], self._apply
        inputs = [self._row(place) for place in statement.inputs]
        ends = list(accumulate(len(result.operands) for result in statement.program.results))
        outputs = list(zip(map(self._target, statement.outputs), [0, *ends], ends, strict=False))

        def step() -> None:
            given: list[Any] = []
            for row in inputs:
                given += row()
            found = apply(tape, given)
            for target, start, end in outputs:
                target()[:] = found[start:end]

        return step

    def _addition(self, statement: Add) -> Step:
        target, source = self._number(statement.target), self._number(statement.source)
        has_start, row = bool(start_of(statement.source.row)), self._row(statement.source)
        rows = self._tables[statement.target.table]

        def step() -> None:
            at = target()
            if at is not None and (has_start or source() is not None):
                rows[at][:] = [a + b for a, b in zip(rows[at], row(), strict=True)]

        return step

    def _loop(self, statement: Loop) -> Step:
        steps, count, counter = self._steps(statement.body), self._lengths[statement.length], statement.counter
        first, end = self._bound(statement.first, 0, count), self._bound(statement.end, count, count)
        ends = self._tables[statement.until] if statement.until else None
        counters, directions = self._counters, self._directions
        direction = -1 if statement.reverse else 1, count

        def step() -> None:
            rows = range(first(), end())
            directions[counter] = direction
            for k in reversed(rows) if statement.reverse else rows:
                counters[counter] = k
                for each in steps:
                    each()
                if ends is not None and ends[0][0] != 0:
                    break

        return step

    def _repetition(self, statement: Repeat) -> Step:
        steps, one = self._steps(statement.body), self._constant(1)
        counts, ends = self._tables[statement.steps], self._tables[statement.until]

        def step() -> None:
            for _ in range(statement.limit):
                for each in steps:
                    each()
                counts[0][0] = counts[0][0] + one
                if ends[0][0] != 0:
                    break

        return step

    def _bound(self, table: str, otherwise: int, count: int) -> Callable[[], int]:
        """Return a function of a bound of a loop over `count` rows: the number in a table, or else another one."""
        if not table:
            return lambda: otherwise
        rows = self._tables[table]

        def bound() -> int:
            value = rows[0][0]
            return (int(value) if value < count else count) if value > 0 else 0

        return bound

    def _target(self, place: Place) -> Callable[[], list[Any]]:
        """Return a function of the row to write to."""
        number, rows = self._number(place), self._tables[place.table]

        def target() -> list[Any]:
            at = number()
            if at is None:
                raise IndexError(f"{place.table}: no row to write to")
            return rows[at]

        return target

    def _row(self, place: Place) -> Callable[[], list[Any]]:
        """Return a function of the row to read."""
        rows, start, counters = self._tables[place.table], start_of(place.row), self._counters
        if place.row is None:
            return lambda: rows[0]
        if isinstance(place.row, Counter):
            loop = place.row.loop
            return lambda: rows[counters[loop]]
        number = self._number(place)
        starts = self._tables[start] if start else None

        def row() -> list[Any]:
            at = number()
            if at is not None:
                return rows[at]
            if starts is None:
                raise IndexError(f"{place.table}: an index table has entry -1, where a row is read")
            return starts[0]

        return row

    def _number(self, place: Place) -> Number:
        """Return a function of the index of a row; its value is None if the row does not exist."""
        lengths = self._lengths_of[place.table]
        if place.row is None:
            return lambda: 0
        axes = [self._along(each, length) for each, length in zip(numbers_of(place.row), lengths, strict=True)]
        if len(axes) == 1:
            return axes[0]
        if len(axes) == 2:
            (outer, inner), (_, width) = axes, lengths

            def number_of_two() -> int | None:
                a, b = outer(), inner()
                return None if a is None or b is None else a * width + b

            return number_of_two

        def number() -> int | None:
            position = 0
            for axis, length in zip(axes, lengths, strict=True):
                k = axis()
                if k is None:
                    return None
                position = position * length + k
            return position

        return number

    def _along(self, row: Along, length: int) -> Number:
        """Return a function of the index of a row along an axis; its value is None if the row does not exist."""
        counters, directions, tables = self._counters, self._directions, self._tables
        match row:
            case Numbered(number, _):
                numbers = tables[number]

                def along() -> int | None:
                    value = numbers[0][0]
                    return int(value) if 0 <= value < length else None

            case Counter(loop):
                return lambda: counters[loop]
            case Shifted(loop, by, boundary, stride, _):

                def along() -> int | None:
                    k = stride * counters[loop] + by
                    return k if 0 <= k < length else row_near(boundary, k, length)

            case Previous(loop, _):

                def along() -> int | None:
                    direction, count = directions[loop]
                    k = counters[loop] - direction
                    return k if 0 <= k < count else None

            case Following(loop):

                def along() -> int | None:
                    direction, count = directions[loop]
                    k = counters[loop] + direction
                    return k if 0 <= k < count else None

            case Parent(index, loop, _):
                parents = tables[index]

                def along() -> int | None:
                    k: int = parents[counters[loop]][0]
                    return k if k >= 0 else None

            case Through(index, loop, column):
                entries = tables[index]

                def along() -> int | None:
                    k: int = entries[counters[loop]][column]
                    return k if k >= 0 else None

        return along
