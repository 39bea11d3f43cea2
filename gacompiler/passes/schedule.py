"""Scheduling of shared scalar expressions: the order and the names of the lines of a program."""

from __future__ import annotations

from fractions import Fraction

from ..ir.program import Argument, Line, Operand, Program, Result
from ..ir.scalar import Op, Scalar
from ..ir.verify import verify
from .opposites import share_opposites


def schedule(
    name: str, arguments: tuple[Argument, ...], results: tuple[tuple[str, tuple[int, ...], tuple[Scalar, ...]], ...]
) -> Program:
    """Order lines depth first, as the results need them, so that lifetimes of values are short.

    The operand with the larger subexpression is scheduled first.
    """
    shared = iter(share_opposites([scalar for _, _, scalars in results for scalar in scalars]))
    results = tuple((result, shape, tuple(next(shared) for _ in scalars)) for result, shape, scalars in results)
    order: list[Scalar] = []
    size: dict[Scalar, int] = {}

    def measure(root: Scalar) -> None:
        stack = [root]
        while stack:
            node = stack[-1]
            missing = [argument for argument in node.arguments if argument not in size]
            if missing:
                stack.extend(missing)
            else:
                size[node] = 1 + sum(size[argument] for argument in node.arguments)
                stack.pop()

    placed: set[Scalar] = set()

    def place(root: Scalar) -> None:
        stack = [root]
        while stack:
            node = stack[-1]
            if node in placed or node.op in (Op.CONSTANT, Op.VARIABLE):
                stack.pop()
                continue
            waiting = [a for a in node.arguments if a not in placed and a.op not in (Op.CONSTANT, Op.VARIABLE)]
            if waiting:
                stack.append(max(waiting, key=lambda a: (size[a], -a.index)))
            else:
                stack.pop()
                placed.add(node)
                order.append(node)

    for _, _, scalars in results:
        for scalar in scalars:
            measure(scalar)
            place(scalar)
    taken = {component for argument in arguments for component in argument.components}
    names: dict[Scalar, str] = {}
    counter = 0
    for node in order:
        while f"t{counter}" in taken:
            counter += 1
        names[node] = f"t{counter}"
        counter += 1

    def operand(node: Scalar) -> Operand:
        if node.op is Op.CONSTANT:
            return Fraction(node.value)
        return str(node.value) if node.op is Op.VARIABLE else names[node]

    lines = tuple(Line(names[node], node.op, tuple(map(operand, node.arguments))) for node in order)
    outputs = tuple(Result(n, shape, tuple(map(operand, scalars))) for n, shape, scalars in results)
    return verify(Program(name, arguments, lines, outputs))
