"""Replacement of several divisions by a number, or by it and its square root, by products with one reciprocal.

``x / q`` and ``y / sqrt(q)`` become ``x * r * r`` and ``y * r`` with ``r = 1 / sqrt(q)``. Division takes several times
longer than multiplication and has less throughput. The reciprocal is that of the root, because ``sqrt(q) * (1 / q)``
would be NaN for `q` equal to 0 or infinity.
"""

from __future__ import annotations

from collections import Counter

from ..ir.program import Operand, Program
from ..ir.scalar import Graph, Op, Scalar


def divide_once(program: Program) -> tuple[Scalar, ...] | None:
    """Return the results with one division for each divisor and its root, or None if `program` already has no more."""
    roots: dict[Operand, Operand] = {line.operands[0]: line.target for line in program.lines if line.op is Op.SQRT}
    divisors = Counter(line.operands[1] for line in program.lines if line.op is Op.DIVIDE)

    def divided_by(divisor: Operand) -> Operand:
        """Return the root of a divisor if it is a divisor as well, else the divisor."""
        root = roots.get(divisor, divisor)
        return root if root in divisors else divisor

    uses = Counter(map(divided_by, divisors.elements()))
    if len(uses) == divisors.total():
        return None
    graph = Graph()
    names = [name for argument in program.arguments for name in argument.components]
    values: dict[Operand, Scalar] = {name: graph.variable(name) for name in names}

    def value(operand: Operand) -> Scalar:
        return values[operand] if isinstance(operand, str) else graph.constant(operand)

    for line in program.lines:
        operands = list(map(value, line.operands))
        if line.op is not Op.DIVIDE or uses[divided_by(line.operands[1])] == 1:
            values[line.target] = graph.apply(line.op, *operands)
            continue
        numerator, divisor = operands
        if divided_by(line.operands[1]) == line.operands[1]:
            values[line.target] = numerator * (1 / divisor)
        else:
            reciprocal = 1 / graph.apply(Op.SQRT, divisor)
            values[line.target] = numerator * reciprocal * reciprocal
    return tuple(value(operand) for result in program.results for operand in result.operands)
