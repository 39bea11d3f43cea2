"""Compare the conformal toolkit, on arrays and on single objects, with clifford.tools.g3c."""

from __future__ import annotations

import sys
import timeit
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.geometry import nearest_on_circles, similarity_between
from generated import cga3

from . import pages
from .libraries import installed
from .machine import version
from .markdown import paragraph
from .subspaces import interleaved
from .timing import minimum_times

PAGE = Path("docs/toolkit-speed.md")
ELEMENTS, QUICK_ELEMENTS = 1000, 20
ROUNDS = 7
THEIRS = 10
"""Number of objects for clifford, which computes one at a time."""
_SPAN = 2e-4
"""Minimum duration of a measurement of an operator in seconds."""


@dataclass(frozen=True, slots=True)
class Row:
    """Nanoseconds per object."""

    what: str
    batched: float
    alone: float
    clifford: float


Pair = tuple[np.ndarray[Any, Any], list[Any]]
"""The same objects as an array and as multivectors of clifford."""


def objects(elements: int) -> dict[str, Pair]:
    """Return two objects of each kind, made of the same points."""
    import clifford.tools.g3c as g3c

    rng = np.random.default_rng(1)
    points = rng.normal(size=(2, 4, elements, 3))
    found: dict[str, Pair] = {}
    for k, name in enumerate("ab"):
        p = points[k]
        ups = [[_up(g3c, x) for x in each[:THEIRS]] for each in p]
        made = {
            "point": (p[0], ups[0]),
            "pair": (cga3.point_pair_from_points(p[0], p[1]), _wedge(ups[:2])),
            "circle": (cga3.circle_from_points(p[0], p[1], p[2]), _wedge(ups[:3])),
            "sphere": (cga3.sphere_from_points(*p), _wedge(ups)),
            "line": (cga3.line_from_points(p[0], p[1]), _wedge([*ups[:2], [g3c.einf] * THEIRS])),
            "plane": (cga3.plane_from_points(p[0], p[1], p[2]), _wedge([*ups[:3], [g3c.einf] * THEIRS])),
        }
        for kind, (ours, theirs) in made.items():
            # The functions of clifford require unit objects; points already have weight 1.
            units = theirs if kind == "point" else [x.normal() for x in theirs]
            found[f"{kind} {name}"] = ours, units
    found["vector"] = points[0, 0], [_vector(g3c, x) for x in points[0, 0, :THEIRS]]
    turns = cga3.motor_from_rotor_translation(cga3.rotor_from_axis_angle(points[0, 0], 1.0), points[0, 1])
    found["motor"] = turns, [_motor(g3c, x, y) for x, y in points[0, :2, :THEIRS].swapaxes(0, 1)]
    return found


def _up(g3c: Any, x: Sequence[float]) -> Any:
    return g3c.up(_vector(g3c, x))


def _vector(g3c: Any, x: Sequence[float]) -> Any:
    return x[0] * g3c.e1 + x[1] * g3c.e2 + x[2] * g3c.e3


def _wedge(columns: Sequence[Sequence[Any]]) -> list[Any]:
    found = list(columns[0])
    for column in columns[1:]:
        found = [a ^ b for a, b in zip(found, column, strict=True)]
    return found


def _motor(g3c: Any, axis: Sequence[float], t: Sequence[float]) -> Any:
    bivector = -(_vector(g3c, axis) / np.linalg.norm(axis)) * g3c.e123
    rotor = np.cos(0.5) + np.sin(0.5) * bivector
    return g3c.generate_translation_rotor(_vector(g3c, t)) * rotor


