"""The loops of a C file: a kernel over a batch of elements at any strides.

A loop loads the components of an element into local arrays, calls the plain function, which is inlined, and stores its
results; so an output may be an input, and the compiler may vectorise without knowing which arrays overlap. It is
compiled for structure-of-arrays (each component contiguous over the batch), once for each width of vectors that is
chosen from when it runs. For other strides the driver of
``batch.c.jinja``, which all kernels share, moves blocks of elements through buffers of that order; from C order (each
element contiguous) by functions for each size of element. That costs one store and one load for each number: what
computes little for each number has a second loop for C order, in which it stays in registers. Both come once more for
an argument that is the same for the whole batch, where that saves work.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from math import prod
from typing import Any

from ..ir.program import Argument, Program, Result
from ..ir.uniform import Uniform
from .c_functions import has_turns, is_transcendental
from .nesting import with_coefficients
from .printers import Names

LANES = 16
"""As in the template: blocks are padded to a multiple of this many elements, so that no loop needs a remainder."""

C_ENDINGS = ("_within", "_v3", "_loop", "_block", "_dense")
"""What the names of a kernel's C functions add to its own."""
FORM_PARTS = ("prepare", "apply", "start", "block", "dense")
"""What the names of a form's C functions have between the kernel's name and its arguments."""

C_HELPERS = re.compile(
    r"(load|store)_(scalar|rows|(span|tile)_\d+|\d+(x\d+)*)|spans|turn(_tiles|_all)?|(load|store)_(tile|few)|tile|half|four|eight"
    r"|(move|stream)_part|move_element|each|run_from|as_they_lie|batch|call_[anr]+"
    r"|bits_of|of_bits|chosen_by|quarters_of|(sin|cos)_of_rest|(sin|cos|exp|log|atan2|acos)_of"
    r"|(sin|cos|exp|log|atan|asin)_polynomial"
)
"""Functions and types that the kernels of a C file share."""

_DENSE_NUMBERS = 64
_DENSE_LINES = 40
_LINES_OF_NUMBER = 7
"""Kernels of at most so many numbers, and of so many operations or so many for each number, have a loop of their own
for C order. Others gain less from what they would add to the build."""

FLAGS = 32
"""As in the template: forms are chosen by what stays the same of so many arguments."""

FEW = 3
"""As in the template: what compilers turn well without tiles has at most so many numbers."""

_TILE_NUMBERS = 32
"""Elements of at most so many numbers have functions of their own between C order and rows."""


def tile_sizes(sizes: Sequence[int]) -> list[int]:
    """The sizes of parts, ascending, for which there are functions between C order and rows."""
    return sorted({1, *(size for size in sizes if size <= _TILE_NUMBERS)})


def parts(program: Program) -> list[Argument | Result]:
    """The arguments, then the results."""
    return [*program.arguments, *program.results]


def loop_text(program: Program, forms: Sequence[Uniform]) -> list[str]:
    """The batch function of a kernel, and the loops that it chooses from."""
    lines: list[str] = []
    tables = []
    for form in forms:
        if any(argument.name in form.same for argument in program.arguments[FLAGS:]):
            continue
        functions = [f"NAME({form_name(program, form, 'start')})", *_loops(program, form, lines)]
        lines += [*_start(program, form), ""]
        same = sum(1 << k for k, argument in enumerate(program.arguments) if argument.name in form.same)
        tables.append(f"{{{same}, {form.least(program)}, {', '.join(functions)}}}")
    loops = _loops(program, None, lines)
    described, first = [], 0
    for part in parts(program):
        shape = ", ".join(map(str, part.shape)) or "0"
        described.append(f"{{{prod(part.shape)}, {len(part.shape)}, {first}, {{{shape}}}}}")
        first += len(part.shape)
    body = [f"    static const struct part parts[] = {{{', '.join(described)}}};"]
    body += [f"    static const struct form forms[] = {{{', '.join(tables)}}};"] if tables else []
    repeats = has_turns(program) or any(has_turns(form.apply) for form in forms)
    counts = [len(program.arguments), len(described), len(tables), int(repeats), int(is_transcendental(program))]
    plain = [f"(any_function *)NAME({program.name})", f"NAME({_caller(program)})"]
    kernel = [*loops, *plain, *map(str, counts), "parts", "forms" if tables else "NULL"]
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
        replace(with_coefficients(form.apply), name=form_name(program, form, "apply")),
    )


