"""The text of ``docs/toolkit.md``. ``python tests/support/toolkit_page.py`` updates the page."""

from __future__ import annotations

import sys
from pathlib import Path

import toolkit_cga
import toolkit_geometry
import toolkit_pga
from toolkit_table import Entry

from algorithms.geometry.kinds import KINDS
from algorithms.geometry.pairs import ANGLES, DISTANCES, PROJECTIONS

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "toolkit.md"
TITLES = {
    "pga3": "Points, lines, planes and motors of space: `generated.pga3`",
    "pga2": "Points, lines and motors of the plane: `generated.pga2`",
    "motors": "Means, curves and fits of motors: `algorithms.motors`",
    "cga3": "Conformal geometry of space: `generated.cga3`",
    "cga2": "Conformal geometry of the plane: `generated.cga2`",
    "geometry": "Any two kinds, fits, curves and surfaces: `algorithms.geometry`",
    "subspaces": "Blades and versors of any dimension: `algorithms.subspaces`",
}


def entries() -> tuple[Entry, ...]:
    """All rows, grouped by module."""
    found = (*toolkit_pga.ENTRIES, *toolkit_cga.ENTRIES, *toolkit_geometry.ENTRIES)
    return tuple(sorted(found, key=lambda entry: list(TITLES).index(entry.algebra)))


def module(algebra: str) -> str:
    return f"algorithms.{algebra}" if algebra in ("motors", "geometry", "subspaces") else f"generated.{algebra}"


def pairs() -> list[str]:
    """The table of the pairs of kinds that `algorithms.geometry` takes."""
    lines = ["| | distance | angle | meet | projected on the other |", "|---|---|---|---|---|"]
    for k, a in enumerate(KINDS):
        for b in list(KINDS)[k:]:
            onto = []
            if a == "point pair" or (a, b) in PROJECTIONS:
                onto.append(a)
            if a != b and (b == "point pair" or (b, a) in PROJECTIONS):
                onto.append(b)
            meets = {("line", "line"): "point", ("line", "plane"): "point", ("plane", "plane"): "line"}
            rounds = "circle" if {a, b} <= {"plane", "sphere"} else "point pair"
            met = "points of it" if "point" in a else meets.get((a, b), rounds)
            cells = ["yes" if (a, b) in table else "-" for table in (DISTANCES, ANGLES)]
            lines.append(f"| {a}, {b} | {' | '.join(cells)} | {met} | {', '.join(onto) or '-'} |")
    return lines


def page() -> str:
    """The text of ``docs/toolkit.md``."""
    lines = [
        "# Toolkit",
        "",
        "What each operation is called, where its formula is from, and the test that compares it with formulas that",
        "share no code with it, over random and degenerate cases. `python tests/support/toolkit_page.py`",
        "writes this page. Kernels take arrays with any leading axes; `help(pga3.distance_lines)` says what degenerate",
        "input gives.",
    ]
    for algebra in dict.fromkeys(entry.algebra for entry in entries()):
        lines += ["", f"## {TITLES.get(algebra, f'`{module(algebra)}`')}", "", "| what | function | source | test |"]
        lines += ["|---|---|---|---|"]
        lines += [
            f"| {entry.entry} | `{entry.function}` | {entry.source} | `{entry.test}` |"
            for entry in entries()
            if entry.algebra == algebra
        ]
        if algebra == "geometry":
            lines += [
                "",
                "`distance`, `angle`, `meet` and `project` take any two kinds. Where a direction or a crossing has no",
            ]
            lines += [
                "meaning there is no angle; `meet` says how they meet: in two, one or no points, parallel, or the same."
            ]
            lines += ["", *pairs()]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page())
    sys.stdout.write(f"{PAGE.name}\n")
