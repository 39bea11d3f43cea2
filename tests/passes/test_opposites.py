"""Differences in both directions are computed once; other programs do not change."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from gacompiler.ir.cost import cost
from gacompiler.ir.interpret import interpret
from gacompiler.ir.program import Argument, Program
from gacompiler.ir.scalar import Graph, Op, Scalar
from gacompiler.passes.opposites import share_opposites
from gacompiler.passes.schedule import schedule

NAMES = ("a", "b", "c", "d")


def program(scalars: list[Scalar]) -> Program:
    return schedule("f", (Argument("x", (4,), NAMES),), (("out", (len(scalars),), tuple(scalars)),))


def test_one_difference_serves_both_directions() -> None:
    graph = Graph()
    a, b, c, d = map(graph.variable, NAMES)
    used = [(a - b) * c, c + (b - a), d - (b - a), (b - a) * (b - a), b - a]
    shared = program(used)
    assert [line.op for line in shared.lines].count(Op.SUBTRACT) == 2  # a - b, and one of the two sums
    assert (cost(shared).mul, cost(shared).add) == (2, 3)
    x, y, z, w = values = tuple(map(Fraction, (2, 5, 7, 11)))
    expected = [(x - y) * z, z + (y - x), w - (y - x), (y - x) ** 2, y - x]
    assert list(interpret(shared, {"x": values})["out"]) == expected


def test_differences_that_become_opposite_are_shared_too() -> None:
    graph = Graph()
    a, b, c, d = map(graph.variable, NAMES)
    scalars = ((a - b) * c - d, d + (b - a) * c)
    assert cost(program(list(scalars))).add == 2


def test_other_programs_are_unchanged() -> None:
    graph = Graph()
    a, b, c, d = map(graph.variable, NAMES)
    scalars = (a - b, c - d, (a - c) * (b - d), -(a * b))
    assert share_opposites(scalars) == scalars


def test_random_graphs_keep_their_values_and_never_cost_more() -> None:
    rng = Random(5)
    for _ in range(60):
        graph = Graph()
        nodes = [graph.variable(name) for name in NAMES]
        for _ in range(30):
            x, y = rng.choices(nodes, k=2)
            nodes.append(rng.choice([x - y, y - x, x + y, x * y, -x]))
        live = tuple(node for node in nodes[-4:] if not node.is_constant)
        shared = share_opposites(live)
        values = {name: Fraction(rng.randint(-9, 9)) for name in NAMES}
        assert [value(node, values) for node in shared] == [value(node, values) for node in live]
        assert heavy(shared) <= heavy(live)
        differences = {node.arguments for node in reachable(shared) if node.op is Op.SUBTRACT}
        assert not any(arguments[::-1] in differences for arguments in differences)


def value(node: Scalar, values: dict[str, Fraction]) -> Fraction:
    match node.op:
        case Op.CONSTANT:
            return Fraction(node.value)
        case Op.VARIABLE:
            return values[str(node.value)]
        case Op.NEGATE:
            return -value(node.arguments[0], values)
    x, y = (value(argument, values) for argument in node.arguments)
    return x + y if node.op is Op.ADD else x - y if node.op is Op.SUBTRACT else x * y


def reachable(roots: tuple[Scalar, ...]) -> set[Scalar]:
    found = set(roots)
    for node in sorted(found, key=lambda each: -each.index):
        found |= reachable(node.arguments)
    return found


def heavy(roots: tuple[Scalar, ...]) -> int:
    return sum(node.op in (Op.ADD, Op.SUBTRACT, Op.MULTIPLY) for node in reachable(roots))
