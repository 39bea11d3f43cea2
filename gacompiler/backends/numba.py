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
from .c_batch import form_name, named_parts
from .printers import PYTHON, Names


def function_text(program: Program, forms: Sequence[Uniform] = ()) -> list[str]:
    """The lines of a kernel and of its loop over a batch, and of its forms for batches with arguments that stay."""
    lines, parameters = _one_function(program)
    outputs = parameters[len(program.arguments) :]
    element = _fresh("i", parameters)
    arguments = ", ".join(f"{parameter}[{element}]" for parameter in parameters)
    lines += [
        *["", "", f"def _{program.name}_loop({', '.join(parameters)}):"],
        f"    for {element} in range(len({outputs[0]})):",
        f"        _{program.name}({arguments})",
    ]
    for form in forms:
        lines += ["", "", *_form_text(program, form, parameters)]
    return lines


def _form_text(program: Program, form: Uniform, parameters: list[str]) -> list[str]:
    """Both functions of a form, and its loop, which prepares once."""
    names = [argument.name for argument in program.arguments]
    once = [f"{p}[0]" for p, name in zip(parameters, names, strict=False) if name in form.same]
    element, prepared = _fresh("i", parameters), _fresh("prepared", parameters)
    each = [f"{p}[{element}]" for k, p in enumerate(parameters) if k >= len(names) or names[k] not in form.same]
    output = parameters[len(names)]
    prepare, apply = named_parts(program, form)
    return [
        *_one_function(prepare)[0],
        *["", "", *_one_function(apply)[0]],
        *["", "", f"def _{form_name(program, form, 'loop')}({', '.join(parameters)}):"],
        f"    {prepared} = empty({form.apply.arguments[0].shape[0]}, {output}.dtype)",
        f"    _{prepare.name}({', '.join([*once, prepared])})",
        f"    for {element} in range(len({output})):",
        f"        _{apply.name}({', '.join([prepared, *each])})",
    ]


def _fresh(name: str, taken: Sequence[str]) -> str:
    while name in taken:
        name += "_"
    return name


def _one_function(program: Program) -> tuple[list[str], list[str]]:
    """The lines of one function, and its parameters."""
    names = Names()
    parameters = names.parameters(program)
    parameters += [names.fresh(result.name) for result in program.results]
    outputs = parameters[len(program.arguments) :]
    used = used_variables(program)
    lines = [f"def _{program.name}({', '.join(parameters)}):"]
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
    return lines, parameters


def indices(part: Argument | Result) -> list[str]:
    """The index of every entry, in C order; a scalar result is entry 0 of a vector."""
    return [", ".join(map(str, index)) or "0" for index in product(*map(range, part.shape))]
