"""What the commands share that measure something and write a page: their options, their progress, and the writing."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn


def options(command: str, about: str | None, page: Path, *, quick: bool = True) -> argparse.ArgumentParser:
    """The parser of a command, with ``--out`` and, if it has a quick mode, ``--quick``."""
    parser = argparse.ArgumentParser(prog=f"python -m benchmarks {command}", description=about)
    if quick:
        parser.add_argument("--quick", action="store_true", help="see that everything works; figures not for quoting")
    parser.add_argument("--out", type=Path, default=page, metavar="FILE", help="the page to write [%(default)s]")
    return parser


def progress() -> Progress:
    """Return a progress bar, which is disabled unless stderr is a terminal."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description:<44}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console, disable=not console.is_terminal)


def publish(command: str, out: Path, text: str, what: str) -> int:
    """Write a page and say what it has, or why it could not be written; the exit status."""
    try:
        write(out, text)
    except OSError as error:
        return refused(command, out, error)
    print(f"{out}: {what}")
    return 0


def refused(command: str, out: Path, error: OSError) -> int:
    """Say why a page could not be written; the exit status."""
    print(f"{command}: {out}: {error.strerror}; expected a file to write to; choose one with --out", file=sys.stderr)
    return 1


def write(path: Path, text: str) -> None:
    """Put `text` into a file that is whole at every moment."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        unfinished.write_text(text)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
