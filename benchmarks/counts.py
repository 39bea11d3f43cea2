"""Compare operation counts of known expressions with the structure as written, published counts and kingdon."""

from __future__ import annotations

import argparse
import math
import operator
import re
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gacompiler.ir.cost import WEIGHTS, Cost
from gacompiler.passes.bounds import lower_bound
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.record import Compilation

from . import pages
from .kingdon_counts import Unsupported, count
from .kingdon_counts import compile_kernel as compile_peer
from .known import Known, known
from .libraries import installed
from .machine import version
from .markdown import paragraph
from .worker import TimeLimitExceeded, Worker

PAGE = Path("docs/operation-counts.md")
LIMIT = 20.0
"""Time limit of kingdon for one expression, in seconds."""
_HEADER = (
    "expression", "definition", "mul", "add", "others", "FMA", "as written", "published", "at least", "kingdon", "ms",
    "kingdon ms",
)  # fmt: skip
_MISSING = "–"


@dataclass(frozen=True, slots=True)
class Peer:
    """The counts of kingdon for one expression. If `found` is None, `reason` is why there are no counts."""

    found: tuple[int, int, int] | None
    seconds: float
    reason: str = ""

    @property
    def total(self) -> int | None:
        """The weighted sum of the counts, with the weights that the compiler uses."""
        if self.found is None:
            return None
        mul, add, div = self.found
        return mul * WEIGHTS["mul"] + add * WEIGHTS["add"] + div * WEIGHTS["div"]


@dataclass(frozen=True, slots=True)
class Row:
    """One expression."""

    known: Known
    record: Compilation
    seconds: float
    peer: Peer | None

    @property
    def written(self) -> Cost:
        """The cost of the author's own structure."""
        return self.record.candidates[0].cost


def peer_count(name: str) -> tuple[tuple[int, int, int], float]:
    """Return kingdon's products, sums and divisions for one expression, and its time; runs in another process."""
    found = count(known()[name].kernel)
    return (found.mul, found.add, found.div), found.seconds


def peer_values(name: str, numbers: Sequence[float]) -> tuple[list[float], tuple[float, ...]]:
    """Return the values of one expression by kingdon, and the factors of its blades; runs in another process."""
    found = compile_peer(known()[name].kernel)
    return list(found.function(numbers)), found.factors


def count_with_kingdon(worker: Worker, name: str, limit: float) -> Peer:
    """Return the counts of kingdon, or the reason why there are none."""
    try:
        found, seconds = worker(name)
    except TimeLimitExceeded:
        return Peer(None, limit, f"> {limit:g} s")
    except Unsupported as error:
        return Peer(None, math.nan, str(error))
    return Peer(found, seconds)


def measure(each: Known, worker: Worker | None, limit: float) -> Row:
    """Compile one expression with gacompiler and, given a worker, with kingdon."""
    start = time.perf_counter()
    record = compile_kernel(each.kernel)
    seconds = time.perf_counter() - start
    return Row(each, record, seconds, None if worker is None else count_with_kingdon(worker, each.kernel.name, limit))


def count_cells(each: Known, record: Compilation) -> tuple[str, ...]:
    """Return the cells of one row that depend neither on time measurements nor on other libraries."""
    assert record.trace is not None
    cost, written = record.cost, record.candidates[0].cost
    definition = ", ".join(f"`{_short(str(expression))}`" for expression in record.trace.expressions)
    published = _MISSING if each.published is None else "{} / {}".format(*each.published)
    bound = lower_bound(each.kernel, record.program)
    least = _MISSING if bound is None else f"{bound.products} / {bound.operations}"
    return (
        each.kernel.name, definition.replace("|", "\\|"), str(cost.mul), str(cost.add), _others(cost.as_dict()),
        str(cost.fma), _pair(written), published, least,
    )  # fmt: skip


def table_cells(text: str) -> dict[str, tuple[str, ...]]:
    """Return the cells of every row of a page, by name: those of `count_cells`, kingdon's count and times."""
    rows = [
        tuple(cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1])
        for line in text.splitlines()
        if line[:1] == "|"
    ]
    return {row[0]: row for row in rows if len(row) == len(_HEADER) and row[0] in known()}


def page(rows: Sequence[Row], limit: float) -> str:
    """Return the page as Markdown, grouped by algebra."""
    lines = [*_opening(rows, limit)]
    for algebra in dict.fromkeys(row.known.algebra for row in rows):
        lines += [f"## {algebra}", "", *_table(row for row in rows if row.known.algebra == algebra), ""]
    return "\n".join(lines).rstrip() + "\n"


