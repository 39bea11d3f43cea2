"""Replay of the statements of a traced kernel inside another kernel, on which derivatives of loops are based.

A kernel with loops is differentiated statement by statement (`frontend.loop_trace.LoopTrace`). The statements are
recorded again with new tables, by the recorder of loop functions. Derivatives add further statements between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from ..algebra.layout import SCALAR
from ..algebra.operations import Operation
from ..errors import KernelError
from ..frontend.expression import Expression, lift
from ..frontend.kernel import Parameter
from ..frontend.loop_trace import LoopTrace
from ..frontend.recorded import Compute, Record, Recorded, Source, targets_in
from ..frontend.recorder import Recorder
from ..frontend.rows import IndexOf, Leaf, Rows, RowsOf, leaves_of, nested
from ..frontend.traced import substituted
from ..ir.procedure import Add, Clear, Copy, Loop, Place, Repeat, Storage
from ..ir.rows import Parent, Row, Through, computed_numbers, with_tables


@dataclass(slots=True)
class Edges:
    """Statements immediately after a loop, and at the beginning and the end of its body.

    Statements that are recorded at `depth` while the loop is open precede the loop.
    """

    depth: int
    first: list[Any] = field(default_factory=list)
    last: list[Any] = field(default_factory=list)
    after: list[Any] = field(default_factory=list)


class Replay:
    """A traced kernel whose statements are recorded again.

    Names, places and tables of the traced kernel are called old.
    """

    def __init__(self, recorder: Recorder, traced: LoopTrace, arguments: Sequence[Any]) -> None:
        self.recorder, self.traced = recorder, traced
        self.base = recorder.depth
        self.old = {record.name: record for record in traced.records}
        self.tables: dict[str, Record] = {}
        self.counters: dict[str, str] = {}
        self._indices: dict[str, str] = {}
        self._lengths: dict[str, str] = {}
        for parameter, argument in zip(traced.kernel.parameters, arguments, strict=True):
            if isinstance(parameter.type, IndexOf):
                first = argument[0] if parameter.type.columns else argument
                self._indices[parameter.name] = first.name
                self._lengths |= {parameter.type.length: first.length, parameter.type.into: first.into}
            else:
                self.tables[parameter.name] = self._bound(parameter, argument)
        for record in traced.records:
            if record.storage is not Storage.ARGUMENT:
                self.tables[record.name] = self.table_like(record, record.name, record.leaves, record.shape)

    def _bound(self, parameter: Parameter, argument: Any) -> Record:
        """Return the table that holds an argument, or a copy if the argument is computed or part of a table."""
        bound = bound_argument(self.recorder, parameter, argument)
        if isinstance(parameter.type, RowsOf):
            self._lengths.update(zip(parameter.type.lengths, bound.lengths, strict=True))
        return bound

    # Tables.

    def lengths(self, lengths: Sequence[str]) -> tuple[str, ...]:
        """Return the new names of old lengths."""
        return tuple(self._lengths[name] for name in lengths)

    def table_like(self, record: Record, stem: str, leaves: Sequence[Leaf], shape: tuple[int, ...]) -> Record:
        """Return a new table with the number of rows of an old one."""
        return self.new_table(stem, self.lengths(record.lengths), leaves, shape)

    def new_table(self, stem: str, lengths: tuple[str, ...], leaves: Sequence[Leaf], shape: tuple[int, ...]) -> Record:
        """Return a new table for intermediate values."""
        scope = self.recorder.scopes[self.base].number
        name = self.recorder.unique(stem)
        return self.recorder.add(Record(name, lengths, tuple(leaves), Storage.WORK, shape, scope=scope))

    # Rows.

    def row(self, row: Row, tables: Mapping[str, Record]) -> Row:
        """Return the new row for an old one; the table of its start is taken from `tables`."""
        numbers = computed_numbers(row)

        def name(old: str) -> str:
            if old in self._indices:
                return self._indices[old]
            return self.tables[old].name if old in numbers else tables[old].name

        return with_tables(row, name, self.counters.__getitem__)

    def place(self, place: Place, tables: Mapping[str, Record] | None = None) -> Place:
        """Return the new place for an old one, in the table that `tables` assigns to the old table."""
        tables = self.tables if tables is None else tables
        return Place(tables[place.table].name, self.row(place.row, tables))

    def through(self, parent: Parent) -> Through:
        """Return the row given by the index table of a parent, without a start row."""
        return Through(self._indices[parent.index], self.counters[parent.loop])

    # Statements.

    def record(self, statement: Recorded) -> None:
        """Append a statement to the innermost scope."""
        self.recorder.append(statement)

    def clear(self, record: Record, depth: int | None = None) -> None:
        """Set a table to zero, in the innermost scope or in the scope at `depth`."""
        depth = self.recorder.depth if depth is None else depth
        if record.lengths:
            self.recorder.scopes[depth].statements.append(Clear(record.name))
        else:
            targets = [(Place(record.name), Leaf(SCALAR, k)) for k in range(record.table.size)]
            self.recorder.compute([lift(0)] * len(targets), targets, depth)

    def clearing(self, record: Record, depth: int) -> list[Recorded]:
        """Return the statements that set a table to zero, without appending them to the scope at `depth`."""
        scope = self.recorder.scopes[depth]
        kept, scope.statements = scope.statements, []
        self.clear(record, depth)
        found, scope.statements = scope.statements, kept
        return found

    def copy(self, source: Place, target: Place) -> None:
        """Copy a row.

        A copy of a row of a table to a single row is recorded as a part, since a plain copy could become an alias of
        the original row in emitted text.
        """
        old, new = self.recorder.records[source.table], self.recorder.records[target.table]
        if source.row is None or new.lengths or not new.shape:
            self.record(Copy(source, target))
            return
        symbols = [self.recorder.symbol(source.table, source, leaf) for leaf in old.leaves]
        self.recorder.compute(symbols, [(target, leaf) for leaf in new.leaves])

    @contextmanager
    def loop(self, old: Loop, reverse: bool, controls: Sequence[str] = ()) -> Iterator[Edges]:
        """Record a loop over the rows of an old one; `controls` are the new tables of `until`, `first` and `end`."""
        counter, edges = self.recorder.counter(), Edges(self.recorder.depth)
        self.counters[old.counter] = counter
        with self.recorder.scope() as scope:
            yield edges
        if scope.statements:
            (length,) = self.lengths([old.length])
            statements = self.recorder.scopes[-1].statements
            body = (*edges.first, *scope.statements, *edges.last)
            statements.append(Loop(counter, length, reverse, body, *controls))
            statements += edges.after

    def controls(self, old: Loop) -> list[str]:
        """Return the new tables that determine which iterations of an old loop run."""
        return [self.tables[name].name if name else "" for name in (old.until, old.first, old.end)]

    def symbols(self, compute: Compute) -> dict[Expression, Expression]:
        """Return the new symbols for the inputs of a part, by old symbol."""
        return {
            symbol: self.symbol(symbol, source)
            for symbol, source in zip(compute.kernel.function.symbols, compute.sources, strict=True)  # type: ignore[attr-defined]
        }

    def symbol(self, symbol: Expression, source: Source) -> Expression:
        """Return a new symbol for one whose value is at an old source."""
        return self.recorder.symbol(symbol.data.name, self.place(source.place), source.leaf, self.base + source.depth)

    def compute(self, compute: Compute) -> None:
        """Record a part unchanged."""
        values = substituted(values_of(compute), self.symbols(compute))
        self.recorder.compute(values, [(self.place(place), leaf) for place, leaf in compute.targets])

    def primal(self, statement: Recorded) -> None:
        """Record an old statement unchanged."""
        match statement:
            case Compute():
                self.compute(statement)
            case Add(source, target) | Copy(source, target):
                self.record(type(statement)(self.place(source), self.place(target)))
            case Clear(table):
                self.record(Clear(self.tables[table].name))
            case Loop():
                with self.loop(statement, statement.reverse, self.controls(statement)):
                    for inner in statement.body:
                        self.primal(inner)  # type: ignore[arg-type]
            case Repeat():
                self.repeat(statement)

    def repeat(self, statement: Repeat) -> None:
        """Record an old iteration."""
        with self.recorder.scope() as scope:
            for inner in statement.body:
                self.primal(inner)  # type: ignore[arg-type]
        until, steps = self.tables[statement.until].name, self.tables[statement.steps].name
        self.record(Repeat(statement.limit, until, steps, tuple(scope.statements)))

    # Results.

    def value(self, old: Record, record: Record) -> Any:
        """Return the contents of the table for the result `old`: arrays of rows or expressions, in nested tuples."""
        outer = old.shape if old.leaves[0].layout.is_scalar else old.shape[:-1]
        return nested(self.held(record), outer)

    def held(self, record: Record) -> list[Any]:
        """Return the arrays of rows, or the expressions, in a table."""
        if record.lengths:
            return record.arrays
        return [self.recorder.symbol(record.name, Place(record.name), leaf) for leaf in record.leaves]

    def values(self) -> list[Any]:
        """Return the results of the kernel."""
        return [self.value(record, self.tables[name]) for name, record in self.traced.results]


def bound_argument(recorder: Recorder, parameter: Parameter, argument: Any) -> Record:
    """Return the table that holds an argument as declared by a parameter, or a copy if there is no such table."""
    given = leaves_of(argument)
    layout = parameter.layout
    leaves = tuple(Leaf(layout, k * layout.size) for k in range(len(given)))
    if isinstance(given[0], Rows):
        return _bound_rows(recorder, parameter, given, leaves)
    if all(isinstance(e, Expression) and e.operation is Operation.INPUT for e in given):
        sources = [recorder.source(symbol) for symbol in given]
        record = recorder.records[sources[0].place.table]
        is_whole = tuple(source.leaf for source in sources) == record.leaves == leaves
        if is_whole and record.storage is Storage.ARGUMENT and {s.place for s in sources} == {Place(record.name)}:
            return record
    stored = recorder.packed(parameter.name, (), [layout] * len(given), parameter.outer_shape)
    recorder.compute([lift(e) for e in given], targets_in(stored))
    return recorder.records[stored[0].table]


def _bound_rows(recorder: Recorder, parameter: Parameter, given: Sequence[Rows], leaves: tuple[Leaf, ...]) -> Record:
    """Return the table that consists of given arrays of rows, or a copy if there is no such table."""
    record = recorder.records[recorder.check_rows(given[0]).table]
    if record.leaves == leaves and list(given) == record.arrays:
        return record
    if any(rows.leaf.layout != parameter.layout for rows in given):
        raise KernelError(
            f"argument {parameter.name}", f"rows of {', '.join(str(rows.leaf.layout) for rows in given)}",
            f"rows of {parameter.layout}", "return that layout from the loop that creates them",
        )  # fmt: skip
    copied = recorder.packed(parameter.name, given[0].lengths, [parameter.layout] * len(given), parameter.outer_shape)
    recorder.store(given, copied, parameter.name)
    return recorder.records[copied[0].table]


# Places that statements read and write.


def values_of(compute: Compute) -> list[Expression]:
    """Return the expressions of a part in terms of its own symbols."""
    return list(compute.kernel.function.value)  # type: ignore[attr-defined]


def flattened(statements: Sequence[Any]) -> Iterator[Any]:
    """Yield all statements recursively; the body of a loop follows the loop."""
    for statement in statements:
        yield statement
        if isinstance(statement, (Loop, Repeat)):
            yield from flattened(statement.body)


def reads_of(statement: Any) -> list[Place]:
    """Return the places that one statement reads, not including the targets of additions."""
    match statement:
        case Compute():
            own = [source.place for source in statement.sources]
        case Add(source, _) | Copy(source, _):
            own = [source]
        case _:
            return []
    return list(dict.fromkeys(own))


def writes_of(statement: Any) -> list[Place]:
    """Return the places that one statement writes or adds to; for a cleared table, its only row."""
    match statement:
        case Compute():
            return list(dict.fromkeys(place for place, _ in statement.targets))
        case Add(_, target) | Copy(_, target):
            return [target]
        case Clear(table):
            return [Place(table)]
        case Repeat(_, until, steps, _):
            return [Place(until), Place(steps)]
        case _:
            return []


def written(statements: Sequence[Any]) -> set[str]:
    """Return the tables that statements write or add to."""
    return {place.table for each in flattened(statements) for place in writes_of(each)}
