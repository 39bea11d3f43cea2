"""Print modules as C17: a ``.c`` with each kernel written once for both precisions, and a ``.h`` for C programs.

Every kernel is a plain function on contiguous components, and a loop over a batch with the calling convention of
numpy's generalised ufuncs (see `gacompiler.backends.c_batch`).
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import jinja2

from ..errors import BackendError
from ..gac_runtime.definition import INTERFACE
from ..ir.procedure import Procedure
from ..ir.program import Program
from ..ir.reserved import LIKE_A_MACRO
from ..ir.uniform import Uniform
from .c_batch import FEW, TILES, helper_lines, loop_text, named_parts, span_lines, tile_line, usable_forms
from .c_loops import (
    c_parameters,
    driver_line,
    lane_lines,
    lane_sizes,
    list_lines,
    loop_parts,
    part_lines,
    plain_lines,
    work_lines,
    work_prototype,
)
from .c_vectors import HELPERS as VECTOR_HELPERS
from .c_vectors import vector_loops
from .c_windows import HELPERS, needed_by
from .documentation import c_comment, c_loop_comment, stamp
from .module import KernelSource, ModuleSource
from .nesting import Nested, expression, nested
from .printers import C
from .shared_parts import with_shared_parts
from .transcendental import has_trigonometric, is_transcendental

POLICY = "contraction: -ffp-contract=off (every operation is rounded once)"

_WIDTH = 116
_KEPT = "\0"
"""Placeholder for a space at which a line is not broken."""

RUNTIME = "gac_runtime"
"""The folder of the runtime, next to the modules."""

RUNTIME_INTERFACE = INTERFACE
"""The version of the runtime's interface that modules are written for, as in ``gac_runtime.h``."""


