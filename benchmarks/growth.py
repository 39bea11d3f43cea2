"""Measure how compile time and operation counts grow with the dimension of the algebra, compared with kingdon."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from gacompiler import commutator, kernel, sandwich
from gacompiler.algebra.algebra import Algebra
from gacompiler.algebra.catalog import null_pairs, orthogonal
from gacompiler.algebra.layout import Layout
from gacompiler.frontend.kernel import Kernel
from gacompiler.passes.pipeline import compile_kernel

from . import pages
from .kingdon_counts import count
from .libraries import installed
from .machine import version
from .markdown import paragraph
from .stamp import stamped
from .worker import TimeLimitExceeded, Worker

PAGE = Path("docs/growth.md")
LIMIT = 10.0
"""Time limit of a compilation in seconds. If it is exceeded, larger dimensions of the expression are omitted."""
DIMENSIONS = range(2, 11)
METRICS = ("orthonormal", "null pairs")
_LATE = "late"


def _layout(algebra: Algebra, name: str, *grades: int, unit: bool = False) -> Layout:
    blades = " ".join(algebra.spelling(blade)[1] for blade in algebra.blades(*grades))
    return algebra.layout(name, blades, unit=unit)


def _vector(algebra: Algebra) -> Layout:
    return _layout(algebra, "VECTOR", 1)


def _product(a: Any, b: Any) -> Any:
    return a * b


def _moved(r: Any, v: Any) -> Any:
    return sandwich(r, v)


def _turning(b: Any, v: Any) -> Any:
    return commutator(b, v)


def _volume(a: Any, b: Any, c: Any) -> Any:
    return a ^ b ^ c


def _full_product(algebra: Algebra) -> Kernel:
    return kernel(a=algebra.full, b=algebra.full)(_product)


def _even_product(algebra: Algebra) -> Kernel:
    return kernel(a=algebra.even, b=algebra.even)(_product)


def _rotor_on_vector(algebra: Algebra) -> Kernel:
    """Return the kernel of a rotation in one plane: the rotor has a scalar and a bivector part, and ``x ~x = 1``."""
    rotor = _layout(algebra, "ROTOR", 0, 2, unit=True)
    return kernel(r=rotor, v=_vector(algebra))(_moved)


def _vector_product(algebra: Algebra) -> Kernel:
    return kernel(a=_vector(algebra), b=_vector(algebra))(_product)


def _bivector_on_vector(algebra: Algebra) -> Kernel:
    return kernel(b=_layout(algebra, "BIVECTOR", 2), v=_vector(algebra))(_turning)


def _three_vectors(algebra: Algebra) -> Kernel:
    vector = _vector(algebra)
    return kernel(a=vector, b=vector, c=vector)(_volume)


EXPRESSIONS: dict[str, tuple[Callable[[Algebra], Kernel], int]] = {
    "full product": (_full_product, 2),
    "even product": (_even_product, 2),
    "rotor on vector": (_rotor_on_vector, 2),
    "vector times vector": (_vector_product, 2),
    "bivector on vector": (_bivector_on_vector, 2),
    "three vectors": (_three_vectors, 3),
}
"""For each expression: the function that makes its kernel, and its smallest dimension."""


@dataclass(frozen=True, slots=True)
class Point:
    """Time and operation counts of one compilation."""

    seconds: float
    mul: int
    add: int


Answer = Point | str
"""A compilation, `_LATE` if it exceeded the time limit, or the name of an error."""


@dataclass(frozen=True, slots=True)
class Curve:
    """Results of gacompiler and kingdon by dimension, for one expression in one metric."""

    expression: str
    metric: str
    own: dict[int, Answer]
    peer: dict[int, Answer]


def kernel_of(expression: str, metric: str, n: int) -> Kernel:
    """Return the kernel of an expression in `n` dimensions."""
    found = EXPRESSIONS[expression][0](null_pairs(n // 2) if metric == "null pairs" else orthogonal(n))
    return replace(found, name=expression.replace(" ", "_"))


def compile_own(expression: str, metric: str, n: int) -> Point:
    """Compile and prove an expression; runs in another process."""
    kernel = kernel_of(expression, metric, n)
    start = time.perf_counter()
    cost = compile_kernel(kernel).cost
    return Point(time.perf_counter() - start, cost.mul, cost.add)


def compile_peer(expression: str, metric: str, n: int) -> Point:
    """Compile an expression with kingdon; runs in another process."""
    found = count(kernel_of(expression, metric, n))
    return Point(found.seconds, found.mul, found.add)


def dimensions(expression: str, metric: str, largest: int) -> list[int]:
    """Return the dimensions of an expression; null pairs have even dimensions only."""
    least = EXPRESSIONS[expression][1]
    return [n for n in DIMENSIONS if least <= n <= largest and not (metric == "null pairs" and n % 2)]


def measure_curve(worker: Callable[..., Point], expression: str, metric: str, largest: int) -> dict[int, Answer]:
    """Return results by dimension, up to the first that exceeds the time limit."""
    found: dict[int, Answer] = {}
    for n in dimensions(expression, metric, largest):
        try:
            found[n] = worker(expression, metric, n)
        except TimeLimitExceeded:
            found[n] = _LATE
            break
        except Exception as error:
            found[n] = type(error).__name__
    return found


def measure_all(limit: float, largest: int, progress: Callable[[str], None]) -> list[Curve]:
    """Measure all curves; `progress` is called with the name of each."""
    curves = []
    with Worker(compile_own, limit) as own, Worker(compile_peer, limit) as peer:
        for metric in METRICS:
            for expression in EXPRESSIONS:
                progress(f"{expression}, {metric}")
                ours = measure_curve(own, expression, metric, largest)
                theirs = measure_curve(peer, expression, metric, largest) if installed("kingdon") else {}
                curves.append(Curve(expression, metric, ours, theirs))
    return curves


def page(curves: Sequence[Curve], limit: float, picture: str) -> str:
    """Return the page as Markdown."""
    with_peer = any(curve.peer for curve in curves)
    lines = [
        "# Growth with the dimension",
        "",
        paragraph(
            "`make bench PAGE=growth` writes this page; do not edit it by hand.",
            f"Times are those of one compilation, including the proof, with a time limit of {limit:g} s.",
            "In *rotor on vector*, the rotor has a scalar and a bivector part with `x ~x = 1`, so it rotates in "
            "one plane.",
            f"Dashed lines are kingdon {version('kingdon')}." if with_peer else "kingdon is not installed.",
        ),
        "",
        f"![Compile time in seconds by dimension]({picture})",
        "",
    ]
    for metric in METRICS:
        title = "Orthonormal, G(n, 0)" if metric == METRICS[0] else "Null pairs, G(n/2, n/2)"
        lines += [f"## {title}", ""]
        lines += ["| expression | n | mul | add | ms | kingdon mul | kingdon add | kingdon ms |"]
        lines += ["| --- |" + " ---: |" * 7]
        for curve in (curve for curve in curves if curve.metric == metric):
            for n in sorted({*curve.own, *curve.peer}):
                cells = (*_cells(curve.own.get(n), limit), *_cells(curve.peer.get(n), limit))
                lines.append(f"| {curve.expression} | {n} | " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join(lines).rstrip() + "\n"


def _cells(answer: Answer | None, limit: float) -> tuple[str, str, str]:
    if answer is None:
        return "–", "–", "–"
    if isinstance(answer, str):
        return "–", "–", f"> {1000 * limit:g}" if answer == _LATE else answer
    return str(answer.mul), str(answer.add), f"{1000 * answer.seconds:.3g}"


def draw(path: Path, curves: Sequence[Curve]) -> None:
    """Write the picture deterministically: equal curves give equal files."""
    with rc_context({"svg.hashsalt": "growth", "svg.fonttype": "none"}):
        figure = Figure(figsize=(10, 4.8), layout="constrained")
        axes = figure.subplots(1, len(METRICS), sharey=True)
        for axis, metric in zip(axes, METRICS, strict=True):
            _panel(axis, [curve for curve in curves if curve.metric == metric])
            axis.set(yscale="log", xlabel="dimension of the algebra", title=metric)
            axis.grid(alpha=0.3)
        axes[0].set_ylabel("seconds to compile")
        axes[0].legend(fontsize=8)
        unfinished = path.with_name(f".{path.name}")
        figure.savefig(unfinished, format="svg", metadata={"Date": None})
    unfinished.replace(path)


def _panel(axis: Any, curves: Sequence[Curve]) -> None:
    for k, curve in enumerate(curves):
        for answers, style, name in ((curve.own, "o-", curve.expression), (curve.peer, "o--", None)):
            points = [(n, answer.seconds) for n, answer in sorted(answers.items()) if isinstance(answer, Point)]
            if points:
                axis.plot(*zip(*points, strict=True), style, color=f"C{k}", markersize=4, linewidth=1, label=name)


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page and its picture; arguments are those of the command line, or of the process."""
    options = _parser().parse_args(arguments)
    out: Path = options.out
    with pages.progress() as bar:
        task = bar.add_task("compile", total=len(EXPRESSIONS) * len(METRICS))
        curves = measure_all(
            options.limit, options.largest, lambda name: bar.update(task, advance=1, description=f"compile {name}")
        )
    picture = out.with_suffix(".svg")
    try:
        pages.write(out, stamped(page(curves, options.limit, picture.name), "growth"))
        draw(picture, curves)
    except OSError as error:
        return pages.report_failure("growth", out, error)
    print(f"{out}: {len(curves)} curves; {picture}")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = pages.options("growth", __doc__, PAGE, quick=False)
    parser.add_argument(
        "--limit", type=float, default=LIMIT, metavar="SECONDS", help="time limit of a compilation [%(default)s]"
    )
    parser.add_argument(
        "--largest", type=int, default=DIMENSIONS[-1], metavar="N", help="the largest dimension [%(default)s]"
    )
    return parser
