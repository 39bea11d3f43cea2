"""Features common to all commands: loading on demand, examples in help texts, ``--debug``, and errors on one line."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Mapping
from difflib import get_close_matches
from importlib import import_module
from typing import Any

import click

from ..errors import GacError

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
    """The group of all commands, whose modules are imported when one of their commands is needed.

    It accepts ``--debug`` before the name of a command too. An error raised by the package is printed on one line, and
    the exit status is 1.

    Parameters
    ----------
    modules : mapping of str to (str, str)
        The module, beside this one, and the first line of the help text of each command.
    """

    def __init__(self, *arguments: Any, modules: Mapping[str, tuple[str, str]], **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.params.append(_debug_option())
        self._modules = modules

    def list_commands(self, context: click.Context) -> list[str]:
        """Return the names of all commands, sorted."""
        return sorted(self._modules)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """Import the module of a command, and return the command."""
        if name in self._modules:
            module = import_module(f".{self._modules[name][0]}", __package__)
            return next(c for c in vars(module).values() if isinstance(c, click.Command) and c.name == name)
        return None

    def resolve_command(
        self, context: click.Context, arguments: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find a command; the error for an unknown one suggests the closest name."""
        try:
            return super().resolve_command(context, arguments)
        except click.UsageError as error:
            near = get_close_matches(arguments[0], self._modules, n=1)
            if not near:
                raise
            raise click.UsageError(f"{error.message} Did you mean '{near[0]}'?", context) from None

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write what each command does, without importing their modules."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, self._modules[name][1]) for name in self.list_commands(context)])

    def invoke(self, context: click.Context) -> Any:
        """Run a command and report errors of the package."""
        try:
            return super().invoke(context)
        except GacError as error:
            if context.meta.get(_DEBUG):
                traceback.print_exception(error)
            from rich.console import Console

            from .output import plain

            console = Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)
            console.print(f"[red]gac: error:[/] {plain(str(error))}")
            sys.exit(1)


def command(*lines: str, name: str | None = None) -> Any:
    """Declare a command; `lines` are the examples shown in its help text."""
    return click.command(name, cls=Command, epilog=examples(*lines))


def examples(*lines: str) -> str:
    """Format examples for the end of a help text."""
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)
