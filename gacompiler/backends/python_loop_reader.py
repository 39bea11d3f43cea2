"""Read kernels with loops back from the Python text, as procedures with the statements of the functions.

Like `readers`, this accepts exactly the text that is printed. A statement that was changed to another valid one gives a
different procedure; any other change raises an error that names the line.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import prod
from typing import NamedTuple

from ..errors import BackendError
from ..ir.procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Repeat, Statement, Storage, Table
from ..ir.procedure_cost import procedure_costs
from ..ir.program import Argument, Operand, Program, Result
from ..ir.rows import Through, goes_through, numbers_of
from ..ir.verify import verify
from .loop_statements import Bound
from .nesting import Shape
from .python_loop_rows import RowReader
from .python_loops import ADD_TO, BOUND, NUMBER, SUM, costs_text, loop_text, moves_numbers
from .readers import PythonFunction, python_function, python_program, python_statements, read_number
from .shared_parts import with_applies


def python_procedures(text: str) -> dict[str, Procedure]:
    """Read the kernels with loops of a ``.py`` module.

    Raises
    ------
    BackendError
        If the text differs from what the printers write; the error names the first line that differs.
    """
    lines, nodes = python_statements(text)
    parts: dict[str, _Part] = {}
    found: dict[str, Procedure] = {}
    for node in nodes:
        if not isinstance(node, ast.FunctionDef):
            continue
        match node.decorator_list:
            case [] if node.returns:
                if node.name in parts:
                    raise BackendError(f"Python text of {node.name}", "two functions with the same name", "one")
                parts[node.name] = _part(lines, node)
            case [ast.Call(ast.Attribute(ast.Name("_module"), "loops")) as declared]:
                where = f"Python text of {node.name}"
                function = python_function(lines, node)
                read = _Reader(where, function, declared, parts)
                found[node.name] = procedure = read.procedure(node.name)
                _check(where, procedure, declared, function, parts)
    called = [program for procedure in found.values() for program in procedure.programs]
    used = {f"_{program.name}" for program in called if not moves_numbers(program)}
    if used != parts.keys():
        raise BackendError("Python text", f"a part {min(parts.keys() - used)} that is never called", "a call of it")
    return found


def outline(procedure: Procedure) -> Procedure:
    """Return a procedure with empty programs, to compare only the tables and statements of procedures."""

    empty = Program("", (), (), ())
    return replace(procedure, body=with_applies(procedure.body, lambda apply: replace(apply, program=empty)))


class _Part(NamedTuple):
    """A straight-line part: its program and its text."""

    program: Program
    lines: list[str]


def _part(lines: list[str], node: ast.FunctionDef) -> _Part:
    where = f"Python text of {node.name}"
    results = node.returns.elts if isinstance(node.returns, ast.Tuple) else [node.returns]
    shapes, out_shapes = (
        [_row_shape(where, row) for row in rows] for rows in ([each.annotation for each in node.args.args], results)
    )
    try:
        program = python_program(python_function(lines, node), shapes, out_shapes)
    except ValueError as error:  # an argument that is not unpacked
        raise BackendError(where, f"{error}", f"a function of {shapes}") from error
    return _Part(program, lines[node.lineno - 1 : node.end_lineno])


def _row_shape(where: str, row: ast.expr | None) -> Shape:
    """Read the shape of a row, such as ``R8``."""
    match row:
        case ast.Name(text) if re.fullmatch(r"R(\d+(x\d+)*)?", text):
            return tuple(int(size) for size in text[1:].split("x") if size)
    raise BackendError(where, "a row without a shape", "shapes, as in R8 or R3x3")


def _check(
    where: str, procedure: Procedure, declared: ast.Call, function: PythonFunction, parts: Mapping[str, _Part]
) -> None:
    """Raise `BackendError` if the text differs from the one printed for the procedure that was read."""
    text = loop_text(procedure)
    for name, lines in text.parts.items():
        _compare(f"Python text of _{name}", lines, parts[f"_{name}"].lines)
    _compare(where, [text.head, *text.body], function.lines)
    expected = ast.parse(f"f({', '.join(text.options)})").body[0]
    assert isinstance(expected, ast.Expr) and isinstance(expected.value, ast.Call)
    options = [ast.unparse(option) for option in expected.value.keywords]
    cost = f"cost={costs_text(procedure_costs(procedure))!r}"
    given = [ast.unparse(option) for option in declared.keywords if option.arg not in ("assumes", "error")]
    _compare(where, [repr(procedure.signature), cost, *options], [ast.unparse(declared.args[0]), *given])
    n_parts = len(procedure.parameters) + len(procedure.results)
    if len(declared.args) != n_parts + 1:
        raise BackendError(where, f"{len(declared.args) - 1} layouts", f"{n_parts}, one for each argument and result")


def _compare(where: str, expected: list[str], found: list[str]) -> None:
    for a, b in zip(expected, found, strict=False):
        if a != b:
            raise BackendError(where, repr(b), repr(a), "generate it again")
    if len(expected) != len(found):
        raise BackendError(where, f"{len(found)} lines", f"{len(expected)}", "generate it again")


class _Reader(RowReader):
    """Reads the function of a kernel with loops, with the tables and parts that its text refers to."""

    def __init__(self, where: str, function: PythonFunction, declared: ast.Call, parts: Mapping[str, _Part]) -> None:
        super().__init__(where)
        self._function, self._parts = function, parts
        try:
            signature = ast.literal_eval(declared.args[0])
            options = {
                option.arg: ast.literal_eval(option.value)
                for option in declared.keywords
                if option.arg in ("names", "shared", "indices", "work")
            }
            self._tables = self._declared(signature, options)
        except (ValueError, TypeError, AttributeError, IndexError, KeyError) as error:
            raise BackendError(where, f"a declaration that cannot be read ({error})", "@_module.loops(...)") from error
        self._may_miss = False
        self._n_moved = 0

    def _declared(self, signature: str, options: Mapping[str, Mapping[str, str]]) -> dict[str, Table]:
        """Return the tables by their names in the text; the lengths are determined at the same time."""
        sides = [[_sizes(part) for part in side[1:-1].split("),(")] for side in signature.split("->")]
        inputs, outputs = sides
        lengths = list(dict.fromkeys(name for named, _ in inputs for name in named))
        texts, parameters = str(options.get("names", "")), self._function.parameters
        own = parameters[: len(lengths)]
        shown = parameters[len(lengths) : len(lengths) + len(inputs) + len(outputs)]
        names = texts.split() or list(shown)
        work = re.findall(r"(\w+)\(([\w,]*)\)", str(options.get("work", "")))
        indices, shared = dict(options.get("indices", {})), str(options.get("shared", "")).split()
        found: dict[str, Table] = {}
        for k, (name, (named, shape)) in enumerate(zip(names, (*inputs, *outputs), strict=True)):
            into = indices.pop(name).rpartition(" of ")[2] if name in indices else ""
            storage = Storage.INDEX if into else Storage.ARGUMENT if k < len(inputs) else Storage.RESULT
            found[shown[k]] = Table(name, named, shape, storage, bool(into) or name in shared, into)
        for name, sizes in work:
            if name in found:
                raise ValueError(f"two tables {name}")
            found[name] = Table(name, *_sizes(sizes), Storage.WORK)
        if indices or list(parameters) != [
            *own,
            *shown,
            *(name for name, table in found.items() if table.storage is Storage.WORK and table.lengths),
        ]:
            raise ValueError("its tables are not those of the function")
        self._lengths = dict(zip(own, lengths, strict=True))
        return found

    def procedure(self, name: str) -> Procedure:
        """Read the whole procedure."""
        body = self._statements(self._function.statements)
        return Procedure(name, tuple(self._tables.values()), body)

    def _statements(self, nodes: Sequence[ast.stmt]) -> tuple[Statement, ...]:
        return tuple(map(self._statement, nodes))

    def _statement(self, node: ast.stmt) -> Statement:
        match node:
            case ast.Assign([target], ast.Call(ast.Name(part), arguments, [])) if part in self._parts:
                return self._apply(node, part, target, arguments)
            case ast.Assign([target], ast.Call(ast.Name(name), [before, row], [])) if name == SUM:
                place = self._written(target)
                if self._read(before) != place or place.row is not None:
                    raise self._unreadable(node)
                return Add(self._added(row), place)
            case ast.Assign([ast.Subscript(ast.Name(name), ast.Slice(None, None, None))], ast.Constant(0)):
                return Clear(self._table(node, name).name)
            case ast.Assign([target], value) if _is_moved(value):
                return self._moved(node, target, value)
            case ast.Assign([target], value):
                return Copy(self._read(value), self._written(target))
            case ast.Expr(ast.Call(ast.Name(name), [ast.Name(table), key, row], [])) if name == ADD_TO:
                return Add(self._added(row), Place(self._table(node, table).name, self._onto(key)))
            case ast.If(test, [inner], []):
                return self._guarded(node, test, inner)
            case ast.For(ast.Name(counter), ast.Call(ast.Name("range"), bounds, []), body, []):
                return self._loop(node, counter, bounds, body)
            case _:
                raise self._unreadable(node)

    def _guarded(self, node: ast.AST, test: ast.expr, inner: ast.stmt) -> Add:
        """Read a conditional sum of a row given by index tables, which may contain -1."""
        self._may_miss = True
        found = self._statement(inner)
        self._may_miss = False
        if not isinstance(found, Add) or not goes_through(found.source.row):
            raise self._unreadable(node)
        terms = test.values if isinstance(test, ast.BoolOp) and isinstance(test.op, ast.And) else [test]
        keys = []
        for term in terms:
            match term:
                case ast.Compare(key, [ast.GtE()], [ast.Constant(0)]):
                    keys.append(key)
                case _:
                    raise self._unreadable(node)
        if [self._along_axis(key) for key in keys] != [
            each for each in numbers_of(found.source.row) if isinstance(each, Through)
        ]:
            raise self._unreadable(node)
        return found

    def _added(self, row: ast.expr) -> Place:
        """Read the row that a sum adds; a condition is required if and only if index tables determine the row."""
        found = self._read(row)
        if goes_through(found.row) != self._may_miss:
            raise self._unreadable(row)
        return found

    def _apply(self, node: ast.AST, part: str, target: ast.expr, arguments: Sequence[ast.expr]) -> Apply:
        program = self._parts[part].program
        inputs = tuple(map(self._read, arguments))
        several = isinstance(target, ast.Tuple)
        outputs = tuple(map(self._written, target.elts if isinstance(target, ast.Tuple) else [target]))
        shapes = [argument.shape for argument in program.arguments], [result.shape for result in program.results]
        if shapes != ([self._shape(place) for place in inputs], [self._shape(place) for place in outputs]) or (
            several != (len(outputs) > 1)
        ):
            raise self._unreadable(node)
        return Apply(program, inputs, outputs)

    def _moved(self, node: ast.AST, target: ast.expr, value: ast.expr) -> Apply:
        """Read results that are constants or numbers of other tables."""
        outputs = tuple(map(self._written, target.elts if isinstance(target, ast.Tuple) else [target]))
        values = value.elts if len(outputs) > 1 and isinstance(value, ast.Tuple) else [value]
        if len(values) != len(outputs):
            raise self._unreadable(node)
        inputs: list[Place] = []
        results: list[tuple[Shape, tuple[Operand, ...]]] = []
        for place, row in zip(outputs, values, strict=True):
            operands: list[Operand] = []
            for entry in _entries(row):
                if isinstance(entry, ast.Call):
                    inputs.append(self._read(entry.args[0]))
                    operands.append(f"x{len(inputs) - 1}")
                else:
                    operands.append(read_number(self._where, entry))
            results.append((self._shape(place), tuple(operands)))
        if any(map(self._shape, inputs)) or any(prod(shape) != len(row) for shape, row in results):
            raise self._unreadable(node)
        self._n_moved += 1
        name = f"{self._function.name}_moved_{self._n_moved}"
        arguments = tuple(Argument(f"x{k}", (), (f"x{k}",)) for k in range(len(inputs)))
        outs = tuple(Result(f"out{k}", *result) for k, result in enumerate(results))
        return Apply(verify(Program(name, arguments, (), outs)), tuple(inputs), outputs)

    def _shape(self, place: Place) -> Shape:
        return next(table.shape for table in self._tables.values() if table.name == place.table)

    def _loop(self, node: ast.AST, counter: str, bounds: Sequence[ast.expr], body: Sequence[ast.stmt]) -> Statement:
        if counter in self._loops or counter in self._tables:
            raise self._unreadable(node)
        reverse, lower = False, Bound("")
        match bounds:
            case [ast.Constant(int(limit))]:
                return self._repeat(node, limit, body)
            case [end]:
                upper = self._bound(node, end)
            case [first, end]:
                lower, upper = self._bound(node, first), self._bound(node, end)
            case [ast.BinOp(end, ast.Sub(), ast.Constant(1)), last, step] if ast.unparse(step) == "-1":
                reverse, upper = True, self._bound(node, end)
                match last:
                    case ast.BinOp(first, ast.Sub(), ast.Constant(1)):
                        lower = self._bound(node, first)
                    case _ if ast.unparse(last) != "-1":
                        raise self._unreadable(node)
            case _:
                raise self._unreadable(node)
        n = upper.length
        if lower.length not in ("", n):
            raise self._unreadable(node)
        self._loops[counter], self._over[counter] = reverse, self._lengths[n]
        until = ""
        match body:
            case [*before, ast.If(ast.Compare(end, [ast.NotEq()], [ast.Constant(0)]), [ast.Break()], [])]:
                body, until = before, self._read(end).table
        inner = self._statements(body)
        del self._loops[counter]
        return Loop(counter, self._lengths[n], reverse, inner, until, lower.table, upper.table)

    def _bound(self, node: ast.AST, bound: ast.expr) -> Bound:
        """Read a bound of a loop: a length, or the number in a table, limited to the rows of a length."""
        match bound:
            case ast.Name(n) if n in self._lengths:
                return Bound(n)
            case ast.Call(ast.Name(function), [value, ast.Name(n)], []) if function == BOUND and n in self._lengths:
                return Bound(n, self._read(value).table)
        raise self._unreadable(node)

    def _repeat(self, node: ast.AST, limit: int, body: Sequence[ast.stmt]) -> Repeat:
        match body:
            case [
                *inner,
                ast.Assign([steps], ast.BinOp(before, ast.Add(), ast.Constant(1))),
                ast.If(ast.Compare(until, [ast.NotEq()], [ast.Constant(0)]), [ast.Break()], []),
            ] if self._written(steps) == self._read(before):
                names = (self._read(until).table, self._read(before).table)
                return Repeat(limit, *names, self._statements(inner))
            case _:
                raise self._unreadable(node)


def _entries(row: ast.expr) -> list[ast.expr]:
    """Return the entries of a row: of a tuple, of the same number several times, or the number itself."""
    match row:
        case ast.BinOp(ast.Tuple([number]), ast.Mult(), ast.Constant(int(count))):
            return [number] * count
        case ast.Tuple(entries):
            return entries
    return [row]


def _is_moved(value: ast.expr) -> bool:
    """Whether a value is a constant, a number of another table, or a tuple of these."""
    match value:
        case ast.Tuple(entries):
            return all(map(_is_moved, entries))
        case ast.Call(ast.Name(name), [_], []):
            return name == NUMBER
    return isinstance(value, (ast.Constant, ast.UnaryOp, ast.BinOp))


def _sizes(text: str) -> tuple[tuple[str, ...], Shape]:
    """Parse the lengths and the shape of a row, such as ``n,6``."""
    sizes = [size for size in text.split(",") if size]
    named = tuple(size for size in sizes if not size.isdigit())
    return named, tuple(map(int, sizes[len(named) :]))
