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
from math import prod

from ..ir.program import Argument, Program, Result
from ..ir.scalar import Op

LANES = 16
"""As in the template: blocks are padded to a multiple of this many elements, so that no loop needs a remainder."""

C_ENDINGS = ("_loop", "_block", "_block_uniform", "_dense", "_dense_uniform")
"""What the names of a kernel's C functions add to its own."""

C_HELPERS = re.compile(r"(load|store)_(scalar|rows|\d+(x\d+)*)|turn_[48]x4|four|eight|move_part|batch")
"""Functions and types that the kernels of a C file share."""

_OPAQUE = frozenset({Op.SIN, Op.COS, Op.ATAN2, Op.ACOS, Op.EXP, Op.LOG})
"""Calls into the mathematical library, which keep a loop from being vectorised."""

_DENSE_SIZES = frozenset({1, 2, 3, 4, 8})
"""Numbers in an element that compilers load and turn in registers."""

_DENSE_LINES = 64

_UNIFORM_LINES = 128


def parts(program: Program) -> list[Argument | Result]:
    """The arguments, then the results."""
    return [*program.arguments, *program.results]


def loop_text(program: Program) -> list[str]:
    """The batch function of a kernel, and the loops that it chooses from."""
    uniform = _uniform(program)
    lines: list[str] = []
    functions = []
    for order in ("block", "dense"):
        for same, ending in (((), ""), (uniform, "_uniform")):
            if (order == "dense" and not _has_dense(program)) or (ending and not same):
                functions.append("NULL")
                continue
            functions.append(f"NAME({program.name}_{order}{ending})")
            lines += [*_one_loop(program, functions[-1], order == "dense", same), ""]
    described, first = [], 0
    for part in parts(program):
        shape = ", ".join(map(str, part.shape)) or "0"
        described.append(f"{{{prod(part.shape)}, {len(part.shape)}, {first}, {{{shape}}}}}")
        first += len(part.shape)
    hoisted = sum(1 << k for k in uniform)
    return [
        *lines,
        f"void NAME({program.name}_loop)(char **args, const intptr_t *dimensions, const intptr_t *steps)",
        "{",
        f"    static const struct part parts[] = {{{', '.join(described)}}};",
        f"    static const struct kernel kernel = {{{{{', '.join(functions)}}}, {hoisted}, {len(program.arguments)}, "
        f"{len(parts(program))}, parts}};",
        "    NAME(batch)(&kernel, args, dimensions[0], steps);",
        "}",
    ]


def _one_loop(program: Program, name: str, dense: bool, uniform: tuple[int, ...]) -> list[str]:
    """The loop over a block, with the `uniform` arguments loaded before it."""
    n_inputs = len(program.arguments)
    cores = [[f"c{k}{'abcdefgh'[axis]}" for axis in range(len(part.shape))] for k, part in enumerate(parts(program))]
    flat_cores = [name for names in cores for name in names]
    lines = [
        f"WIDE static void {name}(intptr_t n, char **args, const intptr_t *strides)",
        "{",
        "    const intptr_t w = sizeof(REAL);",
    ]
    if dense or not flat_cores:
        cores = [_dense(part.shape) for part in parts(program)]
        lines.append("    (void)strides;")
    else:
        assigned = ", ".join(f"{name} = strides[{k}]" for k, name in enumerate(flat_cores))
        lines.append(f"    const intptr_t {assigned};")
    arrays = [f"REAL x{k}[{prod(part.shape)}];" for k, part in enumerate(parts(program))]
    lines += [f"    char *a{k} = args[{k}];" for k in range(len(arrays))]
    moves = []
    for k, part in enumerate(parts(program)):
        place = f"a{k}" if k in uniform else f"a{k} + i * {_times(prod(part.shape) if dense else 1)}"
        if k < n_inputs:
            moves.append(f"NAME(load{_size(part.shape)})({', '.join([f'x{k}', place, *cores[k]])});")
        else:
            moves.append(f"NAME(store{_size(part.shape)})({', '.join([place, *cores[k], f'x{k}'])});")
    for k in uniform:
        lines += [f"    {arrays[k]}", f"    {moves[k]}"]
    end = "n" if _is_opaque(program) else "PADDED(n)"
    lines += ["    ANY_ORDER", f"    for (intptr_t i = 0; i < {end}; ++i) {{"]
    lines += [f"        {array}" for k, array in enumerate(arrays) if k not in uniform]
    lines += [f"        {moves[k]}" for k in range(n_inputs) if k not in uniform]
    call = [f"x{k}" if part.shape or k >= n_inputs else f"x{k}[0]" for k, part in enumerate(parts(program))]
    lines.append(f"        NAME({program.name})({', '.join(call)});")
    return [*lines, *(f"        {move}" for move in moves[n_inputs:]), "    }", "}"]


def _is_opaque(program: Program) -> bool:
    return any(line.op in _OPAQUE for line in program.lines)


def _has_dense(program: Program) -> bool:
    sizes = {prod(part.shape) for part in parts(program)}
    return sizes <= _DENSE_SIZES and sizes != {1} and len(program.lines) <= _DENSE_LINES and not _is_opaque(program)


def _uniform(program: Program) -> tuple[int, ...]:
    """The arguments that have a loop in which they are the same for the whole batch.

    All scalars beside arrays, else the largest array: one motor for many points. Small programs gain from the registers
    alone, large ones if a part of the work leaves the loop.
    """
    sizes = [prod(argument.shape) for argument in program.arguments]
    if len(sizes) < 2:
        return ()
    scalars = tuple(k for k, argument in enumerate(program.arguments) if not argument.shape)
    same = scalars if 0 < len(scalars) < len(sizes) else (sizes.index(max(sizes)),)
    known = {component for k in same for component in program.arguments[k].components}
    for line in program.lines:
        if all(not isinstance(operand, str) or operand in known for operand in line.operands):
            known.add(line.target)
    hoisted = sum(line.target in known for line in program.lines)
    return same if len(program.lines) <= _UNIFORM_LINES or 10 * hoisted >= len(program.lines) else ()


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
