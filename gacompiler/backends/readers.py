"""Read emitted text back as programs: what a proof runs is the file on disk, not what the printers meant to write.

The readers accept exactly what the printers write. A statement that changed into another legal one gives another
program, which the proof then finds to be different; anything else that changed (a loop, a load, a macro, a parameter)
no longer is what the printers write for that program, and is an error that names the line.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from math import prod
from typing import Any, NamedTuple

from ..errors import BackendError
from ..ir.interpret import interpret
from ..ir.program import Argument, Line, Operand, Program, Result
from ..ir.scalar import Op
from ..ir.verify import verify
from .c import c_body
from .numba import function_text, indices
from .python import runtime_text

Function = Callable[..., tuple[tuple[Any, ...], ...]]

_NUMBER = r"-?\d[\d.]*(?:e[+-]?\d+)?|\(-?\d+\.0 / \d+\.0\)"
_OPERAND = rf"(?:\(REAL\))?(?:{_NUMBER})|[A-Za-z_]\w*"
_INFIX = re.compile(rf"({_OPERAND}) ([-+*/]) ({_OPERAND})")
_NEGATION = re.compile(rf"-({_OPERAND})")
_CALL = re.compile(rf"(\w+)\(((?:{_OPERAND})(?:, (?:{_OPERAND}))*)\)")
_READ = re.compile(r"(\w+)\[([\d, ]+)\]")
_OPERAND_ONLY = re.compile(_OPERAND)
_SYMBOLS = {"+": Op.ADD, "-": Op.SUBTRACT, "*": Op.MULTIPLY, "/": Op.DIVIDE}


class _Parameter(NamedTuple):
    name: str
    shape: tuple[int, ...]
    is_result: bool


def c_functions(text: str, constant: Callable[[Fraction], Any] = lambda value: value) -> dict[str, Function]:
    """The kernels of a ``.c`` file as functions over any ring.

    Parameters
    ----------
    text : str
        The file.
    constant : callable
        Lifts an exact number into the ring, as for `gacompiler.ir.interpret.interpret`.

    Returns
    -------
    dict of str to callable
        Each takes a flat sequence of components for each argument and gives a tuple of flat results.

    Raises
    ------
    BackendError
        When the text is not what the printers write, naming the first line that is not.
    """
    return {name: _function(program, constant) for name, program in c_programs(text).items()}


def python_functions(text: str, constant: Callable[[Fraction], Any] = lambda value: value) -> dict[str, Function]:
    """The kernels of a ``.py`` module as functions over any ring; as `c_functions`."""
    return {name: _function(program, constant) for name, program in python_programs(text).items()}


def _function(program: Program, constant: Callable[[Fraction], Any]) -> Function:
    def function(*arguments: Sequence[Any]) -> tuple[tuple[Any, ...], ...]:
        names = [argument.name for argument in program.arguments]
        return tuple(interpret(program, dict(zip(names, arguments, strict=True)), constant).values())

    return function


def c_programs(text: str) -> dict[str, Program]:
    """The programs that a ``.c`` file holds."""
    body = _body(text, "//")
    lines = body.splitlines()
    programs = []
    include = re.search(r'^#include "(\w+)\.h"$', body, re.MULTILINE)
    if include is None:
        raise BackendError("C text", "no #include of its header", "a generated C file")
    for k, line in enumerate(lines):
        if line.startswith("INLINE void NAME("):
            start, end = lines.index("{", k), lines.index("}", k)
            head = re.fullmatch(r"INLINE void NAME\((\w+)\)\((.*)\)", re.sub(r"\s+", " ", " ".join(lines[k:start])))
            if head is None:
                raise BackendError("C text", f"line {line!r}", "a kernel that gacompiler writes")
            each = lines[end + 1 : lines.index("}", end + 1)]
            parameters = _c_parameters(head[1], head[2], each)
            statements = [_c_statement(head[1], statement) for statement in lines[start + 1 : end]]
            kept = [statement for statement in statements if statement]
            programs.append(_program(head[1], parameters, kept, lambda part: list(map(str, range(prod(part.shape))))))
    _compare("C text", c_body(include[1], programs), body)
    return {program.name: program for program in programs}


def _c_parameters(kernel: str, text: str, each: list[str]) -> list[_Parameter]:
    shapes: dict[int, tuple[int, ...]] = {}
    for line in each:
        moved = re.search(r"NAME\((?:load|store)_(\w+)\)\((?:x(\d+), |a(\d+) )", line)
        if moved:
            axes = () if moved[1] == "scalar" else tuple(map(int, moved[1].split("x")))
            shapes.setdefault(int(moved[2] or moved[3]), axes)
    parameters = []
    for k, parameter in enumerate(text.split(", ")):
        match = re.fullmatch(r"(const REAL \*|REAL \*|REAL )(\w+)", parameter)
        if match is None or k not in shapes:
            raise BackendError(f"C text of {kernel}", f"parameter {parameter!r}", "a parameter that gacompiler writes")
        parameters.append(_Parameter(match[2], shapes[k], match[1] == "REAL *"))
    return parameters


def _c_statement(kernel: str, statement: str) -> str:
    """A C statement as Python would write it; empty where it only silences a warning."""
    match = re.fullmatch(r"    (?:const REAL )?(.*);", statement)
    if match is None:
        raise BackendError(f"C text of {kernel}", f"line {statement.strip()!r}", "a statement that gacompiler writes")
    return "" if re.fullmatch(r"\(void\)\w+", match[1]) else match[1]


def python_programs(text: str) -> dict[str, Program]:
    """The programs that a ``.py`` module holds."""
    body = _body(text, "#")
    lines = body.splitlines()
    _compare("Python text", runtime_text(), body[body.find(runtime_text()[:80]) :][: len(runtime_text())])
    programs = {}
    for node in ast.parse(body).body:
        if not (isinstance(node, ast.Assign) and isinstance(node.value, ast.Call)):
            continue
        if not (isinstance(node.value.func, ast.Name) and node.value.func.id == "Kernel"):
            continue
        described = {
            str(keyword.arg): ast.literal_eval(keyword.value)
            for keyword in node.value.keywords
            if keyword.arg in ("name", "inputs", "outputs", "polynomial")
        }
        program = _python_program(lines, described)
        expected = f"    functions=(_{program.name}, _{program.name}_loop),"
        last = lines[(node.end_lineno or 1) - 2]
        if last != expected or described["polynomial"] != program.is_polynomial:
            raise BackendError(f"Python text of {program.name}", f"line {last.strip()!r}", repr(expected.strip()))
        programs[program.name] = program
    return programs


def _python_program(lines: list[str], described: dict[str, Any]) -> Program:
    name = described["name"]
    starts = [k for k, line in enumerate(lines) if line.startswith(f"def _{name}(")]
    head = re.fullmatch(r"def \w+\((.*)\):", lines[starts[0]]) if starts else None
    parts = [*described["inputs"], *described["outputs"]]
    parameters = head[1].split(", ") if head else []
    if head is None or len(parameters) != len(parts):
        raise BackendError(f"Python text of {name}", "no function of its inputs and outputs", f"def _{name}(...)")
    n_inputs = len(described["inputs"])
    shaped = [
        _Parameter(parameter, shape, k >= n_inputs)
        for k, (parameter, (_, shape)) in enumerate(zip(parameters, parts, strict=True))
    ]
    end = lines.index("", starts[0])
    program = _program(name, shaped, [line.strip() for line in lines[starts[0] + 1 : end]], indices)
    expected = function_text(program)
    _compare(f"Python text of {name}", "\n".join(expected), "\n".join(lines[starts[0] : starts[0] + len(expected)]))
    return program


def _program(
    name: str,
    parameters: list[_Parameter],
    statements: list[str],
    places: Callable[[Argument | Result], list[str]],
) -> Program:
    """The program of statements ``x = m[1]``, ``t = a * b``, ``out[0] = t``, in that order."""

    def fail(statement: str) -> BackendError:
        return BackendError(f"text of {name}", f"line {statement!r}", "a statement that gacompiler writes")

    arguments = [parameter for parameter in parameters if not parameter.is_result]
    results = [parameter for parameter in parameters if parameter.is_result]
    components = {
        part.name: [f"{part.name}[{k}]" for k in range(prod(part.shape))] if part.shape else [part.name]
        for part in arguments
    }
    entries: dict[str, list[Operand | None]] = {part.name: [None] * prod(part.shape) for part in results}
    index = {
        part.name: {text: k for k, text in enumerate(places(Result("", part.shape, (Fraction(0),) * prod(part.shape))))}
        for part in parameters
    }
    lines: list[Line] = []
    for statement in statements:
        target, equals, right = statement.partition(" = ")
        if not equals:
            raise fail(statement)
        read, written = _READ.fullmatch(right), _READ.fullmatch(target)
        if read and read[1] in components and read[2] in index[read[1]] and not lines:
            components[read[1]][index[read[1]][read[2]]] = target
        elif written and written[1] in entries and written[2] in index[written[1]] and _OPERAND_ONLY.fullmatch(right):
            if entries[written[1]][index[written[1]][written[2]]] is not None:
                raise fail(statement)
            entries[written[1]][index[written[1]][written[2]]] = _operand(right)
        else:
            operation = _operation(right)
            if operation is None or not target.isidentifier():
                raise fail(statement)
            lines.append(Line(target, *operation))
    outputs = []
    for part in results:
        operands = tuple(operand for operand in entries[part.name] if operand is not None)
        if len(operands) != prod(part.shape):
            raise BackendError(f"text of {name}", f"{part.name} is not written in full", f"{prod(part.shape)} entries")
        outputs.append(Result(part.name, part.shape, operands))
    inputs = tuple(Argument(part.name, part.shape, tuple(components[part.name])) for part in arguments)
    return verify(Program(name, inputs, tuple(lines), tuple(outputs)))


def _operation(text: str) -> tuple[Op, tuple[Operand, ...]] | None:
    infix = _INFIX.fullmatch(text)
    if infix:
        return _SYMBOLS[infix[2]], (_operand(infix[1]), _operand(infix[3]))
    negation = _NEGATION.fullmatch(text)
    if negation:
        return Op.NEGATE, (_operand(negation[1]),)
    call = _CALL.fullmatch(text)
    if call and call[1].lower() in (op.value for op in Op):
        return Op(call[1].lower()), tuple(map(_operand, call[2].split(", ")))
    return None


def _operand(text: str) -> Operand:
    text = text.removeprefix("(REAL)")
    if text.isidentifier():
        return text
    if text.startswith("("):
        top, bottom = text[1:-1].split(" / ")
        return Fraction(int(float(top)), int(float(bottom)))
    return Fraction(int(text)) if re.fullmatch(r"-?\d+", text) else Fraction(float(text))


def _body(text: str, prefix: str) -> str:
    """The text below the header."""
    head, mark, rest = text.partition(f"{prefix} body: ")
    if not mark or not all(line.startswith(prefix) for line in head.splitlines()):
        raise BackendError("generated file", "no header", "the header that gacompiler writes")
    return rest.partition("\n")[2]


def _compare(where: str, expected: str, found: str) -> None:
    if expected == found:
        return
    right, wrong = expected.splitlines(), found.splitlines()
    for k, (a, b) in enumerate(zip(right, wrong, strict=False)):
        if a != b:
            raise BackendError(f"{where}, line {k + 1} of the body", repr(b), repr(a), "generate it again")
    raise BackendError(where, f"{len(wrong)} lines", f"{len(right)}", "generate it again")
