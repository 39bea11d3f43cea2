"""Read emitted text back as programs, so that proofs apply to the files on disk and not to the intended output.

The readers accept exactly the text that the printers write. A statement that was changed to another valid one gives a
different program, which the proof detects. Any other change (to a loop, a load, a macro or a parameter) makes the text
differ from the one printed for that program, and raises an error that names the line.

The readers of C and Python are in one file because they share statements and expressions.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from math import prod
from typing import Any, NamedTuple, TypeVar

from ..errors import BackendError, GacError
from ..gac_runtime.definition import shapes_in
from ..ir.cost import cost
from ..ir.interpret import interpret
from ..ir.procedure import Procedure
from ..ir.program import Program
from ..ir.scalar import ARITY, Op
from ..ir.uniform import Uniform, split
from .c import c_body
from .c_batch import form_name
from .c_loop_reader import START as LOOPS_START
from .c_loop_reader import read_procedures
from .nesting import Nested, Node, Shape, Tree, flattened
from .printers import MACROS, PYTHON, C
from .python import cost_text, form_text
from .python_text import form_functions, function_text

OF_LOOPS = "_module.loops"
"""The decorator of kernels with loops, which `python_loop_reader` reads."""

Function = Callable[..., tuple[tuple[Any, ...], ...]]

_INFIX = {ast.Add: Op.ADD, ast.Sub: Op.SUBTRACT, ast.Mult: Op.MULTIPLY, ast.Div: Op.DIVIDE}
_CALLS = {notation.call(op.value): op for notation in (PYTHON, C) for op in MACROS}


class Read(NamedTuple):
    """A kernel read from text: its program and its uniform variants."""

    program: Program
    forms: tuple[Uniform, ...]


def c_functions(text: str, constant: Callable[[Fraction], Any] = lambda value: value) -> dict[str, Function]:
    """Read the kernels of a ``.c`` file as functions over any ring.

    Parameters
    ----------
    text : str
        The contents of the file.
    constant : callable
        Converts an exact number to an element of the ring, as for `gacompiler.ir.interpret.interpret`.

    Returns
    -------
    dict of str to callable
        Functions that take a flat sequence of components for each argument and return a tuple of flat results.

    Raises
    ------
    BackendError
        If the text differs from what the printers write; the error names the first line that differs.
    """
    return {name: _function(read.program, constant) for name, read in c_programs(text).items()}


def python_functions(text: str, constant: Callable[[Fraction], Any] = lambda value: value) -> dict[str, Function]:
    """Read the kernels of a ``.py`` module as functions over any ring; see `c_functions`."""
    return {name: _function(read.program, constant) for name, read in python_programs(text).items()}


def _function(program: Program, constant: Callable[[Fraction], Any]) -> Function:
    def function(*arguments: Sequence[Any]) -> tuple[tuple[Any, ...], ...]:
        names = [argument.name for argument in program.arguments]
        return tuple(interpret(program, dict(zip(names, arguments, strict=True)), constant).values())

    return function


def c_programs(text: str) -> dict[str, Read]:
    """Read the programs of a ``.c`` file, without those of kernels with loops."""
    return _c_module(text)[0]


def c_procedures(text: str) -> dict[str, Procedure]:
    """Read the kernels with loops of a ``.c`` file, with the names used there."""
    return _c_module(text)[1]


@lru_cache(maxsize=4)
def _c_module(text: str) -> tuple[dict[str, Read], dict[str, Procedure]]:
    """Read the kernels without loops and the kernels with loops of a ``.c`` file."""
    body = _body(text, "//")
    every = body.splitlines()
    first = next((k for k, line in enumerate(every) if line.startswith(LOOPS_START)), len(every))
    lines = every[:first]
    found: list[Read] = []
    include = re.search(r'^#include "(\w+)\.h"$', body, re.MULTILINE)
    if include is None:
        raise BackendError("C text", "no #include of its header", "a generated C file")
    for k, line in enumerate(lines):
        if line.startswith(("INLINE void NAME(", "FUSED(")):
            function = _c_kernel(lines, k)
            listed = _defined(lines, _index(lines, k, f"#define PARTS_{function.name}("))
            found.append(Read(_c_program(function, *_c_shapes(function, listed)), ()))
        elif line.startswith("static INLINE void NAME(") and found and f"({found[-1].program.name}_prepare_" in line:
            after = _index(lines, k + 1, "static INLINE void NAME(")
            prepare, apply = _c_function(lines, k), _c_function(lines, after)
            n_prepared = sum(statement.startswith(f"{prepare.parameters[-1]}[") for statement in prepare.statements)
            form = _form(found[-1].program, prepare, apply, n_prepared, _c_program)
            found[-1] = Read(found[-1].program, (*found[-1].forms, form))
    try:
        procedures = _c_procedures(every[first:])
        expected = c_body(include[1], [(read.program, read.forms) for read in found], procedures)
    except (LookupError, StopIteration, TypeError, ValueError) as error:
        if isinstance(error, GacError) or first == len(every):
            raise
        # A changed text may state something that is not a valid procedure.
        raise BackendError("C text", f"{type(error).__name__}: {error}", "a file written by gacompiler") from error
    _compare("C text", expected, body)
    return {read.program.name: read for read in found}, {each.name: each for each in procedures}


def _c_procedures(lines: list[str]) -> list[Procedure]:
    """Read the kernels with loops and their straight-line parts, which are separate functions."""
    parts = {}
    for k, line in enumerate(lines):
        if line.startswith("static INLINE void NAME(") and not re.match(r".*_within\)\(intptr_t ", line):
            function = _c_function(lines, k)
            parts[function.name] = function

    def part(name: str) -> _CFunction:
        if name not in parts:
            raise BackendError("C text", f"no function {name}", "a part of a kernel with loops")
        return parts[name]

    def program(name: str, shapes: Sequence[Shape], out_shapes: Sequence[Shape]) -> Program:
        function = part(name)
        if len(function.parameters) != len(shapes) + len(out_shapes):
            raise BackendError(f"C text of {name}", f"called with {len(shapes) + len(out_shapes)} rows", "as declared")
        return _c_program(function, shapes, out_shapes)

    return read_procedures(lines, program, lambda name: part(name).n_inputs)


def _index(lines: list[str], first: int, start: str) -> int:
    """Return the index of the first line from `first` on that starts with a text."""
    found = next((k for k in range(first, len(lines)) if lines[k].startswith(start)), None)
    if found is None:
        raise BackendError("C text", f"no line {start!r}", "a file written by gacompiler")
    return found


class _CFunction(NamedTuple):
    """A function of a C file, with statements in Python syntax and constants without casts."""

    name: str
    parameters: tuple[str, ...]
    statements: list[str]
    n_inputs: int


def _c_function(lines: list[str], k: int) -> _CFunction:
    """Read the function whose head begins in line `k`."""
    start, end = lines.index("{", k), lines.index("}", k)
    head = re.fullmatch(r"(?:static )?INLINE void NAME\((\w+)\)\((.*)\)", _joined(lines[k:start]))
    if head is None:
        raise BackendError("C text", f"line {lines[k]!r}", "a kernel written by gacompiler")
    parameters = head[2].removesuffix(", WORD *far").split(", ")
    statements = []
    for statement in filter(None, _joined(lines[start + 1 : end]).split(";")):
        text = statement.strip().removeprefix("const REAL ").replace("(REAL)", "")
        if not text.startswith("(void)"):
            statements += re.split(r", (?=\w+ = )", text)
    names = tuple(parameter.split("REAL ")[-1].lstrip("*") for parameter in parameters)
    n_inputs = sum(not parameter.startswith("REAL *") for parameter in parameters)
    return _CFunction(head[1], names, statements, n_inputs)


def _joined(lines: list[str]) -> str:
    """Join lines to one."""
    return re.sub(r"\s+", " ", " ".join(lines)).strip()


def _c_kernel(lines: list[str], k: int) -> _CFunction:
    """Read the kernel in line `k`, whose body is a separate function if it computes transcendental functions."""
    if lines[k].startswith("INLINE"):
        return _c_function(lines, k)
    name = lines[k].removeprefix("FUSED(").partition(",")[0]
    return _c_function(lines, _index(lines, 0, f"static INLINE void NAME({name}_within)("))._replace(name=name)


def _defined(lines: list[str], k: int) -> str:
    """Return the definition of the macro in line `k`, with its continuation lines joined."""
    end = next((j for j in range(k, len(lines)) if not lines[j].endswith("\\")), k)
    return " ".join(line.removesuffix("\\").strip() for line in lines[k : end + 1])


def _c_shapes(function: _CFunction, listed: str) -> tuple[list[Shape], list[Shape]]:
    """Return the shapes of arguments and results from the list of the parts of a kernel."""
    shapes: dict[bool, list[Shape]] = {False: [], True: []}
    for kind, numbers in re.findall(r"\b(IN|NUMBER|OUT)\((\d+, [\w, ]+)\)", listed):
        described = numbers.split(", ")
        rank = int(described[4]) if kind != "NUMBER" else 0
        shapes[kind == "OUT"].append(tuple(map(int, described[5 : 5 + rank])))
    count = len(shapes[False]) + len(shapes[True])
    if count != len(function.parameters):
        raise BackendError(f"C text of {function.name}", f"a list of {count} parts", f"{len(function.parameters)}")
    return shapes[False], shapes[True]


def _c_program(function: _CFunction, shapes: Sequence[Shape], out_shapes: Sequence[Shape]) -> Program:
    """Read a program from statements ``x = m[1]``, ``t = a * b``, ``out[0] = t``, in that order."""
    where = f"C text of {function.name}"
    n_arguments = len(shapes)
    parameters, outputs = function.parameters[:n_arguments], function.parameters[n_arguments:]
    sizes = dict(zip(function.parameters, map(prod, (*shapes, *out_shapes)), strict=True))
    components: dict[str, list[str | None]] = {name: [None] * sizes[name] for name in parameters}
    entries: dict[str, list[Tree | None]] = {name: [None] * sizes[name] for name in outputs}
    statements: list[tuple[str, Node]] = []
    for statement in _parsed(where, "\n".join(function.statements)):
        match statement:
            case ast.Assign([ast.Name(target)], ast.Subscript(ast.Name(array), ast.Constant(int(k)))) if (
                array in components and k < sizes[array] and not statements
            ):
                components[array][k] = target
            case ast.Assign([ast.Subscript(ast.Name(array), ast.Constant(int(k)))], value) if (
                array in entries and k < sizes[array] and entries[array][k] is None
            ):
                entries[array][k] = _tree(where, value)
            case ast.Assign([ast.Name(target)], value):
                statements.append((target, _node(where, value)))
            case _:
                raise _unreadable(where, statement)
    results = [[tree for tree in entries[name] if tree is not None] for name in outputs]
    for name, trees in zip(outputs, results, strict=True):
        if len(trees) != sizes[name]:
            raise BackendError(where, f"{len(trees)} entries of {name} are written", f"{sizes[name]}")
    text = Nested(
        parameters, outputs, tuple(map(tuple, components.values())), tuple(statements), tuple(map(tuple, results))
    )
    return flattened(function.name, shapes, out_shapes, text)


_Text = TypeVar("_Text", _CFunction, "PythonFunction")


def _form(
    program: Program,
    prepare: _Text,
    apply: _Text,
    n_prepared: int,
    read: Callable[[_Text, Sequence[Shape], Sequence[Shape]], Program],
) -> Uniform:
    """Read a uniform variant from its two functions; `n_prepared` is the number of prepared coefficients."""
    suffix = prepare.name.removeprefix(f"{program.name}_prepare_")
    kept = suffix.split("_")
    every = [argument.name for argument in program.arguments]
    same = tuple(name for k, name in enumerate(every) if name in kept or str(k) in kept)
    if not 0 < len(same) == len(kept) < len(every) or apply.name != f"{program.name}_apply_{suffix}":
        raise BackendError(f"text of {program.name}", f"functions {prepare.name} and {apply.name}", "a variant of it")
    prepared: Shape = (n_prepared,)
    fixed = [argument.shape for argument in program.arguments if argument.name in same]
    changing: list[Shape] = [argument.shape for argument in program.arguments if argument.name not in same]
    out_shapes = [result.shape for result in program.results]
    return Uniform(same, read(prepare, fixed, [prepared]), read(apply, [prepared, *changing], out_shapes))


class PythonFunction(NamedTuple):
    """A function of a Python module."""

    name: str
    parameters: tuple[str, ...]
    statements: list[ast.stmt]
    lines: list[str]


def python_programs(text: str) -> dict[str, Read]:
    """Read the programs of a ``.py`` module, without those of kernels with loops."""
    lines, nodes = python_statements(text)
    definitions = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    functions = {node.name: python_function(lines, node) for node in definitions}
    if len(functions) != len(definitions):
        raise BackendError("Python text", "two functions with the same name", "a module written by gacompiler")
    forms: dict[str, list[ast.Call]] = {}
    for node in nodes:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            called = node.value
            if ast.unparse(called.func) == "_module.form":
                forms.setdefault(ast.unparse(called.args[0]), []).append(called)
    return {
        node.name: _python_read(lines, functions, node.name, node.decorator_list[0], forms.get(node.name, []))
        for node in definitions
        if node.decorator_list
        and isinstance(node.decorator_list[0], ast.Call)
        and ast.unparse(node.decorator_list[0].func) != OF_LOOPS
    }


def python_statements(text: str) -> tuple[list[str], list[ast.stmt]]:
    """Return the lines and the statements of a ``.py`` module below its header."""
    body = _body(text, "#")
    return body.splitlines(), _parsed("Python text", body)


def python_function(lines: list[str], node: ast.FunctionDef) -> PythonFunction:
    """Return a function without its docstring."""
    documented = isinstance(node.body[0], ast.Expr)
    statements = node.body[1:] if documented else node.body
    first = node.body[0].end_lineno if documented else node.lineno
    return PythonFunction(
        node.name.removeprefix("_"),
        tuple(argument.arg for argument in node.args.args),
        statements,
        [lines[node.lineno - 1], *lines[first : node.end_lineno]],
    )


def _python_read(
    lines: list[str],
    functions: Mapping[str, PythonFunction],
    name: str,
    decorator: ast.Call,
    forms: list[ast.Call],
) -> Read:
    """Read a kernel and its uniform variants, with the shapes from its decorator."""
    where = f"Python text of {name}"
    program = python_program(functions[name], *shapes_in(ast.literal_eval(decorator.args[0])))
    options = {keyword.arg: keyword.value for keyword in decorator.keywords}
    _compare(where, cost_text(cost(program)), ast.literal_eval(options["cost"]))
    declared = ast.literal_eval(options["names"]).split() if "names" in options else []
    _compare(where, "\n".join(function_text(program)), "\n".join(functions[name].lines))
    read = []
    for call in forms:
        same = _same_arguments(program, call, declared)
        has_functions = any(option.arg == "n_prepared" for option in call.keywords)
        names = [f"_{form_name(program, same, what)}" for what in ("prepare", "apply") if has_functions]
        if not functions.keys() >= set(names):
            raise BackendError(where, f"no functions {' and '.join(names)}", "both")
        own = [functions[name] for name in names]
        read.append(form := _python_form(where, program, same, own))
        expected = form_text(program, form, declared)
        _compare(where, "\n".join(expected), "\n".join(lines[call.lineno - 1 : call.end_lineno]))
        for text, function in zip(form_functions(program, form), own, strict=True):
            _compare(f"Python text of {function.name}", "\n".join(text), "\n".join(function.lines))
    return Read(program, tuple(read))


def _same_arguments(program: Program, call: ast.Call, declared: Sequence[str]) -> list[str]:
    """Return the arguments that a declared variant has the same for all elements."""
    own = [argument.name for argument in program.arguments]
    names = dict(zip(declared or own, own, strict=True))
    return [names.get(name, name) for name in ast.literal_eval(call.args[1]).split()]


def _python_form(where: str, program: Program, same: Sequence[str], functions: Sequence[PythonFunction]) -> Uniform:
    """Read a uniform variant from its functions; without functions, it performs the operations of the program."""
    if not functions:
        form = split(program, same)
        if form is None:
            raise BackendError(where, f"a variant for the same {' '.join(same)}", "a variant of it")
        return form
    prepare, apply = functions
    match prepare.statements:
        case [*_, ast.Return(ast.Tuple(prepared))]:
            return _form(program, prepare, apply, len(prepared), python_program)
    raise BackendError(f"Python text of {prepare.name}", "no tuple of coefficients", "a tuple at its end")


def python_program(function: PythonFunction, shapes: Sequence[Shape], out_shapes: Sequence[Shape]) -> Program:
    """Read a program from statements ``a, b = m``, ``t = a * b``, ``return t``, in that order."""
    where = f"Python text of {function.name}"
    if len(function.parameters) != len(shapes) or not function.statements:
        raise BackendError(where, f"{len(function.parameters)} parameters", f"a function of {len(shapes)} arguments")
    of_parameter = dict(zip(function.parameters, shapes, strict=True))
    components: dict[str, list[str | None]] = {name: [None] * prod(shape) for name, shape in of_parameter.items()}
    statements: list[tuple[str, Node]] = []
    *body, last = function.statements
    for statement in body:
        match statement:
            case ast.Assign([ast.Tuple() as targets], ast.Name(array)) if array in components and not statements:
                entries = _entries(where, targets, of_parameter[array])
                components[array] = [None if name == "_" else name for name in map(ast.unparse, entries)]
            case ast.Assign([ast.Name(target)], value):
                statements.append((target, _node(where, value)))
            case _:
                raise _unreadable(where, statement)
    if not isinstance(last, ast.Return) or last.value is None:
        raise _unreadable(where, last)
    values = [last.value] if len(out_shapes) == 1 else _entries(where, last.value, (len(out_shapes),))
    results = [_entries(where, value, shape) for value, shape in zip(values, out_shapes, strict=True)]
    text = Nested(
        function.parameters,
        tuple(f"out{k}" for k in range(len(out_shapes))),
        tuple(map(tuple, components.values())),
        tuple(statements),
        tuple(tuple(_tree(where, entry) for entry in result) for result in results),
    )
    return flattened(function.name, shapes, out_shapes, text)


def _entries(where: str, value: ast.expr, shape: Shape) -> list[ast.expr]:
    """Return the entries of nested tuples of a shape, in C order."""
    if not shape:
        return [value]
    if not isinstance(value, ast.Tuple) or len(value.elts) != shape[0]:
        raise _unreadable(where, value)
    return [entry for item in value.elts for entry in _entries(where, item, shape[1:])]


def _parsed(where: str, text: str) -> list[ast.stmt]:
    """Parse the statements of a text."""
    try:
        return ast.parse(text).body
    except (SyntaxError, RecursionError, MemoryError) as error:
        raise BackendError(where, f"{error}", "a text written by gacompiler") from error


def _unreadable(where: str, node: ast.AST) -> BackendError:
    return BackendError(where, f"line {ast.unparse(node)!r}", "a statement written by gacompiler")


def _node(where: str, value: ast.expr) -> Node:
    """Read an expression that must be an operation."""
    tree = _tree(where, value)
    if not isinstance(tree, Node):
        raise _unreadable(where, value)
    return tree


def _tree(where: str, value: ast.expr) -> Tree:
    """Read an expression. Quotients of two numbers, and numbers with a sign, are numbers."""
    match value:
        case ast.Name(name):
            return name
        case ast.Constant(int() | float() as found):
            return Fraction(found)
        case ast.UnaryOp(ast.USub(), operand):
            tree = _tree(where, operand)
            return -tree if isinstance(tree, Fraction) else Node(Op.NEGATE, (tree,))
        case ast.BinOp(left, operator, right) if type(operator) in _INFIX:
            operands = _tree(where, left), _tree(where, right)
            if (
                isinstance(operator, ast.Div)
                and isinstance(operands[0], Fraction)
                and isinstance(operands[1], Fraction)
            ):
                return operands[0] / operands[1]
            return Node(_INFIX[type(operator)], operands)
        case ast.Call(ast.Name(name), arguments, []) if name in _CALLS and len(arguments) == ARITY[_CALLS[name]]:
            return Node(_CALLS[name], tuple(_tree(where, argument) for argument in arguments))
        case _:
            raise _unreadable(where, value)


def read_number(where: str, value: ast.expr) -> Fraction:
    """Read a constant."""
    tree = _tree(where, value)
    if not isinstance(tree, Fraction):
        raise _unreadable(where, value)
    return tree


def _body(text: str, prefix: str) -> str:
    """Return the text below the header."""
    head, mark, rest = text.partition(f"{prefix} body: ")
    if not mark or not all(line.startswith(prefix) for line in head.splitlines()):
        raise BackendError("generated file", "no header", "the header written by gacompiler")
    return rest.partition("\n")[2]


def _compare(where: str, expected: str, found: str) -> None:
    if expected == found:
        return
    right, wrong = expected.splitlines(), found.splitlines()
    for k, (a, b) in enumerate(zip(right, wrong, strict=False)):
        if a != b:
            raise BackendError(f"{where}, line {k + 1} of the body", repr(b), repr(a), "generate it again")
    raise BackendError(where, f"{len(wrong)} lines", f"{len(right)}", "generate it again")
