"""Recording of the statements of a kernel with loops, by calling its function on symbols.

The function is called once. Each loop function that it calls (`frontend.loops`) traces its body on symbols for one row
and appends a statement. Values are expressions of symbols, and every symbol represents a row of a table. Computations
in a body that depend only on outer values are moved out of the loop here. The recorder is one class, and so one file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import prod
from typing import Any, Protocol, TypeVar

from ..algebra.layout import SCALAR, SCALARS, Layout
from ..algebra.operations import Operation
from ..errors import KernelError
from ..ir.procedure import Copy, Loop, Place, Storage, Table
from ..ir.rows import Counter, Row
from .expression import Expression, topological
from .kernel import Kernel, Parameter
from .names import Names, stem_of
from .recorded import Compute, Record, Recorded, Source, is_constant, worth_storing
from .rows import Leaf, Rows, RowsOf, leaves_of, packing
from .traced import Traced, substituted

Made = TypeVar("Made")


class Inference(Protocol):
    """The interface of the passes that the recorder uses."""

    def layouts(self, kernel: Kernel) -> tuple[Layout, ...]:
        """Return the layouts that hold the results of a kernel, with all relations that they are proved to satisfy."""

    def joined(self, known: Layout, found: Layout) -> Layout:
        """Return the smallest layout that holds elements of both layouts."""

    def joined_with_constant(self, layout: Layout, constant: Expression) -> Layout:
        """Return the smallest layout that holds elements of a layout, and a constant."""

    def sum_of(self, layout: Layout) -> Layout:
        """Return the layout that holds sums of elements of a layout, and zero."""

    def layout_of_constant(self, constant: Expression) -> Layout:
        """Return a layout that holds a constant, with all coefficients stored."""


@dataclass(slots=True)
class Scope:
    """The statements of the function or of a loop that are recorded so far."""

    number: int
    statements: list[Any] = field(default_factory=list)


class Recorder:
    """The state of the tracing of a kernel with loops."""

    def __init__(self, kernel: Kernel, inference: Inference) -> None:
        self.kernel = kernel
        self.inference = inference
        self.records: dict[str, Record] = {}
        self.indices: dict[str, Table] = {}
        self.scopes: list[Scope] = [Scope(0)]
        self.numbers: set[str] = set()  # the tables that hold the numbers of their rows
        self.otherwise: dict[tuple[str, Leaf], Expression] = {}  # the values in the tables of `only_row`
        self._n_scopes = 1
        self._sources: dict[Expression, Source] = {}
        self._symbols: dict[Source, Expression] = {}
        self._stems: dict[Expression, str] = {}
        self._common: dict[tuple[Expression, int], Expression] = {}
        self._known: dict[tuple[Any, ...], Any] = {}
        self._counters: list[str] = []
        self._names = Names()
        self._names_of_symbols = Names()

    # Names, tables and symbols.

    def unique(self, stem: str) -> str:
        """Return a unique name for a table, a counter or a part."""
        return self._names.unique(stem)

    def take(self, name: str) -> None:
        """Reserve the name of a parameter or a length; a parameter and a length may have the same name."""
        self._names.take(name)

    def counter(self) -> str:
        """Return a name for the counter of a loop in the innermost scope; consecutive loops have the same name."""
        while len(self._counters) <= self.depth:
            self._counters.append(self.unique("ijk"[min(len(self._counters), 2)]))
        return self._counters[self.depth]

    @property
    def taken(self) -> set[str]:
        """The names of parameters and lengths."""
        lengths = {name for record in self.records.values() for name in record.lengths}
        lengths |= {name for table in self.indices.values() for name in (*table.lengths, table.into)}
        return lengths | {parameter.name for parameter in self.kernel.parameters}

    def add(self, record: Record) -> Record:
        """Add a new table, and return it."""
        self.records[record.name] = record
        return record

    def tables(
        self,
        stems: Sequence[str],
        lengths: tuple[str, ...],
        layouts: Sequence[Layout],
        structure: Any = None,
        outside: bool = False,
    ) -> list[Rows]:
        """Create tables for intermediate results.

        Parameters
        ----------
        stems : sequence of str
            A name for each multivector.
        lengths : tuple of str
        layouts : sequence of Layout
        structure : nested tuple, optional
            The structure of the results; vectors and matrices in it are stored in one table each, see `packing`.
            Where a leaf is an array, the table has the lengths of the array as further axes.
        outside : bool
            Whether the tables are visible in the scope that encloses the innermost one.
        """
        own = [leaf.lengths if isinstance(leaf, Rows) else () for leaf in leaves_of(structure)]
        groups = [(1, ())] * len(layouts) if structure is None or any(own) else packing(structure, layouts)
        found: list[Rows] = []
        for count, shape in groups:
            k = len(found)
            stem = stem_of(stems[k]) if shape else stems[k]
            further = own[k] if structure is not None else ()
            found += self.packed(stem, (*lengths, *further), layouts[k : k + count], shape, outside)
        return found

    def packed(
        self,
        stem: str,
        lengths: tuple[str, ...],
        layouts: Sequence[Layout],
        outer: tuple[int, ...],
        outside: bool = False,
    ) -> list[Rows]:
        """Create a table whose rows are arrays of the shape `outer` of multivectors with layouts of equal size."""
        starts = [sum(layout.size for layout in layouts[:k]) for k in range(len(layouts) + 1)]
        leaves = tuple(Leaf(layout, start) for layout, start in zip(layouts, starts, strict=False))
        shape = outer + (() if layouts[0].is_scalar else (layouts[0].size,))
        scope = self.scopes[-2 if outside else -1].number
        record = self.add(Record(self.unique(stem), lengths, leaves, Storage.WORK, shape, scope=scope))
        return record.arrays

    def shape_returned(self, lengths: tuple[str, ...], n: int) -> tuple[int, ...]:
        """Return the declared shape of a row of `n` multivectors in a result over several lengths, if any."""
        pinned = self.kernel.returns
        types = pinned if isinstance(pinned, tuple) else (pinned,)
        rows = [each for each in types if isinstance(each, RowsOf) and each.shape]
        shapes = [each.shape for each in rows if each.lengths == lengths and prod(each.shape) == n]
        return shapes[0] if shapes and len(lengths) > 1 else ()

    def symbol(self, stem: str, place: Place, leaf: Leaf, depth: int | None = None) -> Expression:
        """Return the symbol of a multivector in a row, read in the innermost scope or in that of the given depth."""
        depth = self.depth if depth is None else depth
        source = Source(place, leaf, depth, self.scopes[depth].number)
        if source not in self._symbols:
            name = self._names_of_symbols.unique(stem)
            symbol: Expression = Parameter(name, leaf.layout).symbols()
            self._sources[symbol], self._symbols[source], self._stems[symbol] = source, symbol, stem
        return self._symbols[source]

    def row_symbol(self, stem: str, rows: Rows) -> Any:
        """Return the symbol of a single row, or the array itself if it has axes."""
        self.check_rows(rows)
        return rows if rows.order else self.symbol(stem, rows.place, rows.leaf)

    def symbols(self, stems: Sequence[str], arrays: Sequence[Rows], row: Row = None) -> list[Any]:
        """Return the symbols of single rows, or of a given row of arrays; those with further axes are arrays."""
        pairs = zip(stems, arrays, strict=True)
        return [self.row_symbol(stem, rows if row is None else rows.at(row)) for stem, rows in pairs]

    def source(self, symbol: Expression) -> Source:
        """Return the location of the value of a symbol.

        Raises
        ------
        KernelError
            If the symbol belongs to another kernel, or to a loop that has ended.
        """
        source = self._sources.get(symbol)
        if source is None or not self._is_open(source.scope):
            raise KernelError(
                self.kernel.where, f"uses {symbol}, an input of another kernel or of a loop that has ended",
                "its own parameters, and what the loops return",
            )  # fmt: skip
        return source

    def check_rows(self, rows: Rows) -> Rows:
        """Return `rows` if they are visible in the current scope.

        Raises
        ------
        KernelError
            If the array belongs to another kernel, or to a loop that has ended.
        """
        record = self.records.get(rows.table)
        if record is None or not self._is_open(record.scope):
            raise KernelError(
                self.kernel.where, f"uses {rows.table}, an array of another kernel or of a loop that has ended",
                "its own parameters, and what the loops return",
            )  # fmt: skip
        return rows

    def _is_open(self, number: int) -> bool:
        return any(scope.number == number for scope in self.scopes)

    @property
    def depth(self) -> int:
        """Number of loops that enclose the current scope."""
        return len(self.scopes) - 1

    @contextmanager
    def scope(self) -> Iterator[Scope]:
        """Record the statements of a loop."""
        inner = Scope(self._n_scopes)
        self._n_scopes += 1
        self.scopes.append(inner)
        try:
            yield inner
        finally:
            self.scopes.pop()

    def append(self, statement: Recorded) -> None:
        """Record a statement in the innermost scope; a loop without statements is left out."""
        if not (isinstance(statement, Loop) and not statement.body):
            self.scopes[-1].statements.append(statement)

    @contextmanager
    def attempt(self) -> Iterator[None]:
        """Trace a body and discard its statements and tables."""
        kept = [list(scope.statements) for scope in self.scopes]
        records, indices = dict(self.records), dict(self.indices)
        sources, symbols, stems = dict(self._sources), dict(self._symbols), dict(self._stems)
        common, known, counters = dict(self._common), dict(self._known), list(self._counters)
        names, names_of_symbols = self._names.copy(), self._names_of_symbols.copy()
        try:
            yield
        finally:
            for scope, statements in zip(self.scopes, kept, strict=True):
                scope.statements = statements
            self.records, self.indices = records, indices
            self._sources, self._symbols, self._stems = sources, symbols, stems
            self._common, self._known, self._counters = common, known, counters
            self._names, self._names_of_symbols = names, names_of_symbols

    # Computing.

    def layouts_of(self, expressions: Sequence[Any]) -> tuple[Layout, ...]:
        """Return the layouts that hold expressions of symbols, or the rows of arrays."""
        found: dict[int, Layout] = {}
        unknown = []
        for k, expression in enumerate(expressions):
            if isinstance(expression, Rows):
                found[k] = expression.leaf.layout
            elif expression.operation is Operation.INPUT:
                found[k] = self.source(expression).leaf.layout
            elif expression.algebra is SCALARS:
                found[k] = SCALAR
            elif is_constant(expression):
                found[k] = self.inference.layout_of_constant(expression)
            else:
                unknown.append(k)
        if unknown:
            kernel, _ = self._kernel("value", [expressions[k] for k in unknown], None)
            found.update(zip(unknown, self.inference.layouts(kernel), strict=True))
        return tuple(found[k] for k in range(len(expressions)))

    def _kernel(
        self, name: str, expressions: Sequence[Expression], layouts: Sequence[Layout] | None
    ) -> tuple[Kernel, tuple[Expression, ...]]:
        """Return a kernel that computes expressions, and the symbols that are its arguments."""
        used = {node for node in topological(expressions) if node.operation is Operation.INPUT}
        for symbol in used:
            self.source(symbol)
        symbols = tuple(symbol for symbol in self._sources if symbol in used)
        parameters = tuple(Parameter(symbol.data.name, symbol.data.layout) for symbol in symbols)
        function = Traced(symbols, tuple(expressions))
        return Kernel(name, function, parameters, tuple(layouts) if layouts else None, self.kernel.summary), symbols

    def compute(
        self, expressions: Sequence[Expression], targets: Sequence[tuple[Place, Leaf]], depth: int | None = None
    ) -> None:
        """Record the computation of expressions and the write of the results, in the innermost scope or an outer one.

        Subexpressions that change only in an outer loop, or in none, are computed there. Copies of rows need no
        program.
        """
        depth = self.depth if depth is None else depth
        moved = self._moved_out(list(expressions), depth)
        written = {place.table for place, _ in targets}
        computed, others = list[int](), list[Recorded]()
        for k, (expression, (place, leaf)) in enumerate(zip(moved, targets, strict=True)):
            simple = self._simple(expression, place, leaf, written)
            computed += [k] if simple is None else []
            others += simple or []
        if computed:
            name = self.unique(f"{self.kernel.name}_step")
            kernel, symbols = self._kernel(name, [moved[k] for k in computed], [targets[k][1].layout for k in computed])
            sources = tuple(self._sources[symbol] for symbol in symbols)
            stems = tuple(self._stems[symbol] for symbol in symbols)
            statement = Compute(kernel, sources, stems, tuple(targets[k] for k in computed))
            self.scopes[depth].statements.append(statement)
        self.scopes[depth].statements.extend(others)

    def _simple(self, expression: Expression, place: Place, leaf: Leaf, written: set[str]) -> list[Recorded] | None:
        """Return the statements for a result that is a whole row of another table, or None if it must be computed.

        Intermediate rows of several numbers are variables in emitted text. A variable that refers to a row of a table
        would change together with the table.
        """
        target = self.records[place.table]
        if len(target.leaves) > 1 or expression.operation is not Operation.INPUT:
            return None
        source = self.source(expression)
        if source.place == place:
            return []
        other = self.records[source.place.table]
        is_row = len(other.leaves) == 1 and source.leaf.layout == leaf.layout and other.name not in written
        is_variable = other.storage is Storage.WORK and not other.lengths
        is_safe = is_variable or not target.shape or target.lengths or target.storage is Storage.RESULT
        return [Copy(source.place, place)] if is_row and is_safe else None

    def _moved_out(self, expressions: list[Expression], depth: int) -> list[Expression]:
        """Replace subexpressions that can be computed in an outer scope by symbols."""
        depths = self._depths(expressions)
        outer: dict[Expression, None] = {}
        for node in [*expressions, *(n for n in depths if depths[n] == depth)]:
            for each in node.arguments if depths[node] == depth else (node,):
                if -1 < depths[each] < depth:
                    outer |= dict.fromkeys(worth_storing(each))
        if not outer:
            return expressions
        by: dict[Expression, Expression] = {}
        for level in sorted({depths[each] for each in outer}, reverse=True):
            values = [each for each in outer if depths[each] == level]
            by.update(zip(values, self._computed_at(level, values), strict=True))
        return substituted(expressions, by)

    def _depths(self, expressions: Sequence[Expression]) -> dict[Expression, int]:
        """Return, for every node of the expressions, the depth of the loop in which it changes; -1 for constants."""
        depths: dict[Expression, int] = {}
        for node in topological(expressions):
            if node.operation is Operation.INPUT:
                depths[node] = self.source(node).depth
            else:
                depths[node] = max((depths[argument] for argument in node.arguments), default=-1)
        return depths

    def _computed_at(self, depth: int, expressions: Sequence[Expression]) -> list[Expression]:
        """Compute expressions in the scope of the given depth, and return their symbols."""
        inner, self.scopes = self.scopes, self.scopes[: depth + 1]
        try:
            number = self.scopes[-1].number
            new = [each for each in expressions if (each, number) not in self._common]
            records = self.stored(new, ["common"] * len(new), self.layouts_of(new))
            for each, symbol in zip(new, self.symbols(["common"] * len(new), records), strict=True):
                self._common[each, number] = symbol
            return [self._common[each, number] for each in expressions]
        finally:
            self.scopes = inner

    def stored(
        self, values: Sequence[Any], stems: Sequence[str], layouts: Sequence[Layout], structure: Any = None
    ) -> list[Rows]:
        """Create tables of one row or array each, and write values to them; see `tables`."""
        tables = self.tables(stems, (), layouts, structure)
        self.store(values, tables)
        return tables

    def once(self, key: tuple[Any, ...], make: Callable[[], Made]) -> Made:
        """Return what an equal call in the innermost scope has returned, or make it."""
        key = (self.scopes[-1].number, *key)
        if key not in self._known:
            self._known[key] = make()
        found: Made = self._known[key]
        return found

    def selectable(self, rows: Rows, axis: int = 0) -> Rows:
        """Return an array whose rows along an axis can be selected: itself, or a copy if they are already selected."""
        if not self.check_rows(rows).is_selected(axis):
            return rows
        return self.copied(rows)

    def copied(self, rows: Rows) -> Rows:
        """Return an array that consists of the rows of a table of its own."""
        copy: Rows = self.stored([rows], ["gathered"], [rows.leaf.layout], (rows,))[0]
        return copy

    def store(self, values: Sequence[Any], onto: Sequence[Rows], stem: str = "value") -> None:
        """Write expressions to single rows, and arrays to arrays, as if at once; rows of arrays are named `stem`."""
        pairs = list(zip(values, onto, strict=True))
        single = [(value, rows) for value, rows in pairs if not rows.order]
        if single:
            self.compute([value for value, _ in single], [(rows.place, rows.leaf) for _, rows in single])
        arrays = [(value, rows) for value, rows in pairs if rows.order and value != rows]
        if {value.table for value, _ in arrays} & {rows.table for _, rows in arrays}:
            kept = [self.packed("kept", rows.lengths, [rows.leaf.layout], ())[0] for _, rows in arrays]
            self.store([value for value, _ in arrays], kept)
            arrays = [(value, rows) for value, (_, rows) in zip(kept, arrays, strict=True)]
        by_lengths: dict[tuple[str, ...], list[tuple[Rows, Rows]]] = {}
        for value, rows in arrays:
            by_lengths.setdefault(rows.lengths, []).append((value, rows))
        for lengths, together in by_lengths.items():
            counter = self.counter()
            with self.scope() as scope:
                found = self.symbols([stem] * len(together), [value for value, _ in together], Counter(counter))
                self.store(found, [rows.at(Counter(counter)) for _, rows in together])
            self.append(Loop(counter, lengths[0], False, tuple(scope.statements)))