def cases() -> list[tuple[str, Callable[..., Any], Callable[..., Any], tuple[str, ...]]]:
    """Return the name of each operation, the functions of both libraries, and the names of their arguments."""
    import clifford.tools.g3c as g3c
    from clifford.tools.g3c.rotor_parameterisation import ga_log

    return [
        ("point of a vector", cga3.embed_point, g3c.up, ("vector",)),
        ("circle of points", cga3.circle_from_points, lambda a, b, c: a ^ b ^ c, ("point a", "point b", "point a")),
        ("centre of a sphere", cga3.sphere_centre, g3c.get_center_from_sphere, ("sphere a",)),
        ("radius of a sphere", cga3.sphere_radius_squared, g3c.get_radius_from_sphere, ("sphere a",)),
        ("centre, normal and radius of a circle", _circle_parts, g3c.get_circle_in_euc, ("circle a",)),
        ("points of a pair", cga3.point_pair_points, g3c.point_pair_to_end_points, ("pair a",)),
        ("meet of spheres", cga3.meet_spheres, g3c.meet, ("sphere a", "sphere b")),
        ("meet of circle and plane", cga3.meet_circle_plane, g3c.meet, ("circle a", "plane b")),
        ("meet of line and plane", cga3.meet_line_plane, g3c.intersect_line_and_plane_to_point, ("line a", "plane b")),
        ("midpoint between two lines", cga3.closest_points_of_lines, g3c.midpoint_between_lines, ("line a", "line b")),
        ("distance of points", cga3.distance_points, g3c.euc_dist, ("point a", "point b")),
        (
            "distance of point and line",
            cga3.distance_point_line,
            lambda p, line: g3c.val_distance_point_to_line(p.value, line.value),
            ("point a", "line b"),
        ),
        (
            "projection on a sphere",
            cga3.project_point_on_sphere,
            lambda p, sphere: g3c.project_points_to_sphere([p], sphere),
            ("point a", "sphere b"),
        ),
        (
            "projection on a circle",
            cga3.project_point_on_circle,
            lambda p, circle: g3c.project_points_to_circle([p], circle),
            ("point a", "circle b"),
        ),
        ("motion of a line", cga3.move_line, lambda m, x: g3c.apply_rotor(x, m), ("motor", "line a")),
        ("motion of a sphere", cga3.move_sphere, lambda m, x: g3c.apply_rotor(x, m), ("motor", "sphere a")),
        ("motor between lines", cga3.motor_between_lines, g3c.rotor_between_lines, ("line a", "line b")),
        ("motor between planes", cga3.motor_between_planes, g3c.rotor_between_planes, ("plane a", "plane b")),
        ("versor between circles", cga3.versor_between_circles, g3c.rotor_between_objects, ("circle a", "circle b")),
        (
            "rotation, dilation and translation between circles",
            lambda a, b: similarity_between("circle", a, b),
            g3c.TRS_between_rounds,
            ("circle a", "circle b"),
        ),
        ("logarithm of a motor", cga3.motor_logarithm, ga_log, ("motor",)),
        ("square root of a motor", cga3.motor_square_root, g3c.square_roots_of_rotor, ("motor",)),
        (
            "closest point on a circle to a line",
            cga3.closest_points_line_circle,
            lambda line, circle: g3c.closest_point_on_circle_from_line(circle, line),
            ("line a", "circle b"),
        ),
        (
            "closest points of circles",
            nearest_on_circles,
            g3c.iterative_closest_points_on_circles,
            ("circle a", "circle b"),
        ),
    ]


def _circle_parts(circle: Any) -> Any:
    return cga3.circle_centre(circle), cga3.circle_normal(circle), cga3.circle_radius_squared(circle)


def measure(elements: int, rounds: int) -> list[Row]:
    """Time all operations; clifford computes `THEIRS` objects one after the other."""
    known = objects(max(elements, THEIRS))
    rows = []
    for what, ours, theirs, names in cases():
        arrays = [known[name][0] for name in names]
        single = [array[0] for array in arrays]
        lists = [known[name][1] for name in names]
        count = len(arrays[0])
        calls = {
            "batched": lambda ours=ours, arrays=arrays: ours(*arrays),
            "alone": lambda ours=ours, single=single: [ours(*single) for _ in range(THEIRS)],
            "clifford": lambda theirs=theirs, lists=lists: [theirs(*each) for each in zip(*lists, strict=True)],
        }
        times = interleaved(calls, 1, rounds)
        rows.append(Row(what, times["batched"] / count, times["alone"] / THEIRS, times["clifford"] / THEIRS))
    return rows


@dataclass(frozen=True, slots=True)
class OperatorRow:
    """Nanoseconds for one operator on single objects, by name of the library."""

    what: str
    times: dict[str, float]


OPERATIONS = (
    ("product of motors, `m * n`", "m", "m", "a * b"),
    ("sum of points, `p + q`", "p", "p", "a + b"),
    ("join of points, `p & q`", "p", "p", "a & b"),
    ("inner product of motor and point", "m", "p", "a | b"),
    ("product with a number, `m * 2.5`", "m", "number", "a * b"),
)


