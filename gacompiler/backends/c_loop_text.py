"""Print the statements of kernels with loops in C, with rows as pointers."""

from __future__ import annotations

from ..errors import BackendError
from ..ir.procedure import Apply, Loop, Place, Procedure, Repeat, Statement, Storage, Table
from ..ir.program import Program
from ..ir.rows import Shifted, computed_numbers, start_of
from .c_rounds import kept_by_rounds
from .c_vectors import VECTORS, numbered_places, vector_loops
from .c_windows import SPLIT, interior_of
from .loop_statements import LoopWords, StatementText
from .loop_statements import is_number as is_number
from .loop_statements import product as product
from .printers import Names
from .transcendental import has_trigonometric

C_WORDS = LoopWords(
    language="C",
    forward="for (intptr_t {counter} = {first}; {counter} < {end}; {counter}++)",
    backward="for (intptr_t {counter} = {end}; {counter}-- > {first};)",
    repeat="for (int {counter} = 0; {counter} < {limit}; {counter}++)",
)


def is_shared(procedure: Procedure, place: Place) -> bool:
    """Whether the row is shared by all elements.

    Raises
    ------
    BackendError
        If the row may belong to one of two tables, of which only one is shared.
    """
    table = procedure.table(place.table)
    start = start_of(place.row)
    shared = table.storage is Storage.ARGUMENT and table.shared
    if start and shared != (procedure.table(start).storage is Storage.ARGUMENT and procedure.table(start).shared):
        raise BackendError(
            f"C text of {procedure.name}", f"{table.name} and {start}, of which one is shared", "both or neither shared"
        )
    return shared


