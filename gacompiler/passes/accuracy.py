"""Rejection of candidates that are much less accurate than the author's own structure.

Relations hold exactly for ideal elements, but only up to rounding for actual arguments. For example, replacing ``b**2``
by ``1 - s**2`` is exact for unit rotors, but inaccurate close to the identity. Every candidate is therefore run in
double precision on ordinary elements, on versors close to 1, on arguments close to each other, and on large multiples
of small motions. The results are compared with those of the author's structure without rounding.

Under a root, a difference of products that replaces a sum of squares loses half of the digits where it nearly vanishes,
or becomes negative. Kernels with roots are therefore also run on arguments that are nearly on a line.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from math import inf, isfinite, isnan, nextafter, ulp
from random import Random
from typing import Any

import mpmath

from ..algebra.coefficients import FLOAT
from ..algebra.layout import Layout
from ..errors import GacError, InexactError
from ..frontend.kernel import Kernel
from ..ir.interpret import NAMES, Tape, evaluate
from ..ir.program import Program
from ..ir.scalar import Op
from ..rings.decimals import digits, from_decimal, to_decimal
from ..rings.points import DIGITS, point
from .samples import sample, to_mpmath

WORSE = 4
"""Maximum error of a candidate, as a multiple of the error of the author's structure."""
ROUNDING = 16.0
"""Error in ulp that is accepted for every candidate, because smaller errors are noise."""
CLOSE = Fraction(1, 2**20)
ERROR_POINTS = 64
LONGEST = 20_000
"""Maximum number of bits of exact values; those of deeper programs are computed to `DIGITS` digits."""
LONG = 1000
"""Programs with more lines than this are measured at fewer points."""

MOVES = 2
"""Number of perturbations of the inputs that are evaluated at each point."""

KINDS = (
    "ordinary arguments",
    "versors close to 1 and small arguments",
    "arguments that nearly coincide",
    "large multiples of small motions",
    "arguments that are nearly on a line",
)
"""The kinds of arguments on which candidates are run, in this order."""

Inputs = list[float]
Point = tuple[Inputs, Sequence[Any]]


class Gate:
    """The results of the author's structure at some points, and the errors that candidates may have there.

    The limit is based on the largest error of the author's structure among points of a kind, since its error at a
    single point may be small by chance. An error is also accepted if it is a small multiple of the change in the result
    that is caused by rounding the inputs.

    Parameters
    ----------
    kernel : Kernel
    author : Program
        The author's structure.
    """

    def __init__(self, kernel: Kernel, author: Program) -> None:
        self._kernel = kernel
        self._author = Tape(author)
        self._moved: dict[int, float] = {}
        self._refusals: dict[tuple[Program, float], str] = {(author, 1.0): ""}
        self._kinds: list[str] = []

    @cached_property
    def _known(self) -> list[tuple[Inputs, Sequence[Any], float]]:
        """The points, with the exact results and the limit of the error. Many gates have only the author's program."""
        known = []
        for kind, points in zip(KINDS, _references(self._kernel, self._author), strict=True):
            self._kinds += [kind] * len(points)
            worst = max((_ulps_or_inf(self._author, inputs, exact) for inputs, exact in points), default=0.0)
            known += [(inputs, exact, max(WORSE * worst, ROUNDING)) for inputs, exact in points]
        return known

    def accepts(self, program: Program, times: float = 1.0) -> bool:
        """Return whether the error of `program` is not much larger than that of the author's structure.

        The limit is multiplied by `times`, at least 1.
        """
        return not self.refusal(program, times)

    def refusal(self, program: Program, times: float = 1.0) -> str:
        """Return why `accepts` is false: the arguments, the error and its limit; "" if it is true.

        Equal programs are measured once.
        """
        key = program, times
        if key not in self._refusals:
            self._refusals[key] = self._measure(program, times)
        return self._refusals[key]

    def _measure(self, program: Program, times: float) -> str:
        tape = Tape(program)
        for k, (inputs, exact, limit) in enumerate(self._known):
            error = _ulps_or_inf(tape, inputs, exact)
            if error > times * limit and error > times * WORSE * self._sensitivity(k):
                most = times * max(limit, WORSE * self._sensitivity(k))
                return f"{error:.2g} units of error for {self._kinds[k]}, {most:.2g} accepted"
        return ""

    def _sensitivity(self, k: int) -> float:
        """Return the sensitivity at a point. It is computed on demand, since few programs require it."""
        if k not in self._moved:
            inputs, exact, _ = self._known[k]
            self._moved[k] = _sensitivity(self._author, inputs, exact)
        return self._moved[k]


def _sensitivity(author: Tape, inputs: Inputs, exact: Sequence[Any]) -> float:
    """Return the change of the exact result in ulp when every input is perturbed by at most half an ulp."""
    random, moved = Random(9), 0.0
    for _ in range(_thinned(author.program, MOVES)):
        near = [Fraction(value) + Fraction(ulp(value)) * random.randint(-8, 8) / 16 for value in inputs]
        try:
            moved = max(moved, ulps(without_rounding(author, near), exact))
        except (ArithmeticError, ValueError, TypeError, GacError):
            continue
    return moved


