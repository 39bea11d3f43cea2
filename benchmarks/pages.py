"""Functions that all benchmark commands share: options, progress bars, and writing pages."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from .stamp import stamped


def options(command: str, about: str | None, page: Path, *, quick: bool = True) -> argparse.ArgumentParser:
    """Return the parser of a command, with ``--out`` and, if it has a quick mode, ``--quick``."""
    parser = argparse.ArgumentParser(prog=f"python -m benchmarks {command}", description=about)
    if quick:
        parser.add_argument(
            "--quick", action="store_true", help="check that everything works; the results are not representative"
        )
    parser.add_argument("--out", type=Path, default=page, metavar="FILE", help="the file to write [%(default)s]")
    return parser


def progress() -> Progress:
    """Return a progress bar, which is disabled unless stderr is a terminal."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description:<44}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console, disable=not console.is_terminal)


def publish(command: str, out: Path, text: str, what: str) -> int:
    """Write a page, and print its contents `what` or the reason of failure. Return the exit status.

    A page of the documentation ends with a stamp, and a table of data does not.
    """
    try:
        write(out, stamped(text, command) if out.suffix == ".md" else text)
    except OSError as error:
        return report_failure(command, out, error)
    print(f"{out}: {what}")
    return 0


def report_failure(command: str, out: Path, error: OSError) -> int:
    """Print why a page could not be written. Return the exit status."""
    print(f"{command}: {out}: {error.strerror}; expected a writable path; choose one with --out", file=sys.stderr)
    return 1


def write(path: Path, text: str) -> None:
    """Replace the file at `path` by `text` atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        unfinished.write_text(text)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
