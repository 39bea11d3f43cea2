"""Proof of procedures: for several lengths they compute what their functions say, written out row by row.

The parts of a procedure are proved as kernels are; that loops put them together as the function does is compared here,
in exact arithmetic, with index tables of several kinds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from random import Random
from typing import Any

import mpmath

from ..errors import InexactError, ProofError
from ..frontend.kernel import Kernel
from ..frontend.recorded import Record
from ..ir.procedure import Loop, Procedure, Repeat, Statement, Storage
from ..ir.run_procedure import run_procedure
from ..rings.points import DIGITS
from .loop_samples import Case
from .prove import same
from .samples import to_mpmath

LENGTHS = (1, 2, 3)
"""Lengths that are compared; every further length of a kernel is one more than the one before."""
POINTS = 2
STEPS = 3
"""Steps of iterations that are compared: each is the same, and exact numbers grow with every one."""

Results = Sequence[tuple[str, Record]]


def prove_procedure(kernel: Kernel, results: Results, procedure: Procedure, lengths: Sequence[int] = LENGTHS) -> None:
    """Compare a procedure with the function of its kernel, written out for several lengths.

    Raises
    ------
    ProofError
        When they differ, a defect of the compiler, or the function has no value at random points.
    """
    difference = procedure_difference(kernel, results, procedure, lengths)
    if difference:
        raise ProofError(
            f"kernel {kernel.name}", difference, remedy="this is a defect of the compiler, please report it"
        )


def procedure_difference(
    kernel: Kernel, results: Results, procedure: Procedure, lengths: Sequence[int] = LENGTHS
) -> str:
    """How a procedure differs from the function of its kernel, or an empty string.

    Parameters
    ----------
    kernel : Kernel
    results : sequence of (str, Record)
        The tables of results, as `frontend.loop_trace.LoopTrace` has them.
    procedure : Procedure
    lengths : sequence of int

    Raises
    ------
    ProofError
        When the function has no value at random points.
    """
    random = Random(5)
    limited = replace(procedure, body=_limited(procedure.body))
    for n in lengths:
        case = Case.of(kernel, procedure, n, random)
        difference = _difference(case, results, limited, random)
        if difference:
            return f"for lengths {dict(case.lengths)}: {difference}"
    return ""


def _limited(body: Sequence[Statement]) -> tuple[Statement, ...]:
    """Statements with at most `STEPS` steps of each iteration."""
    found = list[Statement]()
    for statement in body:
        if isinstance(statement, Repeat):
            limit = min(statement.limit, STEPS)
            found.append(replace(statement, limit=limit, body=_limited(statement.body)))
        elif isinstance(statement, Loop):
            found.append(replace(statement, body=_limited(statement.body)))
        else:
            found.append(statement)
    return tuple(found)


def _difference(case: Case, results: Results, procedure: Procedure, random: Random) -> str:
    """How results differ at some points, or an empty string."""
    points = list(case.points(case.expressions(STEPS), random, POINTS))
    if not points:
        raise ProofError(
            case.kernel.where, f"its definition is undefined at {8 * POINTS} random points for {dict(case.lengths)}",
            remedy="check its domain",
        )  # fmt: skip
    for arguments, values in points:
        found = exact_results(procedure, case.lengths, arguments)
        expected = iter(values)
        scale = max((abs(x) for value in values for x in value.terms.values()), default=0)
        for name, record in results:
            for leaf in record.leaves:
                for row in found[name]:
                    value = next(expected)
                    for k, slot in enumerate(leaf.layout.stored, start=leaf.start):
                        with mpmath.workdps(DIGITS):
                            wanted = slot.sign * value.terms.get(slot.blade, 0)
                        if not same(row[k], wanted, scale):
                            return f"{name} is {row[k]}, expected {wanted}"
    return ""


def exact_results(
    procedure: Procedure, lengths: Mapping[str, int], arguments: Mapping[str, Any], inexact: bool = False
) -> dict[str, list[list[Any]]]:
    """What a procedure gives on numbers: exactly where its functions allow, and not `inexact`; else to `DIGITS` digits.

    Raises
    ------
    ValueError
        When a result is not a real number.
    """
    numbers = [x for table in procedure.of(Storage.ARGUMENT) for row in arguments[table.name] for x in row]
    if all(isinstance(x, (int, Fraction)) for x in numbers) and not inexact:
        try:
            return run_procedure(procedure, lengths, arguments)
        except InexactError:
            pass
    floats = {table.name for table in procedure.of(Storage.ARGUMENT)}
    with mpmath.workdps(DIGITS):
        lifted = {
            name: [list(map(to_mpmath, row)) for row in rows] if name in floats else rows
            for name, rows in arguments.items()
        }
        found = run_procedure(procedure, lengths, lifted, to_mpmath)
    if any(isinstance(x, mpmath.mpc) for rows in found.values() for row in rows for x in row):
        raise ValueError("a result is not real")
    return found
