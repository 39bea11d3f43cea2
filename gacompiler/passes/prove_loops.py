"""Verification of procedures against their functions with unrolled loops, for several lengths.

The parts of a procedure are verified like kernels. This module verifies that the loops combine them as the function
does, in exact arithmetic, with several kinds of index tables.
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
from ..rings.decimals import digits, from_decimal, to_decimal
from ..rings.residues import Residue
from .loop_samples import Case, few_rows
from .prove import same
from .samples import WORKING_DIGITS
from .undefined import reason

POINTS = 2
STEPS = 3
"""Maximum number of compared steps of an iteration. All steps are alike, and exact numbers grow in each."""

Results = Sequence[tuple[str, Record]]


def prove_procedure(kernel: Kernel, results: Results, procedure: Procedure) -> None:
    """Compare a procedure with the unrolled function of its kernel, for several lengths.

    Raises
    ------
    ProofError
        When they differ, which is a defect of the compiler, or when the function is undefined at random points.
    """
    difference = procedure_difference(kernel, results, procedure)
    if difference:
        raise ProofError(
            f"kernel {kernel.name}", difference, remedy="this is a defect of the compiler, please report it"
        )


def procedure_difference(kernel: Kernel, results: Results, procedure: Procedure) -> str:
    """Return a description of how a procedure differs from the function of its kernel, or an empty string.

    Parameters
    ----------
    kernel : Kernel
    results : sequence of (str, Record)
        The tables of results, as in `frontend.loop_trace.LoopTrace`.
    procedure : Procedure

    Raises
    ------
    ProofError
        When the function is undefined at random points.
    """
    random = Random(5)
    limited = replace(procedure, body=_limited(procedure.body))
    for lengths in few_rows(procedure.lengths) if procedure.lengths else [{}]:
        case = Case.of(kernel, procedure, lengths, random)
        difference = _difference(case, results, limited, random)
        if difference:
            return f"for lengths {dict(case.lengths)}: {difference}"
    return ""


def _limited(body: Sequence[Statement]) -> tuple[Statement, ...]:
    """Limit each iteration to at most `STEPS` steps."""
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
    """Return a description of how results differ at some points, or an empty string."""
    expressions = case.expressions(STEPS)
    points = list(case.points(expressions, random, POINTS))
    if not points:
        raise ProofError(
            case.kernel.where, f"its definition is undefined at {8 * POINTS} random points for {dict(case.lengths)}",
            remedy=reason(case.flat, expressions, random) or "check its domain",
        )  # fmt: skip
    for arguments, values in points:
        # Where the function has no exact value, rational numbers of the procedure could become too long.
        inexact = any(isinstance(x, mpmath.mpf) for value in values for x in value.terms.values())
        try:
            found = exact_results(procedure, case.lengths, arguments, inexact)
        except IndexError as error:
            return str(error)
        expected = iter(values)
        numbers = (x for value in values for x in value.terms.values())
        scale = max((abs(x) for x in numbers if not isinstance(x, Residue)), default=0)
        for name, record in results:
            for leaf in record.leaves:
                for row in found[name]:
                    value = next(expected)
                    for k, slot in enumerate(leaf.layout.stored, start=leaf.start):
                        with mpmath.workdps(WORKING_DIGITS):
                            wanted = slot.sign * value.terms.get(slot.blade, 0)
                        if not same(row[k], wanted, scale):
                            return f"{name} is {row[k]}, expected {wanted}"
    return ""


def exact_results(
    procedure: Procedure, lengths: Mapping[str, int], arguments: Mapping[str, Any], inexact: bool = False
) -> dict[str, list[list[Any]]]:
    """Return the results of a procedure on numbers: exact ones if possible, else (or if `inexact`) decimals.

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
    with digits(WORKING_DIGITS):
        lifted = {
            name: [list(map(to_decimal, row)) for row in rows] if name in floats else rows
            for name, rows in arguments.items()
        }
        found = run_procedure(procedure, lengths, lifted, to_decimal)
        return {name: [list(map(from_decimal, row)) for row in rows] for name, rows in found.items()}
