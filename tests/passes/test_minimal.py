"""Proofs that a kernel takes the fewest possible operations, and the search on which they are based."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations_with_replacement
from random import Random
from typing import Any

import pytest

from benchmarks.exhaustive import exists
from benchmarks.minimal import is_small, text
from gacompiler import join, kernel, norm_squared
from gacompiler.algebra.catalog import COMPLEX, PGA2, VGA2
from gacompiler.frontend.kernel import Kernel
from gacompiler.inspect import why
from gacompiler.passes.minimal import NUMBERS, PRIME, Problem, problem, proved_minimum, up_to_sign
from gacompiler.passes.minimal_counts import PROVED
from gacompiler.passes.pipeline import compile_kernel
from tests.support.all_cases import all_cases


@kernel(a=PGA2.POINT, b=PGA2.POINT)
def line(a: Any, b: Any) -> Any:
    return join(a, b)


@kernel(z=COMPLEX.NUMBER, w=COMPLEX.NUMBER)
def product(z: Any, w: Any) -> Any:
    return z * w


@kernel(r=VGA2.ROTOR)
def twice(r: Any) -> Any:
    return r * r


MINIMA = {line: 5, product: 6, twice: 4}


@pytest.mark.parametrize("each", MINIMA, ids=lambda each: each.name)
def test_the_search_proves_what_the_table_has(each: Kernel) -> None:
    program = compile_kernel(each, forms=False).program
    found = problem(each, program)
    assert found is not None and PROVED[found.key] == MINIMA[each]
    assert not exists(found, MINIMA[each] - 1)
    assert exists(found, MINIMA[each])
    assert proved_minimum(each, program) == MINIMA[each]


def test_names_do_not_matter() -> None:
    @kernel(first=PGA2.POINT, second=PGA2.POINT)
    def through(first: Any, second: Any) -> Any:
        """The line through two points."""
        return first & second

    assert proved_minimum(through, compile_kernel(through, forms=False).program) == MINIMA[line]


def test_explanations_report_a_proved_minimum() -> None:
    assert "minimal, proved: " in why(compile_kernel(line, forms=False))
    assert "proved: no program" not in why(compile_kernel(line, forms=False, cost="size"))
    worse = compile_kernel(twice, forms=False, effort=0)
    assert worse.cost.mul + worse.cost.add > MINIMA[twice] and "at least 4 operations, proved: " in why(worse)


def test_divisions_are_no_part_of_the_problem() -> None:
    @kernel(v=VGA2.VECTOR)
    def inverse(v: Any) -> Any:
        return 1 / norm_squared(v)

    assert problem(inverse, compile_kernel(inverse, forms=False).program) is None


def values_of(expressions: list[tuple[int, ...]]) -> Problem:
    """The problem with two inputs and given results, which are triples of exponents and a factor."""
    points = [(Fraction(3, 7), Fraction(-5, 11)), (Fraction(13, 3), Fraction(8, 5))]

    def residue(value: Fraction) -> int:
        return value.numerator * pow(value.denominator, -1, PRIME) % PRIME

    inputs = [tuple(residue(point[k]) for point in points) for k in range(2)] + [(n, n) for n in NUMBERS]
    results = []
    for terms in expressions:
        total = [
            sum((f * p[0] ** i * p[1] ** j for i, j, f in zip(*[iter(terms)] * 3, strict=True)), Fraction())
            for p in points
        ]
        results.append(up_to_sign(tuple(map(residue, total))))
    return Problem(tuple(map(up_to_sign, inputs)), tuple(results))


@all_cases(
    "terms, least",
    [
        ((8, 0, 1), 3),  # x**8
        ((7, 0, 1), 4),
        ((15, 0, 1), 5),
        ((2, 0, 1, 0, 2, -1), 3),  # x**2 - y**2 = (x - y) (x + y)
        ((2, 0, 1, 1, 1, 2, 0, 2, 1), 2),  # (x + y)**2
        ((1, 0, 3), 2),  # 3 x
        ((1, 0, 16), 3),  # (2 + 2)**2 x
        ((2, 0, 1, 0, 0, 1), 2),  # x**2 + 1
    ],
)
def test_known_minima(terms: tuple[int, ...], least: int) -> None:
    """Addition chains of exponents and factors, and factorised polynomials."""
    found = values_of([terms])
    assert [exists(found, n) for n in range(1, least + 1)] == [False] * (least - 1) + [True]


def brute_force(given: Problem, most: int) -> bool:
    """Whether a sequence of at most `most` operations contains the results, without any shortcut."""

    def descend(values: tuple[tuple[int, ...], ...], left: int) -> bool:
        if all(result in values for result in given.results):
            return True
        if not left:
            return False
        pairs = list(combinations_with_replacement(values, 2))
        new = dict.fromkeys(
            up_to_sign(tuple(operation(x, y) % PRIME for x, y in zip(a, b, strict=True)))
            for a, b in pairs
            for operation in (int.__add__, int.__sub__, int.__mul__)
        )
        return any(descend((*values, value), left - 1) for value in new if value not in values)

    return descend(given.inputs, most)


@all_cases("seed", range(12))
def test_the_search_agrees_with_brute_force(seed: int) -> None:
    rng = Random(seed)
    inputs = [(rng.randrange(1, PRIME), rng.randrange(1, PRIME)) for _ in range(2)] + [(1, 1)]
    values = list(inputs)
    for _ in range(3):
        a, b = rng.choice(values), rng.choice(values)
        operation = rng.choice((int.__add__, int.__sub__, int.__mul__))
        values.append((operation(a[0], b[0]) % PRIME, operation(a[1], b[1]) % PRIME))
    results = {up_to_sign(each) for each in values[-rng.choice((1, 2)) :] if any(each)}
    given = tuple(map(up_to_sign, inputs))
    found = Problem(given, tuple(sorted(results - set(given))))
    for n in range(4):
        assert exists(found, n) == brute_force(found, n), n


def test_the_table_is_written_as_it_is_read() -> None:
    written = text({"ab": (3, ["pga2.join_points", "join"]), "cd": (2, ["a"])})
    names: dict[str, Any] = {}
    exec(written, names)
    assert names["PROVED"] == {"ab": 3, "cd": 2}
    assert not is_small(values_of([(8, 0, 1)]), 30) and is_small(values_of([(8, 0, 1)]), 3)
