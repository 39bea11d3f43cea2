"""The text of the stored pages is the text that the benchmarks write now; only numbers differ."""

from __future__ import annotations

import re
from pathlib import Path

from test_benchmarks import made_up

from benchmarks import (
    chain,
    counts,
    estimation,
    evidence,
    growth,
    report,
    robots,
    signals,
    subspaces,
    tasks,
    toolkit,
    tracking,
    vision,
)
from tests.support.all_cases import all_cases

DOCS = Path(__file__).parents[2] / "docs"
POINT = growth.Point(1.0, 1, 1)
ORDERS = {(kind, order): (chain.Pair(1.0, 1.0),) * 3 for kind in chain.TYPES for order in chain.ORDERS}
TASK = tasks.Task("task", 1, {})

PAGES = {
    "benchmarks": report.page(made_up((1e-6, 80e-9), (2e-6, None))),
    "numba": chain.page([chain.Row("kernel", ORDERS)], [], chain.SIZES),
    "evidence": evidence.page([(evidence.ROWS[0], (1, 0, 0))], {}),
    "growth": growth.page([growth.Curve("full product", "orthonormal", {2: POINT}, {2: POINT})], 10, "growth.svg"),
    "operation-counts": "\n".join(counts._opening([], 20)),
    "robot-speed": robots._opening(25, 10_000),
    "signals": signals.page([signals.Row("transform", "", 1.0, 0.0, 0.5)]),
    "subspaces": subspaces.page(
        [
            subspaces.Row(
                3,
                1,
                1,
                dict.fromkeys(
                    (
                        *("halves", "reduced factors", "checked", "orthonormal", "averaged", "outer product", "join"),
                        *("join, shared", "join, factored", "clifford outer", "clifford factors", "clifford join"),
                    ),
                    1.0,
                ),
            )
        ],
        {"operation": 1.0},
        2000,
        7,
    ),
    "toolkit-speed": toolkit.page(
        [toolkit.Row("closest points of circles", 1.0, 1.0, 1.0)],
        [toolkit.OperatorRow("sum", dict.fromkeys(("gacompiler", "clifford", "kingdon"), 1.0))],
        1000,
        7,
    ),
    "estimation-speed": estimation.page([(TASK, {tasks.OURS: 1.0})], 15),
    "tracking-speed": tracking.page([(TASK, {tasks.OURS: 1.0})], 15),
    "vision-speed": vision.page([(TASK, {tasks.OURS: 1.0})], 15),
}
"""Pages of made-up results, or their introductions."""

DIFFER = ("Target:", "Missed targets:", "- Not installed", "- The backends", "kingdon is not installed", "!")
"""Paragraphs that depend on results or on the machine."""


def paragraphs(text: str) -> set[str]:
    """Headings, paragraphs, list items and headers of tables, without line breaks and with 0 for all numbers."""
    found = set()
    for block in re.split(r"\n\n|\n(?=- )", text):
        first = " ".join(block.split("\n|---")[0].split("\n| ---")[0].split())
        found.add(re.sub(r"None|\d+(?:[.,]\d+)*", "0", first))
    return found


@all_cases("name", PAGES)
def test_stored_pages_have_the_text_that_is_written(name: str) -> None:
    stored = paragraphs((DOCS / f"{name}.md").read_text())
    written = {text for text in paragraphs(PAGES[name]) if not text.startswith(DIFFER)}
    if name == "benchmarks":  # the columns depend on the numbers of elements
        written = {text for text in written if not text.startswith("|")}
    assert len(written) > 1 or name == "robot-speed"
    assert written <= stored | {""}, written - stored


def test_made_up_text_is_not_in_the_pages() -> None:
    assert not paragraphs("Some text that no page has.") <= paragraphs(PAGES["benchmarks"])