def _references(kernel: Kernel, tape: Tape) -> Iterator[list[Point]]:
    """Yield inputs in double precision with the exact results of a program, one list for each kind of input."""
    random = Random(3)
    n = _thinned(tape.program, 4)
    for kind in (
        [sample(kernel, random, near_one=True) for _ in range(n + n // 2)],
        [sample(kernel, random, spread=CLOSE, near_one=True) for _ in range(n)],
        [_close_together(kernel, random) for _ in range(n)],
        [_many_times_a_little(kernel, random) for _ in range(n if _has_versor_and_scalar(kernel) else 0)],
        [_nearly_on_a_line(kernel, random) for _ in range(n if _has_root(tape.program) else 0)],
    ):
        points: list[Point] = []
        for values in kind:
            inputs = _in_double(tape.program, values)
            try:
                exact = without_rounding(tape, inputs)
                if all(isfinite(value) for value in exact):
                    points.append((inputs, exact))
            except (ArithmeticError, ValueError, TypeError, GacError):
                continue
        yield points


def _thinned(program: Program, n: int) -> int:
    """Return a reduced number of points for long programs, in which each point involves hundreds of roundings."""
    return max(1, min(n, n * LONG // max(1, len(program.lines))))


def _in_double(program: Program, values: Mapping[str, Any]) -> Inputs:
    return [float(values[name]) for argument in program.arguments for name in argument.components]


def without_rounding(tape: Tape, inputs: Sequence[float | Fraction]) -> Sequence[Any]:
    """Return the flat results of a program on binary fractions, exactly if possible, else to `DIGITS` digits."""
    if tape.bits <= LONGEST:
        if tape.is_dyadic:
            return tape.run_dyadic(inputs)
        try:
            return tape.run([Fraction(value) for value in inputs])
        except InexactError:
            pass
    with digits(DIGITS):
        return list(map(from_decimal, tape.run(map(to_decimal, inputs), to_decimal)))


def _close_together(kernel: Kernel, random: Random) -> dict[str, Any]:
    """Return inputs in which the free elements of each layout nearly coincide."""
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


def _nearly_on_a_line(kernel: Kernel, random: Random) -> dict[str, Any]:
    """Return inputs in which the free elements of each layout nearly lie on a line."""
    lines: dict[Any, tuple[list[Any], list[Any]]] = {}
    values = sample(kernel, random, spread=CLOSE, near_one=True)
    for parameter in kernel.parameters:
        layout = parameter.layout
        if layout.has_relations:
            continue
        ends = lines.setdefault(layout, (point(layout, random, near_one=True), point(layout, random, near_one=True)))
        for start in range(0, len(parameter.components), layout.size):
            place = Fraction(random.randint(-64, 64), 64)
            for name, a, b in zip(parameter.components[start : start + layout.size], *ends, strict=True):
                values[name] += a + place * b
    return values


def _has_root(program: Program) -> bool:
    return any(line.op is Op.SQRT for line in program.lines)


def _has_versor_and_scalar(kernel: Kernel) -> bool:
    layouts = [parameter.layout for parameter in kernel.parameters]
    return any(layout.unit for layout in layouts) and any(_is_number(layout) for layout in layouts)


def _is_number(layout: Layout) -> bool:
    return layout.is_scalar and not layout.has_relations


def _many_times_a_little(kernel: Kernel, random: Random) -> dict[str, Any]:
    """Return versors close to 1, and numbers so large that the corresponding powers of the versors are not."""
    values = sample(kernel, random, spread=CLOSE, near_one=True)
    for parameter in kernel.parameters:
        if _is_number(parameter.layout):
            values.update({name: values[name] / CLOSE**2 for name in parameter.components})
    return values


def run_in_double(program: Program, inputs: Sequence[Sequence[float]]) -> list[float]:
    """Run a program in IEEE double, rounding each operation once; functions are rounded correctly on every machine."""
    return Tape(program).run_in_double([value for values in inputs for value in values], rounded_once)


def rounded_once(op: Op, operands: list[float]) -> float:
    """Evaluate an operation in IEEE double, rounded once; functions are rounded correctly on every machine."""
    if op is Op.DIVIDE:
        return operands[0] / operands[1]
    if op in _TRANSCENDENTAL:
        with mpmath.workdps(30):
            return float(evaluate(op, [mpmath.mpf(operand) for operand in operands]))
    return float(FLOAT[NAMES[op]](*operands))


_TRANSCENDENTAL = frozenset({Op.SIN, Op.COS, Op.ATAN2, Op.ACOS, Op.EXP, Op.LOG})


def ulps(found: Sequence[Any], exact: Sequence[Any], least: Any = 0) -> float:
    """Return the largest error in ulp of the largest exact value, or of the positive number `least` if it is larger."""
    largest = max([least, *map(abs, exact)])
    if largest == 0:
        return 0.0 if not any(found) else inf
    unit = ulp(min(float(largest), nextafter(inf, 0)))
    with mpmath.workdps(DIGITS):
        return max(float(abs(_difference(a, b))) for a, b in zip(found, exact, strict=True)) / unit


def _difference(a: Any, b: Any) -> Any:
    if not isfinite(a):
        return a
    if isinstance(a, (int, float, Fraction)) and isinstance(b, (int, Fraction)):
        (n, d), (m, e) = a.as_integer_ratio(), (b.numerator, b.denominator)
        return (n * e - m * d) / (d * e)  # Python rounds a quotient of integers once.
    return to_mpmath(a) - to_mpmath(b)


def _ulps_or_inf(tape: Tape, inputs: Inputs, exact: Sequence[Any]) -> float:
    try:
        error = ulps(tape.run_in_double(inputs, rounded_once), exact)
    except (ArithmeticError, ValueError, TypeError):
        return inf
    return inf if isnan(error) else error


def measured_error(program: Program, kernel: Kernel) -> tuple[float, int]:
    """Return the largest error in ulp over random elements, relative to exact evaluation, and their number."""
    random, tape, worst = Random(5), Tape(program), 0.0
    n = _thinned(program, ERROR_POINTS)
    for _ in range(n):
        inputs = _in_double(program, sample(kernel, random, near_one=True))
        try:
            worst = max(worst, ulps(tape.run_in_double(inputs, rounded_once), without_rounding(tape, inputs)))
        except (ArithmeticError, ValueError, TypeError):
            continue
    return worst, n
