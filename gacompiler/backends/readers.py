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
from ..gac_runtime.definition import shapes_in
from ..ir.cost import cost
from ..ir.interpret import interpret
from ..ir.program import Argument, Line, Operand, Program, Result
from ..ir.scalar import Op
from ..ir.uniform import Uniform
from ..ir.verify import verify
from .c import c_body
from .numba import function_text, indices
from .python import cost_text, form_text

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


class Read(NamedTuple):
    """A kernel as its text has it."""

    program: Program
    forms: tuple[Uniform, ...]


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
    return {name: _function(read.program, constant) for name, read in c_programs(text).items()}


def python_functions(text: str, constant: Callable[[Fraction], Any] = lambda value: value) -> dict[str, Function]:
    """The kernels of a ``.py`` module as functions over any ring; as `c_functions`."""
    return {name: _function(read.program, constant) for name, read in python_programs(text).items()}


def _function(program: Program, constant: Callable[[Fraction], Any]) -> Function:
    def function(*arguments: Sequence[Any]) -> tuple[tuple[Any, ...], ...]:
        names = [argument.name for argument in program.arguments]
        return tuple(interpret(program, dict(zip(names, arguments, strict=True)), constant).values())

    return function


def c_programs(text: str) -> dict[str, Read]:
    """The programs that a ``.c`` file holds."""
    body = _body(text, "//")
    lines = body.splitlines()
    found: list[Read] = []
    include = re.search(r'^#include "(\w+)\.h"$', body, re.MULTILINE)
    if include is None:
        raise BackendError("C text", "no #include of its header", "a generated C file")
    for k, line in enumerate(lines):
        if line.startswith(("INLINE void NAME(", "FUSED(")):
            name, parameters, statements = _c_kernel(lines, k)
            loop = _index(lines, k, f"static INLINE void NAME({name}_block)(")
            shaped = _c_parameters(name, parameters, lines[loop : lines.index("}", loop)])
            found.append(Read(_program(name, shaped, statements, _flat_indices), ()))
        elif line.startswith("static INLINE void NAME(") and found and f"({found[-1].program.name}_prepare_" in line:
            after = _index(lines, k + 1, "static INLINE void NAME(")
            form = _form(found[-1].program, *_c_function(lines, k), *_c_function(lines, after), _flat_indices)
            found[-1] = Read(found[-1].program, (*found[-1].forms, form))
    _compare("C text", c_body(include[1], [(read.program, read.forms) for read in found]), body)
    return {read.program.name: read for read in found}


def _index(lines: list[str], first: int, start: str) -> int:
    """The first line from `first` on that begins so."""
    found = next((k for k in range(first, len(lines)) if lines[k].startswith(start)), None)
    if found is None:
        raise BackendError("C text", f"no line {start!r}", "a file that gacompiler writes")
    return found


def _flat_indices(part: Argument | Result) -> list[str]:
    return list(map(str, range(prod(part.shape))))


def _c_function(lines: list[str], k: int) -> tuple[str, list[str], list[str]]:
    """Name, parameters and statements of the function whose head begins in line `k`."""
    start, end = lines.index("{", k), lines.index("}", k)
    text = re.sub(r"\s+", " ", " ".join(lines[k:start]))
    head = re.fullmatch(r"(?:static )?INLINE void NAME\((\w+)\)\((.*)\)", text)
    if head is None:
        raise BackendError("C text", f"line {lines[k]!r}", "a kernel that gacompiler writes")
    statements = [_c_statement(head[1], statement) for statement in lines[start + 1 : end]]
    parameters = head[2].removesuffix(", WORD *far").split(", ")
    return head[1], parameters, [statement for statement in statements if statement]


def _c_kernel(lines: list[str], k: int) -> tuple[str, list[str], list[str]]:
    """The same of the kernel in line `k`, whose statements are elsewhere if it computes sines and their kin."""
    if lines[k].startswith("INLINE"):
        return _c_function(lines, k)
    name = lines[k].removeprefix("FUSED(").partition(",")[0]
    within = _index(lines, 0, f"static INLINE void NAME({name}_within)(")
    return name, *_c_function(lines, within)[1:]


def _c_parameters(kernel: str, texts: list[str], each: list[str]) -> list[_Parameter]:
    shapes: dict[int, tuple[int, ...]] = {}
    for line in each:
        moved = re.search(r"NAME\((?:load|store)_(\w+)\)\((?:x(\d+), |a(\d+) )", line)
        if moved:
            axes = () if moved[1] == "scalar" else tuple(map(int, moved[1].split("x")))
            shapes.setdefault(int(moved[2] or moved[3]), axes)
    parameters = []
    for k, parameter in enumerate(texts):
        if k not in shapes:
            raise BackendError(f"C text of {kernel}", f"parameter {parameter!r}", "a parameter that gacompiler writes")
        name, is_result = _c_parameter(kernel, parameter)
        parameters.append(_Parameter(name, shapes[k], is_result))
    return parameters


def _c_parameter(kernel: str, text: str) -> tuple[str, bool]:
    """Name of a parameter, and whether it is written to."""
    match = re.fullmatch(r"(const REAL \*|REAL \*|REAL )(\w+)", text)
    if match is None:
        raise BackendError(f"C text of {kernel}", f"parameter {text!r}", "a parameter that gacompiler writes")
    return match[2], match[1] == "REAL *"