@cache
def environment() -> jinja2.Environment:
    """Return the environment of the templates, which only contain loops over prepared lines."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent / "templates"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )


def c_source(module: ModuleSource) -> str:
    """Print the ``.c`` file of a module.

    Parameters
    ----------
    module : ModuleSource

    Returns
    -------
    str
        C17 text that needs only ``<math.h>``, the runtime, and the header of `c_header` in the same folder.
    """
    module = with_shared_parts(module)
    kernels = [(kernel.program, kernel.uniform) for kernel in module.kernels]
    body = c_body(module.name, kernels, [loop.procedure for loop in module.loops])
    return stamp(body, module, "//", (POLICY,))


def c_body(
    name: str, kernels: Sequence[tuple[Program, tuple[Uniform, ...]]], procedures: Sequence[Procedure] = ()
) -> str:
    """Print the ``.c`` file without its header, as a function of the programs only, so that readers can compare."""
    template = environment().get_template("module.c.jinja")
    return template.render(
        name=name,
        runtime=RUNTIME,
        interface=RUNTIME_INTERFACE,
        **_rendered(name, kernels, procedures),
    )


def standalone_c_source(module: ModuleSource) -> str:
    """Print the ``.c`` file of a module that includes the runtime and needs only the header of `c_header`."""
    shared = _runtime_parts("gac_runtime.h", "#define GAC_RUNTIME_H")
    driver = _runtime_parts("gac_runtime.c", "#include")
    module = with_shared_parts(module)
    kernels = [(kernel.program, kernel.uniform) for kernel in module.kernels]
    template = environment().get_template("standalone.c.jinja")
    rendered = _rendered(module.name, kernels, [loop.procedure for loop in module.loops])
    # The driver defines these itself.
    tiles = {tile_line(size) for size in range(FEW + 1, TILES + 1)}
    rendered["helpers"] = [line for line in rendered["helpers"] if line not in tiles]
    body = template.render(
        name=module.name,
        prototypes=[line for each in _described(module) for line in each["prototypes"]],
        shared=shared[0],
        shared_of_each=shared[1],
        sizes=span_lines([program for program, _ in kernels]),
        driver=driver[0],
        driver_of_each=driver[1],
        **rendered,
    )
    return stamp(body, module, "//", (POLICY,))


def _runtime_parts(name: str, start: str) -> tuple[str, str]:
    """Return the parts of a runtime file, after the line that begins with `start`, for both and for each precision."""
    text = (Path(__file__).parents[1] / RUNTIME / name).read_text(encoding="utf-8")
    once = re.split(rf"^{start}.*\n", text, maxsplit=1, flags=re.MULTILINE)[1]
    for_both, mark, rest = once.partition(" Both precisions.")
    _, other_mark, for_each = rest.partition(" For each precision.")
    assert mark and other_mark
    for_each = for_each.partition("\n")[2].strip().removesuffix("#endif")
    return for_both.rpartition("\n")[0].strip(), for_each.strip()


def _rendered(
    module: str, kernels: Sequence[tuple[Program, tuple[Uniform, ...]]], procedures: Sequence[Procedure]
) -> dict[str, list[str]]:
    """Return the text for each precision, which is common to both kinds of files."""
    programs = [program for program, _ in kernels]
    names = [*(program.name for program in programs), *(procedure.name for procedure in procedures)]
    row_sizes = set().union(*map(lane_sizes, procedures))
    forms = [(program, form) for program, uniform in kernels for form in usable_forms(program, uniform)]
    parts, lanes = _parts_of(procedures)
    in_vectors = [VECTOR_HELPERS.strip()] if any(map(vector_loops, procedures)) else []
    return {
        # A kernel may have the name of a macro of C headers that the runtime does not use, such as FLT_MAX.
        "hidden": [name for name in names if LIKE_A_MACRO.fullmatch(name)],
        "helpers": [*needed_by(procedures, HELPERS), *in_vectors, *helper_lines(programs, forms, row_sizes)],
        "kernels": ["\n".join(_kernel_and_loops(program, uniform)) for program, uniform in kernels]
        + ["\n".join(_procedure_lines(module, procedure, own, lanes)) for procedure, own in parts],
    }


def _parts_of(
    procedures: Sequence[Procedure],
) -> tuple[list[tuple[Procedure, list[Program]]], dict[str, list[str]]]:
    """Return the parts that are printed before each kernel with loops, the first that calls them, and their lanes."""
    printed: dict[str, Program] = {}
    lanes: dict[str, list[str]] = {}
    found = []
    for procedure in procedures:
        own = [part for part in loop_parts(procedure) if part.name not in printed]
        found.append((procedure, own))
        printed |= {part.name: part for part in own}
        loops = part_lines(procedure)
        for part in loop_parts(procedure):
            lines = loops.get(part.name)
            if printed[part.name] != part or (lines and lanes.setdefault(part.name, lines) != lines):
                raise BackendError(f"C text of {procedure.name}", f"another part {part.name}", "the same part")
    return found, lanes


def _procedure_lines(
    module: str, procedure: Procedure, parts: Sequence[Program], lanes: Mapping[str, list[str]]
) -> list[str]:
    """Print a kernel with loops: its tables, straight-line parts, loops over lanes, and its batch function."""
    lines = [piece for line in list_lines(procedure) for piece in _list(line)]
    for part in parts:
        lines += ["", *wrapped(kernel_text(part, "static INLINE"))]
        lines += [piece for line in lanes.get(part.name, []) for piece in _list(line)]
    lines += ["", "#if PRECISION(1, 0)", *wrapped(work_lines(module, procedure)), "#endif"]
    for text in (plain_lines(procedure), lane_lines(procedure)):
        lines += ["", *(piece for line in text for piece in _wrapped_between(_arguments(line), line))] if text else []
    return [*lines, "", driver_line(procedure)]


def _kernel_and_loops(program: Program, uniform: tuple[Uniform, ...]) -> list[str]:
    lines = wrapped(kernel_text(program))
    for form in uniform:
        for part in named_parts(program, form):
            lines += ["", *wrapped(kernel_text(part, "static INLINE"))]
    return [*lines, "", *(piece for line in loop_text(program, uniform) for piece in _macro(line))]


def _list(line: str) -> list[str]:
    """Wrap a line that defines a list, without breaking its entries."""
    lines = _wrapped_between(re.split(r" (?=AND |WORK\()", line.lstrip()), line)
    return [f"{text} \\" if text is not lines[-1] else text for text in lines]


def _wrapped_between(parts: Sequence[str], line: str) -> list[str]:
    """Wrap a line of C between its parts; parts that are longer than a line are wrapped at any space."""
    indent = " " * (len(line) - len(line.lstrip()))
    most = _WIDTH - len(indent) - len("    ")
    text = indent + " ".join(part.replace(" ", _KEPT) if len(part) <= most else part for part in parts)
    return [piece.replace(_KEPT, " ") for piece in wrapped([text])]


def _arguments(line: str) -> list[str]:
    """Split a line after the commas that are within no more than one pair of parentheses."""
    parts, depth = [""], 0
    for piece in re.split(r"(?<=,) |(?=[()])", line.lstrip()):
        depth += piece.startswith("(") - piece.startswith(")")
        parts[-1] += piece
        if piece.endswith(",") and depth <= 1:
            parts.append("")
        elif piece.endswith(","):
            parts[-1] += " "
    return parts


def _macro(line: str) -> list[str]:
    """Wrap a line that instantiates or defines a macro."""
    lines = wrapped([line])
    is_defined = line.startswith("#")
    return [f"{text} \\" if is_defined and text is not lines[-1] else text for text in lines]


def c_header(module: ModuleSource) -> str:
    """Print the ``.h`` file of a module: prototypes in both precisions, with layouts and operation counts."""
    summary = [line.rstrip() for line in module.summary.strip().splitlines()]
    text = (
        environment()
        .get_template("module.h.jinja")
        .render(name=module.name, summary=summary, kernels=_described(module), has_loops=bool(module.loops))
    )
    return stamp(text, module, "//", (POLICY,))


def _described(module: ModuleSource) -> list[dict[str, Any]]:
    """Return the comment and the prototypes of every kernel."""
    found: list[dict[str, Any]] = [
        {"comment": c_comment(kernel), "prototypes": _prototypes(module.name, kernel)} for kernel in module.kernels
    ]
    return found + [
        {"comment": c_loop_comment(loop), "prototypes": _loop_prototypes(module.name, loop.procedure)}
        for loop in module.loops
    ]


def _loop_prototypes(module: str, procedure: Procedure) -> list[str]:
    name, texts = f"{module}_{procedure.name}", _element_loop_prototypes(module, procedure)
    batch = "(const intptr_t *lengths, char **args, const intptr_t *steps, intptr_t count);"
    texts += [f"int {name}_rows_{suffix}{batch}" for suffix in ("f64", "f32")]
    return wrapped(texts)


def _prototypes(module: str, kernel: KernelSource) -> list[str]:
    name, texts = f"{module}_{kernel.program.name}", _element_prototypes(module, kernel.program)
    loop = "(char **args, const intptr_t *dimensions, const intptr_t *steps);"
    texts += [f"void {name}_loop_{suffix}{loop}" for suffix in ("f64", "f32")]
    return wrapped(texts)


def element_prototypes(module: ModuleSource) -> tuple[list[str], list[str]]:
    """Return the prototypes of the functions of single elements that are compiled for doubles, and for floats."""
    found = [_element_prototypes(module.name, kernel.program) for kernel in module.kernels]
    found += [_element_loop_prototypes(module.name, loop.procedure) for loop in module.loops]
    doubles = [text for of_double, _, *of_both in found for text in (of_double, *of_both)]
    return doubles, [of_float for _, of_float, *_ in found]


def _element_loop_prototypes(module: str, procedure: Procedure) -> list[str]:
    """Return the prototypes for doubles, for floats, and of the size of the work space."""
    texts = [
        f"void {module}_{procedure.name}_{suffix}({', '.join(c_parameters(procedure, real))});"
        for real, suffix in (("double", "f64"), ("float", "f32"))
    ]
    return [*texts, f"{work_prototype(module, procedure)};"]


def _element_prototypes(module: str, program: Program) -> list[str]:
    """Return the prototypes for doubles and for floats."""
    text = nested(program)
    return [
        f"void {module}_{program.name}_{suffix}({', '.join(_parameters(program, text, real))});"
        for real, suffix in (("double", "f64"), ("float", "f32"))
    ]


def wrapped(lines: list[str]) -> list[str]:
    """Wrap long lines of C."""
    found = []
    for line in lines:
        indent = " " * (len(line) - len(line.lstrip()))
        found += textwrap.wrap(
            line.strip(),
            _WIDTH,
            initial_indent=indent,
            subsequent_indent=f"{indent}    ",
            break_long_words=False,
            break_on_hyphens=False,
        ) or [""]
    return found


def _parameters(program: Program, text: Nested, real: str) -> list[str]:
    """Return the parameters of a plain function: numbers, and pointers to arguments and results."""
    inputs = zip(program.arguments, text.parameters, strict=True)
    texts = [f"const {real} *{name}" if argument.shape else f"{real} {name}" for argument, name in inputs]
    return texts + [f"{real} *{name}" for name in text.outputs]


def kernel_text(program: Program, storage: str = "INLINE") -> list[str]:
    """Print the plain function of a program: it reads the inputs, executes the statements and writes the outputs.

    If the program computes transcendental functions, the body is a separate function, which loops call. For sines and
    cosines, this function has a parameter that reports arguments too large for a vectorised loop.
    """
    text = nested(program)
    parameters = _parameters(program, text, "REAL")
    passed = [*text.parameters, *text.outputs]
    name, given, after = program.name, parameters, []
    if has_trigonometric(program):
        given = [*parameters, "WORD *far"]
    if is_transcendental(program) and storage == "INLINE":
        head, own, inner = map(", ".join, (parameters, passed, [*passed, *["NULL"] * has_trigonometric(program)]))
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
    """Define constants, with as many on a line as fit."""
    lines = [f"    const REAL {texts[0]}"]
    for text in texts[1:]:
        if len(f"{lines[-1]}, {text};") > _WIDTH:
            lines[-1] += ","
            lines.append(f"        {text}")
        else:
            lines[-1] += f", {text}"
    lines[-1] += ";"
    return lines
