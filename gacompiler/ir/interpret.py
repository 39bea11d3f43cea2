"""The meaning of every operation: run a program over any ring. Backends are approximations of this."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..algebra.coefficients import divide, scalar_function, scale
from .program import Operand, Program
from .scalar import Op, Rational


def evaluate(op: Op, values: Sequence[Any]) -> Any:
    """``op(values)`` in the ring of the values."""
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
            return scalar_function(op.value, *values)


def interpret(
    program: Program, inputs: Mapping[str, Sequence[Any]], constant: Any = lambda value: value
) -> dict[str, tuple[Any, ...]]:
    """Run `program` on flat sequences of components, one for each argument; gives flat results by name.

    `constant` lifts an exact number into the ring (``float``, ``mpmath.mpf``); by default numbers stay exact.
    """
    values: dict[str, Any] = {}
    for argument in program.arguments:
        values.update(zip(argument.components, inputs[argument.name], strict=True))

    def value(operand: Operand) -> Any:
        return values[operand] if isinstance(operand, str) else constant(operand)

    for line in program.lines:
        factor = line.operands[0]
        if line.op is Op.MULTIPLY and not isinstance(factor, str):
            values[line.target] = scale(value(line.operands[1]), _exact(factor))
        else:
            values[line.target] = evaluate(line.op, [value(operand) for operand in line.operands])
    return {result.name: tuple(value(operand) for operand in result.operands) for result in program.results}


def _exact(value: Rational) -> Rational:
    return value.numerator if value.denominator == 1 else value
