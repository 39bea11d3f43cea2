"""Print kernels with loops as CUDA and OpenCL: a function of one element, and a loop over a batch for many threads.

The loops are in a function whose arrays have a stride from number to number, so that neighbouring threads can read
neighbouring numbers in memory. Tables of a single row, and rows that a part reads or writes, are copied to local
variables: compilers keep them in registers, and parts take only pointers to memory private to a thread.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from ..ir.procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Repeat, Statement, Storage, Table
from ..ir.rows import Counter, Previous, computed_numbers, further_tables, indices_of, numbers_of
from .c import wrapped
from .c_windows import boundary_functions, needed_by
from .devices import Grid, element
from .loop_statements import is_number, product
from .module import LoopSource
from .printers import Names
from .target_loops import (
    LoopNames,
    RowText,
    RowWords,
    named_in,
    numbers,
    programs,
    short_work,
    work_numbers,
    work_places,
)
from .targets import Language, function

STEP = "_component"
"""Suffix of the name of the stride of an array from number to number."""


@dataclass(frozen=True, slots=True)
class LoopDialect:
    """Notation of the functions of a kernel with loops in CUDA or OpenCL.

    Attributes
    ----------
    language : Language
    grid : Grid
    name : str
        The name of the language.
    function : str
        The specifiers of a function of one element.
    whole : str
        The specifiers of a function that does not depend on the type of a number.
    table : str
        The type of the entries of an index table.
    """

    language: Language
    grid: Grid
    name: str
    function: str
    whole: str
    table: str

    @property
    def array(self) -> str:
        """The type of the numbers of an array."""
        return self.grid.array.format(real=self.grid.real)

    @property
    def words(self) -> RowWords:
        """The notation of loops."""
        index = self.grid.index
        return RowWords(
            language=self.name,
            forward=f"for ({index} {{counter}} = {{first}}; {{counter}} < {{end}}; {{counter}}++)",
            backward=f"for ({index} {{counter}} = {{end}}; {{counter}}-- > {{first}};)",
            bound=f"({{value}} > 0 ? {{value}} < {{length}} ? ({index}){{value}} : {{length}} : 0)",
            repeat="for (int {counter} = 0; {counter} < {limit}; {counter}++)",
            row=f"({index}){{value}}",
            each="for (int {k} = 0; {k} < {size}; {k}++)",
        )


@dataclass(frozen=True, slots=True)
class LoopBatch:
    """The function in which a thread loops over its elements.

    Attributes
    ----------
    parameters : tuple of str
        The parameters of the function; {real} is the type of a number.
    passed : str
        The names of the parameters, as arguments of a call.
    lines : tuple of str
        The statements.
    """

    parameters: tuple[str, ...]
    passed: str
    lines: tuple[str, ...]

    def declared(self, real: str) -> str:
        """Return the parameters for a type of numbers."""
        return ", ".join(self.parameters).format(real=real)


def window_functions(procedures: Iterable[Procedure], dialect: LoopDialect) -> list[str]:
    """Return the functions and macros for rows at a distance, if some of the procedures need them."""
    index = dialect.grid.index
    head = f"{dialect.whole} {index} {{name}}({index} k, {index} n)".strip()
    return needed_by(procedures, f"#ifndef GAC_WINDOWS\n#define GAC_WINDOWS\n{boundary_functions(head)}#endif")


def element_functions(loop: LoopSource, names: LoopNames, strided: str, dialect: LoopDialect) -> list[list[str]]:
    """Print the functions of one element: parts, work space size, the loops named `strided`, and their caller."""
    found = []
    for program in programs(loop):
        printed = element(function(program, dialect.language), dialect.grid.real)
        found.append(_function(f"{dialect.function} {names.parts[program.name]}", [printed.parameters], printed.lines))
    taken = names.inside(dialect.language, strided)
    named = named_in(taken, loop.procedure)
    lengths = [f"{dialect.grid.index} {length}" for length in named.lengths]
    work_lines = [f"return {work_numbers(named)};"]
    head = f"{dialect.whole} {dialect.grid.index} {names.work}".strip()
    found.append(_function(head, lengths, [*_unread(named.lengths, work_lines), *work_lines]))
    text = _DeviceText(named, taken, names.parts, dialect)
    found.append(_function(f"{dialect.function} {strided}", text.parameters(True), text.function()))
    plain = f"{dialect.function} {names.own}"
    found.append(_function(plain, text.parameters(False), [f"{strided}({', '.join(text.contiguous())});"]))
    return found


def loop_batch(loop: LoopSource, names: LoopNames, strided: str, dialect: LoopDialect) -> LoopBatch:
    """Print the loop over a batch that calls the function `strided`."""
    grid, taken = dialect.grid, names.inside(dialect.language, strided)
    named = named_in(taken, loop.procedure)
    count, at, thread, work = map(taken.fresh, ("elements", "element", "thread", "work"))
    parameters = [f"{grid.index} {name}" for name in (count, *named.lengths)]
    passed, inner, unread = [count, *named.lengths], list(named.lengths), []
    for table in (*named.parameters, *named.results):
        if table.storage is Storage.INDEX:
            parameters.append(f"const {dialect.table} *{table.name}")
            passed.append(table.name)
            inner.append(table.name)
            continue
        strides = [taken.fresh(f"{table.name}_element"), taken.fresh(f"{table.name}{STEP}")]
        constant = "" if table.storage is Storage.RESULT else "const "
        parameters.append(f"{constant}{grid.array} *{table.name}")
        parameters += [f"{grid.index} {stride}" for stride in strides]
        passed += [table.name, *strides]
        if is_number(table):
            inner.append(f"{table.name}[{at} * {strides[0]}]")
            unread.append(f"(void){strides[1]};")
        else:
            inner += [f"{table.name} + {at} * {strides[0]}", strides[1]]
    strides = [taken.fresh(f"{work}_thread"), taken.fresh(f"{work}{STEP}")]
    parameters += [f"{grid.array} *{work}", *(f"{grid.index} {stride}" for stride in strides)]
    passed += [work, *strides]
    inner += [f"{work} + {thread} * {strides[0]}", strides[1]]
    lines = [
        *unread,
        f"const {grid.index} {thread} = {grid.first};",
        f"for ({grid.index} {at} = {thread}; {at} < {count}; {at} += {grid.step})",
        f"    {strided}({', '.join(inner)});",
    ]
    return LoopBatch(tuple(parameters), ", ".join(passed), tuple(lines))


def function_lines(head: str, parameters: str, lines: Sequence[str]) -> list[str]:
    """Print a C function."""
    return [*f"{head}({parameters})".split("\n"), "{", *(f"    {line}" for line in lines), "}"]


def _function(head: str, parameters: Sequence[str], lines: Sequence[str]) -> list[str]:
    return function_lines(head, ", ".join(parameters), lines)


def _words(lines: Sequence[str]) -> set[str]:
    return {word for line in lines for word in re.findall(r"\w+", line)}


def _unread(parameters: Sequence[str], lines: Sequence[str]) -> list[str]:
    """Return statements for unused parameters, which prevent compiler warnings."""
    read = _words(lines)
    return [f"(void){name};" for name in parameters if name not in read]


class _DeviceText(RowText):
    """Prints the function with strides, with a local variable for each row that a part reads or writes."""

    def __init__(self, named: Procedure, names: Names, functions: Mapping[str, str], dialect: LoopDialect) -> None:
        super().__init__(named, names, functions)
        self.words, self._dialect = dialect.words, dialect
        outer = [t for t in (*named.parameters, *named.results) if t.storage is not Storage.INDEX and not is_number(t)]
        self._work = names.fresh("work")
        self._steps = {table.name: names.fresh(f"{table.name}{STEP}") for table in outer}
        self._work_step = names.fresh(f"{self._work}{STEP}")
        self._locals = {table.name: names.fresh(f"{table.name}_row") for table in outer if not table.lengths}
        self._rows: dict[Place, str] = {}
        self._held: set[Place] = set()

    def parameters(self, with_strides: bool) -> list[str]:
        """Return the parameters of the function with strides, or of the function for contiguous arrays."""
        grid, named, array = self._dialect.grid, self._procedure, self._dialect.array
        found = [f"{grid.index} {length}" for length in named.lengths]
        for table in (*named.parameters, *named.results):
            if table.storage is Storage.INDEX:
                found.append(f"const {self._dialect.table} *{table.name}")
            elif is_number(table):
                found.append(f"{grid.real} {table.name}")
            else:
                found.append(f"{'' if table.storage is Storage.RESULT else 'const '}{array} *{table.name}")
                found += [f"{grid.index} {self._steps[table.name]}"] * with_strides
        return [*found, f"{array} *{self._work}", *[f"{grid.index} {self._work_step}"] * with_strides]

    def contiguous(self) -> list[str]:
        """Return the arguments for contiguous arrays."""
        found = [*self._procedure.lengths]
        for table in (*self._procedure.parameters, *self._procedure.results):
            found += [table.name, *["1"] * (table.name in self._steps)]
        return [*found, self._work, "1"]

    def function(self) -> list[str]:
        """Print the body of the function with strides."""
        named, real = self._procedure, self._dialect.grid.real
        body = self.lines(named.body)
        read = _words(body)
        first = [t for t in named.of(Storage.ARGUMENT) if t.name in self._locals and self._locals[t.name] in read]
        last = [table for table in named.results if table.name in self._locals]
        declared = [
            *(self._declared(self._locals[table.name], table) for table in (*first, *last)),
            *(self._declared(table.name, table) for table in short_work(named)),
            *(self._declared(row, named.table(place.table)) for place, row in self._rows.items()),
        ]
        pointers = [
            f"{self._dialect.array} *const {self._begins(table, place)};" for table, place in work_places(named)
        ]
        lines = wrapped(pointers)
        lines += [f"{real} {', '.join(declared)};"] if declared else []
        for table in first:
            lines += self._each(table, lambda k, t=table: f"{self._only(t, k)} = {self._outside(t, k)};")  # type: ignore[misc]
        lines += body
        for table in last:
            lines += self._each(table, lambda k, t=table: f"{self._outside(t, k)} = {self._only(t, k)};")  # type: ignore[misc]
        numbers = [table.name for table in named.parameters if table.storage is Storage.INDEX or is_number(table)]
        arrays = [name for each in self._steps.items() for name in each]
        return [*_unread([*named.lengths, *numbers, *arrays, self._work, self._work_step], lines), *lines]

    def _declared(self, name: str, table: Table) -> str:
        return f"{name}[{table.size}]" if table.shape else name

    def _begins(self, table: Table, place: str) -> str:
        if place == "0":
            return f"{table.name} = {self._work}"
        return f"{table.name} = {self._work} + {f'({place})' if '+' in place else place} * {self._work_step}"

    def _outside(self, table: Table, k: str) -> str:
        """Return the text of a number of a table of a single row in the caller's memory."""
        return f"{table.name}[{'0' if k == '0' else product(k, self._steps[table.name])}]"

    # Statements.

    def _statement(self, statement: Statement) -> list[str]:
        if isinstance(statement, (Loop, Repeat)):
            self._held.clear()
        lines = super()._statement(statement)
        match statement:
            case Loop() | Repeat():
                self._held.clear()
            case Apply(_, _, outputs):
                for place in outputs:
                    self._change(place.table)
                self._held.update(outputs)
            case Add(_, target) | Copy(_, target):
                self._change(target.table)
            case Clear(name):
                self._change(name)
        return lines

    def _change(self, name: str) -> None:
        """Discard the local copies of rows of a table."""
        self._held -= {place for place in self._held if name in (place.table, *further_tables(place.row))}

    def _called(self, statement: Apply) -> list[str]:
        before, passed, after = list[str](), list[str](), list[str]()
        for argument, place in zip(statement.program.arguments, statement.inputs, strict=True):
            if not argument.shape:
                passed.append(self._value(place))
                continue
            row = self._row(place)
            if place.row is not None and place not in self._held:
                before += self._each(
                    self._procedure.table(place.table),
                    lambda k, r=row, p=place: f"{r}[{k}] = {self._entry(p, k)};",  # type: ignore[misc]
                )
            self._held.add(place)
            passed.append(row)
        for place in statement.outputs:
            table, row = self._procedure.table(place.table), self._row(place)
            passed.append(row if table.shape else f"&{row}")
            if place.row is not None:
                after += self._each(
                    table,
                    lambda k, r=row, t=table, p=place: f"{self._entry(p, k)} = {r}{f'[{k}]' if t.shape else ''};",  # type: ignore[misc]
                )
        return [*before, f"{self._functions[statement.program.name]}({', '.join(passed)});", *after]

    def _row(self, place: Place) -> str:
        """Return the local variable of a row."""
        if place.row is None:
            return self._locals.get(place.table, place.table)
        if place not in self._rows:
            self._rows[place] = self._names.fresh(f"{place.table}_{_suffix(place)}")
        return self._rows[place]

    def _cleared(self, table: Table) -> list[str]:
        if not table.lengths:
            return self._each(table, lambda k: f"{self._only(table, k)} = 0;")
        head = self.words.forward.format(counter=self._k, first="0", end=numbers(table))
        return self._block(head, [f"{table.name}[{self._k} * {self._step_of(table)}] = 0;"])

    # Rows.

    def _step_of(self, table: Table) -> str:
        return self._work_step if table.storage is Storage.WORK else self._steps[table.name]

    def _cell(self, table: Table, row: str, k: str) -> str:
        return f"{table.name}[{product(self._place(table, row, k), self._step_of(table))}]"

    def _only(self, table: Table, k: str) -> str:
        name = self._locals.get(table.name, table.name)
        return f"{name}[{k}]" if table.shape else name


def _suffix(place: Place) -> str:
    if isinstance(place.row, Previous):
        return "previous"
    names = [each.loop if isinstance(each, Counter) else "" for each in numbers_of(place.row)]
    return "_".join(filter(None, (*names, *indices_of(place.row), *computed_numbers(place.row))))
