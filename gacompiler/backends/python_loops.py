"""Print kernels with loops as Python: functions on numpy arrays that numba can compile.

Tables over lengths are parameters, which the function reads and writes by rows. Tables of a single row are variables.
The functions of straight-line parts are annotated with the shapes of rows: ``R`` is a number, ``R3x3`` a matrix.
Some functions are free names, which must be bound to run the text: ``_row_or(table, k, start)`` returns row k of a
table, or `start` if there is no such row; ``_add_to(table, k, row)`` adds a row to row k if it exists; and ``_sum(a,
b)`` returns the sum of two rows. ``_bound(x, n)`` returns a computed number as the bound of a loop over n rows.
``_number(x)`` is a number of another table, in the type of the kernel. Constant rows are flat.
Functions such as ``_reflect(k, n)`` return the row that a boundary mode puts at k.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ..errors import BackendError
from ..ir.cost import Cost
from ..ir.procedure import (
    Add,
    Apply,
    Clear,
    Copy,
    Loop,
    Place,
    Procedure,
    Repeat,
    Statement,
    Storage,
    Table,
    statements,
)
from ..ir.procedure_text import at_text
from ..ir.program import Program
from ..ir.rows import (
    Along,
    At,
    Counter,
    Following,
    Numbered,
    Parent,
    Previous,
    Shifted,
    Through,
    goes_through,
    indices_of,
    numbers_of,
    start_of,
)
from ..ir.scalar import Rational
from .module import LoopSource
from .printers import Names, number
from .python_text import function_text

READ_OR = "_row_or"
ADD_TO = "_add_to"
SUM = "_sum"
BOUND = "_bound"
NUMBER = "_number"

_INDENT = "    "


@dataclass(frozen=True, slots=True)
class LoopText:
    """A kernel with loops as Python text.

    Attributes
    ----------
    parts : dict of str to list of str
        The lines of the functions of its straight-line programs, by the names of the programs.
    options : list of str
        The arguments of the decorator that follow the signature and the layouts.
    head : str
        The line ``def ...``.
    body : list of str
        The statements.
    """

    parts: dict[str, list[str]]
    options: list[str]
    head: str
    body: list[str]


def part_name(program: Program) -> str:
    """Return the name of the function of a straight-line program."""
    return f"_{program.name}"


def loop_text(procedure: Procedure) -> LoopText:
    """Print a procedure.

    Raises
    ------
    BackendError
        If it contains a statement that tracing does not produce.
    """
    printer = _Printer(procedure)
    parts = {}
    for program in procedure.programs:
        if moves_numbers(program):
            continue
        lines = function_text(program)
        parts[program.name] = [_part_head(program, lines[0]), *lines[1:]]
    body = list(printer.lines(procedure.body, _INDENT))
    return LoopText(parts, printer.options(), printer.head, body)


def moves_numbers(program: Program) -> bool:
    """Whether the results are constants, or the arguments in their order and all of them numbers.

    Such a program is not printed as a part.
    """
    if program.lines:
        return False
    results = [operand for result in program.results for operand in result.operands]
    if program.arguments:
        shapes = {*(argument.shape for argument in program.arguments), *(result.shape for result in program.results)}
        return shapes == {()} and results == [argument.components[0] for argument in program.arguments]
    return True


def _part_head(program: Program, head: str) -> str:
    """Return the first line of the function of a part, with the types of its rows: ``R8`` has 8 numbers."""
    names = filter(None, head.partition("(")[2].removesuffix("):").split(", "))
    typed = [f"{name}: {_row(argument.shape)}" for name, argument in zip(names, program.arguments, strict=True)]
    results = ", ".join(_row(result.shape) for result in program.results)
    returned = f"({results})" if len(program.results) > 1 else results
    return f"def {part_name(program)}({', '.join(typed)}) -> {returned}:"


def _moved(program: Program, inputs: Sequence[str]) -> Iterator[str]:
    """Yield the texts of results that are constants or arguments."""
    given = iter(inputs)
    for result in program.results:
        numbers = [f"{NUMBER}({next(given)})" if isinstance(o, str) else _constant(o) for o in result.operands]
        if not result.shape:
            yield numbers[0]
        elif len(set(numbers)) == 1:
            yield f"({numbers[0]},) * {len(numbers)}"
        else:
            yield f"({', '.join(numbers)})"


def _constant(value: Rational) -> str:
    """Write a constant as a floating-point number."""
    text = number(value)
    return f"{text}.0" if text.lstrip("-").isdigit() else text


def _row(shape: Sequence[int]) -> str:
    return f"R{'x'.join(map(str, shape))}"


def costs_text(costs: Sequence[tuple[str, Cost]]) -> str:
    """Format operation counts as a sum over loops: ``n * (51 mul, 36 add, 51 fma) + 48 mul, 40 add, 48 fma``."""
    sums: dict[str, dict[str, int]] = {}
    for often, cost in costs:
        counts = sums.setdefault(often, dict.fromkeys(cost.as_dict(), 0))
        for name, count in cost.as_dict().items():
            counts[name] += count
    terms = []
    for often, counts in sorted(sums.items(), key=lambda item: not item[0]):
        if any(counts.values()):
            cost = Cost(**counts)
            text = f"{cost}, {cost.fma} fma"
            terms.append(f"{often} * ({text})" if often else text)
    return " + ".join(terms) or "0 mul, 0 add, 0 fma"


def index_rules(procedure: Procedure) -> dict[str, str]:
    """Return the valid entries of each index table, and the length that they refer to.

    These are ``a row of m`` if a part reads rows through the table, ``a row or -1 of m`` if rows are only added, and
    ``an earlier row or -1 of n`` if the table describes the tree that a loop follows.
    """
    read, parents = set[str](), set[str]()
    for statement in statements(procedure.body):
        if isinstance(statement, Loop):
            parents |= _summed(statement)
        sources = statement.inputs if isinstance(statement, Apply) else ()
        if isinstance(statement, (Add, Copy)):
            sources = (statement.source,)
        for place in sources:
            if isinstance(place.row, Parent):
                parents.add(place.row.index)
            elif not isinstance(statement, Add):
                read |= set(indices_of(place.row))
    return {
        table.name: f"{'an earlier' if table.name in parents else 'a'} row"
        f"{'' if table.name in read else ' or -1'} of {table.into}"
        for table in procedure.of(Storage.INDEX)
    }


def _summed(loop: Loop) -> set[str]:
    """Return the index tables through which a loop adds to rows that it reads later itself."""
    read = {
        place.table
        for statement in loop.body
        if isinstance(statement, Apply)
        for place in statement.inputs
        if place.row == Counter(loop.counter)
    }
    return {
        name
        for statement in loop.body
        if isinstance(statement, Add) and statement.target.table in read
        for name in indices_of(statement.target.row)
    }


def kernel_names(source: LoopSource) -> tuple[str, ...]:
    """Return the names that belong to a kernel with loops in the emitted files, except for those of its parts."""
    name = source.procedure.name
    return (name, f"{name}_rows", f"{name}_work")


class _Printer:
    """Prints a procedure, with names for its tables, lengths and counters."""

    def __init__(self, procedure: Procedure) -> None:
        self._procedure = procedure
        names = Names()
        self._tables = {table.name: table for table in procedure.tables}
        self._names = {table.name: names.fresh(table.name) for table in procedure.tables}
        counters = dict.fromkeys(each.counter for each in statements(procedure.body) if isinstance(each, Loop))
        self._counters = {counter: names.fresh(counter) for counter in counters}
        self._lengths = {length: names.fresh(length) for length in procedure.lengths}
        self._repeat = names.fresh("k")
        self._reversed: dict[str, bool] = {}
        inner = [*(table.name for table in procedure.of(Storage.WORK)), *self._counters]
        for name in inner:
            if {**self._names, **self._counters}[name] != name:
                raise BackendError(f"kernel {procedure.name}", f"a table or a loop {name}", "a legal name")

    @property
    def head(self) -> str:
        """The line ``def ...``: lengths, arguments, results, and intermediate tables over lengths."""
        tables = [table for table in self._procedure.tables if table.storage is not Storage.WORK or table.lengths]
        names = [*self._lengths.values(), *(self._names[table.name] for table in tables)]
        return f"def {self._procedure.name}({', '.join(names)}):"

    def options(self) -> list[str]:
        """Return the arguments of the decorator that describe tables."""
        procedure = self._procedure
        work = procedure.of(Storage.WORK)
        shared = [table.name for table in procedure.of(Storage.ARGUMENT) if table.shared]
        rules = ", ".join(f'"{name}": "{rule}"' for name, rule in index_rules(procedure).items())
        public = [table.name for table in (*procedure.parameters, *procedure.results)]
        found = [f'names="{" ".join(public)}"'] if any(self._names[name] != name for name in public) else []
        found += [f'shared="{" ".join(shared)}"'] if shared else []
        found += [f"indices={{{rules}}}"] if rules else []
        found += [f'work="{" ".join(map(_declared, work))}"'] if work else []
        found += ["repeats=True"] if procedure.repeats else []
        return found

    def lines(self, body: Sequence[Statement], indent: str) -> Iterator[str]:
        """Yield the lines of statements."""
        for statement in body:
            match statement:
                case Apply(program, inputs, outputs) if moves_numbers(program):
                    values = ", ".join(_moved(program, [self._read(place) for place in inputs]))
                    yield f"{indent}{', '.join(map(self._written, outputs))} = {values}"
                case Apply(program, inputs, outputs):
                    targets = ", ".join(map(self._written, outputs))
                    yield f"{indent}{targets} = {part_name(program)}({', '.join(map(self._read, inputs))})"
                case Add(source, target):
                    yield from self._added(source, target, indent)
                case Copy(source, target):
                    yield f"{indent}{self._written(target)} = {self._read(source)}"
                case Clear(name):
                    yield f"{indent}{self._names[self._over(Place(name)).name]}[:] = 0"
                case Loop(counter, _, reverse, inner, until):
                    self._reversed[counter] = reverse
                    yield f"{indent}for {self._counters[counter]} in {self._rows(statement)}:"
                    yield from self.lines(inner, indent + _INDENT)
                    yield from self._end(until, indent + _INDENT) if until else ()
                case Repeat(limit, until, steps, inner):
                    steps = self._read(Place(steps))
                    yield f"{indent}for {self._repeat} in range({limit}):"
                    yield from self.lines(inner, indent + _INDENT)
                    yield f"{indent}{_INDENT}{steps} = {steps} + 1"
                    yield from self._end(until, indent + _INDENT)

    def _rows(self, loop: Loop) -> str:
        """Return the text of the numbers of the rows of a loop."""
        n = self._lengths[loop.length]
        first, end = (f"{BOUND}({self._read(Place(name))}, {n})" if name else "" for name in (loop.first, loop.end))
        if loop.reverse:
            return f"range({end or n} - 1, {f'{first} - 1' if first else -1}, -1)"
        return f"range({', '.join(filter(None, (first, end or n)))})"

    def _end(self, until: str, indent: str) -> Iterator[str]:
        yield f"{indent}if {self._read(Place(until))} != 0:"
        yield f"{indent}{_INDENT}break"

    def _added(self, source: Place, target: Place, indent: str) -> Iterator[str]:
        """Yield the lines of a sum of rows, with a condition if index tables may contain -1."""
        if goes_through(source.row):
            there = [f"{self._number(each)} >= 0" for each in numbers_of(source.row) if isinstance(each, Through)]
            yield f"{indent}if {' and '.join(there)}:"
            indent += _INDENT
        if target.row is None and not self._tables[target.table].lengths:
            yield f"{indent}{self._written(target)} = {SUM}({self._read(target)}, {self._read(source)})"
        else:
            table = self._over(target)
            yield f"{indent}{ADD_TO}({self._names[table.name]}, {self._key(target)}, {self._read(source)})"

    def _read(self, place: Place) -> str:
        """Return the text of a row that is read."""
        table, name = self._tables[place.table], self._names[place.table]
        match place.row:
            case None if not table.lengths:
                return f"{name}[()]" if table.storage is Storage.RESULT and not table.shape else name
            case _ if (start := start_of(place.row)) and not self._tables[start].lengths:
                return f"{READ_OR}({name}, {self._key(place)}, {self._read(Place(start))})"
            case Counter() | Through() | Shifted() | At():
                return f"{name}[{self._key(place)}]"
            case _:
                raise self._unknown(place)

    def _written(self, place: Place) -> str:
        """Return the text of a row that is written."""
        table, name = self._tables[place.table], self._names[place.table]
        match place.row:
            case None if not table.lengths and table.storage is Storage.WORK:
                return name
            case None if not table.lengths and table.storage is Storage.RESULT:
                return f"{name}[:]" if table.shape else f"{name}[()]"
            case Counter():
                return f"{name}[{self._key(place)}]"
            case At() if not goes_through(place.row):
                return f"{name}[{self._key(place)}]"
            case _:
                raise self._unknown(place)

    def _key(self, place: Place) -> str:
        """Return the text of the number of a row, which may not exist."""
        self._over(place)
        if place.row is None:
            raise self._unknown(place)
        lengths = self._tables[place.table].lengths
        numbers = [self._number(each, n) for each, n in zip(numbers_of(place.row), lengths, strict=True)]
        return numbers[0] if len(numbers) == 1 else f"({', '.join(numbers)})"

    def _number(self, row: Along, length: str = "") -> str:
        """Return the text of the number of a row along one axis of the given length."""
        match row:
            case Shifted(loop, by, boundary, stride, _):
                return f"_{boundary}({at_text(stride, self._counters[loop], by)}, {self._lengths[length]})"
            case Numbered(number, _):
                return self._read(Place(number))
            case Counter(loop):
                return self._counters[loop]
            case Through(index, loop, column) if self._tables[index].shape:
                return f"{self._names[index]}[{self._counters[loop]}, {column}]"
            case Through(index, loop) | Parent(index, loop, _):
                return f"{self._names[index]}[{self._counters[loop]}]"
            case Previous(loop, _):
                return f"{self._counters[loop]} {'+' if self._reversed[loop] else '-'} 1"
            case Following(loop):
                return f"{self._counters[loop]} {'-' if self._reversed[loop] else '+'} 1"

    def _over(self, place: Place) -> Table:
        """Return the table of a place, after checking that its row has as many numbers as the table has lengths."""
        table = self._tables[place.table]
        if not table.lengths or (place.row is not None and len(table.lengths) != len(numbers_of(place.row))):
            raise self._unknown(place)
        return table

    def _unknown(self, place: Place) -> BackendError:
        return BackendError(f"kernel {self._procedure.name}", f"{place}", "a row that can be written in Python")


def _declared(table: Table) -> str:
    return f"{table.name}({','.join([*table.lengths, *map(str, table.shape)])})"
