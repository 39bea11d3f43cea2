"""The main benchmark, ``python -m benchmarks``, which writes docs/benchmarks.md."""

from __future__ import annotations

import argparse
from pathlib import Path

from gacompiler.generation.spec_files import load_spec

from . import by_hand, features, generation, kernels, pages
from .affinity import processors, use_one_processor
from .building import building
from .cases import CASES, OPTIONAL
from .libraries import LIBRARIES, installed
from .machine import machine
from .report import Run, page
from .stamp import stamped
from .timing import FULL, QUICK

_ABOUT = "Measure the compiler and its kernels, compare them with other libraries, and write a page in Markdown."


def main(arguments: list[str] | None = None) -> int:
    """Measure, and write the page. Return the exit status, which is 0 unless the page cannot be written.

    Parameters
    ----------
    arguments : list of str, optional
        Command-line arguments. By default, those of the process.
    """
    options = _parser().parse_args(arguments)
    out: Path = options.out
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.open("a").close()
    except OSError as error:
        return pages.report_failure("benchmarks", out, error)
    available = processors()
    if not options.quick:
        use_one_processor()
    effort = QUICK if options.quick else FULL
    sizes = tuple(sorted(set(options.sizes or (kernels.QUICK_SIZES if options.quick else kernels.SIZES))))
    paths = generation.specs(options.quick)
    with pages.progress() as bar:
        total = sum(len(load_spec(path).kernels) for path in paths)
        compiling = bar.add_task("generate", total=total)
        running = bar.add_task("run", total=len(CASES))
        found = generation.generation(
            paths, lambda name: bar.update(compiling, advance=1, description=f"generate {name}")
        )
        built = building((path.stem for path in paths), available, lambda name: bar.update(compiling, description=name))
        limits = machine(effort, options.quick)
        times = tuple(
            kernels.measure(case, sizes, effort, lambda name: bar.update(running, advance=1, description=f"run {name}"))
            for case in CASES
        )
        comparing = bar.add_task("compare", total=None)

        def compared(name: str) -> None:
            bar.update(comparing, advance=1, description=f"compare {name}")

        hand_sizes = by_hand.QUICK_SIZES if options.quick else by_hand.SIZES
        hand = by_hand.measure(hand_sizes, effort, compared)
        calling = features.measure(effort, options.quick, available, compared)
    figure = None
    if any(size > 1 for size in sizes):
        from .figure import draw

        figure = out.with_suffix(".png")
        draw(figure, limits, sizes, times)
    missing = tuple(name for name in (*LIBRARIES, *OPTIONAL) if not installed(name))
    run = Run(
        limits,
        found,
        built,
        sizes,
        times,
        hand_sizes,
        hand,
        calling,
        kernels.backends(),
        missing,
        options.quick,
        effort.repeats,
        figure.name if figure else None,
    )
    pages.write(out, stamped(page(run), "command"))
    print(f"{out}: {len(found.kernels)} kernels generated, {len(times)} measured" + (f"; {figure}" if figure else ""))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=_ABOUT)
    parser.add_argument(
        "--quick", action="store_true", help="check that everything works; the results are not representative"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("docs/benchmarks.md"), metavar="FILE", help="the page to write [%(default)s]"
    )
    parser.add_argument(
        "--sizes", type=_size, nargs="+", metavar="N", help="numbers of elements [1 1000 100000 1000000]"
    )
    return parser


def _size(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of elements; expected an integer of at least 1")
    return int(text)
