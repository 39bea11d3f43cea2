"""C17: one ``.c`` whose kernels are written once for both precisions, and one ``.h`` that a C program can include.

Every kernel is a plain function on contiguous components, and a loop over a batch with the calling convention of
numpy's generalised ufuncs. The loop loads the components of an element into local arrays, calls the plain function,
which is inlined, and stores its results; so an output may be an input, and the compiler may vectorise without knowing
which arrays overlap. It is compiled for the strides that matter (`_variants`), and once for any strides.
"""

from __future__ import annotations

import textwrap
from functools import cache
from math import prod
from pathlib import Path

import jinja2

from ..ir.program import Argument, Program, Result
from .documentation import c_comment, stamp
from .module import KernelSource, ModuleSource
from .printers import C_MACROS, C, Names

POLICY = "contraction: -ffp-contract=off (every operation is rounded once)"

_WIDTH = 116

_LARGE = 400
"""Lines of a program above which only the variants that pay for their compile time are made."""

Part = Argument | Result


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
    return stamp(c_body(module.name, [kernel.program for kernel in module.kernels]), module, "//", (POLICY,))


def c_body(name: str, programs: list[Program]) -> str:
    """All of the ``.c`` below its header, a function of the programs alone: a reader checks a file against it."""
    used = {line.op for program in programs for line in program.lines}
    template = environment().get_template("module.c.jinja")
    return template.render(
        name=name,
        macros=[text for op, text in C_MACROS.items() if op in used],
        loads=_loads([argument.shape for program in programs for argument in program.arguments]),
        stores=_stores([result.shape for program in programs for result in program.results]),
        kernels=["\n".join(_wrapped([*kernel_text(program), "", *loop_text(program)])) for program in programs],
    )


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
    for real, suffix in (("double", "f64"), ("float", "f32")):
        texts.append(f"void {name}_{suffix}({', '.join(_parameters(kernel.program, real)[0])});")
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


def _parameters(program: Program, real: str) -> tuple[list[str], Names]:
    names = Names()
    texts = []
    for argument in program.arguments:
        if argument.shape:
            texts.append(f"const {real} *{names.fresh(argument.name)}")
        else:
            texts.append(f"{real} {names.define(argument.components[0])}")
    texts += [f"{real} *{names.fresh(result.name)}" for result in program.results]
    return texts, names


def kernel_text(program: Program) -> list[str]:
    """The plain function: inputs read, one statement for each line, outputs written."""
    parameters, names = _parameters(program, "REAL")
    pointers = [text.rsplit("*", 1)[-1] for text in parameters]
    lines = [f"INLINE void NAME({program.name})({', '.join(parameters)})", "{"]
    used = used_variables(program)
    for argument, pointer in zip(program.arguments, pointers, strict=False):
        if argument.shape:
            lines += [
                f"    const REAL {names.define(component)} = {pointer}[{k}];"
                for k, component in enumerate(argument.components)
                if component in used
            ]
            if not used.intersection(argument.components):
                lines.append(f"    (void){pointer};")
        elif argument.components[0] not in used:
            lines.append(f"    (void){names.c(argument.components[0])};")
    for line in program.lines:
        right = C[line.op].format(*map(names.c, line.operands))
        lines.append(f"    const REAL {names.define(line.target)} = {right};")
    for result, pointer in zip(program.results, pointers[len(program.arguments) :], strict=True):
        lines += [f"    {pointer}[{k}] = {names.c(operand)};" for k, operand in enumerate(result.operands)]
    return [*lines, "}"]


def used_variables(program: Program) -> frozenset[str]:
    """The variables that a line or a result reads."""
    operands = [operand for line in program.lines for operand in line.operands]
    operands += [operand for result in program.results for operand in result.operands]
    return frozenset(operand for operand in operands if isinstance(operand, str))