def measure_operators(rounds: int) -> list[OperatorRow]:
    """Time operators of `gacompiler.objects` on motors and points of PGA3, and those of installed peers."""
    from gacompiler.objects import PGA3

    motor, point = PGA3.motor([1, 2, 3], 0.5, 0.3), PGA3.point(1, 2, 3)
    known: dict[str, dict[str, Any]] = {"gacompiler": {"m": motor, "p": point}}
    blades = {name: (x.layout.blades, x.values) for name, x in (("m", motor), ("p", point + 0 * PGA3.e123))}
    if installed("clifford"):
        import clifford

        _, all_blades = clifford.Cl(3, 0, 1, firstIdx=0)
        ours = {"e0": all_blades["e0"], "e1": all_blades["e1"], "e2": all_blades["e2"], "e3": all_blades["e3"]}
        known["clifford"] = {name: _of_vectors(ours, *each) for name, each in blades.items()}
    if installed("kingdon"):
        import kingdon

        algebra = kingdon.Algebra(3, 0, 1)
        ours = {f"e{k}": algebra.blades[f"e{k}"] for k in range(4)}
        known["kingdon"] = {name: _of_vectors(ours, *each) for name, each in blades.items()}
    rows = []
    for what, first, second, statement in OPERATIONS:
        calls = {}
        for library, objects_ in known.items():
            names = {"a": objects_[first], "b": {**objects_, "number": 2.5}[second]}
            calls[library] = timeit.Timer(statement, globals=names)
        times = minimum_times(calls, rounds, _SPAN)
        rows.append(OperatorRow(what, {library: 1e9 * spent for library, spent in times.items()}))
    return rows


def _of_vectors(vectors: dict[str, Any], names: Sequence[str], values: Any) -> Any:
    """Return the same multivector of a peer, made of its vectors e0 to e3."""
    total = None
    for name, value in zip(names, values, strict=True):
        blade = float(value)
        for digit in name.removeprefix("e") if name != "1" else "":
            blade = blade * vectors[f"e{digit}"]
        if name == "1":
            square = vectors["e1"] * vectors["e1"]
            blade = float(value) * square
        total = blade if total is None else total + blade
    return total


def page(rows: Sequence[Row], operators: Sequence[OperatorRow], elements: int, rounds: int) -> str:
    """Return the page as Markdown."""
    lines = [
        "# Toolkit compared with clifford",
        "",
        paragraph(
            "`python -m benchmarks toolkit` writes this page.",
            f"Times are nanoseconds per object on one thread, for arrays of {elements} objects, for single "
            f"objects, and for `tools.g3c` of clifford {version('clifford')}, one object at a time.",
            f"They are minima over {rounds} rounds, in which the three are measured alternately.",
            "The numbers in parentheses are speedups over clifford.",
        ),
        "",
        "| operation | array | single object | clifford |",
        "| --- | ---: | ---: | ---: |",
    ]
    for row in rows:
        ratios = [f"{spent:,.0f} ({row.clifford / spent:,.0f})" for spent in (row.batched, row.alone)]
        lines.append(f"| {row.what} | {' | '.join(ratios)} | {row.clifford:,.0f} |")
    slowest = min(rows, key=lambda row: row.clifford / row.batched)
    lines += ["", f"The smallest speedup of arrays is {slowest.clifford / slowest.batched:,.0f}, for {slowest.what}."]
    names = list(operators[0].times)
    lines += [
        "",
        paragraph(
            "Operators on single objects of `gacompiler.objects` (PGA3), in nanoseconds.",
            "The numbers in parentheses are ratios to gacompiler.",
        ),
        "",
    ]
    lines += ["| operation | " + " | ".join(names) + " |", "| --- |" + " ---: |" * len(names)]
    for operator in operators:
        own = operator.times["gacompiler"]
        cells = [f"{own:,.0f}"]
        cells += [f"{operator.times[name]:,.0f} ({operator.times[name] / own:,.0f})" for name in names[1:]]
        lines.append(f"| {operator.what} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = pages.options("toolkit", __doc__, PAGE).parse_args(arguments)
    out: Path = options.out
    if not installed("clifford"):
        print("toolkit: clifford is not installed; run: pip install clifford", file=sys.stderr)
        return 1
    elements, rounds = (QUICK_ELEMENTS, 1) if options.quick else (ELEMENTS, ROUNDS)
    operators = measure_operators(rounds)
    text = page(measure(elements, rounds), operators, elements, rounds)
    return pages.publish("toolkit", out, text, f"{len(cases())} operations")


if __name__ == "__main__":
    sys.exit(main())
