"""The loops of a C file: lines that instantiate the macros of ``gac_runtime.h`` for a kernel.

A loop loads the components of an element into local arrays, calls the plain function, which is inlined, and stores its
results; so an output may be an input, and the compiler may vectorise without knowing which arrays overlap. It is
compiled for structure-of-arrays (each component contiguous over the batch), once for each width of vectors that is
chosen from when it runs. For other strides the driver of ``gac_runtime.c``, which all kernels share, moves blocks of
elements through buffers of that order; from C order (each element contiguous) by functions for each size of element.
That costs one store and one load for each number: a kernel that computes little for each number has a second loop for C
order, in which it stays in registers. Both exist once more for an argument that is the same for the whole batch, where
that saves work.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from math import prod

from ..errors import BackendError
from ..ir.program import Argument, Program, Result
from ..ir.uniform import Uniform
from .c_functions import has_turns, is_transcendental
from .nesting import with_coefficients
from .printers import Names

C_ENDINGS = ("_within", "_v3", "_loop", "_block", "_dense", "_call")
"""What the names of a kernel's C functions add to its own."""
FORM_PARTS = ("prepare", "apply", "start", "block", "dense")
"""What the names of a form's C functions have between the kernel's name and its arguments."""

_DENSE_NUMBERS = 64
_DENSE_LINES = 40
_LINES_OF_NUMBER = 7
"""Kernels of at most so many numbers, and of so many operations or so many for each number, have a loop of their own
for C order. Others gain less from what they would add to the build."""

FLAGS = 32
"""``GAC_FLAGS`` of the runtime: forms are found among so many arguments."""

FEW = 3
"""What compilers transpose well without tiles has at most so many numbers."""

TILES = 32
"""``GAC_TILE_NUMBERS`` of the runtime: elements of at most so many numbers go through tiles."""

MOST_AXES = 5
"""``GAC_MOST_AXES`` of the runtime."""

_MOST_REPEATED = 1024
"""The longest axis whose loads the runtime can write out."""

Shape = tuple[int, ...]


def parts(program: Program) -> list[Argument | Result]:
    """The arguments, then the results."""
    return [*program.arguments, *program.results]


def loop_text(program: Program, forms: Sequence[Uniform]) -> list[str]:
    """What makes the loops of a kernel, and the function that runs it over a batch."""
    name, everything = program.name, range(len(parts(program)))
    lines = [f"#define PARTS_{name}(IN, NUMBER, OUT, AND) {_listed(program, everything)}"]
    uses = []
    for form in usable_forms(program, forms):
        same = _same(program, form)
        label, kind, dense = _label(program, form), _kind_of_form(form.apply), _dense(program, form)
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
    """Those that the driver can find: their arguments are among the first `FLAGS`."""
    late = {argument.name for argument in program.arguments[FLAGS:]}
    return [form for form in forms if not late.intersection(form.same)]


def helper_lines(
    programs: Sequence[Program], forms: Sequence[tuple[Program, Uniform]], row_sizes: Collection[int] = ()
) -> list[str]:
    """What loads and stores elements of every shape, and tiles of those sizes that loops use, in a fixed order.

    Rows of kernels with loops are elements, too.
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
    """The line that makes the functions for tiles of a size."""
    return f"GAC_TILE({size})"


def _inner_shapes(shape: Shape) -> Iterator[Shape]:
    """A shape and those of which its rows are made."""
    if len(shape) > MOST_AXES:
        raise BackendError("C backend", f"{len(shape)} axes", f"at most {MOST_AXES} axes of a part")
    if max(shape, default=1) > _MOST_REPEATED:
        raise BackendError("C backend", f"an axis of {max(shape)} numbers", f"at most {_MOST_REPEATED} along an axis")
    for axis in range(len(shape)):
        yield shape[axis:]


def _axes(shape: Shape) -> str:
    """The line that makes the functions for a shape."""
    power = 1 << (shape[0] - 1).bit_length()
    if len(shape) == 1:
        return f"GAC_AXIS({shape[0]}, {power})"
    return f"GAC_AXES({_shape(shape)}, {shape[0]}, {power}, {_shape(shape[1:])}, {prod(shape[1:])})"


def _shape(shape: Shape) -> str:
    return "x".join(map(str, shape)) if shape else "scalar"


def _listed(program: Program, chosen: Collection[int]) -> str:
    """Parts of a kernel: their places, those of their first strides, and their shapes."""
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


def form_name(program: Program, form: Uniform, what: str) -> str:
    """The name of a function that belongs to a form: ``move_point_block_m``."""
    return f"{program.name}_{what}_{_label(program, form)}"


def _label(program: Program, form: Uniform) -> str:
    """What stays the same, named as it is printed, or numbered where a name has an underscore: ``a_b`` would be one
    argument or two.
    """
    names = Names().parameters(program)
    if any("_" in name for name in names):
        names = list(map(str, range(len(names))))
    kept = [name for name, argument in zip(names, program.arguments, strict=True) if argument.name in form.same]
    return "_".join(kept)


def named_parts(program: Program, form: Uniform) -> tuple[Program, Program]:
    """What a form prepares and what it applies, under the names of their functions."""
    return (
        replace(form.prepare, name=form_name(program, form, "prepare")),
        replace(with_coefficients(form.apply), name=form_name(program, form, "apply")),
    )


def _kind(program: Program) -> str:
    """Which block loop the kernel has, see ``GAC_KERNEL``."""
    return "TURNS" if has_turns(program) else "BUSY" if is_transcendental(program) else "PLAIN"


def _kind_of_form(program: Program) -> str:
    return "TURNS" if has_turns(program) else "PLAIN"


def _same(program: Program, form: Uniform | None) -> list[int]:
    """The arguments that a form has prepared."""
    return [k for k, argument in enumerate(program.arguments) if form and argument.name in form.same]


def _sizes(program: Program, form: Uniform | None) -> list[int]:
    """The sizes of the parts that a loop reads and writes for each element."""
    same = _same(program, form)
    return [prod(part.shape) for k, part in enumerate(parts(program)) if k not in same]


def _dense(program: Program, form: Uniform | None) -> str:
    """Which loop there is for C order: direct where compilers read the elements as well as tiles do."""
    run, sizes = form.apply if form else program, _sizes(program, form)
    few = sum(sizes) <= _DENSE_NUMBERS and len(run.lines) <= max(_DENSE_LINES, _LINES_OF_NUMBER * sum(sizes))
    if not (1 < max(sizes) <= TILES and few) or is_transcendental(run):
        return "NO"
    is_direct = set(sizes) <= {1, 2, 3, 4, 8} and max(sizes[-len(program.results) :]) <= FEW
    return "DIRECT" if is_direct else "TILES"
