"""Read kernels with loops back from C: tables from their lists, statements from the functions.

The plain function and the function for NLANES elements are both read, by interpreting their pointers, and must describe
the same procedure. Everything else (spaces between tables, macros, loops over lanes) is compared with the text that the
printer writes for the procedure that was read (`gacompiler.backends.readers`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..errors import BackendError
from ..ir.procedure import (
    Add,
    Apply,
    Clear,
    Copy,
    Loop,
    Procedure,
    Repeat,
    Statement,
    Storage,
    Table,
)
from ..ir.program import Program
from .c_loop_rows import RowReader
from .c_loop_tokens import Entry, Tree, factors_of, listed, tokens_of
from .c_rounds import KEPT
from .loop_statements import Bound
from .nesting import Shape

START = "#define TABLES_"
"""The beginning of the first line of a kernel with loops."""

ReadPart = Callable[[str, Sequence[Shape], Sequence[Shape]], Program]
"""A function that returns the program of a part, given its name and the shapes of its arguments and results."""


def read_procedures(lines: Sequence[str], read_part: ReadPart, n_inputs: Callable[[str], int]) -> list[Procedure]:
    """Read the kernels with loops of a C file.

    Parameters
    ----------
    lines : sequence of str
        The lines of the file below its other kernels.
    read_part : callable
    n_inputs : callable
        Returns the number of arguments of the part with a given name.

    Raises
    ------
    BackendError
        If the text differs from what the printer writes.
    """
    starts = [k for k, line in enumerate(lines) if line.startswith(START)]
    ends = [*starts[1:], len(lines)]
    return [_procedure(lines[k:end], read_part, n_inputs) for k, end in zip(starts, ends, strict=False)]


def _in_lanes(table: Table) -> Table:
    """Return a table as in the text for lanes, in which the shape of a row is its size in numbers."""
    return replace(table, shape=(table.size,))


def _procedure(lines: Sequence[str], read_part: ReadPart, n_inputs: Callable[[str], int]) -> Procedure:
    name = lines[0].removeprefix(START).partition("(")[0]
    outer, work = (listed(lines, f"#define {kind}_{name}(") for kind in ("TABLES", "WORK"))
    is_busy = any(line.startswith(f"static INLINE void NAME({name}_within)(") for line in lines)
    head = f"static INLINE void NAME({name}_within)(" if is_busy else f"void NAME({name})("
    plain = _Reader(name, outer, work, read_part, n_inputs, in_lanes=False)
    procedure = plain.procedure(_function(name, lines, head))
    lanes = [line for line in lines if line.startswith(f"static INLINE WORD NAME({name}_lanes)(")]
    if lanes:
        reader = _Reader(name, outer, work, lambda part, *_: _program(procedure, part), n_inputs, in_lanes=True)
        same = reader.procedure(_function(name, lines, lanes[0]))
        if same.body != procedure.body or set(map(_in_lanes, same.tables)) != set(map(_in_lanes, procedure.tables)):
            raise BackendError(f"C text of {name}", f"{name} and {name}_lanes are different", "the same loops")
    return procedure


def _program(procedure: Procedure, name: str) -> Program:
    found = next((program for program in procedure.programs if program.name == name), None)
    if found is None:
        raise BackendError(f"C text of {procedure.name}", f"{name} in lanes only", "the same parts in both functions")
    return found


def _function(name: str, lines: Sequence[str], head: str) -> list[str]:
    """Return the tokens of the body of a function."""
    first = next((k for k, line in enumerate(lines) if line.startswith(head)), None)
    if first is None or "{" not in lines[first:] or "}" not in lines[first:]:
        raise BackendError(f"C text of {name}", f"no function {head!r}", "a file written by gacompiler")
    return tokens_of(name, "\n".join(lines[lines.index("{", first) + 1 : lines.index("}", first)]))


_STORAGES = {"IN": Storage.ARGUMENT, "SAME": Storage.ARGUMENT, "OUT": Storage.RESULT, "WORK": Storage.WORK}


class _Reader(RowReader):
    """Reads one function, in which all names must be tables, lengths and counters."""

    def __init__(
        self,
        name: str,
        outer: list[Entry],
        work: list[Entry],
        read_part: ReadPart,
        n_inputs: Callable[[str], int],
        *,
        in_lanes: bool,
    ) -> None:
        super().__init__(name, in_lanes)
        self._read_part, self._n_inputs = read_part, n_inputs
        self._lengths = [entry.fields[0] for entry in outer if entry.kind == "LENGTH"]
        self._outer = [self._table(entry) for entry in outer if entry.kind != "LENGTH"]
        own = [table for table in map(self._table, work) if not table.name.startswith(KEPT)]
        self._long = {table.name: table for table in own}
        self._tables = {table.name: table for table in (*self._outer, *self._long.values())}

    def procedure(self, tokens: list[str]) -> Procedure:
        """Read the procedure from the body of the function."""
        self._tokens = tokens
        local = self._definitions()
        body = self._statements(len(tokens))
        listed = {table.name for table in local}
        tables = (*self._outer, *local, *(t for t in self._long.values() if t.name not in listed))
        return Procedure(self._name, tables, tuple(body))

    # Tables.

    def _table(self, entry: Entry) -> Table:
        kind, fields = entry
        try:
            match kind, fields:
                case "NUMBER", (name,):
                    return Table(name, (), (), Storage.ARGUMENT)
                case "INDEX", (name, rows, into):
                    columns, _, length = rows.rpartition(" * ")
                    shape = (int(columns),) if columns else ()
                    return Table(name, self._axes(length), shape, Storage.INDEX, True, self._length(into))
                case (("IN" | "SAME" | "OUT" | "WORK"), (name, shape, _, rows)):
                    sizes = () if shape == "scalar" else tuple(map(int, shape.split("x")))
                    return Table(name, self._axes(rows), sizes, _STORAGES[kind], kind == "SAME")
        except ValueError:
            pass
        raise self._wrong(f"{kind}({', '.join(fields)})")

    def _axes(self, rows: str) -> tuple[str, ...]:
        return () if rows == "1" else tuple(map(self._length, rows.split(" * ")))

    def _length(self, name: str) -> str:
        if name not in self._lengths:
            raise self._wrong(f"the length {name!r}")
        return name

    def _definitions(self) -> list[Table]:
        """Read the definitions at the beginning, the work tables in their order."""
        found: list[Table] = []
        while self._next() in ("REAL", "WORD", "_Alignas", "("):
            end = self._end()
            if self._next() == "_Alignas":
                self._at += 4
            if self._take() == "REAL":
                while self._at < end:
                    found.append(self._defined())
                    self._at += 1
            self._at = end + 1
        found = [table for table in found if not table.name.startswith(KEPT)]
        for table in found:
            self._tables[table.name] = table
        return found

    def _defined(self) -> Table:
        """Read the definition of a table that is a local variable or a part of the work space."""
        if self._next() == "*":
            self._expect("*", "const")
            name = self._take()
            self._expect("=")
            self._expression()
            if name not in self._long:
                raise self._wrong(f"the table {name!r}")
            return self._long[name]
        name = self._take()
        shape: Shape = ()
        if self._next() == "[":
            self._expect("[")
            factors = factors_of(self._expression())
            self._expect("]")
            if self._in_lanes:
                factors = [factor for factor in factors if factor != "NLANES"]
            if not all(isinstance(factor, int) for factor in factors):
                raise self._wrong(f"the size of {name}")
            shape = tuple(factor for factor in factors if isinstance(factor, int))
        return Table(name, (), shape, Storage.WORK)

    # Statements.

    def _statements(self, end: int) -> list[Statement]:
        found = []
        while self._at < end and self._next() != "return":
            found.append(self._statement())
        return found

    def _statement(self) -> Statement:
        match self._next():
            case "for":
                return self._loop()
            case "GAC_WINDOWS":
                return self._windows(2)
            case "GAC_VECTORS":
                return self._windows(1)
            case "ROUNDS":
                return self._rounds()
            case "if":
                self._expect("if", "(")
                condition = self._expression()
                self._expect(")")
                return self._move(condition)
            case "far" | "NAME":
                return self._apply()
            case "CLEAR":
                self._expect("CLEAR", "(")
                self._expression()
                self._expect(",")
                place = self._place(self._expression())
                self._expect(")", ";")
                return Clear(place.table)
        return self._move(None)

    def _block(self) -> list[Statement]:
        """Read the body of a loop, one statement or several in braces, up to the statements that end an iteration."""
        if self._next() != "{":
            return [self._statement()]
        self._expect("{")
        found: list[Statement] = []
        while self._next() != "}" and self._tokens[self._at + 1] not in ("+=", "[") and not self._at_end():
            found.append(self._statement())
        return found

    def _at_end(self) -> bool:
        """Return whether the next statement ends the loop if a number is not zero."""
        return self._next() == "if" and "break" in self._tokens[self._at : self._end()]

    def _until(self) -> str:
        """Read the statement that ends a loop, and return the table that it reads."""
        self._expect("if", "(")
        match self._expression():
            case ("!=", until, 0):
                self._expect(")", "break", ";")
                return self._place(until).table
        raise self._wrong("the end of an iteration")

    def _loop(self) -> Statement:
        self._expect("for", "(")
        if self._take() == "int":
            return self._repeat()
        counter = self._take()
        self._expect("=")
        first = self._expression()
        self._expect(";", counter)
        reverse = self._next() == "--"
        self._expect(*("-- >" if reverse else "<").split())
        end = self._expression()
        self._expect(*([";"] if reverse else [";", counter, "++"]), ")")
        first, end = (end, first) if reverse else (first, end)
        lower, upper = self._bound(first), self._bound(end)
        length = upper.length or lower.length
        if not length or (first != 0 and not lower.table) or lower.length not in ("", length):
            raise self._wrong("a loop over no length")
        self._loops[counter] = self._length(length), reverse
        braces = self._next() == "{"
        body = self._block()
        until = self._until() if braces and self._next() == "if" else ""
        if braces:
            self._expect("}")
        return Loop(counter, length, reverse, tuple(body), until, lower.table, upper.table)

    def _bound(self, tree: Tree) -> Bound:
        """Read a bound of a loop: a length, or the number in a table, limited to the rows of a length."""
        match tree:
            case ("?", (">", value, 0), ("?", ("<", same, str(length)), ("row", also), other), 0) if (
                value == same == also and length == other
            ):
                return Bound(length, self._place(value).table)
        return Bound(tree if isinstance(tree, str) else "")

    def _windows(self, n_limits: int) -> Loop:
        """Read a loop of which some iterations run in vectors, after a number of expressions that say which ones."""
        self._take()
        self._expect("(")
        counter = self._take()
        self._expect(",")
        length = self._take()
        for _ in range(n_limits):
            self._expect(",")
            self._expression()
        self._expect(",")
        self._loops[counter] = self._length(length), False
        braces = self._next() == "{"
        body = self._block()
        self._expect(*["}"] * braces, ")")
        return Loop(counter, length, False, tuple(body))

    def _repeat(self) -> Repeat:
        counter = self._take()
        self._expect("=", "0", ";", counter, "<")
        limit = self._expression()
        self._expect(";", counter, "++", ")")
        body = self._block()
        steps = self._place(self._expression())
        self._expect("+=", "1", ";")
        until = self._until()
        self._expect("}")
        if not isinstance(limit, int):
            raise self._wrong("the limit of an iteration")
        return Repeat(limit, until, steps.table, tuple(body))

    def _rounds(self) -> Repeat:
        """Read the steps that are repeated by NLANES elements, without the copies for those that have ended."""
        self._expect("ROUNDS", "(")
        self._take()
        self._expect(",")
        limit = self._expression()
        self._expect(")", "{")
        body: list[Statement] = []
        while self._next() != "COUNT":
            if self._next() in ("KEEP", "RESTORE"):
                self._at = self._end() + 1
            else:
                body.append(self._statement())
        self._expect("COUNT", "(")
        self._take()
        self._expect(",")
        steps = self._place(self._expression())
        self._expect(")", ";", "if", "(", "ALL_ENDED", "(")
        self._take()
        self._expect(",")
        until = self._place(self._expression())
        self._expect(")", ")", "break", ";", "}")
        if not isinstance(limit, int):
            raise self._wrong("the limit of an iteration")
        return Repeat(limit, until.table, steps.table, tuple(body))

    def _apply(self) -> Apply:
        if self._next() == "far":
            self._expect("far", "|=")
        self._expect("NAME", "(")
        name = self._take()
        self._expect(")", "(")
        if self._in_lanes:
            name = name.removesuffix("_lanes")
        passed = []
        while self._next() != ")":
            passed.append(self._expression())
            if self._next() == ",":
                self._expect(",")
        self._expect(")", ";")
        places = [self._place(each) for each in passed if each != "NULL"]
        n_inputs = self._n_inputs(name)
        inputs, outputs = tuple(places[:n_inputs]), tuple(places[n_inputs:])
        shapes = [[self._tables[place.table].shape for place in each] for each in (inputs, outputs)]
        return Apply(self._read_part(name, *shapes), inputs, outputs)

    def _move(self, condition: Tree | None) -> Add | Copy:
        """Read a statement that copies or adds a row to another one, which may not exist."""
        kind = self._take()
        self._expect("(")
        self._expression()
        self._expect(",")
        source = self._place(self._expression(), condition)
        self._expect(",")
        target = self._place(self._expression(), condition)
        self._expect(")", ";")
        if kind in ("ADD", "ADD_SPREAD"):
            return Add(source, target)
        if kind in ("COPY", "SPREAD"):
            return Copy(source, target)
        raise self._wrong(kind)
