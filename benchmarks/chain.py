"""Compare kernels on numba with the uniform kernels in C, and chains of kernels with one fused kernel in C."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import numpy as np

import gacompiler
import generated
from gacompiler.algebra.catalog import PGA3
from gacompiler.runtime import load_module

from . import pages
from .kernels import ORDERS, TYPES
from .machine import version
from .markdown import paragraph
from .timing import FULL, QUICK, Effort, minimum_times

PAGE = Path("docs/numba.md")
SIZES = (1_000, 100_000, 1_000_000)

KERNELS: tuple[tuple[str, int | None], ...] = (
    ("pga3.motor_product", None),
    ("pga3.move_point", None),
    ("pga3.move_line", None),
    ("pga3.move_plane", None),
    ("pga3.join_points", None),
    ("pga3.meet_three_planes", None),
    ("pga3.geometric_product", None),
    ("vga3.rotate_vector", None),
    ("quaternion.product", None),
    ("cga3.embed_point", None),
    ("cga3.sphere_from_points", None),
    ("cga3.meet_circle_sphere", None),
    ("cga3.meet_sphere_plane", None),
    ("cga3.move_point", None),
    ("cga3.transform_vector", None),
    ("pga3.motor_exponential", None),
    ("pga3.motor_logarithm", None),
    ("quaternion.exponential", None),
    ("pga3.motor_product", 0),
    ("pga3.move_point", 0),
    ("pga3.move_line", 0),
    ("pga3.move_plane", 0),
    ("vga3.rotate_vector", 0),
    ("cga3.transform_vector", 0),
)
"""Kernels, and the index of the uniform argument, if any."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Seconds per element in C and on numba."""

    c: float
    numba: float

    @property
    def ratio(self) -> float:
        """The time on numba divided by the time in C."""
        return self.numba / self.c


@dataclass(frozen=True, slots=True)
class Row:
    """The times of one computation for each size, by type and order."""

    title: str
    pairs: dict[tuple[str, str], tuple[Pair, ...]]


def _module(name: str, backend: str) -> Any:
    folder = Path(str(generated.__file__)).parent
    module: Any = sys.modules.get(f"_{name}_on_{backend}")
    return module or load_module(folder / f"{name}.py", f"_{name}_on_{backend}", backend)


def _pair(c: Callable[..., Any], ours: Callable[..., Any], arrays: Sequence[Any], order: str, effort: Effort) -> Pair:
    """Time both functions on the uniform arrays, alternately.

    Raises
    ------
    RuntimeError
        If they give different results.
    """
    right = c(*arrays)
    outs = [np.array(right, order=order) for _ in range(2)]
    size = len(right)
    calls = {"c": lambda: c(*arrays, out=outs[0]), "numba": lambda: ours(*arrays, out=outs[1])}
    times = minimum_times(calls, effort.repeats, effort.span)
    scale = float(np.abs(right).max())
    if not np.allclose(outs[0], outs[1], rtol=0, atol=100 * float(np.finfo(right.dtype).eps) * scale):
        raise RuntimeError(f"{getattr(c, 'name', c)}: C and numba give different results")
    return Pair(times["c"] / size, times["numba"] / size)


def measure_kernel(title: str, uniform: int | None, sizes: Sequence[int], effort: Effort) -> Row:
    """Time one kernel on both backends."""
    name, _, kernel = title.partition(".")
    c, ours = (getattr(_module(name, backend), kernel) for backend in ("c", "numba"))
    shapes = c.signature.partition("->")[0].strip("()").split("),(")
    rng = np.random.default_rng(0)
    pairs = {}
    for kind in TYPES:
        for order in ORDERS:
            found = []
            for size in sizes:
                leads = [() if k == uniform else (size,) for k in range(len(shapes))]
                given = [rng.normal(size=(*lead, int(n))) for lead, n in zip(leads, shapes, strict=True)]
                found.append(_pair(c, ours, [np.array(x, kind, order=order) for x in given], order, effort))
            pairs[kind, order] = tuple(found)
    return Row(title if uniform is None else f"{title}, uniform {'abc'[uniform]}", pairs)


@gacompiler.kernel(a=PGA3.MOTOR, b=PGA3.MOTOR, p=PGA3.POINT, q=PGA3.POINT)
def moved_line(a: Any, b: Any, p: Any, q: Any) -> Any:
    """Return the line through two points, moved by `b` and then by `a`."""
    m = a * b
    return (m * p * ~m) & (m * q * ~m)


