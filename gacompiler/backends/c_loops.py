"""Print kernels with loops as C: a plain function that calls the straight-line parts in loops, and a version for NLANES
elements at a time.

The plain function takes the tables of one element, with contiguous rows. Work tables of a single row are local
variables, which the compiler keeps in registers; other work tables are in the work space passed by the caller.

In the function for NLANES elements (``gac_runtime.h``), every number is an array of NLANES numbers, and each part is a
vectorised loop. Tables shared by all elements are stored once. Steps that are repeated until a condition holds are
repeated until it holds for all of them (``c_rounds.py``). Procedures in which elements read different rows have no such
version, nor have those in which loops over neighbours are vectorised (``c_windows.py``). Blocks with an argument too
large for the vectorised sines are computed by the plain function.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import prod

from ..errors import BackendError
from ..ir.procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Repeat, Storage, Table, statements
from ..ir.program import Program
from ..ir.rows import At, computed_numbers, further_tables, is_shifted
from .c_batch import parts
from .c_loop_names import named_in_c
from .c_loop_text import LaneText, PlainText, is_number, is_shared, product
from .c_rounds import kept_tables
from .c_vectors import vector_loops
from .c_windows import has_split_loops
from .transcendental import has_trigonometric, is_transcendental

LOOP_ENDINGS = ("_within", "_v3", "_v4", "_lanes", "_tables", "_call", "_rows", "_work")
"""Suffixes of the names of the C functions of a kernel with loops."""

SHARING = "PARTS_{}(IN, SAME, NUMBER, OUT, AND)"


def loop_parts(procedure: Procedure) -> tuple[Program, ...]:
    """Return the straight-line parts, in the order of the text.

    Raises
    ------
    BackendError
        If two parts have the same name.
    """
    applied = [s.program for s in statements(procedure.body) if isinstance(s, Apply)]
    programs = procedure.programs
    for program in applied:
        if program not in programs:
            raise BackendError(f"C text of {procedure.name}", f"two parts named {program.name}", "different names")
    return programs


def has_lanes(procedure: Procedure) -> bool:
    """Whether NLANES elements are computed at a time: all read the same rows, and no loop over rows is vectorised."""
    return not procedure.selects and not has_split_loops(procedure)


def is_wide_in_c(procedure: Procedure) -> bool:
    """Whether the plain function has loops for the widest vectors of the machine."""
    return has_split_loops(procedure) or bool(vector_loops(procedure))


def lane_sizes(procedure: Procedure) -> set[int]:
    """Return the sizes, in numbers, of the rows that the parts load and store."""
    if not has_lanes(procedure):
        return set()
    return {prod(part.shape) for program in loop_parts(procedure) for part in parts(program)}


def c_parameters(procedure: Procedure, real: str) -> list[str]:
    """Return the parameters of the plain function: lengths, arguments and index tables, results, work space."""
    named, names = named_in_c(procedure)
    return [*_lengths(named), *_declared(named, real, False), f"{real} *{names.fresh('work')}"]


def work_lines(module: str, procedure: Procedure) -> list[str]:
    """Print the function that returns the size of the work space in numbers."""
    named, _ = named_in_c(procedure)
    sizes = [_numbers(table) for table in _long_work(named)]
    read = {length for table in _long_work(named) for length in table.lengths}
    unread = [f"(void){length}" for length in named.lengths if length not in read]
    return [
        work_prototype(module, procedure),
        "{",
        *([f"    {', '.join(unread)};"] if unread else []),
        f"    return {' + '.join(sizes) or '0'};",
        "}",
    ]


def work_prototype(module: str, procedure: Procedure) -> str:
    """Return the head of the function that returns the size of the work space."""
    named, _ = named_in_c(procedure)
    return f"intptr_t {module}_{procedure.name}_work({', '.join(_lengths(named))})"


def list_lines(procedure: Procedure) -> list[str]:
    """Print the lists of lengths and tables, the input of the runtime's macros."""
    named, _ = named_in_c(procedure)
    entries = [f"LENGTH({k}, {length})" for k, length in enumerate(named.lengths)]
    outer = [*named.parameters, *named.results]
    entries += [_entry(k, table) for k, table in enumerate(outer)]
    own = [*_long_work(named), *(table for table in kept_tables(named) if table.lengths)]
    work = [f"WORK({k}, {table.name}, {_described(table)})" for k, table in enumerate(own, start=len(outer))]
    return [
        f"#define TABLES_{named.name}(LENGTH, IN, NUMBER, SAME, INDEX, OUT, AND) {' AND '.join(entries)}",
        f"#define WORK_{named.name}(WORK) {' '.join(work)}".rstrip(),
    ]


