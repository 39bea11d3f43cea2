"""The command ``python -m algorithms.demo``: print a table of kernels, and run three programs that write figures."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
from rich.table import Table

import generated
from generated.gac_runtime.build import BuildError, build_modules, is_wanted

from .timing import MAIN_KERNELS, N_ELEMENTS, Cost, backends, costs

_MODULES = (*MAIN_KERNELS, "robots", "ur5")
"""The modules that the programs call."""
_WIDTH = 110
"""Number of columns if the output is not a terminal."""


def main(arguments: list[str] | None = None) -> int:
    """Run the demonstration.

    Parameters
    ----------
    arguments : list of str, optional
        Command-line arguments. By default those of the process.

    Returns
    -------
    int
        The exit status.
    """
    parser = argparse.ArgumentParser(prog="python -m algorithms.demo", description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--out", type=Path, default=Path("build/demo"), metavar="FOLDER", help="folder for the figures [%(default)s]"
    )
    folder: Path = parser.parse_args(arguments).out
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ".writable").touch()
        (folder / ".writable").unlink()
    except OSError as error:
        return _failed(f"{folder}: {error.strerror}; expected a writable folder; choose one with --out")
    try:
        import skimage.data  # noqa: F401

        from . import programs
    except ImportError as error:
        return _failed(f"{error}; expected matplotlib and scikit-image; install them with pip install -e '.[test]'")
    tasks = (
        ("Forward kinematics of two arms", programs.arms, "arms.png"),
        ("Two views of a motorcycle", programs.stereo, "stereo.png"),
        ("Quaternion Fourier transform of an image", programs.spectrum, "spectrum.png"),
    )
    console = Console()
    if not console.is_terminal:
        console.width = _WIDTH
    pictures = []
    columns = (TextColumn("{task.description:<50}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        total = len(_MODULES) + sum(map(len, MAIN_KERNELS.values())) + len(tasks)
        task = progress.add_task("Building modules", total=total)
        _build(lambda: progress.advance(task))
        progress.update(task, description="Loading modules", completed=len(_MODULES))
        rows: list[Cost] = []
        for row in costs():
            rows.append(row)
            progress.update(task, advance=1, description=f"Timing {row.module}.{row.kernel}")
        console.print(_kernel_table(rows))
        for title, program, name in tasks:
            progress.update(task, description=title)
            facts = program(folder / name)
            progress.advance(task)
            pictures.append(folder / name)
            console.print(_facts_table(title, facts))
    console.print("Figures:", *pictures, sep="\n  ", highlight=False)
    return 0


def _build(advance: Callable[[], None]) -> None:
    """Build the libraries of the modules that are called, in parallel, for doubles, where the folder can be written.

    Elsewhere each is built on its first call, in the user's cache, or its kernels run without a library.
    """
    folder = Path(generated.__path__[0])
    if is_wanted() and os.access(folder, os.W_OK):
        with contextlib.suppress(BuildError):  # the first call reports it
            build_modules([folder / f"{name}.c" for name in _MODULES], only="f64", progress=lambda _: advance())


def _kernel_table(rows: Iterable[Cost]) -> Table:
    ran = backends()
    names = {backend: ", ".join(module for module in ran if ran[module] == backend) for backend in ran.values()}
    table = Table(
        title=f"Generated kernels, batch of {N_ELEMENTS:,} in float64",
        caption="; ".join(f"Backend {backend}: {modules}" for backend, modules in names.items()),
        title_justify="left",
        caption_justify="left",
        box=SIMPLE_HEAD,
    )
    table.add_column("Kernel", no_wrap=True)
    table.add_column("Mul", justify="right")
    table.add_column("Add", justify="right")
    table.add_column("Others", min_width=10)
    table.add_column("ns", justify="right", no_wrap=True)
    table.add_column("Error", justify="right", no_wrap=True)
    before = ""
    for row in rows:
        if row.module != before:
            table.add_section()
            table.add_row(f"[bold]{row.module}[/bold]")
            before = row.module
        numbers = f"{row.multiplications}", f"{row.additions}", row.others, f"{row.nanoseconds:.1f}"
        table.add_row(f"  {row.kernel}", *numbers, row.error)
    return table


def _facts_table(title: str, facts: Iterable[tuple[str, str]]) -> Table:
    table = Table(title=title, title_justify="left", show_header=False, box=SIMPLE_HEAD)
    for quantity, value in facts:
        table.add_row(quantity, value)
    return table


def _failed(message: str) -> int:
    print(f"demo: {message}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
