"""The loops of a C file: a kernel over a batch of elements at any strides.

A loop loads the components of an element into local arrays, calls the plain function, which is inlined, and stores its
results; so an output may be an input, and the compiler may vectorise without knowing which arrays overlap. It is
compiled for structure-of-arrays (each component contiguous over the batch). For other strides the driver of
``batch.c.jinja``, which all kernels share, moves blocks of elements through buffers of that order. That costs one store
and one load for each number: what computes little for each number has a second loop for C order (each element
contiguous). Both come once more for an argument that is the same for the whole batch, where that saves work.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from math import prod

from ..ir.program import Argument, Program, Result
from ..ir.uniform import Uniform
from .c_functions import has_turns, is_long
from .printers import Names

LANES = 16
"""As in the template: blocks are padded to a multiple of this many elements, so that no loop needs a remainder."""

C_ENDINGS = ("_within", "_loop", "_block", "_dense")
"""What the names of a kernel's C functions add to its own."""
FORM_PARTS = ("prepare", "apply", "start", "block", "dense")
"""What the names of a form's C functions have between the kernel's name and its arguments."""

C_HELPERS = re.compile(
    r"(load|store)_(scalar|rows|\d+(x\d+)*)|turn(_tiles|_all)?|(load|store)_tile|four|eight|move_part|batch"
    r"|bits_of|of_bits|chosen_by|quarters_of|(sin|cos)_of_rest|(sin|cos|exp|log|atan2|acos)_of"
    r"|(sin|cos|exp|log|atan|asin)_polynomial"
)
"""Functions and types that the kernels of a C file share."""

_DENSE_SIZES = frozenset({1, 2, 3, 4, 8})
"""Numbers in an element that compilers load and turn in registers."""

_DENSE_LINES = 64


def parts(program: Program) -> list[Argument | Result]:
    """The arguments, then the results."""
    return [*program.arguments, *program.results]


def loop_text(program: Program, forms: Sequence[Uniform]) -> list[str]:
    """The batch function of a kernel, and the loops that it chooses from."""
    lines: list[str] = []
    tables = []
    if forms:
        for form in forms:
            functions = [f"NAME({form_name(program, form, 'start')})", *_loops(program, form, lines)]
            lines += [*_start(program, form), ""]
            same = sum(1 << k for k, argument in enumerate(program.arguments) if argument.name in form.same)
            tables.append(f"{{{same}, {form.least(program)}, {', '.join(functions)}}}")
    block, dense = _loops(program, None, lines)
    described, first = [], 0
    for part in parts(program):
        shape = ", ".join(map(str, part.shape)) or "0"
        described.append(f"{{{prod(part.shape)}, {len(part.shape)}, {first}, {{{shape}}}}}")
        first += len(part.shape)
    body = [f"    static const struct part parts[] = {{{', '.join(described)}}};"]
    body += [f"    static const struct form forms[] = {{{', '.join(tables)}}};"] if tables else []
    repeats = has_turns(program) or any(has_turns(form.apply) for form in forms)
    counts = [len(program.arguments), len(described), len(tables), int(repeats)]
    kernel = [block, dense, *map(str, counts), "parts", "forms" if tables else "NULL"]
    return [
        *lines,
        f"void NAME({program.name}_loop)(char **args, const intptr_t *dimensions, const intptr_t *steps)",
        "{",
        *body,
        f"    static const struct kernel kernel = {{{', '.join(kernel)}}};",
        "    NAME(batch)(&kernel, args, dimensions[0], steps);",
        "}",
    ]


def form_name(program: Program, form: Uniform, what: str) -> str:
    """The name of a function that belongs to a form: ``move_point_block_m``.

    What stays the same is named as it is printed, or numbered where a name has an underscore: ``a_b`` would be one
    argument or two.
    """
    names = Names().parameters(program)
    if any("_" in name for name in names):
        names = list(map(str, range(len(names))))
    kept = [name for name, argument in zip(names, program.arguments, strict=True) if argument.name in form.same]
    return "_".join([program.name, what, *kept])


def named_parts(program: Program, form: Uniform) -> tuple[Program, Program]:
    """What a form prepares and what it applies, under the names of their functions."""
    return (
        replace(form.prepare, name=form_name(program, form, "prepare")),
        replace(form.apply, name=form_name(program, form, "apply")),
    )


def _loops(program: Program, form: Uniform | None, lines: list[str]) -> list[str]:
    """The names of the loops over rows and in C order, whose text is added to `lines`; NULL where there is none."""
    names = []
    for order in ("block", "dense"):
        if order == "dense" and not _has_dense(program, form):
            names.append("NULL")
            continue
        own = form_name(program, form, order) if form else f"{program.name}_{order}"
        names.append(f"NAME({own})")
        lines += [*_one_loop(program, names[-1], order == "dense", form), ""]
    return names


def _cores(program: Program) -> list[list[str]]:
    """Names of the strides within an element, for each part."""
    return [[f"c{k}{'abcdefgh'[axis]}" for axis in range(len(part.shape))] for k, part in enumerate(parts(program))]


def _strides(program: Program, used: Sequence[int]) -> list[str]:
    """The line that gives strides their names, for the parts that are used."""
    named, first = [], 0
    for k, names in enumerate(_cores(program)):
        named += [f"{name} = strides[{first + axis}]" for axis, name in enumerate(names) if k in used]
        first += len(names)
    return [f"    const intptr_t {', '.join(named)};"] if named else ["    (void)strides;"]


