"""Cheap must not mean inaccurate: candidates that lose digits where the author's own structure keeps them are rejected.

Relations hold exactly for the elements that are meant, and to rounding for the elements that arrive. Replacing
``b**2`` by ``1 - s**2`` is exact for unit rotors and useless close to the identity. So every candidate runs in double
precision on ordinary elements, on versors close to 1 and on arguments close to each other, and is compared with the
author's structure without rounding.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from math import inf, nextafter, ulp
from random import Random
from typing import Any

import mpmath

from ..errors import GacError
from ..frontend.kernel import Kernel
from ..ir.interpret import evaluate
from ..ir.program import Program
from ..ir.scalar import Op
from ..rings.points import DIGITS, point
from .prove import Truth, program_reader, read
from .samples import sample, to_mpmath
from .search import Candidate

WORSE = 4
"""How many times the error of the author's structure a candidate may have."""
ROUNDING = 8.0
"""Ulp that any candidate may have: below, errors are noise."""
CLOSE = Fraction(1, 2**20)
ERROR_POINTS = 64

Inputs = list[tuple[float, ...]]


def most_accurate_enough(kernel: Kernel, candidates: Sequence[Candidate]) -> Candidate:
    """The cheapest candidate whose error is not much larger than that of the first, the author's structure."""
    author = candidates[0]
    known = list(_references(kernel, author.program))
    allowed = [max(WORSE * _ulps_or_inf(author.program, inputs, exact), ROUNDING) for inputs, exact in known]
    for candidate in sorted(candidates, key=lambda candidate: candidate.cost.total):
        errors = (_ulps_or_inf(candidate.program, inputs, exact) for inputs, exact in known)
        if all(error <= limit for error, limit in zip(errors, allowed, strict=True)):
            return candidate
    return author


def _references(kernel: Kernel, program: Program) -> Iterator[tuple[Inputs, Sequence[Any]]]:
    """Inputs in double precision, with the results of `program` on them without rounding."""
    random = Random(3)
    points = [sample(kernel, random, near_one=True) for _ in range(6)]
    points += [sample(kernel, random, spread=CLOSE, near_one=True) for _ in range(4)]
    points += [_close_together(kernel, random) for _ in range(4)]
    reader = program_reader(program)
    for point_values in points:
        values = {name: float(value) for name, value in point_values.items()}
        inputs = [tuple(values[name] for name in argument.components) for argument in program.arguments]
        try:
            exact = read(reader, Truth(tuple(tuple(map(Fraction, v)) for v in inputs), (), True))
            if all(mpmath.isfinite(value) for value in map(to_mpmath, exact)):
                yield inputs, exact
        except (ArithmeticError, ValueError, TypeError, GacError):
            continue


def _close_together(kernel: Kernel, random: Random) -> dict[str, Any]:
    """Free elements of one layout that nearly coincide."""
    bases: dict[Any, list[Any]] = {}
    values = sample(kernel, random, spread=CLOSE, near_one=True)
    for parameter in kernel.parameters:
        layout = parameter.layout
        if layout.has_relations:
            continue
        base = bases.setdefault(layout, point(layout, random, near_one=True))
        for k, name in enumerate(parameter.components):
            values[name] = base[k % layout.size] + values[name]
    return values


def run_in_double(program: Program, inputs: Sequence[Sequence[float]]) -> list[float]:
    """The program in IEEE double, each operation rounded once; functions are rounded correctly, on every machine."""
    values: dict[str, float] = {}
    for argument, given in zip(program.arguments, inputs, strict=True):
        values.update(zip(argument.components, given, strict=True))
    for line in program.lines:
        operands = [values[o] if isinstance(o, str) else float(o) for o in line.operands]
        if line.op in (Op.SIN, Op.COS, Op.ATAN2, Op.ACOS, Op.EXP, Op.LOG):
            with mpmath.workdps(30):
                values[line.target] = float(evaluate(line.op, [mpmath.mpf(operand) for operand in operands]))
        else:
            values[line.target] = float(evaluate(line.op, operands))
    return [values[o] if isinstance(o, str) else float(o) for result in program.results for o in result.operands]


def ulps(rounded: Sequence[float], exact: Sequence[Any]) -> float:
    """The largest error in units of the last place of the largest exact value."""
    with mpmath.workdps(DIGITS):
        true = [to_mpmath(value) for value in exact]
        largest = max((abs(value) for value in true), default=mpmath.mpf(0))
        if largest == 0:
            return 0.0 if not any(rounded) else inf
        unit = ulp(min(float(largest), nextafter(inf, 0)))
        return max(float(abs(mpmath.mpf(a) - b)) / unit for a, b in zip(rounded, true, strict=True))


def _ulps_or_inf(program: Program, inputs: Inputs, exact: Sequence[Any]) -> float:
    try:
        return ulps(run_in_double(program, inputs), exact)
    except (ArithmeticError, ValueError, TypeError):
        return inf


def measured_error(program: Program, kernel: Kernel) -> float:
    """The largest error in ulp over `ERROR_POINTS` random elements, against the same program without rounding."""
    random, reader, worst = Random(5), program_reader(program), 0.0
    for _ in range(ERROR_POINTS):
        values = {name: float(value) for name, value in sample(kernel, random, near_one=True).items()}
        inputs = [tuple(values[name] for name in argument.components) for argument in program.arguments]
        try:
            exact = read(reader, Truth(tuple(tuple(map(Fraction, v)) for v in inputs), (), True))
            worst = max(worst, ulps(run_in_double(program, inputs), exact))
        except (ArithmeticError, ValueError, TypeError):
            continue
    return worst
