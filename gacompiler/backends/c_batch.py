"""Print the loops over batches of a C file: lines that instantiate the macros of ``gac_runtime.h`` for a kernel.

A loop loads the components of an element into local arrays, calls the plain function, which is inlined, and stores the
results. Therefore an output may be the same array as an input, and the compiler can vectorise without alias analysis.
The loop is compiled for structures of arrays (each component contiguous over the batch), once for each vector width,
and the version is selected at run time.

For other strides, the driver in ``gac_runtime.c``, which all kernels share, copies blocks of elements through buffers
in this order. Arrays in C order (each element contiguous) are copied by functions for each element size. This costs one
store and one load for each number. A kernel with few operations for each number has a second loop for C order, which
keeps the numbers in registers. Both loops have variants for arguments that are the same for the whole batch, where this
saves work.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from math import prod

from ..errors import BackendError
from ..ir.program import Argument, Program, Result
from ..ir.uniform import Uniform
from .nesting import with_coefficients
from .printers import Names
from .transcendental import has_trigonometric, is_transcendental

C_ENDINGS = ("_within", "_v3", "_loop", "_block", "_dense", "_call")
"""Suffixes of the names of a kernel's C functions."""
FORM_PARTS = ("prepare", "apply", "start", "block", "dense")
"""Parts of the names of a uniform variant's C functions, between the name of the kernel and its arguments."""

_DENSE_NUMBERS = 64
_DENSE_LINES = 40
_LINES_OF_NUMBER = 7
"""Limits for a separate loop for C order: the count of numbers, and the count of operations in total or for each
number. For larger kernels the gain does not justify the longer build."""

FLAGS = 32
"""``GAC_FLAGS`` of the runtime: the number of arguments among which uniform variants are selected."""

FEW = 3
"""The largest element size in numbers that compilers transpose efficiently without tiles."""

TILES = 32
"""``GAC_TILE_NUMBERS`` of the runtime: the largest element size in numbers for which tiles are used."""

MOST_AXES = 5
"""``GAC_MOST_AXES`` of the runtime."""

_MOST_REPEATED = 1024
"""The longest axis for which the runtime can unroll loads."""

Shape = tuple[int, ...]


def parts(program: Program) -> list[Argument | Result]:
    """Return the arguments followed by the results."""
    return [*program.arguments, *program.results]


def loop_text(program: Program, forms: Sequence[Uniform]) -> list[str]:
    """Return the lines that define the loops of a kernel and the function that applies it to a batch."""
    name, everything = program.name, range(len(parts(program)))
    lines = [f"#define PARTS_{name}(IN, NUMBER, OUT, AND) {_listed(program, everything)}"]
    uses = []
    for form in usable_forms(program, forms):
        same = _same(program, form)
        label, kind, dense = _label(program, form.same), _kind_of_form(form.apply), _dense(program, form)
        changing = [k for k in everything if k not in same]
        lines += [
            f"#define PARTS_{name}_{label}(IN, NUMBER, OUT, AND) {_listed(program, changing)}",
            f"#define SAME_{name}_{label}(IN, NUMBER, OUT, AND) {_listed(program, same)}",
            f"GAC_FORM({name}, {label}, {same[0]}, {_kind_of_form(form.prepare)}, {kind}, {dense})",
        ]
        n_prepared = form.apply.arguments[0].shape[0]
        bits = sum(1 << k for k in same)
        uses.append(f"GAC_USE({name}, {label}, {dense}, {bits}, {form.least(program)}, {n_prepared})")
    kernel = f"{name}, {_kind(program)}, {_dense(program, None)}"
    last = f"GAC_KERNEL_AND_FORMS({kernel}, {', '.join(uses)})" if uses else f"GAC_KERNEL({kernel})"
    return [*lines, last]


def usable_forms(program: Program, forms: Sequence[Uniform]) -> list[Uniform]:
    """Return the uniform variants that the driver can select: their arguments are among the first `FLAGS`."""
    late = {argument.name for argument in program.arguments[FLAGS:]}
    return [form for form in forms if not late.intersection(form.same)]


def helper_lines(
    programs: Sequence[Program], forms: Sequence[tuple[Program, Uniform]], row_sizes: Collection[int] = ()
) -> list[str]:
    """Return the lines that define loads and stores for every element shape, and tiles for the sizes that loops use.

    The order is fixed. Rows of tables of kernels with loops are elements too.
    """
    shapes = {part.shape for program in programs for part in parts(program)} | {(size,) for size in row_sizes}
    sizes: set[int] = set()
    for program, form in [*((program, None) for program in programs), *forms]:
        dense = _dense(program, form)
        if dense != "NO":
            shapes |= {(size,) for size in _sizes(program, form)}
        if dense == "TILES":
            sizes |= set(_sizes(program, form))
    needed = {inner for shape in shapes for inner in _inner_shapes(shape)}
    lines = [_axes(shape) for shape in sorted(needed, key=lambda shape: (len(shape), shape))]
    return [*lines, *map(tile_line, sorted(sizes))]


