"""How long scans take to match, beside ICP of small_gicp, and how many motions of a real log both find."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.mapping import MappingStatus, Scan, match_scans, relocate, segments
from algorithms.mapping.g2o import read_g2o
from algorithms.mapping.line_map import LineMap
from generated import pga2

from . import lidar, pages
from .libraries import installed
from .machine import version
from .timing import minimum_times

PAGE = Path("docs/mapping-speed.md")
LOG = Path("tests/data/maps/killian_start.g2o.gz")
ROUNDS = 7
SPAN = 0.02
"""Seconds of one measurement, at least."""
OURS = "gacompiler"
NEAR, TURNED = 0.2, 2.0
"""Metres and degrees within which a motion counts as found."""
Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True)
class Pair:
    """Two scans, and the motion x, y, angle of the second in the frame of the first by the graph of poses."""

    a: Scan
    b: Scan
    motion: Array


def fresh(scan: Scan) -> Scan:
    """Return a copy of a scan without cached points."""
    return Scan(scan.ranges, scan.angle_min, scan.angle_step, scan.max_range)


def pairs() -> list[Pair]:
    """Return the consecutive scans of the log."""
    graph = read_g2o(LOG)
    scans = [reading.scan for reading in graph.readings]
    rows = zip(graph.edges.tolist(), graph.motions, strict=True)
    return [Pair(scans[i], scans[j], motion) for (i, j), motion in rows if j == i + 1]


def by_icp(pair: Pair, start: Array) -> Array:
    """Return the motion x, y, angle by ICP of small_gicp from a start, without downsampling that matters."""
    peer = importlib.import_module("small_gicp")
    clouds = [np.column_stack([scan.points(), np.zeros(len(scan.beams))]) for scan in (pair.a, pair.b)]
    matrix = np.eye(4)
    c, s = np.cos(start[2]), np.sin(start[2])
    matrix[:2, :2], matrix[:2, 3] = [[c, -s], [s, c]], start[:2]
    found = peer.align(
        *clouds,
        matrix,
        registration_type="ICP",
        downsampling_resolution=0.02,
        max_correspondence_distance=0.5,
        max_iterations=50,
    ).T_target_source
    return np.array([found[0, 3], found[1, 3], np.arctan2(found[1, 0], found[0, 0])])


def by_lines(pair: Pair) -> tuple[Array, MappingStatus]:
    """Return the motion x, y, angle by `match_scans`, and its status."""
    found = match_scans(fresh(pair.a), fresh(pair.b))
    angle, shift = pga2.motor_to_angle_translation(found.motor)
    return np.array([*shift, angle]), found.status


def errors(found: Array, truth: Array) -> tuple[float, float]:
    """Return the errors in metres and degrees."""
    turn = (found[2] - truth[2] + np.pi) % (2 * np.pi) - np.pi
    return float(np.linalg.norm(found[:2] - truth[:2])), float(np.degrees(abs(turn)))


def accuracy(chosen: list[Pair]) -> list[str]:
    """Return the rows of the table of motions found."""
    ours = [by_lines(pair) for pair in chosen]
    certain = np.array([status is MappingStatus.OK for _, status in ours])
    methods: dict[str, list[Array]] = {"`match_scans`, no prior": [motion for motion, _ in ours]}
    if installed("small_gicp"):
        methods["ICP from the identity"] = [by_icp(pair, np.zeros(3)) for pair in chosen]
        methods["ICP from the truth"] = [by_icp(pair, pair.motion) for pair in chosen]
    rows = []
    for name, motions in methods.items():
        table = np.array([errors(m, pair.motion) for m, pair in zip(motions, chosen, strict=True)])
        good = (table[:, 0] < NEAR) & (table[:, 1] < TURNED)
        shift, turn = np.median(table, 0)
        rows.append(f"| {name} | {100 * good.mean():.1f} % | {100 * shift:.1f} cm | {turn:.2f}° |")
        if motions is methods["`match_scans`, no prior"]:
            table = table[certain]
            good = good[certain]
            shift, turn = np.median(table, 0)
            share = f"{100 * certain.mean():.0f} % of pairs"
            rows.append(
                f"| of these, with the status OK ({share}) | {100 * good.mean():.1f} % | {100 * shift:.1f} cm "
                f"| {turn:.2f}° |"
            )
    return rows


def times(chosen: list[Pair], rounds: int) -> list[str]:
    """Return the rows of the table of times, in milliseconds."""
    n = len(chosen)
    scans = [reading.scan for reading in read_g2o(LOG).readings]
    a_map = _map(scans, n)
    places = [fresh(pair.a) for pair in chosen[:10]]

    def each(call: Callable[[Pair], object]) -> Callable[[], object]:
        return lambda: [call(pair) for pair in chosen]

    tasks: list[tuple[str, int, dict[str, Callable[[], object]]]] = [
        ("segments of a scan", n, {OURS: each(lambda pair: segments(fresh(pair.a)))}),
        ("motion between two scans, no prior", n, {OURS: each(by_lines)}),
        (
            f"place in a map of {len(a_map)} lines, no prior",
            len(places),
            {OURS: lambda: [relocate(s, a_map) for s in places]},
        ),
    ]
    if installed("small_gicp"):
        tasks[1][2]["ICP from the identity"] = each(lambda pair: by_icp(pair, np.zeros(3)))
    rows = []
    for name, count, calls in tasks:
        spent = minimum_times(calls, rounds, SPAN)
        others = ", ".join(f"{peer} {1e3 * t / count:.2f}" for peer, t in spent.items() if peer != OURS)
        rows.append(f"| {name} | {1e3 * spent[OURS] / count:.2f} | {others} |")
    return rows


def _map(scans: list[Scan], n: int) -> LineMap:
    graph = read_g2o(LOG)
    motors = pga2.motor_from_angle_translation(graph.poses[:, 2], graph.poses[:, :2])
    found = LineMap.empty()
    for scan, motor in list(zip(scans, motors, strict=True))[: max(50, n)]:
        found = found.updated(segments(scan), motor).map
    return found.merged()


def page(accurate: list[str], timed: list[str], drives: list[str], n: int, rounds: int) -> str:
    """All figures as Markdown."""
    lines = [
        "# How fast scans are matched",
        "",
        f"Written by `python -m benchmarks mapping`, beside small_gicp {version('small_gicp')}, one thread each.",
        f"{n} pairs of consecutive scans (180 beams, about half a metre apart) of the log of Killian Court in",
        f"`{LOG}`; truth is the graph of poses, which itself is uncertain by centimetres.",
        "",
        f"A motion counts as found within {100 * NEAR:.0f} cm and {TURNED:.0f}°. Errors are medians of all pairs.",
        "",
        "| | found | error | error |",
        "| --- | ---: | ---: | ---: |",
        *accurate,
        "",
        f"Milliseconds, the least of {rounds} rounds in which libraries alternate:",
        "",
        "| | here | others |",
        "| --- | ---: | --- |",
        *timed,
        "",
        "## Odometry of a lidar",
        "",
        "Errors of the last place along three streets of `benchmarks/streets.py`: 60 scans with 24 rings and 40 scans",
        "with 40 rings, noise of 2 cm, no motion during a scan. Cells of KISS-ICP have a metre, its default for this",
        "range. Medians of CPU time, in milliseconds for a scan; methods alternate.",
        "",
        "| | rings x columns | mm | ms |",
        "| --- | --- | --- | ---: |",
        *drives,
    ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("mapping", __doc__, PAGE).parse_args(arguments)
    out: Path = options.out
    rounds = 1 if options.quick else ROUNDS
    chosen = pairs()[:: 40 if options.quick else 1]
    accurate = accuracy(chosen)
    timed = times(chosen[:: max(1, len(chosen) // 40)], rounds)
    drives = [*lidar.rows(1, 5)] if options.quick else [*lidar.rows(3, 60), *lidar.rows(3, 40, 40, 360)]
    return pages.publish("mapping", out, page(accurate, timed, drives, len(chosen), rounds), "3 tables")


if __name__ == "__main__":
    sys.exit(main())