def loop_text(program: Program) -> list[str]:
    """The batch function, and the inlined loop that it is made of."""
    parts: list[Part] = [*program.arguments, *program.results]
    n_inputs = len(program.arguments)
    steps = [f"s{k}" for k in range(len(parts))]
    cores = [[f"c{k}{'abcdefgh'[axis]}" for axis in range(len(part.shape))] for k, part in enumerate(parts)]
    flat_cores = [name for core in cores for name in core]
    each = f"NAME({program.name}_each)"
    lines = [
        f"static INLINE void {each}(intptr_t n, char **args, "
        + ", ".join(f"intptr_t {name}" for name in [*steps, *flat_cores])
        + ")",
        "{",
    ]
    lines += [f"    char *a{k} = args[{k}];" for k in range(len(parts))]
    uniform = _uniform(program)
    loads = [
        f"NAME(load{_size(part.shape)})({', '.join([f'x{k}', f'a{k} + i * s{k}', *cores[k]])});"
        for k, part in enumerate(parts[:n_inputs])
    ]
    for k in uniform:
        lines += [f"    REAL x{k}[{prod(parts[k].shape)}];", f"    {loads[k].replace(f' + i * s{k}', '')}"]
    lines += ["    ANY_ORDER", "    for (intptr_t i = 0; i < n; ++i) {"]
    lines += [f"        REAL x{k}[{prod(part.shape)}];" for k, part in enumerate(parts) if k not in uniform]
    for k, load in enumerate(loads):
        lines += [f"        if (s{k} != 0)", f"            {load}"] if k in uniform else [f"        {load}"]
    call = [f"x{k}" if part.shape or k >= n_inputs else f"x{k}[0]" for k, part in enumerate(parts)]
    lines.append(f"        NAME({program.name})({', '.join(call)});")
    lines += [
        f"        NAME(store{_size(part.shape)})({', '.join([f'a{k} + i * s{k}', *cores[k], f'x{k}'])});"
        for k, part in enumerate(parts)
        if k >= n_inputs
    ]
    lines += ["    }", "}", ""]
    lines += [
        f"static void NAME({program.name}_any)(intptr_t n, char **args, const intptr_t *steps)",
        "{",
        f"    {each}(n, args, {', '.join(f'steps[{k}]' for k in range(len(steps) + len(flat_cores)))});",
        "}",
        "",
        f"WIDE void NAME({program.name}_loop)(char **args, const intptr_t *dimensions, const intptr_t *steps)",
        "{",
        "    const intptr_t n = dimensions[0], w = sizeof(REAL);",
        "    const intptr_t " + ", ".join(f"{name} = steps[{k}]" for k, name in enumerate([*steps, *flat_cores])) + ";",
        "    if (n < 1)",
        "        return;",
    ]
    branch = "if"
    for condition, arguments in _variants(program, steps, cores):
        lines += [f"    {branch} ({condition})", f"        {each}(n, args, {', '.join(arguments)});"]
        branch = "else if"
    lines += ["    else", f"        NAME({program.name}_any)(n, args, steps);", "}"]
    return lines


def _variants(program: Program, steps: list[str], cores: list[list[str]]) -> list[tuple[str, list[str]]]:
    """Condition on the strides, and the constants that then stand for them.

    Structure of arrays (each component contiguous over the batch) and C order (each element contiguous), with all
    arguments varying or some the same for the whole batch; their part of the work then leaves the loop.
    """
    parts: list[Part] = [*program.arguments, *program.results]
    large = len(program.lines) > _LARGE
    choices = list(dict.fromkeys([(), _uniform(program)]))
    variants = []
    flat_cores = [name for core in cores for name in core]
    for uniform in choices:
        widths = ["0" if k in uniform else "w" for k in range(len(parts))]
        condition = " && ".join(f"{step} == {width}" for step, width in zip(steps, widths, strict=True))
        variants.append((condition, [*widths, *flat_cores]))
    if large or all(prod(part.shape) == 1 for part in parts):
        return variants
    dense = [_dense(part.shape) for part in parts]
    flat_dense = [width for widths in dense for width in widths]
    same_core = [f"{core} == {width}" for core, width in zip(flat_cores, flat_dense, strict=True)]
    for uniform in choices:
        widths = ["0" if k in uniform else _times(prod(part.shape)) for k, part in enumerate(parts)]
        same_step = [f"{step} == {width}" for step, width in zip(steps, widths, strict=True)]
        variants.append((" && ".join([*same_step, *same_core]), [*widths, *flat_dense]))
    return variants


def _uniform(program: Program) -> tuple[int, ...]:
    """The arguments that have a variant of the loop in which they are the same for the whole batch.

    All scalars beside arrays, else the largest array: one motor for many points.
    """
    sizes = [prod(argument.shape) for argument in program.arguments]
    if len(sizes) < 2 or len(program.lines) > _LARGE:
        return ()
    scalars = tuple(k for k, argument in enumerate(program.arguments) if not argument.shape)
    return scalars if 0 < len(scalars) < len(sizes) else (sizes.index(max(sizes)),)


def _times(count: int) -> str:
    return "w" if count == 1 else f"{count} * w"


def _dense(shape: tuple[int, ...]) -> list[str]:
    return [_times(prod(shape[axis + 1 :])) for axis in range(len(shape))]


def _size(shape: tuple[int, ...]) -> str:
    return "_" + ("x".join(map(str, shape)) if shape else "scalar")


def _places(shape: tuple[int, ...]) -> list[str]:
    """The byte offset of every component, in C order."""
    offsets = [""]
    for axis, length in enumerate(shape):
        offsets = [f"{offset} + {k} * c{'abcdefgh'[axis]}" for offset in offsets for k in range(length)]
    return offsets


def _signature(shape: tuple[int, ...]) -> str:
    return "".join(f", intptr_t c{'abcdefgh'[axis]}" for axis in range(len(shape)))


def _loads(shapes: list[tuple[int, ...]]) -> list[dict[str, object]]:
    return [
        {
            "head": f"NAME(load{_size(shape)})(REAL *x, const char *a{_signature(shape)})",
            "lines": [f"x[{k}] = *(const REAL *)(a{offset});" for k, offset in enumerate(_places(shape))],
        }
        for shape in sorted(set(shapes))
    ]


def _stores(shapes: list[tuple[int, ...]]) -> list[dict[str, object]]:
    return [
        {
            "head": f"NAME(store{_size(shape)})(char *a{_signature(shape)}, const REAL *x)",
            "lines": [f"*(REAL *)(a{offset}) = x[{k}];" for k, offset in enumerate(_places(shape))],
        }
        for shape in sorted(set(shapes))
    ]