def plain_lines(procedure: Procedure) -> list[str]:
    """Print the plain function for one element."""
    named, names = named_in_c(procedure)
    work = names.fresh("work")
    parameters = [*_lengths(named), *_declared(named, "REAL", False), f"REAL *{work}"]
    head = ", ".join(parameters)
    body = PlainText(named, names).lines(named.body)
    is_busy, is_wide = any(map(is_transcendental, loop_parts(procedure))), is_wide_in_c(procedure)
    name, storage = (f"{named.name}_within", "static INLINE ") if is_busy or is_wide else (named.name, "")
    lines = [f"{storage}void NAME({name})({head})", "{"]
    lines += _unread([*named.lengths, *(t.name for t in (*named.parameters, *named.results))], named, work)
    lines += _locals(named, work)
    lines += [*(f"    {line}" for line in body), "}"]
    own = ", ".join([*named.lengths, *(t.name for t in (*named.parameters, *named.results)), work])
    if is_wide:
        lines += ["", f"GAC_WIDE({named.name}, ({head}), ({own}))"]
    elif is_busy:
        lines += ["", f"FUSED({named.name}, ({head}), ({own}))", f"void NAME({named.name})({head})", "{"]
        lines += [f"    RUN({named.name}, ({own}), ({own}));", "}"]
    return lines


def lane_lines(procedure: Procedure) -> list[str]:
    """Print the function for NLANES elements, which follows the loops of its parts."""
    if not has_lanes(procedure):
        return []
    named, names = named_in_c(procedure)
    parameters = [*_lengths(named), *_declared(named, "REAL", True)]
    kept = kept_tables(named)
    parameters += [f"REAL *{table.name}" for table in (*_long_work(named), *kept) if table.lengths]
    body = LaneText(named, names).lines(named.body)
    has_sines = any(map(has_trigonometric, loop_parts(procedure)))
    lines = [f"static INLINE WORD NAME({named.name}_lanes)({', '.join(parameters)})", "{"]
    lines += _unread(
        [*named.lengths, *(t.name for t in (*named.parameters, *named.results, *_long_work(named)))], named
    )
    declared = [f"{table.name}[{product(table.size, 'NLANES')}]"
                for table in (*_short_work(named), *kept) if not table.lengths]  # fmt: skip
    lines += [f"    _Alignas(64) REAL {', '.join(declared)};"] if declared else []
    lines += ["    WORD far = 0;"] if has_sines else []
    return [*lines, *(f"    {line}" for line in body), f"    return {'far' if has_sines else '0'};", "}"]


def part_lines(procedure: Procedure) -> dict[str, list[str]]:
    """Return the lines that define the loop of each part over NLANES elements."""
    if not has_lanes(procedure):
        return {}
    found: dict[str, list[str]] = {}
    for statement in statements(procedure.body):
        if not isinstance(statement, Apply):
            continue
        program = statement.program
        entries = []
        for k, (argument, place) in enumerate(zip(program.arguments, statement.inputs, strict=True)):
            is_same = is_shared(procedure, place)
            if argument.shape:
                entries.append(f"{'SAME' if is_same else 'IN'}({k}, {prod(argument.shape)})")
            else:
                entries.append(f"NUMBER({k}, {int(is_same)})")
        for k, result in enumerate(program.results, start=len(entries)):
            entries.append(f"OUT({k}, {prod(result.shape)})")
        lines = [
            f"#define {SHARING.format(program.name)} {' AND '.join(entries)}",
            f"GAC_IN_LANES({program.name}, {'TURNS' if has_trigonometric(program) else 'PLAIN'})",
        ]
        if found.setdefault(program.name, lines) != lines:
            raise BackendError(
                f"C text of {procedure.name}",
                f"{program.name} is called with a shared table and with one that is not shared",
                "a separate part for each",
            )
    return found