class PlainText(StatementText):
    """The statements of the plain function."""

    words = C_WORDS
    lanes = ""
    """The factor between the size of a row and its number."""
    _split: Loop | None = None
    """The loop that is split into borders and an interior, during the printing of its body."""
    _is_inside = False
    """Whether the body of a loop in vectors is being printed."""

    def __init__(self, named: Procedure, names: Names) -> None:
        super().__init__(named, names)
        self._vector_loops = vector_loops(named)

    def _statement(self, statement: Statement) -> list[str]:
        if isinstance(statement, Loop) and any(loop is statement for loop in self._vector_loops):
            return self._vectors(statement)
        interior = interior_of(self._procedure, statement) if isinstance(statement, Loop) and not self.lanes else None
        if interior is None:
            return super()._statement(statement)
        assert isinstance(statement, Loop)
        self._loops[statement.counter] = self._split = statement
        head = f"{SPLIT}({statement.counter}, {statement.length}, {interior.first}, {interior.last},"
        body = [f"    {line}" for line in self.lines(statement.body)]
        self._split = None
        if len(body) == 1:
            return [head, f"{body[0]})"]
        return [f"{head} {{", *body, "})"]

    def _vectors(self, loop: Loop) -> list[str]:
        """Return a loop that runs in blocks of LANES iterations if all rows with computed numbers exist."""
        self._loops[loop.counter] = loop
        conditions = list(dict.fromkeys(super(PlainText, self)._condition(each) for each in numbered_places(loop)))
        self._is_inside = True
        body = [f"    {line}" for line in self.lines(loop.body)]
        self._is_inside = False
        head = f"{VECTORS}({loop.counter}, {loop.length}, {' && '.join(conditions) or '1'},"
        if len(body) == 1:
            return [head, f"{body[0]})"]
        return [f"{head} {{", *body, "})"]

    def _condition(self, place: Place) -> str:
        condition = super()._condition(place)
        return f"GAC_EXISTS({condition})" if self._is_inside and computed_numbers(place.row) else condition

    def _near(self, row: Shifted, length: str) -> str:
        if self._split is not None and row.loop == self._split.counter:
            return f"GAC_ROW_AT({row.boundary}, {self._at(row)}, {length})"
        return super()._near(row, length)

    def _exists(self, row: Shifted, length: str) -> str:
        condition = super()._exists(row, length)
        is_split = self._split is not None and row.loop == self._split.counter
        return f"GAC_EXISTS({condition})" if is_split else condition

    def _called(self, statement: Apply) -> list[str]:
        program = statement.program
        passed = [
            self._pointer(place) if argument.shape else self._value(place)
            for argument, place in zip(program.arguments, statement.inputs, strict=True)
        ]
        passed += map(self._pointer, statement.outputs)
        return [self._call(program, passed)]

    def _call(self, program: Program, passed: list[str]) -> str:
        return f"NAME({program.name})({', '.join([*passed, *['NULL'] * has_trigonometric(program)])});"

    def _copied(self, source: Place, target: Place) -> list[str]:
        return [self._moved("COPY", "SPREAD", source, target)]

    def _summed(self, source: Place, target: Place) -> list[str]:
        return [self._moved("ADD", "ADD_SPREAD", source, target)]

    def _moved(self, each: str, spread: str, source: Place, target: Place) -> str:
        """Return a statement that copies or adds a row; `spread` is used from a shared table to NLANES elements."""
        size = self._procedure.table(target.table).size
        passed = f"{self._pointer(source)}, {self._pointer(target)});"
        if self.lanes and is_shared(self._procedure, source):
            return f"{spread}({size}, {passed}"
        return f"{each}({product(size, self.lanes or 1)}, {passed}"

    def _cleared(self, table: Table) -> list[str]:
        return [f"CLEAR({product(table.size, self._lanes_of(table), *table.lengths)}, {self._start(table)});"]

    # Rows.

    def _lanes_of(self, table: Table) -> int | str:
        return 1

    def _start(self, table: Table) -> str:
        """Return a pointer to the first row of a table."""
        return f"&{table.name}" if is_number(table) else table.name

    def _pointer(self, place: Place) -> str:
        """Return a pointer to a row."""
        return self._chosen(place, self._offset, self._start)

    def _value(self, place: Place) -> str:
        return self._chosen(place, self._element, self._only)

    def _offset(self, table: Table, number: str) -> str:
        return f"{table.name} + {product(table.size, self._lanes_of(table), number)}"

    def _element(self, table: Table, number: str) -> str:
        return f"{table.name}[{number}]"

    def _only(self, table: Table) -> str:
        return table.name if is_number(table) else f"{table.name}[0]"


class LaneText(PlainText):
    """The statements of the function of NLANES elements."""

    lanes = "NLANES"

    def __init__(self, named: Procedure, names: Names) -> None:
        super().__init__(named, names)
        self._kept = iter(kept_by_rounds(named))

    def _repeat(self, statement: Repeat) -> list[str]:
        rounds = self._names.fresh("rounds")
        pairs = [
            (product(table.size, self.lanes, *table.lengths), table.name, copy.name) for table, copy in next(self._kept)
        ]
        inner = [f"KEEP({rounds}, {size}, {name}, {copy});" for size, name, copy in pairs]
        inner += self.lines(statement.body)
        inner += [f"RESTORE({rounds}, {size}, {copy}, {name});" for size, name, copy in pairs]
        inner += [f"COUNT({rounds}, {self._value(Place(statement.steps))});"]
        inner += [f"if (ALL_ENDED({rounds}, {self._value(Place(statement.until))}))", "    break;"]
        return self._block(f"ROUNDS({rounds}, {statement.limit})", inner)

    def _call(self, program: Program, passed: list[str]) -> str:
        return f"{'far |= ' if has_trigonometric(program) else ''}NAME({program.name}_lanes)({', '.join(passed)});"

    def _lanes_of(self, table: Table) -> int | str:
        return 1 if table.storage is Storage.ARGUMENT and table.shared else "NLANES"

    def _start(self, table: Table) -> str:
        return table.name

    def _value(self, place: Place) -> str:
        return self._pointer(place)
