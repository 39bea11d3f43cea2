"""Proof of emitted kernels with loops: the text has the compiled loops, and its programs agree with the definition."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from random import Random
from typing import Any

import numpy as np

from .backends import as_printed
from .backends.shared_parts import with_applies
from .errors import GacError
from .frontend.kernel import trace
from .frontend.recorded import Compute, computes
from .generation.compiled import CompiledLoops
from .ir.procedure import Apply, Loop, Place, Procedure, Repeat, Statement, Storage, Table, statements
from .ir.program import Program
from .passes.loop_accuracy import largest, results_ulps, without_rounding
from .passes.loop_samples import Case, Rows, consecutive, in_doubles
from .passes.prove import truths
from .passes.prove_loops import procedure_difference
from .passes.truth import Truth
from .program_text import difference_of_program, has_formulas, same_formulas, without_names

POINTS = 11
"""Size of the batch that is run: larger than the number of vector lanes, and not a multiple of it."""


def part_truths(record: CompiledLoops, *texts: Procedure) -> list[list[Truth]]:
    """Return points for the straight-line parts and the values of their definitions, as rows of tables.

    A few points suffice for parts that were proved for all inputs, if the texts with these loops have their formulas.
    """
    called = [called_programs(text) for text in texts]
    found = []
    pairs = zip(computes(record.trace.statements), record.parts, strict=True)
    # Parts are numbered in the order of tracing, which differs from the order in fused loops.
    parts = {f"{record.kernel.name}_{k}": pair for k, pair in enumerate(pairs, start=1)}
    for k, apply in enumerate(_applies(record.source.procedure)):
        compute, part = parts[apply.program.name]
        known: Sequence[Truth]
        proof = part.proof
        is_own = bool(called) and all(has_formulas(each[k : k + 1], [apply.program]) for each in called)
        if proof and (is_own or not proof.is_for_all):
            known = proof.known
        else:
            known = truths(compute.kernel, trace(compute.kernel).expressions, part.slots, part.program)
        found.append([_as_rows(truth, compute, apply) for truth in known])
    return found


def _as_rows(truth: Truth, compute: Compute, apply: Apply) -> Truth:
    """Return a point with the multivectors of each row concatenated; entries that a part does not read are 0."""
    sources = [(source.place, source.leaf.start) for source in compute.sources]
    targets = [(place, leaf.start) for place, leaf in compute.targets]
    inputs = _rows([len(argument.components) for argument in apply.program.arguments], sources, truth.inputs)
    results = _rows([len(result.operands) for result in apply.program.results], targets, truth.results)
    more = truth.again
    again = None if more is None else lambda n_digits: _as_rows(more(n_digits), compute, apply)
    return replace(truth, inputs=inputs, results=results, again=again)


def _rows(
    sizes: Sequence[int], at: Sequence[tuple[Place, int]], values: Sequence[Sequence[Any]]
) -> tuple[tuple[Any, ...], ...]:
    """Return the rows of the places, in the order of their first occurrence."""
    places = dict.fromkeys(place for place, _ in at)
    rows = {place: [0] * size for place, size in zip(places, sizes, strict=True)}
    for (place, start), numbers in zip(at, values, strict=True):
        rows[place][start : start + len(numbers)] = numbers
    return tuple(map(tuple, rows.values()))


def loops_difference(
    found: Procedure | None,
    record: CompiledLoops,
    known: Sequence[Sequence[Truth]],
    renamed: Callable[[Procedure], Procedure] = lambda procedure: procedure,
    proved: Sequence[Program] = (),
) -> str:
    """Describe how a procedure that was read from a text differs from the definition; empty if they are equal.

    The programs are compared with the definition in any case; the procedure is compared with the unrolled function
    unless the compilation in this process has done that.

    Parameters
    ----------
    found : Procedure or None
        The procedure that was read; None if the text does not contain it.
    record : CompiledLoops
    known : sequence of sequence of Truth
        The result of `part_truths`.
    renamed : callable
        Function that returns a procedure with the names that it has in the text.
    proved : sequence of Program
        The program of each call in another text in which no difference was found.
    """
    own = record.source.procedure
    if found is None:
        return "is not there"
    printed = renamed(own)
    difference = _other_tables(found.tables, printed.tables) or _other_statements(found.body, printed.body)
    called = called_programs(found)
    if difference or (proved and without_names(called) == without_names(proved)):
        return difference
    pairs = zip(_applies(found), _applies(own), known, strict=True)
    for printed_apply, compiled, points in pairs:
        difference = difference_of_program(printed_apply.program, compiled.program, points)
        if difference:
            return f"{compiled.program.name}: {difference}"
    exact = all(as_printed(program) == program for program in own.programs)
    is_own = not exact or same_formulas(called, called_programs(own))
    text = own if is_own else _with_programs(own, called)
    if text == record.proved:
        return ""
    return procedure_difference(record.kernel, record.trace.results, text)


def _with_programs(procedure: Procedure, programs: Sequence[Program]) -> Procedure:
    """Return a procedure that calls other programs, one for each call."""
    each = iter(programs)
    return replace(procedure, body=with_applies(procedure.body, lambda apply: replace(apply, program=next(each))))


def called_programs(procedure: Procedure) -> list[Program]:
    """Return the program of each call, in the order of the text."""
    return [apply.program for apply in _applies(procedure)]


def _applies(procedure: Procedure) -> list[Apply]:
    return [statement for statement in statements(procedure.body) if isinstance(statement, Apply)]


def _other_tables(found: Sequence[Table], own: Sequence[Table]) -> str:
    for a, b in zip(found, own, strict=False):
        if a != b:
            return f"has the table {a}, expected {b}"
    return "" if len(found) == len(own) else f"has {len(found)} tables, expected {len(own)}"


def _other_statements(found: Sequence[Statement], own: Sequence[Statement]) -> str:
    """Describe how statements differ, apart from their programs."""
    for a, b in zip(found, own, strict=False):
        if isinstance(a, (Loop, Repeat)) and isinstance(b, (Loop, Repeat)):
            inner = _other_statements(a.body, b.body)
            if inner:
                return inner
        if _outside(a) != _outside(b):
            return f"has the statement {_outside(a)}, expected {_outside(b)}"
    return "" if len(found) == len(own) else f"has {len(found)} statements in a row, expected {len(own)}"


def _outside(statement: Statement) -> Any:
    """Return a statement without its body, and with its program replaced by the shapes of the program."""
    if isinstance(statement, Apply):
        program: Program = statement.program
        shapes = [argument.shape for argument in program.arguments], [result.shape for result in program.results]
        return *shapes, statement.inputs, statement.outputs
    return replace(statement, body=()) if isinstance(statement, (Loop, Repeat)) else statement


def error_of_loops(run: Any, record: CompiledLoops) -> float:
    """Return the largest error in ulp of a generated function on arrays of 1, 2 and 3 rows."""
    procedure, random = record.source.procedure, Random(6)
    errors = []
    for n in (1, 2, 3):
        case = Case.of(record.kernel, procedure, consecutive(procedure.lengths, n), random)
        points, exact = _batch(case, procedure, random)
        for k, found in enumerate(_results(run, procedure, case, points)):
            errors.append(results_ulps(found, exact[k]))
    return largest(errors, procedure)


def _batch(case: Case, procedure: Procedure, random: Random) -> tuple[list[dict[str, Rows]], list[dict[str, Rows]]]:
    """Return arguments in doubles at which the procedure has a value, with the value; all have equal shared arrays."""
    shared = {table.name for table in procedure.parameters if table.shared}
    points, exact = list[dict[str, Rows]](), list[dict[str, Rows]]()
    for _ in range(4 * POINTS):
        given = in_doubles(case.near_one(random))
        if points:
            given |= {name: points[0][name] for name in shared}
        try:
            value = without_rounding(procedure, case.lengths, given)
        except (ArithmeticError, ValueError, TypeError, GacError):
            continue
        points.append(given)
        exact.append(value)
        if len(points) == POINTS:
            break
    return points, exact


def _results(run: Any, procedure: Procedure, case: Case, points: Sequence[Mapping[str, Rows]]) -> list[dict[str, Rows]]:
    """Return the results of a function on a batch: the rows of each result by name, for each point."""
    if not points:
        return []
    arrays = []
    for table in procedure.parameters:
        own = points[:1] if table.shared or table.storage is Storage.INDEX else points
        shape = (*(case.lengths[name] for name in table.lengths), *table.shape)
        kind = np.int64 if table.storage is Storage.INDEX else np.float64
        array = np.array([[x for row in point[table.name] for x in row] for point in own], kind)
        arrays.append(array.reshape(shape if own is not points else (len(points), *shape)))
    value = run(*arrays)
    values = value if isinstance(value, tuple) else (value,)
    n_given = len(points) if any(not table.shared for table in procedure.of(Storage.ARGUMENT)) else 1
    found: list[dict[str, Rows]] = [{} for _ in range(n_given)]
    for table, result in zip(procedure.results, values, strict=True):
        rows = np.asarray(result, float).reshape(n_given, -1, table.size)
        for k in range(n_given):
            found[k][table.name] = rows[k].tolist()
    return found