def driver_line(procedure: Procedure) -> str:
    """Return the line that defines the function for a batch."""
    is_busy = any(map(is_transcendental, loop_parts(procedure)))
    kind = ("BUSY" if is_busy else "LANES") if has_lanes(procedure) else "ALONE"
    return f"GAC_PROCEDURE({procedure.name}, {kind})"


# Tables.


def _lengths(named: Procedure) -> list[str]:
    return [f"intptr_t {length}" for length in named.lengths]


def _declared(named: Procedure, real: str, in_lanes: bool) -> list[str]:
    """Return arguments, index tables and results as parameters."""
    found = []
    for table in named.parameters:
        if table.storage is Storage.INDEX:
            found.append(f"const int64_t *{table.name}")
        elif is_number(table) and not in_lanes:
            found.append(f"{real} {table.name}")
        else:
            found.append(f"const {real} *{table.name}")
    return found + [f"{real} *{table.name}" for table in named.results]


def _short_work(named: Procedure) -> list[Table]:
    return [table for table in named.of(Storage.WORK) if not table.lengths]


def _long_work(named: Procedure) -> list[Table]:
    return [table for table in named.of(Storage.WORK) if table.lengths]


def _numbers(table: Table) -> str:
    """Return the size of a table in numbers."""
    return product(table.size, *table.lengths)


def _described(table: Table) -> str:
    shape = "x".join(map(str, table.shape)) or "scalar"
    return f"{shape}, {table.size}, {' * '.join(table.lengths) or '1'}"


def _entry(k: int, table: Table) -> str:
    """Return the entry of a parameter or a result in the list of tables."""
    if table.storage is Storage.INDEX:
        return f"INDEX({k}, {table.name}, {product(table.size, *table.lengths)}, {table.into})"
    if is_number(table):
        return f"NUMBER({k}, {table.name})"
    kind = "OUT" if table.storage is Storage.RESULT else "SAME" if table.shared else "IN"
    return f"{kind}({k}, {table.name}, {_described(table)})"


def _locals(named: Procedure, work: str) -> list[str]:
    """Define the work tables in the plain function, in their order."""
    found, place = [], work
    for table in named.of(Storage.WORK):
        if table.lengths:
            found.append(f"*const {table.name} = {place}")
            place = f"{table.name} + {_numbers(table)}"
        elif table.shape:
            found.append(f"{table.name}[{' * '.join(map(str, table.shape))}]")
        else:
            found.append(table.name)
    return [f"    REAL {', '.join(found)};"] if found else []


def _unread(parameters: Iterable[str], named: Procedure, work: str = "") -> list[str]:
    """Return statements for unused parameters, which prevent compiler warnings."""
    read = set(_read(named))
    if work and _long_work(named):
        read.add(work)
        # The end of each table, which is the start of the next, depends on its lengths.
        read |= {length for table in _long_work(named)[:-1] for length in table.lengths}
    unread = [name for name in (*parameters, *([work] if work else [])) if name not in read]
    return [f"    {', '.join(f'(void){name}' for name in unread)};"] if unread else []


def _read(named: Procedure) -> Iterable[str]:
    """Yield the names that occur in the text of the statements."""
    for statement in statements(named.body):
        match statement:
            case Apply():
                places = (*statement.inputs, *statement.outputs)
            case Add() | Copy():
                places = (statement.source, statement.target)
            case Clear(table):
                places = (Place(table),)
                yield from named.table(table).lengths
            case Loop():
                places = tuple(map(Place, statement.controls))
                yield statement.length
            case Repeat():
                places = (Place(statement.until), Place(statement.steps))
        for place in places:
            yield place.table
            yield from further_tables(place.row)
            if isinstance(place.row, At):
                yield from named.table(place.table).lengths[1:]
            if computed_numbers(place.row) or is_shifted(place.row):
                yield from named.table(place.table).lengths
