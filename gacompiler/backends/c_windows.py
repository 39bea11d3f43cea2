"""C text for rows at a distance: boundary modes, and loops that are split into borders and an interior.

In the interior of an axis, all neighbours exist, so that compilers read them at constant distances, in vectors. Only a
loop that contains no loops and whose rows can be computed in any order is split.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from ..ir.procedure import Add, Apply, Copy, Loop, Place, Procedure, Storage, statements
from ..ir.procedure_text import at_text
from ..ir.rows import Shifted, axis_of, further_tables, is_shifted, numbers_of

BODIES = {
    "reflect": """
    while (n > 0 && (k < 0 || k >= n))
        k = k < 0 ? -1 - k : 2 * n - 1 - k;
    return k;""",
    "mirror": """
    while (n > 1 && (k < 0 || k >= n))
        k = k < 0 ? -k : 2 * n - 2 - k;
    return n > 1 ? k : 0;""",
    "nearest": """
    return k < 0 ? 0 : k < n ? k : n - 1;""",
    "wrap": """
    while (n > 0 && (k < 0 || k >= n))
        k += k < 0 ? n : -n;
    return k;""",
}
"""The statements that find the row that a boundary mode puts at the number k of an axis of n rows, in C."""


def boundary_functions(head: str) -> str:
    """Return the functions of the boundary modes in a language like C; `head` is that of the function {name}."""
    functions = (f"{head.format(name=f'gac_{mode}')}\n{{{body}\n}}\n" for mode, body in BODIES.items())
    macros = "#define gac_constant(k, n) (k)\n#define gac_is_inside(k, n) ((k) >= 0 && (k) < (n))\n"
    return "\n".join([*functions, macros])


_DEFINED = f"""
#ifndef GAC_WINDOWS
#if defined(__GNUC__)
#define GAC_BOUNDARY(name) static __attribute__((const, noinline, unused)) intptr_t name(intptr_t k, intptr_t n)
#else
#define GAC_BOUNDARY(name) static intptr_t name(intptr_t k, intptr_t n)
#endif

