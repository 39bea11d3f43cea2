"""Interpretation of programs over any ring. It defines the operations, which backends approximate."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

from ..algebra.coefficients import divide, scalar_function, scale
from .program import Operand, Program
from .scalar import RING, Op, Rational

MANTISSA = 53
"""Number of bits of a double."""

NAMES: Mapping[Op, str] = {op: op.value for op in Op}
"""The names of operations: the attribute of an enumeration is a function in Python, needed for every evaluation."""


def evaluate(op: Op, values: Sequence[Any]) -> Any:
    """Return ``op(values)`` in the ring of the values."""
    match op:
        case Op.ADD:
            return values[0] + values[1]
        case Op.SUBTRACT:
            return values[0] - values[1]
        case Op.MULTIPLY:
            return values[0] * values[1]
        case Op.NEGATE:
            return -values[0]
        case Op.DIVIDE:
            return divide(values[0], values[1])
        case _:
            return scalar_function(NAMES[op], *values)


_IN_DOUBLE: Mapping[Op, Callable[..., Any]] = {
    Op.ADD: operator.add,
    Op.SUBTRACT: operator.sub,
    Op.MULTIPLY: operator.mul,
    Op.NEGATE: operator.neg,
}
_OF_RING: Mapping[Op, Callable[..., Any]] = {op: _IN_DOUBLE[op] for op in RING} | {Op.DIVIDE: divide}


class Tape:
    """A program prepared for repeated evaluation: names are replaced by positions in one list of values.

    The list contains the inputs, then the constants, then one value for each line.

    Attributes
    ----------
    program : Program
    constants : list of Fraction
        The exact numbers in the program, apart from the factors of products.
    """

    def __init__(self, program: Program) -> None:
        self.program = program
        places: dict[Operand, int] = {}
        for argument in program.arguments:
            for component in argument.components:
                places[component] = len(places)
        self.constants: list[Fraction] = []

        for operand in _operands(program):
            if not isinstance(operand, str) and operand not in places:
                places[operand] = len(places)
                self.constants.append(operand)
        self._first = len(places)
        self._lines: list[tuple[Op, int, int, tuple[int, ...]]] = []
        self._steps: list[tuple[Callable[..., Any], int, int, tuple[int, ...]]] = []
        for line in program.lines:
            at = tuple(places[operand] for operand in line.operands)
            factor = line.operands[0]
            self._lines.append((line.op, at[0], at[-1], at))
            if line.op is Op.MULTIPLY and not isinstance(factor, str):
                self._steps.append((partial(scale, factor=_exact(factor)), 0, 0, at[1:]))
            else:
                function = _OF_RING.get(line.op) or partial(scalar_function, NAMES[line.op])
                self._steps.append((function, at[0], at[-1], () if len(at) == 2 else at))
            places[line.target] = len(places)
        self._results = [places[operand] for result in program.results for operand in result.operands]

    def run(self, inputs: Iterable[Any], constant: Callable[[Any], Any] = lambda value: value) -> list[Any]:
        """Return the flat results for the flat `inputs`; `constant` lifts exact numbers into the ring.

        The exact factor of a product with a constant is not lifted: it scales the value.
        """
        return self.run_with(inputs, map(constant, self.constants))

    def run_with(self, inputs: Iterable[Any], constants: Iterable[Any]) -> list[Any]:
        """Return the same as `run`, for `constants` that are lifted already."""
        values = [*inputs, *constants]
        append = values.append
        for function, a, b, others in self._steps:
            if others:
                append(function(*[values[k] for k in others]))
            else:
                append(function(values[a], values[b]))
        return [values[k] for k in self._results]

    def run_in_double(self, inputs: Iterable[float], function: Callable[[Op, list[float]], float]) -> list[float]:
        """Return the flat results in IEEE double, with each operation rounded once.

        `function` evaluates the operations that are not ring operations.
        """
        values = [*inputs, *map(float, self.constants)]
        append = values.append
        for own, op, a, b, at in self._in_double:
            if own is None:
                append(function(op, [values[k] for k in at]))
            elif len(at) == 2:
                append(own(values[a], values[b]))
            else:
                append(own(values[a]))
        return [values[k] for k in self._results]

    @cached_property
    def _in_double(self) -> list[tuple[Callable[..., float] | None, Op, int, int, tuple[int, ...]]]:
        return [(_IN_DOUBLE.get(line[0]), *line) for line in self._lines]

    @cached_property
    def bits(self) -> int:
        """An estimate of the number of bits of the longest exact value for inputs in double precision."""
        found = [MANTISSA] * (self._first - len(self.constants))
        found += [max(each.numerator.bit_length(), each.denominator.bit_length()) for each in self.constants]
        for op, a, b, at in self._lines:
            if op in (Op.MULTIPLY, Op.DIVIDE):
                found.append(found[a] + found[b])
            else:
                found.append(max(found[k] for k in at) + (op in RING))
        return max(found, default=0)

    @cached_property
    def is_dyadic(self) -> bool:
        """Whether binary fractions are mapped to binary fractions: all operations and constants are dyadic."""
        ring = all(op in RING for op, *_ in self._lines)
        return ring and all(_is_power_of_two(value.denominator) for value in self.constants)

    def run_dyadic(self, inputs: Iterable[float | Fraction]) -> list[Fraction]:
        """Evaluate a program with `is_dyadic` on exact binary fractions, as integers times powers of two.

        This is many times faster than `run` with fractions, which are reduced in every step.
        """
        whole: list[int] = []
        powers: list[int] = []
        numbers: list[float | Fraction] = [*inputs, *self.constants]
        for number in numbers:
            numerator, denominator = number.as_integer_ratio()
            whole.append(numerator)
            powers.append(denominator.bit_length() - 1)
        for op, a, b, _ in self._lines:
            if op is Op.MULTIPLY:
                whole.append(whole[a] * whole[b])
                powers.append(powers[a] + powers[b])
                continue
            if op is Op.NEGATE:
                whole.append(-whole[a])
                powers.append(powers[a])
                continue
            x, y, shift = whole[a], whole[b], powers[a] - powers[b]
            if shift > 0:
                y <<= shift
            elif shift < 0:
                x <<= -shift
            whole.append(x + y if op is Op.ADD else x - y)
            powers.append(max(powers[a], powers[b]))
        return [Fraction(whole[k], 1 << powers[k]) for k in self._results]


def interpret(
    program: Program, inputs: Mapping[str, Sequence[Any]], constant: Any = lambda value: value
) -> dict[str, tuple[Any, ...]]:
    """Run `program` on flat sequences of components, one for each argument, and return flat results by name.

    `constant` lifts an exact number into the ring (``float``, ``mpmath.mpf``). By default numbers remain exact.
    """
    flat: list[Any] = []
    for argument in program.arguments:
        flat += [value for value, _ in zip(inputs[argument.name], argument.components, strict=True)]
    found = iter(Tape(program).run(flat, constant))
    return {result.name: tuple(next(found) for _ in result.operands) for result in program.results}


def _operands(program: Program) -> Iterable[Operand]:
    for line in program.lines:
        yield from line.operands
    for result in program.results:
        yield from result.operands


def _is_power_of_two(value: int) -> bool:
    return value & (value - 1) == 0


def _exact(value: Rational) -> Rational:
    return value.numerator if value.denominator == 1 else value