def _loops(program: Program, form: Uniform | None, lines: list[str]) -> list[str]:
    """The loops over rows and in C order for each width, and how many elements the latter takes at a time.

    Their text is added to `lines`; there may be none for C order.
    """

    def added(order: str, loop: Callable[..., list[str]], compiled: str, named: str) -> str:
        own = form_name(program, form, order) if form else f"{program.name}_{order}"
        lines.extend([*loop(program, f"NAME({own})", form), f"{compiled}({own})", ""])
        return f"{named}({own})"

    block = added("block", _one_loop, "LOOPS", "WIDTHS")
    if not _has_dense(program, form):
        return [block, "{NULL}", "0"]
    if _is_direct(program, form):
        return [block, added("dense", _direct_loop, "LOOPS", "WIDTHS"), "LANES"]
    return [block, added("dense", _tile_loop, "LOOP", "WIDTH"), "TILE"]


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


def _one_loop(program: Program, name: str, form: Uniform | None) -> list[str]:
    """The loop over a block: of a form, with what is prepared in the place of the first argument it comes from."""
    same = _same(program, form)
    changing = [k for k in range(len(parts(program))) if k not in same]
    lines = [f"static INLINE void {name}(intptr_t n, char **args, const intptr_t *strides)", "{"]
    lines += ["    const intptr_t w = sizeof(REAL);", *_strides(program, changing), *_prepared(same)]
    lines += [f"    char *a{k} = args[{k}];" for k in changing]
    places = {k: f"a{k} + i * w" for k in changing}
    run, again = _elements(program, form, places, _cores(program), near=True), []
    if has_turns(_run(program, form)):
        again = _elements(program, form, places, _cores(program), near=False)
    if not again:
        inner = ["ANY_ORDER", "for (intptr_t i = 0; i < PADDED(n); ++i) {", *run]
        return [*lines, *(f"    {text}" for text in inner), "}"]
    inner = [
        "const intptr_t last = first + CHUNK < n ? first + CHUNK : PADDED(n);",
        "WORD far = 0;",
        "ANY_ORDER",
        "for (intptr_t i = first; i < last; ++i) {",
        *run,
        "for (intptr_t i = first; far && i < last; ++i) {",
        *again,
    ]
    head = "for (intptr_t first = 0; first < n; first += CHUNK) {"
    return [*lines, *(f"    {text}" for text in (head, *(f"    {text}" for text in inner), "}")), "}"]


def _tile_loop(program: Program, name: str, form: Uniform | None) -> list[str]:
    """The loop over elements in C order, which become tiles: vectors of as many elements as fill 32 bytes.

    The inner loop is one step of vectors, which stay in registers; wider ones would need more turns and gain nothing.
    """
    n_inputs, sizes = len(program.arguments), _changing(program, form)
    inner = [f"NAME(load_tile_{sizes[k]})(r{k}, TILE, a{k} + first * {sizes[k]});" for k in sizes if k < n_inputs]
    places = {k: f"(char *)(r{k} + i)" for k in sizes}
    cores = [_core_steps(part, "TILE * w") for part in parts(program)]
    inner += ["ANY_ORDER", "for (intptr_t i = 0; i < TILE; ++i) {"]
    inner += _elements(program, form, places, cores, near=True)
    inner += [f"NAME(store_tile_{sizes[k]})(a{k} + first * {sizes[k]}, r{k}, TILE);" for k in sizes if k >= n_inputs]
    return _in_order(name, "TILE", sizes, sizes, _same(program, form), inner)


def _direct_loop(program: Program, name: str, form: Uniform | None) -> list[str]:
    """The same where compilers turn elements as they read them; results go through rows of a few elements.

    Results of neighbours are never written side by side: compilers that make one vector of the sums and differences of
    an element may fuse them with products, whatever they are told of contraction (gcc 12 does).
    """
    n_inputs, sizes = len(program.arguments), _changing(program, form)
    rows = [k for k in sizes if k >= n_inputs]
    places = {
        k: f"(char *)(r{k} + i)" if k in rows else f"(char *)a{k} + (first + i) * {_times(sizes[k])}" for k in sizes
    }
    cores = [_core_steps(part, "LANES * w" if k in rows else "w") for k, part in enumerate(parts(program))]
    inner = ["ANY_ORDER", "for (intptr_t i = 0; i < LANES; ++i) {", *_elements(program, form, places, cores, near=True)]
    inner += [f"NAME(store_few)(a{k} + first * {sizes[k]}, r{k}, {sizes[k]}, LANES, LANES);" for k in rows]
    return _in_order(name, "LANES", sizes, rows, _same(program, form), inner)


