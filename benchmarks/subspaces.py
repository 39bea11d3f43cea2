"""Compare factorisations, joins and meets of blades with outer products of the same size, and with clifford."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path

import numpy as np

from algorithms.subspaces import (
    Blade,
    FactoredBlade,
    FactoredVersor,
    factorize_blade,
    join,
    join_and_meet,
    outer_product,
    reduced_factors,
    split_bivectors,
)

from . import pages
from .libraries import installed
from .machine import version
from .markdown import paragraph
from .timing import minimum_times

PAGE = Path("docs/subspaces.md")
SIZES = ((3, 1, 1), (4, 1, 2), (5, 2, 2), (6, 2, 3), (7, 3, 3), (8, 3, 4), (9, 4, 4), (10, 4, 5), (12, 5, 5))
"""Dimensions, and the grades of the two blades to join. The grade of factorised blades is half the dimension."""
QUICK_SIZES = ((3, 1, 1), (5, 2, 2))
ROUNDS = 7
CLIFFORD = 6
"""Maximum dimension for clifford, which stores all coefficients of both blades."""


@dataclass(frozen=True, slots=True)
class Row:
    """Nanoseconds per element by name of the operation, for one size."""

    n: int
    a: int
    b: int
    times: dict[str, float]


def interleaved(calls: dict[str, Callable[[], object]], elements: int, rounds: int) -> dict[str, float]:
    """Return the minimum times in nanoseconds per element, over rounds that measure all calls alternately."""
    return {name: 1e9 * spent / elements for name, spent in minimum_times(calls, rounds).items()}


def measure(n: int, a: int, b: int, elements: int, rounds: int) -> Row:
    """Time all operations on random blades of one size."""
    random = np.random.default_rng(n)
    rows = random.normal(size=(elements, a + b, n))
    first, second = FactoredBlade.of_vectors(rows[:, :a]), FactoredBlade.of_vectors(rows[:, a:])
    one, two = first.coefficients(), second.coefficients()
    # blades with a common vector
    shared = FactoredBlade.of_vectors(np.concatenate([rows[:, :1], rows[:, a : a + b - 1]], 1)).coefficients()
    k = max(2, n // 2)
    halves = [
        FactoredBlade.of_vectors(part).coefficients()
        for part in np.split(random.normal(size=(elements, k, n)), [k // 2], 1)
    ]
    whole = outer_product(*halves)
    assert isinstance(whole, Blade)
    times = interleaved(
        {
            "outer product": lambda: outer_product(one, two),
            "join": lambda: join(one, two),
            "join, shared": lambda: join(one, shared),
            "join, factored": lambda: join_and_meet(first, second),
            "halves": lambda: outer_product(*halves),
            "reduced factors": lambda: reduced_factors(whole, None),
            "checked": lambda: reduced_factors(whole),
            "orthonormal": lambda: factorize_blade(whole),
        },
        elements,
        rounds,
    )
    times["averaged"] = interleaved({"": lambda: factorize_blade(whole, averaged=True)}, elements, 1)[""]
    if n <= CLIFFORD and installed("clifford"):
        times |= _clifford(n, rows[0], a, rounds)
    return Row(n, a, b, times)


def _clifford(n: int, rows: np.ndarray, a: int, rounds: int) -> dict[str, float]:
    import clifford

    layout, _ = clifford.Cl(n)
    vectors = [sum(c * v for c, v in zip(row, layout.basis_vectors_lst, strict=True)) for row in rows]
    one, two = (reduce(lambda u, v: u ^ v, part) for part in (vectors[:a], vectors[a:]))
    whole = one ^ two
    return interleaved(
        {
            "clifford outer": lambda: one ^ two,
            "clifford factors": lambda: whole.factorise(),
            "clifford join": lambda: one.join(two),
        },
        1,
        rounds,
    )


def measure_others(rounds: int) -> dict[str, float]:
    """Return microseconds per element for operations that are not compared with an outer product."""
    random = np.random.default_rng(0)
    blades = [FactoredBlade.of_vectors(random.normal(size=(100, k, 30))) for k in (14, 14)]
    versors = [FactoredVersor(random.normal(size=(4, 20, 30))) for _ in range(2)]
    bivectors = random.normal(size=(1000, 15))
    minkowski = np.array([1.0] * 5 + [-1.0])
    found = {
        "join and meet of two factored 14-blades, 30 dimensions": (lambda: join_and_meet(*blades), 100),
        "outer product of the same blades": (lambda: outer_product(*blades), 100),
        "product of two versors of 20 vectors each, 30 dimensions": (
            lambda: versors[0].geometric_product(versors[1]),
            4,
        ),
        "split of a bivector, 6 dimensions, Euclidean": (lambda: split_bivectors(bivectors, 6), 1000),
        "split of a bivector, 6 dimensions, one of them timelike": (
            lambda: split_bivectors(bivectors, 6, minkowski),
            1000,
        ),
    }
    return {name: interleaved({"": call}, count, rounds)[""] / 1000 for name, (call, count) in found.items()}


def page(rows: Sequence[Row], others: dict[str, float], elements: int, rounds: int) -> str:
    """Return the page as Markdown."""
    lines = [
        "# Subspaces",
        "",
        paragraph(
            "`python -m benchmarks subspaces` writes this page.",
            f"Times are nanoseconds per element for {elements} elements: the minimum over {rounds} rounds, in "
            "which operations are measured alternately.",
            "The numbers in parentheses are ratios to an outer product: that of two blades whose product is "
            "factorised, or that of the two blades to join.",
            "*n* is the dimension.",
        ),
        "",
        paragraph(
            "*Reduced factors* is the fastest factorisation.",
            "*Checked* also tests whether the element is a blade.",
            "*Orthonormal* factors include this test.",
            "*Averaged* factors are for noisy blades.",
            "*Join* checks that both arguments are blades.",
            "In *join, shared*, the blades have a common vector.",
            "In *join, factored*, they are given by factors, which need no check.",
        ),
        "",
    ]
    factors, joins = (
        ("reduced factors", "checked", "orthonormal", "averaged"),
        ("join", "join, shared", "join, factored"),
    )
    for names, base in ((factors, "halves"), (joins, "outer product")):
        lines += ["| n | grades | outer product | " + " | ".join(names) + " |"]
        lines += ["| ---: | --- |" + " ---: |" * (len(names) + 1)]
        for row in rows:
            k = max(2, row.n // 2)
            grades = (k // 2, k - k // 2) if base == "halves" else (row.a, row.b)
            outer = row.times[base]
            cells = [f"{row.times[name]:,.0f} ({row.times[name] / outer:.1f})" for name in names]
            lines.append(f"| {row.n} | {grades[0]}, {grades[1]} | {outer:,.0f} | " + " | ".join(cells) + " |")
        lines.append("")
    most = {
        what: max((row.times[name] / row.times[base], row.n) for row in rows for name in names)
        for what, names, base in (
            ("factors", ("reduced factors", "checked", "orthonormal"), "halves"),
            ("joins", ("join", "join, shared"), "outer product"),
        )
    }
    largest = [f"{ratio:.1f} for {what} (n = {n})" for what, (ratio, n) in most.items()]
    lines.append(f"The largest ratios, without averaged factors, are {' and '.join(largest)}.")
    peers = [row for row in rows if "clifford join" in row.times]
    if peers:
        lines += ["", f"clifford {version('clifford')}, in nanoseconds per element, one element at a time:", ""]
        lines += ["| n | grades | outer product | factors | join |", "| ---: | --- | ---: | ---: | ---: |"]
        for row in peers:
            cells = [f"{row.times[f'clifford {name}']:,.0f}" for name in ("outer", "factors", "join")]
            lines.append(f"| {row.n} | {row.a}, {row.b} | " + " | ".join(cells) + " |")
    lines += ["", "| other operations | µs per element |", "| --- | ---: |"]
    lines += [f"| {name} | {spent:,.1f} |" for name, spent in others.items()]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("subspaces", __doc__, PAGE).parse_args(arguments)
    out: Path = options.out
    elements, rounds = (50, 1) if options.quick else (2000, ROUNDS)
    rows = [measure(*size, elements, rounds) for size in (QUICK_SIZES if options.quick else SIZES)]
    text = page(rows, measure_others(1 if options.quick else 3), elements, rounds)
    return pages.publish("subspaces", out, text, f"{len(rows)} sizes")


if __name__ == "__main__":
    sys.exit(main())
