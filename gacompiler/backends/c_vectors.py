"""C text for loops whose iterations run in vectors, in kernels that run one element of a batch after the other.

Kernels with computed numbers of rows have no function for NLANES elements, so only their innermost loops can use
vectors. Such a loop is printed in blocks of LANES iterations if it is part of an iteration and of another loop, and no
iteration reads what another one writes. An example are the least of many scores and its row, if each of a number of
lanes has a least score of its own: a `fold` whose carry is an array over the lanes.

In the blocks, all rows with computed numbers exist. If one of them does not, all iterations run one by one.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..ir.procedure import (
    Apply,
    Copy,
    Loop,
    Place,
    Procedure,
    Repeat,
    Statement,
    Storage,
)
from ..ir.rows import axis_of, computed_numbers, further_tables, is_shifted
from .c_windows import WIDE

VECTORS = "GAC_VECTORS"

HELPERS = f"""
#ifndef GAC_VECTORS
#ifndef GAC_WIDE{WIDE}#endif

/* A loop over n rows with counter i, in blocks of LANES rows if all rows with computed numbers exist. */
#ifndef GAC_EXISTS
#define GAC_EXISTS(condition) (GAC_INSIDE || (condition))
#endif
#define GAC_VECTORS(i, n, all_exist, ...)                                                                      \\
    {{                                                                                                          \\
        const intptr_t gac_last = (all_exist) ? (n) - (n) % LANES : 0;                                         \\
        for (intptr_t gac_start = 0; gac_start < gac_last; gac_start += LANES) {{                               \\
            enum {{ GAC_INSIDE = 1 }};                                                                           \\
            ANY_ORDER                                                                                          \\
            for (intptr_t i = gac_start; i < gac_start + LANES; i++)                                           \\
                __VA_ARGS__                                                                                    \\
        }}                                                                                                      \\
        enum {{ GAC_INSIDE = 0 }};                                                                               \\
        for (intptr_t i = gac_last; i < (n); i++)                                                              \\
            __VA_ARGS__                                                                                        \\
    }}
#endif
"""
"""Macros that precede the kernels of a module with loops in vectors; a file contains itself for each precision."""


def vector_loops(procedure: Procedure) -> tuple[Loop, ...]:
    """Return the loops of a procedure that run in vectors."""
    return tuple(_inner(procedure, procedure.body, False, False)) if procedure.selects else ()


def _inner(procedure: Procedure, body: tuple[Statement, ...], repeats: bool, loops: bool) -> Iterator[Loop]:
    for statement in body:
        if isinstance(statement, Repeat):
            yield from _inner(procedure, statement.body, True, False)
        elif isinstance(statement, Loop):
            is_plain = not statement.reverse and not statement.controls
            if repeats and loops and is_plain and _is_free(procedure, statement):
                yield statement
            yield from _inner(procedure, statement.body, repeats, True)


def _is_free(procedure: Procedure, loop: Loop) -> bool:
    """Return whether the iterations of a loop without inner loops can run at the same time."""
    moves = [(_sources(each), _targets(each)) for each in loop.body if isinstance(each, (Apply, Copy))]
    if len(moves) < len(loop.body):
        return False
    written = {place.table: place for _, targets in moves for place in targets}
    ready = set[str]()
    for sources, targets in moves:
        for place in sources:
            if is_shifted(place.row) or any(table in written for table in further_tables(place.row)):
                return False
            is_own = axis_of(place.row, loop.counter) is not None and written.get(place.table) == place
            if place.table in written and place.table not in ready and not is_own:
                return False
        for place in targets:
            table = procedure.table(place.table)
            is_local = table.storage is Storage.WORK and not table.lengths
            if written[place.table] != place or not (is_local or axis_of(place.row, loop.counter) is not None):
                return False
            ready.add(place.table)
    return True


def numbered_places(loop: Loop) -> Iterator[Place]:
    """Yield the places with computed numbers that a loop reads."""
    for statement in loop.body:
        if isinstance(statement, (Apply, Copy)):
            yield from (place for place in _sources(statement) if computed_numbers(place.row))


def _sources(statement: Apply | Copy) -> tuple[Place, ...]:
    return statement.inputs if isinstance(statement, Apply) else (statement.source,)


def _targets(statement: Apply | Copy) -> tuple[Place, ...]:
    return statement.outputs if isinstance(statement, Apply) else (statement.target,)
