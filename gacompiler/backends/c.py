"""C17: one ``.c`` whose kernels are written once for both precisions, and one ``.h`` that a C program can include.

Every kernel is a plain function on contiguous components, and a loop over a batch with the calling convention of
numpy's generalised ufuncs (see `gacompiler.backends.c_batch`).
"""

from __future__ import annotations

import textwrap
from functools import cache
from math import prod
from pathlib import Path

import jinja2

from ..ir.program import Program
from ..ir.uniform import Uniform
from .c_batch import (
    FEW,
    LANES,
    call_helpers,
    load_helpers,
    loop_text,
    named_parts,
    parts,
    store_helpers,
    tile_sizes,
)
from .c_functions import TRANSCENDENTAL, constants, has_turns, is_transcendental, polynomial_lines
from .c_tiles import tile_helpers
from .documentation import c_comment, stamp
from .module import KernelSource, ModuleSource
from .nesting import Nested, expression, nested
from .printers import C_MACROS, C

POLICY = "contraction: -ffp-contract=off (every operation is rounded once)"

_WIDTH = 116

_SPACE = 4096
"""Numbers in the rows of a block, which are to stay in the first cache; more if the least block needs more."""


@cache
def environment() -> jinja2.Environment:
    """The templates: loops over prepared lines, nothing else."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent / "templates"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )


def c_source(module: ModuleSource) -> str:
    """The ``.c`` of a module.

    Parameters
    ----------
    module : ModuleSource
        What to print.

    Returns
    -------
    str
        C17 that needs only ``<math.h>`` and the header of `c_header`, beside it under the name of the module.
    """
    return stamp(
        c_body(module.name, [(kernel.program, kernel.uniform) for kernel in module.kernels]), module, "//", (POLICY,)
    )


def c_body(name: str, kernels: list[tuple[Program, tuple[Uniform, ...]]]) -> str:
    """All of the ``.c`` below its header, a function of the programs alone: a reader checks a file against it."""
    programs = [program for program, _ in kernels]
    forms = [form for _, uniform in kernels for form in uniform]
    shapes = [[part.shape for part in parts(program)] for program in programs]
    parts_of_forms = [part for form in forms for part in (form.prepare, form.apply)]
    used = {line.op for program in (*programs, *parts_of_forms) for line in program.lines}
    sizes = tile_sizes([prod(shape) for each in shapes for shape in each])
    template = environment().get_template("module.c.jinja")
    return template.render(
        name=name,
        macros=[text for op, text in C_MACROS.items() if op in used],
        functions=_functions(name) if used & TRANSCENDENTAL else None,
        loads=load_helpers([argument.shape for program in programs for argument in program.arguments]),
        stores=store_helpers([result.shape for program in programs for result in program.results]),
        calls=[{**helper, "lines": _wrapped(helper["lines"])} for helper in call_helpers(programs)],
        n_axes=max([1, *(len(shape) for each in shapes for shape in each)]),
        n_parts=max([1, *map(len, shapes)]),
        n_cores=max([1, *(sum(map(len, each)) for each in shapes)]),
        n_numbers=max([1, *(sum(map(prod, each)) for each in shapes)]),
        n_prepared=max([1, *(form.apply.arguments[0].shape[0] for form in forms)]),
        tiles=tile_helpers(sizes),
        few=[size for size in sizes if size <= FEW],
        many=[size for size in sizes if size > FEW],
        space=max([_SPACE, *(LANES * sum(map(prod, each)) for each in shapes)]),
        kernels=["\n".join(_wrapped(_kernel_and_loops(program, uniform))) for program, uniform in kernels],
    )


@cache
def _functions(name: str) -> dict[str, list[str]]:
    """The transcendental functions of a module: polynomials, and what is written once for both precisions."""
    text = environment().get_template("functions.c.jinja").render(constants())
    return {"polynomials": _wrapped(polynomial_lines(name)), "generic": text.splitlines()}


def _kernel_and_loops(program: Program, uniform: tuple[Uniform, ...]) -> list[str]:
    lines = kernel_text(program)
    for form in uniform:
        for part in named_parts(program, form):
            lines += ["", *kernel_text(part, "static INLINE")]
    return [*lines, "", *loop_text(program, uniform)]


def c_header(module: ModuleSource) -> str:
    """The ``.h`` of a module: prototypes in both precisions, with layouts and counts."""
    kernels = [
        {"comment": c_comment(kernel), "prototypes": _prototypes(module.name, kernel)} for kernel in module.kernels
    ]
    summary = [line.rstrip() for line in module.summary.strip().splitlines()]
    text = environment().get_template("module.h.jinja").render(name=module.name, summary=summary, kernels=kernels)
    return stamp(text, module, "//", (POLICY,))


def _prototypes(module: str, kernel: KernelSource) -> list[str]:
    texts = []
    name = f"{module}_{kernel.program.name}"
    text = nested(kernel.program)
    for real, suffix in (("double", "f64"), ("float", "f32")):
        texts.append(f"void {name}_{suffix}({', '.join(_parameters(kernel.program, text, real))});")
    loop = "(char **args, const intptr_t *dimensions, const intptr_t *steps);"
    texts += [f"void {name}_loop_{suffix}{loop}" for suffix in ("f64", "f32")]
    return _wrapped(texts)


def _wrapped(lines: list[str]) -> list[str]:
    """Lines of C, long ones continued."""
    wrapped = []
    for line in lines:
        indent = " " * (len(line) - len(line.lstrip()))
        wrapped += textwrap.wrap(
            line.strip(),
            _WIDTH,
            initial_indent=indent,
            subsequent_indent=f"{indent}    ",
            break_long_words=False,
            break_on_hyphens=False,
        ) or [""]
    return wrapped


def _parameters(program: Program, text: Nested, real: str) -> list[str]:
    """The parameters of a plain function: numbers, and pointers to arguments and results."""
    inputs = zip(program.arguments, text.parameters, strict=True)
    texts = [f"const {real} *{name}" if argument.shape else f"{real} {name}" for argument, name in inputs]
    return texts + [f"{real} *{name}" for name in text.outputs]


def kernel_text(program: Program, storage: str = "INLINE") -> list[str]:
    """The plain function: inputs read, one statement for each line, outputs written.

    With sines and their kin its body is a function of its own, for loops; with sines or cosines that has a place to
    say that an argument is too far for one.
    """
    text = nested(program)
    parameters = _parameters(program, text, "REAL")
    passed = [*text.parameters, *text.outputs]
    name, given, after = program.name, parameters, []
    if has_turns(program):
        given = [*parameters, "WORD *far"]
    if is_transcendental(program) and storage == "INLINE":
        head, own, inner = map(", ".join, (parameters, passed, [*passed, *["NULL"] * has_turns(program)]))
        after = ["", f"FUSED({name}, ({head}), ({inner}))", f"void NAME({name})({head})", "{"]
        after += [f"    RUN({name}, ({own}), ({inner}));", "}"]
        name, storage = f"{name}_within", "static INLINE"
    lines = [f"{storage} void NAME({name})({', '.join(given)})", "{"]
    for argument, parameter, components in zip(program.arguments, text.parameters, text.components, strict=True):
        if not any(components):
            lines.append(f"    (void){parameter};")
        elif argument.shape:
            lines += _constants(
                [f"{component} = {parameter}[{k}]" for k, component in enumerate(components) if component is not None]
            )
    for target, tree in text.statements:
        lines += _constants([f"{target} = {expression(tree, C).text}"])
    for output, trees in zip(text.outputs, text.results, strict=True):
        lines += [f"    {output}[{k}] = {expression(tree, C).text};" for k, tree in enumerate(trees)]
    return [*lines, "}", *after]


def _constants(texts: list[str]) -> list[str]:
    """The definitions of some constants, as many to a line as fit."""
    lines = [f"    const REAL {texts[0]}"]
    for text in texts[1:]:
        if len(f"{lines[-1]}, {text};") > _WIDTH:
            lines[-1] += ","
            lines.append(f"        {text}")
        else:
            lines[-1] += f", {text}"
    lines[-1] += ";"
    return lines
