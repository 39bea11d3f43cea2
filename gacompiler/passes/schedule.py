"""Scheduling of shared scalar expressions: the order and the names of the lines of a program."""

from __future__ import annotations

from fractions import Fraction

from ..ir.program import Argument, Line, Operand, Program, Result
from ..ir.scalar import LEAVES, Op, Scalar
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

    placed: set[Scalar] = set()  # leaves, too, which need no line

    def measure(root: Scalar) -> None:
        stack = [root]
        while stack:
            node = stack[-1]
            if node in size:
                stack.pop()
                continue
            total = 1
            for argument in node.arguments:
                known = size.get(argument)
                if known is None:
                    stack.append(argument)
                    total = 0
                elif total:
                    total += known
            if not total:
                continue
            stack.pop()
            size[node] = total
            if node.op in LEAVES:
                placed.add(node)

    def place(root: Scalar) -> None:
        stack = [root]
        while stack:
            node = stack[-1]
            if node in placed:
                stack.pop()
                continue
            waiting = [argument for argument in node.arguments if argument not in placed]
            if waiting:
                stack.append(max(waiting, key=lambda a: (size[a], -a.index)) if len(waiting) > 1 else waiting[0])
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
