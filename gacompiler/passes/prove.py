"""Proof by evaluation: a program is its author's definition, at exact points that satisfy the relations.

Two rational functions of bounded degree that agree at random points of a variety agree on it but for a chance that
falls with every point (Schwartz 1980, Zippel 1979).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from random import Random
from typing import Any

import mpmath

from ..errors import InexactError, ProofError
from ..frontend.expression import Expression
from ..frontend.kernel import Kernel
from ..ir.interpret import Tape
from ..ir.program import Program
from ..ir.scalar import RING, Op
from ..ir.uniform import joined
from ..rings.points import DIGITS
from .lower import Slot
from .record import Compilation
from .samples import samples, to_mpmath

TOLERANCE_DIGITS = 40
"""Agreement asked for where a value is not rational, of `DIGITS` digits computed."""
EXACT_POINTS, FEW_POINTS, LONG = 5, 2, 5000
"""Points for polynomials and fractions; fewer for programs of more than `LONG` lines."""
BRANCH_POINTS = 60
"""Points for kernels with branches, so that every branch is taken."""
LARGE = 12
"""Exponentials of more leave too few digits to what cancels; such points are left out where there are others."""
QUICK_POINTS = 16
"""The same while a script is compiled; `gac verify` takes all."""

Reader = Callable[..., Sequence[Any]]


@dataclass(frozen=True, slots=True)
class Truth:
    """Inputs of a kernel and what its author's definition gives there, in the order of the result arrays."""

    inputs: tuple[tuple[Any, ...], ...]
    results: tuple[tuple[Any, ...], ...]
    is_exact: bool


def truths(
    kernel: Kernel,
    expressions: Sequence[Expression],
    result_slots: Sequence[Sequence[Slot]],
    program: Program,
    seed: int = 11,
    n: int | None = None,
) -> list[Truth]:
    """Points for a kernel and what its definition gives there; points where it gives nothing are left out.

    Parameters
    ----------
    kernel : Kernel
    expressions : sequence of Expression
        The definition: what the kernel's function gives on symbols.
    result_slots : sequence of sequence of Slot
        For each result array: which coefficient of which expression each entry is.
    program : Program
        How many points there are, `n`, depends by default on its operations and its length.
    """
    random = Random(seed)
    long = len(program.lines) > LONG
    if n is None:
        n = BRANCH_POINTS if _has_branches(program) else FEW_POINTS if long else EXACT_POINTS
    found: list[Truth] = []
    grows = any(line.op is Op.EXP for line in program.lines)
    for point, values in samples(kernel, expressions, random, 2 * n if grows else n, long):
        with mpmath.workdps(DIGITS):  # even a minus sign rounds to the precision in force
            results = tuple(
                tuple(_signed(values[slot.expression].terms.get(slot.blade, 0), slot.sign) for slot in slots)
                for slots in result_slots
            )
        exact = all(isinstance(v, (int, Fraction)) for v in [*(v for r in results for v in r), *point.values()])
        inputs = tuple(tuple(point[name] for name in parameter.components) for parameter in kernel.parameters)
        found.append(Truth(inputs, results, exact))
    small = [truth for truth in found if all(abs(x) <= LARGE for values in truth.inputs for x in values)]
    if grows and len(small) > 2:
        return small[:n]
    if not found:
        raise ProofError(
            kernel.where,
            f"its definition is undefined at {8 * n} random points",
            remedy="check its domain",
        )
    return found


def _signed(value: Any, sign: int) -> Any:
    return value if sign > 0 else -value


def _has_branches(program: Program) -> bool:
    return any(line.op not in (*RING, Op.DIVIDE, Op.SQRT) for line in program.lines)


def disagreement(reader: Reader, known: Sequence[Truth]) -> str:
    """How a function over any ring differs from the definition, or an empty string.

    `reader` takes one flat sequence for each argument and gives the flat results, one after the other.
    """
    for number, truth in enumerate(known):
        expected = [value for result in truth.results for value in result]
        try:
            found = list(read(reader, truth))
        except (ArithmeticError, ValueError, KeyError, NameError, TypeError, IndexError, InexactError) as error:
            return f"fails at point {number}: {type(error).__name__}: {error}"
        if len(found) != len(expected):
            return f"gives {len(found)} numbers, expected {len(expected)}"
        for k, (a, b) in enumerate(zip(found, expected, strict=True)):
            if not same(a, b):
                return f"entry {k} at point {number} is {_short(a)}, expected {_short(b)}"
    return ""


def read(reader: Reader, truth: Truth) -> Sequence[Any]:
    """What `reader` gives at a point: exactly where it can, else to `DIGITS` digits.

    Raises
    ------
    ValueError
        When a result is not a real number.
    """
    if truth.is_exact:
        try:
            return reader(*truth.inputs)
        except InexactError:
            pass
    with mpmath.workdps(DIGITS):
        results = reader(*(tuple(map(to_mpmath, values)) for values in truth.inputs))
    if any(isinstance(value, mpmath.mpc) for value in results):
        raise ValueError("a result is not real")
    return results


def same(a: Any, b: Any, scale: Any = 0) -> bool:
    """Whether two numbers are equal: exactly where both are rational, else to `TOLERANCE_DIGITS` digits.

    Digits are those of 1, of `b`, or of `scale`, whichever is the largest.
    """
    if isinstance(a, (int, Fraction)) and isinstance(b, (int, Fraction)):
        return a == b
    with mpmath.workdps(DIGITS):
        x, y = to_mpmath(a), to_mpmath(b)
        return bool(abs(x - y) <= mpmath.mpf(10) ** -TOLERANCE_DIGITS * (1 + max(abs(y), to_mpmath(scale))))


def _short(value: Any) -> str:
    return mpmath.nstr(value, 12) if isinstance(value, mpmath.mpf) else str(value)


def program_reader(program: Program) -> Reader:
    """A program as a function of flat sequences."""

    tape = Tape(program)

    def reader(*inputs: Sequence[Any]) -> list[Any]:
        flat = [value for values in inputs for value in values]
        inexact = any(isinstance(value, mpmath.mpf) for value in flat)
        return tape.run(flat, to_mpmath if inexact else lambda value: value)

    return reader


def prove_program(record: Compilation) -> Compilation:
    """Compare the program that won with the author's definition.

    Raises
    ------
    ProofError
        When they differ: a defect of the compiler, or a relation that the layouts declare and the points do not have.
    """
    quick = record.kernel.result_names and _has_branches(record.program)
    assert record.trace is not None and record.decision is not None
    n = QUICK_POINTS if quick else None
    known = truths(record.kernel, record.trace.expressions, record.decision.slots, record.program, n=n)
    programs = [record.program, *(joined(form, record.program) for form in record.uniform)]
    difference = next(filter(None, (disagreement(program_reader(program), known) for program in programs)), "")
    if difference:
        raise ProofError(
            f"kernel {record.kernel.name}", difference, remedy="this is a defect of the compiler, please report it"
        )
    return record
