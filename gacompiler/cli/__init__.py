"""The command line: ``gac``."""

from __future__ import annotations

import click

from .. import __version__
from .framework import Commands, examples

COMMANDS = {
    "build": ("generating", "Compile the C of generated modules."),
    "cache": ("caching", "Show or clear the cache of compiled kernels."),
    "check": ("checking", "Check that generated/ is what its specs give."),
    "classify": ("showing", "Find the matrix algebra isomorphic to G(P, Q, R)."),
    "cost": ("showing", "Count the operations of each kernel."),
    "generate": ("generating", "Write a module (.py, .pyi, .c, .h) for each spec."),
    "list": ("showing", "List algebras, modules, kernels or layouts."),
    "new": ("starting", "Write a commented starter spec."),
    "package": ("packaging", "Build a wheel of generated modules."),
    "record": ("starting", "Write a spec of what a program computes."),
    "robot": ("generating", "Write a module (.py, .pyi, .c, .h) for one robot."),
    "show": ("showing", "Show how a kernel is compiled, stage by stage."),
    "verify": ("checking", "Prove that generated files compute their specs."),
}
"""The module of each command, and what the command does."""


@click.group(
    cls=Commands,
    modules=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=examples(
        "gac new my_kernels          write a starter spec",
        "gac generate my_kernels.py  write my_kernels.py, .c and .h into out/, and build the C",
        "gac show my_kernels.py:move         how it was compiled",
    ),
)
@click.version_option(__version__)
def main() -> None:
    """Compile definitions in geometric algebra to specialised kernels that are proved correct."""