def _opening(rows: Sequence[Row], limit: float) -> list[str]:
    published = sum(row.known.published is not None for row in rows)
    peers = [(row, row.peer.total) for row in rows if row.peer is not None and row.peer.total is not None]
    late = sum(row.peer is not None and row.peer.reason.startswith(">") for row in rows)
    lines = [
        "# Operation counts",
        "",
        paragraph(
            "`make bench PAGE=operation-counts` writes this page; do not edit it by hand.",
            "Tests compare the counts with those of the current compiler.",
        ),
        "",
        paragraph(
            f"The {len(rows)} expressions are defined in `tests/support/known`: {published} of them have published "
            f"counts, and {len(rows) - published} are further ones.",
            "Products with constants count as products, and negations are free.",
            "*FMA* is the number of instructions for products and sums on a machine with fused multiply-add.",
            "*As written* is the count of the expression as written, operation by operation, without unused "
            "operations.",
            "*Published* is the best published count.",
            "*At least* are lower bounds for every program: products and divisions, and all operations "
            "(`gac cost --bound`).",
            "Times are those of one compilation, including the proof.",
        ),
        "",
    ]
    if any(row.peer is not None for row in rows):
        more, equal, fewer = (
            sum(compare(_operations(row), row.record.cost.total) for row, _ in peers)
            for compare in (operator.gt, operator.eq, operator.lt)
        )
        lines += [
            paragraph(
                f"*kingdon* is kingdon {version('kingdon')}, which receives the same expression in its own "
                "operators and polynomials.",
                "Its generated code is counted by the same rules.",
                "Its sandwich product requires normalised versors, like that of gacompiler.",
                "It has no null vectors, so expressions with null vectors are tried in two forms, in the "
                "coefficients of gacompiler and in those of orthogonal vectors; the lower count is shown.",
                f"The time limit is {limit:g} s.",
            ),
            "",
            paragraph(
                f"kingdon finished {len(peers)} expressions and did not finish {late}.",
                f"Compared with gacompiler, it needs more operations for {more} of them, the same number for {equal}, "
                f"and fewer for {fewer}.",
                f"The geometric mean of the ratios of the counts is {_mean_ratio(peers):.2f}.",
            ),
            "",
        ]
    else:
        lines += ["kingdon is not installed, so its columns are empty. `make .venv/.peers` installs it.", ""]
    return lines


def _operations(row: Row) -> int:
    assert row.peer is not None and row.peer.total is not None
    return row.peer.total


def _mean_ratio(peers: Sequence[tuple[Row, int]]) -> float:
    ratios = [math.log(total / row.record.cost.total) for row, total in peers if total and row.record.cost.total]
    return math.exp(sum(ratios) / len(ratios)) if ratios else math.nan


def _table(rows: Iterable[Row]) -> list[str]:
    lines = ["| " + " | ".join(_HEADER) + " |", "|" + " --- |" * 2 + " ---: |" * 2 + " --- |" + " ---: |" * 7]
    for row in rows:
        cells = (*count_cells(row.known, row.record), *_peer_cells(row))
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _peer_cells(row: Row) -> tuple[str, str, str]:
    own = _milliseconds(row.seconds)
    if row.peer is None:
        return _MISSING, own, _MISSING
    if row.peer.found is None:
        late = row.peer.reason.startswith(">")
        return _MISSING, own, row.peer.reason if late else _MISSING
    mul, add, div = row.peer.found
    return f"{mul} / {add}" + (f", {div} div" if div else ""), own, _milliseconds(row.peer.seconds)


def _pair(cost: Cost) -> str:
    others = _others(cost.as_dict())
    return f"{cost.mul} / {cost.add}" + (f", {others}" if others else "")


def _others(counts: dict[str, int]) -> str:
    return ", ".join(f"{counts[name]} {name}" for name in ("div", "sqrt", "call", "choice") if counts[name])


def _short(text: str) -> str:
    """Return the text without parentheses that enclose all of it."""
    depth = 0
    for k, letter in enumerate(text):
        depth += (letter == "(") - (letter == ")")
        if depth == 0 and k < len(text) - 1:
            return text
    return text[1:-1] if text[:1] == "(" else text


def _milliseconds(seconds: float) -> str:
    return f"{1000 * seconds:.0f}" if seconds >= 0.01 else f"{1000 * seconds:.1f}"


def measure_all(limit: float, progress: Callable[[str], None]) -> list[Row]:
    """Measure every expression; `progress` is called with the name of each."""
    rows = []
    with Worker(peer_count, limit) as worker:
        for name, each in known().items():
            progress(name)
            rows.append(measure(each, worker if installed("kingdon") else None, limit))
    return rows


def main(arguments: list[str] | None = None) -> int:
    """Count, and write the page; arguments are those of the command line, or by default of the process."""
    options = _parser().parse_args(arguments)
    with pages.progress() as bar:
        counting = bar.add_task("count", total=len(known()))
        rows = measure_all(options.limit, lambda name: bar.update(counting, advance=1, description=f"count {name}"))
    return pages.publish("counts", options.out, page(rows, options.limit), f"{len(rows)} expressions counted")


def _parser() -> argparse.ArgumentParser:
    parser = pages.options("counts", __doc__, PAGE, quick=False)
    parser.add_argument(
        "--limit",
        type=float,
        default=LIMIT,
        metavar="SECONDS",
        help="time limit of kingdon for one expression [%(default)s]",
    )
    return parser
