"""Distribution of compile times and operation counts over random kernels in random algebras.

Each kernel is a random tree of products, involutions, norms and sandwiches on random layouts of an algebra of at most
six dimensions with a random metric: orthonormal, degenerate, null pairs, or an arbitrary Gram matrix. The kernels
depend only on the seed, so two versions of the compiler compile the same ones.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import gacompiler as ga
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.layout import Layout
from gacompiler.errors import GacError
from gacompiler.frontend.kernel import Kernel, kernel
from gacompiler.passes.pipeline import compile_kernel

LARGEST_DIMENSION = 6
MOST_BLADES = 10
"""Maximum number of coefficients of a parameter."""
BINARY: tuple[Callable[[Any, Any], Any], ...] = (
    lambda a, b: a * b,
    lambda a, b: a ^ b,
    lambda a, b: a & b,
    lambda a, b: a + b,
    lambda a, b: a - b,
    ga.left_contraction,
    ga.right_contraction,
    ga.inner_product,
    ga.scalar_product,
    ga.commutator,
    ga.anticommutator,
    ga.sandwich,
)
UNARY: tuple[Callable[[Any], Any], ...] = (
    lambda a: -a,
    lambda a: ~a,
    ga.grade_involution,
    ga.clifford_conjugate,
    ga.dual,
    ga.undual,
    ga.norm_squared,
    lambda a: a.grade(0, 2),
    lambda a: a.grade(1),
)
GROUPS = ((1, 4), (5, 6))
"""Ranges of dimensions that the table shows separately."""


@dataclass(frozen=True, slots=True)
class Measured:
    """The compilation of one kernel.

    Attributes
    ----------
    number : int
        The number of the kernel, from which it is made.
    dimension : int
    metric : str
    seconds : float
        CPU time of all stages.
    total : int
        Weighted number of operations.
    operations : tuple of int
        Multiplications, additions and divisions.
    error : str
        The reason why the kernel is refused, or an empty string.
    """

    number: int
    dimension: int
    metric: str
    seconds: float
    total: int
    operations: tuple[int, int, int]
    error: str


def random_kernel(seed: int, number: int) -> tuple[Kernel, str]:
    """Return the kernel of this number and the kind of its metric."""
    random = Random(f"{seed} {number}")
    n = random.randint(1, LARGEST_DIMENSION)
    metric = random.choice(("orthonormal", "degenerate", "null pairs", "oblique"))
    algebra = Algebra(f"R{number}", [f"e{k + 1}" for k in range(n)], _gram(random, n, metric))
    parameters = {name: _layout(random, algebra, name) for name in "abc"[: random.randint(1, 3)]}
    names = ", ".join(parameters)
    tree = _tree(random, random.randint(1, 4), len(parameters))
    # The function needs named parameters, as the signature is compared with the types.
    function = eval(f"lambda {names}: tree(({names},))", {"tree": tree})
    function.__name__ = f"random_{number}"
    return kernel(**parameters)(function), metric


def _gram(random: Random, n: int, metric: str) -> list[list[Fraction]]:
    gram = [[Fraction(0)] * n for _ in range(n)]
    for k in range(n):
        gram[k][k] = Fraction(random.choice((1, 1, -1)))
    if metric == "degenerate":
        gram[random.randrange(n)] = [Fraction(0)] * n
        for k in range(n):
            gram[k] = [gram[k][j] if j == k else Fraction(0) for j in range(n)]
    if metric == "null pairs":
        for k in range(0, n - 1, 2):
            gram[k][k] = gram[k + 1][k + 1] = Fraction(0)
            gram[k][k + 1] = gram[k + 1][k] = Fraction(-1)
    if metric == "oblique":
        for j in range(n):
            for k in range(j):
                gram[j][k] = gram[k][j] = Fraction(random.choice((0, 0, 1, -1, 2)), random.choice((1, 2)))
    return gram


def _layout(random: Random, algebra: Algebra, name: str) -> Layout:
    spelled = [algebra.spelling(blade)[1] for blade in algebra.blades()]
    of_grade: dict[int, list[str]] = {}
    for blade, text in zip(algebra.blades(), spelled, strict=True):
        of_grade.setdefault(blade.bit_count(), []).append(text)
    kind = random.random()
    if kind < 0.25:
        chosen = of_grade[1]
    elif kind < 0.5:
        grades = range(0, algebra.dimension + 1, 2)
        chosen = [text for grade in grades for text in of_grade[grade]]
    elif kind < 0.7:
        chosen = of_grade[random.randint(0, algebra.dimension)]
    else:
        chosen = random.sample(spelled, random.randint(1, min(len(spelled), MOST_BLADES)))
    chosen = [text for text in spelled if text in chosen][:MOST_BLADES]
    fixed: dict[str, Fraction] = {}
    if random.random() < 0.35 and len(chosen) > 1:
        fixed[chosen.pop(random.randrange(len(chosen)))] = Fraction(random.choice((1, -1, 2)))
    return algebra.layout(f"L{name}", " ".join(chosen), fixed=fixed)


def _tree(random: Random, depth: int, n: int) -> Callable[[Sequence[Any]], Any]:
    if depth == 0:
        place = random.randrange(n)
        return lambda x: x[place]
    if random.random() < 0.3:
        unary, inner = random.choice(UNARY), _tree(random, depth - 1, n)
        return lambda x: unary(inner(x))
    binary = random.choice(BINARY)
    left = _tree(random, depth - 1, n)
    right = _tree(random, random.randint(0, depth - 1), n)
    return lambda x: binary(left(x), right(x))


def measure(seed: int, number: int, options: dict[str, Any]) -> Measured:
    """Compile one random kernel, which includes its proof."""
    made, metric = random_kernel(seed, number)
    dimension = made.parameters[0].layout.algebra.dimension
    start = time.process_time()
    try:
        cost = compile_kernel(made, **options).cost
    except GacError as error:
        return Measured(number, dimension, metric, time.process_time() - start, 0, (0, 0, 0), str(error)[:200])
    spent = time.process_time() - start
    return Measured(number, dimension, metric, spent, cost.total, (cost.mul, cost.add, cost.div), "")


def summary(found: Sequence[Measured]) -> str:
    """Return the distribution of times as a table in Markdown."""
    lines = ["| dimension | kernels | median | 95 % | 99 % | worst | operations |", "|---|---|---|---|---|---|---|"]
    for low, high in (*GROUPS, (1, LARGEST_DIMENSION)):
        chosen = [each for each in found if low <= each.dimension <= high]
        times = sorted(each.seconds for each in chosen)
        if times:
            at = [times[min(len(times) - 1, int(part * len(times)))] for part in (0.5, 0.95, 0.99)]
            cells = [f"{1000 * value:.1f} ms" for value in (*at, times[-1])]
            total = sum(each.total for each in chosen)
            lines.append(f"| {low} to {high} | {len(chosen)} | {' | '.join(cells)} | {total} |")
    refused = sum(bool(each.error) for each in found)
    return "\n".join([*lines, "", f"{refused} of {len(found)} kernels are refused; all others are verified."])


def main(arguments: list[str] | None = None) -> int:
    """Compile random kernels and print the distribution; the exit status is 0 unless a proof fails."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks random_kernels", description=__doc__)
    parser.add_argument("--count", type=int, default=2000, help="number of kernels [%(default)s]")
    parser.add_argument("--seed", type=int, default=1, help="seed of all kernels [%(default)s]")
    parser.add_argument("--effort", type=int, choices=range(4), default=1, help="effort level [%(default)s]")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every figure to this file")
    parser.add_argument("--compare", type=Path, metavar="FILE", help="list kernels that cost more than in this file")
    chosen = parser.parse_args(arguments)
    options = {} if chosen.effort == 1 else {"effort": chosen.effort}
    found = []
    for number in range(chosen.count):
        found.append(measure(chosen.seed, number, options))
        if sys.stderr.isatty() and number % 20 == 0:
            print(f"\r{number} of {chosen.count}", end="", file=sys.stderr)
    print(summary(found))
    slowest = sorted(found, key=lambda each: -each.seconds)[:5]
    print("\nslowest: " + ", ".join(f"{each.number} ({each.seconds:.2f} s, {each.metric})" for each in slowest))
    if chosen.json:
        rows = [[e.number, e.dimension, e.metric, e.seconds, e.total, e.operations, e.error] for e in found]
        chosen.json.write_text(json.dumps(rows))
    if chosen.compare:
        known = {row[0]: row for row in json.loads(chosen.compare.read_text())}
        for each in found:
            if each.number in known and each.total != known[each.number][4]:
                print(f"kernel {each.number}: {known[each.number][4]} -> {each.total}")
    failed = [each for each in found if "defect of the compiler" in each.error]
    for each in failed:
        print(f"kernel {each.number}: {each.error}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