def _in_order(
    name: str, length: str, sizes: Mapping[int, int], rows: Collection[int], same: Sequence[int], inner: Sequence[str]
) -> list[str]:
    """A loop over elements in C order, `length` at a time."""
    return [
        f"static INLINE void {name}(intptr_t n, char **args, const intptr_t *strides)",
        "{",
        "    const intptr_t w = sizeof(REAL);",
        *_prepared(same),
        "    (void)strides;",
        *(f"    REAL *a{k} = (REAL *)args[{k}];" for k in sizes),
        *(f"    _Alignas(64) REAL r{k}[{sizes[k]} * {length}];" for k in rows),
        f"    for (intptr_t first = 0; first < n; first += {length}) {{",
        *(f"        {text}" for text in inner),
        "    }",
        "}",
    ]


def _core_steps(part: Argument | Result, step: str) -> list[str]:
    """Strides within an element whose components are `step` apart, in C order."""
    return [_times(prod(part.shape[axis + 1 :]), step) for axis in range(len(part.shape))]


def _same(program: Program, form: Uniform | None) -> list[int]:
    """The arguments that a form has prepared."""
    return [k for k, argument in enumerate(program.arguments) if form and argument.name in form.same]


def _prepared(same: Sequence[int]) -> list[str]:
    return [f"    const REAL *prepared = (const REAL *)args[{same[0]}];"] if same else []


def _run(program: Program, form: Uniform | None) -> Program:
    """What a loop runs for each element."""
    return named_parts(program, form)[1] if form else program


def _elements(
    program: Program, form: Uniform | None, places: Mapping[int, str], cores: Sequence[Sequence[str]], *, near: bool
) -> list[str]:
    """The body of a loop: components from their places, the plain function, results to theirs.

    Of a function with sines, the one that only notes far angles, or the one that knows them.
    """
    n_inputs, run = len(program.arguments), _run(program, form)
    passed = ["prepared"] if form else []
    loads, stores, arrays = [], [], []
    for k, place in places.items():
        shape = parts(program)[k].shape
        arrays.append(f"REAL x{k}[{prod(shape)}];")
        passed.append(f"x{k}" if shape or k >= n_inputs else f"x{k}[0]")
        if k < n_inputs:
            loads.append(f"NAME(load{_size(shape)})({', '.join([f'x{k}', place, *cores[k]])});")
        else:
            stores.append(f"NAME(store{_size(shape)})({', '.join([place, *cores[k], f'x{k}'])});")
    name = f"{run.name}_within" if near and is_transcendental(run) and not form else run.name
    if has_turns(run) and near:
        passed.append("&far")
    elif has_turns(run) and form:
        passed.append("NULL")
    return [f"    {text}" for text in (*arrays, *loads, f"NAME({name})({', '.join(passed)});", *stores)] + ["}"]


def _changing(program: Program, form: Uniform | None) -> dict[int, int]:
    """The sizes of the parts that a loop reads and writes for each element."""
    same = _same(program, form)
    return {k: prod(part.shape) for k, part in enumerate(parts(program)) if k not in same}


def _has_dense(program: Program, form: Uniform | None) -> bool:
    run, counts = _run(program, form), _changing(program, form).values()
    few = sum(counts) <= _DENSE_NUMBERS and len(run.lines) <= max(_DENSE_LINES, _LINES_OF_NUMBER * sum(counts))
    return 1 < max(counts) <= _TILE_NUMBERS and few and not is_transcendental(run)


def _is_direct(program: Program, form: Uniform | None) -> bool:
    """Whether compilers read the elements as well as tiles do."""
    sizes = list(_changing(program, form).values())
    return set(sizes) <= {1, 2, 3, 4, 8} and max(sizes[-len(program.results) :]) <= FEW


def _times(count: int, step: str = "w") -> str:
    return step if count == 1 else f"{count} * {step}"


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


def _caller(program: Program) -> str:
    """The name of what calls a plain function: for an array, a number, a result."""
    inputs = "".join("a" if argument.shape else "n" for argument in program.arguments)
    return f"call_{inputs}{'r' * len(program.results)}"


def call_helpers(programs: Sequence[Program]) -> list[dict[str, Any]]:
    """Calls of plain functions through pointers of the right types, one for each that there is."""
    helpers: list[dict[str, Any]] = []
    types = {"a": "const REAL *", "n": "REAL", "r": "REAL *"}
    for name in sorted({_caller(program) for program in programs}):
        kinds = name.removeprefix("call_")
        passed = [f"*(REAL *)x[{k}]" if kind == "n" else f"x[{k}]" for k, kind in enumerate(kinds)]
        call = f"((void (*)({', '.join(types[kind] for kind in kinds)}))function)({', '.join(passed)});"
        helpers.append({"head": f"NAME({name})(any_function *function, void **x)", "lines": [call]})
    return helpers


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