def tile_line(size: int) -> str:
    """Return the line that defines the functions for tiles of a size."""
    return f"GAC_TILE({size})"


def span_lines(programs: Sequence[Program]) -> list[str]:
    """Return the lines that define the sizes of elements for which the runtime has functions of their own."""
    sizes = {prod(part.shape) for program in programs for part in parts(program)}
    lists = (("FEW", range(1, FEW + 1)), ("MANY", range(FEW + 1, TILES + 1)))
    return [" ".join([f"#define {name}_SPANS(M)", *(f"M({k})" for k in some if k in sizes)]) for name, some in lists]


def _inner_shapes(shape: Shape) -> Iterator[Shape]:
    """Yield a shape and the shapes of its rows."""
    if len(shape) > MOST_AXES:
        raise BackendError("C backend", f"{len(shape)} axes", f"at most {MOST_AXES} axes of a part")
    if max(shape, default=1) > _MOST_REPEATED:
        raise BackendError("C backend", f"an axis of {max(shape)} numbers", f"at most {_MOST_REPEATED} along an axis")
    for axis in range(len(shape)):
        yield shape[axis:]


def _axes(shape: Shape) -> str:
    """Return the line that defines the functions for a shape."""
    power = 1 << (shape[0] - 1).bit_length()
    if len(shape) == 1:
        return f"GAC_AXIS({shape[0]}, {power})"
    return f"GAC_AXES({_shape(shape)}, {shape[0]}, {power}, {_shape(shape[1:])}, {prod(shape[1:])})"


def _shape(shape: Shape) -> str:
    return "x".join(map(str, shape)) if shape else "scalar"


def _listed(program: Program, chosen: Collection[int]) -> str:
    """List arguments and results: their positions, the positions of their first strides, and their shapes."""
    listed, first = [], 0
    for k, part in enumerate(parts(program)):
        lengths = ", ".join(map(str, part.shape)) or "0"
        described = f"{k}, {first}, {_shape(part.shape)}, {prod(part.shape)}, {len(part.shape)}, {lengths}"
        if k in chosen and k >= len(program.arguments):
            listed.append(f"OUT({described})")
        elif k in chosen:
            listed.append(f"IN({described})" if part.shape else f"NUMBER({k}, {first})")
        first += len(part.shape)
    return " AND ".join(listed)


def form_name(program: Program, same: Collection[str], what: str) -> str:
    """Return the name of a function of the uniform variant for some arguments: ``move_point_block_m``."""
    return f"{program.name}_{what}_{_label(program, same)}"


def _label(program: Program, same: Collection[str]) -> str:
    """Return a label of the uniform arguments: their printed names, or their numbers if a name contains an underscore.

    Otherwise ``a_b`` could be one argument or two.
    """
    names = Names(program).parameters(program)
    if any("_" in name for name in names):
        names = list(map(str, range(len(names))))
    kept = [name for name, argument in zip(names, program.arguments, strict=True) if argument.name in same]
    return "_".join(kept)


def named_parts(program: Program, form: Uniform) -> tuple[Program, Program]:
    """What a form prepares and what it applies, under the names of their functions."""
    return (
        replace(form.prepare, name=form_name(program, form.same, "prepare")),
        replace(with_coefficients(form.apply), name=form_name(program, form.same, "apply")),
    )


def _kind(program: Program) -> str:
    """Return the kind of the block loop of a kernel, see ``GAC_KERNEL``."""
    return "TURNS" if has_trigonometric(program) else "BUSY" if is_transcendental(program) else "PLAIN"


def _kind_of_form(program: Program) -> str:
    return "TURNS" if has_trigonometric(program) else "PLAIN"


def _same(program: Program, form: Uniform | None) -> list[int]:
    """Return the positions of the uniform arguments of a variant."""
    return [k for k, argument in enumerate(program.arguments) if form and argument.name in form.same]


def _sizes(program: Program, form: Uniform | None) -> list[int]:
    """Return the sizes of the arguments and results that a loop reads and writes for each element."""
    same = _same(program, form)
    return [prod(part.shape) for k, part in enumerate(parts(program)) if k not in same]


def _dense(program: Program, form: Uniform | None) -> str:
    """Return the kind of the loop for C order: direct if compilers read elements as efficiently as with tiles."""
    run, sizes = form.apply if form else program, _sizes(program, form)
    few = sum(sizes) <= _DENSE_NUMBERS and len(run.lines) <= max(_DENSE_LINES, _LINES_OF_NUMBER * sum(sizes))
    if not (1 < max(sizes) <= TILES and few) or is_transcendental(run):
        return "NO"
    is_direct = set(sizes) <= {1, 2, 3, 4, 8} and max(sizes[-len(program.results) :]) <= FEW
    return "DIRECT" if is_direct else "TILES"