def _start(program: Program, form: Uniform) -> list[str]:
    """What prepares a form, from the arguments that are the same for the whole batch."""
    used = [k for k, argument in enumerate(program.arguments) if argument.name in form.same]
    lines = [
        f"static void NAME({form_name(program, form, 'start')})(char **args, const intptr_t *strides, void *prepared)",
        "{",
        *_strides(program, used),
    ]
    cores, inputs = _cores(program), []
    for k in used:
        shape = program.arguments[k].shape
        lines.append(f"    REAL x{k}[{prod(shape)}];")
        lines.append(f"    NAME(load{_size(shape)})({', '.join([f'x{k}', f'args[{k}]', *cores[k]])});")
        inputs.append(f"x{k}" if shape else f"x{k}[0]")
    passed = [*inputs, "prepared", *(["NULL"] if has_turns(form.prepare) else [])]
    return [*lines, f"    NAME({form_name(program, form, 'prepare')})({', '.join(passed)});", "}"]


def _one_loop(program: Program, name: str, dense: bool, form: Uniform | None) -> list[str]:
    """The loop over a block: of a form, with what is prepared in the place of the first argument it comes from."""
    n_inputs = len(program.arguments)
    same = [k for k, argument in enumerate(program.arguments) if form and argument.name in form.same]
    changing = [k for k in range(len(parts(program))) if k not in same]
    cores = _cores(program)
    lines = [f"WIDE static void {name}(intptr_t n, char **args, const intptr_t *strides)", "{"]
    lines.append("    const intptr_t w = sizeof(REAL);")
    if dense:
        cores = [_dense(part.shape) for part in parts(program)]
        lines.append("    (void)strides;")
    else:
        lines += _strides(program, changing)
    lines += [f"    const REAL *prepared = (const REAL *)args[{same[0]}];"] if same else []
    lines += [f"    char *a{k} = args[{k}];" for k in changing]
    loads, stores = [], []
    for k in changing:
        shape = parts(program)[k].shape
        place = f"a{k} + i * {_times(prod(shape) if dense else 1)}"
        if k < n_inputs:
            loads.append(f"NAME(load{_size(shape)})({', '.join([f'x{k}', place, *cores[k]])});")
        else:
            stores.append(f"NAME(store{_size(shape)})({', '.join([place, *cores[k], f'x{k}'])});")
    run = named_parts(program, form)[1] if form else program
    passed = ["prepared"] if same else []
    passed += [f"x{k}" if parts(program)[k].shape or k >= n_inputs else f"x{k}[0]" for k in changing]
    arrays = [f"REAL x{k}[{prod(parts(program)[k].shape)}];" for k in changing]

    def each(name: str, passed: list[str]) -> list[str]:
        return [f"    {text}" for text in (*arrays, *loads, f"NAME({name})({', '.join(passed)});", *stores)] + ["}"]

    if not has_turns(run):
        inner = ["ANY_ORDER", "for (intptr_t i = 0; i < PADDED(n); ++i) {", *each(run.name, passed)]
        return [*lines, *(f"    {text}" for text in inner), "}"]
    near, again = (run.name, run.name) if form else (f"{run.name}_within", run.name)
    inner = [
        "const intptr_t last = first + CHUNK < n ? first + CHUNK : PADDED(n);",
        "WORD far = 0;",
        "ANY_ORDER",
        "for (intptr_t i = first; i < last; ++i) {",
        *each(near, [*passed, "&far"]),
        "for (intptr_t i = first; far && i < last; ++i) {",
        *each(again, [*passed, "NULL"] if form else passed),
    ]
    head = "for (intptr_t first = 0; first < n; first += CHUNK) {"
    return [*lines, *(f"    {text}" for text in (head, *(f"    {text}" for text in inner), "}")), "}"]


def _has_dense(program: Program, form: Uniform | None) -> bool:
    run = form.apply if form else program
    sizes = {prod(part.shape) for part in (run.arguments[1:] if form else run.arguments)}
    sizes |= {prod(result.shape) for result in run.results}
    return sizes <= _DENSE_SIZES and sizes != {1} and len(run.lines) <= _DENSE_LINES and not is_long(run)


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


def load_helpers(shapes: list[tuple[int, ...]]) -> list[dict[str, object]]:
    """Functions that gather the components of an element, one for each shape of input."""
    return [
        {
            "head": f"NAME(load{_size(shape)})(REAL *x, const char *a{_signature(shape)})",
            "lines": [f"x[{k}] = *(const REAL *)(a{offset});" for k, offset in enumerate(_places(shape))],
        }
        for shape in sorted(set(shapes))
    ]


def store_helpers(shapes: list[tuple[int, ...]]) -> list[dict[str, object]]:
    """Functions that scatter the components of an element, one for each shape of result."""
    return [
        {
            "head": f"NAME(store{_size(shape)})(char *a{_signature(shape)}, const REAL *x)",
            "lines": [f"*(REAL *)(a{offset}) = x[{k}];" for k, offset in enumerate(_places(shape))],
        }
        for shape in sorted(set(shapes))
    ]
