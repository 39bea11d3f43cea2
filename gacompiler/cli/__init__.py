"""The command line: ``gac``."""

from __future__ import annotations

import click

from .. import __version__
from . import caching, checking, generating, packaging, showing, starting
from .framework import Commands, examples


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=examples(
        "gac new my_kernels          write a starter spec",
        "gac generate my_kernels.py  write my_kernels.py, .c and .h into out/, and build the C",
        "gac show my_kernels.py:move_point",
    ),
)
@click.version_option(__version__)
def main() -> None:
    """Compile definitions in geometric algebra to specialised kernels that are proved correct."""


for _command in (
    generating.generate,
    generating.build,
    checking.check,
    showing.show,
    showing.cost,
    checking.verify,
    showing.list_,
    generating.robot,
    packaging.package,
    starting.new,
    starting.record,
    showing.classify,
    caching.cache,
):
    main.add_command(_command)
