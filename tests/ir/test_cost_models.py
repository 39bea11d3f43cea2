"""Cost models on programs whose costs are known."""

from __future__ import annotations

import random

import pytest

from gacompiler.errors import KernelError
from gacompiler.ir.contraction import contracted
from gacompiler.ir.cost_models import COUNTS, MODELS, cost_model
from gacompiler.ir.latency import UNITS, cycles
from gacompiler.ir.program import Argument, Line, Program, Result
from gacompiler.ir.scalar import Op
from tests.support.all_cases import all_cases


def program(*lines: tuple[str, Op, tuple[str, ...]], stored: tuple[str, ...] = ()) -> Program:
    names = (lines[-1][0], *stored)
    inputs = tuple(Argument(name, (), (name,)) for name in "abcdefgh")
    return Program("f", inputs, tuple(Line(*line) for line in lines), (Result("out", (len(names),), names),))


def test_a_chain_takes_the_sum_of_its_latencies() -> None:
    chain = [("t0", Op.ADD, ("a", "b"))] + [(f"t{k}", Op.ADD, (f"t{k - 1}", "c")) for k in range(1, 7)]
    assert cycles(program(*chain)) == 7 * 4
    assert cycles(program(("t", Op.DIVIDE, ("a", "b")), ("u", Op.SQRT, ("t",)))) == 13 + 18
    assert cycles(program(("t", Op.SIN, ("a",)), ("u", Op.NEGATE, ("t",)), ("v", Op.ADD, ("u", "a")))) == 50 + 4


def test_independent_instructions_share_two_units() -> None:
    def sums(count: int) -> Program:
        return program(*((f"t{k}", Op.ADD, ("a", "b")) for k in range(count)))

    assert [cycles(sums(count)) for count in (1, 2, 3, 4, 5, 9)] == [4, 4, 5, 5, 6, 8]


def test_divisions_share_one_divider() -> None:
    def divisions(count: int) -> Program:
        return program(*((f"t{k}", Op.DIVIDE, ("a", "b")) for k in range(count)))

    assert [cycles(divisions(count)) for count in (1, 2, 4)] == [13, 17, 25]
    roots = program(("t", Op.SQRT, ("a",)), ("u", Op.SQRT, ("b",)), ("v", Op.DIVIDE, ("a", "b")))
    assert cycles(roots) == 6 + 6 + 13
    beside = program(("t", Op.DIVIDE, ("a", "b")), ("u", Op.ADD, ("a", "b")), ("v", Op.DIVIDE, ("u", "b")))
    assert cycles(beside) == 4 + 13


def test_a_product_used_in_sums_only_is_contracted() -> None:
    product = ("t", Op.MULTIPLY, ("a", "b"))
    once = program(product, ("u", Op.ADD, ("t", "c")))
    twice = program(product, ("u", Op.ADD, ("t", "c")), ("v", Op.SUBTRACT, ("u", "t")))
    two = program(product, ("u", Op.MULTIPLY, ("c", "d")), ("v", Op.ADD, ("t", "u")))
    doubled = program(product, ("v", Op.ADD, ("t", "t")))
    squared = program(product, ("u", Op.ADD, ("t", "c")), ("v", Op.MULTIPLY, ("t", "u")))
    stored = program(product, ("u", Op.ADD, ("t", "c")), stored=("t",))
    programs = (once, twice, two, doubled, squared, stored)
    assert [sorted(contracted(each)) for each in programs] == [["t"], ["t"], ["t"], [], [], []]
    assert [cycles(each) for each in programs[:3]] == [4, 8, 8]
    assert [MODELS["fma"].of(each) for each in programs[:3]] == [1, 2, 2]
    assert [COUNTS.of(each) for each in programs[:3]] == [2, 3, 3]


def test_contracted_products_share_no_sum() -> None:
    rng = random.Random(4)
    for _ in range(200):
        values, lines = list("abcdefgh"), []
        for k in range(rng.randint(2, 30)):
            op = rng.choice((Op.ADD, Op.SUBTRACT, Op.MULTIPLY, Op.MULTIPLY))
            lines.append((f"t{k}", op, tuple(rng.sample(values[-10:], 2))))
            values.append(f"t{k}")
        found = program(*lines)
        sums = {line.target for line in found.lines if line.op in (Op.ADD, Op.SUBTRACT)}
        merged = contracted(found)
        for target in merged:
            users = [line.target for line in found.lines if target in line.operands]
            assert users and set(users) <= sums
        assert all(len(merged.intersection(map(str, line.operands))) <= 1 for line in found.lines)


def test_a_balanced_sum_is_faster_than_a_chain_of_the_same_size() -> None:
    chain = [("t0", Op.ADD, ("a", "b"))] + [(f"t{k}", Op.ADD, (f"t{k - 1}", x)) for k, x in enumerate("cdefgh", 1)]
    pairs = [(f"p{k}", Op.ADD, (x, y)) for k, (x, y) in enumerate(("ab", "cd", "ef", "gh"))]
    tree = [*pairs, ("q0", Op.ADD, ("p0", "p1")), ("q1", Op.ADD, ("p2", "p3")), ("r", Op.ADD, ("q0", "q1"))]
    assert cycles(program(*tree)) == 13 < cycles(program(*chain)) == 28
    assert MODELS["size"].of(program(*tree)) == MODELS["size"].of(program(*chain)) == 7


@all_cases("seed", range(20))
def test_cycles_lie_between_the_bounds_of_any_schedule(seed: int) -> None:
    """At least the longest path and the work of the units, at most the sum of both (Graham 1966)."""
    rng = random.Random(seed)
    values = list("abcdefgh")
    lines = []
    depth = dict.fromkeys(values, 0)
    for k in range(rng.randint(1, 60)):
        operands = tuple(rng.choices(values[-8:] if rng.random() < 0.7 else values, k=2))
        depth[f"t{k}"] = 4 + max(depth[each] for each in operands)
        lines.append((f"t{k}", Op.ADD, operands))
        values.append(f"t{k}")
    longest, work = max(depth.values()), -(-len(lines) // UNITS)
    assert max(longest, work + 3) <= cycles(program(*lines)) <= longest + work


def test_divisions_weigh_as_much_as_sums_in_the_size_only() -> None:
    divided = program(("t", Op.DIVIDE, ("a", "b")), ("u", Op.NEGATE, ("t",)))
    assert {name: model.of(divided) for name, model in MODELS.items()} == {
        "counts": 8,
        "latency": 13,
        "fma": 8,
        "size": 1,
    }


def test_unknown_models_are_refused() -> None:
    assert cost_model("latency") is MODELS["latency"]
    for name in ("speed", "", None, 1):
        with pytest.raises(KernelError, match="one of counts, latency, fma, size"):
            cost_model(name)  # type: ignore[arg-type]
