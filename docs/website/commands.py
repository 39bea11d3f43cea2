"""Write the reference of the command line from its click commands."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator

import click

from gacompiler.cli import main

from .markdown import code, table

PROGRAM = "gac"


def page() -> str:
    """Return the page: common help first, followed by every command with its options and examples."""
    root = click.Context(main, info_name=PROGRAM)
    parts = [f"# The command {PROGRAM}\n", *_command(main, root)]
    for name in main.list_commands(root):
        command = main.get_command(root, name)
        assert command is not None
        parts += [f"## {PROGRAM} {name}\n", *_command(command, click.Context(command, info_name=name, parent=root))]
    return "\n".join(parts)


def _command(command: click.Command, context: click.Context) -> Iterator[str]:
    """Yield the parts of a command: usage, description, arguments and options, examples."""
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    yield f"```text\n{usage}\n```\n"
    yield from _paragraphs(command.help or "")
    rows = [_option(record) for parameter in command.get_params(context) if (record := _record(parameter, context))]
    yield table(("option", "description"), rows)
    examples = (command.epilog or "").partition("Examples:\n")[2]
    if examples:
        yield f"```text\n{inspect.cleandoc(examples)}\n```\n"


def _record(parameter: click.Parameter, context: click.Context) -> tuple[str, str] | None:
    return parameter.get_help_record(context) if isinstance(parameter, click.Option) else None


def _option(record: tuple[str, str]) -> tuple[str, str]:
    names, about = record
    return ", ".join(map(code, names.split(", "))), _escaped(about)


def _paragraphs(text: str) -> Iterator[str]:
    """Yield the paragraphs of a help text; paragraphs that must not be wrapped become code blocks."""
    for paragraph in inspect.cleandoc(text).split("\n\n"):
        kept, mark, lines = paragraph.partition("\b\n")
        yield f"```text\n{lines}\n```\n" if mark and not kept else f"{_escaped(paragraph)}\n"


def _escaped(text: str) -> str:
    """Escape the text of a help page for Markdown, except backticks around code."""
    parts = re.split(r"(`[^`]+`)", text)
    return "".join(part if part.startswith("`") else re.sub(r"([*_\[\]<>$\\])", r"\\\1", part) for part in parts)
