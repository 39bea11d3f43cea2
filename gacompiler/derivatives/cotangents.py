"""Tables of cotangents for the tables of a traced kernel, and accumulation of cotangents.

Every table that depends on the parameter has a table of cotangents, with the coefficients of its derivatives.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, Protocol

from ..algebra.layout import SCALAR, Layout
from ..frontend.expression import Expression, lift
from ..frontend.loop_trace import LoopTrace
from ..frontend.recorded import Compute, Record
from ..frontend.recorder import Recorder
from ..frontend.rows import Leaf
from ..ir.procedure import Add, Clear, Loop, Place, Storage
from ..ir.rows import (
    Counter,
    Following,
    Numbered,
    Parent,
    Previous,
    Row,
    computed_numbers,
    row_at,
    start_of,
    with_numbers,
)
from .forward import shape_of
from .replay import Edges, Replay, flattened, reads_of, writes_of
from .stored import only_added, set_once
from .tangents import Key


class Seed(Protocol):
    """The cotangent of a result."""

    def numbers(self, leaf: int, layout: Layout, row: Row) -> list[list[Expression]]:
        """Return the coefficients of `layout` of multivector number `leaf` in a row, for each cotangent."""

    def table(self, layouts: Sequence[Layout]) -> Record | None:
        """Return the table that contains these numbers in this order, or None."""


class Cotangents(Replay):
    """A traced kernel with tables for the cotangents of its tables.

    Parameters
    ----------
    recorder : Recorder
    traced : LoopTrace
    arguments : sequence
        The arguments of the traced kernel.
    layouts : mapping
        The layouts of derivatives, see `tangents.tangent_layouts`.
    wrt : str
        The parameter with respect to which the kernel is differentiated.
    seeds : mapping of str to Seed
        The cotangents of results.
    count : int
        The number of cotangents of each result.
    """

    def __init__(
        self,
        recorder: Recorder,
        traced: LoopTrace,
        arguments: Sequence[Any],
        layouts: Mapping[Key, Layout],
        wrt: str,
        seeds: Mapping[str, Seed],
        count: int = 1,
    ) -> None:
        super().__init__(recorder, traced, arguments)
        self._layouts, self._wrt, self._count, self._seeds = layouts, wrt, count, seeds
        statements = list(flattened(traced.statements))
        self._set_once = set_once(traced.statements)
        self._reads = [place for statement in statements for place in reads_of(statement)]
        self._read = {name for place in self._reads for name in (place.table, start_of(place.row))}
        changed = {place.table for each in statements if not isinstance(each, Clear) for place in writes_of(each)}
        self._zeros = {record.name for record in traced.records if record.storage is Storage.WORK} - changed
        self._edges: list[tuple[str, Edges]] = []
        self._marks_over: dict[tuple[str, ...], tuple[Record, Record]] = {}
        self._restored: dict[str, str] = {}
        """The tables that hold numbers of rows in the reverse sweep, by the tables that held them before."""
        self._starts: dict[tuple[str, int, int], int] = {}
        self._adjoints = self._tables()

    def _tables(self) -> dict[str, Record]:
        found: dict[str, Record] = {}
        for record in self.traced.records:
            active = [leaf for leaf in record.leaves if (record.name, leaf.start) in self._layouts]
            layouts = [self._layouts[record.name, leaf.start] for leaf in active]
            if not active:
                continue
            n = 0
            for seed in range(self._count):
                for leaf, layout in zip(active, layouts, strict=True):
                    self._starts[record.name, leaf.start, seed] = n
                    n += layout.size
            table = self._seeds[record.name].table(layouts) if record.name in self._seeds else None
            if self._is_direct(record.name):
                if table is not None:
                    found[record.name] = table
                continue
            leaves = [Leaf(SCALAR, k) for k in range(n)]
            found[record.name] = self.table_like(record, f"{record.name}_adjoint", leaves, shape_of(record, n))
        return found

    def _is_direct(self, name: str) -> bool:
        """Return whether the cotangent of a result is that given by the caller, without further contributions."""
        if name not in self._seeds or name in self._read:
            return False
        if name in self._set_once:
            return True
        layouts = [self._layouts[key] for key in self._layouts if key[0] == name]
        is_sum = name in only_added([s for s in self.traced.statements if not isinstance(s, Clear)])
        return is_sum and self._seeds[name].table(layouts) is not None

    def _is_sole(self, place: Place) -> bool:
        """Return whether only one part reads a table, row by row, so that its cotangent is set and not accumulated."""
        table = place.table
        if not isinstance(place.row, Counter) or table in self._seeds or self.old[table].lengths == ():
            return False
        if [p for p in self._reads if table in (p.table, start_of(p.row))] != [place]:
            return False
        reads = [s for s in flattened(self.traced.statements) if place in reads_of(s)]
        return all(isinstance(s, Compute) for s in reads) and any(
            isinstance(outer, Loop)
            and outer.counter == place.row.loop
            and reads[0] in outer.body
            and not outer.controls  # The cotangents of rows that are left out are zero.
            for outer in self.traced.statements
        )

    def _begin(self) -> None:
        """Initialise the cotangents of results to the given values, and the others to zero."""
        sole = {place.table for place in self._reads if self._is_sole(place)}
        for name, record in self._adjoints.items():
            if self._is_direct(name):
                continue
            if name in self._seeds:
                self._copy_seed(name, record)
            elif name not in sole:
                self.clear(record)

    def _copy_seed(self, name: str, record: Record) -> None:
        """Set the cotangent of a result, which is also an operand, to that given by the caller."""
        old = self.old[name]
        with ExitStack() as loops:
            counters = [f"seed_{axis}" for axis in range(len(old.lengths))]
            for counter, length in zip(counters, old.lengths, strict=True):
                loops.enter_context(self.loop(Loop(counter, length, False, ()), False))
            row = row_at(tuple(Counter(self.counters[counter]) for counter in counters))
            values: dict[int, Expression] = {}
            for k, leaf in enumerate(old.leaves):
                layout = self._layouts.get((name, leaf.start))
                if layout is not None:
                    for seed, given in enumerate(self._seeds[name].numbers(k, layout, row)):
                        first = self._starts[name, leaf.start, seed]
                        values.update(enumerate(given, start=first))
            self._write(values, Place(record.name, row))

    def _write(self, values: Mapping[int, Expression], place: Place) -> None:
        order = sorted(values)
        self.recorder.compute([values[k] for k in order], [(place, Leaf(SCALAR, k)) for k in order])

    def gradient(self) -> list[Any]:
        """Return the cotangent of the parameter as a list of numbers."""
        return self.held(self._adjoints[self._wrt])

    @contextmanager
    def _backward_loop(self, loop: Loop, ended: str = "") -> Iterator[None]:
        """Record the transposed statements of a loop, in the opposite direction.

        The table `ended` has the number of the row before which a loop has ended early.
        """
        _, first, end = self.controls(loop)
        with self.loop(loop, not loop.reverse, ("", first, ended or end)) as edges:
            self._edges.append((loop.counter, edges))
            yield
            self._edges.pop()

    # Rows of cotangents.

    def _symbol(self, table: str, place: Place, leaf: Leaf) -> Expression:
        return self.recorder.symbol(f"{table}_adjoint", place, leaf)

    def _cotangent(self, target: Place) -> Place:
        """Return the cotangent of a row that is the target of an addition, or zero if the row does not exist."""
        missing = start_of(target.row)
        is_numbered = bool(computed_numbers(target.row))
        if not missing and not is_numbered and not isinstance(target.row, Following):
            return self.place(target, self._adjoints)
        own = self._adjoints[target.table]
        zero = self.new_table("zero", (), own.leaves, own.shape)
        self.clear(zero, self.recorder.depth - 1)
        if isinstance(target.row, Following):
            return Place(own.name, Previous(self.counters[target.row.loop], zero.name))
        if is_numbered:
            return Place(own.name, self._numbered(target.row, zero.name))
        return Place(own.name, self.row(target.row, {**self._adjoints, missing: zero}))

    def _add(self, source: Place, old: Place) -> None:
        """Add a row of cotangents to the cotangent of an old place."""
        own, start = self._adjoints[old.table], start_of(old.row)
        to_start = self._adjoints.get(start) if start not in self._zeros else None
        match old.row:
            case Previous(loop, _):
                target = Place(own.name, Following(self.counters[loop]))
                if to_start is None:
                    self.record(Add(source, target))
                else:
                    self._add_before(source, loop, target, Place(to_start.name))
            case Parent():
                if to_start is not None:
                    self._add_to_start(source, old, to_start)
                self.record(Add(source, Place(own.name, self.through(old.row))))
            case _ if computed_numbers(old.row):
                if to_start is not None:
                    self._add_to_start(source, old, to_start)
                self.record(Add(source, Place(own.name, self._numbered(old.row))))
            case _:
                self.record(Add(source, self.place(old, self._adjoints)))

    def _add_before(self, source: Place, loop: str, target: Place, start: Place) -> None:
        """Add a row to the cotangent of the previous row, or to that of the start in the last reverse iteration."""
        own = self.recorder.records[target.table]
        edges = dict(self._edges)[loop]
        is_inner = loop != self._edges[-1][0]
        if is_inner or source.row is not None:
            single = Place(self.new_table("passed", (), own.leaves, own.shape).name)
            if is_inner:
                self.record(Add(source, single))
            else:
                self.copy(source, single)
            source = single
        passed = self.recorder.records[source.table]
        if is_inner:  # Contributions of an inner loop are accumulated.
            edges.first += self.clearing(passed, edges.depth + 1)
            edges.last.append(Add(source, target))
        else:
            self.record(Add(source, target))
        self.clear(passed, edges.depth)  # This value is used if there are no rows.
        edges.after.append(Add(source, start))

    def _numbered(self, row: Row, start: str = "") -> Row:
        """Return the new row for an old one whose numbers are computed, with another table in place of missing rows."""
        found = self.row(with_numbers(row, lambda each: Numbered(each.number, "")), self._adjoints)
        return with_numbers(found, lambda each: Numbered(self._restored.get(each.number, each.number), start))

    def _add_to_start(self, source: Place, old: Place, start: Record) -> None:
        """Add a row to the start, multiplied by 1 if the old row does not exist, and by 0 otherwise."""
        own, row = self._adjoints[old.table], old.row
        zeros, one = self._marks(old)
        if isinstance(row, Parent):
            mark: Row = Parent(self.row(row, self.tables).index, self.counters[row.loop], one.name)  # type: ignore[union-attr]
        else:
            mark = self._numbered(row, one.name)
        is_missing = self.recorder.symbol("is_missing", Place(zeros.name, mark), Leaf(SCALAR, 0))
        values = {leaf.start: is_missing * self.recorder.symbol("given", source, leaf) for leaf in own.leaves}
        single = Place(self.new_table("of_missing", (), own.leaves, own.shape).name)
        self._write(values, single)
        self.record(Add(single, Place(start.name)))

    def _marks(self, old: Place) -> tuple[Record, Record]:
        """Return a table of zeros with the rows of an old table and a table with a single 1, for missing rows."""
        lengths = self.old[old.table].lengths
        if lengths not in self._marks_over:
            leaves = (Leaf(SCALAR, 0),)
            zeros = self.new_table("zeros", self.lengths(lengths), leaves, ())
            one = self.new_table("one", (), leaves, ())
            self.clear(zeros, self.base)
            self.recorder.compute([lift(1)], [(Place(one.name), leaves[0])], self.base)
            self._marks_over[lengths] = zeros, one
        return self._marks_over[lengths]
