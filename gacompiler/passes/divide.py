"""Dividing once: quotients by a number, or by it and by its root, become products with one reciprocal.

``x / q`` and ``y / sqrt(q)`` are ``x * r`` and ``y * (sqrt(q) * r)`` with ``r = 1 / q``: processors divide several
times slower than they multiply, and not two numbers at a time.
"""

from __future__ import annotations

from collections import Counter

from ..ir.program import Operand, Program
from ..ir.scalar import Graph, Op, Scalar


def divide_once(program: Program) -> tuple[Scalar, ...] | None:
    """The results with one division for each divisor and its root, or None where `program` has no more than that."""
    radicands = {line.target: line.operands[0] for line in program.lines if line.op is Op.SQRT}
    divisors = [line.operands[1] for line in program.lines if line.op is Op.DIVIDE]

    def base(divisor: Operand) -> Operand:
        """What a divisor is, or is the root of where something is divided by that too."""
        radicand = radicands.get(str(divisor), divisor)
        return radicand if radicand in divisors else divisor

    uses = Counter(map(base, divisors))
    if len(uses) == len(divisors):
        return None
    graph = Graph()
    names = [name for argument in program.arguments for name in argument.components]
    values: dict[Operand, Scalar] = {name: graph.variable(name) for name in names}

    def value(operand: Operand) -> Scalar:
        return values[operand] if isinstance(operand, str) else graph.constant(operand)

    for line in program.lines:
        operands = list(map(value, line.operands))
        if line.op is not Op.DIVIDE or uses[base(line.operands[1])] == 1:
            values[line.target] = graph.apply(line.op, *operands)
            continue
        numerator, divisor = operands
        radicand = value(base(line.operands[1]))
        values[line.target] = numerator * (1 / divisor if radicand is divisor else divisor * (1 / radicand))
    return tuple(value(operand) for result in program.results for operand in result.operands)
