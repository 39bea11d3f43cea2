"""Fewer divisions: several divisions by a number, or by it and its square root, become products with one reciprocal.

``x / q`` and ``y / sqrt(q)`` become ``x * r * r`` and ``y * r`` with ``r = 1 / sqrt(q)``. Division takes several times
longer than multiplication and has less throughput. The reciprocal is that of the root, because ``sqrt(q) * (1 / q)``
would be NaN for `q` equal to 0 or infinity. For the cost model `size`, in which all operations weigh the same, products
with a reciprocal are replaced by divisions.
"""

from __future__ import annotations

from collections import Counter

from ..ir.program import Line, Operand, Program
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


def cancel_numbers(program: Program) -> tuple[Scalar, ...] | None:
    """Return the results with ``x / y`` for quotients of equal multiples of `x` and `y`, or None if there are none."""
    multiples: dict[Operand, tuple[Operand, Operand]] = {}
    for line in program.lines:
        if line.op is Op.MULTIPLY:
            numbers = [operand for operand in line.operands if not isinstance(operand, str)]
            others = [operand for operand in line.operands if isinstance(operand, str)]
            if len(numbers) == 1:
                multiples[line.target] = numbers[0], others[0]
    found = {
        line.target: (multiples[x][1], multiples[y][1])
        for line in program.lines
        if line.op is Op.DIVIDE
        for x, y in [line.operands]
        if x in multiples and y in multiples and multiples[x][0] == multiples[y][0]
    }
    if not found:
        return None
    graph = Graph()
    names = [name for argument in program.arguments for name in argument.components]
    values: dict[Operand, Scalar] = {name: graph.variable(name) for name in names}

    def value(operand: Operand) -> Scalar:
        return values[operand] if isinstance(operand, str) else graph.constant(operand)

    for line in program.lines:
        values[line.target] = graph.apply(line.op, *map(value, found.get(line.target, line.operands)))
    return tuple(value(operand) for result in program.results for operand in result.operands)


def divide_each(program: Program) -> tuple[Scalar, ...] | None:
    """Return the results with divisions for products with a reciprocal, or None if `program` has no such reciprocal.

    Only reciprocals that are used in products alone, each of which has another factor, are replaced.
    """
    stored = {operand for result in program.results for operand in result.operands}
    uses: dict[Operand, list[Line]] = {}
    for line in program.lines:
        for operand in line.operands:
            uses.setdefault(operand, []).append(line)
    reciprocals: dict[Operand, Operand] = {
        line.target: line.operands[1] for line in program.lines if line.op is Op.DIVIDE and line.operands[0] == 1
    }
    replaced = {
        name: divisor
        for name, divisor in reciprocals.items()
        if name not in stored
        and all(use.op is Op.MULTIPLY and sum(each in reciprocals for each in use.operands) == 1 for use in uses[name])
    }
    if not replaced:
        return None
    graph = Graph()
    names = [name for argument in program.arguments for name in argument.components]
    values: dict[Operand, Scalar] = {name: graph.variable(name) for name in names}

    def value(operand: Operand) -> Scalar:
        return values[operand] if isinstance(operand, str) else graph.constant(operand)

    for line in program.lines:
        divisor = next((operand for operand in line.operands if operand in replaced), None)
        if line.target in replaced:
            continue
        if divisor is None:
            values[line.target] = graph.apply(line.op, *map(value, line.operands))
        else:
            (other,) = (operand for operand in line.operands if operand != divisor)
            values[line.target] = value(other) / value(replaced[divisor])
    return tuple(value(operand) for result in program.results for operand in result.operands)
