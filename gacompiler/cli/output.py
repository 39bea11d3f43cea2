"""What commands print: paths, tables, progress bars."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click
from rich import progress as bars
from rich.console import Console
from rich.table import Table


def near(path: Path) -> str:
    """A path relative to the working folder."""
    return os.path.relpath(path) if path.is_absolute() else str(path)


def plain(text: str) -> str:
    """A text without markup, for `rich`."""
    return text.replace("[", r"\[")


def print_table(header: list[str], rows: list[list[str]]) -> None:
    """A coloured table on a terminal, aligned plain text elsewhere."""
    if Console().is_terminal:
        table = Table(*header, header_style="bold cyan")
        for row in rows:
            table.add_row(*map(plain, row))
        Console().print(table)
        return
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
    for row in [header, *rows]:
        click.echo("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())


@contextmanager
def progress_bar(total: int) -> Iterator[Callable[[str], None]]:
    """A bar on standard error when that is a terminal, nothing otherwise; call what it gives with each name."""
    console = Console(stderr=True)
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
        yield lambda name: bar.update(task, advance=1, description=name)
