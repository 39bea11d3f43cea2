"""The Python text of a kernel: one function that numba compiles, that whole arrays run through, and that a proof reads.

``_move_point(m, p, out)`` reads ``m[0]`` (``m[0, 1]`` for a matrix), takes scalars as they are, and writes ``out[0]``.
Under numba ``m`` and ``out`` are arrays. With dictionaries of components instead, the same function runs on whole
arrays of any namespace. Functions are free names (``sqrt``, ``select``): whoever runs the text binds them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from ..ir.program import Argument, Program, Result
from ..ir.uniform import Uniform
from .c import used_variables
from .c_batch import named_parts
from .printers import PYTHON, Names


def function_text(program: Program, forms: Sequence[Uniform] = ()) -> list[list[str]]:
    """The lines of a kernel, and then of both functions of each of its forms."""
    parts = [part for form in forms for part in named_parts(program, form)]
    return [_one_function(program, program.name), *(_one_function(part, f"_{part.name}") for part in parts)]


def _one_function(program: Program, name: str) -> list[str]:
    """The lines of one function."""
    names = Names()
    parameters = names.parameters(program)
    parameters += [names.fresh(result.name) for result in program.results]
    outputs = parameters[len(program.arguments) :]
    used = used_variables(program)
    lines = [f"def {name}({', '.join(parameters)}):"]
    for argument, parameter in zip(program.arguments, parameters, strict=False):
        if argument.shape:
            lines += [
                f"    {names.define(component)} = {parameter}[{index}]"
                for component, index in zip(argument.components, indices(argument), strict=True)
                if component in used
            ]
    for line in program.lines:
        right = PYTHON[line.op].format(*map(names.python, line.operands))
        lines.append(f"    {names.define(line.target)} = {right}")
    for result, output in zip(program.results, outputs, strict=True):
        lines += [
            f"    {output}[{index}] = {names.python(operand)}"
            for operand, index in zip(result.operands, indices(result), strict=True)
        ]
    return lines


def indices(part: Argument | Result) -> list[str]:
    """The index of every entry, in C order; a scalar result is entry 0 of a vector."""
    return [", ".join(map(str, index)) or "0" for index in product(*map(range, part.shape))]
