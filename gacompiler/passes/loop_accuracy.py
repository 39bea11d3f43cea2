"""The rounding error of kernels with loops, on random elements and arrays of three rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from random import Random
from sys import float_info
from typing import Any

from ..errors import GacError
from ..frontend.kernel import Kernel
from ..ir.interpret import Tape
from ..ir.procedure import Procedure
from ..ir.run_procedure import is_dyadic, run_procedure
from .accuracy import ERROR_POINTS, LONG, rounded_once, ulps
from .loop_samples import Case, Rows, consecutive, in_doubles
from .prove_loops import exact_results

LENGTH = 3
LEAST_POINTS = 4
KEPT = 3, 4
"""Fraction of points used for programs with comparisons. The worst quarter is excluded, since rounding can change the
outcome of a comparison."""


def measured_loop_error(kernel: Kernel, procedure: Procedure) -> tuple[float, int]:
    """Return the largest error in ulp of the largest number of a result, and the number of inputs.

    The reference is the same procedure without rounding. For procedures with comparisons, only three quarters of the
    inputs are used.
    """
    random = Random(5)
    case = Case.of(kernel, procedure, consecutive(procedure.lengths, LENGTH), random)
    n_lines = LENGTH * sum(len(program.lines) for program in procedure.programs)
    n = max(LEAST_POINTS, min(ERROR_POINTS, ERROR_POINTS * LONG // max(1, n_lines)))
    errors = []
    for _ in range(n):
        arguments = in_doubles(case.near_one(random))
        try:
            found = run_procedure(procedure, case.lengths, arguments, float, _in_double)
            errors.append(results_ulps(found, without_rounding(procedure, case.lengths, arguments)))
        except (ArithmeticError, ValueError, TypeError, GacError):
            continue
    return largest(errors, procedure), n


def largest(errors: Sequence[float], procedure: Procedure) -> float:
    """Return the largest error, excluding the worst quarter for procedures with comparisons."""
    kept, of = KEPT if procedure.has_branches else (1, 1)
    return max(sorted(errors)[: max(1, len(errors) * kept // of)], default=0.0)


def without_rounding(
    procedure: Procedure, lengths: Mapping[str, int], arguments: Mapping[str, Rows]
) -> dict[str, Rows]:
    """Return the results of a procedure on doubles, exactly if possible in reasonable time, else to many digits."""
    from_doubles = {name: [[_exact(x) for x in row] for row in rows] for name, rows in arguments.items()}
    if not procedure.repeats and is_dyadic(procedure):
        return run_procedure(procedure, lengths, from_doubles, apply=Tape.run_dyadic)
    return exact_results(procedure, lengths, from_doubles, inexact=True)


def _exact(value: float | int) -> Any:
    return Fraction(value) if isinstance(value, float) else value


def results_ulps(found: Mapping[str, Rows], exact: Mapping[str, Rows]) -> float:
    """Return the largest error in ulp of the largest exact number of the same result.

    Errors of a result below the rounding error of another one, as of a sum whose terms cancel, are relative to the
    largest number of all results.
    """
    numbers = {name: [x for row in rows for x in row] for name, rows in exact.items() if any(rows)}
    sizes = {name: max(map(abs, flat)) for name, flat in numbers.items()}
    whole, worst = max(sizes.values(), default=0), 0.0
    for name, flat in numbers.items():
        least = whole if sizes[name] <= float_info.epsilon * whole else 0
        worst = max(worst, ulps([x for row in found[name] for x in row], flat, least))
    return worst


def _in_double(tape: Tape, inputs: Sequence[Any]) -> list[float]:
    return tape.run_in_double(inputs, rounded_once)
