"""Features common to all commands: examples in help texts, ``--debug``, errors on one line, and shared options."""

from __future__ import annotations

import sys
import traceback
from typing import Any

import click
from rich.console import Console

from ..backends.build import processors
from ..errors import GacError
from ..generation.cache import Cache, open_cache
from ..ir.cost_models import COUNTS, MODELS
from ..passes.effort import DEFAULT, LEVELS
from .output import plain

_DEBUG = "gacompiler.debug"
"""Key in the root context that records whether ``--debug`` was given, before or after a command's name."""


def _wants_traceback(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted:
        context.find_root().meta[_DEBUG] = True


def _debug_option() -> click.Option:
    about = "Print the traceback when an error occurs."
    return click.Option(["--debug"], is_flag=True, expose_value=False, callback=_wants_traceback, help=about)


class Command(click.Command):
    """A command with the option ``--debug``."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.params.append(_debug_option())


class Commands(click.Group):
    """The group of all commands.

    It accepts ``--debug`` before the name of a command too. An error raised by the package is printed on one line, and
    the exit status is 1.
    """

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.params.append(_debug_option())

    def invoke(self, context: click.Context) -> Any:
        """Run a command and report errors of the package."""
        try:
            return super().invoke(context)
        except GacError as error:
            if context.meta.get(_DEBUG):
                traceback.print_exception(error)
            Console(stderr=True, highlight=False, soft_wrap=True).print(f"[red]gac: error:[/] {plain(str(error))}")
            sys.exit(1)


def command(*lines: str, name: str | None = None) -> Any:
    """Declare a command; `lines` are the examples shown in its help text."""
    return click.command(name, cls=Command, epilog=examples(*lines))


def examples(*lines: str) -> str:
    """Format examples for the end of a help text."""
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)


algebra_option = click.option(
    "--algebra",
    "algebra",
    default=None,
    help="Algebra of scripts (.clu): cga, 3dpga, ..., or a folder that contains definition.csv.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
jobs_option = click.option(
    "-j",
    "--jobs",
    type=click.IntRange(min=1),
    default=processors,
    help="Number of modules to compile in parallel [default: the number of processors].",
)

effort_option = click.option(
    "--effort",
    type=click.IntRange(0, len(LEVELS) - 1),
    default=DEFAULT,
    show_default=True,
    help="Work spent on reducing operations: 0 keeps the author's structure, 3 may take hours.",
)

model_option = click.option(
    "--cost",
    "model",
    type=click.Choice(list(MODELS)),
    default=COUNTS.name,
    show_default=True,
    help="What is minimised: operations, cycles of one element, fused multiply-adds, or the size of the code "
    "(see `gac cost --explain`).",
)


def _names(_: click.Context, __: click.Parameter, texts: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name.strip() for text in texts for name in text.split(",") if name.strip())


only_option = click.option(
    "--only",
    "only",
    multiple=True,
    metavar="NAMES",
    callback=_names,
    help="Only the kernels of these names, separated by commas; may be repeated.",
)


def _opened(_: click.Context, __: click.Parameter, unwanted: bool) -> Cache | None:
    return None if unwanted else open_cache()


cache_option = click.option(
    "--no-cache",
    "cache",
    is_flag=True,
    callback=_opened,
    help="Compile every kernel from scratch instead of using cached results (see `gac cache`).",
)
"""Passes the user's cache to the command, or None."""