def _c_statement(kernel: str, statement: str) -> str:
    """A C statement as Python would write it; empty where it only silences a warning."""
    match = re.fullmatch(r"    (?:const REAL )?(.*);", statement)
    if match is None:
        raise BackendError(f"C text of {kernel}", f"line {statement.strip()!r}", "a statement that gacompiler writes")
    return "" if re.fullmatch(r"\(void\)\w+", match[1]) else match[1]


def _form(
    program: Program,
    prepare_name: str,
    prepare_parameters: list[str],
    prepare_statements: list[str],
    apply_name: str,
    apply_parameters: list[str],
    apply_statements: list[str],
    places: Callable[[Argument | Result], list[str]],
) -> Uniform:
    """A form from the texts of its functions; shapes are those of the kernel, and what is prepared is counted."""
    suffix = prepare_name.removeprefix(f"{program.name}_prepare_")
    kept = suffix.split("_")
    every = [argument.name for argument in program.arguments]
    same = tuple(name for k, name in enumerate(every) if name in kept or str(k) in kept)
    if not 0 < len(same) == len(kept) < len(every) or apply_name != f"{program.name}_apply_{suffix}":
        raise BackendError(f"text of {program.name}", f"functions {prepare_name} and {apply_name}", "a form of it")
    bare = [parameter.rsplit("*", 1)[-1].removeprefix("REAL ") for parameter in prepare_parameters]
    prepared = bare[-1]
    count = sum(statement.startswith(f"{prepared}[") for statement in prepare_statements)
    fixed = [argument for argument in program.arguments if argument.name in same]
    rest = [argument for argument in program.arguments if argument.name not in same]
    once = [_Parameter(name, part.shape, False) for name, part in zip(bare, fixed, strict=False)]
    once.append(_Parameter(prepared, (count,), True))
    bare = [parameter.rsplit("*", 1)[-1].removeprefix("REAL ") for parameter in apply_parameters]
    kinds = [((count,), False), *((part.shape, False) for part in rest), *((r.shape, True) for r in program.results)]
    each = [_Parameter(name, *kind) for name, kind in zip(bare, kinds, strict=False)]
    return Uniform(
        same,
        _program(prepare_name, once, prepare_statements, places),
        _program(apply_name, each, apply_statements, places),
    )


def python_programs(text: str) -> dict[str, Read]:
    """The programs that a ``.py`` module holds."""
    body = _body(text, "#")
    lines, tree = body.splitlines(), ast.parse(body)
    forms: dict[str, list[ast.Call]] = {}
    for node in tree.body:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            called = node.value
            if ast.unparse(called.func) == "_module.form":
                forms.setdefault(ast.unparse(called.args[0]), []).append(called)
    return {
        node.name: _python_program(lines, node, node.decorator_list[0], forms.get(node.name, []))
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and node.decorator_list and isinstance(node.decorator_list[0], ast.Call)
    }


def _python_function(lines: list[str], name: str) -> tuple[str, list[str], list[str]]:
    """The name, parameters and statements of a function."""
    starts = [k for k, line in enumerate(lines) if line.startswith(f"def {name}(")]
    head = re.fullmatch(r"def \w+\((.*)\):", lines[starts[0]]) if starts else None
    if head is None:
        raise BackendError(f"Python text of {name}", "no function of that name", f"def {name}(...)")
    statements = [line.strip() for line in lines[starts[0] + 1 : lines.index("", starts[0])]]
    return name.removeprefix("_"), head[1].split(", "), statements


def _python_program(lines: list[str], node: ast.FunctionDef, decorator: ast.expr, forms: list[ast.Call]) -> Read:
    assert isinstance(decorator, ast.Call)
    name = node.name
    shapes, out_shapes = shapes_in(ast.literal_eval(decorator.args[0]))
    parameters = [argument.arg for argument in node.args.args]
    if len(parameters) != len(shapes) + len(out_shapes):
        raise BackendError(f"Python text of {name}", "no function of its inputs and outputs", f"def {name}(...)")
    shaped = [
        _Parameter(parameter, shape, k >= len(shapes))
        for k, (parameter, shape) in enumerate(zip(parameters, (*shapes, *out_shapes), strict=True))
    ]
    statements = [line.strip() for line in lines[node.body[0].end_lineno : node.end_lineno]]
    declared = {str(keyword.arg): keyword.value for keyword in decorator.keywords}
    names = ast.literal_eval(declared["names"]).split() if "names" in declared else []
    program = _program(name, shaped, statements, indices)
    read = []
    for form in forms:
        prepare, apply = (_python_function(lines, ast.unparse(argument)) for argument in form.args[2:4])
        read.append(_form(program, *prepare, *apply, indices))
        found = lines[form.lineno - 1 : form.end_lineno]
        _compare(f"Python text of {name}", "\n".join(form_text(program, read[-1], names)), "\n".join(found))
    _compare(f"cost of {name}", cost_text(cost(program)), ast.literal_eval(declared["cost"]))
    expected = function_text(program, read)
    found = [lines[node.lineno - 1], *lines[node.body[0].end_lineno : node.end_lineno]]
    _compare(f"Python text of {name}", "\n".join(expected[0]), "\n".join(found))
    for text in expected[1:]:
        start = lines.index(text[0])
        _compare(f"Python text of {name}", "\n".join(text), "\n".join(lines[start : start + len(text)]))
    return Read(program, tuple(read))


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
