"""Draw the picture at the top of the README from the pages that the other benchmarks write."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib import rc_context
from matplotlib.figure import Figure

from . import pages

_DOCS = Path(__file__).parents[1] / "docs"
PICTURE = _DOCS / "overview.svg"
_METHODS = (
    *("forward", "forward_all", "jacobian", "mass_matrix", "inverse_dynamics", "gravity", "coriolis_matrix"),
    *("forward_dynamics", "inverse_dynamics_derivatives", "centroidal_momentum_matrix", "kinetic_energy"),
)


class Count(NamedTuple):
    """The operations of one expression: those of a kernel, and those of the code that kingdon generates."""

    own: int
    peer: int


class Ratio(NamedTuple):
    """The times of a call divided by that of Pinocchio, with specialised and with generic kernels."""

    method: str
    own: float
    any: float


def main(arguments: list[str] | None = None) -> int:
    """Draw the picture. Return the exit status, which is 0 unless the picture cannot be written."""
    out: Path = pages.options("overview", __doc__, PICTURE, quick=False).parse_args(arguments).out
    counts = read_counts((_DOCS / "operation-counts.md").read_text())
    ratios = read_ratios((_DOCS / "robot-speed.md").read_text(), "ur5")
    try:
        draw(out, counts, ratios)
    except OSError as error:
        return pages.report_failure("overview", out, error)
    print(f"{out}: {len(counts)} expressions, {len(ratios)} methods")
    return 0


def _rows(text: str) -> Iterator[list[str]]:
    """Yield the cells of the rows of all tables, including headers."""
    for line in text.splitlines():
        if line.startswith("|"):
            # A vertical line within backquotes does not end a cell.
            cells = re.findall(r"(?:`[^`]*`|[^|`])+", line)
            yield [cell.strip() for cell in cells]


def read_counts(text: str) -> list[Count]:
    """Return the counts in the page of operation counts, for the expressions that kingdon finished."""
    found, head = [], {}
    for cells in _rows(text):
        if cells[0] == "expression":
            head = {name: k for k, name in enumerate(cells)}
        elif head and len(cells) == len(head):
            peer = _total(cells[head["kingdon"]])
            own = _total(" ".join(cells[head[name]] for name in ("mul", "add", "others")))
            if own and peer:
                found.append(Count(own, peer))
    return found


def _total(cell: str) -> int:
    """Return the sum of the numbers in a cell such as ``40 / 38, 2 div``, and 0 for a dash."""
    return sum(map(int, re.findall(r"\d+", cell)))


def read_ratios(text: str, robot: str) -> list[Ratio]:
    """Return the ratios of one robot in the page of robots."""
    section = text.partition(f"## {robot}\n")[2].partition("\n## ")[0]
    times = {cells[0].strip("`"): cells[1:] for cells in _rows(section) if len(cells) == 6 and "`" in cells[0]}
    return [
        Ratio(
            method, float(times[method][0]) / float(times[method][4]), float(times[method][1]) / float(times[method][4])
        )
        for method in _METHODS
        if method in times
    ]


def draw(path: Path, counts: list[Count], ratios: list[Ratio]) -> None:
    """Write the picture deterministically: equal numbers give equal files."""
    with rc_context({"svg.hashsalt": "overview", "svg.fonttype": "none"}):
        figure = Figure(figsize=(11, 4), layout="constrained")
        left, right = figure.subplots(1, 2)
        _scatter(left, counts)
        _bars(right, ratios)
        unfinished = path.with_name(f".{path.name}")
        figure.savefig(unfinished, format="svg", metadata={"Date": None})
    unfinished.replace(path)


def _scatter(axis: Any, counts: list[Count]) -> None:
    most = max(max(count) for count in counts)
    axis.plot([1, most], [1, most], color="0.6", linewidth=1, label="equal")
    axis.scatter([count.peer for count in counts], [count.own for count in counts], s=18, alpha=0.7)
    axis.set(xscale="log", yscale="log", xlabel="operations, kingdon", ylabel="operations, gacompiler")
    axis.set_title(f"{len(counts)} expressions", fontsize=11)
    axis.legend(fontsize=8)
    axis.grid(alpha=0.3)


def _bars(axis: Any, ratios: list[Ratio]) -> None:
    rows = range(len(ratios))
    axis.barh([row + 0.2 for row in rows], [ratio.any for ratio in ratios], 0.38, label="generic kernels")
    axis.barh([row - 0.2 for row in rows], [ratio.own for ratio in ratios], 0.38, label="specialised kernels")
    axis.axvline(1, color="0.3", linewidth=1)
    axis.set_yticks(list(rows), [ratio.method for ratio in ratios], fontsize=8)
    axis.invert_yaxis()
    axis.set(xlabel="time of a call from Python, Pinocchio = 1")
    axis.set_title("UR5, one configuration", fontsize=11)
    axis.legend(fontsize=8)
    axis.grid(alpha=0.3, axis="x")
