"""Output of commands: paths, tables and progress bars."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click
from rich import progress as bars
from rich.console import Console
from rich.table import Table

from ..passes.interruption import BEST, interruptible, is_interrupted, reporting


def near(path: Path) -> str:
    """Return a path relative to the working folder."""
    return os.path.relpath(path) if path.is_absolute() else str(path)


def plain(text: str) -> str:
    """Escape markup in a text for `rich`."""
    return text.replace("[", r"\[")


def print_table(header: list[str], rows: list[list[str]]) -> None:
    """Print a coloured table on a terminal, or aligned plain text otherwise."""
    if Console().is_terminal:
        table = Table(*header, header_style="bold cyan")
        for row in rows:
            table.add_row(*map(plain, row))
        Console(emoji=False).print(table)
        return
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
    for row in [header, *rows]:
        click.echo("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())


@contextmanager
def progress_bar(total: int) -> Iterator[Callable[[str], None]]:
    """Show a progress bar on standard error if that is a terminal.

    The context manager gives a function, which shows the name passed to it and advances the bar, except for the
    progress of a search.
    """
    console = Console(stderr=True, emoji=False)
    bar = bars.Progress(
        bars.TextColumn("{task.description}"),
        bars.BarColumn(),
        bars.MofNCompleteColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    with bar:
        task = bar.add_task("", total=total)
        yield lambda name: bar.update(task, advance=not name.startswith(BEST), description=name)


@contextmanager
def searching(show: Callable[[str], None] = lambda name: None) -> Iterator[None]:
    """Let Ctrl-C end searches with their best results so far, and report it; `show` is called with their progress."""
    with interruptible(), reporting(show):
        yield
        if is_interrupted():
            click.echo("interrupted: kept the best results so far; cheaper ones may exist", err=True)