/* The row that a boundary mode puts at the number k of an axis of n rows. Compilers call a function that has no other
   effects outside of loops that do not change its arguments. */
{boundary_functions("GAC_BOUNDARY({name})")}"""

WIDE = """
/* A function with loops over rows of windows, for the widest vectors of the machine, see `GAC_HEAD` of the runtime. */
#if defined(ON_v3) && !defined(GAC_LEVEL)
#define GAC_WIDE(name, parameters, arguments)                                                                   \\
    ON_v3 static void NAME(name##_v3) parameters { NAME(name##_within) arguments; }                             \\
    ON_v4 static void NAME(name##_v4) parameters { NAME(name##_within) arguments; }                             \\
    void NAME(name) parameters                                                                                  \\
    {                                                                                                           \\
        if (HAS_v4)                                                                                             \\
            NAME(name##_v4) arguments;                                                                          \\
        else if (HAS_v3)                                                                                        \\
            NAME(name##_v3) arguments;                                                                          \\
        else                                                                                                    \\
            NAME(name##_within) arguments;                                                                      \\
    }
#elif defined(ON_v4) && GAC_LEVEL >= 4
#define GAC_WIDE(name, parameters, arguments) ON_v4 void NAME(name) parameters { NAME(name##_within) arguments; }
#else
#define GAC_WIDE(name, parameters, arguments) void NAME(name) parameters { NAME(name##_within) arguments; }
#endif
"""
"""A macro that defines a function for the widest vectors of the machine."""

_SPLIT = """
/* A loop over n rows with counter i. From row `first` to the row before `last`, all neighbours exist; these rows are
   computed in whole vectors, the last of which may overlap with the one before. */
#define GAC_ROW_AT(boundary, k, n) (GAC_INSIDE || ((k) >= 0 && (k) < (n)) ? (k) : gac_##boundary(k, n))
#define GAC_EXISTS(condition) (GAC_INSIDE || (condition))
#define GAC_WINDOWS(i, n, first, last, ...)                                                                    \\
    {                                                                                                          \\
        const intptr_t gac_first = (first) < (n) ? (first) : (n), gac_end = (last) < (n) ? (last) : (n);       \\
        const intptr_t gac_last = gac_end - gac_first < LANES ? gac_first : gac_end;                           \\
        enum { GAC_INSIDE = 0 };                                                                               \\
        for (intptr_t i = gac_first > 0 ? 0 : gac_last; i < (n); i = i + 1 == gac_first ? gac_last : i + 1)    \\
            __VA_ARGS__                                                                                        \\
        for (intptr_t gac_done = gac_first; gac_done < gac_last; gac_done += LANES) {                          \\
            enum { GAC_INSIDE = 1 };                                                                           \\
            const intptr_t gac_start = gac_done + LANES <= gac_last ? gac_done : gac_last - LANES;             \\
            ANY_ORDER                                                                                          \\
            for (intptr_t i = gac_start; i < gac_start + LANES; i++)                                           \\
                __VA_ARGS__                                                                                    \\
        }                                                                                                      \\
    }
#endif
"""

HELPERS = _DEFINED + WIDE + _SPLIT
"""Functions and macros that precede the kernels of a module with windows; a file contains itself for each precision."""

SPLIT = "GAC_WINDOWS"


@dataclass(frozen=True, slots=True)
class Interior:
    """The rows of a loop all of whose neighbours exist, as texts of the first row and the one after the last."""

    first: str
    last: str


def has_windows(procedure: Procedure) -> bool:
    """Return whether rows of a procedure lie at a distance from the current row of a loop."""
    return any(is_shifted(place.row) for each in statements(procedure.body) for place in _places(each))


def has_split_loops(procedure: Procedure) -> bool:
    """Return whether a loop of a procedure is split into borders and an interior."""
    return any(
        isinstance(each, Loop) and interior_of(procedure, each) is not None for each in statements(procedure.body)
    )


def needed_by(procedures: Iterable[Procedure], text: str) -> list[str]:
    """Return a list of a text if some of the procedures have windows, else an empty list."""
    return [text.strip()] if any(map(has_windows, procedures)) else []


def interior_of(procedure: Procedure, loop: Loop) -> Interior | None:
    """Return the interior of a loop that is to be split, or None."""
    is_near = any(is_shifted(place.row) for each in loop.body for place in _places(each))
    if loop.reverse or loop.controls or not is_near or not _in_any_order(procedure, loop):
        return None
    shifts = list(_shifts(procedure, loop))
    if not shifts:
        return Interior("0", loop.length)
    if len({(row.stride, length) for row, length in shifts}) > 1:
        return None
    (stride, length), distances = (shifts[0][0].stride, shifts[0][1]), [row.by for row, _ in shifts]
    least, most = min(distances), max(distances)
    first = max(0, -(least // stride))
    if stride == 1:
        return Interior(str(first), f"{length} - {most}" if most > 0 else length)
    return Interior(str(first), f"({at_text(1, length, stride - 1 - most)}) / {stride}")


def _shifts(procedure: Procedure, loop: Loop) -> Iterator[tuple[Shifted, str]]:
    """Yield the rows at a distance from the current row of a loop, with the lengths of their axes."""
    for statement in loop.body:
        for place in _places(statement):
            for row, length in zip(numbers_of(place.row), procedure.table(place.table).lengths, strict=False):
                if isinstance(row, Shifted) and row.loop == loop.counter:
                    yield row, length


def _places(statement: object) -> tuple[Place, ...]:
    match statement:
        case Apply(_, inputs, outputs):
            return (*inputs, *outputs)
        case Add(source, target) | Copy(source, target):
            return (source, target)
    return ()


def _in_any_order(procedure: Procedure, loop: Loop) -> bool:
    """Return whether no iteration of a loop without inner loops reads what another one writes."""
    if not all(isinstance(each, (Apply, Copy)) for each in loop.body):
        return False
    written: dict[str, Place] = {}
    read = set[str]()
    for statement in loop.body:
        sources = statement.inputs if isinstance(statement, Apply) else (statement.source,)  # type: ignore[union-attr]
        targets = statement.outputs if isinstance(statement, Apply) else (statement.target,)  # type: ignore[union-attr]
        for place in sources:
            read |= {place.table, *further_tables(place.row)}
            if written.get(place.table, place) != place:
                return False
        for place in targets:
            table = procedure.table(place.table)
            is_own = axis_of(place.row, loop.counter) is not None
            is_local = table.storage is Storage.WORK and not table.lengths
            if (place.table in read and place.table not in written) or written.setdefault(place.table, place) != place:
                return False
            if not (is_own or is_local):
                return False
    return True