def chains() -> dict[str, Callable[..., Any]]:
    """Return implementations of the chain with kernels on numba, as functions of arrays and ``out``."""
    pga3 = _module("pga3", "numba")
    product, move, join = pga3.motor_product.jit, pga3.move_point.jit, pga3.join_points.jit

    @numba.njit
    def leg(a: Any, b: Any, p: Any, q: Any) -> Any:
        m = product(a, b)
        return join(move(m, p), move(m, q))

    @numba.njit
    def tuples(a: Any, b: Any, p: Any, q: Any, out: Any) -> None:
        for k in range(len(out)):
            m = product(a[k], b[k])
            join(move(m, p[k]), move(m, q[k]), out[k])

    @numba.njit
    def scratch(a: Any, b: Any, p: Any, q: Any, out: Any) -> None:
        m, x, y = np.empty(8, a.dtype), np.empty(3, a.dtype), np.empty(3, a.dtype)
        for k in range(len(out)):
            product(a[k], b[k], m)
            move(m, p[k], x)
            move(m, q[k], y)
            join(x, y, out[k])

    def plain(loop: Any) -> Callable[..., Any]:
        return lambda *arrays, out: loop(*arrays, out)

    return {
        "`Kernel.of`": pga3.Kernel.of(leg, "(8),(8),(3),(3)->(6)"),
        "loop, tuples": plain(tuples),
        "loop, small arrays": plain(scratch),
    }


def measure_chain(title: str, chain: Callable[..., Any], fused: Any, sizes: Sequence[int], effort: Effort) -> Row:
    """Compare one implementation of the chain with the fused kernel in C."""
    pga3 = _module("pga3", "c")
    rng = np.random.default_rng(0)
    pairs = {}
    for kind in TYPES:
        for order in ORDERS:
            found = []
            for size in sizes:
                motors = [pga3.motor_exponential(0.4 * rng.normal(size=(size, 6))) for _ in range(2)]
                given = [*motors, *(rng.normal(size=(size, 3)) for _ in range(2))]
                found.append(_pair(fused, chain, [np.array(x, kind, order=order) for x in given], order, effort))
            pairs[kind, order] = tuple(found)
    return Row(title, pairs)


def page(kernels: Sequence[Row], chained: Sequence[Row], sizes: Sequence[int]) -> str:
    """Return the page as Markdown."""
    ratios = [pair.ratio for row in kernels for pairs in row.pairs.values() for pair in pairs]
    above = sum(ratio > 1.5 for ratio in ratios)
    lines = [
        "# numba compared with C",
        "",
        paragraph(
            f"`python -m benchmarks chain` writes this page; numba {version('numba')}, numpy {version('numpy')}.",
            "Each cell gives the nanoseconds per element in C and on numba, and their ratio.",
            "The times are those of whole calls: the minimum of repeated runs, measured alternately.",
            "The column names give the number of elements and the memory order, C or Fortran.",
        ),
        "",
        paragraph(
            f"The median ratio of the kernels is {float(np.median(ratios)):.2f}, and the largest is "
            f"{max(ratios):.2f}; {above} of {len(ratios)} ratios are above 1.5.",
        ),
    ]
    chain = "## Join of two points moved by a product of motors, compared with one fused kernel in C"
    for heading, rows in (("## Kernels", kernels), (chain, chained)):
        for kind in TYPES:
            columns = [f"{size:,} {order}" for order in ORDERS for size in sizes]
            lines += ["", f"{heading}, {kind}", "", f"| | {' | '.join(columns)} |", "|---|" + "---:|" * len(columns)]
            for row in rows:
                cells = [
                    f"{pair.c * 1e9:.2f} {pair.numba * 1e9:.2f} **{pair.ratio:.2f}**"
                    for order in ORDERS
                    for pair in row.pairs[kind, order]
                ]
                lines.append(f"| {row.title} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page; arguments are those of the command line, or by default of the process."""
    options = _parser().parse_args(arguments)
    out: Path = options.out
    effort = QUICK if options.quick else FULL
    sizes = tuple(options.sizes)
    chosen = KERNELS[:: 8 if options.quick else 1]
    if not list(Path(str(generated.__file__)).parent.glob("_build/pga3-*")):
        print("chain: the C libraries of generated/ are not built; build them with `gac build`", file=sys.stderr)
        return 1
    with pages.progress() as bar:
        implementations = chains()
        task = bar.add_task("numba", total=len(chosen) + len(implementations))
        kernels, chained = [], []
        for title, uniform in chosen:
            bar.update(task, description=title)
            kernels.append(measure_kernel(title, uniform, sizes, effort))
            bar.advance(task)
        fused = gacompiler.compile(moved_line, backend="c")
        for title, chain in implementations.items():
            bar.update(task, description=title)
            chained.append(measure_chain(title, chain, fused, sizes, effort))
            bar.advance(task)
    return pages.publish(
        "chain",
        out,
        page(kernels, chained, sizes),
        f"{len(kernels)} kernels, {len(chained)} implementations of a chain",
    )


def _parser() -> argparse.ArgumentParser:
    parser = pages.options("chain", __doc__, PAGE)
    parser.add_argument(
        "--sizes", type=int, nargs="+", default=SIZES, metavar="N", help="numbers of elements [1000 100000 1000000]"
    )
    return parser
