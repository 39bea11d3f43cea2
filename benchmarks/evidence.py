"""How often estimators are OK and wrong, and how often they refuse good data, beside a version before the evidence."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from . import (
    evidence_adversary,
    evidence_buildings,
    evidence_contradictions,
    evidence_estimation,
    evidence_fits,
    evidence_focal,
    evidence_hand_eye,
    evidence_lidar,
    evidence_mapping,
    evidence_misfits,
    evidence_objects,
    evidence_others,
    evidence_robots,
    evidence_scans,
    evidence_strangers,
    evidence_views,
    evidence_vision,
    evidence_walks,
    pages,
)
from .evidence_scenes import ROWS, Row

PAGE = Path("docs/evidence.md")
BEFORE = Path(__file__).with_name("evidence_before.json")
"""Counts of the version before `algorithms.evidence`, commit 77c814e3, with the same scenes: of each row the number of
trials, how many were OK and wrong, and how many were refused. Rows of `evidence_contradictions` are of 52fa09b6, those
of `evidence_adversary` of 0a063ed7, those of `evidence_fits` of 80c47a70, and those of `evidence_buildings` and
`evidence_walks` of 118aa86a."""
SEED = 2026
"""Scenes of other seeds were used while thresholds were chosen."""
SLOW = 200
"""Number of trials of rows that take more than a twentieth of a second each; others have five times more."""
CHAPTERS = (
    evidence_contradictions,
    evidence_adversary,
    evidence_misfits,
    evidence_fits,
    evidence_vision,
    evidence_views,
    evidence_focal,
    evidence_hand_eye,
    evidence_estimation,
    evidence_others,
    evidence_scans,
    evidence_strangers,
    evidence_mapping,
    evidence_buildings,
    evidence_walks,
    evidence_lidar,
    evidence_objects,
    evidence_robots,
)


def counted(row: Row, n_trials: int) -> tuple[int, int, int]:
    """Return the number of trials of a row, how many of them were OK and wrong, and how many were refused."""
    found = [row.trial(np.random.default_rng([k, SEED])) for k in range(n_trials)]
    return n_trials, sum(each.ok and not each.right for each in found), sum(not each.ok for each in found)


def page(found: list[tuple[Row, tuple[int, int, int]]], before: dict[str, list[int]]) -> str:
    """All figures as Markdown."""
    lines = [
        "# Evidence",
        "",
        "Every status of `algorithms` derives from `algorithms.evidence.Status`. OK is a promise: under the stated",
        "model of the noise the error exceeds the stated bound with a probability of at most a thousandth, and the",
        "data do not contradict the model. One package has what the estimators share. `Noise` is the noise that",
        "residuals show and that they can only raise, and `by_chance` the test against chance and its null models.",
        "`consensus` takes random samples, `likely` and `differ` compare minima, and `rank` and `undetermined` say",
        "what data determine. `gate_of` and `is_lost` are gates of filters, and `minima` is least squares from many",
        "starts.",
        "",
        "Written by `python -m benchmarks evidence`. Each row is a generator of scenes that no test uses, with seeds",
        "that were not used in development. A result is wrong if it is off by more than the stated bound, and by more",
        "than the scene says, if it says so. Where data are good, a refusal is a fault; elsewhere, the aim is not to",
        "be OK and wrong. Percentages before are those of commit 77c814e3, of the same scenes, or of the version",
        "before the scenes were added. A bound for a count of 0 in 1,000 trials is 0.3 %, with 95 % confidence.",
        "Rows are measured again when an estimator changes; `git blame` of this page names their commits.",
        "",
        "| estimator | scene | trials | OK and wrong, before | now | refused, before | now |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for row, (count, wrong, refused) in found:
        scene = f"{row.scene} (good data)" if row.good else row.scene
        old = before.get(row.name)
        first, second = ("", "") if old is None else (_percent(old[1], old[0]), _percent(old[2], old[0]))
        now = _percent(wrong, count), _percent(refused, count)
        lines.append(f"| {row.estimator} | {scene} | {count:,} | {first} | {now[0]} | {second} | {now[1]} |")
    return "\n".join(lines) + "\n"


def with_rows(text: str, measured: list[str]) -> str:
    """Return a page with measured rows in place of those of the same scenes, and with new ones at the end."""
    lines = text.splitlines()
    for row in measured:
        scene = row.split(" | ")[:2]
        same = [k for k, line in enumerate(lines) if line.split(" | ")[:2] == scene]
        last = [k for k, line in enumerate(lines) if line.startswith("| `")][-1]
        lines[slice(same[0], same[0] + 1) if same else slice(last + 1, last + 1)] = [row]
    return "\n".join(lines) + "\n"


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / max(whole, 1):.1f} %"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    parser = pages.options("evidence", __doc__, PAGE)
    parser.add_argument(
        "--only", metavar="NAME", help="measure the rows of one estimator, which replace those of the page"
    )
    options = parser.parse_args(arguments)
    rows = [row for row in ROWS if options.only is None or row.estimator.startswith(f"`{options.only}")]
    if not rows:
        parser.error(
            f"argument --only: {options.only}; expected one of {', '.join(sorted({r.estimator for r in ROWS}))}"
        )
    found = []
    with pages.progress() as bar:
        task = bar.add_task("scenes", total=len(rows))
        for row in rows:
            found.append((row, counted(row, 2 if options.quick else (SLOW if row.slow else 5 * SLOW))))
            bar.advance(task)
    before = json.loads(BEFORE.read_text()) if BEFORE.exists() else {}
    text = page(found, before)
    if options.only is not None:
        measured = [line for line in text.splitlines() if line.startswith("| `")]
        print("\n".join(measured))
        if not options.quick and options.out.exists():
            options.out.write_text(with_rows(options.out.read_text(), measured))
        return 0
    return pages.publish("evidence", options.out, text, f"{len(found)} rows")


if __name__ == "__main__":
    sys.exit(main())
